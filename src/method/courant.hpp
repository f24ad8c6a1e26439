// Courant numbers dt c/h that a method allows, c the P-wave speed: what `cfl` of a case is a part of, and what no time step
// may pass. The second are rows of data, found by the case `dispersion` of `ordo verify`, whose tests find them again.
#pragma once

#include "method/spec.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

namespace ordo {

/// The highest frequency of splines that are fitted to particles, in c/h: of 16 cells between walls, where the functions at the
/// walls are the fastest, the largest over degrees of the stress. Between periodic faces it is 3.15 or less. Of the
/// velocity's splines without knots next to the walls, and with; and of a bar with a free end, the largest over where it cuts its cell.
inline double highest_frequency(const MethodSpec& s, bool has_surface)
{
    static constexpr double all[] = {3.11, 3.17, 3.82, 4.96, 6.28}, removed[] = {3.08, 3.07, 3.05, 3.28, 4.04},
                            cut[] = {6.24, 4.45, 5.41, 7.49, 9.77};
    const int k                   = degree_of(s.basis) - 1;
    return has_surface ? cut[k] : s.removed_knots > 0 ? removed[k] : all[k];
}

/// The Courant number at which the fastest wave of the grid becomes unstable, over that of hats with lumped mass in full
/// cells, 1. With the consistent mass 2/sqrt(largest eigenvalue of M^-1 K) in units of h/c, the end functions of splines
/// being the fastest (computed for 40 cells, both ends free); waves along several axes then add. A scale of `cfl`, which
/// knows nothing of particles.
inline double courant_scale(const MethodSpec& s, int dim, bool has_surface = false)
{
    if (is_spline_fit(s)) {
        const double reach = s.scheme == Scheme::rk3 ? 1.732 : 2.828;  // of the scheme along the imaginary axis
        return reach / (highest_frequency(s, has_surface) * std::sqrt(dim));
    }
    const bool lumped    = s.mass == MassMatrix::lumped;
    const double several = lumped ? 1.0 : 1.0 / std::sqrt(dim);
    switch (s.basis) {
    case Basis::hat:
    case Basis::ddmpm: return lumped ? 1.0 : 0.577 * several;
    case Basis::bspline2: return lumped ? 0.862 : 0.430 * several;
    case Basis::bspline3: return lumped ? 0.652 : 0.291 * several;
    case Basis::bspline4:
    case Basis::bspline5: break;
    }
    return 1.0;
}

/// The Courant number at which the step itself becomes unstable: the least over uniform lattices of 1 to 4 particles per
/// cell and axis, wherever they lie in the cell. Not above courant_scale: that has the ends of splines, which lattices do not.
inline double stable_courant_number(const MethodSpec& s, int dim, bool has_surface = false)
{
    if (is_spline_fit(s)) return courant_scale(s, dim, has_surface);
    const bool is_point_spline = s.basis == Basis::bspline2 && s.domain == Domain::point;
    double limit               = 1.0;
    if (s.mass == MassMatrix::consistent && s.basis == Basis::hat)
        limit = 0.5 / std::sqrt(dim);
    else if (s.mass == MassMatrix::lumped && s.scheme == Scheme::usl && (s.basis == Basis::hat || is_point_spline))
        limit = 0.7071;  // 1/sqrt(2), one particle in the middle of each cell
    return std::min(limit, courant_scale(s, dim));
}

/// Methods of which some waves grow at any small time step, where particles lie off sub-cell centres, and why. Weak ones are
/// not here: least squares with one particle a cell (docs/verification.md).
struct Instability {
    bool (*concerns)(const MethodSpec&);
    std::string_view why;
};

inline const std::vector<Instability>& instabilities()
{
    static const std::vector<Instability> rows = {
        {[](const MethodSpec& s) {
             return s.quadrature == Quadrature::cell ? s.gradient != Gradient::adjoint
                                                     : s.gradient == Gradient::adjoint && s.quadrature == Quadrature::particle;
         },
         "forces and particle gradients are not each other's transpose: quadrature cell and gradient adjoint belong together"},
        {has_tls_velocity,
         "velocities by Taylor least squares are not the transpose of the particles' increments; tls = \"stress\" is stable"},
        {[](const MethodSpec& s) { return fits_velocity(s) && s.scheme == Scheme::musl && s.weight != Weight::hat; },
         "velocities by moving least squares are not the transpose of the particles' increments, and scheme musl, unlike usl, "
         "does "
         "not damp what grows"},
        {[](const MethodSpec& s) { return s.projection == Projection::gradient_enhanced && s.domain != Domain::point; },
         "projection gradient-enhanced with particle domains is not the transpose of the particles' increments; for points it is "
         "stable"},
    };
    return rows;
}

/// Why waves grow at any time step; null where they do not.
inline const Instability* instability_of(const MethodSpec& s)
{
    for (const Instability& row : instabilities())
        if (row.concerns(s)) return &row;
    return nullptr;
}

}  // namespace ordo
