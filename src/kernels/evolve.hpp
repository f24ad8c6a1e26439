// How domains follow the deformation: the axis on which uGIMP and cpGIMP, CPDI1 and CPDI2 differ.
#pragma once

#include "particles/particles.hpp"

namespace ordo {

/// Points, and boxes of fixed size (uGIMP).
template <int D>
struct Rigid {
    ORDO_HD static void apply(const ParticleView<D>&, int) {}
};

/// Boxes stretched by the diagonal of F (cpGIMP), Gong (2015) sec. 6.3.
template <int D>
struct StretchedBox {
    ORDO_HD static void apply(const ParticleView<D>& p, int i)
    {
        for (int a = 0; a < D; ++a) p.half[i][a] = p.F[i](a, a) * p.half0[i][a];
    }
};

/// Half-edge vectors r = F r0 (CPDI1), Gong (2015) sec. 6.4.
template <int D>
struct AffineEdges {
    ORDO_HD static void apply(const ParticleView<D>& p, int i) { p.edges[i] = p.F[i] * p.edges0[i]; }
};

}  // namespace ordo
