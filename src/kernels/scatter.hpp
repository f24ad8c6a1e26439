// Particles to nodes. A deposit adds what a particle leaves: value A (times w) and fluxes X_d (times dw_d); several are fused in one
// sweep.
#pragma once

#include "kernels/sweep.hpp"
#include "shape/shape.hpp"

#include <type_traits>

namespace ordo {

/// What a mass m with velocity v leaves at a node of weight 1.
template <int D>
ORDO_FLAT inline Lanes mass_momentum(double m, const Vec<D>& v, double V)
{
    double mv[3] = {};
    for (int a = 0; a < D; ++a) mv[a] = m * v[a];
    return make_lanes(mv[0], mv[1], mv[2], m, 0, 0, 0, V);
}
/// What a force f leaves.
template <int D>
ORDO_FLAT inline UpperLanes force(const Vec<D>& f)
{
    double r[3] = {};
    for (int a = 0; a < D; ++a) r[a] = f[a];
    return UpperLanes::of(r[0], r[1], r[2], 0);
}

/// m_i, (m v)_i and the volume that particles fill.
template <int D>
struct MassMomentum {
    static constexpr bool has_flux = false;
    using Value                    = Lanes;
    using Flux                     = UpperLanes;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Value& value, Flux (&)[D])
    {
        value += mass_momentum(p.m[i], p.v[i], p.V[i]);
    }
};

/// f_i = sum_p phi_ip T_p + sum_p M_p grad phi_ip, where T_p is the traction on faces of the domain and M_p its moment about
/// x_p: total force and moment are exact, and corner domains get it at the corners of the face.
template <int D>
struct SurfaceForce {
    static constexpr bool has_flux = true;
    using Value                    = UpperLanes;
    using Flux                     = UpperLanes;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, auto& value, Flux (&flux)[D])
    {
        if (!p.traction) return;
        value += force(p.traction[i]);
        for (int d = 0; d < D; ++d) flux[d] += force(column(p.traction_moment[i], d));
    }
};

/// All forces, and with has_mass m_i and (m v)_i in the same sweep: f_i = sum_p phi_ip m_p b_p - sum_p V_p sigma_p grad phi_ip, and
/// those of surfaces.
template <int D, bool has_mass>
struct Forces {
    static constexpr bool has_flux = true;
    using Value                    = std::conditional_t<has_mass, Lanes, UpperLanes>;
    using Flux                     = UpperLanes;
    ORDO_FLAT static void add(const ParticleView<D>& p, int i, Value& value, Flux (&flux)[D])
    {
        if constexpr (has_mass) value += mass_momentum(p.m[i], p.v[i], p.V[i]);
        for (int d = 0; d < D; ++d) {
            Vec<D> f{};
            for (int a = 0; a < D; ++a) f[a] = -p.V[i] * p.sigma[i](a, d);
            flux[d] += force(f);
        }
        if (p.b) value += force(p.m[i] * p.b[i]);
        SurfaceForce<D>::add(p, i, value, flux);
    }
};

/// The scatter of particles [begin, end).
template <Shape S, class Deposit>
void scatter(const Sweep<S::dim>& sweep, int begin, int end)
{
    const Sweep<S::dim> s = sweep;  // a copy that no store to a node can alias
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        for_each_stencil<S>(s.lattice, s.p, b, [&](int k, const auto& stencil) {
            typename Deposit::Value value{};
            typename Deposit::Flux flux[S::dim] = {};
            Deposit::add(s.p, b.first + k, value, flux);
            if constexpr (Deposit::has_flux)
                spread(stencil, s.lattice, s.nodes, value, flux);
            else
                spread_value(stencil, s.lattice, s.nodes, value);
        });
    }
}

/// The product of the consistent mass matrix with `from`, added to the nodes: sum_p m_p phi_ip sum_j phi_jp from_j.
template <Shape S>
void apply_mass(const Sweep<S::dim>& sweep, const Lanes* from, int begin, int end)
{
    const Sweep<S::dim> s = sweep;
    for (int i = begin; i < end; ++i) {
        Lanes value{};
        S::collect_value(s.lattice, s.p, i, from, value);
        S::spread_value(s.lattice, s.p, i, s.nodes, value * s.p.m[i]);
    }
}

}  // namespace ordo
