// Domains `box` and `stretched-box`: phi_ip is the mean of N_i over a box of half-lengths l_p (GIMP).
// Bardenhagen & Kober (2004); Gong (2015) sec. 6.3 with errata 24-27: the normaliser is the length 2 l_p of the support.
#pragma once

#include "shape/interval_mean.hpp"
#include "shape/shape.hpp"
#include "shape/stencil.hpp"

#include <cmath>
#include <limits>

namespace ordo {

template <int D, class Basis>
struct Box {
    static constexpr int dim = D;
    /// The largest distance in cells from centre to side; beyond it the run ends with a NumericalError.
    static constexpr double max_reach = 7.0;
    static constexpr int max_count    = 15 + Basis::degree;
    /// Up to this half-length in cells both ends lie in the same or in neighbouring cells, whatever the rounding.
    static constexpr double most_of_three_nodes = 0.5 - 1e-9;

    /// NaN if a stretched box has turned over.
    ORDO_FLAT static Lanes reach(const Lattice<D>& g, const ParticleView<D>& p, const Batch& b)
    {
        const Vec<D, Lanes> half = load(p.half, b);
        Lanes r{}, least = half[0];
        for (int a = 0; a < D; ++a) {
            r     = larger(r, half[a] * g.inv_h[a]);
            least = smaller(least, half[a]);
        }
        for (int k = 0; k < Batch::size; ++k)
            if (!(least[k] > 0)) r[k] = std::numeric_limits<double>::quiet_NaN();
        return r;
    }

    template <int W>
    ORDO_FLAT static Stencil<D, W> stencil(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Stencil<D, W> s;
        s.first = 0;
        for (int a = 0; a < D; ++a) {
            const double l   = p.half[i][a] * g.inv_h[a];
            const double y   = g.cell_coordinate(a, p.x[i][a]);
            const double low = y - l, high = y + l;
            int cells      = 0;
            const int cell = IntervalMean<Basis>::first(g, a, low, high, cells);
            s.first += g.stride[a] * cell;
            s.count[a] = cells + Basis::degree;
            ORDO_EXPECT(cell >= 0 && cell + s.size(a) <= g.nodes[a] && s.size(a) <= s.capacity);
            IntervalMean<Basis>::fill(g, a, low, high, cell, s.size(a), s.w[a], s.dw[a]);
            for (int k = 0; k < s.size(a); ++k) s.dw[a][k] *= g.inv_h[a];
        }
        return s;
    }

    /// f(k, stencil) for the particles of a batch.
    template <class F>
    ORDO_FLAT static void for_each_stencil(const Lattice<D>& g, const ParticleView<D>& p, const Batch& b,
                                           F&& f) requires(IntervalMean<Basis>::takes_lanes)
    {
        constexpr int W = Basis::degree + 2;
        if (largest(reach(g, p, b)) < most_of_three_nodes) {
            const Vec<D, Lanes> x = load(p.x, b), half = load(p.half, b);
            Stencils<D, W> s;
            for (int a = 0; a < D; ++a) {
                const Lanes y = g.cell_coordinate(a, x[a]), l = half[a] * g.inv_h[a], cell = truncate(y - l);
                s.first += cell * static_cast<double>(g.stride[a]);
                IntervalMean<Basis>::fill(y - l, y + l, cell, W, s.w[a], s.dw[a]);
                for (Lanes& d : s.dw[a]) d *= Lanes(g.inv_h[a]);
            }
            for (int k = 0; k < b.count; ++k) f(k, s.of(k));
        } else {
            for (int k = 0; k < b.count; ++k) f(k, OneParticle<Box>{p, b.first + k});
        }
    }

    /// f(stencil): degree + 2 nodes per axis suffice for boxes up to a cell wide.
    template <class F>
    ORDO_FLAT static void with_stencil(const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
    {
        double widest = 0.0;
        for (int a = 0; a < D; ++a) widest = larger(widest, p.half[i][a] * g.inv_h[a]);
        if (widest < most_of_three_nodes)
            f(stencil<Basis::degree + 2>(g, p, i));
        else
            f(stencil<-max_count>(g, p, i));
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::for_each_node(s, g, visit); });
    }
    template <class Value, class Flux>
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value,
                                 const Flux (&flux)[D])
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::spread(s, g, nodes, value, flux); });
    }
    template <class Value>
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value)
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::spread_value(s, g, nodes, value); });
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Quad (&gradient)[D])
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::collect(s, g, nodes, value, gradient); });
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::collect_value(s, g, nodes, value); });
    }
};

}  // namespace ordo
