// Weights of reconstruction: how much a sample counts at a target of the lattice (a node, or the centre of a cell).
// They are splines of the distance in cells, tensor products of the axes. Of the basis they know only where its nodes are.
#pragma once

#include "grid/lattice.hpp"

#include <cmath>

namespace ordo {

/// The centred spline of degree W - 1, W cells wide: 1 is the indicator of a cell, 2 the hat, 3 the quadratic spline of
/// support 3h/2, 4 the cubic spline of support 2h (Gong 2015, 5.1 and 5.2). Their values at integer distances sum to 1.
template <int W>
ORDO_FLAT inline double spline_weight(double distance)
{
    static_assert(W >= 1 && W <= 4);
    const double r = std::fabs(distance);
    if constexpr (W == 1) return r <= 0.5 ? 1.0 : 0.0;
    if constexpr (W == 2) return larger(0.0, 1 - r);
    if constexpr (W == 3) {
        const double s = larger(0.0, 1.5 - r);
        return r <= 0.5 ? 0.75 - r * r : 0.5 * s * s;
    }
    const double s = larger(0.0, 2 - r);
    return r <= 1 ? 2.0 / 3 - r * r * (1 - 0.5 * r) : s * s * s / 6;
}

/// The targets along one axis to which a sample contributes: distances (from target to sample, cells) and weights of `count`
/// targets from `first` on.
template <int capacity>
struct WeightRow {
    int first, count;
    double distance[capacity], weight[capacity];
};

/// The weights at targets one cell apart. The first is `t` cells before the sample, W/2 - 1 <= t < W/2.
template <int W, class T>
ORDO_FLAT inline void spline_row(const T& t, T (&w)[W])
{
    const T f = t - (0.5 * W - 1), s = 1 - f;  // fractions of a cell
    if constexpr (W == 1) w[0] = T(1.0);
    if constexpr (W == 2) {
        w[0] = s;
        w[1] = f;
    }
    if constexpr (W == 3) {
        w[0] = 0.5 * s * s;
        w[1] = 0.5 + f * s;
        w[2] = 0.5 * f * f;
    }
    if constexpr (W == 4) {
        w[0] = s * s * s * (1.0 / 6);
        w[1] = 2.0 / 3 - f * f * (1 - 0.5 * f);
        w[2] = 2.0 / 3 - s * s * (1 - 0.5 * s);
        w[3] = f * f * f * (1.0 / 6);
    }
}

/// Targets one cell apart, the first `halves` half cells from the first node.
template <int halves>
struct EvenTargets {
    static constexpr bool is_even = true;
    template <int W>
    static constexpr int capacity = W;

    /// The first target to which a sample at y contributes.
    template <int W>
    ORDO_FLAT static int first(double y)
    {
        return static_cast<int>(y - 0.5 * (halves + W) + 1);  // not negative, because of the margin
    }
    ORDO_FLAT static double distance(double y, int target) { return y - 0.5 * halves - target; }
    /// The first targets of eight samples, as whole numbers, and the distances to them.
    template <int W>
    ORDO_FLAT static Lanes first(const Lanes& y, Lanes& distance)
    {
        const Lanes target = truncate(y - (0.5 * (halves + W) - 1));
        distance           = y - 0.5 * halves - target;
        return target;
    }

    template <int W, int D>
    ORDO_FLAT static void fill(const Lattice<D>&, int, double y, WeightRow<W>& row)
    {
        row.first = first<W>(y);
        row.count = W;
        for (int k = 0; k < W; ++k) row.distance[k] = distance(y, row.first + k);
        spline_row<W>(row.distance[0], row.weight);
    }
};
using HatNodes    = EvenTargets<0>;
using CellCenters = EvenTargets<1>;

/// Targets at the Greville points of splines, which lie closer together at the faces of the grid.
struct SplineNodes {
    static constexpr bool is_even = false;
    template <int W>
    static constexpr int capacity = W + 2;

    template <int W, int D>
    ORDO_FLAT static void fill(const Lattice<D>& g, int a, double y, WeightRow<W + 2>& row)
    {
        const int p         = g.basis.degree;
        const int inner     = static_cast<int>(std::floor(y - 0.5 * W + 0.5 * (p - 1))) + 1;
        const bool is_inner = g.periodic[a] || (inner - g.margin >= p && inner + W - 1 - g.margin < g.cells[a]);
        row.first           = is_inner ? inner : inner - 1;
        row.count           = is_inner ? W : W + 2;
        for (int k = 0; k < row.count; ++k) {
            row.distance[k] = y - g.cell_coordinate(a, g.node_position(a, row.first + k));
            row.weight[k]   = spline_weight<W>(row.distance[k]);
        }
    }
};

/// How many nodes beyond its own functions a sample contributes to: tiles add this to the reach of domains.
inline int extra_reach(int width, int degree) { return degree > 1 ? 2 : width > 2 ? 1 : 0; }

}  // namespace ordo
