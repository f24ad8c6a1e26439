// Forces and work of boundaries, tractions and body forces: they are what changes momentum and energy.
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "method/tables.hpp"
#include "setup/build.hpp"
#include "sim/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>

namespace ordo {
namespace {

/// A block that hangs from a clamp, is pulled to the right by a plane that moves, pressed against an oblique wall with friction, and
/// loaded from above, with a grip of its own material at its left.
setup::CaseSpec<2> pushed_block(const MethodSpec& method)
{
    setup::CaseSpec<2> spec{};
    spec.method    = method;
    spec.size      = {0.8, 0.8};
    spec.spacing   = {0.1, 0.1};
    spec.gravity   = {1.0, -10.0};
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e5, 0.3)};
    spec.bodies    = {{.shape      = Bounds<2>{{0.2, 0.2}, {0.8, 0.8}},
                       .velocity   = {Field(0.3), Field(-0.2)},
                       .body_force = {Field(-3.0), Field(2.0)}},
                      {.shape = Bounds<2>{{0.1, 0.4}, {0.2, 0.6}}}};
    setup::BoundarySpec<2> clamp{.axis = 1, .is_above = true, .type = setup::FaceType::fixed};
    setup::BoundarySpec<2> pull{.axis = 0, .is_above = true, .type = setup::FaceType::velocity, .value = {Field(0.5), {}}};
    setup::BoundarySpec<2> wall{.type = setup::FaceType::wall, .normal = Vec<2>{0.5, 1.0}, .point = {0.2, 0.2}, .friction = 0.3};
    setup::BoundarySpec<2> region{.type = setup::FaceType::displacement, .region = Ball<2>{{0.6, 0.4}, 0.11}};
    region.value[1] = Field([](const FieldPoint& p) { return -0.1 * p.t; });
    setup::BoundarySpec<2> grip{.type = setup::FaceType::velocity, .value = {Field(-0.1), Field(0.1)}, .body = 1};
    spec.boundaries = {clamp, pull, wall, region, grip};
    spec.tractions  = {{.traction = {TractionType::dead, {Field(50.0), Field(-20.0)}}}};
    spec.time       = {.end = 1.0, .cfl = 0.2};
    return spec;
}


/// Two bars that meet on the common grid, where their ends lie anywhere in cells: the most energy over that at the start.
double most_energy_of_bars(const MethodSpec& method, int per_axis, double left, double gap)
{
    setup::CaseSpec<1> spec{};
    spec.method    = method;
    spec.size      = {4.0};
    spec.spacing   = {0.1};
    spec.materials = {elastic_material(find_law("neo-hookean"), 1000.0, 1e5, 0.0)};
    spec.bodies    = {{.shape = Bounds<1>{{left}, {left + 0.6}}, .particles_per_cell = {per_axis}, .velocity = {Field(0.5)}},
                      {.shape              = Bounds<1>{{left + 0.6 + gap}, {left + 1.2 + gap}},
                       .particles_per_cell = {per_axis},
                       .velocity           = {Field(-0.5)}}};
    spec.time      = {.end = 1.0, .dt = 1e-3};
    WatchSpec watch;
    watch.energy_growth = 1e9;
    Simulation<1> sim(setup::build(spec), watch);
    const double start = totals(sim.model(), sim.state()).total_energy();
    double most        = start;
    for (int n = 0; n < 1000; ++n) {
        sim.step();
        most = std::max(most, totals(sim.model(), sim.state()).total_energy());
    }
    return most / start;
}

/// With limited fits as with projection by mass impacts hardly gain energy; with whole fits they do.
TEST(Limiter, ImpactsHardlyGainEnergy)
{
    for (const int per_axis : {1, 2})
        for (const double strain_velocity : {0.3, 1.0}) {
            double limited = 0.0, whole = 0.0, by_mass = 0.0;
            for (const double left : {0.7, 0.725, 0.75, 0.775})
                for (const double gap : {0.4, 0.425, 0.45, 0.475}) {
                    auto most = [&](std::string_view preset) {
                        MethodSpec method      = find_preset(preset)->spec;
                        method.strain_velocity = strain_velocity;
                        return most_energy_of_bars(method, per_axis, left, gap);
                    };
                    limited = std::max(limited, most("cpls-limited"));
                    whole   = std::max(whole, most("cpls"));
                    by_mass = std::max(by_mass, most("cpdi1"));
                }
            EXPECT_LT(limited, by_mass + 0.002) << per_axis << ' ' << strain_velocity;
            EXPECT_LT(limited, 1.005) << per_axis << ' ' << strain_velocity;
            EXPECT_GT(whole, 1.3);
        }
}

class Balance : public testing::TestWithParam<std::tuple<std::string, TimeScheme, double>> {};

/// Momentum changes in each step by the impulses of gravity, boundaries, tractions and body forces.
TEST_P(Balance, OfMomentum)
{
    const auto& [preset, scheme, pic] = GetParam();
    MethodSpec method                 = find_preset(preset)->spec;
    method.scheme                     = scheme;
    method.pic_fraction               = pic;
    if (const Rule* rule = broken_rule(method)) GTEST_SKIP() << rule->why;
    if (keeps_corner_velocity(method) && pic > 0)
        GTEST_SKIP() << "particles then take the momentum of corners with kept velocities";
    const setup::CaseSpec<2> spec = pushed_block(method);
    Simulation<2> sim(setup::build(spec));
    const double mass = totals(sim.model(), sim.state()).mass, pushed = 0.36 * 1000.0;
    std::array<double, 5> largest{};
    for (int step = 0; step < 12; ++step) {
        const State<2>& s        = sim.state();
        const Vec<3> before      = totals(sim.model(), s).momentum;
        const double dt_of_start = s.dt_prev;
        sim.step();
        const double dt = 0.5 * (dt_of_start + s.dt_prev);
        Vec<3> force    = mass * padded(spec.gravity) + pushed * Vec<3>{-3.0, 2.0, 0.0};
        for (std::size_t k = 0; k < s.account.boundaries.size(); ++k) {
            force += s.account.boundaries[k].force;
            largest[k] = std::max(largest[k], norm(s.account.boundaries[k].force));
        }
        for (const Exchange& e : s.account.tractions) force += e.force;
        const Vec<3> change = totals(sim.model(), s).momentum - before;
        EXPECT_LT(norm(change - dt * force), 1e-10 * dt * norm(force) + 1e-12 * norm(before)) << "step " << step;
    }
    for (const double force : largest) EXPECT_GT(force, 10.0);  // N: each of them does act
}

std::string name_of_balance(const testing::TestParamInfo<Balance::ParamType>& info)
{
    std::string r = std::get<0>(info.param) + "_" + std::string(name_of(std::get<1>(info.param))) +
                    (std::get<2>(info.param) > 0 ? "_pic" : "");
    std::replace(r.begin(), r.end(), '-', '_');
    return r;
}

INSTANTIATE_TEST_SUITE_P(
    Presets, Balance,
    testing::Combine(testing::Values("mpm", "ugimp", "cpdi1", "cpdi2", "cpdi2t", "apic", "bsmpm", "ddmpm", "fem", "xpic", "fmpm"),
                     testing::Values(TimeScheme::usf, TimeScheme::usl, TimeScheme::musl), testing::Values(0.0, 0.3)),
    name_of_balance);

/// To keep the account changes no particle, also where a pressure follows faces that USF turns before it acts.
TEST(Account, DoesNotChangeTheRun)
{
    for (const TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl}) {
        setup::CaseSpec<2> spec = pushed_block(find_preset("cpdi1")->spec);
        spec.method.scheme      = scheme;
        spec.tractions          = {{.traction = {TractionType::pressure, {Field(2000.0)}}}};
        spec.time.end           = 0.02;
        Simulation<2> with(setup::build(spec)), without(setup::build(spec));
        without.state().account.is_wanted = false;
        with.run();
        without.run();
        const Particles<2>&p = with.state().particles, &q = without.state().particles;
        for (int i = 0; i < p.count; ++i) ASSERT_TRUE(p.x[i] == q.x[i] && p.v[i] == q.v[i] && p.sigma[i] == q.sigma[i]) << i;
    }
}

/// A body force does the work that gravity would do, to round-off.
TEST(Account, WorkOfBodyForces)
{
    setup::CaseSpec<2> spec = pushed_block(find_preset("cpdi1")->spec);
    spec.boundaries.clear();
    spec.tractions.clear();
    spec.time.end = 0.05;
    Simulation<2> forced(setup::build(spec));
    forced.run();
    const double pushed = 0.36 * 1000.0;
    Vec<2> centre{};
    const Particles<2>& p = forced.state().particles;
    for (int i = 0; i < p.count; ++i)
        if (p.body[i] == 0) centre += (1 / pushed) * p.m[i] * p.x[i];
    const Vec<2> moved = centre - Vec<2>{0.5, 0.5};
    EXPECT_NEAR(forced.state().account.body_force_work, -pushed * (-3.0 * moved[0] + 2.0 * moved[1]), 1e-10);
    EXPECT_GT(std::fabs(forced.state().account.body_force_work), 1.0);
}

/// A grip ends where it is told, with steps of any size, and a body beside it does not.
TEST(Account, DisplacementsAreExact)
{
    setup::CaseSpec<2> spec = pushed_block(find_preset("cpdi1")->spec);
    spec.size               = {2.0, 1.0};
    spec.bodies[1].shape    = Bounds<2>{{1.4, 0.4}, {1.6, 0.6}};
    spec.tractions.clear();
    spec.boundaries = {{.type = setup::FaceType::displacement, .body = 1}};
    for (int a = 0; a < 2; ++a) spec.boundaries[0].value[a] = Field([a](const FieldPoint& at) { return (a + 1) * at.t * at.t; });
    spec.time.end = 0.2;
    Simulation<2> sim(setup::build(spec));
    sim.run();
    const Particles<2>& p = sim.state().particles;
    for (int i = 0; i < p.count; ++i) {
        const Vec<2> moved = p.x[i] - p.X[i];
        const double off   = norm(moved - Vec<2>{0.04, 0.08});
        EXPECT_TRUE(p.body[i] == 1 ? off < 1e-12 : off > 0.01) << off;
    }
}

/// The work of a pressure that grows with time, on a face that moves on a given path: the mean force times the way.
TEST(Account, WorkOfTractions)
{
    setup::CaseSpec<2> spec = pushed_block(find_preset("cpdi1")->spec);
    spec.gravity            = {};
    spec.size               = {1.0, 1.0};
    spec.bodies.resize(1);
    spec.bodies[0].body_force = {};
    spec.bodies[0].velocity   = {Field(0.5), Field(0.0)};
    spec.boundaries           = {{.type = setup::FaceType::velocity, .value = {Field(0.5), Field(0.0)}, .body = 0}};
    spec.tractions            = {{.faces    = {{setup::BodyFace::along_axis, 0, true}},
                                  .traction = {TractionType::pressure, {Field([](const FieldPoint& at) { return 1e3 * at.t; })}}}};
    spec.time                 = {.end = 0.1, .dt = 0.001};
    Simulation<2> sim(setup::build(spec));
    sim.run();
    const Account& a = sim.state().account;
    const double way = 0.05, height = 0.6, mean_pressure = 50.0;
    EXPECT_NEAR(a.traction_work(), mean_pressure * height * way, 1e-10);
    EXPECT_NEAR(a.tractions[0].force[0], -99.0 * height, 1e-9);
    EXPECT_NEAR(a.boundary_work(), -a.traction_work(), 0.02 * a.traction_work());  // the boundary drives the block against it
    EXPECT_NEAR(sim.state().particles.x[0][0] - sim.state().particles.X[0][0], way, 1e-12);
}

/// Of total energy and all that has left it, which is constant.
template <int D>
double sum_of_account(const Simulation<D>& sim)
{
    const State<D>& s = sim.state();
    const Totals now  = totals(sim.model(), s);
    return energy_parts(now).all() + s.account.work() + s.account.damped + s.account.staged + s.contacts.work() +
           scheme_energy(now, s).all();
}

class EnergyAccount : public testing::TestWithParam<std::tuple<std::string, TimeScheme>> {};

/// The projection by mass gives particles the kinetic energy that forces gave the nodes, whatever acts on them.
TEST_P(EnergyAccount, LosesNothingInTheProjectionByMass)
{
    const auto& [preset, scheme] = GetParam();
    MethodSpec method            = find_preset(preset)->spec;
    method.scheme                = scheme;
    setup::CaseSpec<2> spec      = pushed_block(method);
    if (method.mass == MassMatrix::consistent)
        std::erase_if(spec.boundaries, [](const auto& b) { return b.type == setup::FaceType::wall; });
    Simulation<2> sim(setup::build(spec));
    const double first = sum_of_account(sim);
    double largest     = first;
    for (int step = 0; step < 20; ++step) {
        sim.step();
        const NodalWork& w = sim.state().account.nodes;
        for (const double one : {w.stresses, w.loads, w.gravity, w.constraints}) largest = std::max(largest, std::fabs(one));
        EXPECT_LT(std::fabs(scheme_energy(totals(sim.model(), sim.state()), sim.state()).projection), 1e-10 * largest) << step;
        EXPECT_LT(std::fabs(sum_of_account(sim) - first), 1e-12 * largest) << step;
    }
    for (const double one : {sim.state().account.nodes.loads, sim.state().account.nodes.constraints})
        EXPECT_GT(std::fabs(one), 0.01);
}

std::string name_of_account(const testing::TestParamInfo<EnergyAccount::ParamType>& info)
{
    return std::get<0>(info.param) + "_" + std::string(name_of(std::get<1>(info.param)));
}

INSTANTIATE_TEST_SUITE_P(Presets, EnergyAccount,
                         testing::Combine(testing::Values("mpm", "ugimp", "cpdi1", "cpdi2", "bscpdi2", "bsmpm", "ddmpm", "xpic",
                                                          "fmpm"),
                                          testing::Values(TimeScheme::usf, TimeScheme::usl, TimeScheme::musl)),
                         name_of_account);

/// A falling block: all that the scheme takes is half a step between velocities and positions. Body forces are the same as gravity.
TEST(SchemeEnergy, OfFreeFallIsHalfAStep)
{
    for (const bool is_body_force : {false, true})
        for (const char* preset : {"cpdi1", "cpls", "bsmpm", "tls-mpm", "impm", "apic", "fem"}) {
            SCOPED_TRACE(preset);
            setup::CaseSpec<2> spec = pushed_block(find_preset(preset)->spec);
            spec.boundaries.clear();
            spec.tractions.clear();
            spec.bodies.pop_back();
            spec.bodies[0].velocity   = {Field(0.0), Field(0.0)};
            spec.bodies[0].body_force = {Field(0.0), Field(is_body_force ? -10.0 : 0.0)};
            spec.gravity              = {0.0, is_body_force ? 0.0 : -10.0};
            spec.time                 = {.end = 1.0, .dt = 1e-3};
            Simulation<2> sim(setup::build(spec));
            for (int step = 0; step < 15; ++step) sim.step();
            const State<2>& s = sim.state();
            const double mass = totals(sim.model(), s).mass, half = 50.0 * mass * (s.t * s.t - s.t_v * s.t_v);
            const SchemeEnergy e = scheme_energy(totals(sim.model(), s), s);
            EXPECT_GT(half, 0.1);
            EXPECT_NEAR(e.half_step, half, 1e-9 * mass);
            EXPECT_NEAR(e.stress_update, 0.0, 1e-9 * mass);
            EXPECT_NEAR(e.projection, 0.0, 1e-9 * mass);
            EXPECT_NEAR(e.filter, 0.0, 1e-9 * mass);
            EXPECT_NEAR(s.account.nodal_kinetic, totals(sim.model(), s).kinetic_energy, 1e-9 * mass);
        }
}

/// Boundaries hold the terms of a filter: the account has the work of these impulses on both sides, and none of it is left as half a step.
TEST(SchemeEnergy, HasTheWorkOfFilters)
{
    auto after_a_step = [](Filter filter, double order) {
        MethodSpec method       = find_preset("cpdi1")->spec;
        method.filter           = filter;
        method.filter_order     = order;
        setup::CaseSpec<2> spec = pushed_block(method);
        spec.gravity            = {};  // their works come from motion, which FMPM changes
        spec.tractions.clear();
        for (auto& body : spec.bodies) body.body_force = {Field(0.0), Field(0.0)};
        Simulation<2> sim(setup::build(spec));
        sim.step();
        return std::pair(scheme_energy(totals(sim.model(), sim.state()), sim.state()), sim.state().account.boundary_work());
    };
    for (const Filter filter : {Filter::xpic, Filter::fmpm}) {
        const auto [first, work_of_first] = after_a_step(filter, 1);
        const auto [fourth, work]         = after_a_step(filter, 4);
        EXPECT_GT(std::fabs(work - work_of_first), 0.01 * std::fabs(work));
        EXPECT_NEAR(fourth.half_step, first.half_step, 1e-12 * std::fabs(work));
        EXPECT_NEAR(fourth.projection, 0.0, 1e-12 * std::fabs(work));
    }
}

/// A block with waves in it and no forces from outside. Of the stress update, usl takes energy and musl hardly any; the blend lies
/// between them. Constraints do nothing. What PIC takes in a step is the difference that it makes.
TEST(SchemeEnergy, SplitsWhatTheSchemeTakes)
{
    auto block = [](const MethodSpec& method) {
        setup::CaseSpec<2> spec = pushed_block(method);
        spec.gravity            = {};
        spec.boundaries.clear();
        spec.tractions.clear();
        spec.bodies.pop_back();
        spec.bodies[0].velocity   = {Field([](const FieldPoint& p) { return p.X[0] < 0.5 ? 0.3 : -0.3; }), Field(0.0)};
        spec.bodies[0].body_force = {Field(0.0), Field(0.0)};
        return Simulation<2>(setup::build(spec));
    };
    auto taken = [&](double part, double pic) {
        MethodSpec method      = find_preset("cpdi1")->spec;
        method.strain_velocity = part;
        method.pic_fraction    = pic;
        Simulation<2> sim      = block(method);
        sim.advance(0.2);
        EXPECT_EQ(sim.state().account.boundaries.size(), 0u);
        EXPECT_LT(std::fabs(sim.state().account.nodes.constraints), 1e-12 * std::fabs(sim.state().account.nodes.stresses));
        return scheme_energy(totals(sim.model(), sim.state()), sim.state());
    };
    const double start = 0.5 * 360.0 * 0.09;
    const double musl = taken(0.0, 0.0).stress_update, between = taken(0.3, 0.0).stress_update,
                 usl = taken(1.0, 0.0).stress_update;
    EXPECT_LT(std::fabs(musl), 0.05 * start);
    EXPECT_GT(between, 0.1 * start);
    EXPECT_GT(usl, between);
    EXPECT_EQ(taken(0.3, 0.0).filter, 0.0);
    EXPECT_GT(taken(0.3, 0.01).filter, 0.01 * start);

    MethodSpec method   = find_preset("cpdi1")->spec;
    Simulation<2> flip  = block(method);
    method.pic_fraction = 0.4;
    Simulation<2> pic   = block(method);
    flip.step();
    pic.step();
    const double difference = totals(flip.model(), flip.state()).kinetic_energy - totals(pic.model(), pic.state()).kinetic_energy;
    EXPECT_GT(difference, 0.01 * start);
    EXPECT_NEAR(pic.state().account.filtered, difference, 1e-12 * start);
}

}  // namespace
}  // namespace ordo
