// The free surface of a body as level sets, for projection spline-fit. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// The free surface of a built-in shape: functions that are negative inside, without plane faces on walls and periods of the
/// grid. Empty if the body must fill the grid. Throws SetupError for body 0 if a part of a ring has more than 180 degrees.
template <int D>
std::vector<LevelSet<D>> free_surface(const BodyShape<D>& shape, const Model<D>& model);

}  // namespace ordo::setup
