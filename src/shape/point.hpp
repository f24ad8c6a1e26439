// Domain `point`: phi_ip = N_i(x_p).
#pragma once

#include "shape/shape.hpp"
#include "shape/stencil.hpp"

#include <cmath>

namespace ordo {

/// Slopes of the functions themselves, converted from 1/cell to 1/m.
struct OwnSlopes {
    template <class Basis, int D, class T, class Cell>
    ORDO_FLAT static void set(const Lattice<D>& g, int a, const T&, const Cell&, const T (&)[Basis::width], T (&dw)[Basis::width])
    {
        for (T& d : dw) d *= T(g.inv_h[a]);
    }
};

/// `Slopes` may replace the slopes in the rows, see affine_point.hpp.
template <int D, class Basis, class Slopes = OwnSlopes>
struct Point {
    static constexpr int dim          = D;
    static constexpr double max_reach = 0.0;
    using Row                         = Stencil<D, Basis::width>;

    ORDO_FLAT static Lanes reach(const Lattice<D>&, const ParticleView<D>&, const Batch&) { return Lanes(0.0); }

    ORDO_FLAT static Row stencil(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Row s;
        s.first = 0;
        for (int a = 0; a < D; ++a) {
            const double y = g.cell_coordinate(a, p.x[i][a]);
            const int cell = Basis::row(g, a, y, s.w[a], s.dw[a]);
            ORDO_EXPECT(cell >= 0 && cell + Basis::width <= g.nodes[a]);
            s.first += g.stride[a] * cell;
            Slopes::template set<Basis>(g, a, y, cell, s.w[a], s.dw[a]);
        }
        return s;
    }
    /// f(k, stencil) for the particles of a batch.
    template <class F>
    ORDO_FLAT static void for_each_stencil(const Lattice<D>& g, const ParticleView<D>& p, const Batch& b, F&& f)
    {
        const Vec<D, Lanes> x = load(p.x, b);
        Stencils<D, Basis::width> s;
        bool are_alike = true;
        for (int a = 0; a < D && are_alike; ++a) {
            Lanes cell{};
            const Lanes y = g.cell_coordinate(a, x[a]);
            are_alike     = Basis::rows(g, a, y, cell, s.w[a], s.dw[a]);
            s.first += cell * static_cast<double>(g.stride[a]);
            Slopes::template set<Basis>(g, a, y, cell, s.w[a], s.dw[a]);
        }
        for (int k = 0; k < b.count; ++k) {
            if (!are_alike) s.set(k, stencil(g, p, b.first + k));
            f(k, s.of(k));
        }
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        ordo::for_each_node(stencil(g, p, i), g, visit);
    }
    template <class Value, class Flux>
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value,
                                 const Flux (&flux)[D])
    {
        ordo::spread(stencil(g, p, i), g, nodes, value, flux);
    }
    template <class Value>
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value)
    {
        ordo::spread_value(stencil(g, p, i), g, nodes, value);
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Quad (&gradient)[D])
    {
        ordo::collect(stencil(g, p, i), g, nodes, value, gradient);
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        ordo::collect_value(stencil(g, p, i), g, nodes, value);
    }
};

/// The field sum_i N_i(x) n_i of node records n_i; on a periodic axis x may lie outside the period.
template <int D, class Basis>
ORDO_FLAT inline Lanes interpolate(const Lattice<D>& g, const Lanes* nodes, const Vec<D>& x)
{
    Stencil<D, Basis::width> s;
    s.first = 0;
    for (int a = 0; a < D; ++a) {
        double y = g.cell_coordinate(a, x[a]);
        if (g.periodic[a]) y -= g.cells[a] * std::floor((y - g.margin) / g.cells[a]);
        const int cell = Basis::row(g, a, y, s.w[a]);
        ORDO_EXPECT(cell >= 0 && cell + Basis::width <= g.nodes[a]);
        s.first += g.stride[a] * cell;
    }
    Lanes value{};
    ordo::collect_value(s, g, nodes, value);
    return value;
}

}  // namespace ordo
