// Contact: bodies in velocity fields of their own, points where their faces meet, and the impulses there.
#include "method/contact_points.hpp"
#include "method/diagnostics.hpp"
#include "method/tables.hpp"
#include "setup/build.hpp"
#include "shape/curved_face.hpp"
#include "sim/simulation.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace ordo {
namespace {

using namespace setup;

/// Whether bodies can have velocity fields of their own.
bool can_have_fields(const MethodSpec& m)
{
    return !is_spline_fit(m) && !has_enrichment(m) && m.mass == MassMatrix::lumped && m.quadrature == Quadrature::particle &&
           m.projection != Projection::tls && m.gradient != Gradient::adjoint;
}

/// Two halves of a block that share nodes, each in its field: both move as if the other were not there.
template <int D>
void check_fields(const MethodSpec& spec)
{
    Model<D> model           = test::unit_box<D>(D == 3 ? 4 : 8, spec);
    std::vector<Seed<D>> all = test::block(model, 0.25, 0.75, 4 - D / 3), parts[2];
    for (Seed<D>& one : all) {
        const bool is_above = one.x[0] > 0.5;
        if (is_above) one.x[0] += 0.1 * model.h[0];  // so that no cells share corners
        parts[is_above].push_back(one);
    }
    const double dt = 0.1 * model.h[0] / model.materials[0].wave_speed();
    auto wobble     = [](const Vec<D>& x) {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = 0.1 * std::sin(5 * x[a] + 3 * x[0]) + 0.02;
        return v;
    };
    auto run = [&](const Model<D>& m, const std::vector<Seed<D>>& seeds, int body_above) {
        const Explicit<D> method(m);
        Particles<D> p = plant_all(m, seeds);
        for (int i = 0; i < p.count; ++i) p.body[i] = p.x[i][0] > 0.5 ? body_above : 0;
        State<D> s = method.start(std::move(p));
        set_velocities(s.particles, 0, s.particles.count, wobble, m.h);
        for (int k = 0; k < 8; ++k) method.step(s, dt);
        return s;
    };
    model.field_of_body  = {0, 1};
    const State<D> both  = run(model, all, 1);
    model.field_of_body  = {};
    const State<D> one[] = {run(model, parts[0], 0), run(model, parts[1], 0)};
    std::vector<int> place(static_cast<std::size_t>(both.particles.count));
    for (int i = 0; i < both.particles.count; ++i) place[both.particles.id[i]] = i;
    for (int part : {0, 1})
        for (int i = 0; i < one[part].particles.count; ++i) {
            const Particles<D>&alone = one[part].particles, &p = both.particles;
            const auto same = std::find_if(place.begin(), place.end(), [&](int k) { return p.X[k] == alone.X[i]; });
            ASSERT_NE(same, place.end());
            EXPECT_LT(norm(p.x[*same] - alone.x[i]), 1e-14);
            EXPECT_LT(norm(p.v[*same] - alone.v[i]), 1e-12);
            EXPECT_LT(ddot(p.F[*same] - alone.F[i], p.F[*same] - alone.F[i]), 1e-24);
        }
}
std::vector<MethodSpec> with_fields()
{
    std::vector<MethodSpec> r;
    for (const Preset& preset : presets())
        if (can_have_fields(preset.spec)) r.push_back(preset.spec);
    return r;
}
TEST(Fields, BodiesMoveAsIfAloneIn1D) { test::for_each_spec(with_fields(), check_fields<1>); }
TEST(Fields, BodiesMoveAsIfAloneIn2D) { test::for_each_spec(with_fields(), check_fields<2>); }
TEST(Fields, BodiesMoveAsIfAloneIn3D) { test::for_each_spec(with_fields(), check_fields<3>); }

/// Two blocks, B at a gap to the right of A and wider, in the unit box. 8 cells a side.
template <int D>
CaseSpec<D> blocks(double gap, const ContactSpec& contact, const char* preset = "cpdi1")
{
    CaseSpec<D> spec{};
    spec.method    = find_preset(preset)->spec;
    spec.size      = Vec<D>::filled(1.0);
    spec.spacing   = Vec<D>::filled(0.125);
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e5, 0.3),
                      elastic_material(find_law("neo-hookean"), 2000.0, 4e5, 0.2)};
    Bounds<D> a{Vec<D>::filled(0.25), Vec<D>::filled(0.75)}, b{Vec<D>::filled(0.1875), Vec<D>::filled(0.8125)};
    a.upper[0]    = 0.5;
    b.lower[0]    = 0.5 + gap;
    b.upper[0]    = 0.75 + gap;
    spec.bodies   = {{.shape = a, .name = "a"}, {.shape = b, .name = "b", .material = 1}};
    spec.contacts = {contact};
    spec.time     = {.end = 1.0, .cfl = 0.2};
    return spec;
}

template <int D>
std::vector<ContactPoint<D>> points_of(const Simulation<D>& sim)
{
    std::vector<std::vector<Vec<D>>> vertices;
    for (const ContactSurface<D>& one : sim.model().surfaces) vertices.push_back(vertices_of(one, sim.model(), sim.state()));
    return find_contact_points(sim.model(), sim.state(), vertices, 0.0, contact_reach(sim.model(), sim.state()));
}

/// Gaps, normals, and half of the area that faces the other body from each side.
template <int D>
void check_points(bool on_faces)
{
    constexpr double gap = 0.01;
    const Simulation<D> sim(build(blocks<D>(gap, {.on_faces = on_faces})));
    const std::vector<ContactPoint<D>> points = points_of(sim);
    double area[2]                            = {};
    for (const ContactPoint<D>& q : points) {
        EXPECT_NEAR(q.gap, gap, 1e-14);
        EXPECT_NEAR(q.normal[0], q.key.side == 0 ? -1.0 : 1.0, 1e-14);  // out of the other body
        EXPECT_NEAR(q.x[0], q.key.side == 0 ? 0.5 : 0.5 + gap, 1e-14);
        area[q.key.side] += q.area;
    }
    const double face = std::pow(0.5, D - 1);
    EXPECT_NEAR(area[0], face / 2, 1e-14);
    EXPECT_GT(area[1], 0.99 * face / 2);  // vertices of B within the face of A and on its edge, with their shares beyond it
    EXPECT_LT(area[1], std::pow(0.5625, D - 1) / 2 + 1e-14);
    EXPECT_TRUE(points_of(Simulation<D>(build(blocks<D>(0.1, {.on_faces = on_faces})))).empty());
}
TEST(ContactPoints, HaveTheGapAndTheAreaOfBothSidesIn2D) { check_points<2>(false); }
TEST(ContactPoints, HaveTheGapAndTheAreaOfBothSidesIn3D) { check_points<3>(false); }
TEST(ContactPoints, OfFacesHaveTheGapAndTheAreaOfBothSidesIn2D) { check_points<2>(true); }
TEST(ContactPoints, OfFacesHaveTheGapAndTheAreaOfBothSidesIn3D) { check_points<3>(true); }

/// A quarter of a ring: the ends of its outline lie in planes of symmetry, until a stage has none. A plane between nodes is not held.
TEST(ContactPoints, EndInPlanesOfSymmetry)
{
    Model<2> model{};
    model.method     = find_preset("cpdi2")->spec;
    model.h          = Vec<2>::filled(0.125);
    model.cells      = Index<2>::filled(8);
    model.materials  = {elastic_material(find_law("neo-hookean"), 1000.0, 1e5, 0.3)};
    model.conditions = {{.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}},
                        {.axis = 1, .at = 0.0, .type = ConditionType::symmetry, .value = {}},
                        {.axis = 0, .at = 0.3, .type = ConditionType::symmetry, .value = {}}};
    const Tube<2> tube{.inner = 0.3, .outer = 0.6, .to = std::numbers::pi / 2};
    const CellMesh<2> mesh = weld(polar_cells(tube, 2, 5, 1));
    Particles<2> p(static_cast<int>(mesh.cells.size()), field_groups(model));
    plant_cells(p, 0, mesh, 1000.0);
    ContactSurface<2> surface = surface_of(0, mesh, p, 0);
    find_planes_of_symmetry(model, mesh, surface);

    const Outline<2>& outline = surface.outline;
    std::vector<Vec<2>> x;
    for (const int corner : outline.corners) x.push_back(mesh.corners[corner]);
    auto count = [&](int axis) {
        int r = 0;
        for (std::size_t v = 0; v < x.size(); ++v) {
            const bool is_held = outline.planes[v][axis] == 0.0;
            EXPECT_TRUE(is_held || std::isnan(outline.planes[v][axis]));
            EXPECT_TRUE(!is_held || std::fabs(x[v][axis]) < 1e-14);
            r += is_held;
        }
        return r;
    };
    EXPECT_EQ(count(0), 3);
    EXPECT_EQ(count(1), 3);
    auto largest_error = [&] {
        const auto normals = corner_normals(outline, x.data());
        double r           = 0;
        for (std::size_t k = 0; k < normals.size(); ++k)
            for (int c = 0; c < 2; ++c) {
                const auto& own = outline.vertices[k];
                if (norm(x[own[0]]) < 0.599 || norm(x[own[1]]) < 0.599) continue;
                r = std::max(r, norm(normals[k][c] - (1 / norm(x[own[c]])) * x[own[c]]));
            }
        return r;
    };
    EXPECT_LT(largest_error(), 1e-13);
    model.conditions.erase(model.conditions.begin() + 1);
    keep_planes_of_symmetry(model.conditions, surface);
    EXPECT_EQ(count(0), 3);
    EXPECT_EQ(count(1), 0);
    EXPECT_GT(largest_error(), 0.1);
}

/// Two rings that fit exactly, with unlike numbers of faces: on flat faces gaps would be as large as the sagitta of a face.
void check_rings(bool on_faces, std::size_t count)
{
    CaseSpec<2> spec = blocks<2>(0.0, {.on_faces = on_faces});
    const Tube<2> inner{.center = {0.5, 0.5}, .inner = 0.15, .outer = 0.3},
        outer{.center = {0.5, 0.5}, .inner = 0.3, .outer = 0.45};
    spec.bodies[0].shape = TubeShape<2>{.tube = inner, .is_polar = true, .radial = 2, .angular = 20};
    spec.bodies[1].shape = TubeShape<2>{.tube = outer, .is_polar = true, .radial = 2, .angular = 28};
    const Simulation<2> sim(build(spec));
    const double sagitta = 0.3 * (1 - std::cos(std::numbers::pi / 28));
    const auto points    = points_of(sim);
    EXPECT_EQ(points.size(), count);
    double area = 0;
    for (const ContactPoint<2>& q : points) {
        const Vec<2> out = unit(q.x - Vec<2>{0.5, 0.5});
        EXPECT_LT(std::fabs(q.gap), 0.02 * sagitta);
        EXPECT_NEAR(dot(q.normal, out), q.key.side == 0 ? -1.0 : 1.0, 1e-4);
        area += q.area;
    }
    EXPECT_NEAR(area / (2 * std::numbers::pi * 0.3), 1, on_faces ? 2e-4 : 5e-3);  // chords are shorter
}
TEST(ContactPoints, LieOnCurvedFaces) { check_rings(false, 48); }
TEST(ContactPoints, OfFacesLieOnCurvedFaces) { check_rings(true, 96); }

/// Points see the velocities where they are: of a block that shears, which fits of least squares keep to round-off.
template <int D>
void check_motion(bool on_faces)
{
    CaseSpec<D> spec       = blocks<D>(0.01, {.on_faces = on_faces});
    spec.method.projection = Projection::mls;
    spec.time              = {.end = 1.0, .dt = 1e-7};  // stress does nothing yet
    Simulation<D> sim(build(spec));
    Particles<D>& p = sim.state().particles;
    for (int i = 0; i < p.count; ++i)
        if (p.body[i] == 1)
            for (int a = 1; a < D; ++a) p.v[i][a] = 1e-3 * (p.x[i][1] + 2 * p.x[i][D - 1]);
    sim.step();
    const auto& points = sim.state().contacts.points;
    ASSERT_GT(points.size(), 8u);
    for (const ContactPoint<D>& q : points)
        for (int a = 1; a < D; ++a) EXPECT_NEAR(q.slip[a], (q.key.side == 0 ? -1e-3 : 1e-3) * (q.x[1] + 2 * q.x[D - 1]), 1e-12);
}
TEST(ContactPoints, SeeTheVelocitiesAtTheirPlacesIn2D) { check_motion<2>(false); }
TEST(ContactPoints, SeeTheVelocitiesAtTheirPlacesIn3D) { check_motion<3>(false); }
TEST(ContactPoints, OfFacesSeeTheVelocitiesAtTheirPlacesIn2D) { check_motion<2>(true); }
TEST(ContactPoints, OfFacesSeeTheVelocitiesAtTheirPlacesIn3D) { check_motion<3>(true); }

/// Blocks of one width between planes of symmetry: all points of the interface are alike, so that one sweep solves the contact.
/// B hits A with velocity v.
template <int D>
CaseSpec<D> column(const Vec<D>& v, const ContactSpec& contact)
{
    CaseSpec<D> spec = blocks<D>(0.0, contact);
    for (BodySpec<D>& body : spec.bodies)
        for (int a = 1; a < D; ++a) {
            auto& box    = std::get<Bounds<D>>(body.shape);
            box.lower[a] = 0.0;
            box.upper[a] = 1.0;
        }
    for (int a = 1; a < D; ++a) spec.boundaries.push_back({.axis = a, .type = FaceType::periodic});
    for (int a = 0; a < D; ++a) spec.bodies[1].velocity[a] = Field(v[a]);
    spec.time = {.end = 1.0, .dt = 1e-4};
    return spec;
}

/// Its contacts after one step, with B moved by `shift` along the first axis before it.
template <int D>
Contacts<D> after_a_step(const CaseSpec<D>& spec, double shift = 0.0)
{
    Simulation<D> sim(build(spec));
    Particles<D>& p = sim.state().particles;
    for (int i = 0; i < p.count; ++i)
        if (p.body[i] == 1) p.x[i][0] += shift;
    sim.step();
    return std::move(sim.state().contacts);
}

template <int D>
void check_sweep(bool on_faces)
{
    constexpr double v = 0.1, slip = 0.05, dt = 1e-4;
    Vec<D> u{};
    u[0]                     = -v;
    u[D - 1]                 = slip;
    const Contacts<D> sticks = after_a_step(column<D>(u, {.type = ContactType::no_slip, .on_faces = on_faces}));
    ASSERT_GT(sticks.points.size(), 8u);
    const double p = sticks.points[0].p;
    Vec<D> impulse{};
    for (const ContactPoint<D>& q : sticks.points) {
        EXPECT_LT(norm(q.slip), 1e-12 * slip);
        EXPECT_NEAR(q.p, p, 1e-12 * p);
        EXPECT_NEAR(norm(q.t), p * slip / v, 1e-12 * p);
        if (q.key.side == 0) impulse += 2.0 * q.area * (q.p * q.normal + q.t);
    }
    EXPECT_NEAR(sticks.pairs[0].force[0], impulse[0] / sticks.dt, 1e-12 * p / dt);
    EXPECT_LT(impulse[0], 0);
    EXPECT_GT(impulse[D - 1], 0);

    // Coulomb's law holds for the normal impulse of the same sweep.
    for (const ContactPoint<D>& q : after_a_step(column<D>(u, {.friction = 0.2, .on_faces = on_faces})).points) {
        EXPECT_NEAR(q.p, p, 1e-12 * p);
        EXPECT_NEAR(norm(q.t), 0.2 * q.p, 1e-12 * p);
        EXPECT_GT(norm(q.slip), 0.1 * slip);
        EXPECT_FALSE(q.sticks);
    }
    // Adhesion is a shear stress that needs no pressure.
    const Contacts<D> adheres = after_a_step(column<D>(u, {.adhesion = 100.0, .on_faces = on_faces}));
    for (const ContactPoint<D>& q : adheres.points) EXPECT_NEAR(norm(q.t), 100.0 * adheres.dt, 1e-12 * p);
    // A gap may close within the step, no more.
    for (const ContactPoint<D>& q : after_a_step(column<D>(u, {.type = ContactType::frictionless}), 0.5 * v * dt).points) {
        EXPECT_NEAR(q.p, 0.5 * p, 1e-3 * p);
        EXPECT_EQ(norm(q.t), 0.0);
    }
    // An overlap is taken back at the rate 0.025 c/h of the faster material.
    constexpr double overlap = 1e-5;
    const CaseSpec<D> rest   = column<D>({}, {});
    const double rate        = 0.025 * rest.materials[1].wave_speed() / 0.125;
    for (const ContactPoint<D>& q : after_a_step(rest, -overlap).points)
        EXPECT_NEAR(q.p, p * rate * overlap / v, 1e-3 * p * rate * overlap / v);
}
TEST(ContactImpulses, SolveAnEvenInterfaceInOneSweepIn2D) { check_sweep<2>(false); }
TEST(ContactImpulses, SolveAnEvenInterfaceInOneSweepIn3D) { check_sweep<3>(false); }
TEST(ContactImpulses, OnFacesSolveAnEvenInterfaceInOneSweepIn2D) { check_sweep<2>(true); }
TEST(ContactImpulses, OnFacesSolveAnEvenInterfaceInOneSweepIn3D) { check_sweep<3>(true); }

/// Momentum to round-off, in every method with faces, for blocks that meet askew and rub.
template <int D>
void check_momentum(const MethodSpec& method, bool on_faces)
{
    CaseSpec<D> spec = blocks<D>(0.0, {.friction = 0.3, .sweeps = 2, .on_faces = on_faces});
    spec.method      = method;
    for (int a = 0; a < D; ++a) spec.bodies[1].velocity[a] = Field(a == 0 ? -1.0 : 0.4);
    Simulation<D> sim(build(spec));
    const Totals before = totals(sim.model(), sim.state());
    double size         = 0;
    Vec<3> impulse{}, first{};
    for (int i = 0; i < sim.state().particles.count; ++i) size += sim.state().particles.m[i] * norm(sim.state().particles.v[i]);
    for (int k = 0; k < (D == 3 ? 5 : 40); ++k) {
        sim.step();
        impulse += sim.state().contacts.dt * sim.state().contacts.pairs[0].force;
    }
    const Totals after = totals(sim.model(), sim.state());
    for (int a = 0; a < D; ++a) EXPECT_NEAR(after.momentum[a], before.momentum[a], 1e-13 * size);
    for (int i = 0; i < sim.state().particles.count; ++i)
        if (sim.state().particles.body[i] == 0) first += sim.state().particles.m[i] * padded(sim.state().particles.v[i]);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(first[a], impulse[a], 1e-12 * size);
    EXPECT_LT(impulse[0], -0.01 * size);
    EXPECT_GT(sim.state().contacts.pairs[0].dissipated, 0);
    EXPECT_GT(sim.state().contacts.pairs[0].friction, 0);
}
std::vector<MethodSpec> with_faces()
{
    std::vector<MethodSpec> r;
    for (const MethodSpec& m : with_fields())
        if (keeps_momentum(m) && (m.domain == Domain::parallelepiped || has_cells(m))) r.push_back(m);
    return r;
}
template <int D>
void check_momentum_of_all(bool on_faces)
{
    test::for_each_spec(with_faces(), [&](const MethodSpec& m) { check_momentum<D>(m, on_faces); });
}
TEST(ContactImpulses, KeepMomentumIn2D) { check_momentum_of_all<2>(false); }
TEST(ContactImpulses, KeepMomentumIn3D) { check_momentum_of_all<3>(false); }
TEST(ContactImpulses, OnFacesKeepMomentumIn2D) { check_momentum_of_all<2>(true); }
TEST(ContactImpulses, OnFacesKeepMomentumIn3D) { check_momentum_of_all<3>(true); }

/// The place of body 0 and its velocity in the mean.
template <int D>
std::array<Vec<D>, 2> mean_motion(const State<D>& s, int body)
{
    Vec<D> x{}, v{};
    double m = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        if (s.particles.body[i] != body) continue;
        x += s.particles.m[i] * s.particles.x[i];
        v += s.particles.m[i] * s.particles.v[i];
        m += s.particles.m[i];
    }
    return {1 / m * x, 1 / m * v};
}

/// A block on a plate that is held, under gravity at 30 degrees, mu 0.7: damped to rest, it stays. Without anchors it creeps.
TEST(ContactImpulses, HoldABlockOnASlope)
{
    CaseSpec<2> spec{};
    spec.method    = find_preset("cpdi1")->spec;
    spec.size      = {2.0, 1.0};
    spec.spacing   = {0.125, 0.125};
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e6, 0.3)};
    spec.bodies    = {{.shape = Bounds<2>{{0.0, 0.0}, {2.0, 0.25}}}, {.shape = Bounds<2>{{0.5, 0.25}, {1.5, 0.75}}}};
    spec.contacts  = {{.friction = 0.7}};
    spec.gravity   = {5.0, -8.660254};
    spec.time      = {.end = 3.6, .dt = 1e-3};
    for (int side : {0, 1}) spec.boundaries.push_back({.axis = side, .type = FaceType::symmetry});
    spec.boundaries.push_back({.type = FaceType::fixed, .body = 0});
    spec.stages = {{.duration = 0.6, .damping = {.type = DampingType::viscous, .rate = 20.0}}, {.duration = 3.0}};
    Simulation<2> sim(build(spec));
    sim.advance(0.6);
    const auto settled = mean_motion(sim.state(), 1);
    sim.advance(3.6);
    const auto end = mean_motion(sim.state(), 1);
    EXPECT_LT(std::fabs(end[0][0] - settled[0][0]), 1e-6 * 5.0 * 0.5 * 3.0 * 3.0);
    EXPECT_LT(std::fabs(end[1][0]), 1e-4);
}

/// Tied halves move like one block under tension; halves that do not slip part.
TEST(ContactImpulses, HoldTiedBodiesTogether)
{
    auto run = [](ContactType type, bool on_faces) {
        CaseSpec<2> spec           = column<2>({}, {.type = type, .on_faces = on_faces});
        spec.materials[1]          = spec.materials[0];
        spec.bodies[0].velocity[0] = Field(-0.02);
        spec.bodies[1].velocity[0] = Field(0.02);
        Simulation<2> sim(build(spec));
        sim.advance(0.05);
        double first = 1, last = 0;
        for (int i = 0; i < sim.state().particles.count; ++i) {
            const double x = sim.state().particles.x[i][0];
            if (sim.state().particles.body[i] == 0)
                last = std::max(last, x);
            else
                first = std::min(first, x);
        }
        return first - last - 0.0625;
    };
    for (const bool on_faces : {false, true}) {
        EXPECT_LT(std::fabs(run(ContactType::tied, on_faces)), 1e-3);
        EXPECT_GT(run(ContactType::no_slip, on_faces), 0.9 * 0.04 * 0.05);
    }
}

}  // namespace
}  // namespace ordo
