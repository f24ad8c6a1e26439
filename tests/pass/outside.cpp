// What comes from outside a step: laws for all particles of a material at once, added body forces, changes of nodes.
#include "material/laws.hpp"
#include "material/outside_law.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "method/tables.hpp"
#include "setup/build.hpp"
#include "sim/simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>

namespace ordo {
namespace {

/// The neo-Hookean law of ordo, which counts its calls and the strain of each particle.
class OutsideNeoHookean final : public OutsideLaw {
  public:
    OutsideNeoHookean() : OutsideLaw("outside-neo-hookean", "the same from outside", {{"calls", 3.0}, {"dilation", 0.0}}) {}

    double wave_speed(const NamedNumbers& p) const override { return std::sqrt((p.at("lambda") + 2 * p.at("mu")) / p.at("rho")); }
    void update(const NamedNumbers& p, OutsideParticles& particles) const override
    {
        const std::size_t n = particles.count();
        std::vector<double> F(9 * n), dF(9 * n), cauchy(9 * n), calls(n), dilation(n);
        particles.read_F(F.data());
        particles.read_dF(dF.data());
        particles.read_history(0, calls.data());
        particles.read_history(1, dilation.data());
        const NeoHookean law{p.at("lambda"), p.at("mu")};
        for (std::size_t k = 0; k < n; ++k) {
            Mat<3> full{}, step{};
            for (int c = 0; c < 9; ++c) {
                full(c / 3, c % 3) = F[9 * k + c];
                step(c / 3, c % 3) = dF[9 * k + c];
            }
            const Stress<3> sigma = law.cauchy(full);
            for (int c = 0; c < 9; ++c) cauchy[9 * k + c] = sigma(c / 3, c % 3);
            calls[k] += 1;
            dilation[k] += std::log(det(step));
        }
        particles.set(cauchy.data(), {calls.data(), dilation.data()});
    }
};

const LawRow* outside_law()
{
    static const LawRow* const row = [] {
        add_law(std::make_unique<OutsideNeoHookean>());
        return find_law("outside-neo-hookean");
    }();
    return row;
}

constexpr double kLambda = 6e4, kMu = 4e4, kDensity = 1000.0;

template <int D>
setup::CaseSpec<D> block(const Material& material, const MethodSpec& method, double dt = 5e-4)
{
    setup::CaseSpec<D> spec{};
    spec.method    = method;
    spec.size      = Vec<D>::filled(1.0);
    spec.spacing   = Vec<D>::filled(0.125);
    spec.materials = {material};
    VectorField<D> v{};
    for (int a = 0; a < D; ++a)
        v[static_cast<std::size_t>(a)] =
            Field([a](const FieldPoint& at) { return 0.5 * std::sin(5 * at.x[a] + 2 * at.x[(a + 1) % D] + a); });
    spec.bodies = {{.shape = Bounds<D>{Vec<D>::filled(0.25), Vec<D>::filled(0.75)}, .velocity = v}};
    spec.time   = {.end = 0.02, .dt = dt};
    return spec;
}

Material built_in() { return {find_law("neo-hookean"), kDensity, kLambda, kMu}; }
Material from_outside()
{
    Material m{outside_law(), kDensity, 0.0, 0.5 * (kLambda + 2 * kMu)};
    m.named = keep_numbers({{"lambda", kLambda}, {"mu", kMu}, {"rho", kDensity}});
    return m;
}

template <int D>
void expect_same_motion(const MethodSpec& method)
{
    Simulation<D> own(setup::build(block<D>(from_outside(), method))), reference(setup::build(block<D>(built_in(), method)));
    own.run();
    reference.run();
    const Particles<D>&p = own.state().particles, &q = reference.state().particles;
    double largest = 0.0;
    for (int i = 0; i < q.count; ++i) largest = std::max(largest, std::sqrt(square(q.sigma[i])));
    ASSERT_GT(largest, 100.0);
    const double* calls    = p.history[p.history_column("calls")].data();
    const double* dilation = p.history[p.history_column("dilation")].data();
    for (int i = 0; i < p.count; ++i) {
        ASSERT_EQ(p.id[i], q.id[i]);
        for (int c = 0; c < Stress<D>::size; ++c) ASSERT_NEAR(p.sigma[i].c[c], q.sigma[i].c[c], 1e-9 * largest);
        ASSERT_NEAR(dilation[i], std::log(det(p.F[i])), 1e-12);
        ASSERT_EQ(calls[i], 3.0 + static_cast<double>(own.state().n) - (method.scheme == TimeScheme::usf ? 1 : 0));
    }
}

TEST(OutsideLaw, IsTheLawOfTheTable)
{
    for (const char* preset : {"mpm", "cpdi1", "cpls", "cpdi2"}) {
        SCOPED_TRACE(preset);
        expect_same_motion<2>(find_preset(preset)->spec);
    }
    for (const TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl}) {
        MethodSpec method = find_preset("ugimp")->spec;
        method.scheme     = scheme;
        expect_same_motion<2>(method);
    }
    expect_same_motion<1>(find_preset("cpdi1")->spec);
    expect_same_motion<3>(find_preset("cpdi1")->spec);
}

/// The work of the stresses is the stored energy, up to an error of second order in the time step.
TEST(OutsideLaw, StoresTheWorkOfItsStresses)
{
    double errors[2];
    for (const int k : {0, 1}) {
        Simulation<2> sim(setup::build(block<2>(from_outside(), find_preset("cpdi1")->spec, 5e-4 / (1 + k))));
        sim.run();
        Particles<2>& p    = sim.state().particles;
        const double found = totals(sim.model(), sim.state()).strain_energy;
        double expected    = 0.0;
        for (int i = 0; i < p.count; ++i) expected += p.V0[i] * NeoHookean{kLambda, kMu}.energy(p.F[i]);
        errors[k] = std::fabs(found / expected - 1);
    }
    EXPECT_LT(errors[0], 1e-2);
    EXPECT_NEAR(errors[0] / errors[1], 4.0, 1.2);
}

TEST(OutsideLaw, GivesTheTimeStep)
{
    auto spec         = block<2>(from_outside(), find_preset("mpm")->spec);
    auto reference    = block<2>(built_in(), find_preset("mpm")->spec);
    spec.time.dt      = {};
    reference.time.dt = {};
    Simulation<2> a(setup::build(spec)), b(setup::build(reference));
    a.step();
    b.step();
    EXPECT_NEAR(a.state().t, b.state().t, 1e-12 * b.state().t);
}

/// Forces on the nodes and a body force of the same size move bodies alike, and the account has both as given.
TEST(Outside, ForcesOnNodesAreBodyForces)
{
    constexpr double push = 300.0;  // m/s^2
    for (const char* preset : {"cpdi1", "cpls", "bsmpm"}) {
        SCOPED_TRACE(preset);
        auto spec    = block<2>(built_in(), find_preset(preset)->spec, 2e-4);
        spec.gravity = {0.0, -5.0};
        Simulation<2> a(setup::build(spec)), b(setup::build(spec));
        double mass = 0.0;
        a.scheme().on_nodes([&](NodeForces<2>& now) {
            mass = std::accumulate(now.nodes.mass.begin(), now.nodes.mass.end(), 0.0);
            for (std::size_t k = 0; k < now.force.size(); ++k)
                now.force[k] += now.nodes.mass[k] * Vec<2>{push, 0.1 * push};  // also along gravity
        });
        b.scheme().add_body_force(
            [](const ParticleView<2>& p, double) {
                for (int i = 0; i < p.count; ++i) p.b[i] += Vec<2>{push, 0.1 * push};
            },
            b.state());
        for (Simulation<2>* sim : {&a, &b}) sim->advance(0.005);
        const Totals e = totals(a.model(), a.state()), f = totals(b.model(), b.state());
        EXPECT_NEAR(mass, e.mass, 1e-9 * e.mass);
        EXPECT_NEAR(e.momentum[0], f.momentum[0], 1e-9 * f.momentum[0]);
        EXPECT_NEAR(e.momentum[1], f.momentum[1], 1e-9 * f.momentum[0]);
        const SchemeEnergy of_a = scheme_energy(e, a.state()), of_b = scheme_energy(f, b.state());
        const double scale = 1e-2 * f.kinetic_energy;
        EXPECT_NEAR(of_a.stress_update, of_b.stress_update, scale);
        EXPECT_NEAR(of_a.projection, of_b.projection, scale);
        EXPECT_NEAR(of_a.half_step, of_b.half_step, 5 * scale);
        EXPECT_NEAR(a.state().account.nodes_work, b.state().account.body_force_work, 5 * scale);
        EXPECT_LT(a.state().account.nodes_work, -0.5 * f.kinetic_energy);
    }
}

TEST(Outside, LooksChangeNoBit)
{
    for (const char* preset : {"mpm", "cpls", "bsmpm"}) {
        auto spec    = block<2>(built_in(), find_preset(preset)->spec, 2e-4);
        spec.gravity = {0.0, -5.0};
        Simulation<2> a(setup::build(spec)), b(setup::build(spec));
        a.scheme().on_nodes([](NodeForces<2>&) {});
        for (Simulation<2>* sim : {&a, &b}) sim->advance(0.004);
        for (int i = 0; i < a.state().particles.count; ++i)
            for (int c = 0; c < 2; ++c) ASSERT_EQ(a.state().particles.x[i][c], b.state().particles.x[i][c]);
    }
}

TEST(Outside, StepsGoPastTheEnd)
{
    Simulation<2> sim(setup::build(block<2>(built_in(), find_preset("mpm")->spec)));
    sim.run();
    sim.step_on();
    EXPECT_NEAR(sim.state().t, 0.0205, 1e-12);
    sim.step_on(1e-4);
    EXPECT_EQ(sim.state().dt_prev, 1e-4);
    EXPECT_FALSE(sim.is_cut());
}

}  // namespace
}  // namespace ordo
