// Tractions on faces of particle domains: which faces bound a body, and what their forces leave on the nodes.
#include "method/diagnostics.hpp"
#include "method/planting.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

template <int D>
int expected_outer_faces(int n)  // of a cube of n^D cells
{
    return D == 1 ? 2 : D == 2 ? 4 * n : 6 * n * n;
}

template <int D>
void check_outer_faces()
{
    const Model<D> model = test::unit_box<D>(8, Domain::cell);
    const auto seeds     = test::block(model, 0.25, 0.75, 1);
    for (const Domain domain : {Domain::cell, Domain::simplex}) {
        const CellMesh<D> mesh = mesh_of({.domain = domain}, seeds);
        Vec<D> sum{};
        double area = 0, flux = 0;
        const auto faces = outer_faces(mesh);
        for (const Face<D>& f : faces) {
            Vec<D> at[Face<D>::max_corners]{};
            for (int c = 0; c < f.count; ++c) at[c] = mesh.corners[mesh.cells[f.cell][f.corner[c]]];
            Vec<D> a = face_area(at, f.count);
            if (D == 1 && at[0][0] < 0.5) a = -a;
            sum += a;
            area += norm(a);
            flux += dot(a, face_center(at, f.count)) / D;  // the volume, by the divergence theorem
        }
        const int per_face = domain == Domain::simplex && D == 3 ? 2 : 1;
        EXPECT_EQ(static_cast<int>(faces.size()), per_face * expected_outer_faces<D>(4));
        for (int a = 0; a < D; ++a) EXPECT_NEAR(sum[a], 0, 1e-14);
        EXPECT_NEAR(area, 2 * D * std::pow(0.5, D - 1), 1e-13);
        EXPECT_NEAR(flux, std::pow(0.5, D), 1e-14);
    }
}
TEST(Tractions, OuterFacesCloseTheBody)
{
    check_outer_faces<1>();
    check_outer_faces<2>();
    check_outer_faces<3>();
}

/// A block turned and stretched by F, under one traction on its face x-max.
template <int D>
struct Loaded {
    State<D> s;
    Vec<D> force{};   ///< of all nodes
    Mat<D> moment{};  ///< sum f_i (x) x_i
    Vec<D> area0{}, center{};

    Loaded(const MethodSpec& spec, TractionType type, const Vec<D>& value, const Mat<D>& F)
    {
        Model<D> model = test::unit_box<D>(D == 3 ? 10 : 16, spec);
        model.tractions.push_back({.type = type, .value = {}});
        for (int a = 0; a < D; ++a) model.tractions[0].value[a] = Field(value[a]);
        const auto seeds = test::block(model, 0.4, 0.6, 2);
        Particles<D> p   = plant_all(model, seeds);
        add_loads<D>(model.loads, p, mesh_of(spec, seeds), 0, 0, [](const Vec<D>& n, const Vec<D>&) { return n[0] > 0.9; });
        const Vec<D> middle = Vec<D>::filled(0.5);
        auto place          = [&](const Vec<D>& X) { return middle + F * (X - middle); };
        for (int i = 0; i < p.count; ++i) {
            p.X[i] = p.x[i];
            p.x[i] = place(p.X[i]);
            p.F[i] = F;
        }
        for (Vec<D>& c : p.corner) c = place(c);
        area0[0] = std::pow(0.2, D - 1);
        center   = middle;
        center[0] += 0.1;
        center = place(center);

        const Explicit<D> method(model);
        s = method.start_deformed(std::move(p));
        for (int i = 0; i < s.particles.count; ++i) s.particles.sigma[i] = {};
        evaluate_loads(model.loads, model.tractions, s.lattice, s.particles.view(), 0.0);
        const Passes<D> passes = choose_passes<D>(spec);
        const Sweep<D> view{s.lattice, s.particles.view(), s.field.nodes.data(), model.materials.data(), 0, 0, 0};
        for (const auto pass : {passes.project, passes.force})
            s.field.tiles.for_each_by_colour([&](const Tile& t) { pass(view, t.begin, t.end); });
        for (std::size_t n = 0; n < s.field.nodes.size(); ++n) {
            Vec<D> f{};
            for (int a = 0; a < D; ++a) f[a] = s.field.nodes[n][NodeLane::increment + a];
            force += f;
            moment += outer(f, test::place_of_node(s, n));
        }
    }
};

template <int D>
void check_resultants(const MethodSpec& spec)
{
    test::Random random(5);
    const Mat<D> F = test::random_deformation<D>(random, 0.3);
    Vec<D> value{};
    for (int a = 0; a < D; ++a) value[a] = 3.0 - a;
    for (const TractionType type : {TractionType::pressure, TractionType::traction, TractionType::dead}) {
        const Loaded<D> b(spec, type, value, F);
        const Vec<D> area     = D == 1 ? b.area0 : cofactor(F) * b.area0;
        const Vec<D> expected = type == TractionType::pressure   ? -value[0] * area
                                : type == TractionType::traction ? norm(area) * value
                                                                 : norm(b.area0) * value;
        const Mat<D> moment   = outer(expected, b.center);
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(b.force[a], expected[a], 1e-12);
            for (int c = 0; c < D; ++c) EXPECT_NEAR(b.moment(a, c), moment(a, c), 1e-12);
        }
    }
}
/// Total force and its first moment, thus the torque, are those of the face, whatever basis and domain.
TEST(Tractions, ForceAndMomentAreExact)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_resultants<1>(spec);
        check_resultants<2>(spec);
        check_resultants<3>(spec);
    });
}

/// Corner domains get the force at the corners of the face: nodes behind it get none.
TEST(Tractions, CornerDomainsTakeThemAtTheFace)
{
    for (const Domain domain : {Domain::parallelepiped, Domain::cell}) {
        const Loaded<2> b({.domain = domain}, TractionType::dead, {1.0, 0.0}, Mat<2>::identity());
        for (std::size_t n = 0; n < b.s.field.nodes.size(); ++n) {
            const Index<2> at = b.s.lattice.index(static_cast<std::ptrdiff_t>(n));
            if (std::fabs(b.s.lattice.node_position(0, at[0]) - 0.6) > b.s.lattice.h[0] + 1e-12) {
                EXPECT_NEAR(b.s.field.nodes[n][NodeLane::increment], 0, 1e-15);
            }
        }
    }
}

/// A bar under equal dead pulls at both ends keeps its momentum; a single pull gives it what force and time say.
TEST(Tractions, MomentumGrowsByTheForce)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        Model<2> model = test::unit_box<2>(16, spec);
        model.tractions.push_back({.type = TractionType::dead, .value = {Field(2.0), Field(-1.0)}});
        const auto seeds = test::block(model, 0.4, 0.6, 2);
        Particles<2> p   = plant_all(model, seeds);
        add_loads<2>(model.loads, p, mesh_of(spec, seeds), 0, 0, [](const Vec<2>& n, const Vec<2>&) { return n[0] > 0.9; });
        const Explicit<2> method(std::move(model));
        State<2> s      = method.start(std::move(p));
        const double dt = 0.1 * courant_time_step(method.model(), s.particles);
        for (int k = 0; k < 10; ++k) method.step(s, dt);
        const Vec<3> momentum = totals(method.model(), s).momentum;
        EXPECT_NEAR(momentum[0], 0.2 * 2.0 * 9.5 * dt, 1e-11);  // the first kick is a half
        EXPECT_NEAR(momentum[1], -0.2 * 9.5 * dt, 1e-11);
    });
}

}  // namespace
}  // namespace ordo
