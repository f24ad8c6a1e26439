// The preconditioner for splines on bodies with free surfaces: an incomplete Cholesky factor of the matrix. It replaces the
// tensor-product preconditioner of full grids and needs 10 to 40 iterations, a diagonal 150 to 500.
#pragma once

#include "solve/incomplete_cholesky.hpp"
#include "spline/matrix.hpp"

#include <vector>

namespace ordo {

template <int D>
class CutFactor {
  public:
    /// Factors a matrix, for its last weight, over its active functions.
    explicit CutFactor(const SplineMatrix<D>& matrix) : functions_(functions_of(matrix))
    {
        std::vector<int> number(functions_.empty() ? 0 : functions_.back() + 1, -1);  // of a function among the active
        for (std::size_t k = 0; k < functions_.size(); ++k) number[functions_[k]] = static_cast<int>(k);
        std::vector<IncompleteCholesky::Entry> left;
        for (const std::ptrdiff_t i : functions_) {
            left.clear();
            double diagonal = 0.0;
            matrix.for_each_entry(i, [&](std::ptrdiff_t column, double value) {
                if (column == i)
                    diagonal += value;
                else if (column < i && value != 0.0)
                    left.emplace_back(number[column], value);
            });
            factor_.add_row(left, diagonal > 0 ? diagonal : 1.0);
        }
        factor_.factor();
    }

    /// Whether it is a factor over the active functions of this matrix.
    bool is_for(const SplineMatrix<D>& matrix) const { return functions_ == functions_of(matrix); }

    /// z = P^-1 r, lane by lane; z of other functions is not touched.
    void solve(const Lanes* r, Lanes* z)
    {
        keep_room(r_, functions_.size());
        keep_room(z_, functions_.size());
        for (std::size_t k = 0; k < functions_.size(); ++k) r_[k] = r[functions_[k]];
        factor_.solve(r_.data(), z_.data());
        for (std::size_t k = 0; k < functions_.size(); ++k) z[functions_[k]] = z_[k];
    }

  private:
    static std::vector<std::ptrdiff_t> functions_of(const SplineMatrix<D>& matrix)
    {
        std::vector<std::ptrdiff_t> r;
        for (const auto& piece : matrix.active())
            for (const auto& interval : piece)
                for (std::ptrdiff_t i = interval.begin; i < interval.end; ++i) r.push_back(i);
        return r;
    }

    std::vector<std::ptrdiff_t> functions_;
    IncompleteCholesky factor_;
    Array<Lanes> r_, z_;
};

}  // namespace ordo
