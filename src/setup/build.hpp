// Builds model and particles from the structs of a case, with every check that needs geometry. Used by `ordo run`, `ordo check`
// and programs.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// Throws SetupError if the spacing does not divide the size of the grid into whole cells, or makes too many. Both have `dim`
/// components.
void require_grid(const double* size, const double* spacing, int dim);

/// Builds the case. Throws SetupError for invalid parts, bodies outside the grid or beyond a boundary, overlapping bodies,
/// velocities that are not finite, time steps above the limit, and more particles than `most_particles`, before it makes them.
template <int D>
Built<D> build(CaseSpec<D> spec, double most_particles = 2e9);

}  // namespace ordo::setup
