// Simulation: which steps it makes, what observers are told and in which order.
#include "sim/simulation.hpp"
#include "method/explicit.hpp"
#include "method/tables.hpp"
#include "setup/build.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ordo {
namespace {

setup::CaseSpec<1> bar(double end, double dt)
{
    setup::CaseSpec<1> spec{};
    spec.method    = find_preset("mpm")->spec;
    spec.size      = {1.0};
    spec.spacing   = {0.1};
    spec.materials = {elastic_material(find_law("neo-hookean"), 1.0, 1.0, 0.0)};
    spec.bodies    = {{.shape = Bounds<1>{{0.3}, {0.6}}, .velocity = {Field(0.01)}}};
    spec.time      = {.end = end, .dt = dt};
    return spec;
}

/// Writes down what it is told.
struct Log : Observer<1> {
    std::string text;
    void started(Simulation<1>&) override { text += "started "; }
    void before_step(Simulation<1>& sim, const StepSize&) override { text += std::to_string(sim.state().n) + "<"; }
    void after_step(Simulation<1>& sim, const StepSize& step) override
    {
        text += std::to_string(sim.state().n) + (step.is_cut ? "cut " : " ");
    }
    void failed(Simulation<1>&, const NumericalError&) override { text += "failed "; }
    void ending(Simulation<1>&) override { text += "ending "; }
    void ended(Simulation<1>&) override { text += "ended"; }
};

TEST(Simulation, TellsObserversInOrder)
{
    Simulation<1> sim(setup::build(bar(0.025, 0.01)));
    Log log;
    sim.add(log);
    sim.run();
    EXPECT_EQ(log.text, "started 0<1 1<2 2<3cut ending ended");
    EXPECT_EQ(sim.state().t, 0.025);
    EXPECT_TRUE(sim.is_complete());
    EXPECT_TRUE(sim.is_cut());
}

TEST(Simulation, TakesWholeStepsToTheEnd)
{
    Simulation<1> sim(setup::build(bar(0.1, 0.001)));
    sim.run();
    EXPECT_EQ(sim.state().n, 100);
    EXPECT_FALSE(sim.is_cut());
}

TEST(Simulation, StopsAndGoesOn)
{
    Simulation<1> sim(setup::build(bar(0.04, 0.01)));
    Log log;
    sim.add(log);
    sim.advance(0.02);
    sim.advance(0.02);
    sim.step();
    EXPECT_EQ(log.text, "started 0<1 1<2 2<3 ");
    sim.run([] { return true; });
    EXPECT_EQ(sim.state().n, 3);
    EXPECT_FALSE(sim.is_complete());
}

/// In pieces that are whole steps it is the same bit for bit, and the same as the bare scheme.
TEST(Simulation, IsTheSchemeItSteps)
{
    const setup::Built<1> built = setup::build(bar(0.1, 0.01));
    const Explicit<1> scheme(built.model);
    State<1> s = scheme.start(setup::build(bar(0.1, 0.01)).particles);
    for (int k = 0; k < 10; ++k) scheme.step(s, 0.01);
    Simulation<1> sim(setup::build(bar(0.1, 0.01)));
    sim.advance(0.03);
    sim.advance(0.07);
    sim.run();
    for (int i = 0; i < s.particles.count; ++i) {
        EXPECT_EQ(sim.state().particles.x[i], s.particles.x[i]);
        EXPECT_EQ(sim.state().particles.v[i], s.particles.v[i]);
    }
}

TEST(Simulation, TellsOfFailures)
{
    setup::CaseSpec<1> spec    = bar(10.0, 0.01);  // longer than the way to the end of the grid
    spec.bodies[0].velocity[0] = Field(1.0);
    Simulation<1> sim(setup::build(spec));
    Log log;
    sim.add(log);
    EXPECT_THROW(sim.run(), NumericalError);
    EXPECT_TRUE(log.text.ends_with("<failed ")) << log.text;
}

TEST(Simulation, WatchesWhatASetUpStarts)
{
    std::vector<std::string> warnings;
    setup::CaseSpec<1> spec = bar(0.1, 0.07);
    spec.gravity            = {500.0};
    spec.boundaries         = {{.type = setup::FaceType::periodic}};
    Simulation<1> sim(setup::build(spec), {}, [&](const std::string& text) { warnings.push_back(text); });
    sim.state().particles.v[0][0] = 3.0;
    EXPECT_THROW(sim.advance(5.0), NumericalError);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("above the limit"), std::string::npos);
}

}  // namespace
}  // namespace ordo
