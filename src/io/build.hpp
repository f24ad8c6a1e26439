// From the resolved input to the structs of setup, and from there to what the step works on.
#pragma once

#include "io/input.hpp"
#include "setup/build.hpp"

namespace ordo::io {

using setup::Built;

/// Reads the files of bodies and sets the case up. Throws InputError with the place in the file, for what setup::build refuses too.
template <int D>
Built<D> build(const CaseInput& input, double most_particles = 2e9);

/// The particle of [[probe]] `particle`: the id of the one that starts nearest to `at`.
template <int D>
int nearest_particle(const Particles<D>& particles, const Vec<D>& at);

}  // namespace ordo::io
