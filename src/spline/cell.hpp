// Splines in one cell: evaluation at its particles and Gauss points, and the transposed sums, for projection `spline-fit`.
#pragma once

#include "base/index.hpp"
#include "base/lanes.hpp"
#include "spline/axis.hpp"

#include <cstddef>

namespace ordo {

/// The functions of degree P that do not vanish in a cell, and a copy of their records.
template <int D, int P>
struct SplineCell {
    static constexpr int width = P + 1, size = power_of(width, D);

    Lanes records[size];

    SplineCell(const SplineSpace<D>& space, const Index<D>& cell)
    {
        std::ptrdiff_t stride = 1;
        for (int a = 0; a < D; ++a) {
            const int first = space.axis[a].span_of(cell[a]);
            for (int j = 0; j < width; ++j) offset_[a][j] = stride * space.axis[a].wrapped(first + j);
            stride *= space.axis[a].count();
        }
    }

    void load(const Lanes* from)
    {
        for_each([&](int k, std::ptrdiff_t node) { records[k] = from[node]; });
    }
    void clear()
    {
        for (Lanes& r : records) r = Lanes(0.0);
    }
    void add_to(Lanes* to) const
    {
        for_each([&](int k, std::ptrdiff_t node) { to[node] += records[k]; });
    }

    /// The sum of weights times records; `w` has the weights of one axis after another.
    ORDO_FLAT Lanes collect(const double* w) const
    {
        if constexpr (D == 1) return along_x(records, w);
        Lanes total(0.0);
        if constexpr (D == 2)
            for (int j = 0; j < width; ++j) total += along_x(records + j * width, w) * w[width + j];
        if constexpr (D == 3)
            for (int k = 0; k < width; ++k) {
                Lanes plane(0.0);
                for (int j = 0; j < width; ++j) plane += along_x(records + (k * width + j) * width, w) * w[width + j];
                total += plane * w[2 * width + k];
            }
        return total;
    }

    /// Adds weights times `value` to the records.
    ORDO_FLAT void spread(const double* w, const Lanes& value)
    {
        if constexpr (D == 1) add_along_x(records, w, value);
        if constexpr (D == 2)
            for (int j = 0; j < width; ++j) add_along_x(records + j * width, w, value * w[width + j]);
        if constexpr (D == 3)
            for (int k = 0; k < width; ++k) {
                const Lanes plane = value * w[2 * width + k];
                for (int j = 0; j < width; ++j) add_along_x(records + (k * width + j) * width, w, plane * w[width + j]);
            }
    }

    template <class F>
    ORDO_FLAT void for_each(F&& f) const
    {
        int number = 0;
        for (int k = 0; k < (D > 2 ? width : 1); ++k)
            for (int j = 0; j < (D > 1 ? width : 1); ++j) {
                const std::ptrdiff_t line = (D > 2 ? offset_[D - 1][k] : 0) + (D > 1 ? offset_[D > 1][j] : 0);
                for (int i = 0; i < width; ++i) f(number++, line + offset_[0][i]);
            }
    }

  private:
    ORDO_FLAT static Lanes along_x(const Lanes* r, const double* w)
    {
        Lanes sum = r[0] * w[0];
        for (int i = 1; i < width; ++i) sum += r[i] * w[i];
        return sum;
    }
    ORDO_FLAT static void add_along_x(Lanes* r, const double* w, const Lanes& value)
    {
        for (int i = 0; i < width; ++i) r[i] += value * w[i];
    }

    std::ptrdiff_t offset_[D][width];
};

inline constexpr int kMaxGauss = SplineAxis::max_degree + 1;

/// Applies B to one axis of a block of records: to[o][g][i] = sum_j B[g][j] from[o][j][i], or the same with B transposed.
template <bool Transposed>
ORDO_FLAT inline void contract(const double* B, int points, int width, int inner, int outer, const Lanes* from, Lanes* to)
{
    const int rows = Transposed ? width : points, columns = Transposed ? points : width;
    for (int o = 0; o < outer; ++o)
        for (int g = 0; g < rows; ++g)
            for (int i = 0; i < inner; ++i) {
                const Lanes* line = from + o * columns * inner + i;
                Lanes sum(0.0);
                for (int j = 0; j < columns; ++j) sum += line[j * inner] * (Transposed ? B[j * width + g] : B[g * width + j]);
                to[(o * rows + g) * inner + i] = sum;
            }
}

/// Evaluates the functions of a cell at its Gauss points, axis by axis, and applies the transposed operator.
template <int D, int P>
struct CellQuadrature {
    static constexpr int width = P + 1, most = power_of(kMaxGauss, D);

    const double* B[D];  ///< values of the cell's functions along an axis, [point][function]
    int points;          ///< along an axis
    Lanes values[most];  ///< at Gauss points, the first axis fastest

    CellQuadrature(const Vec<D, const double*>& rows, int points_) : points(points_)
    {
        for (int a = 0; a < D; ++a) B[a] = rows[a];
    }
    int count() const { return power(points, D); }

    void evaluate(const SplineCell<D, P>& cell)
    {
        if constexpr (D == 1) {
            contract<false>(B[0], points, width, 1, 1, cell.records, values);
        } else if constexpr (D == 2) {
            contract<false>(B[0], points, width, 1, width, cell.records, first_);
            contract<false>(B[1], points, width, points, 1, first_, values);
        } else {
            contract<false>(B[0], points, width, 1, width * width, cell.records, values);
            contract<false>(B[1], points, width, points, width, values, first_);
            contract<false>(B[2], points, width, points * points, 1, first_, values);
        }
    }
    void integrate(SplineCell<D, P>& cell)
    {
        if constexpr (D == 1) {
            contract<true>(B[0], points, width, 1, 1, values, cell.records);
        } else if constexpr (D == 2) {
            contract<true>(B[1], points, width, points, 1, values, first_);
            contract<true>(B[0], points, width, 1, width, first_, cell.records);
        } else {
            contract<true>(B[2], points, width, points * points, 1, values, first_);
            contract<true>(B[1], points, width, points, width, first_, values);
            contract<true>(B[0], points, width, 1, width * width, values, cell.records);
        }
    }

  private:
    static int power(int n, int d) { return d == 0 ? 1 : n * power(n, d - 1); }
    Lanes first_[most];
};

}  // namespace ordo
