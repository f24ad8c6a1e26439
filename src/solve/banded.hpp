// A banded symmetric matrix and its factors.
#pragma once

#include "base/lanes.hpp"

#include <algorithm>
#include <cstddef>
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

}  // namespace ordo
