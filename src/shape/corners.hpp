// Domains with corners: phi_ip = sum_c w_c N_i(x_c), grad phi_ip = sum_c g_c N_i(x_c).
// A particle leaves a charge at each corner, which is spread with the values of the basis alone: no gradient, no search for
// duplicate nodes.
#pragma once

#include "shape/cell_weights.hpp"
#include "shape/shape.hpp"
#include "shape/stencil.hpp"

#include <cmath>
#include <limits>

namespace ordo {

/// The distance in cells from the particle to the furthest corner of a parallelepiped with half-edge vectors r, per axis.
template <int D>
ORDO_FLAT inline Lanes corner_reach(const Lattice<D>& g, const Mat<D, Lanes>& r)
{
    Lanes reach{};
    for (int a = 0; a < D; ++a) {
        Lanes sum{};
        for (int d = 0; d < D; ++d) sum += fabs(r(a, d));
        reach = larger(reach, sum * g.inv_h[a]);
    }
    return reach;
}

/// The sign of each corner of a box or parallelepiped along its edge d, -1 or 1, from bit d of the corner. Lanes are corners;
/// fewer than eight corners are repeated.
ORDO_FLAT inline Lanes corner_side(int d)
{
    return d == 0   ? make_lanes(-1, 1, -1, 1, -1, 1, -1, 1)
           : d == 1 ? make_lanes(-1, -1, 1, 1, -1, -1, 1, 1)
                    : make_lanes(-1, -1, -1, -1, 1, 1, 1, 1);
}

/// f(c, stencil) for `count` corners at cell coordinates y, one per lane; stencils hold the values of the basis.
template <int D, class Basis, class F>
ORDO_FLAT inline void for_each_corner_stencil(const Lattice<D>& g, const Vec<D, Lanes>& y, int count, F&& f)
{
    constexpr int W = Basis::width;
    Stencils<D, W> s;
    bool are_alike = true;
    for (int a = 0; a < D && are_alike; ++a) {
        Lanes cell{};
        are_alike = Basis::rows(g, a, y[a], cell, s.w[a]);
        s.first += cell * static_cast<double>(g.stride[a]);
    }
    for (int c = 0; c < count; ++c) {
        if (!are_alike) {
            s.first[c] = 0;
            for (int a = 0; a < D; ++a) {
                double w[W];
                s.first[c] += static_cast<double>(g.stride[a] * Basis::row(g, a, y[a][c], w));
                for (int k = 0; k < W; ++k) s.w[a][k][c] = w[k];
            }
        }
        f(c, s.of(c));
    }
}

// A corner is given by the values of the basis at its position, or by a node number if it is a node itself.
template <int D, AnyStencil S, class F>
ORDO_FLAT inline void visit_corner(const S& s, const Lattice<D>& g, F&& visit)
{
    for_each_value(s, g, visit);
}
template <int D, class F>
ORDO_FLAT inline void visit_corner(std::ptrdiff_t node, const Lattice<D>&, F&& visit)
{
    visit(node, 1.0);
}
template <int D, AnyStencil S, class Charge>
ORDO_FLAT inline void spread_corner(const S& s, const Lattice<D>& g, Lanes* nodes, const Charge& charge)
{
    ordo::spread_value(s, g, nodes, charge);
}
template <int D, class Charge>
ORDO_FLAT inline void spread_corner(std::ptrdiff_t node, const Lattice<D>&, Lanes* nodes, const Charge& charge)
{
    nodes[node] += charge;
}
template <int D, AnyStencil S>
ORDO_FLAT inline Lanes value_at_corner(const S& s, const Lattice<D>& g, const Lanes* nodes)
{
    Lanes value{};
    ordo::collect_value(s, g, nodes, value);
    return value;
}
template <int D>
ORDO_FLAT inline Lanes value_at_corner(std::ptrdiff_t node, const Lattice<D>&, const Lanes* nodes)
{
    return nodes[node];
}

/// Domain `parallelepiped` (CPDI1): corners x_p + sum_d s_d r_d, s_d = -1 or 1, with half-edge vectors r_d.
/// w_c = 2^-D; g_c = 2^-D sum_d s_d r^d with the dual vectors r^d . r_e = delta_de (Gong 2015, 6.27; errata 28).
template <int D, class Basis>
struct Parallelepiped {
    static constexpr int dim          = D;
    static constexpr int corner_count = 1 << D;
    static constexpr double w         = 1.0 / corner_count;
    /// Corners further away than this many cells would need too wide tiles: the run ends with a NumericalError.
    static constexpr double max_reach = 30.0;

    ORDO_FLAT static Lanes reach(const Lattice<D>& g, const ParticleView<D>& p, const Batch& b)
    {
        return corner_reach(g, load(p.edges, b));
    }

    /// Its columns are the dual vectors r^d times 2^-D.
    ORDO_FLAT static Mat<D> scaled_duals(const Mat<D>& r) { return cofactor(r) * (w / det(r)); }
    ORDO_FLAT static double sign(int corner, int d) { return corner >> d & 1 ? 1.0 : -1.0; }

    /// f(corner, stencil) for each corner.
    template <class F>
    ORDO_FLAT static void for_each_corner(const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
    {
        const Mat<D>& r = p.edges[i];
        Vec<D, Lanes> y;
        for (int a = 0; a < D; ++a) {
            y[a] = Lanes(g.cell_coordinate(a, p.x[i][a]));
            for (int d = 0; d < D; ++d) y[a] += corner_side(d) * (r(a, d) * g.inv_h[a]);
        }
        for_each_corner_stencil<D, Basis>(g, y, corner_count, f);
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        const Mat<D> dual = scaled_duals(p.edges[i]);
        for_each_corner(g, p, i, [&](int c, const auto& s) {
            Vec<D> gc{};
            for (int d = 0; d < D; ++d) gc += sign(c, d) * column(dual, d);
            visit_corner(s, g, [&](std::ptrdiff_t node, double n) { visit(node, w * n, n * gc); });
        });
    }

    template <class Value, class Flux>
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value,
                                 const Flux (&flux)[D])
    {
        const Mat<D> dual = scaled_duals(p.edges[i]);
        Value charge[corner_count];
        charge[0] = value * w;
        for (int d = 0; d < D; ++d) {
            Flux X{};
            for (int a = 0; a < D; ++a) X += flux[a] * dual(a, d);
            for (int c = 0; c < 1 << d; ++c) {
                charge[c + (1 << d)] = charge[c] + X;
                charge[c]            = charge[c] - X;
            }
        }
        for_each_corner(g, p, i, [&](int c, const auto& s) { ordo::spread_value(s, g, nodes, charge[c]); });
    }
    template <class Value>
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value)
    {
        const Value A = value * w;
        for_each_corner(g, p, i, [&](int, const auto& s) { ordo::spread_value(s, g, nodes, A); });
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Quad (&gradient)[D])
    {
        Lanes total{};
        Quad sum[corner_count], X[D] = {};
        for_each_corner(g, p, i, [&](int c, const auto& s) {
            Lanes u{};
            ordo::collect_value(s, g, nodes, u);
            total += u;
            sum[c] = low(u);
        });
        for (int d = D; d-- > 0;) {  // differences along the edges d, then sums
            X[d] = sum[1 << d] - sum[0];
            for (int c = 1; c < 1 << d; ++c) X[d] += sum[c + (1 << d)] - sum[c];
            for (int c = 0; c < 1 << d; ++c) sum[c] += sum[c + (1 << d)];
        }
        value += total * w;
        const Mat<D> dual = scaled_duals(p.edges[i]);
        for (int a = 0; a < D; ++a)
            for (int d = 0; d < D; ++d) gradient[a] += X[d] * dual(a, d);
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        Lanes total{};
        for_each_corner(g, p, i, [&](int, const auto& s) { ordo::collect_value(s, g, nodes, total); });
        value += total * w;
    }
};

/// Domain `cell` (CPDI2, CPDI-T): a cell of a mesh whose corners are shared and move with the grid. Weights of the corners
/// are integrals over the cell, or all equal (Sadeghirad et al. 2013); gradients are exact means. V_p is the volume of the
/// cell: with J V0 a uniform stress would leave forces inside. With `is_enriched` corners may be nodes of their own
/// (Sadeghirad et al. 2013, sec. 4).
template <int D, class Basis, bool is_exact, bool is_enriched = false>
struct Cell {
    static constexpr int dim          = D;
    static constexpr int corner_count = 1 << D;
    static constexpr double max_reach = 30.0;

    /// The corners of particle i. On periodic axes particles are put back into the period, but stored corners are not.
    ORDO_FLAT static void get(const Lattice<D>& g, const ParticleView<D>& p, int i, Vec<D> (&x)[corner_count])
    {
        get_corners(p.cell[i], p.corner, x);
        if (!p.turns) return;
        for (int a = 0; a < D; ++a)
            if (g.periodic[a])
                for (Vec<D>& c : x) c[a] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
    }
    /// `is_exact` is a template parameter: testing it at run time would cost `fem` a fifth of its speed (measured).
    ORDO_FLAT static CellWeights<D> weights(const ParticleView<D>& p, int i, const Vec<D> (&x)[corner_count])
    {
        return cell_weights<D, is_exact>(x, p.cell[i].is_simplex());
    }

    /// NaN if the cell has turned over or folded.
    ORDO_FLAT static Lanes reach(const Lattice<D>& g, const ParticleView<D>& p, const Batch& b)
    {
        return each_particle(b, [&](int i) { return reach_of(g, p, i); });
    }
    static double reach_of(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Vec<D> x[corner_count];
        get(g, p, i, x);
        const CellWeights<D> k = weights(p, i, x);
        if (!k.is_sound) return std::numeric_limits<double>::quiet_NaN();
        double r = 0.0;
        for (int c = 0; c < k.count; ++c)
            for (int a = 0; a < D; ++a) r = larger(r, std::fabs(x[c][a] - p.x[i][a]) * g.inv_h[a]);
        return r;
    }

    /// Sets the volume of particle i from its corners; returns its position, sum w_c x_c.
    ORDO_FLAT static Vec<D> settle(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Vec<D> x[corner_count], center{};
        get(g, p, i, x);
        const CellWeights<D> k = weights(p, i, x);
        for (int c = 0; c < k.count; ++c) center += k.w[c] * (x[c] - x[0]);
        p.V[i] = k.V;
        return x[0] + center;
    }

    /// The node of a corner of particle i if the corner is enriched, else -1. On a periodic axis particles that are an odd number
    /// of periods apart write to different images of the node, because they may be in tiles of one colour.
    ORDO_FLAT static std::ptrdiff_t own_node(const Lattice<D>& g, const ParticleView<D>& p, int i, int corner)
    {
        if (!p.corner_node) return -1;
        std::ptrdiff_t node = p.corner_node[p.cell[i][corner]];
        if (node < 0 || !p.turns) return node;
        std::ptrdiff_t images = p.enriched_count;
        for (int a = 0; a < D; ++a) {
            if (!g.periodic[a]) continue;
            if (p.turns[i][a] & 1) node += images;
            images *= 2;
        }
        return node;
    }

    /// f(w_c, g_c, place) for each corner; `place` is a stencil or a node.
    template <class F>
    ORDO_FLAT static void for_each_corner(const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
    {
        Vec<D> x[corner_count];
        get(g, p, i, x);
        const CellWeights<D> k = weights(p, i, x);
        Vec<D, Lanes> y;
        for (int a = 0; a < D; ++a) {
            for (int c = 0; c < 8; ++c) y[a][c] = x[smaller(c % corner_count, k.count - 1)][a];
            y[a] = g.cell_coordinate(a, y[a]);
        }
        for_each_corner_stencil<D, Basis>(g, y, k.count, [&](int c, const auto& s) {
            if constexpr (is_enriched)
                if (const std::ptrdiff_t own = own_node(g, p, i, c); own >= 0) {
                    f(k.w[c], k.g[c], own);
                    return;
                }
            f(k.w[c], k.g[c], s);
        });
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        for_each_corner(g, p, i, [&](double w, const Vec<D>& gc, const auto& place) {
            visit_corner(place, g, [&](std::ptrdiff_t node, double n) { visit(node, w * n, n * gc); });
        });
    }
    template <class Value, class Flux>
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value,
                                 const Flux (&flux)[D])
    {
        for_each_corner(g, p, i, [&](double w, const Vec<D>& gc, const auto& place) {
            Value charge = value * w;
            for (int a = 0; a < D; ++a) charge += flux[a] * gc[a];
            spread_corner(place, g, nodes, charge);
        });
    }
    template <class Value>
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value)
    {
        for_each_corner(g, p, i, [&](double w, const Vec<D>&, const auto& place) { spread_corner(place, g, nodes, value * w); });
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Quad (&gradient)[D])
    {
        for_each_corner(g, p, i, [&](double w, const Vec<D>& gc, const auto& place) {
            const Lanes u = value_at_corner(place, g, nodes);
            value += u * w;
            for (int a = 0; a < D; ++a) gradient[a] += low(u) * gc[a];
        });
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        for_each_corner(g, p, i, [&](double w, const Vec<D>&, const auto& place) {
            const Lanes u = value_at_corner(place, g, nodes);
            value += u * w;
        });
    }
};

}  // namespace ordo
