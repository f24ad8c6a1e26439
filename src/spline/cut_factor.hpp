// The preconditioner of splines on bodies with free surfaces: an incomplete Cholesky factor of the whole matrix, which is formed
// for it. What products of axes are to a full grid, this is to a part of one: 10 to 40 iterations for the 150 to 500 of a diagonal.
#pragma once

#include "base/index.hpp"
#include "base/lanes.hpp"
#include "spline/axis.hpp"
#include "spline/ghost_penalty.hpp"

#include <memory>
#include <vector>

namespace ordo {

/// A symmetric matrix over the functions of a space, in which those of neighbouring cells meet.
template <int D>
class CutFactor {
  public:
    explicit CutFactor(const SplineSpace<D>& space);
    CutFactor(CutFactor&&) noexcept;
    ~CutFactor();

    /// Adds a dense block of the functions `first` to `first + size`, the first axis fastest; those beyond a period are wrapped.
    /// Blocks that share no function may be added at the same time.
    void add(const Index<D>& first, const Index<D>& size, const double* block);
    /// Adds a penalty and factors, before `solve`. Functions without entries get a row of the identity.
    void finish(const GhostPenalty<D>& ghost, double weight);
    /// z = (L L^T)^-1 r, lane by lane.
    void solve(const Lanes* r, Lanes* z) const;

  private:
    struct Factor;

    void factor();

    SplineSpace<D> space_;
    int width_;        ///< of the neighbourhood of a function along an axis
    int stencil_ = 1;  ///< functions of the neighbourhood
    std::vector<double> entries_;
    std::unique_ptr<Factor> factor_;
};

/// What the points of a cell add to a matrix: sum of weights times N_i N_j.
template <int D, int P>
class CellBlock {
  public:
    /// `rows` has the values of an axis' functions.
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
