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

/// The means of a basis over [low, high] along one axis and their slopes per cell, for all functions that the interval touches.
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
    template <class T>
    ORDO_FLAT static T hat(const T& t)
    {
        return larger(T(0.0), 1 - fabs(t));
    }
    /// The integral of the hat over [a, b], each side by itself, which avoids cancellation near the ends of the hat. Otherwise a
    /// box that ends at a cell face could leave a gradient but no weight at the node beyond.
    template <class T>
    ORDO_FLAT static T hat_integral(const T& a, const T& b)
    {
        auto between = [](const T& t, double low, double high) { return smaller(larger(t, T(low)), T(high)); };
        const T a0 = between(a, -1.0, 0.0), b0 = between(b, -1.0, 0.0), a1 = between(a, 0.0, 1.0), b1 = between(b, 0.0, 1.0);
        return 0.5 * ((b0 - a0) * (2 + a0 + b0) + (b1 - a1) * (2 - a1 - b1));
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
        fill(low, high, static_cast<double>(cell), count, w, dw);
    }
    template <class T>
    ORDO_FLAT static void fill(const T& low, const T& high, const T& cell, int count, T* w, T* dw)
    {
        const T norm = T(1.0) / (high - low);
        for (int k = 0; k < count; ++k) {
            const T a = low - cell - k, b = high - cell - k;
            w[k]  = hat_integral(a, b) * norm;
            dw[k] = (hat(b) - hat(a)) * norm;
        }
    }
};

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
                                           F&& f) requires std::same_as<Basis, Hat>
    {
        constexpr int W = Hat::degree + 2;
        if (largest(reach(g, p, b)) < most_of_three_nodes) {
            const Vec<D, Lanes> x = load(p.x, b), half = load(p.half, b);
            Stencils<D, W> s;
            for (int a = 0; a < D; ++a) {
                const Lanes y = g.cell_coordinate(a, x[a]), l = half[a] * g.inv_h[a], cell = truncate(y - l);
                s.first += cell * static_cast<double>(g.stride[a]);
                IntervalMean<Hat>::fill(y - l, y + l, cell, W, s.w[a], s.dw[a]);
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
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value,
                                 const Lanes (&flux)[D])
    {
        with_stencil(g, p, i, [&](const auto& s) { ordo::spread(s, g, nodes, value, flux); });
    }
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value)
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
static_assert(Shape<Box<2, Hat>>);

}  // namespace ordo
