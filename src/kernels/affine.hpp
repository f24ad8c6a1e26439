// Particles whose velocity is a field beside them: linear with a matrix L_p (gradient-enhanced, affine), or a polynomial.
#pragma once

#include "kernels/gather.hpp"
#include "kernels/ldl.hpp"
#include "kernels/scatter.hpp"
#include "shape/affine_point.hpp"

namespace ordo {

/// m_i = sum_p phi_ip m_p and (m v)_i = sum_p phi_ip m_p (v_p + L_p (x_i - x_p)), with nodes of splines at their Greville
/// points. With L_p the velocity gradient Wallstedt & Guilkey (2007), with the affine matrix Jiang et al. (2015).
template <Shape S>
void project_affine(const Sweep<S::dim>& sweep, int begin, int end)
{
    constexpr int D  = S::dim;
    const Sweep<D> s = sweep;
    Lanes* nodes     = s.nodes;
    for (int i = begin; i < end; ++i) {
        const double m = s.p.m[i], V = s.p.V[i];
        S::for_each_node(s.lattice, s.p, i, s.nodes, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            const Vec<D> v = s.p.v[i] + s.p.L[i] * (place_of_node(s.lattice, node) - s.p.x[i]);
            nodes[node] += mass_momentum(m, v, V) * w;
        });
    }
}

/// The affine matrix C_p = B_p D_p^-1, B_p = sum_i phi_ip v_i (x) (x_i - x_p), D_p = sum_i phi_ip (x_i - x_p) (x) (x_i - x_p)
/// (Jiang et al. 2015), becomes L_p. D_p is summed, not h^2/4: that is wrong near clamped faces.
template <Shape S>
void keep_affine(const Sweep<S::dim>& sweep, int begin, int end, TileReport&)
{
    constexpr int D  = S::dim;
    const Sweep<D> s = sweep;
    for (int i = begin; i < end; ++i) {
        double B[D][D] = {}, M[D][D] = {};
        S::for_each_node(s.lattice, s.p, i, s.nodes, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            const Vec<D> d = place_of_node(s.lattice, node) - s.p.x[i];
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) {
                    B[a][b] += w * s.nodes[node][NodeLane::velocity + a] * d[b];
                    M[a][b] += w * d[a] * d[b];
                }
        });
        const Ldl<D> inertia(M);
        for (int a = 0; a < D; ++a) {
            inertia.solve(B[a]);
            for (int b = 0; b < D; ++b) s.p.L[i](a, b) = B[a][b];
        }
    }
}

/// L_p becomes the velocity gradient sum_i v_i (x) grad phi_ip.
template <Shape S>
void keep_gradient(const Sweep<S::dim>& sweep, int begin, int end, TileReport&)
{
    constexpr int D  = S::dim;
    const Sweep<D> s = sweep;
    for (int i = begin; i < end; ++i) {
        Lanes value{};
        Quad gradient[D] = {};
        S::collect(s.lattice, s.p, i, s.nodes, value, gradient);
        s.p.L[i] = velocity_gradient(gradient);
    }
}

/// f(node, w_i, products of the axes' orthogonal polynomials at node i) for each node of a particle, and their norms
/// sum_i w_i P_k(x_i)^2. The polynomials of degree 0..r along an axis are orthogonal in the weights there: 1, z, and
/// z^2 - alpha z - beta with z = (x_i - x_p)/h. Those of several axes are then orthogonal too (Fu et al. 2017, sec. 4).
template <int D, class Basis, int degree, class F>
ORDO_FLAT inline void for_each_mode(const Lattice<D>& g, const ParticleView<D>& p, int i, double (&norm)[power_of(degree + 1, D)],
                                    F&& f)
{
    constexpr int count = degree + 1, modes = power_of(count, D), W = Basis::width;
    const Stencil<D, W> s = Point<D, Basis>::stencil(g, p, i);
    const Index<D> first  = g.index(s.first);
    double P[D][count][W], size[D][count] = {};
    for (int a = 0; a < D; ++a) {
        double second = 0.0, third = 0.0;
        for (int k = 0; k < W; ++k) {
            const double z = (g.node_position(a, first[a] + k) - p.x[i][a]) * g.inv_h[a];
            P[a][0][k]     = 1.0;
            P[a][1][k]     = z;
            second += s.w[a][k] * z * z;
            third += s.w[a][k] * z * z * z;
        }
        if constexpr (degree > 1)
            for (int k = 0; k < W; ++k) P[a][2][k] = P[a][1][k] * (P[a][1][k] - third / second) - second;
        for (int n = 0; n < count; ++n)
            for (int k = 0; k < W; ++k) size[a][n] += s.w[a][k] * P[a][n][k] * P[a][n][k];
    }
    const IndexBox<D> powers{{}, Index<D>::filled(count)};
    int mode = 0;
    powers.for_each([&](const Index<D>& n) {
        norm[mode] = 1.0;
        for (int a = 0; a < D; ++a) norm[mode] *= size[a][n[a]];
        ++mode;
    });
    IndexBox<D>{{}, Index<D>::filled(W)}.for_each([&](const Index<D>& k) {
        double w = 1.0, product[modes];
        for (int a = 0; a < D; ++a) w *= s.w[a][k[a]];
        int m = 0;
        powers.for_each([&](const Index<D>& n) {
            product[m] = 1.0;
            for (int a = 0; a < D; ++a) product[m] *= P[a][n[a]][k[a]];
            ++m;
        });
        f(s.first + g.offset(k), w, product);
    });
}

/// m_i and (m v)_i of the particles' polynomials.
template <int D, class Basis, int degree>
void project_modes(const Sweep<D>& sweep, int begin, int end)
{
    constexpr int modes = power_of(degree + 1, D);
    const Sweep<D> s    = sweep;
    Lanes* nodes        = s.nodes;
    for (int i = begin; i < end; ++i) {
        const double m = s.p.m[i], V = s.p.V[i];
        double norm[modes];
        for_each_mode<D, Basis, degree>(s.lattice, s.p, i, norm, [&](std::ptrdiff_t node, double w, const double* product) {
            Vec<D> v = s.p.v[i];
            for (int k = 1; k < modes; ++k) v += product[k] * s.p.modes[i].c[k];
            nodes[node] += mass_momentum(m, v, V) * w;
        });
    }
}

/// The polynomials of the nodes' velocities around each particle, c_k = sum_i w_i P_k v_i / sum_i w_i P_k^2.
template <int D, class Basis, int degree>
void keep_modes(const Sweep<D>& sweep, int begin, int end, TileReport&)
{
    constexpr int modes = power_of(degree + 1, D);
    const Sweep<D> s    = sweep;
    for (int i = begin; i < end; ++i) {
        double norm[modes];
        Vec<D> c[modes]{};
        for_each_mode<D, Basis, degree>(s.lattice, s.p, i, norm, [&](std::ptrdiff_t node, double w, const double* product) {
            for (int k = 0; k < modes; ++k)
                for (int a = 0; a < D; ++a) c[k][a] += w * product[k] * s.nodes[node][NodeLane::velocity + a];
        });
        for (int k = 0; k < modes; ++k) s.p.modes[i].c[k] = norm[k] > 1e-14 ? c[k] * (1 / norm[k]) : Vec<D>{};
    }
}

}  // namespace ordo
