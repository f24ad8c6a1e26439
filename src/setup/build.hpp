// From the structs of a case to what the step works on: model and particles, with every check that needs geometry. `ordo run`,
// `ordo check` and programs come through here.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// Throws SetupError where the spacing does not divide the size of the grid into whole cells, or makes too many. `dim` numbers each.
void require_grid(const double* size, const double* spacing, int dim);

/// Seeds the bodies. Throws SetupError for parts that make no sense, bodies outside the grid or a boundary, overlapping bodies,
/// velocities that are not numbers, time steps above the limit, and before it makes more particles than `most_particles`.
template <int D>
Built<D> build(CaseSpec<D> spec, double most_particles = 2e9);

}  // namespace ordo::setup
