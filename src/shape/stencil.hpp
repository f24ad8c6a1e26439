// Tensor products of one-dimensional rows, which apply a particle's weights to node records.
// A deposit is linear in (w, dw): a particle leaves w A + sum_d dw_d X_d at a node, with constant 8-vectors A and X_d.
#pragma once

#include "base/error.hpp"
#include "base/lanes.hpp"
#include "base/vec.hpp"
#include "grid/lattice.hpp"

#include <cstddef>

namespace ordo {

/// Values w and slopes dw (1/m) along each axis, from the first node on. The number of nodes along an axis is W, or
/// `count[a]` <= -W where W is negative (domains of any size).
template <int D, int W>
struct Stencil {
    static constexpr int capacity = W > 0 ? W : -W;

    std::ptrdiff_t first = 0;
    double w[D][capacity];
    double dw[D][capacity];
    int count[D];

    ORDO_HD int size(int a) const { return W > 0 ? W : count[a]; }
};

/// Adds w A + sum_d dw_d X_d to the nodes of the stencil.
template <int A, int D, int W>
ORDO_FLAT inline void spread_axis(const Stencil<D, W>& s, const Lattice<D>& g, Lanes* node, const Lanes& value, const Lanes* flux)
{
    for (int k = 0; k < s.size(A); ++k) {
        const Lanes v = value * s.w[A][k] + flux[A] * s.dw[A][k];
        if constexpr (A == 0) {
            node[k] += v;
        } else {
            Lanes rest[A];
            for (int b = 0; b < A; ++b) rest[b] = flux[b] * s.w[A][k];
            spread_axis<A - 1>(s, g, node + k * g.stride[A], v, rest);
        }
    }
}

/// Adds w A to the nodes of the stencil.
template <int A, int D, int W>
ORDO_FLAT inline void spread_value_axis(const Stencil<D, W>& s, const Lattice<D>& g, Lanes* node, const Lanes& value)
{
    for (int k = 0; k < s.size(A); ++k) {
        const Lanes v = value * s.w[A][k];
        if constexpr (A == 0)
            node[k] += v;
        else
            spread_value_axis<A - 1>(s, g, node + k * g.stride[A], v);
    }
}

/// Adds the sums of w n_i and dw_d n_i over the nodes of the stencil to value and gradient. Gradients only of four lanes.
template <int A, int D, int W>
ORDO_FLAT inline void collect_axis(const Stencil<D, W>& s, const Lattice<D>& g, const Lanes* node, Lanes& value, Quad* gradient)
{
    for (int k = 0; k < s.size(A); ++k) {
        Lanes v{};
        if constexpr (A == 0) {
            v = node[k];
        } else {
            Quad rest[A] = {};
            collect_axis<A - 1>(s, g, node + k * g.stride[A], v, rest);
            for (int b = 0; b < A; ++b) gradient[b] += rest[b] * s.w[A][k];
        }
        value += v * s.w[A][k];
        gradient[A] += low(v) * s.dw[A][k];
    }
}

/// Adds the sum of w n_i over the nodes of the stencil to value.
template <int A, int D, int W>
ORDO_FLAT inline void collect_value_axis(const Stencil<D, W>& s, const Lattice<D>& g, const Lanes* node, Lanes& value)
{
    for (int k = 0; k < s.size(A); ++k) {
        if constexpr (A == 0) {
            value += node[k] * s.w[A][k];
        } else {
            Lanes v{};
            collect_value_axis<A - 1>(s, g, node + k * g.stride[A], v);
            value += v * s.w[A][k];
        }
    }
}

template <int D, int W>
ORDO_FLAT inline void spread(const Stencil<D, W>& s, const Lattice<D>& g, Lanes* nodes, const Lanes& value,
                             const Lanes (&flux)[D])
{
    spread_axis<D - 1>(s, g, nodes + s.first, value, flux);
}
template <int D, int W>
ORDO_FLAT inline void spread_value(const Stencil<D, W>& s, const Lattice<D>& g, Lanes* nodes, const Lanes& value)
{
    spread_value_axis<D - 1>(s, g, nodes + s.first, value);
}
template <int D, int W>
ORDO_FLAT inline void collect(const Stencil<D, W>& s, const Lattice<D>& g, const Lanes* nodes, Lanes& value, Quad (&gradient)[D])
{
    collect_axis<D - 1>(s, g, nodes + s.first, value, gradient);
}
template <int D, int W>
ORDO_FLAT inline void collect_value(const Stencil<D, W>& s, const Lattice<D>& g, const Lanes* nodes, Lanes& value)
{
    collect_value_axis<D - 1>(s, g, nodes + s.first, value);
}

/// The stencils of eight places, one per lane.
template <int D, int W>
struct Stencils {
    Lanes first{};  ///< whole numbers
    Lanes w[D][W], dw[D][W];

    /// The stencil of lane k.
    ORDO_FLAT Stencil<D, W> of(int k) const
    {
        Stencil<D, W> s;
        s.first = static_cast<std::ptrdiff_t>(first[k]);
        for (int a = 0; a < D; ++a)
            for (int j = 0; j < W; ++j) {
                s.w[a][j]  = w[a][j][k];
                s.dw[a][j] = dw[a][j][k];
            }
        return s;
    }
};

/// visit(node, w, dw) for each node of the stencil: the plain form of the functions above.
template <int D, int W, class Visit>
ORDO_HD void for_each_node(const Stencil<D, W>& s, const Lattice<D>& g, Visit&& visit)
{
    IndexBox<D> box{};
    for (int a = 0; a < D; ++a) box.hi[a] = s.size(a);
    box.for_each([&](const Index<D>& k) {
        double w  = 1.0;
        Vec<D> dw = Vec<D>::filled(1.0);
        for (int a = 0; a < D; ++a) {
            w *= s.w[a][k[a]];
            for (int b = 0; b < D; ++b) dw[b] *= a == b ? s.dw[a][k[a]] : s.w[a][k[a]];
        }
        visit(s.first + g.offset(k), w, dw);
    });
}

}  // namespace ordo
