// Rigid obstacles: their masses, which bodies meet them, and what they ask of method and bodies. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// Adds the obstacles of a case to the model, with a pair for each body that meets one. Throws SetupError.
template <int D>
void set_up_obstacles(const CaseSpec<D>& spec, Model<D>& model);

/// Whether a contact or an obstacle of the model meets faces of bodies.
template <int D>
bool needs_surfaces(const Model<D>& model);

/// Finds the tied points of pair k, a surface and an obstacle. Throws SetupError if the surface begins deep in it. `vertices` of each
/// surface.
template <int D>
void settle_on_obstacle(Model<D>& model, int k, const std::vector<std::vector<Vec<D>>>& vertices);

/// Throws SetupError if particles, of all ranks, begin deep in an obstacle that they meet.
template <int D>
void require_outside_obstacles(const Particles<D>& p, const Model<D>& model, Ranks& ranks);

}  // namespace ordo::setup
