// How domains follow the deformation: the difference between uGIMP and cpGIMP, and between CPDI1 and CPDI2.
#pragma once

#include "kernels/sweep.hpp"
#include "shape/corners.hpp"

namespace ordo {

/// Points, and boxes of fixed size (uGIMP).
template <int D>
struct Rigid {
    ORDO_FLAT static void apply(const Sweep<D>&, const Batch&) {}
};

/// Boxes stretched by the diagonal of F (cpGIMP), Gong (2015) sec. 6.3.
template <int D>
struct StretchedBox {
    ORDO_FLAT static void apply(const Sweep<D>& s, const Batch& b)
    {
        const Mat<D, Lanes> F = load(s.p.F, b);
        Vec<D, Lanes> half    = load(s.p.half0, b);
        for (int a = 0; a < D; ++a) half[a] *= F(a, a);
        store(s.p.half, b, half);
    }
};

/// Half-edge vectors r = F r0 (CPDI1), Gong (2015) sec. 6.4. If a corner would be further away than the limit, all edges
/// are scaled down (Homel, Brannon & Guilkey 2016).
template <int D>
struct AffineEdges {
    ORDO_FLAT static void apply(const Sweep<D>& s, const Batch& b)
    {
        Mat<D, Lanes> r = load(s.p.F, b) * load(s.p.edges0, b);
        if (s.stretch_limit > 0) {
            constexpr double within = 1 - 1e-15;  // round-off must not raise the reach above the largest one allowed
            r *= smaller(Lanes(1.0), Lanes(within * s.stretch_limit) / corner_reach(s.lattice, r));
        }
        store(s.p.edges, b, r);
    }
};

/// Particles whose position and volume follow the corners of their cells.
template <class S>
struct OfCorners {
    ORDO_FLAT static void apply(const Sweep<S::dim>& s, const Batch& b)
    {
        for (int i = b.first; i < b.first + b.count; ++i) s.p.x[i] = S::settle(s.lattice, s.p, i);
    }
};

}  // namespace ordo
