// A sparse matrix of blocks between nodes that grows as entries are added.
#pragma once

#include "base/parallel.hpp"
#include "base/vec.hpp"
#include "solve/sparse_rows.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ordo {

/// A dense matrix between some rows: entry (D m + a, D n + b) couples component a of row[m] with component b of row[n].
struct Patch {
    std::vector<int> row;       ///< ascending
    std::vector<double> value;  ///< row by row
};

template <int D>
class BlockRows {
  public:
    /// All entries are zero then; those that were there stay in the pattern.
    void clear(std::size_t rows)
    {
        rows_.resize(rows);
        parallel_for_each(std::ssize(rows_),
                          [&](std::ptrdiff_t i) { std::fill(rows_[i].block.begin(), rows_[i].block.end(), Mat<D>{}); });
    }
    Mat<D>& at(int row, int column)
    {
        Row& r       = rows_[row];
        const auto k = std::lower_bound(r.column.begin(), r.column.end(), column) - r.column.begin();
        return r.block[r.place(static_cast<std::size_t>(k), column)];
    }
    /// Adds patches in parallel; each row takes them in their order.
    void add(const std::vector<Patch>& patches)
    {
        const std::ptrdiff_t parts = 8 * thread_count(), count = std::ssize(rows_);
        parallel_for(parts, [&](std::ptrdiff_t k) {
            const int begin = static_cast<int>(count * k / parts), end = static_cast<int>(count * (k + 1) / parts);
            for (const Patch& p : patches)
                for (auto r = std::lower_bound(p.row.begin(), p.row.end(), begin); r != p.row.end() && *r < end; ++r)
                    add_row(p, static_cast<std::size_t>(r - p.row.begin()));
        });
    }
    SparseRows<Mat<D>> matrix() const
    {
        SparseRows<Mat<D>> m;
        for (const Row& r : rows_) m.first.push_back(m.first.back() + std::ssize(r.column));
        m.column.resize(m.first.back());
        m.value.resize(m.first.back());
        parallel_for_each(std::ssize(rows_), [&](std::ptrdiff_t i) {
            std::copy(rows_[i].column.begin(), rows_[i].column.end(), m.column.begin() + m.first[i]);
            std::copy(rows_[i].block.begin(), rows_[i].block.end(), m.value.begin() + m.first[i]);
        });
        return m;
    }

  private:
    struct Row {
        std::vector<int> column;
        std::vector<Mat<D>> block;

        /// The place of a column that is at k or belongs before it.
        std::size_t place(std::size_t k, int of)
        {
            if (k == column.size() || column[k] != of) {
                column.insert(column.begin() + static_cast<std::ptrdiff_t>(k), of);
                block.insert(block.begin() + static_cast<std::ptrdiff_t>(k), Mat<D>{});
            }
            return k;
        }
    };
    void add_row(const Patch& p, std::size_t m)
    {
        Row& r                  = rows_[p.row[m]];
        const std::size_t width = D * p.row.size();
        std::size_t k           = 0;
        for (std::size_t n = 0; n < p.row.size(); ++n) {
            while (k < r.column.size() && r.column[k] < p.row[n]) ++k;
            Mat<D> change{};
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) change(a, b) = p.value[(D * m + a) * width + D * n + b];
            if (!(change == Mat<D>{})) r.block[r.place(k, p.row[n])] += change;  // zero: no particle has both nodes
        }
    }

    std::vector<Row> rows_;
};

}  // namespace ordo
