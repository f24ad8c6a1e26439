// Set-up from plain structs: what a program gives, and what it is told is wrong.
#include "method/tables.hpp"
#include "setup/build.hpp"
#include "setup/true_shape.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace ordo {
namespace {

using namespace setup;

/// A disk in the middle of the unit box.
CaseSpec<2> disk()
{
    CaseSpec<2> spec{};
    spec.method    = find_preset("cpdi1")->spec;
    spec.size      = {1.0, 1.0};
    spec.spacing   = {0.125, 0.125};
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e4, 0.3)};
    spec.bodies    = {{.shape = Ball<2>{{0.5, 0.5}, 0.25}}};
    spec.time      = {.end = 0.1};
    return spec;
}

std::string refusal(const std::function<void(CaseSpec<2>&)>& change)
{
    CaseSpec<2> spec = disk();
    change(spec);
    try {
        build(std::move(spec), 1e4);
    } catch (const SetupError& e) {
        return e.what();
    }
    return "";
}

/// A body of each shape, of two materials.
CaseSpec<2> bodies_of_every_shape()
{
    CaseSpec<2> spec = disk();
    spec.materials.push_back(spec.materials[0]);
    spec.materials[1].density = 500.0;
    spec.bodies[0].shape      = Ball<2>{{0.25, 0.25}, 0.2};
    spec.bodies.push_back({.shape = Bounds<2>{{0.5, 0.0}, {0.75, 0.25}}, .material = 1, .velocity = {Field(2.0), Field(3.0)}});
    const Tube<2> half{.center = {0.5, 0.5}, .inner = 0.1, .outer = 0.2, .from = 0.0, .to = std::numbers::pi};
    spec.bodies.push_back({.shape = TubeShape<2>{.tube = half, .is_polar = true, .radial = 2, .angular = 6}});
    spec.bodies.push_back({.shape = std::vector<Seed<2>>{{{0.9, 0.9}, 0.01, {{{0.05, 0}, {0, 0.05}}}}}});
    const CellMesh<2> square{{{0.0, 0.75}, {0.25, 0.75}, {0.0, 1.0}, {0.25, 1.0}}, {{{0, 1, 2, 3}}}};
    spec.bodies.push_back({.shape = MeshShape<2>{.mesh = square}});
    spec.bodies.push_back({.shape = PolarBall<2>{.ball = {{0.87, 0.5}, 0.1}, .radial = 2, .angular = 16}});
    return spec;
}

TEST(Setup, SeedsBodiesOfEveryShape)
{
    const Built<2> built = build(bodies_of_every_shape());

    EXPECT_EQ(built.bodies[5].particles, 4 * 4 + 2 * 16);
    std::vector<double> mass(6);
    for (int i = 0; i < built.particles.count; ++i) mass[built.particles.body[i]] += built.particles.m[i];
    EXPECT_NEAR(mass[0], 1000 * std::numbers::pi * 0.04, 1e-9);
    EXPECT_NEAR(mass[1], 500 * 0.0625, 1e-9);
    EXPECT_NEAR(mass[2], 1000 * std::numbers::pi * 0.03 / 2, 1e-9);
    EXPECT_NEAR(mass[3], 10, 1e-12);
    EXPECT_NEAR(mass[4], 62.5, 1e-9);
    EXPECT_NEAR(mass[5], 1000 * 8 * 0.01 * std::sin(std::numbers::pi / 8), 1e-9);  // of the polygon
    for (int i = 0; i < built.particles.count; ++i) EXPECT_EQ(built.particles.v[i][1], built.particles.body[i] == 1 ? 3.0 : 0.0);
    EXPECT_EQ(built.time.cfl, 0.4);
}

/// The bytes of each field of particles, those of several ranges one after the other.
template <int D>
void append_fields(std::vector<std::vector<std::byte>>& to, Particles<D>& p)
{
    std::size_t k = 0;
    p.for_each_field([&](auto& field) {
        if (to.size() == k) to.emplace_back();
        const auto bytes = std::as_bytes(std::span(field.data(), field.size()));
        to[k].insert(to[k].end(), bytes.begin(), bytes.end());
        ++k;
    });
}

/// Builds a case at once, and in the shares of 1, 2, 3 and many ranks.
template <int D>
void expect_shares_of_the_whole(const CaseSpec<D>& spec)
{
    Built<D> whole = build(spec);
    std::vector<std::vector<std::byte>> expected;
    append_fields(expected, whole.particles);
    for (const int count : {1, 2, 3, whole.particles.count + 5}) {
        SCOPED_TRACE(count);
        std::vector<std::vector<std::byte>> fields;
        for (int k = 0; k < count; ++k) {
            Built<D> built = build(spec, kMostParticles, {k, count});
            EXPECT_LE(built.particles.count, whole.particles.count / count + 1);
            EXPECT_EQ(built.notes, whole.notes);
            append_fields(fields, built.particles);
        }
        EXPECT_EQ(fields, expected);
    }
}
TEST(Setup, SharesOfRanksMakeUpTheWhole)
{
    for (const char* preset : {"cpdi1", "apic", "cpdi2"}) {
        SCOPED_TRACE(preset);
        CaseSpec<2> spec     = bodies_of_every_shape();
        spec.method          = find_preset(preset)->spec;
        spec.bodies[1].gauss = spec.method.domain == Domain::point;
        expect_shares_of_the_whole(spec);
    }
    CaseSpec<3> spec{};
    spec.method    = find_preset("cpdi1")->spec;
    spec.size      = {1.0, 1.0, 1.0};
    spec.spacing   = {0.25, 0.25, 0.25};
    spec.gravity   = {0.0, 0.0, -10.0};
    spec.materials = {elastic_material(find_law("jaumann-elastic"), 1000.0, 1e6, 0.3)};
    spec.bodies    = {{.shape = Ball<3>{{0.5, 0.5, 0.35}, 0.3}}, {.shape = Bounds<3>{{0.0, 0.0, 0.75}, {1.0, 1.0, 1.0}}}};
    spec.bodies[0].stress.k0 = 0.5;
    spec.time                = {.end = 0.1};
    expect_shares_of_the_whole(spec);
}

/// A disk, and half a ring whose ends are cut along the grid; a ball, and a quarter of a tube in 3D.
template <int D>
std::vector<std::pair<BodyShape<D>, std::vector<double>>> round_bodies()  // and the areas of their smooth faces
{
    const double pi = std::numbers::pi, r = 0.31, inner = 0.17;
    if constexpr (D == 2) {
        const Tube<2> half{.center = {0.52, 0.5}, .inner = inner, .outer = r, .from = 0.0, .to = pi};
        return {{Ball<2>{{0.52, 0.47}, r}, {2 * pi * r}}, {TubeShape<2>{.tube = half}, {pi * r, pi * inner, 2 * (r - inner)}}};
    } else {
        const Tube<3> quarter{.center = {0.3, 0.2, 0.25},
                              .inner  = inner,
                              .outer  = r,
                              .from   = 0.0,
                              .to     = pi / 2,
                              .axis   = 1,
                              .bottom = 0.2,
                              .top    = 0.7};
        return {{Ball<3>{{0.52, 0.47, 0.49}, r}, {4 * pi * r * r}},
                {TubeShape<3>{.tube = quarter},
                 {0.5 * pi / 2 * r, 0.5 * pi / 2 * inner, 2 * 0.5 * (r - inner), 2 * pi / 4 * (r * r - inner * inner)}}};
    }
}

template <int D>
CaseSpec<D> round_case(const BodyShape<D>& shape, const char* preset)
{
    CaseSpec<D> spec{};
    spec.method    = find_preset(preset)->spec;
    spec.size      = Vec<D>::filled(1.0);
    spec.spacing   = Vec<D>::filled(0.125);  // 2.5 cells a radius
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e4, 0.3)};
    spec.bodies    = {{.shape = shape}};
    spec.time      = {.end = 0.1};
    return spec;
}

template <int D>
void check_round_volumes()
{
    for (const auto& [shape, areas] : round_bodies<D>())
        for (const char* preset : {"mpm", "cpdi1", "cpdi2", "cpdi2t"}) {
            CaseSpec<D> spec                     = round_case<D>(shape, preset);
            const double exact                   = *true_volume<D>(shape);
            const BodyReport body                = build(spec).bodies[0];
            spec.bodies[0].keeps_lattice_volumes = true;
            const BodyReport lattice             = build(spec).bodies[0];
            EXPECT_NEAR(body.volume, exact, 1e-13) << preset;
            EXPECT_NEAR(body.mass, 1000 * exact, 1e-10) << preset;
            EXPECT_EQ(body.particles, lattice.particles);
            const double cells = lattice.volume / std::pow(0.0625, D);  // whole sub-cells
            EXPECT_NEAR(cells, std::round(cells), 1e-9);
            EXPECT_GT(std::fabs(lattice.volume / exact - 1), 1e-4) << "nothing is to be scaled";
        }
}
TEST(Setup, RoundBodiesHaveTheirVolume)
{
    check_round_volumes<2>();
    check_round_volumes<3>();
}

/// The force of a traction of 1 in a given direction is the area of the true surface, not of the stairs.
template <int D>
void check_round_areas()
{
    for (const auto& [shape, areas] : round_bodies<D>())
        for (const char* preset : {"cpdi1", "cpdi2", "cpdi2t"}) {
            CaseSpec<D> spec = round_case<D>(shape, preset);
            spec.tractions   = {{.body = 0, .faces = {{}}, .traction = {.type = TractionType::dead}}};
            double sum = 0, stairs = 0, exact = 0;
            for (const Load<D>& load : build(spec).model.loads) {
                sum += load.share * norm(load.area0);
                stairs += norm(load.area0);
            }
            for (const double area : areas) exact += area;
            EXPECT_NEAR(sum, exact, 1e-12) << preset;
            EXPECT_GT(stairs, 1.05 * exact) << preset;

            spec.tractions[0].faces = {{BodyFace::outer}};
            sum                     = 0;
            for (const Load<D>& load : build(spec).model.loads) sum += load.share * norm(load.area0);
            EXPECT_NEAR(sum, areas[0], 1e-12) << preset;
        }
}
TEST(Setup, RoundFacesHaveTheirArea)
{
    check_round_areas<2>();
    check_round_areas<3>();
}

/// Overlaps too small for a centre to lie in another particle.
TEST(Setup, RefusesBoxesThatOverlapByMoreThanAHundredthOfAParticle)
{
    const double particle = 0.0625 * 0.0625;
    auto message          = [&](double depth) {
        return refusal([&](CaseSpec<2>& s) {
            s.bodies[0].shape = Bounds<2>{{0.25, 0.25}, {0.5, 0.5}};
            s.bodies.push_back({.shape = Bounds<2>{{0.5 - depth, 0.25}, {0.75, 0.5}}});
        });
    };
    EXPECT_EQ(message(0.0), "");
    EXPECT_EQ(message(0.9 * 0.01 * particle / 0.25), "");
    EXPECT_NE(message(1.1 * 0.01 * particle / 0.25).find("would be there twice, the mass of 0.011 particles"), std::string::npos);
    EXPECT_NE(message(0.02).find("5 kg/m would be there twice"), std::string::npos);
}

TEST(Setup, FillsTheModel)
{
    CaseSpec<2> spec = disk();
    spec.boundaries  = {{.axis = 0, .type = FaceType::periodic}, {.axis = 1, .is_above = true, .type = FaceType::symmetry}};
    spec.bodies[0].body_force[1]        = Field(-1.0);
    spec.tractions                      = {{.body = 0, .faces = {{BodyFace::along_axis, 1, false}}}};
    spec.tractions[0].traction.value[0] = Field(5.0);
    const Model<2> model                = build(spec).model;
    EXPECT_EQ(model.cells, (Index<2>{8, 8}));
    EXPECT_TRUE(model.periodic[0]);
    EXPECT_FALSE(model.periodic[1]);
    ASSERT_EQ(model.conditions.size(), 1u);
    EXPECT_EQ(model.conditions[0].at, 1.0);
    ASSERT_FALSE(model.loads.empty());
    for (const Load<2>& load : model.loads) EXPECT_LT(load.area0[1], 0);
}

TEST(Setup, RefusesByKey)
{
    const double nan                                                       = std::numeric_limits<double>::quiet_NaN();
    const std::pair<const char*, std::function<void(CaseSpec<2>&)>> rows[] = {
        {"grid.spacing: must divide", [](auto& s) { s.spacing[1] = 0.3; }},
        {"grid.size: must be positive", [](auto& s) { s.size[1] = -1; }},
        {"method: ", [](auto& s) { s.method.projection = Projection::tls; }},
        {"material[0]: there is none", [](auto& s) { s.materials.clear(); }},
        {"material[0].density: must be positive", [](auto& s) { s.materials[0].density = 0; }},
        {"material[0].model: ", [](auto& s) { s.materials[0].law = find_law("linear-rate-1d"); }},
        {"body[0]: there is none", [](auto& s) { s.bodies.clear(); }},
        {"body[0].material: there is no material 1", [](auto& s) { s.bodies[0].material = 1; }},
        {"body[0].radius: must be positive",
         [](auto& s) {
             s.bodies[0].shape = Ball<2>{{0.5, 0.5}, -1};
         }},
        {"body[0].upper: must be larger",
         [](auto& s) {
             s.bodies[0].shape = Bounds<2>{{0.5, 0.5}, {0.6, 0.5}};
         }},
        {"body[0].inner_radius: ", [](auto& s) { s.bodies[0].shape = TubeShape<2>{{.inner = 0.3, .outer = 0.2}}; }},
        {"body[0].cells: polar cells of a part need",
         [](auto& s) {
             s.bodies[0].shape = TubeShape<2>{{.outer = 0.2, .to = 1.0}, true};
         }},
        {"body[0].angular: must be a multiple of 4",
         [](auto& s) {
             s.bodies[0].shape = PolarBall<2>{.ball = {{0.5, 0.5}, 0.2}, .angular = 10};
         }},
        {"body[0].particles_per_cell: makes",
         [](auto& s) {
             s.bodies[0].shape = PolarBall<2>{.ball = {{0.5, 0.5}, 0.2}, .angular = 400000};
         }},
        {"body[0].shape: holds no particle", [](auto& s) { s.bodies[0].shape = std::vector<Seed<2>>{}; }},
        {"body[0].shape: body \"body 0\" lies outside",
         [](auto& s) {
             s.bodies[0].shape = Ball<2>{{0.9, 0.5}, 0.25};
         }},
        {"body[1].shape: body \"body 1\" overlaps", [](auto& s) { s.bodies.push_back(s.bodies[0]); }},
        {"body[0].particles_per_cell: makes",
         [](auto& s) {
             s.bodies[0].particles_per_cell = {1000, 1000};
         }},
        {"body[0].particles_per_cell: must be",
         [](auto& s) {
             s.bodies[0].particles_per_cell = {0, 1};
         }},
        {"body[0].seeding: gauss", [](auto& s) { s.bodies[0].gauss = true; }},
        {"body[0].velocity: is nan", [=](auto& s) { s.bodies[0].velocity[1] = Field(nan); }},
        {"body[0].body_force: is nan", [=](auto& s) { s.bodies[0].body_force[0] = Field(nan); }},
        {"boundary[0].at: the plane 2", [](auto& s) { s.boundaries = {{.at = 2.0}}; }},
        {"boundary[0].face: axis 2", [](auto& s) { s.boundaries = {{.axis = 2}}; }},
        {"boundary[1].face: x-max belongs to a periodic",
         [](auto& s) {
             s.boundaries = {{.type = FaceType::periodic}, {.is_above = true}};
         }},
        {"traction[0].body: there is no body 1", [](auto& s) { s.tractions = {{.body = 1}}; }},
        {"traction[0].face: \"inner\" needs",
         [](auto& s) {
             s.bodies[0].shape = Bounds<2>{{0.25, 0.25}, {0.5, 0.5}};
             s.tractions       = {{.faces = {{BodyFace::inner}}}};
         }},
        {"traction[0].value: is nan",
         [=](auto& s) {
             s.tractions = {{.traction = {.value = {Field(nan), {}}}}};
         }},
        {"time.end: must be positive", [](auto& s) { s.time.end = 0; }},
        {"time.dt: 0.1 s is above the limit", [](auto& s) { s.time.dt = 0.1; }},
        {"time.end: takes about", [](auto& s) { s.time.end = 1e12; }},
    };
    for (const auto& [start, change] : rows) EXPECT_EQ(refusal(change).find(start), 0u) << start << "\n" << refusal(change);
    EXPECT_EQ(refusal([](auto&) {}), "");
}

}  // namespace
}  // namespace ordo
