// The energy account: what forces do in each kick, and with it what the scheme itself takes, part by part.
//
// A kick gives nodes the increments dv = dt a and particles S dv, S the shape functions. With v the velocities of nodes after it,
//
//     sum m dv . (v - dv) + sum_p m_p |S dv|^2/2 = work of stresses, loads, gravity and constraints,
//
// where each force f works dt f . (v - dv/2), and stresses, besides, what particles receive less than nodes. Particles gain the
// left side as kinetic energy if nodes have the mass projection of their velocities: what is missing was lost in the projection.
// Particles should store what stresses take: what is missing was lost in the stress update. The others should agree with what is
// counted from motion; the difference comes from kicks that lie half a step before positions.
#pragma once

#include "method/diagnostics.hpp"
#include "method/sums.hpp"

namespace ordo {

/// What the scheme has taken since the start, J; negative where it added.
struct SchemeEnergy {
    double stress_update = 0.0;  ///< work against stresses that is neither stored nor heat
    double projection    = 0.0;  ///< between particles and nodes, both ways
    double filter        = 0.0;  ///< by PIC and by filters of the particles' velocities
    double half_step     = 0.0;  ///< works of external forces as counted, less those of their kicks

    double all() const { return stress_update + projection + filter + half_step; }
};

inline EnergyParts energy_parts(const Totals& e)
{
    return {e.kinetic_energy, e.strain_energy + e.dissipated + e.artificial, e.potential};
}

/// Starts the account at the present state.
template <int D>
void start_account(const Model<D>& model, State<D>& s);

/// Of a state whose account was started, and its totals.
template <int D>
SchemeEnergy scheme_energy(const Totals& now, const State<D>& s);

/// Adds the work of a kick to the account and sets the kinetic energy of the nodes after it. `nodes` are those after the kick with its
/// constraints, `forces` have what they felt in the lanes of increments, and `loads` have the part that is not of stresses; null if
/// there is none. momentum(node) has M times velocities and increments, in their lanes.
template <int D, class Momentum>
void add_kick(State<D>& s, const Vec<D>& gravity, double dt, const Lanes* nodes, const Lanes* forces, const Lanes* loads,
              const Momentum& momentum)
{
    enum { stresses, of_loads, of_gravity, constraints, kinetic };
    const Numbers<5> sums = sum_over_nodes<5>(s, [&](std::ptrdiff_t i) {
        Numbers<5> r;
        const double m = nodes[i][NodeLane::mass];
        if (!(m > 0)) return r;
        const Lanes mv = momentum(i);
        for (int a = 0; a < D; ++a) {
            const int velocity = NodeLane::velocity + a, increment = NodeLane::increment + a;
            const double v = nodes[i][velocity], dv = nodes[i][increment], u = v - 0.5 * dv;
            const double f = forces[i][increment], load = loads ? loads[i][increment] : 0.0;
            r[stresses] += dt * (f - load) * u - 0.5 * mv[increment] * dv;
            r[of_loads] += dt * load * u;
            r[of_gravity] += dt * m * gravity[a] * u;
            r[constraints] += (mv[increment] - dt * (f + m * gravity[a])) * u;
            r[kinetic] += 0.5 * mv[velocity] * v;
        }
        return r;
    });
    s.account.nodes += {sums[stresses], sums[of_loads], sums[of_gravity], sums[constraints]};
    s.account.nodal_kinetic = sums[kinetic];
}

}  // namespace ordo
