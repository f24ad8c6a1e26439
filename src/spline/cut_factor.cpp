#include "spline/cut_factor.hpp"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include <algorithm>
#include <utility>

namespace ordo {

/// The matrix is about S^-1 L L^T S^-1. L is stored by columns, the diagonal first.
template <int D>
struct CutFactor<D>::Factor {
    Eigen::SparseMatrix<double> lower;
    Eigen::VectorXd scale;
};

template <int D>
CutFactor<D>::CutFactor(const SplineSpace<D>& space, const SplineMatrix<D>& matrix, const GhostPenalty<D>& ghost,
                        double ghost_weight)
    : space_(space), width_(2 * (space.axis[0].degree + 1) + 1), factor_(std::make_unique<Factor>())
{
    for (int a = 0; a < D; ++a) stencil_ *= width_;
    entries_.assign(space.count() * stencil_, 0.0);
    matrix.for_each_entry([&](std::size_t row, const Index<D>& by, double value) {
        int place = 0;
        for (int a = D - 1; a >= 0; --a) place = place * width_ + by[a];
        entries_[row * stencil_ + stencil_ / 2 + place] = value;
    });
    ghost.for_each_block([&](const Index<D>& first, const Index<D>& size, std::vector<double>& block) {
        for (double& of : block) of *= ghost_weight;
        add(first, size, block.data());
    });
    factor();
}

template <int D>
CutFactor<D>::CutFactor(CutFactor&&) noexcept = default;
template <int D>
CutFactor<D>::~CutFactor() = default;

template <int D>
void CutFactor<D>::add(const Index<D>& first, const Index<D>& size, const double* block)
{
    std::vector<std::pair<std::size_t, int>> functions;  // number, position in a neighbourhood up to a constant
    IndexBox<D>{first, first + size}.for_each([&](const Index<D>& k) {
        Index<D> at{};
        int place = 0;
        for (int a = D - 1; a >= 0; --a) {
            at[a] = space_.axis[a].wrapped(k[a]);
            place = place * width_ + k[a];
        }
        functions.emplace_back(space_.number(at), place);
    });
    for (const auto& [row, of_row] : functions)
        for (const auto& [column, of_column] : functions)
            entries_[row * stencil_ + stencil_ / 2 + of_column - of_row] += *block++;
}

template <int D>
void CutFactor<D>::factor()
{
    const auto n = static_cast<int>(space_.count());
    std::vector<Eigen::Triplet<double>> lower;
    const IndexBox<D> around = IndexBox<D>::around(Index<D>{}, width_ / 2);
    for (int row = 0; row < n; ++row) {
        const double* entry = entries_.data() + static_cast<std::size_t>(row) * stencil_;
        const Index<D> at   = space_.index(row);
        bool has_any        = false;
        around.for_each([&](const Index<D>& by) {
            const double value = *entry++;
            if (value == 0) return;
            has_any = true;
            Index<D> other{};
            for (int a = 0; a < D; ++a) {
                const int count = space_.axis[a].count();
                other[a]        = space_.axis[a].periodic ? ((at[a] + by[a]) % count + count) % count : at[a] + by[a];
            }
            const auto column = static_cast<int>(space_.number(other));
            if (column <= row) lower.emplace_back(row, column, value);
        });
        if (!has_any) lower.emplace_back(row, row, 1.0);
    }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(lower.begin(), lower.end());
    const Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>> cholesky(matrix);
    factor_->lower = cholesky.matrixL();
    factor_->scale = cholesky.scalingS();
}

template <int D>
void CutFactor<D>::solve(const Lanes* r, Lanes* z) const
{
    const auto n      = static_cast<int>(space_.count());
    const int *begins = factor_->lower.outerIndexPtr(), *rows = factor_->lower.innerIndexPtr();
    const double *values = factor_->lower.valuePtr(), *scale = factor_->scale.data();
    for (int j = 0; j < n; ++j) z[j] = r[j] * scale[j];
    for (int j = 0; j < n; ++j) {
        const Lanes of = z[j] = z[j] * (1 / values[begins[j]]);
        for (int k = begins[j] + 1; k < begins[j + 1]; ++k) z[rows[k]] -= of * values[k];
    }
    for (int j = n - 1; j >= 0; --j) {
        Lanes of = z[j];
        for (int k = begins[j] + 1; k < begins[j + 1]; ++k) of -= z[rows[k]] * values[k];
        z[j] = of * (1 / values[begins[j]]);
    }
    for (int j = 0; j < n; ++j) z[j] = z[j] * scale[j];
}

template class CutFactor<1>;
template class CutFactor<2>;
template class CutFactor<3>;

}  // namespace ordo
