// Turns the resolved input into the structs of setup, and these into model and particles.
#pragma once

#include "io/input.hpp"
#include "setup/build.hpp"

namespace ordo::io {

using setup::Built;

/// Reads the files of bodies and sets the case up. Throws InputError with the place in the file, also for errors of setup::build.
template <int D>
Built<D> build(const CaseInput& input, double most_particles = setup::kMostParticles, const setup::Share& share = {});

/// What `build` leaves to be checked of a share: all that needs the particles of all ranks. Throws InputError on all of them.
template <int D>
void require_runnable(const CaseInput& input, const Built<D>& built, Ranks& ranks);

/// The particle of [[probe]] `particle`: the id of the one that starts nearest to `at`, of several the first in the order of tiles.
template <int D>
int nearest_particle(const State<D>& start, const Vec<D>& at);

}  // namespace ordo::io
