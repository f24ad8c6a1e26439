// How domains follow the deformation: the axis on which uGIMP and cpGIMP, CPDI1 and CPDI2 differ.
#pragma once

#include "kernels/sweep.hpp"
#include "shape/corners.hpp"

namespace ordo {

/// Points, and boxes of fixed size (uGIMP).
template <int D>
struct Rigid {
    ORDO_HD static void apply(const Sweep<D>&, int) {}
};

/// Boxes stretched by the diagonal of F (cpGIMP), Gong (2015) sec. 6.3.
template <int D>
struct StretchedBox {
    ORDO_HD static void apply(const Sweep<D>& s, int i)
    {
        const ParticleView<D>& p = s.p;
        for (int a = 0; a < D; ++a) p.half[i][a] = p.F[i](a, a) * p.half0[i][a];
    }
};

/// Half-edge vectors r = F r0 (CPDI1), Gong (2015) sec. 6.4. Where a corner would be further away than the limit, all of
/// them are scaled: Homel, Brannon & Guilkey (2016).
template <int D>
struct AffineEdges {
    ORDO_HD static void apply(const Sweep<D>& s, int i)
    {
        Mat<D>& r = s.p.edges[i];
        r         = s.p.F[i] * s.p.edges0[i];
        if (!(s.stretch_limit > 0)) return;
        const double reach      = corner_reach(s.lattice, r);
        constexpr double within = 1 - 1e-15;  // round-off must not lift the limit above the largest reach there is
        if (reach > s.stretch_limit) r *= within * s.stretch_limit / reach;
    }
};

/// Particles that follow the corners of their cells: place and volume.
template <class S>
struct OfCorners {
    ORDO_HD static void apply(const Sweep<S::dim>& s, int i) { s.p.x[i] = S::settle(s.lattice, s.p, i); }
};

}  // namespace ordo
