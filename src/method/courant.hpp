// Courant numbers dt c/h that a method allows, c the P-wave speed: what `cfl` of a case is a part of, and what no time step
// may pass. The second are rows of data, found by the case `dispersion` of `ordo verify`, whose tests find them again.
#pragma once

#include "method/spec.hpp"

#include <string_view>
#include <vector>

namespace ordo {

template <int D>
struct Model;
template <int D>
struct Particles;

/// The Courant number at which the fastest wave of the grid becomes unstable, over that of hats with lumped mass in full
/// cells, 1. With the consistent mass 2/sqrt(largest eigenvalue of M^-1 K) in units of h/c, the end functions of splines
/// being the fastest (computed for 40 cells, both ends free); waves along several axes then add. A scale of `cfl`, which
/// knows nothing of particles.
double courant_scale(const MethodSpec& s, int dim, bool has_surface = false);

/// The Courant number at which the step itself becomes unstable: the least over uniform lattices of 1 to 4 particles per
/// cell and axis, wherever they lie in the cell. Not above courant_scale: that has the ends of splines, which lattices do not.
double stable_courant_number(const MethodSpec& s, int dim, bool has_surface = false);

/// Methods of which some waves grow at any small time step, where particles lie off sub-cell centres, and why. Weak ones are
/// not here: least squares with one particle a cell (docs/verification.md).
struct Instability {
    bool (*concerns)(const MethodSpec&);
    std::string_view why;
};

const std::vector<Instability>& instabilities();
/// Why waves grow at any time step; null where they do not.
const Instability* instability_of(const MethodSpec& s);

/// That of a model's method and bodies.
template <int D>
double stable_courant_number(const Model<D>& model);

/// h over the P-wave speed plus |v|, smallest over axes and particles, s: times courant_scale, of which `cfl` is a part, or
/// times stable_courant_number, which no time step may pass.
template <int D>
double courant_time_step(const Model<D>& model, const Particles<D>& particles);
template <int D>
double stable_time_step(const Model<D>& model, const Particles<D>& particles);

/// The time step for a `cfl`, s.
template <int D>
double automatic_time_step(const Model<D>& model, const Particles<D>& particles, double cfl);

}  // namespace ordo
