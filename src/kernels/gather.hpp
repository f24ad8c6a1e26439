// Nodes to particles: velocity update, stress update and motion, fused at will in one sweep over the particles.
#pragma once

#include "kernels/sweep.hpp"
#include "shape/shape.hpp"

#include <cmath>

namespace ordo {

/// What a gather does. Shape functions are those of x^n in every pass: only `move`, the last one, changes x and domains.
enum GatherPart : unsigned {
    kUpdateVelocity = 1u,  ///< v_p += sum phi dv_i (FLIP), or a part of it (PIC)
    kUpdateStress   = 2u,  ///< F_p = (I + dt L_p) F_p; sigma_p; V_p = J V0
    kMove           = 4u,  ///< x_p += dt sum phi v_i; the domain follows F_p
    kStressOfPast   = 8u,  ///< kUpdateStress by the step that led here: x^n is its end, not its start
};

/// The displacement gradient of a step with respect to its start, from dt L with respect to its end: the step back is
/// I - dt L. Taking dt L itself would be first order.
template <int D>
ORDO_FLAT inline Mat<D> from_start(const Mat<D>& dtL)
{
    return inverse(Mat<D>::identity() - dtL) - Mat<D>::identity();
}

/// F, sigma and V of particle i from dt L, the displacement gradient of the step with respect to its start.
template <int D>
ORDO_FLAT inline void deform(const Sweep<D>& s, int i, const Mat<D>& dtL, TileReport& report)
{
    const ParticleView<D>& p = s.p;
    const Mat<D> F           = p.F[i] + dtL * p.F[i];
    const double J           = det(F);
    p.F[i]                   = F;
    p.V[i]                   = J * p.V0[i];
    if (!(J > 0)) report.flag(std::isfinite(J) ? Fault::inverted : Fault::not_finite, i);
    with_material<D>(s.materials[p.material[i]], [&](const auto& law) {
        if constexpr (Hyperelastic<std::decay_t<decltype(law)>>)
            p.sigma[i] = law.cauchy(F);
        else
            p.sigma[i] = law.update(p.sigma[i], dtL);
    });
    if (!std::isfinite(trace(p.sigma[i]))) report.flag(Fault::not_finite, i);
}

/// The new place and domain of particle i.
template <Shape S, class Evolution, int D>
ORDO_FLAT inline void move(const Sweep<D>& s, int i, const Vec<D>& v, TileReport& report)
{
    const ParticleView<D>& p = s.p;
    for (int a = 0; a < D; ++a) {
        p.x[i][a] += s.dt * v[a];
        report.move    = larger(report.move, std::fabs(s.dt * v[a]) * s.lattice.inv_h[a]);
        const double y = s.lattice.cell_coordinate(a, p.x[i][a]) - s.lattice.margin;
        if (!std::isfinite(y))
            report.flag(Fault::not_finite, i);
        else if (!s.lattice.periodic[a] && !(y >= 0 && y <= s.lattice.cells[a]))
            report.flag(Fault::left_grid, i);
    }
    Evolution::apply(p, i);
    const double reach = S::reach(s.lattice, p, i);
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
            Lanes gradient[D] = {};
            S::collect(s.lattice, s.p, i, s.nodes, value, gradient);
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) dtL(a, b) = s.dt * gradient[b][NodeLane::velocity + a];
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
        if constexpr ((parts & kMove) != 0) move<S, Evolution>(s, i, v, report);
    }
    out = report;
}

}  // namespace ordo
