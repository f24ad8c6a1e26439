// An incomplete Cholesky factor without fill, as a preconditioner (Meijerink & van der Vorst 1977, Math. Comp. 31, 148).
#pragma once

#include "base/error.hpp"
#include "base/lanes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace ordo {

/// S L L^T S is about A, a symmetric positive definite matrix: S is the root of A's diagonal, L has the entries of A's lower
/// triangle. Rows are made of runs of neighbouring columns, which keep the products of rows in registers.
class IncompleteCholesky {
  public:
    /// A column and its entry.
    using Entry = std::pair<int, double>;

    /// Adds the next row: its entries left of the diagonal, in any order, and the diagonal. Entries of one column are added up.
    void add_row(std::vector<Entry>& left, double diagonal)
    {
        std::sort(left.begin(), left.end(), [](const Entry& a, const Entry& b) { return a.first < b.first; });
        std::ptrdiff_t last = 0;  // the entry before
        for (std::size_t k = 0; k < left.size(); ++k) {
            const auto [column, value] = left[k];
            if (k > 0 && column == left[k - 1].first) {
                values_[last] += value;
                continue;
            }
            const bool continues = std::ssize(runs_) > first_.back() && runs_.back().column + runs_.back().length == column;
            if (!continues) runs_.push_back({column, 0, std::ssize(values_)});
            Run& run = runs_.back();
            if (run.length % kStep == 0) values_.insert(values_.end(), kStep, 0.0);
            last          = run.values + run.length++;
            values_[last] = value;
        }
        first_.push_back(std::ssize(runs_));
        scale_.push_back(1 / std::sqrt(diagonal));
    }

    int size() const { return static_cast<int>(scale_.size()); }

    /// Factors the matrix; call it after the last row. Where a pivot is not positive, all pivots are raised by a share, which grows
    /// until none is. Throws NumericalError if entries are not finite.
    void factor()
    {
        for (int i = 0; i < size(); ++i)
            for_each_run(i, [&](const Run& run) {
                for (int k = 0; k < run.length; ++k) values_[run.values + k] *= scale_[i] * scale_[run.column + k];
            });
        const std::vector<double> whole = values_;
        double raised                   = 0.0;
        while (!try_factor(1.0 + raised)) {
            values_ = whole;
            raised  = raised > 0 ? 4 * raised : 1e-3;
            if (raised > size() + 1.0)
                throw NumericalError("a matrix has entries that are not finite");  // all sizes are at most 1
        }
    }

    /// z = S^-1 (L L^T)^-1 S^-1 r, lane by lane.
    void solve(const Lanes* r, Lanes* z) const
    {
        for (int i = 0; i < size(); ++i) {
            Lanes sum = r[i] * scale_[i];
            for_each_run(i, [&](const Run& run) {
                const double* const value = values_.data() + run.values;
                for (int k = 0; k < run.length; ++k) sum -= z[run.column + k] * value[k];
            });
            z[i] = sum * inverse_[i];
        }
        for (int i = size() - 1; i >= 0; --i) {
            const Lanes of = z[i] * inverse_[i];
            for_each_run(i, [&](const Run& run) {
                const double* const value = values_.data() + run.values;
                for (int k = 0; k < run.length; ++k) z[run.column + k] -= of * value[k];
            });
            z[i] = of * scale_[i];
        }
    }

  private:
    static constexpr int kStep = 4;  ///< rows have room for whole steps, filled up with zeros
    struct Run {
        int column, length;
        std::ptrdiff_t values;
    };

    template <class F>
    ORDO_FLAT void for_each_run(int row, const F& f) const
    {
        for (std::ptrdiff_t k = first_[row]; k < first_[row + 1]; ++k) f(runs_[k]);
    }

    /// The sum of row k of L times the numbers of all columns.
    ORDO_FLAT double product(int row, const double* of) const
    {
        double sums[kStep] = {};
        for_each_run(row, [&](const Run& run) {
            const double *const value = values_.data() + run.values, *const x = of + run.column;
            for (int k = 0; k < run.length; k += kStep)
                for (int j = 0; j < kStep; ++j) sums[j] += value[k + j] * x[k + j];
        });
        return (sums[0] + sums[1]) + (sums[2] + sums[3]);
    }

    /// False if a pivot is not positive.
    bool try_factor(double diagonal)
    {
        inverse_.assign(size(), 0.0);
        std::vector<double> row(size() + kStep, 0.0);
        for (int i = 0; i < size(); ++i) {
            for_each_run(i,
                         [&](const Run& run) { std::copy_n(values_.data() + run.values, run.length, row.data() + run.column); });
            double pivot = diagonal;
            for_each_run(i, [&](const Run& run) {
                for (int k = run.column; k < run.column + run.length; ++k) {
                    row[k] = (row[k] - product(k, row.data())) * inverse_[k];
                    pivot -= row[k] * row[k];
                }
            });
            for_each_run(i, [&](const Run& run) {
                std::copy_n(row.data() + run.column, run.length, values_.data() + run.values);
                std::fill_n(row.data() + run.column, run.length, 0.0);
            });
            if (!(pivot > std::max(1e-5, 1e-3 * (diagonal - 1.0)))) return false;
            inverse_[i] = 1 / std::sqrt(pivot);
        }
        return true;
    }

    std::vector<std::ptrdiff_t> first_{0};  ///< run of each row, then the end
    std::vector<Run> runs_;
    std::vector<double> values_;
    std::vector<double> scale_, inverse_;  ///< the inverse roots of A's diagonal; the inverses of L's
};

}  // namespace ordo
