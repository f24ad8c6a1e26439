// From the resolved input to what the step works on: model and particles, with the checks that need geometry.
#pragma once

#include "io/input.hpp"
#include "method/state.hpp"

namespace ordo::io {

template <int D>
struct Built {
    Model<D> model;
    Particles<D> particles;
};

/// Seeds the bodies. Throws InputError for bodies outside the grid or a boundary, overlapping bodies, velocities that
/// are not numbers, time steps above the limit, and before it makes more particles than `most_particles`.
template <int D>
Built<D> build(const CaseInput& input, double most_particles = 2e9);

/// The particle of [[probe]] `particle`: the id of the one that starts nearest to `at`.
template <int D>
int nearest_particle(const Particles<D>& particles, const Vec<D>& at);

}  // namespace ordo::io
