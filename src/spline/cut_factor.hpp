// The preconditioner for splines on bodies with free surfaces: an incomplete Cholesky factor of the full matrix, which is
// assembled for it. It replaces the tensor-product preconditioner of full grids and needs 10 to 40 iterations, a diagonal 150
// to 500.
#pragma once

#include "base/index.hpp"
#include "base/lanes.hpp"
#include "spline/axis.hpp"
#include "spline/ghost_penalty.hpp"

#include <memory>
#include <vector>

namespace ordo {

/// A symmetric matrix over the functions of a space; only functions of the same or neighbouring cells are coupled.
template <int D>
class CutFactor {
  public:
    explicit CutFactor(const SplineSpace<D>& space);
    CutFactor(CutFactor&&) noexcept;
    ~CutFactor();

    /// Adds a dense block for the functions from `first` up to `first + size`, the first axis fastest; indices wrap on periodic
    /// axes. Blocks that share no function may be added at the same time.
    void add(const Index<D>& first, const Index<D>& size, const double* block);
    /// Adds the penalty and factors the matrix; call it before `solve`. Functions without entries get a row of the identity.
    void finish(const GhostPenalty<D>& ghost, double weight);
    /// z = S (L L^T)^-1 S r, lane by lane, with the scale S of the factor.
    void solve(const Lanes* r, Lanes* z) const;

  private:
    struct Factor;

    void factor();

    SplineSpace<D> space_;
    int width_;        ///< of a function's neighbourhood, functions along an axis
    int stencil_ = 1;  ///< functions in the neighbourhood
    std::vector<double> entries_;
    std::unique_ptr<Factor> factor_;
};

/// The sum of weights times N_i N_j over points of a cell: its part of the matrix.
template <int D, int P>
class CellBlock {
  public:
    /// Adds a point; rows[a] has the values there of the functions of axis a.
    void add(const Vec<D, const double*>& rows, double weight)
    {
        double values[count];
        for (int i = 0; i < count; ++i) {
            values[i] = 1.0;
            for (int a = 0, rest = i; a < D; ++a, rest /= P + 1) values[i] *= rows[a][rest % (P + 1)];
        }
        for (int i = 0; i < count; ++i) {
            const double of = weight * values[i];
            for (int j = 0; j < count; ++j) block_[i * count + j] += of * values[j];
        }
    }
    void add_to(const SplineSpace<D>& space, const Index<D>& cell, CutFactor<D>& factor) const
    {
        factor.add(space.first_of(cell), Index<D>::filled(P + 1), block_.data());
    }

  private:
    static constexpr int count = power_of(P + 1, D);
    std::vector<double> block_ = std::vector<double>(count * count, 0.0);
};

}  // namespace ordo
