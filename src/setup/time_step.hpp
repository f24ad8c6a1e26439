// The time step of a case, and whether its method allows it. Used by set-up and by Simulation.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// The size of the next step, s.
template <int D>
double time_step(const TimeSpec& time, const Model<D>& model, const Particles<D>& particles, Ranks& ranks = alone());

/// Throws SetupError if the step is above the limit of the method, or the end is too many steps away. `particles`: of all ranks.
template <int D>
void require_stable(const TimeSpec& time, const Model<D>& model, const Particles<D>& particles, Ranks& ranks);

}  // namespace ordo::setup
