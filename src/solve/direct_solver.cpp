#include "solve/direct_solver.hpp"

#include "solve/scattered.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>

#include <algorithm>

namespace ordo {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

/// The matrix has factors that can be used: a load at random moves no unknown too far and gives a small residual. False for NaN.
template <class Solver>
bool is_good(const Solver& solver, const Matrix& a, double tolerance)
{
    if (solver.info() != Eigen::Success) return false;
    const Eigen::VectorXd stiffness = a.cwiseAbs() * Eigen::VectorXd::Ones(a.rows());
    Eigen::VectorXd load(a.rows());
    for (Eigen::Index i = 0; i < load.size(); ++i) load[i] = scattered(static_cast<std::uint64_t>(i)) * stiffness[i];
    const Eigen::VectorXd x    = solver.solve(load);
    const Eigen::VectorXd size = a.cwiseAbs() * x.cwiseAbs() + load.cwiseAbs();
    return x.cwiseAbs().maxCoeff() < 1 / tolerance && (a * x - load).cwiseAbs().sum() < 1e-6 * size.sum();
}

}  // namespace

struct DirectSolver::Factors {
    bool is_ldl = true;
    Eigen::SimplicialLDLT<Matrix> ldl;
    Eigen::SparseLU<Matrix> lu;
};

DirectSolver::DirectSolver() : factors_(std::make_unique<Factors>()) {}
DirectSolver::~DirectSolver()                                  = default;
DirectSolver::DirectSolver(DirectSolver&&) noexcept            = default;
DirectSolver& DirectSolver::operator=(DirectSolver&&) noexcept = default;

bool DirectSolver::factor(const SparseRows& matrix, bool is_symmetric, double tolerance)
{
    const std::ptrdiff_t n = std::ssize(matrix.first) - 1;
    if (n == 0) return true;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(matrix.column.size());
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t k = matrix.first[i]; k < matrix.first[i + 1]; ++k)
            entries.emplace_back(static_cast<int>(i), matrix.column[k], matrix.value[k]);
    Matrix a(n, n);
    a.setFromTriplets(entries.begin(), entries.end());
    factors_ = std::make_unique<Factors>();
    if (is_symmetric) {
        factors_->ldl.compute(a);
        if (is_good(factors_->ldl, a, tolerance)) return true;
    }
    factors_->is_ldl = false;
    factors_->lu.compute(a);
    return is_good(factors_->lu, a, tolerance);
}

void DirectSolver::solve(std::span<const double> b, std::span<double> x)
{
    if (b.empty()) return;
    const Eigen::Map<const Eigen::VectorXd> side(b.data(), std::ssize(b));
    Eigen::Map<Eigen::VectorXd> result(x.data(), std::ssize(x));
    if (factors_->is_ldl)
        result = factors_->ldl.solve(side);
    else
        result = factors_->lu.solve(side);
}

}  // namespace ordo
