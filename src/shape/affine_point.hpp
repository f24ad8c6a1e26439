// Points whose slopes are not those of their functions. Gradient `affine`: phi_ip = N_i(x_p) with the gradient
// w_i D_p^-1 (x_i - x_p) of the affine matrix, in forces and in L_p (MLS-MPM, Hu et al. 2018). Exact for linear fields, like the
// gradient of the functions.
#pragma once

#include "shape/point.hpp"

namespace ordo {

template <int D>
ORDO_FLAT inline Vec<D> place_of_node(const Lattice<D>& g, std::ptrdiff_t node)
{
    const Index<D> at = g.index(node);
    Vec<D> x{};
    for (int a = 0; a < D; ++a) x[a] = g.node_position(a, at[a]);
    return x;
}

/// Slopes w_k (x_k - x_p), m. Collected with velocities they give the matrix B_p; a scatter of m v with flux m C leaves
/// affine momenta at the nodes.
struct Arms {
    template <class Basis, int D, class T, class Cell>
    ORDO_FLAT static void set(const Lattice<D>& g, int a, const T& y, const Cell& cell, const T (&w)[Basis::width],
                              T (&dw)[Basis::width])
    {
        for (int k = 0; k < Basis::width; ++k) dw[k] = w[k] * distance<Basis>(g, a, k, y, cell) * g.h[a];
    }

    /// The distance from a place to node k of its row, cells.
    template <class Basis, int D>
    ORDO_FLAT static double distance(const Lattice<D>& g, int a, int k, double y, int cell)
    {
        return g.margin + g.node_place(a, cell + k) - y;
    }
    /// The same away from faces.
    template <class Basis, int D>
    ORDO_FLAT static Lanes distance(const Lattice<D>&, int, int k, const Lanes& y, const Lanes& cell)
    {
        return cell + (k + 0.5 * (1 - Basis::degree)) - y;
    }
};

/// Slopes w_k (x_k - x_p)/D_p, 1/m, with D_p = sum_k w_k (x_k - x_p)^2 along an axis: D_p is diagonal for products of weights
/// whose first moments vanish. D_p is summed, because h^2/4 is wrong near clamped faces.
struct AffineSlopes {
    template <class Basis, int D, class T, class Cell>
    ORDO_FLAT static void set(const Lattice<D>& g, int a, const T& y, const Cell& cell, const T (&w)[Basis::width],
                              T (&dw)[Basis::width])
    {
        T inertia{};
        for (int k = 0; k < Basis::width; ++k) {
            const T d = Arms::distance<Basis>(g, a, k, y, cell);
            dw[k]     = w[k] * d;
            inertia += dw[k] * d;
        }
        const T inverse = inverse_of(inertia) * g.inv_h[a];
        for (T& d : dw) d *= inverse;
    }

    /// 0 on a clamped face, where all but one function vanish.
    ORDO_FLAT static double inverse_of(double inertia) { return inertia > 0 ? 1 / inertia : 0.0; }
    ORDO_FLAT static Lanes inverse_of(const Lanes& inertia) { return Lanes(1.0) / inertia; }
};

template <int D, class Basis>
using PointWithArms = Point<D, Basis, Arms>;

/// For splines only: with hats D_p is singular at a node.
template <int D, class Basis>
requires(Basis::degree > 1) using AffinePoint = Point<D, Basis, AffineSlopes>;

}  // namespace ordo
