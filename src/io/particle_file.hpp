// Particles from a CSV file: columns x, y, z, volume and optional half-edge vectors r1x, r1y, ..
#pragma once

#include "io/input.hpp"
#include "particles/seeding.hpp"

namespace ordo::io {

/// The particles of body.file; throws InputError with file, line and column.
template <int D>
std::vector<Seed<D>> read_particles(const BodyInput& body);

}  // namespace ordo::io
