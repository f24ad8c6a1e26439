// Gradient `affine`: phi_ip = N_i(x_p) with the gradient w_i D_p^-1 (x_i - x_p) of the affine matrix, in forces and in L_p
// (MLS-MPM, Hu et al. 2018). Exact for linear fields, as that of the functions is.
#pragma once

#include "shape/point.hpp"

namespace ordo {

/// Where a node is.
template <int D>
ORDO_FLAT inline Vec<D> place_of_node(const Lattice<D>& g, std::ptrdiff_t node)
{
    const Index<D> at = g.index(node);
    Vec<D> x{};
    for (int a = 0; a < D; ++a) x[a] = g.node_position(a, at[a]);
    return x;
}

template <int D, class Basis>
struct AffinePoint : Point<D, Basis> {
    using Row = typename Point<D, Basis>::Row;

    /// D_p is diagonal for products of weights whose first moments vanish.
    ORDO_FLAT static Row stencil(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Row s                = Point<D, Basis>::stencil(g, p, i);
        const Index<D> first = g.index(s.first);
        for (int a = 0; a < D; ++a) {
            double inertia = 0.0;
            for (int k = 0; k < Basis::width; ++k) {
                const double d = g.node_position(a, first[a] + k) - p.x[i][a];
                s.dw[a][k]     = s.w[a][k] * d;
                inertia += s.w[a][k] * d * d;
            }
            for (double& d : s.dw[a]) d *= inertia > 0 ? 1 / inertia : 0.0;
        }
        return s;
    }
    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        ordo::for_each_node(stencil(g, p, i), g, visit);
    }
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value,
                                 const Lanes (&flux)[D])
    {
        ordo::spread(stencil(g, p, i), g, nodes, value, flux);
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Lanes (&gradient)[D])
    {
        ordo::collect(stencil(g, p, i), g, nodes, value, gradient);
    }
};
static_assert(Shape<AffinePoint<2, Hat>>);

}  // namespace ordo
