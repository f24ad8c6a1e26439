// The waves of `plate-impact` against the law itself and against numbers computed elsewhere.
#include "verification/impact.hpp"
#include "material/laws.hpp"

#include <gtest/gtest.h>

namespace ordo::verification {
namespace {

/// Stress of j2 in uniaxial strain, one step at a time.
TEST(PlateImpact, StressIsThatOfTheLaw)
{
    const JumpOfJ2 jump{};
    Material m{find_law("j2"), jump.density, jump.bulk - 2.0 / 3 * jump.shear, jump.shear, {}};
    m.parameters[0] = m.parameters[2] = jump.yield;
    double history[Material::most_history]{}, fault = 0, F = 1;
    m.law->in<1>().start(m, Mat<1>{{{1.0}}}, history);
    for (const double next : {0.999, 0.998, 0.995, 0.99}) {
        const Step<1> step{{{{next}}}, {{{next / F - 1}}}, 1e-6};
        const Stress<1> sigma = m.law->in<1>().update(m, step, {}, history, fault);
        EXPECT_NEAR(sigma(0, 0), jump.stress(next), 1e-12 * jump.bulk) << next;
        F = next;
    }
    EXPECT_EQ(fault, 0);
}

/// Speeds of small strain, sqrt((K + 4G/3)/rho) and sqrt(K/rho), and stresses with them; finite strain adds 0.6 %. Stress and
/// momentum balance at each front.
TEST(PlateImpact, WavesOfSteel)
{
    const JumpOfJ2 jump{};
    const std::vector<WaveFront> fronts = jump.fronts(40.0);
    ASSERT_EQ(fronts.size(), 2u);
    EXPECT_NEAR(fronts[1].speed, 5875.10, 0.006 * 5875.10);
    EXPECT_NEAR(fronts[0].speed, 4622.50, 0.01 * 4622.50);
    EXPECT_NEAR(fronts[1].stress, -7.0e8, 0.003 * 7.0e8);
    EXPECT_NEAR(fronts[0].stress, -1.59146e9 * 1.0058, 1e-4 * 1.59146e9);
    EXPECT_NEAR(fronts[0].velocity, 0.0, 1e-9);
    EXPECT_NEAR(-fronts[1].stress, jump.density * fronts[1].speed * (fronts[1].velocity + 40), 1e-3);
    EXPECT_NEAR(fronts[1].stress - fronts[0].stress, jump.density * fronts[0].speed * (0 - fronts[1].velocity), 1e-3);

    const std::vector<WaveFront> slow = JumpOfJ2{}.fronts(1e-3);
    ASSERT_EQ(slow.size(), 1u) << "a push that does not yield";
    EXPECT_NEAR(slow[0].speed, 5875.10, 0.01);
}

/// Rankine-Hugoniot states of copper, of an independent program.
TEST(PlateImpact, HugoniotOfCopper)
{
    const double rows[][4] = {{50, 4014.45, 1.792451925e9, 0.9875449937},
                              {500, 4684.5, 2.09162925e10, 0.8932650229},
                              {1000, 5429.0, 4.848097e10, 0.8158040155}};
    for (const auto& [speed, shock, pressure, J] : rows) {
        const WaveFront f = Hugoniot{}.fronts(speed)[0];
        EXPECT_NEAR(f.speed, shock, 1e-9 * shock);
        EXPECT_NEAR(-f.stress, pressure, 1e-9 * pressure);
        EXPECT_NEAR(f.F, J, 1e-10);
    }
}

/// Position is continuous, velocity its rate, F its slope, on both sides of each front.
TEST(PlateImpact, PositionsFollowFromTheFronts)
{
    const SteppedWave wave(JumpOfJ2{}.fronts(40.0), 40.0);
    const double t = 1e-4, e = 1e-7;
    for (const double X : {0.0, 0.2, 0.45, 0.4661, 0.4667, 0.5, 0.585, 0.59, 0.9}) {
        const double x = wave.position({X}, t)[0];
        EXPECT_NEAR((wave.position({X + e}, t)[0] - x) / e, wave.deformation({X}, t)(0, 0), 1e-7) << X;
        EXPECT_NEAR((wave.position({X}, t + 1e-10)[0] - x) / 1e-10, wave.velocity({X}, t)[0], 1e-4) << X;
    }
    for (const WaveFront& f : wave.fronts())
        EXPECT_NEAR(wave.position({f.speed * t + 1e-12}, t)[0], wave.position({f.speed * t - 1e-12}, t)[0], 1e-11);
    EXPECT_NEAR(wave.position({0.0}, t)[0], 0.0, 1e-15);
}

}  // namespace
}  // namespace ordo::verification
