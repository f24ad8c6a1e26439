// Matrices between two spline spaces of one axis, and their tensor products.
#pragma once

#include "base/array.hpp"
#include "base/index.hpp"
#include "base/lanes.hpp"
#include "base/parallel.hpp"

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace ordo {

/// A banded matrix from the functions of one spline space to those of another, or to points: each row has entries for a few
/// consecutive functions.
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

    /// to = this * from for one line; entries of both are `stride` apart.
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

/// f(first, stride) for each line of an array along an axis, in parallel; `first` is the index of its first entry.
template <int D, class F>
void for_each_line(const Index<D>& counts, int axis, F&& f)
{
    std::ptrdiff_t inner = 1, outer = 1;
    for (int a = 0; a < axis; ++a) inner *= counts[a];
    for (int a = axis + 1; a < D; ++a) outer *= counts[a];
    const std::ptrdiff_t length = counts[axis];
    // One thread handles the `inner` lines that are adjacent in memory; for axis 0 that is one line.
    parallel_for(
        outer,
        [&](std::ptrdiff_t o) {
            for (std::ptrdiff_t i = 0; i < inner; ++i) f(o * inner * length + i, inner);
        },
        outer > 1 && inner * outer * length > 4096);
}

/// to = (A_1 (x) ... (x) A_D) from, one axis after another; `between` has the intermediate results.
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
