// Particles that carry a velocity field: linear with a matrix L_p (gradient-enhanced, affine), or a polynomial.
#pragma once

#include "kernels/gather.hpp"
#include "kernels/ldl.hpp"
#include "kernels/scatter.hpp"
#include "shape/affine_point.hpp"

namespace ordo {

/// m_i and (m v)_i of particles whose velocity at x_i is v_p + L_p (x_i - x_p), for shapes that have Arms as slopes.
template <int D>
struct AffineMomentum {
    static constexpr bool has_flux = true;
    using Value                    = Lanes;
    using Flux                     = LowerLanes;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Value& value, Flux (&flux)[D])
    {
        value += mass_momentum(p.m[i], p.v[i], p.V[i]);
        for (int d = 0; d < D; ++d) {
            double mL[3] = {};
            for (int a = 0; a < D; ++a) mL[a] = p.m[i] * p.L[i](a, d);
            flux[d] += LowerLanes::of(mL[0], mL[1], mL[2], 0);
        }
    }
};

/// The plain form for any shape: m_i = sum_p phi_ip m_p and (m v)_i = sum_p phi_ip m_p (v_p + L_p (x_i - x_p)). Nodes of splines
/// are at their Greville points. L_p is the velocity gradient in Wallstedt & Guilkey (2007), the affine matrix in Jiang et al.
/// (2015).
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

/// The plain form for any shape: sets L_p to the affine matrix C_p = B_p D_p^-1 (Jiang et al. 2015), with
/// B_p = sum_i phi_ip v_i (x) (x_i - x_p) and D_p = sum_i phi_ip (x_i - x_p) (x) (x_i - x_p).
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

/// Sets L_p to the velocity gradient sum_i v_i (x) grad phi_ip; with AffineSlopes it is the affine matrix.
template <Shape S>
void keep_gradient(const Sweep<S::dim>& sweep, int begin, int end, TileReport&)
{
    const Sweep<S::dim> s = sweep;
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        FromNodes<S::dim> nodes;
        if (!b.is_full()) nodes = {};
        collect<S, true>(s, b, nodes);
        store(s.p.L, b, nodes.velocity_gradients());
    }
}

/// Polynomials along each axis that are orthogonal in the weights of a particle's nodes: w_k P_n(x_k), and norms
/// sum_k w_k P_n(x_k)^2. P_n is 1, z or z^2 - alpha z - beta with z = (x_k - x_p)/h. Modes are their products over the axes,
/// which are orthogonal too (Fu et al. 2017, sec. 4), numbered with the first axis fastest.
template <int D, class Basis, int degree>
struct ModeRows {
    static constexpr int count = degree + 1, W = Basis::width, modes = power_of(count, D);

    std::ptrdiff_t first = 0;
    double wP[D][count][W];
    double norm[D][count] = {};

    ORDO_FLAT ModeRows(const Lattice<D>& g, const Vec<D>& x)
    {
        for (int a = 0; a < D; ++a) {
            const double y = g.cell_coordinate(a, x[a]);
            double w[W], P[count][W], second = 0.0, third = 0.0;
            const int cell = Basis::row(g, a, y, w);
            first += g.stride[a] * cell;
            for (int k = 0; k < W; ++k) {
                const double z = Arms::distance<Basis>(g, a, k, y, cell);
                P[0][k]        = 1.0;
                P[1][k]        = z;
                second += w[k] * z * z;
                third += w[k] * z * z * z;
            }
            if constexpr (degree > 1)
                for (int k = 0; k < W; ++k) P[2][k] = P[1][k] * (P[1][k] - third / second) - second;
            for (int n = 0; n < count; ++n)
                for (int k = 0; k < W; ++k) {
                    wP[a][n][k] = w[k] * P[n][k];
                    norm[a][n] += wP[a][n][k] * P[n][k];
                }
        }
    }
};

/// Adds sum_n wP_n c_n to the nodes, axis by axis from A down.
template <int A, int D, class Basis, int degree>
ORDO_FLAT inline void spread_modes(const ModeRows<D, Basis, degree>& rows, const Lattice<D>& g, Lanes* node, const Lanes* c)
{
    constexpr int inner = power_of(degree + 1, A);
    for (int k = 0; k < Basis::width; ++k) {
        Lanes rest[inner] = {};
        for (int n = 0; n <= degree; ++n)
            for (int j = 0; j < inner; ++j) rest[j] += c[n * inner + j] * rows.wP[A][n][k];
        if constexpr (A == 0)
            node[k] += rest[0];
        else
            spread_modes<A - 1>(rows, g, node + k * g.stride[A], rest);
    }
}

/// Adds the sums of wP_n times the velocities of the nodes to c_n.
template <int A, int D, class Basis, int degree>
ORDO_FLAT inline void collect_modes(const ModeRows<D, Basis, degree>& rows, const Lattice<D>& g, const Lanes* node, Quad* c)
{
    constexpr int inner = power_of(degree + 1, A);
    for (int k = 0; k < Basis::width; ++k) {
        Quad rest[inner] = {};
        if constexpr (A == 0)
            rest[0] = low(node[k]);
        else
            collect_modes<A - 1>(rows, g, node + k * g.stride[A], rest);
        for (int n = 0; n <= degree; ++n)
            for (int j = 0; j < inner; ++j) c[n * inner + j] += rest[j] * rows.wP[A][n][k];
    }
}

/// Adds m_i and (m v)_i of the particles' polynomials.
template <int D, class Basis, int degree>
void project_modes(const Sweep<D>& sweep, int begin, int end)
{
    using Rows       = ModeRows<D, Basis, degree>;
    const Sweep<D> s = sweep;
    for (int i = begin; i < end; ++i) {
        const Rows rows(s.lattice, s.p.x[i]);
        Lanes c[Rows::modes] = {};
        c[0]                 = mass_momentum(s.p.m[i], s.p.v[i], s.p.V[i]);
        for (int n = 1; n < Rows::modes; ++n)
            for (int a = 0; a < D; ++a) c[n][NodeLane::velocity + a] = s.p.m[i] * s.p.modes[i].c[n][a];
        spread_modes<D - 1>(rows, s.lattice, s.nodes + rows.first, c);
    }
}

/// Fits a polynomial to the nodal velocities around each particle, c_n = sum_i w_i P_n v_i / sum_i w_i P_n^2.
template <int D, class Basis, int degree>
void keep_modes(const Sweep<D>& sweep, int begin, int end, TileReport&)
{
    using Rows       = ModeRows<D, Basis, degree>;
    const Sweep<D> s = sweep;
    for (int i = begin; i < end; ++i) {
        const Rows rows(s.lattice, s.p.x[i]);
        Quad c[Rows::modes] = {};
        collect_modes<D - 1>(rows, s.lattice, s.nodes + rows.first, c);
        int mode = 0;
        IndexBox<D>{{}, Index<D>::filled(degree + 1)}.for_each([&](const Index<D>& n) {
            double norm = 1.0;
            for (int a = 0; a < D; ++a) norm *= rows.norm[a][n[a]];
            for (int a = 0; a < D; ++a) s.p.modes[i].c[mode][a] = norm > 1e-14 ? c[mode][NodeLane::velocity + a] / norm : 0.0;
            ++mode;
        });
    }
}

}  // namespace ordo
