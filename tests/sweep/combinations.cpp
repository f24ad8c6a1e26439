// Every combination of the axes that exists, generated from the tables: a new choice is tested by existing.
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/layout.hpp"
#include "setup/schemes.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

/// The allowed ones of all_specs. In 3D not every start, to save time.
std::vector<MethodSpec> allowed(int dim)
{
    std::vector<MethodSpec> r;
    for (const MethodSpec& spec : test::all_specs())
        if (!broken_rule(spec) && (dim < 3 || spec.start == Start::leapfrog)) r.push_back(spec);
    return r;
}

template <int D>
constexpr int cells_of_box()
{
    return D == 1 ? 16 : 8;
}
constexpr int kSteps = 20;
constexpr double kPi = 3.14159265358979324;

/// A rigid translation stays one, exactly: nothing deforms, every velocity is kept.
/// `shift` of a cell from the usual places: a quarter puts particles on cell faces, where hats have two slopes.
template <int D>
void check_translation(const MethodSpec& spec, double shift)
{
    const std::unique_ptr<const Scheme<D>> owner = make_scheme(test::unit_box<D>(cells_of_box<D>(), spec));
    const Scheme<D>& method                      = *owner;
    // Those of the solver, and of fits at nodes far from their samples, which a solver then starts from.
    const double tolerance = (spec.mass == MassMatrix::consistent ? 1e-9 : 1e-11) * (fits_velocity(spec) ? 10 : 1);
    const double h = method.model().h[0], low = 0.25 + shift * h, time = 0.01 * h * kSteps;
    State<D> s = method.start(test::plant_halves(method.model(), test::block(method.model(), low, low + 2 * h, 2)));
    const std::vector<Vec<D>> corners(s.particles.corner.begin(), s.particles.corner.end());
    Vec<D> v{};
    for (int a = 0; a < D; ++a) v[a] = 7 - 3 * a;  // a cell and more
    set_velocities(
        s.particles, 0, s.particles.count, [&](const Vec<D>&) { return v; }, method.model().h);
    const int steps = is_implicit(spec) ? 3 : kSteps;  // each of them solves equations
    for (int k = 0; k < steps; ++k) method.step(s, time / steps);
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(s.particles.v[i][a], v[a], tolerance);
            EXPECT_NEAR(s.particles.x[i][a] - s.particles.X[i][a], time * v[a], 0.1 * tolerance);
            for (int b = 0; b < D; ++b) EXPECT_NEAR(s.particles.F[i](a, b), a == b, tolerance);
        }
    for (std::size_t c = 0; c < corners.size(); ++c)
        for (int a = 0; a < D; ++a) EXPECT_NEAR(s.particles.corner[c][a], corners[c][a] + time * v[a], 0.1 * tolerance);
}
template <int D>
void check_translations(const MethodSpec& spec)
{
    if (needs_full_grid(spec) || is_static(spec)) return;  // whose bodies end at walls, or have no velocity
    for (double shift : {0.0, 0.25, 0.25 + 1e-15, 0.25 - 1e-15}) check_translation<D>(spec, shift);
}
TEST(Combinations, ConstantVelocityIsExactIn1D) { test::for_each_spec(allowed(1), check_translations<1>); }
TEST(Combinations, ConstantVelocityIsExactIn2D) { test::for_each_spec(allowed(2), check_translations<2>); }
TEST(Combinations, ConstantVelocityIsExactIn3D)
{
    test::for_each_spec(allowed(3), [](const MethodSpec& spec) {
        if (!needs_full_grid(spec) && !is_static(spec)) check_translation<3>(spec, 0.25 + 1e-15);
    });
}

/// Methods for bodies that fill their cells: points of cells stand for material where there is none, and weights narrower
/// than 2h find one layer of particles at a free surface and extrapolate from it. They want three particles an axis.
bool needs_full_cells(const MethodSpec& spec)
{
    return spec.quadrature != Quadrature::particle || (fits_velocity(spec) && spec.weight != Weight::cubic);
}

/// Twenty steps of a wobbling block: finite, every particle still there, and what the method claims to keep is kept.
template <int D>
void check_conservation(MethodSpec spec, const LawRow& law)
{
    if (is_static(spec)) return;  // without momentum
    if (is_implicit(spec)) spec.newton_tolerance = 1e-13;
    const bool is_walled = needs_full_cells(spec);
    Model<D> model =
        is_walled ? test::walled_box<D>(D == 3 ? 4 : cells_of_box<D>(), spec) : test::unit_box<D>(cells_of_box<D>(), spec);
    model.materials[0]                           = test::sample_material(law.name, D);
    const std::unique_ptr<const Scheme<D>> owner = make_scheme(std::move(model));
    const Scheme<D>& method                      = *owner;
    const double low = is_walled ? 0.0 : 0.25, high = is_walled ? 1.0 : D == 3 ? 0.5 : 0.75;
    State<D> s  = method.start(test::plant_halves(method.model(), test::block(method.model(), low, high, is_walled ? 3 : 2)));
    auto wobble = [&](const Vec<D>& x) {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = is_walled ? 0.05 * std::sin(kPi * x[a]) : 0.05 * std::sin(6 * x[a]) + 0.02;
        return v;
    };
    set_velocities(s.particles, 0, s.particles.count, wobble, method.model().h);
    const Totals before = totals(method.model(), s);
    const int steps     = is_implicit(spec)       ? 3
                          : D < 3 || !is_walled   ? kSteps
                          : needs_full_grid(spec) ? kSteps / 10
                                                  : kSteps / 2;  // to save time
    for (int k = 0; k < steps; ++k) method.step(s, 0.1 * courant_time_step(method.model(), s.particles));
    const Totals after = totals(method.model(), s);
    double size        = 0;
    std::vector<bool> seen(s.particles.x.size());
    for (int i = 0; i < s.particles.count; ++i) {
        size += s.particles.m[i] * norm(s.particles.v[i]);
        seen[s.particles.id[i]] = true;
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), s.particles.count);
    EXPECT_EQ(before.mass, after.mass);
    double nodal = 0;
    s.field.tiles.for_each_node([&](const Index<D>&, std::ptrdiff_t node) { nodal += s.field.nodes[node][NodeLane::mass]; });
    for (const int c : s.particles.enriched)
        if (const std::ptrdiff_t own = s.particles.corner_node[c]; own >= 0) nodal += s.field.nodes[own][NodeLane::mass];
    EXPECT_NEAR(nodal, before.mass, keeps_mass(spec) ? 1e-13 * before.mass : 0.5 * before.mass);
    for (int a = 0; a < D && !is_walled; ++a)
        EXPECT_NEAR(before.momentum[a], after.momentum[a], keeps_momentum(spec) ? 1e-12 * size : 0.1 * size);
    EXPECT_TRUE(std::isfinite(after.total_energy()));
    EXPECT_GT(after.strain_energy, 0);
    if (spec.filter != Filter::none && instability_of(spec)) return;  // a filter speeds up what grows
    EXPECT_LT(after.total_energy(), 1.2 * before.total_energy());     // the part that affine fields hold is not counted
}
template <int D>
void check_neo_hookean(const MethodSpec& spec)
{
    check_conservation<D>(spec, *find_law("neo-hookean"));
}
TEST(Combinations, MassAndMomentumAreKeptIn1D) { test::for_each_spec(allowed(1), check_neo_hookean<1>); }
TEST(Combinations, MassAndMomentumAreKeptIn2D) { test::for_each_spec(allowed(2), check_neo_hookean<2>); }
TEST(Combinations, MassAndMomentumAreKeptIn3D) { test::for_each_spec(allowed(3), check_neo_hookean<3>); }
TEST(Combinations, MassAndMomentumAreKeptForEveryMaterial)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        for (const LawRow& law : laws()) {
            if (law.name == "neo-hookean") continue;  // has been
            check_conservation<1>(spec, law);
            if (law.max_dim >= 2) check_conservation<2>(spec, law);
        }
    });
}

/// Uniform stress on a tiling gives no force on nodes whose functions end inside the body; cells need not be regular.
template <int D>
void check_uniform_stress(const MethodSpec& spec)
{
    const Explicit<D> method(test::unit_box<D>(cells_of_box<D>(), spec));
    const Model<D>& model = method.model();
    State<D> s            = method.start(test::plant_halves(model, test::block(model, 0.25, 0.75, 2)));
    test::Random random(5);
    auto is_inside = [](const Vec<D>& x, double margin) {
        bool r = true;
        for (int a = 0; a < D; ++a) r = r && x[a] > 0.25 + margin && x[a] < 0.75 - margin;
        return r;
    };
    for (Vec<D>& corner : s.particles.corner)
        if (is_inside(corner, 1e-9))
            for (int a = 0; a < D; ++a) corner[a] += test::uniform(random, -0.05, 0.05) * model.h[a];
    test::follow(model, s);
    sort_particles(model, s);
    for (Stress<D>& sigma : s.particles.sigma)
        for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) sigma(a, b) = 10.0 + a + b;
    const Passes<D> passes = choose_passes<D>(spec);
    for (Lanes& n : s.field.nodes) n = Lanes{};
    const Sweep<D> view{s.lattice, s.particles.view(), s.field.nodes.data(), model.materials.data(), 0, 0, 0};
    passes.project(view, 0, s.particles.count);
    passes.force(view, 0, s.particles.count);
    double inside = 0, edge = 0;
    int count = 0;
    for (std::size_t n = 0; n < s.field.nodes.size(); ++n) {
        const double reach  = n < s.lattice.node_count() ? 0.5 * (s.lattice.basis.degree + 1) - 1e-9 : 1e-9;  // in cells
        const bool interior = is_inside(test::place_of_node(s, n), reach * model.h[0]);
        count += interior;
        for (int a = 0; a < D; ++a)
            (interior ? inside : edge) = std::max(interior ? inside : edge, std::fabs(s.field.nodes[n][NodeLane::increment + a]));
    }
    EXPECT_LT(inside, 2e-13 * edge);
    EXPECT_GT(edge, 0.01);
    EXPECT_GT(count, 0);
}
TEST(Combinations, UniformStressGivesNoForceInside)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_uniform_stress<1>(spec);
        check_uniform_stress<2>(spec);
        check_uniform_stress<3>(spec);
    });
}

/// A velocity that is linear in the places of the nodes (of splines their Greville points): F of every particle, also next to
/// the faces of the grid, and the motion of corners are exact.
template <int D>
void check_linear_velocity(const MethodSpec& spec)
{
    const Explicit<D> method(test::unit_box<D>(cells_of_box<D>(), spec));
    const Model<D>& model = method.model();
    State<D> s            = method.start(test::plant_halves(model, test::block(model, 0.0, 0.5, 2)));
    test::Random random(9);
    const Mat<D> A = test::random_deformation<D>(random, 0.9);
    const Vec<D> b = Vec<D>::filled(0.3);
    for (std::size_t n = 0; n < s.field.nodes.size(); ++n) {
        const Vec<D> x  = test::place_of_node(s, n);
        bool is_in_grid = true;
        for (int a = 0; a < D; ++a) is_in_grid = is_in_grid && x[a] > -1e-9 && x[a] < 1 + 1e-9;
        const Vec<D> v   = A * x + b;
        s.field.nodes[n] = Lanes{};
        for (int a = 0; a < D; ++a) s.field.nodes[n][NodeLane::velocity + a] = v[a];
        s.field.nodes[n][NodeLane::mass] = is_in_grid;
    }
    const Passes<D> passes  = choose_passes<D>(spec);
    const double dt         = 0.1;
    const ParticleView<D> p = s.particles.view();
    Sweep<D> view{s.lattice, p, s.field.nodes.data(), model.materials.data(), dt, 0, 0};
    const Mat<D> forward = Mat<D>::identity() + dt * A, past = inverse(Mat<D>::identity() - dt * A);
    TileReport report;
    auto check_F = [&](auto pass, const Mat<D>& step) {
        for (Mat<D>& F : s.particles.F) F = Mat<D>::identity();
        pass(view, 0, p.count, report);
        double error = 0;
        for (int i = 0; i < p.count; ++i)
            for (int a = 0; a < D; ++a)
                for (int c = 0; c < D; ++c) error = std::max(error, std::fabs(p.F[i](a, c) - step(a, c)));
        EXPECT_LT(error, 1e-12);
    };
    const std::vector<Vec<D>> x(p.x, p.x + p.count), corners(s.particles.corner.begin(), s.particles.corner.end());
    check_F(passes.deform, forward);
    view.is_past = true;
    check_F(passes.deform, past);
    view.is_past = false;
    check_F(passes.update_all, forward);
    if (passes.move_corners) {
        passes.move_corners(view, 0, static_cast<std::ptrdiff_t>(corners.size()));
        passes.follow_corners(view, 0, p.count, report);
    }
    auto moved = [&](const Vec<D>& from) { return from + dt * (A * from + b); };
    for (std::size_t c = 0; c < corners.size(); ++c) EXPECT_LT(norm(p.corner[c] - moved(corners[c])), 1e-13);
    for (int i = 0; i < p.count; ++i) {
        EXPECT_LT(norm(p.x[i] - moved(x[i])), 1e-13);
        EXPECT_NEAR(p.V[i], det(forward) * p.V0[i], 1e-12 * p.V0[i]);
    }
}
TEST(Combinations, LinearVelocityIsExact)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_linear_velocity<1>(spec);
        check_linear_velocity<2>(spec);
        check_linear_velocity<3>(spec);
    });
}

/// Forbidden combinations say why.
template <int D>
void check_refusal(const MethodSpec& spec)
{
    try {
        static_cast<void>(choose_passes<D>(spec));
        FAIL() << test::describe(spec);
    } catch (const InputError& e) {
        EXPECT_NE(std::string(e.what()).find(broken_rule(spec)->why), std::string::npos) << e.what();
    }
}
TEST(Combinations, ForbiddenOnesSayWhy)
{
    std::vector<MethodSpec> specs = test::all_specs();
    for (MethodSpec spec : test::shapes()) {
        spec.stretch_limit = 2;
        specs.push_back(spec);
    }
    for (const Preset& p : presets()) {
        specs.push_back(p.spec);
        specs.back().pic_fraction = 0.1;
        specs.push_back(p.spec);
        specs.back().degree = 3;
        specs.push_back(p.spec);
        specs.back().a0 = 0.3;
        specs.push_back(p.spec);
        specs.back().lump_below = 0.1;
        specs.push_back(p.spec);
        specs.back().layers = 3;
        specs.push_back(p.spec);
        specs.back().null_damping = 0.5;
        specs.push_back(p.spec);
        specs.back().quadratic_viscosity = 1.5;
        specs.push_back(p.spec);
        specs.back().strain_velocity = 0.3;
        specs.push_back(p.spec);
        specs.back().newmark_beta = 0.3;
        specs.push_back(p.spec);
        specs.back().scheme        = TimeScheme::newmark;
        specs.back().newmark_gamma = 0.6;
        specs.back().newmark_beta  = 0.25;
        specs.push_back(specs.back());
        specs.back().newmark_beta = 0.4;
        specs.back().mass         = MassMatrix::consistent;
        specs.push_back(p.spec);
        specs.back().step_halvings = 3;
        specs.push_back(p.spec);
        specs.back().filter_order = 3;
        for (const double pic : {0.0, 0.1}) {
            specs.push_back(p.spec);
            specs.back().filter       = Filter::xpic;
            specs.back().pic_fraction = pic;
        }
        specs.push_back(p.spec);
        specs.back().tls        = Tls::velocity;
        specs.back().quadrature = Quadrature::cell;
        specs.back().mass       = MassMatrix::lumped;
    }
    std::vector<bool> seen(rules().size());
    for (const MethodSpec& spec : specs) {
        const Rule* rule = broken_rule(spec);
        if (!rule) continue;
        seen[static_cast<std::size_t>(rule - rules().data())] = true;
        check_refusal<1>(spec);
        check_refusal<2>(spec);
        check_refusal<3>(spec);
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0) << "a rule that forbids nothing";
}

/// Every preset is one of the combinations above, under a name of its own.
TEST(Combinations, PresetsDiffer)
{
    std::vector<std::string> rows;
    for (const Preset& p : presets()) {
        std::string row;
        for_each_axis([&](auto axis) { row += std::string(name_of(p.spec.*axis)) + ","; });
        rows.push_back(row);
    }
    std::sort(rows.begin(), rows.end());
    EXPECT_EQ(std::unique(rows.begin(), rows.end()), rows.end());
}

}  // namespace
}  // namespace ordo
