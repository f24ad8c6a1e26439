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

/// D_p is diagonal for products of weights whose first moments vanish.
struct AffineGradient {
    template <int D, class Row>
    ORDO_FLAT static void set(const Lattice<D>& g, const Vec<D>& x, Row& s)
    {
        const Index<D> first = g.index(s.first);
        for (int a = 0; a < D; ++a) {
            double inertia = 0.0;
            for (int k = 0; k < Row::capacity; ++k) {
                const double d = g.node_position(a, first[a] + k) - x[a];
                s.dw[a][k]     = s.w[a][k] * d;
                inertia += s.w[a][k] * d * d;
            }
            for (double& d : s.dw[a]) d *= inertia > 0 ? 1 / inertia : 0.0;
        }
    }
};

template <int D, class Basis>
using AffinePoint = Point<D, Basis, AffineGradient>;
static_assert(Shape<AffinePoint<2, Hat>>);

}  // namespace ordo
