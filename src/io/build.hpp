// Turns the resolved input into the structs of setup, and these into model and particles.
#pragma once

#include "io/input.hpp"
#include "setup/build.hpp"

namespace ordo::io {

using setup::Built;

/// Reads the files of bodies and sets the case up. Throws InputError with the place in the file, also for errors of setup::build.
template <int D>
Built<D> build(const CaseInput& input, double most_particles = 2e9);

/// The particle of [[probe]] `particle`: the id of the one that starts nearest to `at`.
template <int D>
int nearest_particle(const Particles<D>& particles, const Vec<D>& at);

}  // namespace ordo::io
