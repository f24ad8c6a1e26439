// Domains with corners: phi_ip = sum_c w_c N_i(x_c), grad phi_ip = sum_c g_c N_i(x_c).
// A particle leaves a charge at each corner, which is spread with plain hats: no gradient, no search for duplicate nodes.
#pragma once

#include "shape/hat.hpp"
#include "shape/shape.hpp"
#include "shape/stencil.hpp"

#include <cmath>

namespace ordo {

/// Domain `parallelepiped` (CPDI1): corners x_p + sum_d s_d r_d, s_d = -1 or 1, with half-edge vectors r_d.
/// w_c = 2^-D; g_c = 2^-D sum_d s_d r^d with the dual vectors r^d . r_e = delta_de (Gong 2015, 6.27; errata 28).
template <int D, class Basis>
struct Parallelepiped {
    static constexpr int dim          = D;
    static constexpr int corner_count = 1 << D;
    static constexpr double w         = 1.0 / corner_count;
    /// Corners further away than this many cells make tiles so wide that the run rather ends with a NumericalError.
    static constexpr double max_reach = 30.0;

    ORDO_FLAT static double reach(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        double r = 0.0;
        for (int a = 0; a < D; ++a) {
            double sum = 0.0;
            for (int d = 0; d < D; ++d) sum += std::fabs(p.edges[i](a, d));
            r = larger(r, sum * g.inv_h[a]);
        }
        return r;
    }

    /// The columns are the dual vectors r^d times 2^-D.
    ORDO_FLAT static Mat<D> scaled_duals(const Mat<D>& r) { return cofactor(r) * (w / det(r)); }
    ORDO_FLAT static double sign(int corner, int d) { return corner >> d & 1 ? 1.0 : -1.0; }

    /// f(corner, first node, rows): the hats at each corner.
    template <class F>
    ORDO_FLAT static void for_each_corner(const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
    {
        const Mat<D>& r = p.edges[i];
        Vec<D> y{};
        Mat<D> e{};
        for (int a = 0; a < D; ++a) {
            y[a] = g.cell_coordinate(a, p.x[i][a]);
            for (int d = 0; d < D; ++d) e(a, d) = r(a, d) * g.inv_h[a];
        }
        for (int c = 0; c < corner_count; ++c) {
            Stencil<D, Basis::width> s;
            s.first = 0;
            for (int a = 0; a < D; ++a) {
                double at = y[a];
                for (int d = 0; d < D; ++d) at += sign(c, d) * e(a, d);
                const int cell = Basis::row(at, s.w[a]);
                ORDO_EXPECT(cell >= 0 && cell + Basis::width <= g.nodes[a]);
                s.first += g.stride[a] * cell;
            }
            f(c, s);
        }
    }

    template <class Visit>
    ORDO_FLAT static void for_each_node(const Lattice<D>& g, const ParticleView<D>& p, int i, Visit&& visit)
    {
        const Mat<D> dual = scaled_duals(p.edges[i]);
        for_each_corner(g, p, i, [&](int c, auto& s) {
            Vec<D> gc{};
            for (int d = 0; d < D; ++d) gc += sign(c, d) * column(dual, d);
            for (auto& row : s.dw)
                for (double& x : row) x = 0.0;
            ordo::for_each_node(s, g, [&](std::ptrdiff_t node, double n, const Vec<D>&) { visit(node, w * n, n * gc); });
        });
    }

    ORDO_FLAT static void spread(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value,
                                 const Lanes (&flux)[D])
    {
        const Mat<D> dual = scaled_duals(p.edges[i]);
        const Lanes A     = value * w;
        Lanes X[D]        = {};
        for (int d = 0; d < D; ++d)
            for (int a = 0; a < D; ++a) X[d] += flux[a] * dual(a, d);
        for_each_corner(g, p, i, [&](int c, const auto& s) {
            Lanes charge = A;
            for (int d = 0; d < D; ++d) charge += X[d] * sign(c, d);
            spread_value_axis<D - 1>(s, g, nodes + s.first, charge);
        });
    }
    ORDO_FLAT static void spread_value(const Lattice<D>& g, const ParticleView<D>& p, int i, Lanes* nodes, const Lanes& value)
    {
        const Lanes A = value * w;
        for_each_corner(g, p, i, [&](int, const auto& s) { spread_value_axis<D - 1>(s, g, nodes + s.first, A); });
    }
    ORDO_FLAT static void collect(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value,
                                  Lanes (&gradient)[D])
    {
        Lanes total{};
        Lanes X[D] = {};
        for_each_corner(g, p, i, [&](int c, const auto& s) {
            Lanes u{};
            collect_value_axis<D - 1>(s, g, nodes + s.first, u);
            total += u;
            for (int d = 0; d < D; ++d) X[d] += u * sign(c, d);
        });
        value += total * w;
        const Mat<D> dual = scaled_duals(p.edges[i]);
        for (int a = 0; a < D; ++a)
            for (int d = 0; d < D; ++d) gradient[a] += X[d] * dual(a, d);
    }
    ORDO_FLAT static void collect_value(const Lattice<D>& g, const ParticleView<D>& p, int i, const Lanes* nodes, Lanes& value)
    {
        Lanes total{};
        for_each_corner(g, p, i, [&](int, const auto& s) { collect_value_axis<D - 1>(s, g, nodes + s.first, total); });
        value += total * w;
    }
};


static_assert(Shape<Parallelepiped<2, Hat>>);

}  // namespace ordo
