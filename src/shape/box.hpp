// Domains `box` and `stretched-box`: phi_ip is the mean of N_i over a box of half-lengths l_p (GIMP).
// Bardenhagen & Kober (2004); Gong (2015) sec. 6.3 with errata 24-27: the normaliser is the length 2 l_p of the support.
#pragma once

#include "shape/bspline.hpp"
#include "shape/hat.hpp"
#include "shape/shape.hpp"
#include "shape/stencil.hpp"

#include <cmath>
#include <limits>

namespace ordo {

/// The means of a basis over [low, high] of one axis and their slopes per cell: f(k, w, dw) for count functions from `first`
/// on. Every function that the interval touches is among them.
template <class Basis>
struct IntervalMean {
    /// The first function and the number of cells that the interval touches.
    template <int D>
    ORDO_FLAT static int first(const Lattice<D>& g, int a, double low, double high, int& cells)
    {
        int before, after;
        const int cell = Basis::locate(g, a, low, before, after);
        cells          = Basis::locate(g, a, high, before, after) - cell + 1;
        return cell;
    }
    /// Two Gauss points a cell are exact for splines up to the third degree.
    template <int D>
    ORDO_FLAT static void fill(const Lattice<D>& g, int a, double low, double high, int cell, int count, double* w, double* dw)
    {
        constexpr double gauss = 0.57735026918962576;
        const double norm      = 1 / (high - low);
        for (int k = 0; k < count; ++k) w[k] = dw[k] = 0.0;
        double row[Basis::width];
        auto add = [&](double y, double factor, double* to) {
            const int at = Basis::row(g, a, y, row) - cell;
            for (int k = 0; k < Basis::width; ++k) to[at + k] += factor * row[k];
        };
        for (double from = low; from < high;) {
            const double to   = smaller(high, std::floor(from) + 1);
            const double half = 0.5 * (to - from), middle = 0.5 * (to + from);
            add(middle - gauss * half, half * norm, w);
            add(middle + gauss * half, half * norm, w);
            from = to;
        }
        add(high, norm, dw);
        add(low, -norm, dw);
    }
};

template <>
struct IntervalMean<Hat> {
    /// The hat N(t) and its integral from -infinity.
    ORDO_FLAT static double hat(double t) { return larger(0.0, 1 - std::fabs(t)); }
    /// The integral of the hat over [a, b], without cancellation near its ends: a box on a cell face would else leave a
    /// gradient without weight at the node beyond.
    ORDO_FLAT static double hat_integral(double a, double b)
    {
        a = smaller(larger(a, -1.0), 1.0);
        b = smaller(larger(b, -1.0), 1.0);
        if (a >= 0) return 0.5 * (b - a) * (2 - a - b);
        if (b <= 0) return 0.5 * (b - a) * (2 + a + b);
        return 0.5 * (b * (2 - b) - a * (2 + a));
    }
    template <int D>
    ORDO_FLAT static int first(const Lattice<D>&, int, double low, double high, int& cells)
    {
        const int cell = static_cast<int>(low);
        cells          = static_cast<int>(high) - cell + 1;
        return cell;
    }
    template <int D>
    ORDO_FLAT static void fill(const Lattice<D>&, int, double low, double high, int cell, int count, double* w, double* dw)
    {
        const double norm = 1 / (high - low);
        for (int k = 0; k < count; ++k) {
            w[k]  = hat_integral(low - cell - k, high - cell - k) * norm;
            dw[k] = (hat(high - cell - k) - hat(low - cell - k)) * norm;
        }
    }
};

template <int D, class Basis>
struct Box {
    static constexpr int dim = D;
    /// The widest box in cells from centre to side; beyond it the run ends with a NumericalError.
    static constexpr double max_reach = 7.0;
    static constexpr int max_count    = 15 + Basis::degree;

    ORDO_FLAT static double reach(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        double r = 0.0;
        for (int a = 0; a < D; ++a) {
            if (!(p.half[i][a] > 0)) return std::numeric_limits<double>::quiet_NaN();  // a stretched box that has turned over
            r = larger(r, p.half[i][a] * g.inv_h[a]);
        }
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

    /// f(stencil): degree + 2 nodes an axis suffice for boxes up to a cell wide.
    template <class F>
    ORDO_FLAT static void with_stencil(const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
    {
        if (reach(g, p, i) < 0.5 - 1e-9)  // rounding may not put the ends into three cells
            f(stencil<Basis::degree + 2>(g, p, i));
        else
            f(stencil<-max_count>(g, p, i));
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes*, Visit&& visit)
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::for_each_node(s, g, visit); });
    }
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value,
                                 const Lanes (&flux)[D])
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::spread(s, g, nodes, value, flux); });
    }
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value)
    {
        with_stencil(g, p, i, [&](const auto& s) { spread_value_axis<D - 1>(s, g, nodes + s.first, value); });
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Lanes (&gradient)[D])
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::collect(s, g, nodes, value, gradient); });
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        with_stencil(g, p, i, [&](const auto& s) { collect_value_axis<D - 1>(s, g, nodes + s.first, value); });
    }
};
static_assert(Shape<Box<2, Hat>>);

}  // namespace ordo
