#include "method/tables.hpp"

#include "base/error.hpp"

namespace ordo {

template <class E>
E parse_choice(std::string_view name)
{
    for (const auto& c : Axis<E>::choices)
        if (c.name == name) return c.value;
    throw InputError(std::string(Axis<E>::key) + ": there is no choice called " + std::string(name));
}

namespace {

template <class E>
struct AxisRow {
    std::string_view key, what;
    std::span<const Choice<E>> choices;
};

constexpr Choice<Basis> choices_of_basis[] = {
    {Basis::hat, "hat", "piecewise linear"},
    {Basis::bspline2, "bspline2", "quadratic splines, knots clamped at the grid's faces (Wobbes et al. 2020)"},
    {Basis::bspline3, "bspline3", "cubic splines, knots clamped at the grid's faces"},
    {Basis::bspline4, "bspline4", "splines of degree 4, only with projection spline-fit"},
    {Basis::bspline5, "bspline5", "splines of degree 5, only with projection spline-fit"},
    {Basis::ddmpm, "ddmpm", "hats with the dual-domain gradient (Zhang et al. 2011; Wobbes et al. 2020)"}};
constexpr AxisRow<Basis> row_of(Basis) { return {"basis", "shape functions N_i of the background grid", choices_of_basis}; }

constexpr Choice<Domain> choices_of_domain[] = {
    {Domain::point, "point", "phi_ip = N_i(x_p)"},
    {Domain::box, "box", "a box of fixed size (uGIMP)"},
    {Domain::stretched_box, "stretched-box", "a box stretched by the diagonal of F (cpGIMP)"},
    {Domain::parallelepiped, "parallelepiped", "a parallelepiped r = F r0 (CPDI1)"},
    {Domain::cell, "cell", "a cell of a mesh with shared corners that move (CPDI2)"},
    {Domain::simplex, "simplex", "the same, with built-in shapes cut into triangles or tetrahedra (CPDI-T)"}};
constexpr AxisRow<Domain> row_of(Domain) { return {"domain", "the region that a particle represents", choices_of_domain}; }

constexpr Choice<CornerWeights> choices_of_corner_weights[] = {
    {CornerWeights::exact, "exact", "integrals over the cell"},
    {CornerWeights::mean, "mean", "equal weights (Sadeghirad et al. 2013), exact for parallelepipeds"}};
constexpr AxisRow<CornerWeights> row_of(CornerWeights)
{
    return {"cell_weights", "weights of the corners of a cell", choices_of_corner_weights};
}

constexpr Choice<Enrichment> choices_of_enrichment[] = {
    {Enrichment::none, "none", "all corners spread to the grid"},
    {Enrichment::interface, "interface", "corners that cells of different bodies share"},
    {Enrichment::adjacent, "adjacent", "all corners of the cells at an interface"},
    {Enrichment::layers, "layers", "the same for `layers` layers of cells"},
    {Enrichment::all, "all", "every corner: one-point finite elements"}};
constexpr AxisRow<Enrichment> row_of(Enrichment)
{
    return {"enrichment",
            "corners of cells that are degrees of freedom in addition to the grid's nodes, where no other body is near "
            "(Sadeghirad et al. 2013)",
            choices_of_enrichment};
}

constexpr Choice<CornerVelocity> choices_of_corner_velocity[] = {
    {CornerVelocity::remapped, "remapped", "projected from the particles, like the velocity of nodes"},
    {CornerVelocity::kept, "kept", "the velocity of the last step, as in finite elements"}};
constexpr AxisRow<CornerVelocity> row_of(CornerVelocity)
{
    return {"corner_velocity", "velocity of enriched corners at the start of a step", choices_of_corner_velocity};
}

constexpr Choice<Projection> choices_of_projection[] = {
    {Projection::mass, "mass", "weighted by m_p phi_ip; conserves linear momentum"},
    {Projection::gradient_enhanced, "gradient-enhanced",
     "as mass, with v_p + L_p (x_i - x_p) (Wallstedt & Guilkey 2007); conserves linear momentum if the functions reproduce "
     "linear "
     "fields"},
    {Projection::affine, "affine",
     "as mass, with v_p + C_p (x_i - x_p), C_p from the nodes (Jiang et al. 2015); conserves linear momentum and, with update "
     "apic, angular momentum"},
    {Projection::polynomial, "polynomial",
     "as mass, with a polynomial per particle, of `degree` along each axis (Fu et al. 2017); conserves linear momentum"},
    {Projection::mls, "mls",
     "moving least squares of `degree` at the nodes, of degree 0 where these are singular (Gong 2015, sec. 5.3); does not "
     "conserve momentum"},
    {Projection::imls, "imls",
     "as mls, but drops only the monomials that the samples do not determine (Tran et al. 2019); does not conserve momentum"},
    {Projection::tls, "tls",
     "Taylor least squares of `degree` in each cell, at Gauss points (Wobbes et al. 2020); conserves mass and linear momentum"},
    {Projection::spline_fit, "spline-fit",
     "least-squares fit of the splines of `basis` to the particles (docs/high_order.md); conserves momentum up to the quadrature "
     "error of the particle masses"}};
constexpr AxisRow<Projection> row_of(Projection)
{
    return {"projection", "velocity from particles to nodes", choices_of_projection};
}

constexpr Choice<Weight> choices_of_weight[] = {{Weight::hat, "hat", "of support h"},
                                                {Weight::quadratic, "quadratic", "quadratic spline of support 3h/2"},
                                                {Weight::cubic, "cubic", "cubic spline of support 2h"}};
constexpr AxisRow<Weight> row_of(Weight)
{
    return {"weight", "weight of a sample at a node, for mls and imls", choices_of_weight};
}

constexpr Choice<Samples> choices_of_samples[] = {
    {Samples::particles, "particles", "particles"},
    {Samples::corners, "corners",
     "particles and the corners of their domains, v_c = v_p + L_p (x_c - x_p) (CPLS, Tran et al. 2019); shared corners count "
     "once and carry their own velocity"}};
constexpr AxisRow<Samples> row_of(Samples) { return {"samples", "the data of the fits mls and imls", choices_of_samples}; }

constexpr Choice<Limiter> choices_of_limiter[] = {
    {Limiter::none, "none", "all of the fit"},
    {Limiter::slope, "slope",
     "the fit where its slopes explain the samples' velocities, the projection by mass where they do not, as where bodies meet "
     "(docs/energy.md)"}};
constexpr AxisRow<Limiter> row_of(Limiter) { return {"limiter", "what nodes take of the fits mls and imls", choices_of_limiter}; }

constexpr Choice<Tls> choices_of_tls[] = {
    {Tls::both, "both", "density and momentum for the nodes' velocities, stress for the forces"},
    {Tls::velocity, "velocity", "density and momentum; forces from the particles"},
    {Tls::stress, "stress", "stress; velocities by projection mass"}};
constexpr AxisRow<Tls> row_of(Tls) { return {"tls", "what projection tls reconstructs", choices_of_tls}; }

constexpr Choice<Quadrature> choices_of_quadrature[] = {
    {Quadrature::particle, "particle", "sum over particle volumes; conserves mass and linear momentum"},
    {Quadrature::cell, "cell",
     "one point per cell, mls of density, stress and body force (IMPM, Gong 2015, sec. 5.3); does not conserve mass"},
    {Quadrature::gauss, "gauss",
     "2^D Gauss points per cell, Taylor least squares of stress and body force (Wobbes et al. 2020), and of mass with projection "
     "tls"},
    {Quadrature::spline, "spline", "Gauss points, with splines of density, body force and stress fitted to the particles"}};
constexpr AxisRow<Quadrature> row_of(Quadrature)
{
    return {"quadrature", "integration of mass and forces", choices_of_quadrature};
}

constexpr Choice<CellVolume> choices_of_cell_volume[] = {
    {CellVolume::full, "full", "the whole cell; wrong by O(h) if a body ends inside it"},
    {CellVolume::filled, "filled",
     "in cells next to empty ones the volume of the particles inside, with the one point at their centroid, or with their means "
     "at the Gauss points"}};
constexpr AxisRow<CellVolume> row_of(CellVolume)
{
    return {"cell_volume", "volume of a cell for quadratures cell and gauss", choices_of_cell_volume};
}

constexpr Choice<MassMatrix> choices_of_mass_matrix[] = {
    {MassMatrix::lumped, "lumped", "row sums"},
    {MassMatrix::consistent, "consistent",
     "sum_p m_p phi_ip phi_jp, solved by conjugate gradients; rows below lump_below are lumped"}};
constexpr AxisRow<MassMatrix> row_of(MassMatrix) { return {"mass", "mass matrix of the nodes", choices_of_mass_matrix}; }

constexpr Choice<Gradient> choices_of_gradient[] = {
    {Gradient::shape, "shape", "sum_i v_i (x) grad phi_ip"},
    {Gradient::adjoint, "adjoint",
     "quadratic-spline interpolation of the gradients at cell centres, the adjoint of quadrature cell (docs/design.md)"},
    {Gradient::affine, "affine", "the affine matrix C_p, in forces too (MLS-MPM, Hu et al. 2018)"},
    {Gradient::projected, "projected", "grad v_h projected onto the splines of the stress, the adjoint of quadrature spline"}};
constexpr AxisRow<Gradient> row_of(Gradient) { return {"gradient", "velocity gradient at the particle", choices_of_gradient}; }

constexpr Choice<Update> choices_of_update[] = {
    {Update::flip, "flip", "velocity increments, blended with the node velocity by pic_fraction"},
    {Update::apic, "apic", "node velocity and affine matrix (Jiang et al. 2015)"},
    {Update::polypic, "polypic", "node velocity and polynomial (Fu et al. 2017)"}};
constexpr AxisRow<Update> row_of(Update) { return {"update", "velocity from nodes to particles", choices_of_update}; }

constexpr Choice<Filter> choices_of_filter[] = {
    {Filter::none, "none", "particles keep what nodes do not see"},
    {Filter::xpic, "xpic",
     "XPIC(m), m = filter_order: removes (1 - S R)^m v_p, R to nodes and S to particles (Hammerquist & Nairn 2017)"},
    {Filter::fmpm, "fmpm",
     "FMPM(k), k = filter_order: node velocities sum_{l<k} (1 - R S)^l v_i, an approximate inverse of the consistent mass "
     "matrix, "
     "move particles and positions, and with scheme usl strains (Nairn & Hammerquist 2021)"}};
constexpr AxisRow<Filter> row_of(Filter)
{
    return {"filter", "removes velocities of particles that nodes do not see", choices_of_filter};
}

constexpr Choice<TimeScheme> choices_of_scheme[] = {
    {TimeScheme::usf, "usf", "stress first, from the projected velocity"},
    {TimeScheme::usl, "usl", "stress last, from the advanced velocity"},
    {TimeScheme::musl, "musl", "stress last, from the velocity projected again after the particle update"},
    {TimeScheme::rk3, "rk3", "Heun's Runge-Kutta method of third order, three stages, on the particles"},
    {TimeScheme::rk4, "rk4", "the classical Runge-Kutta method of fourth order, four stages"},
    {TimeScheme::midpoint, "midpoint",
     "implicit: the midpoint rule with stresses that keep energy and angular momentum (Simo & Tarnow 1992; Gonzalez 2000; "
     "docs/implicit.md)"},
    {TimeScheme::newmark, "newmark", "implicit: Newmark's method with newmark_beta and newmark_gamma (Guilkey & Weiss 2003)"},
    {TimeScheme::quasi_static, "static", "implicit: equilibrium at the end of each step, without inertia; time is the load"}};
constexpr AxisRow<TimeScheme> row_of(TimeScheme)
{
    return {"scheme", "when the stress is updated, or how a step is solved for", choices_of_scheme};
}

constexpr Choice<Start> choices_of_start[] = {
    {Start::leapfrog, "leapfrog", "the first kick is a half step: velocities live at t - dt/2"},
    {Start::plain, "plain", "the first kick is a whole step: the initial velocity is taken as that at -dt/2"}};
constexpr AxisRow<Start> row_of(Start) { return {"start", "time level of the velocities", choices_of_start}; }

constexpr Choice<Averaging> choices_of_averaging[] = {
    {Averaging::none, "none", "each particle its own; locks where the material hardly changes its volume"},
    {Averaging::cell, "cell", "means over the particles of a body in a cell of the grid (F-bar; Coombs et al. 2018)"},
    {Averaging::node, "node", "the same at the vertices of the grid, interpolated by hats: reproduces linear pressures inside"}};
constexpr AxisRow<Averaging> row_of(Averaging)
{
    return {"averaging", "volume average of volume changes and of mean stresses, against volumetric locking (docs/design.md)",
            choices_of_averaging};
}

constexpr Setting kSettings[] = {
    Setting{"degree", &MethodSpec::degree, 0, 3,
            "degree of the polynomials of projections mls, imls, tls and polynomial and of quadratures cell and gauss", true},
    Setting{"strain_velocity", &MethodSpec::strain_velocity, 0, 1,
            "usl and musl: part of the advanced velocity in the velocity of the strain, the rest is projected again", false,
            "0 with scheme musl, 1 with usl"},
    Setting{"pic_fraction", &MethodSpec::pic_fraction, 0, 1, "fraction of PIC in the velocity update, the rest is FLIP; damps"},
    Setting{"filter_order", &MethodSpec::filter_order, 1, 100,
            "terms of the filter, each a projection more; 1 is PIC, higher orders leave more of what nodes see", true},
    Setting{"filter_every", &MethodSpec::filter_every, 1, 1e9, "steps from one filtering to the next", true},
    Setting{"a0", &MethodSpec::a0, 0, 1, "ddmpm: weight of the plain gradient in the middle of a cell"},
    Setting{"lump_below", &MethodSpec::lump_below, 0, 1, "consistent mass: nodes with a filled fraction below this are lumped",
            false, "0.3; implicit schemes 1e-4, or 0.02 with boundaries of type velocity or displacement"},
    Setting{"stretch_limit", &MethodSpec::stretch_limit, 0, 30,
            "parallelepiped: largest distance of a corner from the particle, cells; wider domains are scaled down (Homel et al. "
            "2016); 0: no limit"},
    Setting{"layers", &MethodSpec::layers, 0, 1000, "enrichment layers: layers of cells on each side of an interface", true},
    Setting{"stress_degree", &MethodSpec::stress_degree, 1, 5,
            "spline-fit: degree of the splines of stress and velocity gradient", true},
    Setting{"removed_knots", &MethodSpec::removed_knots, 0, 3,
            "spline-fit: knots left out next to each wall, for the splines of the velocity", true},
    Setting{"removed_stress_knots", &MethodSpec::removed_stress_knots, 0, 3, "spline-fit: the same for the stress", true},
    Setting{"null_damping", &MethodSpec::null_damping, 0, 1,
            "spline-fit: fraction of the velocity not represented by the splines that each step removes"},
    Setting{"linear_viscosity", &MethodSpec::linear_viscosity, 0, 10,
            "Landshoff's artificial viscosity, pressure rho c h |tr d| in compression; 0.06 is usual for shocks"},
    Setting{"quadratic_viscosity", &MethodSpec::quadratic_viscosity, 0, 10,
            "that of von Neumann and Richtmyer, the root of the factor of rho h^2 (tr d)^2; 1.5 is usual for shocks"},
    Setting{"newmark_beta", &MethodSpec::newmark_beta, 0.25, 1,
            "newmark: part of the new acceleration in displacements; at least newmark_gamma/2", false, "newmark_gamma/2"},
    Setting{"newmark_gamma", &MethodSpec::newmark_gamma, 0.5, 1,
            "newmark: part of the new acceleration in velocities; above 0.5 damps, of first order"},
    Setting{"newton_tolerance", &MethodSpec::newton_tolerance, 1e-14, 1e-2,
            "implicit schemes: residual at which Newton's method ends, relative to the forces on the nodes"},
    Setting{"newton_iterations", &MethodSpec::newton_iterations, 1, 1000,
            "implicit schemes: iterations after which a step is halved", true},
    Setting{"step_halvings", &MethodSpec::step_halvings, 0, 30,
            "implicit schemes: how often a step that does not converge, or that cells or obstacles do not allow, is halved "
            "before the run ends",
            true},
    Setting{"ghost_penalty", &MethodSpec::ghost_penalty, 0, 100,
            "implicit schemes: stiffness against jumps of derivatives next to nodes with little of a body, relative to the "
            "material's (Burman 2010; Coombs 2023)",
            false, "0.001 with these schemes"}};

}  // namespace

template <class E>
const std::string_view Axis<E>::key = row_of(E{}).key;
template <class E>
const std::string_view Axis<E>::what = row_of(E{}).what;
template <class E>
const std::span<const Choice<E>> Axis<E>::choices = row_of(E{}).choices;

#define ORDO_AXIS(E)         \
    template struct Axis<E>; \
    template E parse_choice(std::string_view);
ORDO_AXES(ORDO_AXIS)
#undef ORDO_AXIS

std::span<const Setting> settings() { return kSettings; }

const std::vector<Rule>& rules()
{
    static const std::vector<Rule> rows = {
        {[](const MethodSpec& s) { return s.basis == Basis::ddmpm && s.domain != Domain::point; },
         "basis ddmpm with a domain other than point",
         "ddmpm changes the gradient at a point only; domains average the values of hats, which it does not change: use basis "
         "hat"},
        {[](const MethodSpec& s) { return s.weights == CornerWeights::mean && !has_cells(s); },
         "cell_weights mean with a domain other than cell and simplex", "other domains have no cells with corner weights"},
        {[](const MethodSpec& s) { return s.stretch_limit > 0 && s.domain != Domain::parallelepiped; },
         "stretch_limit with a domain other than parallelepiped",
         "only parallelepipeds can be scaled: points and boxes do not follow all of F, and cells share their corners"},
        {[](const MethodSpec& s) { return has_enrichment(s) && !has_cells(s); },
         "enrichment with a domain other than cell and simplex", "other domains have no shared corners"},
        {[](const MethodSpec& s) {
             return has_enrichment(s) &&
                    (s.projection != Projection::mass || s.quadrature != Quadrature::particle || s.gradient != Gradient::shape);
         },
         "enrichment with a projection other than mass, a quadrature other than particle or a gradient other than shape",
         "fits and grid cells do not see enriched corners, which do not spread to the grid"},
        {[](const MethodSpec& s) { return has_enrichment(s) && s.mass == MassMatrix::consistent; },
         "enrichment with mass consistent", "with one particle per cell the matrix of its corners is singular: use mass lumped"},
        {[](const MethodSpec& s) { return keeps_corner_velocity(s) && !has_enrichment(s); },
         "corner_velocity kept without enrichment", "only enriched corners have a velocity of their own"},
        {[](const MethodSpec& s) { return s.layers != MethodSpec{}.layers && s.enrichment != Enrichment::layers; },
         "layers with an enrichment other than layers",
         "only enrichment layers has a number of layers: set enrichment to layers"},
        {[](const MethodSpec& s) { return s.samples == Samples::corners && !fits_velocity(s); },
         "samples corners with a projection other than mls and imls",
         "only least squares have samples: set samples to particles"},
        {[](const MethodSpec& s) { return s.limiter != Limiter::none && (!fits_velocity(s) || s.degree != 1); },
         "limiter with a projection other than mls and imls, or a degree other than 1",
         "it limits the slopes of linear fits: set limiter to none"},
        {[](const MethodSpec& s) { return s.samples == Samples::corners && s.domain == Domain::point; },
         "samples corners with domain point", "a point has no corners: use domain box or parallelepiped"},
        {[](const MethodSpec& s) {
             return (s.projection == Projection::affine || s.projection == Projection::polynomial) && s.domain == Domain::point &&
                    !has_splines(s);
         },
         "projection affine or polynomial with domain point and basis hat or ddmpm",
         "at a node all other hats vanish and the matrix is undetermined: use basis bspline2, or projection gradient-enhanced, "
         "which is the same away from nodes"},
        {[](const MethodSpec& s) { return s.projection == Projection::polynomial && s.domain != Domain::point; },
         "projection polynomial with a domain other than point",
         "its polynomials are orthogonal only for products of one-dimensional weights: use projection affine"},
        {[](const MethodSpec& s) { return s.projection == Projection::polynomial && !(s.degree == 1 || s.degree == 2); },
         "projection polynomial with a degree other than 1 and 2",
         "degree 0 is projection mass, and quadratic splines determine at most degree 2"},
        {[](const MethodSpec& s) { return s.gradient == Gradient::affine && (s.domain != Domain::point || !has_splines(s)); },
         "gradient affine with a domain other than point or a basis other than splines",
         "the affine matrix replaces the gradient of functions at a point, and is undetermined for hats at a node"},
        {[](const MethodSpec& s) { return s.gradient == Gradient::adjoint && s.basis == Basis::ddmpm; },
         "gradient adjoint with basis ddmpm", "ddmpm is a choice of gradient itself: use basis hat"},
        {[](const MethodSpec& s) { return s.update == Update::apic && s.projection != Projection::affine; },
         "update apic with a projection other than affine",
         "without the affine matrix it would be plain PIC, which damps strongly: use projection affine"},
        {[](const MethodSpec& s) { return (s.update == Update::polypic) != (s.projection == Projection::polynomial); },
         "update polypic without projection polynomial, or the reverse",
         "the update computes the polynomials that the projection spreads"},
        {[](const MethodSpec& s) { return s.strain_velocity >= 0 && !updates_stress_last(s); },
         "strain_velocity with a scheme other than usl and musl",
         "it blends the velocities of usl and musl, and these schemes have one velocity for the strain: use scheme usl or musl"},
        {[](const MethodSpec& s) {
             return is_implicit(s) && (s.basis == Basis::ddmpm || has_enrichment(s) || s.weights == CornerWeights::mean);
         },
         "scheme midpoint, newmark or static with basis ddmpm, enrichment or cell_weights mean",
         "the tangent does not know how their functions depend on masses or corners: use basis hat, bspline2 or bspline3"},
        {[](const MethodSpec& s) {
             return is_implicit(s) &&
                    (s.projection != Projection::mass || s.quadrature != Quadrature::particle || s.gradient != Gradient::shape ||
                     s.update != Update::flip || s.filter != Filter::none || has_artificial_viscosity(s));
         },
         "scheme midpoint, newmark or static with a projection other than mass, a quadrature other than particle, a gradient "
         "other than shape, an update other than flip, a filter or artificial viscosity",
         "the equations of an implicit step have forces that are the derivatives of an energy, and gradients that are their "
         "transpose: take the plain choices of these axes, as presets mpm, cpgimp, cpdi1, cpdi2 and bscpdi2 have them"},
        {[](const MethodSpec& s) { return is_implicit(s) && (s.start != Start::leapfrog || s.stretch_limit > 0); },
         "scheme midpoint, newmark or static with start plain or stretch_limit",
         "their velocities are those at the times of positions, and their domains follow all of the deformation"},
        {[](const MethodSpec& s) { return is_static(s) && (s.mass == MassMatrix::consistent || s.pic_fraction > 0); },
         "scheme static with mass consistent or pic_fraction", "equilibrium has no inertia and no velocities"},
        {[](const MethodSpec& s) {
             const MethodSpec usual;
             return s.scheme != TimeScheme::newmark && (s.newmark_beta >= 0 || s.newmark_gamma != usual.newmark_gamma);
         },
         "newmark_beta or newmark_gamma with a scheme other than newmark", "they are parameters of scheme newmark"},
        {[](const MethodSpec& s) { return newmark_beta_of(s) < 0.5 * s.newmark_gamma; }, "newmark_beta below newmark_gamma/2",
         "only small steps are stable with it: leave newmark_beta out, or raise it"},
        {[](const MethodSpec& s) {
             return s.scheme == TimeScheme::newmark && s.mass == MassMatrix::consistent &&
                    newmark_beta_of(s) > 0.5 * s.newmark_gamma;
         },
         "newmark_beta above newmark_gamma/2 with mass consistent",
         "velocities would need accelerations, and these another solve for the mass matrix: leave newmark_beta out"},
        {[](const MethodSpec& s) {
             const MethodSpec usual;
             return !is_implicit(s) &&
                    (s.newton_tolerance != usual.newton_tolerance || s.newton_iterations != usual.newton_iterations ||
                     s.step_halvings != usual.step_halvings || s.ghost_penalty >= 0);
         },
         "newton_tolerance, newton_iterations, step_halvings or ghost_penalty with an explicit scheme",
         "they are parameters of the equations that schemes midpoint, newmark and static solve"},
        {[](const MethodSpec& s) { return s.pic_fraction > 0 && s.update != Update::flip; },
         "pic_fraction with an update other than flip", "apic and polypic always take the whole node velocity"},
        {[](const MethodSpec& s) {
             const MethodSpec usual;
             return s.filter == Filter::none && (s.filter_order != usual.filter_order || s.filter_every != usual.filter_every);
         },
         "filter_order or filter_every without a filter", "set filter to xpic or fmpm"},
        {[](const MethodSpec& s) { return s.degree != MethodSpec{}.degree && !has_polynomials(s); },
         "degree with another projection than mls, imls, tls and polynomial and another quadrature than cell and gauss",
         "only these have polynomials: set method.projection, or leave degree out"},
        {[](const MethodSpec& s) { return s.a0 != MethodSpec{}.a0 && s.basis != Basis::ddmpm; },
         "a0 with a basis other than ddmpm", "it is a parameter of ddmpm: leave it out"},
        {[](const MethodSpec& s) { return s.lump_below >= 0 && s.mass != MassMatrix::consistent; }, "lump_below with mass lumped",
         "all nodes are lumped: set method.mass to consistent, or leave lump_below out"},
        {[](const MethodSpec& s) { return s.filter != Filter::none && (s.update != Update::flip || s.pic_fraction > 0); },
         "filter with pic_fraction or an update other than flip",
         "they already remove what nodes do not see, and filter_order 1 is PIC"},
        {[](const MethodSpec& s) { return s.filter != Filter::none && is_spline_fit(s); }, "filter with projection spline-fit",
         "null_damping is its filter"},
        {[](const MethodSpec& s) { return s.filter != Filter::none && has_enrichment(s); }, "filter with enrichment",
         "the conditions of enriched corners are not known to the terms of the filter: use cpdi2"},
        {[](const MethodSpec& s) { return s.filter != Filter::none && s.filter_order > 1 && s.mass == MassMatrix::consistent; },
         "filter_order above 1 with mass consistent",
         "with this matrix velocities of nodes come back from particles as they were, and all orders are one: set filter_order "
         "to "
         "1"},
        {[](const MethodSpec& s) { return s.quadrature == Quadrature::cell && s.mass == MassMatrix::consistent; },
         "quadrature cell with mass consistent", "with one point per cell the matrix is singular: use mass lumped"},
        {[](const MethodSpec& s) { return s.cell_volume == CellVolume::filled && s.quadrature == Quadrature::particle; },
         "cell_volume filled with quadrature particle", "this quadrature uses the volumes of particles, not of cells"},
        {[](const MethodSpec& s) {
             return s.mass == MassMatrix::consistent &&
                    (s.projection == Projection::gradient_enhanced || s.projection == Projection::affine ||
                     s.projection == Projection::polynomial);
         },
         "projection gradient-enhanced, affine or polynomial with mass consistent",
         "these projections spread velocities at nodes, as lumped mass requires; the consistent matrix requires velocities at "
         "particles: use projection mass"},
        {[](const MethodSpec& s) { return s.tls != Tls::both && s.projection != Projection::tls; },
         "tls velocity or stress with a projection other than tls", "it selects what projection tls reconstructs"},
        {[](const MethodSpec& s) {
             return s.projection == Projection::tls && s.tls != Tls::velocity && s.quadrature != Quadrature::gauss;
         },
         "projection tls with a quadrature other than gauss",
         "the reconstructed stress is needed at Gauss points: set quadrature to gauss, or tls to velocity"},
        {[](const MethodSpec& s) { return s.projection == Projection::tls && s.quadrature == Quadrature::cell; },
         "projection tls with quadrature cell",
         "mass would come from two different quadratures: set quadrature to gauss or particle"},
        {[](const MethodSpec& s) {
             const bool is_projected = s.gradient == Gradient::projected, has_stages = has_stages_of_runge_kutta(s);
             return (s.quadrature == Quadrature::spline) != is_spline_fit(s) || is_projected != is_spline_fit(s) ||
                    has_stages != is_spline_fit(s) || (s.mass == MassMatrix::lumped && is_spline_fit(s));
         },
         "projection spline-fit without quadrature spline, gradient projected, scheme rk3 or rk4 and mass consistent, or one of "
         "these three without it",
         "they are parts of one scheme, whose fits and gradient are adjoint; use preset spline3, spline4 or spline5"},
        {[](const MethodSpec& s) { return is_spline_fit(s) && s.domain != Domain::point; },
         "projection spline-fit with a domain other than point", "splines are fitted to values at the positions of particles"},
        {[](const MethodSpec& s) {
             return is_spline_fit(s) &&
                    (s.basis == Basis::ddmpm || s.pic_fraction > 0 || s.start == Start::plain || s.update != Update::flip);
         },
         "projection spline-fit with basis ddmpm, pic_fraction, start plain or an update other than flip",
         "its Runge-Kutta stages have velocities at the times of positions and add the grid's acceleration to them; for damping "
         "use null_damping"},
        {[](const MethodSpec& s) { return (s.basis == Basis::bspline4 || s.basis == Basis::bspline5) && !is_spline_fit(s); },
         "basis bspline4 or bspline5 with a projection other than spline-fit",
         "sums over particles do not become more accurate with them: use bspline3"},
        {[](const MethodSpec& s) {
             const MethodSpec usual;
             return !is_spline_fit(s) &&
                    (s.stress_degree != usual.stress_degree || s.removed_knots != usual.removed_knots ||
                     s.removed_stress_knots != usual.removed_stress_knots || s.null_damping != usual.null_damping);
         },
         "stress_degree, removed_knots, removed_stress_knots or null_damping with a projection other than spline-fit",
         "they are parameters of projection spline-fit"},
        {[](const MethodSpec& s) { return s.averaging != Averaging::none && s.quadrature != Quadrature::particle; },
         "averaging with a quadrature other than particle",
         "forces of the other quadratures come from stresses fitted in cells or by splines, which are averages already"},
        {[](const MethodSpec& s) { return has_artificial_viscosity(s) && s.quadrature != Quadrature::particle; },
         "linear_viscosity or quadratic_viscosity with a quadrature other than particle",
         "artificial viscosity is a pressure of particles: use quadrature particle"},
    };
    return rows;
}

const Rule* broken_rule(const MethodSpec& s)
{
    for (const Rule& r : rules())
        if (r.forbids(s)) return &r;
    return nullptr;
}

void require_allowed(const MethodSpec& s)
{
    if (const Rule* rule = broken_rule(s)) throw InputError(std::string(rule->what) + ": " + std::string(rule->why));
}

namespace {

/// Taylor least squares for density, momentum and stress, on a basis.
MethodSpec tls(Basis basis)
{
    return {.basis       = basis,
            .projection  = Projection::tls,
            .quadrature  = Quadrature::gauss,
            .cell_volume = CellVolume::filled,
            .mass        = MassMatrix::consistent,
            .scheme      = TimeScheme::musl,
            .degree      = 2};
}

/// Splines fitted to particles, with a separate degree for the stress.
MethodSpec spline_fit(Basis basis, double stress_degree, double removed_knots, double removed_stress_knots, TimeScheme scheme)
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

}  // namespace

const std::vector<Preset>& presets()
{
    static const std::vector<Preset> rows = {
        {"mpm", "the original material point method (Gong 2015, ch. 4)", {.domain = Domain::point}},
        {"ugimp", "GIMP with domains of fixed size (Gong 2015, sec. 6.3)", {.domain = Domain::box}},
        {"xpic",
         "ugimp with particle velocities filtered by XPIC(2) (Hammerquist & Nairn 2017)",
         {.domain = Domain::box, .filter = Filter::xpic}},
        {"fmpm",
         "ugimp with the approximate inverse of the consistent mass matrix FMPM(2) (Nairn & Hammerquist 2021)",
         {.domain = Domain::box, .filter = Filter::fmpm}},
        {"cpgimp", "GIMP with domains stretched along the axes (Gong 2015, sec. 6.3)", {.domain = Domain::stretched_box}},
        {"cpdi1", "convected particle domains, parallelepipeds (Gong 2015, sec. 6.4)", {.domain = Domain::parallelepiped}},
        {"cpdi2",
         "convected particle domains, quadrilaterals and hexahedra (Gong 2015, sec. 6.5; Sadeghirad et al. 2013)",
         {.domain = Domain::cell}},
        {"cpdi2t", "convected particle domains, triangles and tetrahedra (Nguyen et al. 2017)", {.domain = Domain::simplex}},
        {"cpdi2e",
         "enriched cpdi2: corners of cells at an interface between bodies are degrees of freedom (Sadeghirad et al. 2013)",
         {.domain = Domain::cell, .enrichment = Enrichment::adjacent}},
        {"fem",
         "every corner enriched: one-point updated-Lagrangian finite elements on the cells of cpdi2 (Sadeghirad et al. 2013)",
         {.domain          = Domain::cell,
          .weights         = CornerWeights::mean,
          .enrichment      = Enrichment::all,
          .corner_velocity = CornerVelocity::kept}},
        {"bscpdi2",
         "cpdi2 on quadratic splines: most robust for large shear on fine meshes (docs/vortex.md)",
         {.basis = Basis::bspline2, .domain = Domain::cell}},
        {"impm",
         "MLS velocity and one-point cell quadrature (Gong 2015, ch. 5)",
         {.projection = Projection::mls, .quadrature = Quadrature::cell}},
        {"impm-adjoint",
         "impm with the particle gradient adjoint to its quadrature; second order, which impm is not",
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
        {"cpls-limited",
         "cpls with fits limited where velocities jump, so that impacts hardly gain energy (docs/energy.md)",
         {.domain     = Domain::parallelepiped,
          .projection = Projection::imls,
          .samples    = Samples::corners,
          .limiter    = Limiter::slope}},
        {"bscpls",
         "cpls with cells on quadratic splines: contact of second order (docs/contact.md)",
         {.basis = Basis::bspline2, .domain = Domain::cell, .projection = Projection::imls, .samples = Samples::corners}},
        {"imls-mpm", "mpm with improved MLS velocity (Tran et al. 2019, Table 1)", {.projection = Projection::imls}},
        {"mls-bsmpm",
         "quadratic splines with MLS velocity (Tran et al. 2019, Table 1)",
         {.basis = Basis::bspline2, .projection = Projection::mls, .scheme = TimeScheme::musl}},
        {"wls",
         "ugimp with weighted least squares (Tran et al. 2019, Table 1)",
         {.domain = Domain::box, .projection = Projection::mls, .weight = Weight::quadratic}},
        {"bsmpm",
         "quadratic splines with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::bspline2, .mass = MassMatrix::consistent, .scheme = TimeScheme::musl}},
        {"ddmpm",
         "dual domain gradient with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::ddmpm, .mass = MassMatrix::consistent, .scheme = TimeScheme::musl}},
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
         spline_fit(Basis::bspline3, 3, 0, 0, TimeScheme::rk3)},
        {"spline4", "fourth order: the same with stresses of degree 4 and four stages",
         spline_fit(Basis::bspline3, 4, 0, 1, TimeScheme::rk4)},
        {"spline5", "fourth order for any particle positions: splines of degree 4, stresses of degree 5",
         spline_fit(Basis::bspline4, 5, 1, 1, TimeScheme::rk4)},
    };
    return rows;
}

const Preset* find_preset(std::string_view name)
{
    for (const Preset& p : presets())
        if (p.name == name) return &p;
    return nullptr;
}

std::vector<std::string> preset_names()
{
    std::vector<std::string> names;
    for (const Preset& p : presets()) names.emplace_back(p.name);
    return names;
}

}  // namespace ordo
