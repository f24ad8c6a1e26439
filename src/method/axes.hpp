// A method is a row of choices on independent axes. The tables here are the only place that names them: input, error
// messages, `ordo list` and dispatch all read them. A new choice is a new entry.
#pragma once

#include "base/error.hpp"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

enum class Basis { hat, bspline2, bspline3, bspline4, bspline5, ddmpm };
enum class Domain { point, box, stretched_box, parallelepiped, cell, simplex };
enum class CornerWeights { exact, mean };
enum class Enrichment { none, interface, adjacent, layers, all };
enum class CornerVelocity { remapped, kept };
enum class Projection { mass, gradient_enhanced, affine, polynomial, mls, imls, tls, spline_fit };
enum class Weight { hat, quadratic, cubic };
enum class Samples { particles, corners };
enum class Tls { both, velocity, stress };
enum class Quadrature { particle, cell, gauss, spline };
enum class CellVolume { full, filled };
enum class MassMatrix { lumped, consistent };
enum class Gradient { shape, adjoint, affine, projected };
enum class Update { flip, apic, polypic };
enum class Scheme { usf, usl, musl, rk3, rk4 };
enum class Start { leapfrog, plain };

/// One choice of an axis: its value, its name in the input, a sentence.
template <class E>
struct Choice {
    E value;
    std::string_view name;
    std::string_view what;
};

/// The choices of an axis, and what the axis decides.
template <class E>
struct Axis;

// clang-format off
template <> struct Axis<Basis> {
    static constexpr std::string_view key = "basis", what = "shape functions N_i of the background grid";
    static constexpr std::array choices{
        Choice<Basis>{Basis::hat, "hat", "piecewise linear"},
        Choice<Basis>{Basis::bspline2, "bspline2", "quadratic splines, knots clamped at the grid's faces (Wobbes et al. 2020)"},
        Choice<Basis>{Basis::bspline3, "bspline3", "cubic splines, knots clamped at the grid's faces"},
        Choice<Basis>{Basis::bspline4, "bspline4", "the same of degree 4, of projection spline-fit"},
        Choice<Basis>{Basis::bspline5, "bspline5", "the same of degree 5"},
        Choice<Basis>{Basis::ddmpm, "ddmpm", "hats with the dual-domain gradient (Zhang et al. 2011; Wobbes et al. 2020)"}};
};
template <> struct Axis<Domain> {
    static constexpr std::string_view key = "domain", what = "the region that a particle stands for";
    static constexpr std::array choices{
        Choice<Domain>{Domain::point, "point", "phi_ip = N_i(x_p)"},
        Choice<Domain>{Domain::box, "box", "a box of fixed size (uGIMP)"},
        Choice<Domain>{Domain::stretched_box, "stretched-box", "a box stretched by the diagonal of F (cpGIMP)"},
        Choice<Domain>{Domain::parallelepiped, "parallelepiped", "a parallelepiped r = F r0 (CPDI1)"},
        Choice<Domain>{Domain::cell, "cell", "a cell of a mesh with shared corners that move (CPDI2)"},
        Choice<Domain>{Domain::simplex, "simplex", "the same, built-in shapes cut into triangles or tetrahedra (CPDI-T)"}};
};
template <> struct Axis<CornerWeights> {
    static constexpr std::string_view key = "cell_weights", what = "weights of the corners of a cell";
    static constexpr std::array choices{
        Choice<CornerWeights>{CornerWeights::exact, "exact", "integrals over the cell"},
        Choice<CornerWeights>{CornerWeights::mean, "mean", "the mean of the corners (Sadeghirad et al. 2013), exact for parallelepipeds"}};
};
template <> struct Axis<Enrichment> {
    static constexpr std::string_view key = "enrichment", what = "corners of cells that are degrees of freedom of their own, beside the grid's nodes, where no other body is near (Sadeghirad et al. 2013)";
    static constexpr std::array choices{
        Choice<Enrichment>{Enrichment::none, "none", "all corners spread to the grid"},
        Choice<Enrichment>{Enrichment::interface, "interface", "corners that cells of different bodies share"},
        Choice<Enrichment>{Enrichment::adjacent, "adjacent", "all corners of the cells that have one of those"},
        Choice<Enrichment>{Enrichment::layers, "layers", "the same, over as many layers of cells as `layers` says"},
        Choice<Enrichment>{Enrichment::all, "all", "every corner: finite elements of one point"}};
};
template <> struct Axis<CornerVelocity> {
    static constexpr std::string_view key = "corner_velocity", what = "velocity of enriched corners at the start of a step";
    static constexpr std::array choices{
        Choice<CornerVelocity>{CornerVelocity::remapped, "remapped", "projected from the particles, as that of nodes"},
        Choice<CornerVelocity>{CornerVelocity::kept, "kept", "that of the last step, as in finite elements"}};
};
template <> struct Axis<Projection> {
    static constexpr std::string_view key = "projection", what = "velocity from particles to nodes";
    static constexpr std::array choices{
        Choice<Projection>{Projection::mass, "mass", "weighted by m_p phi_ip; conserves linear momentum"},
        Choice<Projection>{Projection::gradient_enhanced, "gradient-enhanced", "the same of v_p + L_p (x_i - x_p) (Wallstedt & Guilkey 2007); conserves linear momentum where functions reproduce linear fields"},
        Choice<Projection>{Projection::affine, "affine", "the same of v_p + C_p (x_i - x_p), C_p from the nodes (Jiang et al. 2015); conserves linear and, with update apic, angular momentum"},
        Choice<Projection>{Projection::polynomial, "polynomial", "the same of a polynomial a particle, of `degree` an axis (Fu et al. 2017); conserves linear momentum"},
        Choice<Projection>{Projection::mls, "mls", "moving least squares of `degree` at the nodes, degree 0 where they are singular (Gong 2015, sec. 5.3); does not conserve momentum"},
        Choice<Projection>{Projection::imls, "imls", "the same, but only the monomials are left out that samples do not determine (Tran et al. 2019); does not conserve momentum"},
        Choice<Projection>{Projection::tls, "tls", "Taylor least squares of `degree` a cell, at Gauss points (Wobbes et al. 2020); conserves mass and linear momentum"},
        Choice<Projection>{Projection::spline_fit, "spline-fit", "the splines of `basis` that fit the particles best (docs/high_order.md); conserves momentum up to the error of the particles' masses as a quadrature"}};
};
template <> struct Axis<Weight> {
    static constexpr std::string_view key = "weight", what = "weight of a sample at a node, of mls and imls";
    static constexpr std::array choices{
        Choice<Weight>{Weight::hat, "hat", "of support h"},
        Choice<Weight>{Weight::quadratic, "quadratic", "quadratic spline of support 3h/2"},
        Choice<Weight>{Weight::cubic, "cubic", "cubic spline of support 2h"}};
};
template <> struct Axis<Samples> {
    static constexpr std::string_view key = "samples", what = "what mls and imls fit to";
    static constexpr std::array choices{
        Choice<Samples>{Samples::particles, "particles", "particles"},
        Choice<Samples>{Samples::corners, "corners", "particles and the corners of their domains, v_c = v_p + L_p (x_c - x_p) (CPLS, Tran et al. 2019); shared corners once, with a velocity of their own"}};
};
template <> struct Axis<Tls> {
    static constexpr std::string_view key = "tls", what = "what projection tls reconstructs";
    static constexpr std::array choices{
        Choice<Tls>{Tls::both, "both", "density and momentum for the nodes' velocities, stress for the forces"},
        Choice<Tls>{Tls::velocity, "velocity", "density and momentum; forces from the particles"},
        Choice<Tls>{Tls::stress, "stress", "stress; velocities by projection mass"}};
};
template <> struct Axis<Quadrature> {
    static constexpr std::string_view key = "quadrature", what = "integration of mass and forces";
    static constexpr std::array choices{
        Choice<Quadrature>{Quadrature::particle, "particle", "sum over particle volumes; conserves mass and linear momentum"},
        Choice<Quadrature>{Quadrature::cell, "cell", "one point a cell, mls of density, stress and body force (IMPM, Gong 2015, sec. 5.3); does not conserve mass"},
        Choice<Quadrature>{Quadrature::gauss, "gauss", "2^D Gauss points a cell, Taylor least squares of stress and body force (Wobbes et al. 2020); of mass with projection tls"},
        Choice<Quadrature>{Quadrature::spline, "spline", "Gauss points of splines of density, body force and stress that fit the particles best"}};
};
template <> struct Axis<CellVolume> {
    static constexpr std::string_view key = "cell_volume", what = "volume of a cell in quadratures cell and gauss";
    static constexpr std::array choices{
        Choice<CellVolume>{CellVolume::full, "full", "the whole cell; wrong by O(h) where a body ends inside of it"},
        Choice<CellVolume>{CellVolume::filled, "filled", "next to empty cells the volume of the particles inside, with the one point at their centroid, or their means at Gauss points"}};
};
template <> struct Axis<MassMatrix> {
    static constexpr std::string_view key = "mass", what = "mass matrix of the nodes";
    static constexpr std::array choices{
        Choice<MassMatrix>{MassMatrix::lumped, "lumped", "row sums"},
        Choice<MassMatrix>{MassMatrix::consistent, "consistent", "sum_p m_p phi_ip phi_jp, solved by conjugate gradients; rows below lump_below are lumped"}};
};
template <> struct Axis<Gradient> {
    static constexpr std::string_view key = "gradient", what = "velocity gradient at the particle";
    static constexpr std::array choices{
        Choice<Gradient>{Gradient::shape, "shape", "sum_i v_i (x) grad phi_ip"},
        Choice<Gradient>{Gradient::adjoint, "adjoint", "quadratic-spline interpolation of the gradients at cell centres, the adjoint of quadrature cell (docs/design.md)"},
        Choice<Gradient>{Gradient::affine, "affine", "the affine matrix C_p, in forces too (MLS-MPM, Hu et al. 2018)"},
        Choice<Gradient>{Gradient::projected, "projected", "grad v_h projected onto the splines of the stress, the adjoint of quadrature spline"}};
};
template <> struct Axis<Update> {
    static constexpr std::string_view key = "update", what = "velocity from nodes to particles";
    static constexpr std::array choices{
        Choice<Update>{Update::flip, "flip", "increments; a fraction pic_fraction takes the node velocity instead"},
        Choice<Update>{Update::apic, "apic", "node velocity and affine matrix (Jiang et al. 2015)"},
        Choice<Update>{Update::polypic, "polypic", "node velocity and polynomial (Fu et al. 2017)"}};
};
template <> struct Axis<Scheme> {
    static constexpr std::string_view key = "scheme", what = "when the stress is updated";
    static constexpr std::array choices{
        Choice<Scheme>{Scheme::usf, "usf", "stress first, from the projected velocity"},
        Choice<Scheme>{Scheme::usl, "usl", "stress last, from the advanced velocity"},
        Choice<Scheme>{Scheme::musl, "musl", "stress last, from the velocity projected again after the particle update"},
        Choice<Scheme>{Scheme::rk3, "rk3", "Heun's three stages of third order, particles as their data"},
        Choice<Scheme>{Scheme::rk4, "rk4", "the four classical stages of fourth order"}};
};
template <> struct Axis<Start> {
    static constexpr std::string_view key = "start", what = "time level of the velocities";
    static constexpr std::array choices{
        Choice<Start>{Start::leapfrog, "leapfrog", "the first kick is a half step: velocities live at t - dt/2"},
        Choice<Start>{Start::plain, "plain", "the first kick is a whole step: the initial velocity is taken as that of -dt/2"}};
};
// clang-format on

template <class E>
constexpr std::string_view name_of(E value)
{
    for (const auto& c : Axis<E>::choices)
        if (c.value == value) return c.name;
    return "?";
}

template <class E>
std::vector<std::string> choice_names()
{
    std::vector<std::string> r;
    for (const auto& c : Axis<E>::choices) r.emplace_back(c.name);
    return r;
}

/// The choice called `name`, which the input's schema has checked.
template <class E>
E parse_choice(std::string_view name)
{
    for (const auto& c : Axis<E>::choices)
        if (c.name == name) return c.value;
    throw InputError(std::string(Axis<E>::key) + ": there is no choice called " + std::string(name));
}

/// A method: one choice per axis.
struct MethodSpec {
    Basis basis                    = Basis::hat;
    Domain domain                  = Domain::point;
    CornerWeights weights          = CornerWeights::exact;
    Enrichment enrichment          = Enrichment::none;
    CornerVelocity corner_velocity = CornerVelocity::remapped;
    Projection projection          = Projection::mass;
    Weight weight                  = Weight::cubic;
    Samples samples                = Samples::particles;
    Tls tls                        = Tls::both;
    Quadrature quadrature          = Quadrature::particle;
    CellVolume cell_volume         = CellVolume::full;
    MassMatrix mass                = MassMatrix::lumped;
    Gradient gradient              = Gradient::shape;
    Update update                  = Update::flip;
    Scheme scheme                  = Scheme::usl;
    Start start                    = Start::leapfrog;
    double degree                  = 1;
    double pic_fraction            = 0.0;
    double a0                      = 0.5;
    double lump_below              = 0.3;
    double stretch_limit           = 0.0;
    double layers                  = 2;
    double stress_degree           = 3;
    double removed_knots           = 0;
    double removed_stress_knots    = 0;
    double null_damping            = 0.01;

    bool operator==(const MethodSpec&) const = default;
};

/// f(axis member) for each axis of a MethodSpec: the one list of axes.
template <class F>
void for_each_axis(F&& f)
{
    f(&MethodSpec::basis);
    f(&MethodSpec::domain);
    f(&MethodSpec::weights);
    f(&MethodSpec::enrichment);
    f(&MethodSpec::corner_velocity);
    f(&MethodSpec::projection);
    f(&MethodSpec::weight);
    f(&MethodSpec::samples);
    f(&MethodSpec::tls);
    f(&MethodSpec::quadrature);
    f(&MethodSpec::cell_volume);
    f(&MethodSpec::mass);
    f(&MethodSpec::gradient);
    f(&MethodSpec::update);
    f(&MethodSpec::scheme);
    f(&MethodSpec::start);
}

/// A number of a method, beside its axes.
struct Setting {
    std::string_view name;
    double MethodSpec::*value;
    double min, max;
    std::string_view what;
    bool is_integer = false;
};
inline constexpr std::array settings{
    Setting{"degree", &MethodSpec::degree, 0, 3,
            "of the polynomials of projections mls, imls, tls and polynomial and of quadratures cell and gauss", true},
    Setting{"pic_fraction", &MethodSpec::pic_fraction, 0, 1, "part of the velocity update that is PIC instead of FLIP; damps"},
    Setting{"a0", &MethodSpec::a0, 0, 1, "ddmpm: the part of the plain gradient in the middle of a cell"},
    Setting{"lump_below", &MethodSpec::lump_below, 0, 1,
            "consistent mass: nodes that are filled to less than this part are lumped"},
    Setting{"stretch_limit", &MethodSpec::stretch_limit, 0, 30,
            "parallelepiped: largest distance of a corner from the particle, cells; wider domains are scaled (Homel et al. "
            "2016); 0: none"},
    Setting{"layers", &MethodSpec::layers, 0, 1000, "layers of cells on both sides of an interface, of enrichment layers", true},
    Setting{"stress_degree", &MethodSpec::stress_degree, 1, 5,
            "spline-fit: of the splines of the stress and the velocity gradient", true},
    Setting{"removed_knots", &MethodSpec::removed_knots, 0, 3,
            "spline-fit: knots left out next to each wall, of the velocity's splines", true},
    Setting{"removed_stress_knots", &MethodSpec::removed_stress_knots, 0, 3, "spline-fit: the same of the stress' splines", true},
    Setting{"null_damping", &MethodSpec::null_damping, 0, 1,
            "spline-fit: part of what splines do not hold of the velocity that a step takes away"}};

/// A combination that makes no sense, and why.
struct Rule {
    bool (*forbids)(const MethodSpec&);
    std::string_view what;  ///< the combination, in names of choices
    std::string_view why;
};

inline bool has_cells(const MethodSpec& s) { return s.domain == Domain::cell || s.domain == Domain::simplex; }
inline bool has_splines(const MethodSpec& s) { return s.basis == Basis::bspline2 || s.basis == Basis::bspline3; }
/// The scheme of docs/high_order.md.
inline bool is_spline_fit(const MethodSpec& s) { return s.projection == Projection::spline_fit; }
inline bool has_stages_of_runge_kutta(const MethodSpec& s) { return s.scheme == Scheme::rk3 || s.scheme == Scheme::rk4; }
/// Of a scheme of Runge and Kutta.
inline int stages_of(Scheme scheme) { return scheme == Scheme::rk3 ? 3 : 4; }
/// Of the splines, 1 for hats.
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
inline bool has_enrichment(const MethodSpec& s) { return s.enrichment != Enrichment::none; }
inline bool keeps_corner_velocity(const MethodSpec& s) { return s.corner_velocity == CornerVelocity::kept; }
/// Velocities of the nodes are least-squares fits there.
inline bool fits_velocity(const MethodSpec& s) { return s.projection == Projection::mls || s.projection == Projection::imls; }
/// Cells that a weight is wide.
inline int width_of(Weight weight) { return weight == Weight::hat ? 2 : weight == Weight::quadratic ? 3 : 4; }
/// Mass and momentum are those of the Gauss points.
inline bool has_tls_velocity(const MethodSpec& s) { return s.projection == Projection::tls && s.tls != Tls::stress; }
/// Forces are those of the Gauss points.
inline bool has_gauss_forces(const MethodSpec& s)
{
    return s.quadrature == Quadrature::gauss && !(s.projection == Projection::tls && s.tls == Tls::velocity);
}
/// Particles leave velocities that are linear beside them.
inline bool spreads_gradient(const MethodSpec& s)
{
    return s.projection == Projection::gradient_enhanced || s.projection == Projection::affine;
}
/// Particles carry a matrix from which velocities beside them follow: L_p, or the affine matrix.
inline bool carries_gradient(const MethodSpec& s)
{
    return spreads_gradient(s) || (s.samples == Samples::corners && !has_cells(s));
}
/// That matrix is the gradient of the stress update, which stores it in passing.
inline bool stores_gradient(const MethodSpec& s)
{
    return s.scheme == Scheme::usl && carries_gradient(s) &&
           (s.projection != Projection::affine || s.gradient == Gradient::affine);
}

/// The mass of the nodes is that of the particles, to round-off. Where domains reach further than quadrature points, nodes
/// that only they reach have the particles' mass besides.
inline bool keeps_mass(const MethodSpec& s)
{
    return !is_spline_fit(s) && s.quadrature != Quadrature::cell && !(has_tls_velocity(s) && s.domain != Domain::point);
}
/// So is the momentum of the particles before a step and after it, but for forces from outside. Velocities by least squares
/// do not keep it on the nodes, but increments from them do on the particles, where node masses are sums over particles.
inline bool keeps_momentum(const MethodSpec& s)
{
    const bool has_particle_masses = keeps_mass(s) && !has_tls_velocity(s);
    return has_particle_masses && !(fits_velocity(s) && s.pic_fraction > 0);
}

inline const std::vector<Rule>& rules()
{
    static const std::vector<Rule> rows = {
        {[](const MethodSpec& s) { return s.basis == Basis::ddmpm && s.domain != Domain::point; },
         "basis ddmpm with a domain other than point",
         "ddmpm changes the gradient at a point; domains take means of the values of hats, which it leaves alone: use basis hat"},
        {[](const MethodSpec& s) { return s.weights == CornerWeights::mean && !has_cells(s); },
         "cell_weights mean with a domain other than cell and simplex", "there are no cells whose corners could be weighted"},
        {[](const MethodSpec& s) { return s.stretch_limit > 0 && s.domain != Domain::parallelepiped; },
         "stretch_limit with a domain other than parallelepiped",
         "points and boxes do not stretch with F and cells share their corners: there is nothing that could be scaled"},
        {[](const MethodSpec& s) { return has_enrichment(s) && !has_cells(s); },
         "enrichment with a domain other than cell and simplex", "there are no corners that cells share"},
        {[](const MethodSpec& s) {
             return has_enrichment(s) &&
                    (s.projection != Projection::mass || s.quadrature != Quadrature::particle || s.gradient != Gradient::shape);
         },
         "enrichment with a projection other than mass, a quadrature other than particle or a gradient other than shape",
         "fits and cells of the grid know nothing of corners that do not spread to it"},
        {[](const MethodSpec& s) { return has_enrichment(s) && s.mass == MassMatrix::consistent; },
         "enrichment with mass consistent", "one particle a cell leaves the matrix of its corners singular: use mass lumped"},
        {[](const MethodSpec& s) { return keeps_corner_velocity(s) && !has_enrichment(s); },
         "corner_velocity kept without enrichment", "only enriched corners have a velocity of their own"},
        {[](const MethodSpec& s) { return s.layers != MethodSpec{}.layers && s.enrichment != Enrichment::layers; },
         "layers with an enrichment other than layers", "the other choices say how far they go: set enrichment to layers"},
        {[](const MethodSpec& s) { return s.samples == Samples::corners && !fits_velocity(s); },
         "samples corners with a projection other than mls and imls", "only least squares have samples"},
        {[](const MethodSpec& s) { return s.samples == Samples::corners && s.domain == Domain::point; },
         "samples corners with domain point", "a point has no corners: use domain box or parallelepiped"},
        {[](const MethodSpec& s) {
             return (s.projection == Projection::affine || s.projection == Projection::polynomial) && s.domain == Domain::point &&
                    !has_splines(s);
         },
         "projection affine or polynomial with domain point and basis hat or ddmpm",
         "on a node all other hats vanish and nothing determines the matrix: use basis bspline2, or projection "
         "gradient-enhanced, which is the same elsewhere"},
        {[](const MethodSpec& s) { return s.projection == Projection::polynomial && s.domain != Domain::point; },
         "projection polynomial with a domain other than point",
         "its polynomials are orthogonal for products of one-dimensional weights: use projection affine"},
        {[](const MethodSpec& s) { return s.projection == Projection::polynomial && !(s.degree == 1 || s.degree == 2); },
         "projection polynomial with a degree other than 1 and 2",
         "degree 0 is projection mass, and quadratic splines carry no more than degree 2"},
        {[](const MethodSpec& s) { return s.gradient == Gradient::affine && (s.domain != Domain::point || !has_splines(s)); },
         "gradient affine with a domain other than point or a basis other than splines",
         "the affine matrix stands for the gradient of functions at a point, and hats leave it undetermined on a node"},
        {[](const MethodSpec& s) { return s.gradient == Gradient::adjoint && s.basis == Basis::ddmpm; },
         "gradient adjoint with basis ddmpm", "ddmpm is a choice of gradient itself: use basis hat"},
        {[](const MethodSpec& s) { return s.update == Update::apic && s.projection != Projection::affine; },
         "update apic with a projection other than affine",
         "without the affine matrix it would lose all that nodes cannot hold: use projection affine"},
        {[](const MethodSpec& s) { return (s.update == Update::polypic) != (s.projection == Projection::polynomial); },
         "update polypic without projection polynomial, or the reverse", "the one finds the polynomials that the other spreads"},
        {[](const MethodSpec& s) { return s.pic_fraction > 0 && s.update != Update::flip; },
         "pic_fraction with an update other than flip", "apic and polypic take the node velocity whole"},
        {[](const MethodSpec& s) { return s.quadrature == Quadrature::cell && s.mass == MassMatrix::consistent; },
         "quadrature cell with mass consistent", "one point a cell leaves the matrix singular: use mass lumped"},
        {[](const MethodSpec& s) { return s.cell_volume == CellVolume::filled && s.quadrature == Quadrature::particle; },
         "cell_volume filled with quadrature particle", "particles have volumes of their own"},
        {[](const MethodSpec& s) {
             return s.mass == MassMatrix::consistent &&
                    (s.projection == Projection::gradient_enhanced || s.projection == Projection::affine ||
                     s.projection == Projection::polynomial);
         },
         "projection gradient-enhanced, affine or polynomial with mass consistent",
         "particles leave the velocity of the node's place, which lumped mass gives back; the consistent matrix wants that of "
         "their own: use projection mass"},
        {[](const MethodSpec& s) { return s.tls != Tls::both && s.projection != Projection::tls; },
         "tls velocity or stress with a projection other than tls", "it says what that projection reconstructs"},
        {[](const MethodSpec& s) {
             return s.projection == Projection::tls && s.tls != Tls::velocity && s.quadrature != Quadrature::gauss;
         },
         "projection tls with a quadrature other than gauss",
         "the stress that it reconstructs is asked for at Gauss points: set quadrature to gauss, or tls to velocity"},
        {[](const MethodSpec& s) { return s.projection == Projection::tls && s.quadrature == Quadrature::cell; },
         "projection tls with quadrature cell", "mass would be that of two quadratures: set quadrature to gauss or particle"},
        {[](const MethodSpec& s) {
             const bool is_projected = s.gradient == Gradient::projected, has_stages = has_stages_of_runge_kutta(s);
             return (s.quadrature == Quadrature::spline) != is_spline_fit(s) || is_projected != is_spline_fit(s) ||
                    has_stages != is_spline_fit(s) || (s.mass == MassMatrix::lumped && is_spline_fit(s));
         },
         "projection spline-fit without quadrature spline, gradient projected, scheme rk3 or rk4 and mass consistent, or one of "
         "these "
         "three without it",
         "they are one scheme: its fits and its gradient are each other's adjoint; use preset spline3, spline4 or spline5"},
        {[](const MethodSpec& s) { return is_spline_fit(s) && s.domain != Domain::point; },
         "projection spline-fit with a domain other than point", "splines are fitted to what particles have where they are"},
        {[](const MethodSpec& s) {
             return is_spline_fit(s) &&
                    (s.basis == Basis::ddmpm || s.pic_fraction > 0 || s.start == Start::plain || s.update != Update::flip);
         },
         "projection spline-fit with basis ddmpm, pic_fraction, start plain or an update other than flip",
         "its stages have velocities at the times of positions and particles that take the grid's acceleration; null_damping "
         "damps"},
        {[](const MethodSpec& s) { return (s.basis == Basis::bspline4 || s.basis == Basis::bspline5) && !is_spline_fit(s); },
         "basis bspline4 or bspline5 with a projection other than spline-fit",
         "sums over particles gain nothing from them: use bspline3"},
        {[](const MethodSpec& s) {
             const MethodSpec usual;
             return !is_spline_fit(s) &&
                    (s.stress_degree != usual.stress_degree || s.removed_knots != usual.removed_knots ||
                     s.removed_stress_knots != usual.removed_stress_knots || s.null_damping != usual.null_damping);
         },
         "stress_degree, removed_knots, removed_stress_knots or null_damping with a projection other than spline-fit",
         "they say what splines that projection fits"},
    };
    return rows;
}

/// The rule that a combination breaks; null when it is allowed.
inline const Rule* broken_rule(const MethodSpec& s)
{
    for (const Rule& r : rules())
        if (r.forbids(s)) return &r;
    return nullptr;
}

/// A named row of the table of methods.
struct Preset {
    std::string_view name;
    std::string_view what;
    MethodSpec spec;
};

/// Taylor least squares of everything, on a basis.
inline MethodSpec tls(Basis basis)
{
    return {.basis       = basis,
            .projection  = Projection::tls,
            .quadrature  = Quadrature::gauss,
            .cell_volume = CellVolume::filled,
            .mass        = MassMatrix::consistent,
            .scheme      = Scheme::musl,
            .degree      = 2};
}

/// Splines of this degree that fit the particles, the stress' of another.
inline MethodSpec spline_fit(Basis basis, double stress_degree, double removed_knots, double removed_stress_knots, Scheme scheme)
{
    return {.basis                = basis,
            .projection           = Projection::spline_fit,
            .quadrature           = Quadrature::spline,
            .mass                 = MassMatrix::consistent,
            .gradient             = Gradient::projected,
            .scheme               = scheme,
            .stress_degree        = stress_degree,
            .removed_knots        = removed_knots,
            .removed_stress_knots = removed_stress_knots};
}

/// The presets, in the order of `ordo list methods`.
inline const std::vector<Preset>& presets()
{
    static const std::vector<Preset> rows = {
        {"mpm", "the original material point method (Gong 2015, ch. 4)", {.domain = Domain::point}},
        {"ugimp", "GIMP with domains of fixed size (Gong 2015, sec. 6.3)", {.domain = Domain::box}},
        {"cpgimp", "GIMP with domains stretched along the axes (Gong 2015, sec. 6.3)", {.domain = Domain::stretched_box}},
        {"cpdi1", "convected particle domains, parallelepipeds (Gong 2015, sec. 6.4)", {.domain = Domain::parallelepiped}},
        {"cpdi2",
         "convected particle domains, quadrilaterals and hexahedra (Gong 2015, sec. 6.5; Sadeghirad et al. 2013)",
         {.domain = Domain::cell}},
        {"cpdi2t", "convected particle domains, triangles and tetrahedra (Nguyen et al. 2017)", {.domain = Domain::simplex}},
        {"cpdi2e",
         "enriched cpdi2: cells at an interface between bodies carry degrees of freedom of their own (Sadeghirad et al. 2013)",
         {.domain = Domain::cell, .enrichment = Enrichment::adjacent}},
        {"fem",
         "every corner enriched: updated-Lagrangian finite elements of one point, on the cells of cpdi2 (Sadeghirad et al. 2013)",
         {.domain          = Domain::cell,
          .weights         = CornerWeights::mean,
          .enrichment      = Enrichment::all,
          .corner_velocity = CornerVelocity::kept}},
        {"bscpdi2",
         "cpdi2 on quadratic splines: holds large shear on fine meshes best (docs/vortex.md)",
         {.basis = Basis::bspline2, .domain = Domain::cell}},
        {"impm",
         "MLS velocity and one-point cell quadrature (Gong 2015, ch. 5)",
         {.projection = Projection::mls, .quadrature = Quadrature::cell}},
        {"impm-adjoint",
         "impm with the particle gradient that is adjoint to its quadrature; second order where impm is not",
         {.projection = Projection::mls, .quadrature = Quadrature::cell, .gradient = Gradient::adjoint}},
        {"icpdi1",
         "improved CPDI: cpdi1 with MLS velocity (Gong 2015, sec. 6.6)",
         {.domain = Domain::parallelepiped, .projection = Projection::mls}},
        {"icpdi2",
         "improved CPDI: cpdi2 with MLS velocity (Gong 2015, sec. 6.6)",
         {.domain = Domain::cell, .projection = Projection::mls}},
        {"cpls",
         "cpdi1 with improved MLS velocity from particles and corners (Tran et al. 2019)",
         {.domain = Domain::parallelepiped, .projection = Projection::imls, .samples = Samples::corners}},
        {"imls-mpm", "mpm with improved MLS velocity (Tran et al. 2019, Table 1)", {.projection = Projection::imls}},
        {"mls-bsmpm",
         "quadratic splines with MLS velocity (Tran et al. 2019, Table 1)",
         {.basis = Basis::bspline2, .projection = Projection::mls, .scheme = Scheme::musl}},
        {"wls",
         "ugimp with weighted least squares (Tran et al. 2019, Table 1)",
         {.domain = Domain::box, .projection = Projection::mls, .weight = Weight::quadratic}},
        {"bsmpm",
         "quadratic splines with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::bspline2, .mass = MassMatrix::consistent, .scheme = Scheme::musl}},
        {"ddmpm",
         "dual domain gradient with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::ddmpm, .mass = MassMatrix::consistent, .scheme = Scheme::musl}},
        {"tls-mpm", "mpm with Taylor least squares (Wobbes et al. 2020)", tls(Basis::hat)},
        {"tls-ddmpm", "ddmpm with Taylor least squares (Wobbes et al. 2020)", tls(Basis::ddmpm)},
        {"tls-bsmpm", "bsmpm with Taylor least squares (Wobbes et al. 2020)", tls(Basis::bspline2)},
        {"apic",
         "affine particle-in-cell (Jiang et al. 2015)",
         {.basis = Basis::bspline2, .projection = Projection::affine, .update = Update::apic}},
        {"mls-mpm",
         "apic with forces and gradients by the affine matrix (Hu et al. 2018)",
         {.basis = Basis::bspline2, .projection = Projection::affine, .gradient = Gradient::affine, .update = Update::apic}},
        {"polypic",
         "polynomial particle-in-cell, multilinear (Fu et al. 2017)",
         {.basis = Basis::bspline2, .projection = Projection::polynomial, .update = Update::polypic}},
        {"spline3", "third order at large deformation: cubic splines fitted to particles, three stages (docs/high_order.md)",
         spline_fit(Basis::bspline3, 3, 0, 0, Scheme::rk3)},
        {"spline4", "fourth order: the same with stresses of degree 4 and four stages",
         spline_fit(Basis::bspline3, 4, 0, 1, Scheme::rk4)},
        {"spline5", "fourth order wherever particles lie: splines of degree 4, stresses of degree 5",
         spline_fit(Basis::bspline4, 5, 1, 1, Scheme::rk4)},
    };
    return rows;
}

/// The row of this name; null where there is none.
inline const Preset* find_preset(std::string_view name)
{
    for (const Preset& p : presets())
        if (p.name == name) return &p;
    return nullptr;
}
inline std::vector<std::string> preset_names()
{
    std::vector<std::string> names;
    for (const Preset& p : presets()) names.emplace_back(p.name);
    return names;
}

}  // namespace ordo
