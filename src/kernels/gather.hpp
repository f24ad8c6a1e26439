// Nodes to particles: velocity update, deformation and motion, in any combination in one sweep over the particles.
#pragma once

#include "kernels/cell_gradient.hpp"
#include "kernels/sweep.hpp"
#include "particles/batch.hpp"
#include "shape/point.hpp"

#include <cmath>
#include <limits>

namespace ordo {

/// What a gather does. All passes use the shape functions at x^n: only the last, `move`, changes x and domains.
enum GatherPart : unsigned {
    kUpdateVelocity = 1u,  ///< v_p += sum phi dv_i (FLIP), blended with sum phi v_i (PIC)
    kDeform         = 2u,  ///< F_p = (I + dt L_p) F_p; V_p = J V0; the stress follows, see stress.hpp
    kMove           = 4u,  ///< x_p += dt sum phi v_i; the domain follows F_p. For cells see move_corners
};

/// L from the gradients of the node lanes.
template <int D>
ORDO_FLAT inline Mat<D> velocity_gradient(const Quad (&gradient)[D])
{
    Mat<D> L{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) L(a, b) = gradient[b][NodeLane::velocity + a];
    return L;
}

/// The displacement gradient of a step with respect to its start, from dt L with respect to its end: the step back is
/// I - dt L, so this is (I - dt L)^-1 - I, written without cancellation for small steps. dt L itself would be first order.
template <int D, class T>
ORDO_FLAT inline Mat<D, T> from_start(const Mat<D, T>& dtL)
{
    return inverse(Mat<D, T>::identity() - dtL) * dtL;
}

/// Nodal fields at the particles of a batch: velocity, its increment and velocity gradient.
template <int D>
struct FromNodes {
    Lanes value[Batch::size];       ///< of particle k
    Quad gradient[Batch::size][D];  ///< of particle k along each axis

    /// Velocities and increments of all particles, m/s.
    ORDO_FLAT void velocities(Vec<D, Lanes>& v, Vec<D, Lanes>& dv)
    {
        transpose(value);
        for (int a = 0; a < D; ++a) {
            v[a]  = value[NodeLane::velocity + a];
            dv[a] = value[NodeLane::increment + a];
        }
    }
    /// L of all particles, 1/s.
    ORDO_FLAT Mat<D, Lanes> velocity_gradients() const
    {
        Mat<D, Lanes> L;
        for (int b = 0; b < D; b += 2) {
            Lanes two[Batch::size];  // along two axes
            for (int k = 0; k < Batch::size; ++k) two[k] = join(gradient[k][b], gradient[k][smaller(b + 1, D - 1)]);
            transpose(two);
            for (int a = 0; a < D; ++a) {
                L(a, b) = two[NodeLane::velocity + a];
                if (b + 1 < D) L(a, b + 1) = two[4 + NodeLane::velocity + a];
            }
        }
        return L;
    }
};

/// Values of a batch and, with `has_gradient`, gradients.
template <Shape S, bool has_gradient>
ORDO_FLAT inline void collect(const Sweep<S::dim>& s, const Batch& b, FromNodes<S::dim>& nodes)
{
    constexpr int D = S::dim;
    for_each_stencil<S>(s.lattice, s.p, b, [&](int k, const auto& stencil) {
        Lanes value{};
        Quad gradient[D] = {};
        if constexpr (has_gradient)
            collect(stencil, s.lattice, s.nodes, value, gradient);
        else
            collect_value(stencil, s.lattice, s.nodes, value);
        nodes.value[k] = value;
        for (int d = 0; d < D; ++d) nodes.gradient[k][d] = gradient[d];
    });
}
/// The same with the gradients of cells where they are known.
template <Shape S>
ORDO_CALL void collect_in_cells(const Sweep<S::dim>& s, const Batch& b, FromNodes<S::dim>& nodes, bool has_value)
{
    constexpr int D = S::dim;
    for_each_stencil<S>(s.lattice, s.p, b, [&](int k, const auto& stencil) {
        Lanes value{};
        Quad gradient[D] = {};
        Mat<D> L{};
        if (interpolate_gradient(s, b.first + k, L)) {
            if (has_value) collect_value(stencil, s.lattice, s.nodes, value);
            for (int c = 0; c < D * D; ++c) gradient[c % D][NodeLane::velocity + c / D] = L(c / D, c % D);
        } else {
            collect(stencil, s.lattice, s.nodes, value, gradient);
        }
        nodes.value[k] = value;
        for (int d = 0; d < D; ++d) nodes.gradient[k][d] = gradient[d];
    });
}

/// Flags fault(k) if lane k of `sound` is negative or NaN.
template <class WhichFault>
ORDO_FLAT inline void report_lanes(const Lanes& sound, const Batch& b, TileReport& report, WhichFault&& fault)
{
    if (none_negative(sound)) return;
    for (int k = 0; k < b.count; ++k)
        if (!(sound[k] >= 0)) report.flag(fault(k), b.first + k);
}

/// The kinetic energy that goes with a change of velocities from `before` to `after`, J; zero in spare lanes.
template <int D>
ORDO_FLAT inline Lanes taken(const Lanes& m, const Vec<D, Lanes>& before, const Vec<D, Lanes>& after, const Batch& b)
{
    Lanes r = 0.5 * m * (dot(before, before) - dot(after, after));
    for (int k = b.count; k < Batch::size; ++k) r[k] = 0.0;
    return r;
}

/// F and V of a batch from dt L, the displacement gradient of the step with respect to its start. Stresses are updated later,
/// see stress.hpp.
template <int D>
ORDO_FLAT inline void deform(const Sweep<D>& s, const Batch& b, const Mat<D, Lanes>& dtL, TileReport& report)
{
    const ParticleView<D>& p  = s.p;
    const Mat<D, Lanes> start = load(p.F, b), F = start + dtL * start;
    const Lanes J = det(F);
    store(p.F, b, F);
    if (!p.cell) store(p.V, b, J * load(p.V0, b));  // a cell has the volume between its corners
    if (s.increments) store(s.increments, Batch{b.first - s.increment_first, b.count}, dtL);
    const Lanes sound = J - std::numeric_limits<double>::min();
    report_lanes(sound, b, report, [&](int k) { return J[k] <= 0 ? Fault::inverted : Fault::not_finite; });
}

/// Moves the particles of a batch to x; records how far they moved and whether they are still in the grid.
template <int D>
ORDO_FLAT inline void place(const Sweep<D>& s, const Batch& b, const Vec<D, Lanes>& x, Lanes& move, TileReport& report)
{
    const Vec<D, Lanes> from = load(s.p.x, b);
    Lanes outside{}, sum{};
    for (int a = 0; a < D; ++a) {
        move = larger(move, fabs(x[a] - from[a]) * s.lattice.inv_h[a]);
        sum += x[a];
        if (s.lattice.periodic[a]) continue;
        const Lanes y = (x[a] - Lanes(s.lattice.origin[a])) * s.lattice.inv_h[a];
        outside       = larger(outside, larger(-y, y - Lanes(s.lattice.cells[a])));
    }
    store(s.p.x, b, x);
    const Lanes sound = 0.0 * sum - outside;  // NaN where x is not finite
    report_lanes(sound, b, report, [&](int k) { return std::isfinite(sum[k]) ? Fault::left_grid : Fault::not_finite; });
}

/// Records how far the domains of a batch reach.
template <Shape S, int D>
ORDO_FLAT inline void measure_reach(const Sweep<D>& s, const Batch& b, Lanes& furthest, TileReport& report)
{
    const Lanes reach = S::reach(s.lattice, s.p, b);
    furthest          = larger(furthest, reach);
    report_lanes(S::max_reach - reach, b, report,
                 [&](int k) { return std::isnan(reach[k]) ? Fault::domain_turned : Fault::domain_too_wide; });
}

/// Gathers for particles [begin, end). `Evolution` is how the domain follows F; void where particles do not move.
template <Shape S, class Evolution, unsigned parts, bool has_cell_gradients = true>
void gather(const Sweep<S::dim>& sweep, int begin, int end, TileReport& out)
{
    constexpr int D          = S::dim;
    constexpr bool has_value = (parts & (kUpdateVelocity | kMove)) != 0, has_gradient = (parts & kDeform) != 0;
    const Sweep<D> s  = sweep;  // copies that no store to a particle can alias
    TileReport report = out;
    Lanes move(report.move), reach(report.reach), kicked(0.0), filtered(0.0);
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        FromNodes<D> nodes;
        if (!b.is_full()) nodes = {};  // spare lanes must be defined
        bool is_collected = false;
        if constexpr (has_gradient && has_cell_gradients)
            if ((is_collected = s.gradients)) collect_in_cells<S>(s, b, nodes, has_value);
        if (!is_collected) collect<S, has_gradient>(s, b, nodes);
        Vec<D, Lanes> v, dv;
        if constexpr (has_value) nodes.velocities(v, dv);
        if constexpr ((parts & kUpdateVelocity) != 0) {
            const Vec<D, Lanes> flip = load(s.p.v, b) + dv, next = Lanes(1 - s.pic) * flip + Lanes(s.pic) * v;
            if (s.sums_energy) {
                const Lanes m = load(s.p.m, b);
                kicked += taken(m, dv, Vec<D, Lanes>{}, b);
                filtered += taken(m, flip, next, b);
            }
            store(s.p.v, b, next);
            report_lanes(0.0 * dot(next, next), b, report, [](int) { return Fault::not_finite; });
        }
        if constexpr (has_gradient) {
            Mat<D, Lanes> dtL = nodes.velocity_gradients();
            if (s.keeps_gradient) store(s.p.L, b, dtL);
            dtL *= Lanes(s.dt);
            if (s.is_past) dtL = from_start(dtL);
            deform(s, b, dtL, report);
        }
        if constexpr ((parts & kMove) != 0) {
            place(s, b, load(s.p.x, b) + Lanes(s.dt) * v, move, report);
            Evolution::apply(s, b);
            measure_reach<S>(s, b, reach, report);
        }
    }
    report.move  = largest(move);
    report.reach = largest(reach);
    report.kicked += sum(kicked);
    report.filtered += sum(filtered);
    out = report;
}

/// Shared corners [begin, end) move with the nodes: x_c += dt sum N_i(x_c) v_i. Their velocities, if they are samples, are
/// updated like those of particles. An enriched corner moves with its own node.
template <int D, class Basis, bool is_enriched>
void move_corners(const Sweep<D>& sweep, std::ptrdiff_t begin, std::ptrdiff_t end)
{
    const Sweep<D> s = sweep;
    for (std::ptrdiff_t c = begin; c < end; ++c) {
        if constexpr (is_enriched)
            if (const std::ptrdiff_t own = s.p.corner_node ? s.p.corner_node[c] : -1; own >= 0) {
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

/// Sets particles [begin, end) after their corners have moved: x_p is the centroid of the cell, V_p its volume.
template <Shape S>
void follow_corners(const Sweep<S::dim>& sweep, int begin, int end, TileReport& out)
{
    constexpr int D   = S::dim;
    const Sweep<D> s  = sweep;
    TileReport report = out;
    Lanes move(report.move), reach(report.reach);
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        Vec<D, Lanes> x;
        for (int k = 0; k < Batch::size; ++k) {
            const Vec<D> at = S::settle(s.lattice, s.p, b.particle(k));
            for (int a = 0; a < D; ++a) x[a][k] = at[a];
        }
        place(s, b, x, move, report);
        measure_reach<S>(s, b, reach, report);
    }
    report.move  = largest(move);
    report.reach = largest(reach);
    out          = report;
}

}  // namespace ordo
