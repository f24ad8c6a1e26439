// Nodes to particles: velocity update, stress update and motion, fused at will in one sweep over the particles.
#pragma once

#include "kernels/cell_gradient.hpp"
#include "kernels/sweep.hpp"
#include "shape/point.hpp"

#include <cmath>

namespace ordo {

/// What a gather does. Shape functions are those of x^n in every pass: only `move`, the last one, changes x and domains.
enum GatherPart : unsigned {
    kUpdateVelocity = 1u,  ///< v_p += sum phi dv_i (FLIP), or a part of it (PIC)
    kUpdateStress   = 2u,  ///< F_p = (I + dt L_p) F_p; sigma_p; V_p = J V0
    kMove           = 4u,  ///< x_p += dt sum phi v_i; the domain follows F_p. Cells move otherwise, see move_corners
    kStressOfPast   = 8u,  ///< kUpdateStress by the step that led here: x^n is its end, not its start
};

/// L from the gradients of the lanes of a node.
template <int D>
ORDO_FLAT inline Mat<D> velocity_gradient(const Lanes (&gradient)[D])
{
    Mat<D> L{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) L(a, b) = gradient[b][NodeLane::velocity + a];
    return L;
}

/// The displacement gradient of a step with respect to its start, from dt L with respect to its end: the step back is
/// I - dt L. Taking dt L itself would be first order. (I - dt L)^-1 - I, written so that small steps do not cancel.
template <int D>
ORDO_FLAT inline Mat<D> from_start(const Mat<D>& dtL)
{
    return inverse(Mat<D>::identity() - dtL) * dtL;
}

/// F, sigma and V of particle i from dt L, the displacement gradient of the step with respect to its start.
template <int D>
ORDO_FLAT inline void deform(const Sweep<D>& s, int i, const Mat<D>& dtL, TileReport& report)
{
    const ParticleView<D>& p = s.p;
    const Mat<D> F           = p.F[i] + dtL * p.F[i];
    const double J           = det(F);
    p.F[i]                   = F;
    if (!p.cell) p.V[i] = J * p.V0[i];  // a cell has the volume between its corners
    if (!(J > 0)) report.flag(std::isfinite(J) ? Fault::inverted : Fault::not_finite, i);
    with_material<D>(s.materials[p.material[i]], [&](const auto& law) {
        if constexpr (Hyperelastic<std::decay_t<decltype(law)>>)
            p.sigma[i] = law.cauchy(F);
        else
            p.sigma[i] = law.update(p.sigma[i], dtL);
    });
    if (!std::isfinite(trace(p.sigma[i]))) report.flag(Fault::not_finite, i);
}

/// Particle i is at x from now on: notes how far it went and whether it is still in the grid.
template <int D>
ORDO_FLAT inline void place(const Sweep<D>& s, int i, const Vec<D>& x, TileReport& report)
{
    const ParticleView<D>& p = s.p;
    for (int a = 0; a < D; ++a) {
        report.move    = larger(report.move, std::fabs(x[a] - p.x[i][a]) * s.lattice.inv_h[a]);
        p.x[i][a]      = x[a];
        const double y = s.lattice.cell_coordinate(a, x[a]) - s.lattice.margin;
        if (!std::isfinite(y))
            report.flag(Fault::not_finite, i);
        else if (!s.lattice.periodic[a] && !(y >= 0 && y <= s.lattice.cells[a]))
            report.flag(Fault::left_grid, i);
    }
}

/// Notes how far the domain of particle i reaches.
template <Shape S, int D>
ORDO_FLAT inline void measure_reach(const Sweep<D>& s, int i, TileReport& report)
{
    const double reach = S::reach(s.lattice, s.p, i);
    report.reach       = larger(report.reach, reach);
    if (!(reach <= S::max_reach)) report.flag(std::isnan(reach) ? Fault::domain_turned : Fault::domain_too_wide, i);
}

/// The gather of particles [begin, end). Evolution is how the domain follows F.
template <Shape S, class Evolution, unsigned parts>
void gather(const Sweep<S::dim>& sweep, int begin, int end, TileReport& out)
{
    constexpr int D   = S::dim;
    const Sweep<D> s  = sweep;  // copies that no store to a particle can alias
    TileReport report = out;
    for (int i = begin; i < end; ++i) {
        Lanes value{};
        Mat<D> dtL{};
        if constexpr ((parts & kUpdateStress) != 0) {
            if (s.gradients && interpolate_gradient(s, i, dtL)) {
                if constexpr ((parts & (kUpdateVelocity | kMove)) != 0) S::collect_value(s.lattice, s.p, i, s.nodes, value);
            } else {
                Lanes gradient[D] = {};
                S::collect(s.lattice, s.p, i, s.nodes, value, gradient);
                dtL = velocity_gradient(gradient);
            }
            if (s.keeps_gradient) s.p.L[i] = dtL;
            dtL *= s.dt;
        } else {
            S::collect_value(s.lattice, s.p, i, s.nodes, value);
        }
        Vec<D> v{}, dv{};
        for (int a = 0; a < D; ++a) {
            v[a]  = value[NodeLane::velocity + a];
            dv[a] = value[NodeLane::increment + a];
        }
        if constexpr ((parts & kUpdateVelocity) != 0) {
            s.p.v[i] = (1 - s.pic) * (s.p.v[i] + dv) + s.pic * v;
            if (!std::isfinite(dot(s.p.v[i], s.p.v[i]))) report.flag(Fault::not_finite, i);
        }
        if constexpr ((parts & kStressOfPast) != 0) dtL = from_start(dtL);
        if constexpr ((parts & kUpdateStress) != 0) deform(s, i, dtL, report);
        if constexpr ((parts & kMove) != 0) {
            place(s, i, s.p.x[i] + s.dt * v, report);
            Evolution::apply(s, i);
            measure_reach<S>(s, i, report);
        }
    }
    out = report;
}

/// Shared corners [begin, end) move with the nodes: x_c += dt sum N_i(x_c) v_i; velocities of samples as those of particles.
/// An enriched corner is a node.
template <int D, class Basis, bool is_enriched>
void move_corners(const Sweep<D>& sweep, std::ptrdiff_t begin, std::ptrdiff_t end)
{
    const Sweep<D> s = sweep;
    for (std::ptrdiff_t c = begin; c < end; ++c) {
        if constexpr (is_enriched)
            if (const std::ptrdiff_t own = s.p.corner_node[c]; own >= 0) {
                for (int a = 0; a < D; ++a) s.p.corner[c][a] += s.dt * s.nodes[own][NodeLane::velocity + a];
                continue;
            }
        const Lanes value = interpolate<D, Basis>(s.lattice, s.nodes, s.p.corner[c]);
        for (int a = 0; a < D; ++a) s.p.corner[c][a] += s.dt * value[NodeLane::velocity + a];
        if (!s.p.corner_velocity) continue;
        for (int a = 0; a < D; ++a) {
            double& v = s.p.corner_velocity[c][a];
            v         = (1 - s.pic) * (v + value[NodeLane::increment + a]) + s.pic * value[NodeLane::velocity + a];
        }
    }
}

/// Particles [begin, end) follow their corners, which have moved: x_p is the centroid of the cell, V_p its volume.
template <Shape S>
void follow_corners(const Sweep<S::dim>& sweep, int begin, int end, TileReport& out)
{
    const Sweep<S::dim> s = sweep;
    TileReport report     = out;
    for (int i = begin; i < end; ++i) {
        place(s, i, S::settle(s.lattice, s.p, i), report);
        measure_reach<S>(s, i, report);
    }
    out = report;
}

}  // namespace ordo
