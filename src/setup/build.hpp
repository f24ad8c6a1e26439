// Builds model and particles from the structs of a case, with every check that needs geometry. Used by `ordo run`, `ordo check`
// and programs.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// Throws SetupError if the spacing does not divide the size of the grid into whole cells, or makes too many. Both have `dim`
/// components.
void require_grid(const double* size, const double* spacing, int dim);

/// They are numbered with 32 bits.
constexpr double kMostParticles = 2e9;

/// Which particles a rank makes of a case that ranks share: the part `index` of `count` equal ones, by number.
struct Share {
    int index = 0, count = 1;
};

/// Builds the case. Throws SetupError for invalid parts, bodies outside the grid or beyond a boundary, overlapping bodies, velocities that
/// are not finite, more particles than `most_particles`, before it makes them, and where require_runnable does.
/// Of a share, sums over particles, notes and checks of shapes are those of the whole case, reports on bodies those of the share;
/// require_runnable is left to the caller. Shares of shapes take the memory of their own particles, and of seeds in the bounding boxes of
/// other bodies; where cells have shared corners, with tractions and with contacts, all particles are made first.
template <int D>
Built<D> build(CaseSpec<D> spec, double most_particles = kMostParticles, const Share& share = {});

/// Throws SetupError, on all ranks, if particles of any begin deep in an obstacle or the time step is above the limit.
template <int D>
void require_runnable(const Built<D>& built, Ranks& ranks);

}  // namespace ordo::setup
