// Implicit steps: what they keep, that steps may be halved, what they refuse, and that loads, conditions and the account fit together.
#include "base/parallel.hpp"
#include "implicit/scheme.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "setup/schemes.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

MethodSpec implicit_spec(TimeScheme scheme, Domain domain = Domain::parallelepiped)
{
    MethodSpec s = test::shape_spec(Basis::hat, domain);
    s.scheme     = scheme;
    return s;
}

/// A free block in the middle of the grid that turns and stretches.
template <int D>
State<D> spinning(const Scheme<D>& scheme, double drift = 0.02)
{
    State<D> s = scheme.start(test::plant_halves(scheme.model(), test::block(scheme.model(), 0.3, 0.7, 3)));
    set_velocities(
        s.particles, 0, s.particles.count,
        [&](const Vec<D>& x) {
            Vec<D> v = Vec<D>::filled(drift);
            v[0] += -0.8 * (x[1] - 0.5) + 0.2 * (x[0] - 0.5);
            v[1] += 0.8 * (x[0] - 0.5);
            return v;
        },
        scheme.model().h);
    return s;
}

/// Sum of m (x_0 v_1 - x_1 v_0).
template <int D>
double angular_momentum(const State<D>& s)
{
    const Particles<D>& p = s.particles;
    double r              = 0.0;
    for (int i = 0; i < p.count; ++i) r += p.m[i] * (p.x[i][0] * p.v[i][1] - p.x[i][1] * p.v[i][0]);
    return r;
}

/// The midpoint rule with the consistent mass keeps momentum, angular momentum and energy at any size of the step. The ghost penalty takes a
/// little energy.
template <int D>
void check_conservation(Domain domain, double courant, int steps, double penalty = 0.0)
{
    MethodSpec spec       = implicit_spec(TimeScheme::midpoint, domain);
    spec.mass             = MassMatrix::consistent;
    spec.lump_below       = 0.0;
    spec.newton_tolerance = 1e-12;
    spec.ghost_penalty    = penalty;
    const auto scheme     = make_scheme(test::unit_box<D>(5, spec));
    State<D> s            = spinning(*scheme);
    const Totals before   = totals(scheme->model(), s);
    const double turning  = angular_momentum(s);
    const double dt       = courant * courant_time_step(scheme->model(), s.particles);
    // The centroid of a bent cell, which its particle follows, is not the mean of its nodes' places.
    const double bearable = domain == Domain::cell ? 2e-3 : 1e-9;
    double change = 0.0, strain = 0.0;
    for (int k = 0; k < steps; ++k) {
        scheme->step(s, dt);
        const Totals now = totals(scheme->model(), s);
        change           = std::max(change, std::fabs(now.total_energy() / before.total_energy() - 1));
        strain           = std::max(strain, now.strain_energy / before.total_energy());
        EXPECT_NEAR(angular_momentum(s), turning, bearable * std::fabs(turning)) << k;
        for (int a = 0; a < D; ++a) EXPECT_NEAR(now.momentum[a], before.momentum[a], 1e-9 * before.mass);
    }
    EXPECT_LT(change, penalty > 0 ? 0.02 : 1e-9);
    EXPECT_GT(strain, 0.005);  // it does stretch
}
TEST(ImplicitSteps, MidpointKeepsEnergyAndAngularMomentum)
{
    for (const Domain domain :
         {Domain::box, Domain::parallelepiped, Domain::cell, Domain::simplex}) {  // points leave nodes without mass
        SCOPED_TRACE(name_of(domain));
        check_conservation<2>(domain, 1.0, 12);
        check_conservation<2>(domain, 3.0, 4);
        check_conservation<2>(domain, 3.0, 25, ghost_penalty_of({}));
    }
    check_conservation<3>(Domain::parallelepiped, 3.0, 3);
}

/// With lumped rows at slivers, the default, none of ten thousand steps gives a free block energy while it turns through the cells.
TEST(ImplicitSteps, MidpointNeverGainsEnergyInALongRun)
{
    MethodSpec spec     = implicit_spec(TimeScheme::midpoint, Domain::parallelepiped);
    spec.mass           = MassMatrix::consistent;
    const auto scheme   = make_scheme(test::unit_box<2>(5, spec));
    State<2> s          = spinning(*scheme, 0.0);
    const double start  = totals(scheme->model(), s).total_energy();
    const double turned = angular_momentum(s);
    const double dt     = 0.3 * courant_time_step(scheme->model(), s.particles);
    double energy = start, gain = 0.0;
    for (int k = 0; k < 10000; ++k) {
        scheme->step(s, dt);
        const double now = totals(scheme->model(), s).total_energy();
        gain             = std::max(gain, now - energy);
        energy           = now;
    }
    EXPECT_LT(gain, 1e-12 * start);
    EXPECT_GT(energy, 0.95 * start);  // 0.969 after 22.7 turns
    EXPECT_NEAR(angular_momentum(s), turned, 1e-9 * std::fabs(turned));
}

/// With lumped mass what the nodes do not see takes energy, and never gives any; the account says where it went.
TEST(ImplicitSteps, LumpedMassNeverGainsEnergy)
{
    MethodSpec spec       = implicit_spec(TimeScheme::midpoint);
    spec.newton_tolerance = 1e-12;  // what is left of the residual does work too
    const auto scheme     = make_scheme(test::unit_box<2>(6, spec));
    State<2> s            = spinning(*scheme);
    start_account(scheme->model(), s);
    const double start = totals(scheme->model(), s).total_energy();
    double last        = start;
    for (int k = 0; k < 30; ++k) {
        scheme->step(s, 3 * courant_time_step(scheme->model(), s.particles));
        const Totals now = totals(scheme->model(), s);
        EXPECT_LT(now.total_energy(), last + 1e-9 * start);
        last                           = now.total_energy();
        const SchemeEnergy scheme_took = scheme_energy(now, s);
        EXPECT_NEAR(start - last, scheme_took.all(), 1e-8 * start);
        EXPECT_NEAR(scheme_took.projection, 0.0, 1e-10 * start);
        EXPECT_NEAR(scheme_took.half_step, 0.0, 1e-10 * start);
    }
    EXPECT_GT(last, 0.2 * start);
}

/// Results have the same bits for any number of threads.
TEST(ImplicitSteps, ThreadsDoNotChangeBits)
{
    for (const TimeScheme type : {TimeScheme::midpoint, TimeScheme::newmark}) {
        std::vector<State<2>> ends;
        const int usual = thread_count();
        for (const int threads : {1, 2, 3}) {
            set_thread_count(threads);
            const auto scheme = make_scheme(test::unit_box<2>(40, implicit_spec(type)));
            State<2> s        = spinning(*scheme);
            for (int k = 0; k < 3; ++k) scheme->step(s, 4 * courant_time_step(scheme->model(), s.particles));
            ends.push_back(std::move(s));
        }
        set_thread_count(usual);
        for (const State<2>& s : ends)
            for (int i = 0; i < s.particles.count; ++i) {
                EXPECT_EQ(s.particles.x[i], ends[0].particles.x[i]);
                EXPECT_EQ(s.particles.v[i], ends[0].particles.v[i]);
            }
    }
}

/// What the equations do not hold is refused where a scheme is made, also by programs on the library.
TEST(ImplicitSteps, RefusesWhatItCannotTreat)
{
    Model<2> walled = test::unit_box<2>(6, implicit_spec(TimeScheme::midpoint));
    walled.walls.emplace_back();
    EXPECT_THROW(static_cast<void>(make_scheme(std::move(walled))), InputError);
    Model<2> meeting = test::unit_box<2>(6, implicit_spec(TimeScheme::midpoint));
    meeting.contacts.emplace_back();
    EXPECT_THROW(static_cast<void>(make_scheme(std::move(meeting))), InputError);
    const auto scheme = make_scheme(test::unit_box<2>(6, implicit_spec(TimeScheme::midpoint)));
    EXPECT_THROW(scheme->on_nodes([](NodeForces<2>&) {}), InputError);
    EXPECT_NO_THROW(scheme->on_nodes({}));
}

/// A bar that a moving end shortens: in one step `static` finds the uniform strain, the force of the end and its work to second order, and leaves
/// no velocity.
TEST(ImplicitSteps, StaticPressIsExact)
{
    for (const Domain domain : {Domain::point, Domain::box, Domain::stretched_box, Domain::parallelepiped, Domain::cell}) {
        SCOPED_TRACE(name_of(domain));
        Model<1> model = test::unit_box<1>(8, implicit_spec(TimeScheme::quasi_static, domain));
        model.conditions.push_back({.axis = 0, .outer_is_above = false, .at = 0.0, .type = ConditionType::fixed});
        model.conditions.push_back(
            {.axis = 0, .outer_is_above = true, .at = 0.75, .type = ConditionType::displacement, .boundary = 1});
        model.conditions.back().value[0] = Field([](const FieldPoint& at) { return -0.075 * at.t; });
        const auto scheme                = make_scheme(std::move(model));
        State<1> s                       = scheme->start(plant_all(scheme->model(), test::block(scheme->model(), 0.0, 0.75, 2)));
        set_velocities(
            s.particles, 0, s.particles.count, [](const Vec<1>&) { return Vec<1>{1.0}; }, scheme->model().h);
        start_account(scheme->model(), s);
        scheme->step(s, 1.0);
        const Material& m  = scheme->model().materials[0];
        const double sigma = m.law->in_1d.initial_stress(m, {0.9})(0, 0);
        for (int i = 0; i < s.particles.count; ++i) {
            EXPECT_NEAR(s.particles.F[i](0, 0), 0.9, 1e-12);
            EXPECT_NEAR(s.particles.sigma[i](0, 0), sigma, 1e-9 * std::fabs(sigma));
            EXPECT_EQ(s.particles.v[i][0], 0.0);
        }
        const Exchange& end = s.account.boundaries[1];
        EXPECT_NEAR(end.force[0], sigma, 1e-8 * std::fabs(sigma));
        EXPECT_NEAR(end.work, 0.075 * sigma, 1e-8 * std::fabs(sigma));  // the force at the end of the step, times its way
    }
}

/// A step that does not converge is tried in halves, which are what steps of their size would be.
TEST(ImplicitSteps, HardStepsAreHalved)
{
    MethodSpec spec        = implicit_spec(TimeScheme::quasi_static);
    spec.newton_iterations = 3;
    auto pressed           = [&](int steps) {
        Model<2> model  = test::unit_box<2>(6, spec);
        model.origin[0] = -0.5;
        model.cells[0]  = 9;
        for (const bool above : {false, true})
            model.conditions.push_back({.axis           = 1,
                                                  .outer_is_above = above,
                                                  .at             = above ? 0.5 : 0.0,
                                                  .type           = above ? ConditionType::displacement : ConditionType::fixed,
                                                  .boundary       = above ? 1 : 0});
        model.conditions.back().value = {Field(0.0), Field([](const FieldPoint& at) { return -0.15 * at.t; })};
        const auto scheme             = make_scheme(std::move(model));
        State<2> s                    = scheme->start(plant_all(scheme->model(), test::block(scheme->model(), 0.0, 0.5, 2)));
        start_account(scheme->model(), s);
        for (int k = 0; k < steps; ++k) scheme->step(s, 1.0 / steps);
        return s;
    };
    const State<2> whole = pressed(1);
    ASSERT_GT(whole.newton.halvings, 0);
    EXPECT_NEAR(whole.t, 1.0, 1e-14);
    int parts = 0;
    for (const NewtonReport& one : whole.newton.of_step) parts += one.converged ? 1 : 0;
    const State<2> small = pressed(parts);
    EXPECT_EQ(small.newton.halvings, 0);
    double moved = 0.0;
    for (int i = 0; i < whole.particles.count; ++i)
        for (int a = 0; a < 2; ++a) {
            EXPECT_NEAR(whole.particles.x[i][a], small.particles.x[i][a], 1e-12);
            moved = std::max(moved, whole.particles.X[i][a] - whole.particles.x[i][a]);
        }
    EXPECT_GT(moved, 0.1);
    const Exchange &of_whole = whole.account.boundaries[1], &of_small = small.account.boundaries[1];
    EXPECT_NEAR(of_whole.force[1], of_small.force[1], 1e-9 * std::fabs(of_small.force[1]));
    EXPECT_NEAR(of_whole.work, of_small.work, 1e-9 * std::fabs(of_small.work));
}

/// A load step begins like the last one, which saves iterations. What it finds does not depend on where it begins, nor on a motion that no
/// longer fits the conditions.
TEST(ImplicitSteps, LoadStepsBeginLikeTheLast)
{
    Model<2> model     = test::unit_box<2>(6, implicit_spec(TimeScheme::quasi_static));
    model.materials[0] = test::sample_material("j2", 2);
    model.origin[0]    = -0.5;
    model.cells[0]     = 9;
    model.conditions.push_back({.axis = 1, .outer_is_above = false, .at = 0.0, .type = ConditionType::fixed});
    model.conditions.push_back({.axis = 1, .outer_is_above = true, .at = 0.5, .type = ConditionType::displacement});
    model.conditions.back().value = {Field(0.0), Field([](const FieldPoint& at) { return -0.1 * std::min(at.t, 2 - at.t); })};
    const auto scheme             = make_scheme(std::move(model));
    auto run                      = [&](bool forgets, int steps) {
        State<2> s = scheme->start(plant_all(scheme->model(), test::block(scheme->model(), 0.0, 0.5, 2)));
        for (int k = 0; k < steps; ++k) {
            if (forgets) s.load_step.clear();
            scheme->step(s, 0.25);
        }
        return s;
    };
    for (const int steps : {4, 8}) {  // at 1 s the load turns round
        const State<2> like_last = run(false, steps), from_rest = run(true, steps);
        for (int i = 0; i < like_last.particles.count; ++i)
            EXPECT_NEAR(norm(like_last.particles.x[i] - from_rest.particles.x[i]), 0.0, 1e-8);
        EXPECT_LT(like_last.newton.iterations, from_rest.newton.iterations);
        EXPECT_EQ(like_last.newton.halvings, 0);
        // Nodes are numbered from the grid's faces: those of the floor rest, those of the top move as given.
        int resting = 0, moving = 0;
        for (const NodeMotion<2>& one : like_last.load_step) {
            if (one.node[1] == 0) {
                EXPECT_EQ(norm(one.velocity), 0.0);
                ++resting;
            } else if (one.node[1] == 3) {
                EXPECT_NEAR(one.velocity[1], steps == 4 ? -0.1 : 0.1, 1e-12);
                ++moving;
            }
        }
        EXPECT_GT(resting, 3);
        EXPECT_GT(moving, 3);
    }
}

/// A step that never converges names node, particle, body and law, or a body that nothing holds.
TEST(ImplicitSteps, HopelessStepsSayWhere)
{
    enum { free, guided, hinged };
    for (const auto held : {free, guided, hinged}) {
        MethodSpec spec    = implicit_spec(TimeScheme::quasi_static);
        spec.step_halvings = 2;
        Model<2> model     = test::unit_box<2>(6, spec);
        model.gravity      = {0.0, -1.0};
        if (held == guided)
            model.conditions.push_back({.axis = 0, .outer_is_above = false, .at = 1.0 / 3, .type = ConditionType::symmetry});
        if (held == hinged)
            model.conditions.push_back({.region = [](const Vec<2>& x) { return norm(x - Vec<2>::filled(1.0 / 3)) < 0.01; }});
        const auto scheme = make_scheme(std::move(model));
        State<2> s        = scheme->start(plant_all(scheme->model(), test::block(scheme->model(), 1.0 / 3, 0.75, 2)));
        try {
            scheme->step(s, 1.0);
            FAIL();
        } catch (const NumericalError& e) {
            const std::string text = e.what();
            const std::vector<std::string> words =
                held == hinged   ? std::vector<std::string>{"halvings", "free to move", "body 0", "neo-hookean"}
                : held == guided ? std::vector<std::string>{"nothing holds body 0 along y"}
                                 : std::vector<std::string>{"nothing holds body 0: no boundary"};
            for (const std::string& word : words) EXPECT_NE(text.find(word), std::string::npos) << text;
        }
    }
}

}  // namespace
}  // namespace ordo
