// Where the energy of a step goes: the power balance on the nodes, Gong (2015) eqs. 4.21 and 4.22 with the velocities of the
// nodes as test functions, and what particles lose to nodes and stresses on both sides of it.
#pragma once

#include "sim/simulation.hpp"

namespace ordo::verification {

/// Parts of the change of energy over a step, J. projection + motion + update is the change of the particles' kinetic energy;
/// with the change of their strain energy, stress - work, and motion = work it is projection + update + stress in all.
struct EnergyBalance {
    double projection = 0.0;  ///< kinetic energy of the nodes less that of the particles that they come from
    double motion     = 0.0;  ///< gain of kinetic energy of the nodes
    double work       = 0.0;  ///< of the nodal forces, dt sum v_i . f_i with v_i the mean of before and after: = motion
    double update     = 0.0;  ///< kinetic energy of the particles that come from the nodes less that of the nodes
    double stress     = 0.0;  ///< gain of strain energy, and the work of the internal forces that paid for it

    EnergyBalance& operator+=(const EnergyBalance& o);
};

/// Takes a step of the fixed size, without gravity, boundary conditions and forces from outside, and tells where its energy went. With scheme
/// `usf`, whose forces are those of a stress that the step finds itself, `work` is `motion`. Splines have no nodes that move: all
/// that the particles gain is `update` and `stress`.
template <int D>
EnergyBalance step_with_balance(Simulation<D>& sim);

}  // namespace ordo::verification
