// Banded matrices along one axis: symmetric ones, factored, and rectangular ones between two spaces of splines.
#pragma once

#include "base/array.hpp"
#include "base/lanes.hpp"
#include "base/parallel.hpp"
#include "grid/spline_axis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace ordo {

/// A symmetric positive definite matrix in which rows and columns further apart than a band do not meet, and its factors L D L^T.
/// On a periodic axis the last rows are next to the first: rows are then taken from both ends in turn, which doubles the band.
/// T: double, or Lanes for eight matrices at once.
template <class T>
class Banded {
  public:
    Banded() = default;
    Banded(int size, int band, bool periodic)
        : size_(size),
          band_(std::min(periodic ? 2 * band : band, size - 1)),
          periodic_(periodic),
          rows_(size * (band_ + 1), T(0.0))
    {}

    /// Adds to an entry; an entry and the one across the diagonal are the same, of which the one above is ignored.
    void add(int i, int j, const T& value)
    {
        const int row = place(i), column = place(j);
        if (column <= row) at(row, column) += value;
    }
    const T& diagonal(int i) const { return rows_[place(i) * (band_ + 1) + band_]; }

    /// Replaces the matrix by its factors. Returns the first row that the rows before it determine to within `tolerance` of its
    /// diagonal, in any of the lanes; -1 where there is none.
    int factor(double tolerance)
    {
        int singular = -1;
        for (int i = 0; i < size_; ++i) {
            const int first = std::max(0, i - band_);
            const T whole   = at(i, i);
            for (int j = first; j < i; ++j) {
                T sum = at(i, j);
                for (int k = std::max(first, j - band_); k < j; ++k) sum -= at(i, k) * at(j, k);  // L D of row i, L of row j
                at(i, j) = sum;
            }
            for (int j = first; j < i; ++j) {  // row i of L D becomes one of L
                const T product = at(i, j);
                at(i, j)        = product * inverse(j);
                at(i, i) -= product * at(i, j);
            }
            if (singular < 0 && is_small(at(i, i) - tolerance * whole)) singular = origin(i);
            at(i, i) = T(1.0) / at(i, i);
        }
        return singular;
    }

    /// Solves for a line of right-hand sides, a stride apart, by the factors.
    template <class U>
    void solve(U* x, std::ptrdiff_t stride) const
    {
        if (periodic_)
            substitute(x, [&](int row) { return origin(row) * stride; });
        else
            substitute(x, [&](int row) { return row * stride; });
    }

  private:
    int place(int i) const
    {
        if (!periodic_) return i;
        return i < (size_ + 1) / 2 ? 2 * i : 2 * (size_ - 1 - i) + 1;
    }
    int origin(int row) const
    {
        if (!periodic_) return row;
        return row % 2 == 0 ? row / 2 : size_ - 1 - row / 2;
    }
    T& at(int row, int column) { return rows_[row * (band_ + 1) + band_ - (row - column)]; }
    const T& at(int row, int column) const { return rows_[row * (band_ + 1) + band_ - (row - column)]; }
    const T& inverse(int row) const { return at(row, row); }  ///< of D, once it is factored

    static bool is_small(double d) { return !(d > 0); }
    static bool is_small(const Lanes& d)
    {
        for (int k = 0; k < 8; ++k)
            if (!(d[k] > 0)) return true;
        return false;
    }

    template <class U, class Place>
    void substitute(U* x, const Place& place) const
    {
        for (int i = 0; i < size_; ++i) {
            U sum = x[place(i)];
            for (int j = std::max(0, i - band_); j < i; ++j) sum -= x[place(j)] * at(i, j);
            x[place(i)] = sum;
        }
        for (int i = size_ - 1; i >= 0; --i) {
            U sum = x[place(i)] * inverse(i);
            for (int j = i + 1; j <= std::min(size_ - 1, i + band_); ++j) sum -= x[place(j)] * at(j, i);
            x[place(i)] = sum;
        }
    }

    int size_ = 0, band_ = 0;
    bool periodic_ = false;
    std::vector<T> rows_;
};

/// A matrix from the functions of one axis to those of another, or to places: each row has entries for some functions that
/// follow each other.
class AxisMatrix {
  public:
    AxisMatrix() = default;
    AxisMatrix(int rows, int columns) : columns_(columns), entries_(rows) {}

    int rows() const { return static_cast<int>(entries_.size()); }
    int columns() const { return columns_; }

    void add(int row, int column, double value)
    {
        for (auto& [k, sum] : entries_[row])
            if (k == column) {
                sum += value;
                return;
            }
        entries_[row].emplace_back(column, value);
    }

    AxisMatrix transposed() const
    {
        AxisMatrix r(columns_, rows());
        for (int i = 0; i < rows(); ++i)
            for (const auto& [k, value] : entries_[i]) r.add(k, i, value);
        return r;
    }

    /// to = this * from for a line; both a stride apart.
    template <class U>
    void multiply(const U* from, U* to, std::ptrdiff_t stride) const
    {
        for (const auto& row : entries_) {
            U sum = U(0.0);
            for (const auto& [k, value] : row) sum += from[k * stride] * value;
            *to = sum;
            to += stride;
        }
    }

  private:
    int columns_ = 0;
    std::vector<std::vector<std::pair<int, double>>> entries_;
};

/// f(first, stride) for each line of an array along an axis, lines in parallel; `first` is where it begins.
template <int D, class F>
void for_each_line(const Index<D>& counts, int axis, F&& f)
{
    std::ptrdiff_t inner = 1, outer = 1;
    for (int a = 0; a < axis; ++a) inner *= counts[a];
    for (int a = axis + 1; a < D; ++a) outer *= counts[a];
    const std::ptrdiff_t length = counts[axis];
    // Neighbours in memory by one thread: lines of axis 0 apart, of others a run of `inner` beside each other.
    parallel_for(
        outer,
        [&](std::ptrdiff_t o) {
            for (std::ptrdiff_t i = 0; i < inner; ++i) f(o * inner * length + i, inner);
        },
        outer > 1 && inner * outer * length > 4096);
}

/// to = A from along the axes one after another.
template <int D>
void along_axes(const std::array<const AxisMatrix*, D>& matrices, std::array<Array<Lanes>, 2>& between, const Lanes* from,
                Lanes* to)
{
    Index<D> counts{};
    for (int a = 0; a < D; ++a) counts[a] = matrices[a]->columns();
    for (int a = 0; a < D; ++a) {
        const Index<D> before = counts;
        counts[a]             = matrices[a]->rows();
        std::size_t size      = 1;
        for (int b = 0; b < D; ++b) size *= counts[b];
        keep_room(between[a % 2], size);
        Lanes* const next       = a == D - 1 ? to : between[a % 2].data();
        const std::ptrdiff_t in = before[a], out = counts[a];
        for_each_line<D>(before, a, [&](std::ptrdiff_t first, std::ptrdiff_t stride) {
            const std::ptrdiff_t outer = first / (stride * in), inner = first % stride;
            matrices[a]->multiply(from + first, next + outer * stride * out + inner, stride);
        });
        from = next;
    }
}

}  // namespace ordo
