// Every combination of the axes that exists, generated from the tables: a new choice is tested by existing.
#include "method/diagnostics.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

/// f(spec) for each combination of the axes with more than one choice.
template <class F>
void for_each_spec(F&& f)
{
    for (const auto& domain : Axis<Domain>::choices)
        for (const auto& scheme : Axis<Scheme>::choices)
            for (const auto& start : Axis<Start>::choices) {
                MethodSpec spec;
                spec.domain = domain.value;
                spec.scheme = scheme.value;
                spec.start  = start.value;
                SCOPED_TRACE(std::string(domain.name) + ", " + std::string(scheme.name) + ", " + std::string(start.name));
                f(spec);
            }
}

template <int D>
Explicit<D> method_for(const MethodSpec& spec)
{
    Model<D> model = test::unit_box<D>(D == 3 ? 8 : 16, spec.domain);
    model.method   = spec;
    return Explicit<D>(std::move(model));
}

/// A rigid translation stays one, exactly: nothing deforms, every velocity is kept.
/// `shift` of a cell from the usual places: a quarter puts particles on cell faces, where hats have two slopes.
template <int D>
void check_translation(const MethodSpec& spec, double shift)
{
    const Explicit<D> method = method_for<D>(spec);
    const double offset      = shift * method.model().h[0];
    State<D> s = method.start(test::make_particles(method.model(), test::block(method.model(), 0.25 + offset, 0.5 + offset, 2)));
    Vec<D> v{};
    for (int a = 0; a < D; ++a) v[a] = 0.3 - 0.1 * a;
    for (Vec<D>& w : s.particles.v) w = v;
    for (int k = 0; k < 20; ++k) method.step(s, 0.02);
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(s.particles.v[i][a], v[a], 1e-12);
            EXPECT_NEAR(s.particles.x[i][a] - s.particles.X[i][a], 0.4 * v[a], 1e-12);
            for (int b = 0; b < D; ++b) EXPECT_NEAR(s.particles.F[i](a, b), a == b, 1e-11);
        }
}
TEST(Combinations, ConstantVelocityIsExact)
{
    for_each_spec([](const MethodSpec& spec) {
        for (double shift : {0.0, 0.25, 0.25 + 1e-15, 0.25 - 1e-15}) {
            check_translation<1>(spec, shift);
            check_translation<2>(spec, shift);
            check_translation<3>(spec, shift);
        }
    });
}

/// Uniform stress on a regular tiling gives no force on nodes inside the body.
template <int D>
void check_uniform_stress(const MethodSpec& spec)
{
    const Explicit<D> method = method_for<D>(spec);
    State<D> s               = method.start(test::make_particles(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) s.particles.sigma[i](a, b) = 10.0 + a + b;
    const Passes<D> passes = choose_passes<D>(spec, false);
    for (Lanes& n : s.nodes) n = Lanes{};
    const Sweep<D> view{s.lattice, s.particles.view(), s.nodes.data(), method.model().materials.data(), 0, 0};
    s.tiles.for_each_by_colour([&](const Tile& t) { passes.force(view, t.begin, t.end); });
    double inside = 0, edge = 0;
    for (std::size_t n = 0; n < s.nodes.size(); ++n) {
        const Index<D> at = s.lattice.index(static_cast<std::ptrdiff_t>(n));
        bool interior     = true;
        for (int a = 0; a < D; ++a) {
            const double x = s.lattice.node_position(a, at[a]);
            interior       = interior && x > 0.25 + 0.01 && x < 0.75 - 0.01;
        }
        for (int a = 0; a < D; ++a)
            (interior ? inside : edge) = std::max(interior ? inside : edge, std::fabs(s.nodes[n][NodeLane::increment + a]));
    }
    EXPECT_LT(inside, 1e-13 * edge);
    EXPECT_GT(edge, 0.01);
}
TEST(Combinations, UniformStressGivesNoForceInside)
{
    for_each_spec([](const MethodSpec& spec) {
        check_uniform_stress<1>(spec);
        check_uniform_stress<2>(spec);
        check_uniform_stress<3>(spec);
    });
}

/// Twenty steps of a wobbling block: finite, mass and momentum kept, every particle still there.
template <int D>
void check_conservation(const MethodSpec& spec, MaterialModel material)
{
    Model<D> model           = test::unit_box<D>(D == 3 ? 8 : 16, spec.domain);
    model.method             = spec;
    model.materials[0].model = material;
    const Explicit<D> method(std::move(model));
    State<D> s = method.start(test::make_particles(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a) s.particles.v[i][a] = 0.05 * std::sin(6 * s.particles.x[i][a]) + 0.02;
    const Totals before = totals(method.model(), s.particles);
    for (int k = 0; k < 20; ++k) method.step(s, 0.2 * courant_time_step(method.model(), s.particles));
    const Totals after = totals(method.model(), s.particles);
    double size        = 0;
    std::vector<bool> seen(s.particles.x.size());
    for (int i = 0; i < s.particles.count; ++i) {
        size += s.particles.m[i] * norm(s.particles.v[i]);
        seen[s.particles.id[i]] = true;
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), true), s.particles.count);
    EXPECT_EQ(before.mass, after.mass);
    double nodal = 0;
    for (const Index<D>& block : s.tiles.blocks())
        s.tiles.nodes_of(block).for_each([&](const Index<D>& k) { nodal += s.nodes[s.lattice.offset(k)][NodeLane::mass]; });
    EXPECT_NEAR(nodal, before.mass, 1e-13 * before.mass);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(before.momentum[a], after.momentum[a], 1e-12 * size);
    EXPECT_TRUE(std::isfinite(after.total_energy()));
    EXPECT_GT(after.strain_energy, 0);
    EXPECT_LT(after.total_energy(), 1.1 * before.total_energy());
}
TEST(Combinations, MassAndMomentumAreKept)
{
    for_each_spec([](const MethodSpec& spec) {
        for (MaterialModel m : {MaterialModel::neo_hookean, MaterialModel::st_venant_kirchhoff, MaterialModel::jaumann_elastic}) {
            check_conservation<1>(spec, m);
            check_conservation<2>(spec, m);
            check_conservation<3>(spec, m);
        }
        check_conservation<1>(spec, MaterialModel::linear_rate_1d);
    });
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
