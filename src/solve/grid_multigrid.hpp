// Multigrid for matrices between the nodes of a lattice, a preconditioner for Krylov methods: implicit steps use it. It knows the lattice
// indices of the nodes and the entries of the matrix, nothing of particles or materials.
#pragma once

#include "base/index.hpp"
#include "solve/sparse_rows.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace ordo {

struct MultigridChoices {
    int direct_unknowns = 0;  ///< at most so many are solved directly; 0: 100000, 4000 and 1500 in one, two and three dimensions
    int degree          = 0;  ///< of the polynomials that smooth; 0: 2, 4 or 8 for matrices that join nodes 1, 2 or 3 apart
    double range        = 0;  ///< the largest eigenvalue over the least one that they damp; 0: 12, 30 or 100
};

/// Geometric multigrid with Galerkin matrices. Every second node along each axis is a coarse one, the others take linear interpolation of
/// them; that keeps translations and rotations on all levels, up to the rim of a body of any shape. Chebyshev polynomials of the
/// block-Jacobi-scaled matrix smooth (Adams, Brezina, Hu & Tuminaro 2003), the coarsest level is solved directly. A cycle of a
/// symmetric matrix is symmetric. Results have the same bits for any number of threads.
template <int D>
class GridMultigrid {
  public:
    explicit GridMultigrid(const MultigridChoices& choices = {});
    ~GridMultigrid();
    GridMultigrid(GridMultigrid&&) noexcept;
    GridMultigrid& operator=(GridMultigrid&&) noexcept;

    /// Takes a matrix. False if it is singular, as far as rounding lets one see, or not finite: it is then not to be applied.
    /// @param matrix of the nodes
    /// @param place lattice index of each node
    /// @param periodic,cells on a periodic axis, indices k and k + cells are the same node
    /// @param held of each unknown node * D + component: not 0 where it is given. Its row and column are taken for those of the identity.
    /// @param is_symmetric the matrix is, up to rounding
    bool set_up(SparseRows<Mat<D>> matrix, const std::vector<Index<D>>& place, const Vec<D, bool>& periodic,
                const Index<D>& cells, const std::vector<unsigned char>& held, bool is_symmetric = false);

    /// y = A x: faster than by rows of single unknowns.
    void multiply(std::span<const double> x, std::span<double> y) const;

    /// z = one cycle for A z = r from z = 0; the solution if the matrix is small enough to be solved directly.
    void apply(std::span<const double> r, std::span<double> z);

    /// Unknowns that are not held, of each level from the finest.
    std::vector<std::ptrdiff_t> unknowns() const;
    /// Entries of the matrices of all levels, relative to those of the finest.
    double operator_complexity() const;
    /// Nodes, on all levels but the coarsest, whose own block is not positive definite: it is scaled as if a pivot were 1e-6 of its diagonal.
    std::ptrdiff_t blocks_without_root() const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace ordo
