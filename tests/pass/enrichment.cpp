// Corners that are degrees of freedom of their own: which they are, what they get, conditions on them, and their limit, finite
// elements.
#include "method/diagnostics.hpp"
#include "method/layout.hpp"
#include "support/particles.hpp"
#include "support/plain_fem.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

namespace ordo {
namespace {

constexpr double kPi = std::numbers::pi;

MethodSpec enriched(Enrichment enrichment, CornerVelocity velocity = CornerVelocity::remapped)
{
    MethodSpec s;
    s.domain          = Domain::cell;
    s.weights         = velocity == CornerVelocity::kept ? CornerWeights::mean : CornerWeights::exact;
    s.enrichment      = enrichment;
    s.corner_velocity = velocity;
    return s;
}

std::vector<MethodSpec> enriched_shapes()
{
    std::vector<MethodSpec> r;
    for (const MethodSpec& s : test::all_shapes())
        if (has_enrichment(s)) r.push_back(s);
    return r;
}

/// On deformed cells every other corner of which is enriched: sum phi = 1, sum grad phi = 0, linear fields are exact.
template <int D>
void check_weights(const MethodSpec& spec)
{
    test::Random random(11);
    const Explicit<D> method(test::unit_box<D>(10, spec));
    State<D> s = test::random_state(method, 50, random);
    sort_particles(method.model(), s);
    const ParticleView<D> p = s.particles.view();
    test::with_shape<D>(spec, [&](auto shape) {
        for (int i = 0; i < p.count; ++i) {
            double sum = 0, size = 0;
            Vec<D> slope{}, x{};
            Mat<D> slopes{};
            int own = 0;
            decltype(shape)::type::for_each_node(s.lattice, p, i, nullptr, [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
                const Vec<D> at = test::place_of_node(s, static_cast<std::size_t>(node));
                sum += w;
                slope += dw;
                size += norm(dw);
                x += w * at;
                slopes += outer(at, dw);
                own += node >= static_cast<std::ptrdiff_t>(s.lattice.node_count());
            });
            EXPECT_GT(own, 0);
            EXPECT_NEAR(sum, 1, 1e-14);
            EXPECT_LE(norm(slope), 1e-14 * size);
            EXPECT_LE(norm(x - p.x[i]), 1e-14);
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) EXPECT_NEAR(slopes(a, b), a == b, 1e-14 * size);
        }
    });
}
TEST(Enrichment, WeightsReproduceLinearFields)
{
    test::for_each_spec(enriched_shapes(), [](const MethodSpec& spec) {
        check_weights<1>(spec);
        check_weights<2>(spec);
        check_weights<3>(spec);
    });
}

/// 8 x 4 cells in two halves: corners in columns of 5, the fifth on the interface.
TEST(Enrichment, LayersGrowFromTheInterface)
{
    auto count = [](Enrichment enrichment, double layers = MethodSpec{}.layers) {
        MethodSpec spec      = enriched(enrichment);
        spec.layers          = layers;
        const Model<2> model = test::unit_box<2>(8, spec);
        const auto seeds     = fill_box(Bounds<2>{{0.25, 0.25}, {0.75, 0.5}}, SubCells<2>{{}, model.h, {2, 2}});
        const Particles<2> p = test::plant_halves(model, seeds);
        EXPECT_EQ(p.corner.size(), 9u * 5u);
        for (const int c : p.enriched) EXPECT_LE(std::fabs(p.corner[c][0] - 0.5), 0.0625 * layers + 1e-12);
        return p.enriched.size();
    };
    EXPECT_EQ(count(Enrichment::interface, 2), 1u * 5u);
    EXPECT_EQ(count(Enrichment::adjacent), 3u * 5u);
    EXPECT_EQ(count(Enrichment::layers, 0), 1u * 5u);
    EXPECT_EQ(count(Enrichment::layers, 1), 3u * 5u);
    EXPECT_EQ(count(Enrichment::layers, 3), 7u * 5u);
    EXPECT_EQ(count(Enrichment::layers, 9), 9u * 5u);
    EXPECT_EQ(count(Enrichment::none), 0u);
    EXPECT_EQ(count(Enrichment::all, 9), 9u * 5u);
}

/// Bodies have corners of their own until enrichment makes one of those at one place; a slit within a body stays.
TEST(Enrichment, WeldsBodiesAndLeavesSlits)
{
    const Model<2> model = test::unit_box<2>(4, enriched(Enrichment::interface));
    auto square          = [](double x) { return CornerPoints<2>{{{x, 0}, {x + 0.25, 0}, {x, 0.25}, {x + 0.25, 0.25}}}; };
    Particles<2> p(4, field_groups(model));
    CellMesh<2> slit;  // two cells beside each other that share no corner
    for (double x : {0.0, 0.25}) {
        const CellMesh<2> one = weld<2>({square(x)});
        CornerIds<2> cell     = one.cells[0];
        for (int& c : cell.c) c += static_cast<int>(slit.corners.size());
        slit.corners.insert(slit.corners.end(), one.corners.begin(), one.corners.end());
        slit.cells.push_back(cell);
    }
    plant_cells(p, 0, slit, 1000.0);
    plant_cells(p, 2, weld<2>({square(0.5), square(0.75)}), 1000.0);
    p.body[2] = p.body[3] = 1;
    EXPECT_EQ(p.corner.size(), 8u + 6u);
    EXPECT_EQ(enrich(model, p), 2);
    EXPECT_EQ(p.corner.size(), 8u + 6u - 2u);
    EXPECT_EQ(p.cell[1][1], p.cell[2][0]);
    EXPECT_EQ(p.cell[1][3], p.cell[2][2]);
    EXPECT_NE(p.cell[0][1], p.cell[1][0]);
    EXPECT_EQ(enrich(model, p), 2);  // again: nothing changes
    EXPECT_EQ(p.corner.size(), 12u);
}

/// A body more leaves the velocities of the corners that are there.
TEST(Enrichment, BodiesKeepTheirCornerVelocities)
{
    const Model<1> model = test::unit_box<1>(4, enriched(Enrichment::all, CornerVelocity::kept));
    Particles<1> p(2, field_groups(model));
    for (int k = 0; k < 2; ++k) {
        plant_cells(p, k, weld<1>({CornerPoints<1>{{{0.5 * k}, {0.5 * k + 0.25}}}}), 1000.0);
        set_velocities<1>(
            p, k, k + 1, [k](const Vec<1>&) { return Vec<1>{1.0 + k}; }, model.h);
    }
    for (int c = 0; c < 4; ++c) EXPECT_EQ(p.corner_velocity[c][0], c < 2 ? 1.0 : 2.0);
}

// ---- the limit: finite elements --------------------------------------------------------------------------------------

/// The mesh of `model` and `corners` as plain elements; `body` of a place gives the material.
template <class Body>
test::PlainFem plain_fem(const Model<2>& model, const std::vector<CornerPoints<2>>& corners, const Body& body)
{
    const CellMesh<2> mesh = weld(corners);
    std::vector<test::PlainFem::Element> elements;
    for (const CornerIds<2>& c : mesh.cells) {
        const Vec<2> middle = 0.25 * (mesh.corners[c[0]] + mesh.corners[c[1]] + mesh.corners[c[2]] + mesh.corners[c[3]]);
        const Material& m   = model.materials[body(middle)];
        elements.push_back({.node = {c[0], c[1], c[3], c[2]}, .law = {m.lambda, m.mu}});
    }
    test::PlainFem fem(mesh.corners, elements, model.materials[0].density);
    fem.gravity = model.gravity;
    return fem;
}

/// Largest differences of places, velocities and stresses, each over the largest value.
struct Difference {
    double x = 0, v = 0, sigma = 0;
};
Difference difference(const State<2>& s, const test::PlainFem& fem, const std::vector<CornerPoints<2>>& corners)
{
    const std::vector<Vec<2>> start = weld(corners).corners;
    Difference d, size;
    for (std::size_t c = 0; c < start.size(); ++c) {
        d.x    = std::max(d.x, norm(s.particles.corner[c] - fem.x[c]));
        size.x = std::max(size.x, norm(fem.x[c] - start[c]));
        d.v    = std::max(d.v, norm(s.particles.corner_velocity[c] - fem.v[c]));
        size.v = std::max(size.v, norm(fem.v[c]));
    }
    for (int i = 0; i < s.particles.count; ++i) {
        const Mat<2>& sigma = fem.elements[s.particles.id[i]].sigma;
        const Mat<2> off    = in_plane(s.particles.sigma[i]) - sigma;
        d.sigma             = std::max(d.sigma, std::sqrt(ddot(off, off)));
        size.sigma          = std::max(size.sigma, std::sqrt(ddot(sigma, sigma)));
    }
    return {d.x / size.x, d.v / size.v, d.sigma / size.sigma};
}

/// The bi-material bar of Sadeghirad et al. (2013), 18 cells, 20000 steps of 5e-5 s.
TEST(FiniteElements, EqualPlainOnesOnTheBar)
{
    Model<2> model{};
    model.method     = find_preset("fem")->spec;
    model.origin     = {0, -1};
    model.h          = {1, 1};
    model.cells      = {1, 10};
    auto material    = [](double E) { return Material{find_law("neo-hookean"), 1050, 0.3 * E / (1.3 * 0.4), E / 2.6}; };
    model.materials  = {material(5e6), material(1e7)};
    model.gravity    = {0, -10};
    model.conditions = {{.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}},
                        {.axis = 0, .outer_is_above = true, .at = 1.0, .type = ConditionType::symmetry, .value = {}},
                        {.axis = 1, .outer_is_above = true, .at = 9.0, .type = ConditionType::fixed, .value = {}}};
    model.body_forces.resize(2);
    const auto seeds   = fill_box(Bounds<2>{{0, 0}, {1, 9}}, SubCells<2>{{}, model.h, {1, 2}});
    const auto corners = corner_points(seeds);
    auto body          = [](const Vec<2>& x) { return x[1] < 4.5 ? 0 : 1; };

    Particles<2> p = plant_all(model, seeds);
    for (int i = 0; i < p.count; ++i) p.body[i] = p.material[i] = body(p.x[i]);
    enrich(model, p);
    const Explicit<2> method(model);
    State<2> s          = method.start(std::move(p));
    test::PlainFem fem  = plain_fem(model, corners, body);
    const auto X        = fem.x;
    fem.constrain       = [X](int n, Vec<2>& v) { v = X[n][1] > 8.99 ? Vec<2>{} : Vec<2>{0.0, v[1]}; };
    constexpr double dt = 5e-5;
    double largest      = 0;
    for (int k = 0; k < 20000; ++k) {
        method.step(s, dt);
        fem.step(k == 0 ? dt / 2 : dt, dt);
        if (k % 1000 != 999) continue;
        const Difference d = difference(s, fem, corners);
        largest            = std::max({largest, d.x, d.v, d.sigma});
    }
    EXPECT_LT(largest, 1e-10);
    EXPECT_LT(fem.x[0][1], 0.0);  // it hangs out of its place
}

/// Slender quadrilaterals that turn and shear: a ring that spins, stretches and swings.
TEST(FiniteElements, EqualPlainOnesOnATurningRing)
{
    Model<2> model = test::unit_box<2>(8, find_preset("fem")->spec);
    model.origin   = {-1, -1};
    model.h        = {0.25, 0.25};
    const Tube<2> tube{.inner = 0.4, .outer = 0.7};
    const auto corners = polar_cells(tube, 3, 24, 1);
    Particles<2> p     = plant_all(model, fill_polar(tube, 3, 24, 1), corners);
    const auto spin    = [](const Vec<2>& x) { return Vec<2>{-0.4 * x[1] + 0.1 * x[0] * x[1], 0.4 * x[0]}; };
    set_velocities<2>(p, 0, p.count, spin, model.h);
    const Explicit<2> method(model);
    State<2> s         = method.start(std::move(p));
    test::PlainFem fem = plain_fem(model, corners, [](const Vec<2>&) { return 0; });
    for (std::size_t n = 0; n < fem.x.size(); ++n) fem.v[n] = spin(fem.x[n]);
    const double dt = 0.5 * stable_time_step(model, s.particles);
    for (int k = 0; k < 200; ++k) {
        method.step(s, dt);
        fem.step(k == 0 ? dt / 2 : dt, dt);
    }
    const Difference d = difference(s, fem, corners);
    EXPECT_LT(std::max({d.x, d.v, d.sigma}), 1e-11);
    EXPECT_GT(std::fabs(det(s.particles.F[0]) - 1), 1e-3);
}

/// Energies of a free block of square cells that swings, in steps of a part of the stable one.
double energy_growth(double part)
{
    Model<2> model = test::unit_box<2>(8, find_preset("fem")->spec);
    Particles<2> p = plant_all(model, test::block(model, 0.25, 0.75, 2));
    test::Random random(4);
    set_velocities<2>(
        p, 0, p.count,
        [&](const Vec<2>&) {
            return Vec<2>{test::uniform(random, -1e-6, 1e-6), test::uniform(random, -1e-6, 1e-6)};
        },
        model.h);
    const double dt = part * enriched_time_step(model, p);
    const Explicit<2> method(std::move(model));
    State<2> s         = method.start(std::move(p));
    const double start = totals(method.model(), s).kinetic_energy;
    for (int k = 0; k < 2000 && std::isfinite(s.t); ++k) {
        method.step(s, dt);
        if (totals(method.model(), s).total_energy() > 100 * start) return 100;
    }
    return totals(method.model(), s).total_energy() / start;
}
/// Square cells would expand and shrink at once along both axes; those of a mesh cannot, and allow h/c.
TEST(FiniteElements, TimeStepLimitIsSafe)
{
    const Model<2> model = test::unit_box<2>(8, find_preset("fem")->spec);
    const Particles<2> p = plant_all(model, test::block(model, 0.25, 0.75, 2));
    const Material& m    = model.materials[0];
    EXPECT_NEAR(enriched_time_step(model, p), 0.0625 / std::sqrt(2 * (m.lambda + m.mu) / m.density), 1e-12);
    EXPECT_LT(energy_growth(1.0), 10);
    EXPECT_EQ(energy_growth(1.05 * std::sqrt(2 * (m.lambda + m.mu) / m.p_wave_modulus())), 100);
}

// ---- conservation and conditions -------------------------------------------------------------------------------------

/// With kept velocities, too, momentum of corners is momentum of particles, where weights do not change.
TEST(Enrichment, KeptVelocitiesKeepMomentum)
{
    Model<2> model = test::unit_box<2>(8, find_preset("fem")->spec);
    Particles<2> p = plant_all(model, test::block(model, 0.25, 0.75, 2));
    set_velocities<2>(
        p, 0, p.count,
        [](const Vec<2>& x) {
            return Vec<2>{0.1 + 0.2 * std::sin(6 * x[1]), 0.1 * x[0] * x[0]};
        },
        model.h);
    const Explicit<2> method(model);
    State<2> s = method.start(std::move(p));
    auto sums  = [&] {
        const ProjectionReport& r = method.project(s);
        return std::array{r.momentum_after, totals(model, s).momentum};
    };
    const auto before = sums();
    for (int k = 0; k < 100; ++k) method.step(s, 0.5 * stable_time_step(model, s.particles));
    const auto after = sums();
    for (int k : {0, 1}) EXPECT_LT(norm(after[k] - before[k]), 1e-13 * norm(before[k]));
    EXPECT_NE(before[0][0], before[1][0]);  // they sample the field at other places
}

/// Corners that start on a plane stay on it; those that come to it stop there, and leave it when they want to.
TEST(Enrichment, ConditionsHoldOnCorners)
{
    for (const CornerVelocity velocity : {CornerVelocity::remapped, CornerVelocity::kept}) {
        Model<2> model   = test::unit_box<2>(8, enriched(Enrichment::all, velocity));
        model.conditions = {{.axis = 0, .at = 0.25, .type = ConditionType::symmetry, .value = {}},
                            {.axis = 1, .at = 0.2, .type = ConditionType::symmetry, .value = {}}};
        const auto seeds = fill_box(Bounds<2>{{0.25, 0.25}, {0.5, 0.75}}, SubCells<2>{{}, model.h, {2, 2}});
        Particles<2> p   = plant_all(model, seeds);
        set_velocities<2>(
            p, 0, p.count,
            [](const Vec<2>&) {
                return Vec<2>{0.0, -0.1};
            },
            model.h);
        const std::vector<Vec<2>> start(p.corner.begin(), p.corner.end());
        const Explicit<2> method(model);
        State<2> s      = method.start(std::move(p));
        const double dt = 0.3 * stable_time_step(model, s.particles);
        double lowest   = 1;
        for (int k = 0; k < 3000 && s.t < 4; ++k) {
            method.step(s, dt);
            for (std::size_t c = 0; c < start.size(); ++c) {
                if (start[c][0] < 0.2501) {
                    EXPECT_DOUBLE_EQ(s.particles.corner[c][0], 0.25);
                }
                lowest = std::min(lowest, s.particles.corner[c][1]);
            }
        }
        EXPECT_NEAR(lowest, 0.2, 0.1 * dt + 1e-6);
        double momentum = 0, low = 1;
        for (int i = 0; i < s.particles.count; ++i) momentum += s.particles.m[i] * s.particles.v[i][1];
        for (const Vec<2>& c : s.particles.corner) low = std::min(low, c[1]);
        EXPECT_GT(momentum, 0);
        EXPECT_GT(low, 0.21);
    }
}

/// A grip that pushes its corners inwards keeps them, as it does finite elements: nodes of the grid would be left behind.
TEST(Enrichment, GripsKeepTheirCorners)
{
    Model<2> model = test::unit_box<2>(8, find_preset("fem")->spec);
    Condition<2> grip{.axis = 1, .outer_is_above = true, .at = 0.75, .type = ConditionType::velocity, .value = {}};
    grip.value[1] =
        Field(std::function<double(const FieldPoint&)>([](const FieldPoint& at) { return -0.02 * std::min(1.0, at.t); }));
    model.conditions = {{.axis = 1, .at = 0.25, .type = ConditionType::fixed, .value = {}}, grip};
    const Explicit<2> method(model);
    State<2> s      = method.start(plant_all(model, test::block(model, 0.25, 0.75, 2)));
    const double dt = 0.5 * stable_time_step(model, s.particles);
    double way      = 0;
    for (int k = 0; k < 500; ++k) {
        way += dt * -0.02 * std::min(1.0, (k + 0.5) * dt);
        method.step(s, dt);
    }
    int on_grip = 0;
    for (const Vec<2>& x : s.particles.corner) on_grip += std::fabs(x[1] - (0.75 + way)) < 1e-12;
    EXPECT_EQ(on_grip, 9);
    EXPECT_LT(way, -0.02);
}

/// Two blocks of finite elements run into each other, meet on the grid and part again.
TEST(Enrichment, PartsMeetOnTheGrid)
{
    for (const CornerVelocity velocity : {CornerVelocity::remapped, CornerVelocity::kept}) {
        const Model<2> model = test::unit_box<2>(16, enriched(Enrichment::all, velocity));
        auto seeds           = test::block(model, 0.25, 0.4375, 2);
        for (auto& seed : test::block(model, 0.5625, 0.75, 2)) seeds.push_back(seed);
        for (auto& seed : seeds) seed.x[1] = seed.x[0] > 0.5 ? seed.x[1] - 0.3125 : seed.x[1];
        Particles<2> p = plant_all(model, seeds);
        EXPECT_EQ(p.part_count, 2);
        set_velocities<2>(
            p, 0, p.count,
            [](const Vec<2>& x) {
                return Vec<2>{x[0] < 0.5 ? 0.1 : -0.1, 0.0};
            },
            model.h);
        const std::vector<int> part(p.corner_part.begin(), p.corner_part.end());
        const Explicit<2> method(model);
        State<2> s      = method.start(std::move(p));
        const double dt = 0.4 * stable_time_step(model, s.particles), mass = totals(model, s).mass;
        double gap = 1, last_gap = 1;
        std::size_t fewest = s.particles.corner.size();
        while (s.t < 3) {
            method.step(s, dt);
            double left = 0, right = 1;
            std::size_t own = 0;
            for (std::size_t c = 0; c < part.size(); ++c) {
                if (part[c] == 0)
                    left = std::max(left, s.particles.corner[c][0]);
                else
                    right = std::min(right, s.particles.corner[c][0]);
                own += s.particles.corner_node[c] >= 0;
            }
            last_gap = right - left;
            gap      = std::min(gap, last_gap);
            fewest   = std::min(fewest, own);
        }
        const Totals end = totals(model, s);
        EXPECT_LT(norm(end.momentum), 1e-13 * mass * 0.1);
        EXPECT_LT(end.kinetic_energy + end.strain_energy, 1.01 * 0.5 * mass * 0.01);
        EXPECT_GT(end.kinetic_energy, 0.3 * 0.5 * mass * 0.01);
        EXPECT_LT(fewest, part.size());  // some went to the grid
        EXPECT_GT(gap, 0.0);
        EXPECT_LT(gap, model.h[0]);
        EXPECT_GT(last_gap, 0.1);
    }
}

/// A body that crosses the seam of a periodic box, whose corners there belong to particles a period apart: the same bytes for
/// any number of threads.
TEST(Enrichment, SeamIsTheSameForAnyThreads)
{
    auto run = [](int threads) {
        set_thread_count(threads);
        Model<2> model = test::unit_box<2>(24, enriched(Enrichment::all));
        model.periodic = {true, true};
        Particles<2> p = plant_all(model, test::block(model, 0.25, 0.875, 2));
        set_velocities<2>(
            p, 0, p.count,
            [](const Vec<2>& x) {
                return Vec<2>{1.0 + 0.1 * std::sin(2 * kPi * x[1]), 1.0};
            },
            model.h);
        const Explicit<2> method(model);
        State<2> s = method.start(std::move(p));
        for (int k = 0; k < 40; ++k) method.step(s, 0.4 * stable_time_step(model, s.particles));
        return s;
    };
    const int before   = thread_count();
    const State<2> one = run(1), many = run(8);
    set_thread_count(before);
    const Particles<2>&p = one.particles, &q = many.particles;
    EXPECT_EQ(std::memcmp(p.corner.data(), q.corner.data(), sizeof(p.corner[0]) * p.corner.size()), 0);
    EXPECT_EQ(std::memcmp(p.v.data(), q.v.data(), sizeof(p.v[0]) * p.v.size()), 0);
    int turned = 0;
    for (int i = 0; i < p.count; ++i) turned += p.turns[i][0] > 0;
    EXPECT_GT(turned, 0);
    EXPECT_LT(turned, p.count);
}

TEST(Enrichment, RefusesACutAtTheSeam)
{
    Model<2> model = test::unit_box<2>(8, enriched(Enrichment::all));
    model.periodic = {true, false};
    EXPECT_THROW(plant_all(model, test::block(model, 0.0, 1.0, 2)), InputError);
    EXPECT_NO_THROW(plant_all(model, test::block(model, 0.0, 0.5, 2)));
}

}  // namespace
}  // namespace ordo
