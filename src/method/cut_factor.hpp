// The preconditioner of splines on bodies with free surfaces: an incomplete Cholesky factor of the whole matrix, which is formed
// for it. What products of axes are to a full grid, this is to a part of one: 10 to 40 iterations for the 150 to 500 of a diagonal.
#pragma once

#include "base/index.hpp"
#include "base/lanes.hpp"
#include "grid/spline_axis.hpp"

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
    /// To be called before `solve`. Functions without entries get a row of the identity.
    void factor();
    /// z = (L L^T)^-1 r, lane by lane.
    void solve(const Lanes* r, Lanes* z) const;

  private:
    struct Factor;

    SplineSpace<D> space_;
    int width_;        ///< of the neighbourhood of a function along an axis
    int stencil_ = 1;  ///< functions of the neighbourhood
    std::vector<double> entries_;
    std::unique_ptr<Factor> factor_;
};

}  // namespace ordo
