// A sparse matrix, row by row.
#pragma once

#include <cstddef>
#include <vector>

namespace ordo {

/// A square matrix: row i has the entries first[i] <= k < first[i + 1], in any order, each column at most once.
struct SparseRows {
    std::vector<std::ptrdiff_t> first;
    std::vector<int> column;
    std::vector<double> value;
};

}  // namespace ordo
