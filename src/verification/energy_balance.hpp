// The energy balance of a step: the power balance on the nodes, Gong (2015) eqs. 4.21 and 4.22 with the nodal velocities as
// test functions, and the losses before and after it, from particles to nodes and back, and to stresses.
#pragma once

#include "sim/simulation.hpp"

namespace ordo::verification {

/// Parts of the change of energy over a step, J. The kinetic energy of the particles changes by projection + motion + update and
/// their strain energy by stress - work; as motion = work, the total energy changes by projection + update + stress.
struct EnergyBalance {
    double projection = 0.0;  ///< kinetic energy of the nodes minus that of the particles before
    double motion     = 0.0;  ///< gain of kinetic energy of the nodes
    double work       = 0.0;  ///< of the nodal forces, dt sum v_i . f_i with the mean v_i of before and after; equals motion
    double update     = 0.0;  ///< kinetic energy of the particles afterwards minus that of the nodes
    double stress     = 0.0;  ///< gain of strain energy plus the work of the nodal forces

    EnergyBalance& operator+=(const EnergyBalance& o);
};

/// Takes a step of the fixed size, without gravity, boundary conditions and external forces, and returns its energy balance. With
/// scheme `usf`, whose forces come from a stress that the step itself computes, and with filter `fmpm`, which changes the nodes after
/// the kick, `work` is set to `motion`. Splines have no nodes
/// that move: all that the particles gain is `update` and `stress`.
template <int D>
EnergyBalance step_with_balance(Simulation<D>& sim);

}  // namespace ordo::verification
