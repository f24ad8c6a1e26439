// Tensor products of one-dimensional rows, which apply a particle's weights to node records.
// A deposit is linear in (w, dw): a particle leaves w A + sum_d dw_d X_d at a node, with constant 8-vectors A and X_d,
// of which some have zeros in the first or last four places.
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
    ORDO_FLAT double value(int a, int k) const { return w[a][k]; }
    ORDO_FLAT double slope(int a, int k) const { return dw[a][k]; }
};

/// The stencils of eight places, one per lane.
template <int D, int W>
struct Stencils {
    Lanes first{};  ///< whole numbers
    Lanes w[D][W], dw[D][W];

    /// The stencil of a lane, read from where it is.
    struct One {
        const Stencils& all;
        int lane;
        std::ptrdiff_t first;

        ORDO_FLAT static constexpr int size(int) { return W; }
        ORDO_FLAT double value(int a, int k) const { return lane_at(all.w[a][k], lane); }
        ORDO_FLAT double slope(int a, int k) const { return lane_at(all.dw[a][k], lane); }
    };
    ORDO_FLAT One of(int lane) const { return {*this, lane, static_cast<std::ptrdiff_t>(lane_at(first, lane))}; }

    /// Puts `s` into a lane.
    ORDO_FLAT void set(int lane, const Stencil<D, W>& s)
    {
        first[lane] = static_cast<double>(s.first);
        for (int a = 0; a < D; ++a)
            for (int k = 0; k < W; ++k) {
                w[a][k][lane]  = s.w[a][k];
                dw[a][k][lane] = s.dw[a][k];
            }
    }
};

/// A `Stencil`, or one of `Stencils`.
template <class S>
concept AnyStencil = requires(const S& s)
{
    s.first;
    s.value(0, 0);
    s.slope(0, 0);
};

/// Adds w A + sum_d dw_d X_d to the nodes of the stencil.
template <int A, class S, int D, class Value, class Flux>
ORDO_FLAT inline void spread_axis(const S& s, const Lattice<D>& g, Lanes* node, const Value& value, const Flux* flux)
{
    for (int k = 0; k < s.size(A); ++k) {
        if constexpr (A == 0) {
            node[k] = node[k] + value * s.value(A, k) + flux[A] * s.slope(A, k);
        } else {
            Flux rest[A];
            for (int b = 0; b < A; ++b) rest[b] = flux[b] * s.value(A, k);
            spread_axis<A - 1>(s, g, node + k * g.stride[A], value * s.value(A, k) + flux[A] * s.slope(A, k), rest);
        }
    }
}

/// Adds w A to the nodes of the stencil.
template <int A, class S, int D, class Value>
ORDO_FLAT inline void spread_value_axis(const S& s, const Lattice<D>& g, Lanes* node, const Value& value)
{
    for (int k = 0; k < s.size(A); ++k) {
        const Value v = value * s.value(A, k);
        if constexpr (A == 0)
            node[k] += v;
        else
            spread_value_axis<A - 1>(s, g, node + k * g.stride[A], v);
    }
}

/// Adds the sums of w n_i and dw_d n_i over the nodes of the stencil to value and gradient. Gradients only of four lanes.
template <int A, class S, int D>
ORDO_FLAT inline void collect_axis(const S& s, const Lattice<D>& g, const Lanes* node, Lanes& value, Quad* gradient)
{
    for (int k = 0; k < s.size(A); ++k) {
        Lanes v{};
        if constexpr (A == 0) {
            v = node[k];
        } else {
            Quad rest[A] = {};
            collect_axis<A - 1>(s, g, node + k * g.stride[A], v, rest);
            for (int b = 0; b < A; ++b) gradient[b] += rest[b] * s.value(A, k);
        }
        value += v * s.value(A, k);
        gradient[A] += low(v) * s.slope(A, k);
    }
}

/// Adds the sum of w n_i over the nodes of the stencil to value.
template <int A, class S, int D>
ORDO_FLAT inline void collect_value_axis(const S& s, const Lattice<D>& g, const Lanes* node, Lanes& value)
{
    for (int k = 0; k < s.size(A); ++k) {
        if constexpr (A == 0) {
            value += node[k] * s.value(A, k);
        } else {
            Lanes v{};
            collect_value_axis<A - 1>(s, g, node + k * g.stride[A], v);
            value += v * s.value(A, k);
        }
    }
}

template <AnyStencil S, int D, class Value, class Flux>
ORDO_FLAT inline void spread(const S& s, const Lattice<D>& g, Lanes* nodes, const Value& value, const Flux (&flux)[D])
{
    spread_axis<D - 1>(s, g, in_register(nodes + s.first), value, flux);
}
template <AnyStencil S, int D, class Value>
ORDO_FLAT inline void spread_value(const S& s, const Lattice<D>& g, Lanes* nodes, const Value& value)
{
    spread_value_axis<D - 1>(s, g, in_register(nodes + s.first), value);
}
template <AnyStencil S, int D>
ORDO_FLAT inline void collect(const S& s, const Lattice<D>& g, const Lanes* nodes, Lanes& value, Quad (&gradient)[D])
{
    collect_axis<D - 1>(s, g, in_register(nodes + s.first), value, gradient);
}
template <AnyStencil S, int D>
ORDO_FLAT inline void collect_value(const S& s, const Lattice<D>& g, const Lanes* nodes, Lanes& value)
{
    collect_value_axis<D - 1>(s, g, in_register(nodes + s.first), value);
}

/// visit(node, w, dw) for each node of the stencil: the plain form of the functions above.
template <AnyStencil S, int D, class Visit>
ORDO_HD void for_each_node(const S& s, const Lattice<D>& g, Visit&& visit)
{
    IndexBox<D> box{};
    for (int a = 0; a < D; ++a) box.hi[a] = s.size(a);
    box.for_each([&](const Index<D>& k) {
        double w  = 1.0;
        Vec<D> dw = Vec<D>::filled(1.0);
        for (int a = 0; a < D; ++a) {
            w *= s.value(a, k[a]);
            for (int b = 0; b < D; ++b) dw[b] *= a == b ? s.slope(a, k[a]) : s.value(a, k[a]);
        }
        visit(s.first + g.offset(k), w, dw);
    });
}
/// visit(node, w) for each node of the stencil.
template <AnyStencil S, int D, class Visit>
ORDO_HD void for_each_value(const S& s, const Lattice<D>& g, Visit&& visit)
{
    IndexBox<D> box{};
    for (int a = 0; a < D; ++a) box.hi[a] = s.size(a);
    box.for_each([&](const Index<D>& k) {
        double w = 1.0;
        for (int a = 0; a < D; ++a) w *= s.value(a, k[a]);
        visit(s.first + g.offset(k), w);
    });
}

}  // namespace ordo
