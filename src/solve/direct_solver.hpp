// A direct solver for sparse matrices: the coarsest level of multigrid, and small matrices as a whole.
#pragma once

#include "solve/sparse_rows.hpp"

#include <memory>
#include <span>

namespace ordo {

/// Factors of a matrix: L D L^T where it is symmetric and that succeeds, else L U with pivots. One thread does it.
class DirectSolver {
  public:
    DirectSolver();
    ~DirectSolver();
    DirectSolver(DirectSolver&&) noexcept;
    DirectSolver& operator=(DirectSolver&&) noexcept;

    /// False if the matrix is singular or not finite.
    /// @param tolerance for rounding: the matrix is singular if a load at random, relative to the sums of the sizes in each row, moves an
    ///                  unknown by more than 1/tolerance
    bool factor(const SparseRows& matrix, bool is_symmetric, double tolerance);

    /// x = A^-1 b
    void solve(std::span<const double> b, std::span<double> x);

  private:
    struct Factors;
    std::unique_ptr<Factors> factors_;
};

}  // namespace ordo
