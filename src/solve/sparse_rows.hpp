// A sparse matrix, row by row.
#pragma once

#include "base/config.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

/// A square matrix of numbers or blocks: row i has the entries first[i] <= k < first[i + 1], in any order, each column at most once.
template <class T>
struct SparseRows {
    std::vector<std::ptrdiff_t> first{0};
    std::vector<int> column;
    std::vector<T> value;

    std::ptrdiff_t size() const { return std::ssize(first) - 1; }

    /// f(column, value) for the entries of row i.
    template <class F>
    ORDO_FLAT void for_each(std::ptrdiff_t i, F&& f) const
    {
        for (std::ptrdiff_t k = first[i]; k < first[i + 1]; ++k) f(column[k], value[k]);
    }
};

}  // namespace ordo
