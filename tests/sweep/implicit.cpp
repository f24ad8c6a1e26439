// Implicit schemes in every combination of the axes that they take: the tangent is the derivative of the residual, and what a step keeps.
#include "implicit/newton.hpp"
#include "implicit/scheme.hpp"
#include "method/diagnostics.hpp"
#include "setup/build.hpp"
#include "setup/schemes.hpp"
#include "sim/simulation.hpp"
#include "solve/krylov.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

/// Every allowed combination of basis, domain, mass matrix and averaging with each implicit scheme.
std::vector<MethodSpec> implicit_specs()
{
    std::vector<MethodSpec> r;
    for (const TimeScheme scheme : {TimeScheme::midpoint, TimeScheme::newmark, TimeScheme::quasi_static})
        for (const auto& basis : Axis<Basis>::choices)
            for (const auto& domain : Axis<Domain>::choices)
                for (const auto& mass : Axis<MassMatrix>::choices)
                    for (const auto& averaging : Axis<Averaging>::choices) {
                        MethodSpec s    = test::shape_spec(basis.value, domain.value);
                        s.scheme        = scheme;
                        s.mass          = mass.value;
                        s.averaging     = averaging.value;
                        s.ghost_penalty = 0.02;
                        if (!broken_rule(s)) r.push_back(s);
                    }
    return r;
}
/// One for each shape, and for each other choice of the axes.
std::vector<MethodSpec> few_specs()
{
    std::vector<MethodSpec> r;
    for (const MethodSpec& s : implicit_specs()) {
        const bool is_plain = s.mass == MassMatrix::lumped && s.averaging == Averaging::none;
        const bool is_usual = s.basis == Basis::hat && s.domain == Domain::parallelepiped;
        if ((is_plain && s.scheme == TimeScheme::midpoint) || is_usual) r.push_back(s);
    }
    return r;
}

template <int D>
constexpr int cells_of_box()
{
    return D == 3 ? 5 : 8;
}

enum class Where { inside, at_seam };  ///< of a period along the last axis

/// A body that is held at one face and loaded on the others, in motion.
template <int D>
struct Loaded {
    std::unique_ptr<Scheme<D>> scheme;
    State<D> s;
    test::Random random{7};

    Loaded(const MethodSpec& spec, const Material& material, Where where)
    {
        Model<D> model        = test::unit_box<D>(cells_of_box<D>(), spec);
        model.materials[0]    = material;
        model.periodic[D - 1] = where == Where::at_seam;
        model.gravity         = Vec<D>::filled(-0.3);
        for (int a = 0; a < D; ++a) model.body_forces[0][a] = model.body_forces[1][a] = Field(0.2 * (a + 1));
        model.conditions.push_back({.axis = 0, .outer_is_above = false, .at = 0.0, .type = ConditionType::fixed});
        for (const TractionType type : {TractionType::pressure, TractionType::traction, TractionType::dead}) {
            model.tractions.push_back({.type = type, .value = {}});
            for (int a = 0; a < D; ++a) model.tractions.back().value[a] = Field(3.0 + a);
        }
        const std::vector<Seed<D>> seeds = test::block(model, 0.0, 0.6, 2);
        Particles<D> p                   = test::plant_halves(model, seeds);
        const CellMesh<D> mesh           = mesh_of(spec, seeds);
        for (int k = 0; k < 3; ++k)
            add_loads<D>(model.loads, p, mesh, 0, k, [&](const Vec<D>& normal, const Vec<D>&) {
                const bool is_on = k == 0   ? normal[D - 1] > 0.5
                                   : k == 1 ? normal[0] > 0.5
                                            : normal[0] > 0.5 || normal[D - 1] < -0.5;
                return is_on ? 0.7 : 0.0;
            });
        scheme = make_scheme(std::move(model));
        s      = scheme->start(std::move(p));
        set_velocities(
            s.particles, 0, s.particles.count,
            [&](const Vec<D>& x) {
                Vec<D> v{};
                for (int a = 0; a < D; ++a) v[a] = 0.05 * std::sin(6 * x[D - 1 - a] + a);
                return v;
            },
            scheme->model().h);
    }
};

/// The equations of a step at random displacements: dr/du in random directions is what central differences (of fourth order) give. The matrix is the
/// same but for loads on faces and, with averages, for what stresses have of it.
template <int D>
void check_equations(const Model<D>& model, State<D>& s, double dt, test::Random& random)
{
    const MethodSpec& spec = model.method;
    const std::string law(model.materials[0].law->name);
    const Passes<D> passes = choose_passes<D>(spec);
    const MassSolver<D> mass(passes, lump_below_of(spec), false);
    StepEquations<D> step(model, passes, mass, s, dt, [](State<D>&, double) {});
    const std::size_t n = step.size();
    auto random_vector  = [&](double size) {
        std::vector<double> x(n);
        for (double& one : x) one = test::uniform(random, -size, size);
        return x;
    };
    const std::vector<double> u = random_vector(0.02 * model.h[0]), x = random_vector(1.0);
    std::vector<double> product(n), difference(n, 0.0), r(n), at(n);
    ASSERT_TRUE(step.find_residual(u, r, true));
    step.multiply(x, product);
    const double size = length_of(product);
    const double e    = 1e-6 * model.h[0];  // small, for laws have kinks
    for (const auto& [shift, factor] : {std::pair{-2.0, -1.0}, {-1.0, 8.0}, {1.0, -8.0}, {2.0, 1.0}}) {
        for (std::size_t k = 0; k < n; ++k) at[k] = u[k] + shift * e * x[k];
        ASSERT_TRUE(step.find_residual(at, r, false));
        for (std::size_t k = 0; k < n; ++k) difference[k] += factor * r[k] / (12 * e);
    }
    add_multiple(difference, -1.0, product);
    EXPECT_LT(length_of(difference), 1e-7 * size) << law;

    if (spec.averaging == Averaging::node) return;
    std::vector<double> by_matrix(n, 0.0);
    ASSERT_TRUE(step.find_residual(u, r, true));
    const SparseRows<Mat<D>> matrix = step.matrix();
    for (std::ptrdiff_t row = 0; row < matrix.size(); ++row)
        matrix.for_each(row, [&](int column, const Mat<D>& block) {
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) by_matrix[D * row + a] += block(a, b) * x[D * column + b];
        });
    add_multiple(by_matrix, -1.0, product);
    EXPECT_LT(length_of(by_matrix), 0.03 * size) << law;
}

/// Those from a state that has come some steps.
template <int D>
void check_tangent(const MethodSpec& spec, const Material& material, Where where = Where::inside)
{
    MethodSpec before = spec;  // loads at once are more than some laws bear at rest
    if (is_static(spec)) before.scheme = TimeScheme::midpoint;
    Loaded<D> body(before, material, where);
    Model<D> model  = body.scheme->model();
    model.method    = spec;
    State<D>& s     = body.s;
    const double dt = 2 * courant_time_step(model, s.particles);
    for (int k = 0; k < 2; ++k) body.scheme->step(s, dt);
    body.scheme->project(s);  // sorts
    check_equations(model, s, dt, body.random);
}

template <int D>
void check_tangents(const MethodSpec& spec)
{
    check_tangent<D>(spec, test::sample_material("neo-hookean", D));
}
TEST(Implicit, TangentIsTheDerivativeIn1D) { test::for_each_spec(implicit_specs(), check_tangents<1>); }
TEST(Implicit, TangentIsTheDerivativeIn2D) { test::for_each_spec(implicit_specs(), check_tangents<2>); }
TEST(Implicit, TangentIsTheDerivativeIn3D) { test::for_each_spec(few_specs(), check_tangents<3>); }
TEST(Implicit, DISABLED_TangentIsTheDerivativeInAllOf3D) { test::for_each_spec(implicit_specs(), check_tangents<3>); }  // nightly

TEST(Implicit, TangentIsTheDerivativeAcrossAPeriod)
{
    test::for_each_spec(few_specs(), [](const MethodSpec& spec) {
        const Material material = test::sample_material("neo-hookean", 2);
        if (!has_cells(spec)) check_tangent<2>(spec, material, Where::at_seam);
    });
}

/// The same for every law, in every scheme.
TEST(Implicit, TangentIsTheDerivativeForEveryLaw)
{
    for (const TimeScheme scheme : {TimeScheme::midpoint, TimeScheme::newmark, TimeScheme::quasi_static})
        for (const Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3})
            for (const Averaging averaging : {Averaging::none, Averaging::cell})
                for (const LawRow& law : laws()) {
                    MethodSpec spec = test::shape_spec(basis, Domain::parallelepiped);
                    spec.scheme     = scheme;
                    spec.averaging  = averaging;
                    SCOPED_TRACE(test::describe(spec) + ", " + std::string(law.name));
                    EXPECT_NO_THROW(check_tangent<1>(spec, test::sample_material(law.name, 1)));
                    if (law.max_dim > 1) {
                        EXPECT_NO_THROW(check_tangent<2>(spec, test::sample_material(law.name, 2)));
                    }
                    if (law.max_dim > 2 && averaging == Averaging::none && basis == Basis::hat) {
                        EXPECT_NO_THROW(check_tangent<3>(spec, test::sample_material(law.name, 3)));
                    }
                }
}

/// A block that overlaps a moving floor by a twentieth of a cell, off the axes of the grid.
template <int D>
void check_obstacle(const MethodSpec& spec, ContactType type, double friction, bool on_faces)
{
    setup::CaseSpec<D> block{};
    block.method    = spec;
    block.size      = Vec<D>::filled(1.0);
    block.spacing   = Vec<D>::filled(0.2);
    block.materials = {test::sample_material("neo-hookean", D)};
    block.bodies    = {{.shape = Bounds<D>{Vec<D>::filled(0.2), Vec<D>::filled(0.8)}}};
    block.time      = {.end = 1.0, .dt = 1e-3};
    Vec<D> normal{}, point = Vec<D>::filled(0.2);
    normal[0]     = 0.005;
    normal[D - 1] = 1.0;
    point[D - 1] += 0.01;
    setup::ObstacleSpec<D> floor{.contact = {.type = type, .friction = friction, .on_faces = on_faces},
                                 .solid   = HalfSpace<D>{point, (1 / norm(normal)) * normal}};
    floor.velocity[0] = Field(2.0);
    block.obstacles   = {floor};
    Simulation<D> sim(setup::build(block));
    sim.scheme().project(sim.state());
    test::Random random(11);
    check_equations(sim.model(), sim.state(), 1e-3, random);
}
/// Where points stick, slide and rise off an obstacle, at vertices and on faces, with every scheme and mass.
TEST(Implicit, TangentIsTheDerivativeOnObstacles)
{
    for (const MethodSpec& spec : few_specs()) {
        const bool has_faces = has_cells(spec) || spec.domain == Domain::parallelepiped;
        if (!has_faces) continue;
        SCOPED_TRACE(test::describe(spec));
        for (const bool on_faces : {false, true}) {
            check_obstacle<2>(spec, ContactType::frictional, 0.3, on_faces);
            check_obstacle<2>(spec, ContactType::frictional, 100.0, on_faces);
            check_obstacle<2>(spec, ContactType::frictionless, 0.0, on_faces);
            check_obstacle<2>(spec, ContactType::tied, 0.0, on_faces);
        }
        check_obstacle<3>(spec, ContactType::frictional, 0.3, false);
    }
}

/// Newton's method converges quadratically: at the end the residual falls to a multiple of its square.
template <int D>
void check_newton(const MethodSpec& given)
{
    MethodSpec spec       = given;
    spec.newton_tolerance = 1e-13;
    Loaded<D> body(spec, test::sample_material("neo-hookean", D), Where::inside);
    body.scheme->step(body.s, 5 * courant_time_step(body.scheme->model(), body.s.particles));
    std::vector<double> r;
    for (const NewtonIteration& one : body.s.newton.of_step.back().iterations) r.push_back(one.residual);
    ASSERT_GE(r.size(), 3u);
    EXPECT_LE(r.size(), 8u);
    // The last that rounding does not spoil.
    std::size_t k = 1;
    while (k + 1 < r.size() && r[k + 1] > 1e-10 * r[0]) ++k;
    ASSERT_GE(k, 2u);
    EXPECT_LT(r[k] / r[0], 20 * std::pow(r[k - 1] / r[0], 2)) << r[k - 1] << " " << r[k];
}
TEST(Implicit, NewtonIsQuadratic)
{
    test::for_each_spec(few_specs(), [](const MethodSpec& spec) {
        check_newton<1>(spec);
        check_newton<2>(spec);
    });
}

}  // namespace
}  // namespace ordo
