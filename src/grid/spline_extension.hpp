// Splines on a part of the grid: functions that see too little of it are no unknowns of their own but go on as the polynomials of
// the nearest whole cell, extended B-splines (Hollig, Reif & Wipper 2001, SIAM Journal on Numerical Analysis 39, 442). Spaces stay
// as accurate as on whole grids, and no cut cell, however small, makes a system singular.
#pragma once

#include "base/gauss_rule.hpp"
#include "grid/cut_rule.hpp"
#include "grid/spline_axis.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace ordo {

/// The coefficients that splines which are one polynomial have, for function `of`, from those of the functions of a span: the
/// blossom of the polynomial at the function's knots, by de Boor's algorithm (Ramshaw 1989).
template <int P>
void continue_from_span(const SplineAxis& axis, int span, int of, double (&weights)[P + 1])
{
    double d[P + 1][P + 1] = {};  // coefficient j, as made of those of the span
    for (int j = 0; j <= P; ++j) d[j][j] = 1.0;
    for (int r = 1; r <= P; ++r) {
        const double u = axis.knot(of - P + r);
        for (int j = P; j >= r; --j) {
            const int i        = span + j;
            const double left  = axis.knot(i - P);
            const double alpha = (u - left) / (axis.knot(i + 1 - r) - left);
            for (int k = 0; k <= P; ++k) d[j][k] = (1 - alpha) * d[j - 1][k] + alpha * d[j][k];
        }
    }
    for (int k = 0; k <= P; ++k) weights[k] = d[P][k];
}

/// Which functions of a space are unknowns, and how those that only see parts of cells follow from them: c = E c_inner.
template <int D>
class SplineExtension {
  public:
    SplineExtension() = default;
    /// `cover` of all cells, the first axis fastest.
    SplineExtension(const SplineSpace<D>& space, const Index<D>& cells, const std::vector<Cover>& cover)
        : is_inner_(space.count(), 0)
    {
        std::vector<char> is_seen(space.count(), 0);
        std::vector<double> integral(space.count(), 0.0);  // over whole cells
        Vec<D, std::vector<double>> of_cells{};
        for (int a = 0; a < D; ++a) of_cells[a] = integrals_of_cells(space.axis[a]);
        auto for_each_seen_cell = [&](const auto& f) {
            std::size_t number = 0;
            IndexBox<D>{{}, cells}.for_each([&](const Index<D>& cell) {
                if (cover[number] != Cover::none) f(cell, cover[number]);
                ++number;
            });
        };
        for_each_seen_cell([&](const Index<D>& cell, Cover here) {
            for_each_function(space, cell, [&](const Index<D>& k, std::size_t function) {
                is_seen[function] = 1;
                double part       = here == Cover::all ? 1.0 : 0.0;
                for (int a = 0; a < D; ++a)
                    part *= of_cells[a][cell[a] * (space.axis[a].degree + 1) + k[a] - space.axis[a].span_of(cell[a])];
                integral[function] += part;
            });
        });
        for (std::size_t i = 0; i < space.count(); ++i) is_inner_[i] = integral[i] >= kLeastPart * space.integral(i);
        std::vector<char> is_core(cover.size(), 0);  // whole, and all of its functions are unknowns
        for_each_seen_cell([&](const Index<D>& cell, Cover here) {
            char& r = is_core[number_of(cell, cells)];
            r       = here == Cover::all;
            for_each_function(space, cell, [&](const Index<D>&, std::size_t function) { r = r && is_inner_[function]; });
        });
        // The one nearest to an outer function, among those around it first.
        std::vector<double> distance(space.count(), std::numeric_limits<double>::infinity());
        std::vector<Index<D>> nearest(space.count());
        bool is_known = true;
        IndexBox<D>{{}, space.counts()}.for_each([&](const Index<D>& k) {
            const std::size_t function = space.number(k);
            if (!is_seen[function] || is_inner_[function]) return;
            const Vec<D> center = space.center(function);
            Index<D> first{};
            for (int a = 0; a < D; ++a) first[a] = static_cast<int>(center[a]);
            for (int reach = 1; distance[function] > reach && reach < 2 * cells_of_longest(cells); reach *= 2)
                IndexBox<D>::around(first, reach).for_each([&](const Index<D>& at) {
                    Index<D> cell = at;
                    for (int a = 0; a < D; ++a) {
                        cell[a] = place_in_period(space.axis[a], at[a]);
                        if (cell[a] < 0 || cell[a] >= cells[a]) return;
                    }
                    if (!is_core[number_of(cell, cells)]) return;
                    double square = 0.0;
                    for (int a = 0; a < D; ++a) square += (at[a] + 0.5 - center[a]) * (at[a] + 0.5 - center[a]);
                    if (square < distance[function] * distance[function]) {
                        distance[function] = std::sqrt(square);
                        nearest[function]  = at;
                    }
                });
            is_known = is_known && distance[function] < std::numeric_limits<double>::infinity();
            if (is_known) add_row(space, k, nearest[function]);
        });
        if (!is_known) is_inner_.clear();
    }

    /// Whether there is a whole cell that outer functions can go on from; without one nothing else may be asked.
    bool is_possible() const { return !is_inner_.empty(); }

    /// Leaves inner values, others become 0.
    template <class T>
    void keep_inner(T* values) const
    {
        for (std::size_t i = 0; i < is_inner_.size(); ++i)
            if (!is_inner_[i]) values[i] = T(0.0);
    }
    bool is_inner(std::size_t function) const { return is_inner_[function] != 0; }

    /// Outer coefficients from inner ones; those of functions that see nothing become 0.
    template <class T>
    void extend(T* c) const
    {
        keep_inner(c);
        for (const Row& row : rows_) {
            T sum(0.0);
            for (std::size_t k = row.begin; k < row.end; ++k) sum += c[entries_[k].function] * entries_[k].weight;
            c[row.function] = sum;
        }
    }
    /// The transposed: adds to inner sums what outer ones hold; all others become 0.
    template <class T>
    void gather(T* sums) const
    {
        for (const Row& row : rows_)
            for (std::size_t k = row.begin; k < row.end; ++k)
                sums[entries_[k].function] += sums[row.function] * entries_[k].weight;
        keep_inner(sums);
    }

  private:
    /// The part of a function's integral that whole cells must hold for it to be an unknown: with less, as at a corner of whole cells,
    /// particles hardly tell its coefficient.
    static constexpr double kLeastPart = 0.02;

    struct Entry {
        std::size_t function;
        double weight;
    };
    struct Row {
        std::size_t function, begin, end;  ///< of entries_
    };

    static std::size_t number_of(const Index<D>& cell, const Index<D>& cells)
    {
        std::size_t r = 0;
        for (int a = D - 1; a >= 0; --a) r = r * cells[a] + cell[a];
        return r;
    }
    /// Integrals over each cell of its functions along an axis.
    static std::vector<double> integrals_of_cells(const SplineAxis& axis)
    {
        std::vector<double> r;
        with_degree(axis.degree, [&]<int P>() {
            double w[P + 1], dw[P + 1];
            for (int cell = 0; cell < axis.cells; ++cell) {
                double sums[P + 1] = {};
                for (const auto& [at, weight] : gauss_rule(P / 2 + 1)) {
                    axis.row<P>(axis.span_of(cell), cell + at, w, dw);
                    for (int j = 0; j <= P; ++j) sums[j] += weight * w[j];
                }
                r.insert(r.end(), sums, sums + P + 1);
            }
        });
        return r;
    }
    static int place_in_period(const SplineAxis& axis, int k)
    {
        return axis.periodic ? ((k % axis.cells) + axis.cells) % axis.cells : k;
    }
    static int cells_of_longest(const Index<D>& cells)
    {
        int r = 1;
        for (int a = 0; a < D; ++a) r = larger(r, cells[a]);
        return r;
    }
    /// f(index along each axis, number) for the functions that do not vanish in a cell; indices beyond a period are not wrapped.
    template <class F>
    static void for_each_function(const SplineSpace<D>& space, const Index<D>& cell, const F& f)
    {
        Index<D> first{}, last{};
        for (int a = 0; a < D; ++a) {
            first[a] = space.axis[a].span_of(cell[a]);
            last[a]  = first[a] + space.axis[a].degree + 1;
        }
        IndexBox<D>{first, last}.for_each([&](const Index<D>& k) {
            Index<D> wrapped{};
            for (int a = 0; a < D; ++a) wrapped[a] = place_in_period(space.axis[a], k[a]);
            f(k, space.number(wrapped));
        });
    }
    void add_row(const SplineSpace<D>& space, const Index<D>& of, const Index<D>& cell)
    {
        Row row{space.number(of), entries_.size(), 0};
        with_degree(space.axis[0].degree, [&]<int P>() {
            double weights[D][P + 1];
            Index<D> first{};
            for (int a = 0; a < D; ++a) {
                first[a] = space.axis[a].span_of(cell[a]);
                continue_from_span<P>(space.axis[a], first[a], of[a], weights[a]);
            }
            for_each_function(space, cell, [&](const Index<D>& k, std::size_t function) {
                double weight = 1.0;
                for (int a = 0; a < D; ++a) weight *= weights[a][k[a] - first[a]];
                if (weight != 0) entries_.push_back({function, weight});
            });
        });
        row.end = entries_.size();
        rows_.push_back(row);
    }

    std::vector<char> is_inner_;
    std::vector<Row> rows_;  ///< of outer functions
    std::vector<Entry> entries_;
};

}  // namespace ordo
