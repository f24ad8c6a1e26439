// Basis `ddmpm`: hats whose gradient at a particle blends into a continuous one. Zhang, Ma & Giguere (2011); Wobbes et al.
// (2020) sec. 2.2.
#pragma once

#include "shape/hat.hpp"
#include "shape/point.hpp"
#include "shape/shape.hpp"

namespace ordo {

/// Along each axis grad~ N_i = alpha grad N_i + (1 - alpha) sum_j N_j(x) (1/V_j) int N_j grad N_i, the sum along that axis,
/// times the plain hats of the other axes. alpha = a0 (1 - xi^2), xi in [-1, 1] across the cell: zero on its faces. The second
/// part is the central difference at node j. If its neighbour on one side has no mass (at the end of the grid or of the
/// material), it is the difference to the other side, so the gradient never needs a missing velocity. So nodes must have
/// their masses before gradients are used.
template <int D>
struct DualDomain {
    static constexpr int dim          = D;
    static constexpr double max_reach = 1.0;
    using Plain                       = Point<D, Hat>;
    using Row                         = typename Plain::Row;

    /// The gradient reaches one cell further than the values.
    ORDO_FLAT static Lanes reach(const Lattice<D>&, const ParticleView<D>&, const Batch&) { return Lanes(max_reach); }

    /// alpha of each axis.
    ORDO_FLAT static Vec<D> blend(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        Vec<D> alpha{};
        for (int a = 0; a < D; ++a) {
            const double y  = g.cell_coordinate(a, p.x[i][a]);
            const double xi = 2 * (y - static_cast<int>(y)) - 1;
            alpha[a]        = g.basis.a0 * (1 - xi * xi);
        }
        return alpha;
    }

    /// The smoothed derivative along an axis is the difference of these two nodes times `factor`.
    struct Difference {
        std::ptrdiff_t before, after;
        double factor;
    };
    ORDO_FLAT static Difference difference(const Lattice<D>& g, const Lanes* nodes, std::ptrdiff_t node, int a)
    {
        const std::ptrdiff_t step = g.stride[a];
        const bool before = nodes[node - step][NodeLane::mass] > 0, after = nodes[node + step][NodeLane::mass] > 0;
        return {before ? node - step : node, after ? node + step : node, g.inv_h[a] * (before && after ? 0.5 : 1.0)};
    }

    /// The stencil with slopes alpha grad N, and f(axis, N_j (1 - alpha), difference at node j) for the smoothed part.
    template <class F>
    ORDO_FLAT static Row parts(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, F&& f)
    {
        Row s              = Plain::stencil(g, p, i);
        const Vec<D> alpha = blend(g, p, i);
        ordo::for_each_value(s, g, [&](std::ptrdiff_t node, double w) {
            for (int a = 0; a < D; ++a) f(a, (1 - alpha[a]) * w, difference(g, nodes, node, a));
        });
        for (int a = 0; a < D; ++a)
            for (double& d : s.dw[a]) d *= alpha[a];
        return s;
    }

    /// Visits a node several times.
    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Visit&& visit)
    {
        const Row s = parts(g, p, i, nodes, [&](int a, double w, const Difference& d) {
            Vec<D> dw{};
            dw[a] = w * d.factor;
            visit(d.after, 0.0, dw);
            visit(d.before, 0.0, -dw);
        });
        ordo::for_each_node(s, g, visit);
    }
    template <class Value, class Flux>
    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value,
                                 const Flux (&flux)[D])
    {
        const Row s = parts(g, p, i, nodes, [&](int a, double w, const Difference& d) {
            nodes[d.after] += flux[a] * (w * d.factor);
            nodes[d.before] += flux[a] * (-w * d.factor);
        });
        ordo::spread(s, g, nodes, value, flux);
    }
    template <class Value>
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Value& value)
    {
        Plain::spread_value(g, p, i, nodes, value);
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Quad (&gradient)[D])
    {
        const Row s = parts(g, p, i, nodes, [&](int a, double w, const Difference& d) {
            gradient[a] += low(nodes[d.after] - nodes[d.before]) * (w * d.factor);
        });
        ordo::collect(s, g, nodes, value, gradient);
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        Plain::collect_value(g, p, i, nodes, value);
    }
};
static_assert(Shape<DualDomain<2>>);

}  // namespace ordo
