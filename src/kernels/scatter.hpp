// Particles to nodes. A deposit adds what a particle leaves: value A (times w) and fluxes X_d (times dw_d), fused at will.
#pragma once

#include "kernels/sweep.hpp"
#include "shape/shape.hpp"

namespace ordo {

/// m_i and (m v)_i.
template <int D>
struct MassMomentum {
    static constexpr bool has_flux = false;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Lanes& value, Lanes (&)[D])
    {
        const double m = p.m[i];
        double mv[3]   = {};
        for (int a = 0; a < D; ++a) mv[a] = m * p.v[i][a];
        value += make_lanes(mv[0], mv[1], mv[2], m, 0, 0, 0, 0);
    }
};

/// f_i = -sum_p V_p sigma_p grad phi_ip.
template <int D>
struct InternalForce {
    static constexpr bool has_flux = true;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Lanes&, Lanes (&flux)[D])
    {
        for (int d = 0; d < D; ++d) {
            double f[3] = {};
            for (int a = 0; a < D; ++a) f[a] = -p.V[i] * p.sigma[i](a, d);
            flux[d] += make_lanes(0, 0, 0, 0, f[0], f[1], f[2], 0);
        }
    }
};

/// f_i = sum_p phi_ip m_p b_p.
template <int D>
struct BodyForce {
    static constexpr bool has_flux = false;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Lanes& value, Lanes (&)[D])
    {
        double f[3] = {};
        for (int a = 0; a < D; ++a) f[a] = p.m[i] * p.b[i][a];
        value += make_lanes(0, 0, 0, 0, f[0], f[1], f[2], 0);
    }
};

/// The scatter of particles [begin, end).
template <Shape S, class... Deposit>
void scatter(const Sweep<S::dim>& sweep, int begin, int end)
{
    const Sweep<S::dim> s = sweep;  // a copy that no store to a node can alias
    for (int i = begin; i < end; ++i) {
        Lanes value{}, flux[S::dim] = {};
        (Deposit::add(s.p, i, value, flux), ...);
        if constexpr ((Deposit::has_flux || ...))
            S::spread(s.lattice, s.p, i, s.nodes, value, flux);
        else
            S::spread_value(s.lattice, s.p, i, s.nodes, value);
    }
}

}  // namespace ordo
