// The free surface of a body as level sets, for projection spline-fit. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// The free surface of a built-in shape: functions that are negative inside, without its plane faces on walls and periods of the
/// grid. None where the grid has to be filled. Throws SetupError for body 0 where a part of a ring is more than half of it.
template <int D>
std::vector<LevelSet<D>> free_surface(const BodyShape<D>& shape, const Model<D>& model);

}  // namespace ordo::setup
