// A method is a set of choices on independent axes. Here are the axes as types, the set, and functions of it. Names,
// descriptions, rules and presets are in tables.hpp.
#pragma once

namespace ordo {

enum class Basis { hat, bspline2, bspline3, bspline4, bspline5, ddmpm };
enum class Domain { point, box, stretched_box, parallelepiped, cell, simplex };
enum class CornerWeights { exact, mean };
enum class Enrichment { none, interface, adjacent, layers, all };
enum class CornerVelocity { remapped, kept };
enum class Projection { mass, gradient_enhanced, affine, polynomial, mls, imls, tls, spline_fit };
enum class Weight { hat, quadratic, cubic };
enum class Samples { particles, corners };
enum class Limiter { none, slope };
enum class Tls { both, velocity, stress };
enum class Quadrature { particle, cell, gauss, spline };
enum class CellVolume { full, filled };
enum class MassMatrix { lumped, consistent };
enum class Gradient { shape, adjoint, affine, projected };
enum class Update { flip, apic, polypic };
enum class Filter { none, xpic, fmpm };
enum class TimeScheme { usf, usl, musl, rk3, rk4, midpoint, newmark, quasi_static };
enum class Start { leapfrog, plain };
enum class Averaging { none, cell, node };

/// A method: one choice per axis, and numbers.
struct MethodSpec {
    Basis basis                    = Basis::hat;
    Domain domain                  = Domain::point;
    CornerWeights weights          = CornerWeights::exact;
    Enrichment enrichment          = Enrichment::none;
    CornerVelocity corner_velocity = CornerVelocity::remapped;
    Projection projection          = Projection::mass;
    Weight weight                  = Weight::cubic;
    Samples samples                = Samples::particles;
    Limiter limiter                = Limiter::none;
    Tls tls                        = Tls::both;
    Quadrature quadrature          = Quadrature::particle;
    CellVolume cell_volume         = CellVolume::full;
    MassMatrix mass                = MassMatrix::lumped;
    Gradient gradient              = Gradient::shape;
    Update update                  = Update::flip;
    Filter filter                  = Filter::none;
    TimeScheme scheme              = TimeScheme::usl;
    Start start                    = Start::leapfrog;
    Averaging averaging            = Averaging::none;
    double degree                  = 1;
    double strain_velocity         = -1.0;  ///< negative: of the scheme, see strain_velocity_of
    double pic_fraction            = 0.0;
    double filter_order            = 2;
    double filter_every            = 1;
    double a0                      = 0.5;
    double lump_below              = -1.0;  ///< negative: of the scheme, see lump_below_of
    double stretch_limit           = 0.0;
    double layers                  = 2;
    double stress_degree           = 3;
    double removed_knots           = 0;
    double removed_stress_knots    = 0;
    double null_damping            = 0.01;
    double linear_viscosity        = 0.0;
    double quadratic_viscosity     = 0.0;
    double newmark_beta            = -1.0;  ///< negative: of newmark_gamma, see newmark_beta_of
    double newmark_gamma           = 0.5;
    double newton_tolerance        = 1e-9;
    double newton_iterations       = 30;
    double step_halvings           = 10;
    double ghost_penalty           = -1.0;  ///< negative: of the scheme, see ghost_penalty_of

    bool operator==(const MethodSpec&) const = default;
};

inline bool has_artificial_viscosity(const MethodSpec& s) { return s.linear_viscosity > 0 || s.quadratic_viscosity > 0; }
/// Forces come from stresses other than those of the laws.
inline bool has_force_stress(const MethodSpec& s) { return s.averaging != Averaging::none || has_artificial_viscosity(s); }
inline bool has_cells(const MethodSpec& s) { return s.domain == Domain::cell || s.domain == Domain::simplex; }
/// Whether domains deform and turn with the body. Particles of other methods lose each other when it stretches or turns far.
inline bool domains_deform(const MethodSpec& s) { return s.domain == Domain::parallelepiped || has_cells(s); }
inline constexpr const char* kDeformingMethods = "method whose domains deform and turn (cpdi1)";  ///< in messages
inline bool has_splines(const MethodSpec& s) { return s.basis == Basis::bspline2 || s.basis == Basis::bspline3; }
/// The scheme of docs/high_order.md.
inline bool is_spline_fit(const MethodSpec& s) { return s.projection == Projection::spline_fit; }
inline bool has_stages_of_runge_kutta(const MethodSpec& s) { return s.scheme == TimeScheme::rk3 || s.scheme == TimeScheme::rk4; }
/// The number of stages of a Runge-Kutta scheme.
inline int stages_of(TimeScheme scheme) { return scheme == TimeScheme::rk3 ? 3 : 4; }
/// The scheme of docs/implicit.md: each step solves equations for the displacements of nodes.
inline bool is_implicit(const MethodSpec& s)
{
    return s.scheme == TimeScheme::midpoint || s.scheme == TimeScheme::newmark || s.scheme == TimeScheme::quasi_static;
}
/// The same without inertia.
inline bool is_static(const MethodSpec& s) { return s.scheme == TimeScheme::quasi_static; }
/// Of implicit schemes.
inline double ghost_penalty_of(const MethodSpec& s) { return s.ghost_penalty >= 0 ? s.ghost_penalty : 0.001; }
/// The least that is stable at any step, with which velocities need no accelerations.
inline double newmark_beta_of(const MethodSpec& s) { return s.newmark_beta >= 0 ? s.newmark_beta : 0.5 * s.newmark_gamma; }
/// Lumped rows take energy from implicit steps, which are stable without; explicit steps need them. Rows of slivers alone make the matrix too nearly
/// singular for its solver.
inline double lump_below_of(const MethodSpec& s) { return s.lump_below >= 0 ? s.lump_below : is_implicit(s) ? 1e-4 : 0.3; }
/// The degree of the splines; 1 for hats.
inline int degree_of(Basis basis)
{
    switch (basis) {
    case Basis::bspline2: return 2;
    case Basis::bspline3: return 3;
    case Basis::bspline4: return 4;
    case Basis::bspline5: return 5;
    case Basis::hat:
    case Basis::ddmpm: break;
    }
    return 1;
}
/// The degree of the nodes' functions. Projection spline-fit shows its fields at the vertices of cells, with hats.
inline int node_degree(const MethodSpec& s) { return is_spline_fit(s) ? 1 : degree_of(s.basis); }
/// Bodies must fill the grid between walls, unless they define their surface.
inline bool needs_full_grid(const MethodSpec& s) { return is_spline_fit(s); }
inline bool has_enrichment(const MethodSpec& s) { return s.enrichment != Enrichment::none; }
inline bool keeps_corner_velocity(const MethodSpec& s) { return s.corner_velocity == CornerVelocity::kept; }
/// The stress is updated at the end of a step, from velocities at its middle.
inline bool updates_stress_last(const MethodSpec& s) { return s.scheme == TimeScheme::usl || s.scheme == TimeScheme::musl; }
/// The part of the advanced velocity in the velocity of the strain, for these schemes; the rest is projected again.
inline double strain_velocity_of(const MethodSpec& s)
{
    if (s.strain_velocity >= 0) return s.strain_velocity;
    return s.scheme == TimeScheme::usl ? 1.0 : 0.0;
}
/// The particles' new velocities are projected for the strain: MUSL and what lies between it and USL.
inline bool projects_again(const MethodSpec& s) { return updates_stress_last(s) && strain_velocity_of(s) < 1; }
/// The strain is that of the advanced velocity: USL.
inline bool strains_by_advanced(const MethodSpec& s) { return updates_stress_last(s) && !projects_again(s); }
/// Nodal velocities are least-squares fits at the nodes.
inline bool fits_velocity(const MethodSpec& s) { return s.projection == Projection::mls || s.projection == Projection::imls; }
/// Fields are fitted or carried by polynomials of `degree`.
inline bool has_polynomials(const MethodSpec& s)
{
    return fits_velocity(s) || s.projection == Projection::tls || s.projection == Projection::polynomial ||
           s.quadrature == Quadrature::cell || s.quadrature == Quadrature::gauss;
}
/// The width of a weight's support, cells.
inline int width_of(Weight weight) { return weight == Weight::hat ? 2 : weight == Weight::quadratic ? 3 : 4; }
/// Nodal mass and momentum are sums over Gauss points.
inline bool has_tls_velocity(const MethodSpec& s) { return s.projection == Projection::tls && s.tls != Tls::stress; }
/// Nodal forces are sums over Gauss points.
inline bool has_gauss_forces(const MethodSpec& s)
{
    return s.quadrature == Quadrature::gauss && !(s.projection == Projection::tls && s.tls == Tls::velocity);
}
/// Particles spread linear velocity fields, with a gradient.
inline bool spreads_gradient(const MethodSpec& s)
{
    return s.projection == Projection::gradient_enhanced || s.projection == Projection::affine;
}
/// Particles carry a matrix that extrapolates their velocity to points near them: L_p, or the affine matrix.
inline bool carries_gradient(const MethodSpec& s)
{
    return spreads_gradient(s) || (s.samples == Samples::corners && !has_cells(s));
}
/// That matrix is the velocity gradient of the stress update, which stores it.
inline bool stores_gradient(const MethodSpec& s)
{
    return strains_by_advanced(s) && carries_gradient(s) &&
           (s.projection != Projection::affine || s.gradient == Gradient::affine);
}

/// The total mass of the nodes is that of the particles, to round-off. It is not with velocities by tls and domains other than
/// points: nodes that domains reach but no quadrature point reaches get the particles' mass in addition.
inline bool keeps_mass(const MethodSpec& s)
{
    return !is_spline_fit(s) && s.quadrature != Quadrature::cell && !(has_tls_velocity(s) && s.domain != Domain::point);
}
/// Without external forces a step keeps the momentum of the particles, to round-off. Velocities by least squares change it on
/// the nodes, but their increments keep it on the particles if nodal masses are sums over particles.
inline bool keeps_momentum(const MethodSpec& s)
{
    const bool has_particle_masses = keeps_mass(s) && !has_tls_velocity(s);
    return has_particle_masses && !(fits_velocity(s) && (s.pic_fraction > 0 || s.filter != Filter::none));
}

}  // namespace ordo
