// A direct solver for sparse matrices between places of a lattice: the coarsest level of multigrid, and matrices of some size as a whole.
#pragma once

#include "base/index.hpp"
#include "solve/sparse_rows.hpp"

#include <memory>
#include <span>
#include <vector>

namespace ordo {

/// Factors L U of a matrix by nested dissection (George 1973, SIAM J. Numerical Analysis 10:345) with dense fronts (Duff & Reid 1983, ACM TOMS 9:302).
/// Pivots are the largest of the unknowns that a part eliminates, which is enough for stiffness: what matters of a part is regular where the
/// rest is held. Matrices that are symmetric and positive definite have factors L L^T, at half of the cost. The same bits for any number of threads.
class DirectSolver {
  public:
    DirectSolver();
    ~DirectSolver();
    DirectSolver(DirectSolver&&) noexcept;
    DirectSolver& operator=(DirectSolver&&) noexcept;

    /// False if the matrix is singular or not finite. Matrices with the entries of the last one in the same order are the faster ones.
    /// @param place of each unknown. Any do; it is fast where unknowns that share entries are near each other.
    /// @param tolerance for rounding: the matrix is singular if a load at random, relative to the sums of the sizes in each row, moves an
    ///                  unknown by more than 1/tolerance
    /// @param is_symmetric the matrix is, up to rounding; definite or not
    bool factor(const SparseRows<double>& matrix, const std::vector<Index<3>>& place, double tolerance,
                bool is_symmetric = false);

    /// x = A^-1 b
    void solve(std::span<const double> b, std::span<double> x);

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace ordo
