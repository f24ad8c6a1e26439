// Courant numbers dt c/h of a method, where c is the P-wave speed: the one that `cfl` of a case multiplies, and the limit of
// every time step. The limits are data found by the case `dispersion` of `ordo verify`; its tests check them.
#pragma once

#include "base/ranks.hpp"
#include "method/spec.hpp"

#include <string_view>
#include <vector>

namespace ordo {

template <int D>
struct Model;
template <int D>
struct Particles;

/// The Courant number at which the fastest wave of the grid becomes unstable, relative to that of hats with lumped mass in full
/// cells, which is 1. With the consistent mass it is 2/sqrt(largest eigenvalue of M^-1 K) in units of h/c, computed for 40
/// cells with both ends free. There the end functions of splines are the fastest, and waves along several axes add up. It
/// scales `cfl` and does not depend on particles.
double courant_scale(const MethodSpec& s, int dim, bool has_surface = false);

/// The Courant number at which the step itself becomes unstable: the least over uniform lattices of 1 to 4 particles per cell
/// and axis, at any position in the cell. At most courant_scale, which includes the ends of splines; lattices have no ends.
double stable_courant_number(const MethodSpec& s, int dim, bool has_surface = false);

/// Whether that number falls when domains grow: with the consistent mass and domains that follow F.
bool has_limit_of_strain(const MethodSpec& s);
/// What the number counts, for messages: "the limit is 0.5 .."
std::string_view unit_of_limit(const MethodSpec& s);
/// The stable Courant number of hats with the consistent mass and domains of w cells side by side, whose functions are means over corners.
/// The corners of a wave of two cells lie on a triangle wave, of autocorrelation C(w) = 1/3 - 2 w^2 + 4/3 w^3: its mass is (C(0) + C(w))/2
/// and its stiffness 2 (C(0) - C(w))/w^2. At w = 1 it has no mass.
double stable_number_of_domains(double w);

/// A group of methods with waves that grow at any time step, however small, if particles are not at sub-cell centres, and the
/// reason. Weak instabilities are not listed: least squares with one particle a cell (docs/verification.md).
struct Instability {
    bool (*concerns)(const MethodSpec&);
    std::string_view why;
};

const std::vector<Instability>& instabilities();
/// Why waves grow at any time step; null if they do not.
const Instability* instability_of(const MethodSpec& s);

/// The same for the method and bodies of a model.
template <int D>
double stable_courant_number(const Model<D>& model);

/// h over (P-wave speed + |v|), the smallest over axes and particles of all ranks, s: times courant_scale, which `cfl` multiplies, or times
/// stable_courant_number, the limit of every time step; infinite for implicit schemes.
template <int D>
double courant_time_step(const Model<D>& model, const Particles<D>& particles, Ranks& ranks = alone());
template <int D>
double stable_time_step(const Model<D>& model, const Particles<D>& particles, Ranks& ranks = alone());

/// The time step for a `cfl`, s; for implicit schemes without any limit of stability.
template <int D>
double automatic_time_step(const Model<D>& model, const Particles<D>& particles, double cfl, Ranks& ranks = alone());

}  // namespace ordo
