// The exact solutions of contact-ring and contact-bars against closed forms, differences and balances.
#include "verification/bar_waves.hpp"
#include "verification/pressed_rings.hpp"

#include <gtest/gtest.h>

namespace ordo::verification {
namespace {

/// Contact pressures over the pressure inside, of an independent program.
TEST(PressedRings, HaveThePressureOfLame)
{
    EXPECT_NEAR(PressedRings::of(1).contact_pressure(1), 0.2612, 5e-5);
    EXPECT_NEAR(PressedRings::of(10).contact_pressure(1), 0.6131, 5e-5);
    // Of one material the pressure is that in a single ring.
    const ElasticRing whole{0.4, 0.85, 1.0, 0.3, 1.0};
    EXPECT_NEAR(PressedRings::of(1).contact_pressure(1), -whole.stresses(0.6137, {1.0, 0.0}).radial, 1e-14);
}

/// Radial balance (r s_r)' - s_t + rho w^2 r^2 = 0, Hooke's law for u', the loads on the rims, and one place for both surfaces.
TEST(PressedRings, AreInBalance)
{
    const PressedRings rings = PressedRings::of(10);
    constexpr double inside = 0.7, d = 1e-5;
    const std::array<double, 2> speeds{0.3, -0.2};
    const double b = rings.common_radius(), p = rings.contact_pressure(inside, speeds);
    const ElasticRing::Load loads[] = {{inside, p, speeds[0]}, {p, 0.0, speeds[1]}};
    for (int k = 0; k < 2; ++k) {
        const ElasticRing& ring       = rings.ring[k];
        const ElasticRing::Load& load = loads[k];
        EXPECT_NEAR(ring.stresses(ring.inner, load).radial, -load.inside, 1e-14);
        EXPECT_NEAR(ring.stresses(ring.outer, load).radial, -load.outside, 1e-14);
        for (const double part : {0.1, 0.5, 0.8}) {
            const double r = ring.inner + part * (ring.outer - ring.inner);
            auto force     = [&](double x) { return x * ring.stresses(x, load).radial; };
            const auto s   = ring.stresses(r, load);
            EXPECT_NEAR((force(r + d) - force(r - d)) / (2 * d) - s.hoop + ring.density * load.speed * load.speed * r * r, 0.0,
                        1e-9);
            const double nu = ring.poisson, slope = (ring.displacement(r + d, load) - ring.displacement(r - d, load)) / (2 * d);
            EXPECT_NEAR(slope, (1 + nu) / ring.young * ((1 - nu) * s.radial - nu * s.hoop), 1e-9);
        }
    }
    EXPECT_NEAR(rings.ring[0].displacement(b, loads[0]), rings.ring[1].displacement(b, loads[1]), 1e-14);
}

/// Spins change as by a constant torque, for the turning is slow; angular momentum is kept.
TEST(SpinningRings, Brake)
{
    const PressedRings rings = PressedRings::of(1);
    constexpr double speed = 1e-3, friction = 0.3, inside = 1e-4, end = 2.0;
    SpinningRings spins(rings, friction, speed);
    for (int k = 0; k < 200; ++k) spins.step(0.01 * k, 0.01, [&](double) { return inside; });
    const auto [w0, w1] = spins.speeds();
    const double lost   = end * rings.torque(friction, rings.contact_pressure(inside)) / rings.ring[0].inertia();
    EXPECT_NEAR(speed - w0, lost, 2e-3 * lost);
    EXPECT_GT(speed - w0, lost) << "turning presses the rings together";
    EXPECT_NEAR(rings.ring[0].inertia() * (w0 - speed) + rings.ring[1].inertia() * w1, 0.0, 1e-18);
}

/// Velocity is the rate of displacement and stress its slope; both are continuous at the interface, where only compression acts.
TEST(PulseThroughContact, IsAWave)
{
    constexpr double d = 1e-5;
    for (const double modulus : {1.0, 4.0, 0.25}) {
        const PulseThroughContact wave{{WaveBar{1.0, 1.0}, WaveBar{modulus, 1.0}}, 1.0, -0.5, 0.4};
        for (const double t : {0.2, 0.5, 0.6, 0.7}) {
            for (const double x : {-1.2, -0.6, -0.3, -0.05, 0.02, 0.1, 0.3}) {
                const double rate  = (wave.displacement(x, t + d) - wave.displacement(x, t - d)) / (2 * d);
                const double slope = (wave.displacement(x + d, t) - wave.displacement(x - d, t)) / (2 * d);
                EXPECT_NEAR(wave.velocity(x, t), rate, 1e-8);
                EXPECT_NEAR(wave.stress(x, t), (x > 0 ? modulus : 1.0) * slope, 1e-8);
            }
            EXPECT_NEAR(wave.displacement(1e-13, t), wave.displacement(-1e-13, t), 1e-11);
            EXPECT_NEAR(wave.velocity(1e-13, t), wave.velocity(-1e-13, t), 1e-11);
            EXPECT_NEAR(wave.stress(1e-13, t), -wave.contact_pressure(t), 1e-11);
            EXPECT_NEAR(wave.stress(-1e-13, t), -wave.contact_pressure(t), 1e-11);
            EXPECT_GE(wave.contact_pressure(t), 0.0);
        }
        EXPECT_NEAR(wave.displacement(-0.5, 0.0), 0.0, 1e-17);  // clang++ rounds once less
        EXPECT_EQ(wave.velocity(-0.5, 0.0), 1.0);
    }
}

/// Equal bars swap their velocities; unlike ones keep momentum and energy.
TEST(BarImpact, KeepsMomentumAndEnergy)
{
    const BarImpact equal{{WaveBar{1.0, 1.0}, WaveBar{1.0, 1.0}}, {0.01, -0.02}};
    EXPECT_DOUBLE_EQ(equal.speed_after(0), -0.02);
    EXPECT_DOUBLE_EQ(equal.speed_after(1), 0.01);
    EXPECT_DOUBLE_EQ(equal.pressure(), 0.015);
    const BarImpact unlike{{WaveBar{1.0, 1.0}, WaveBar{4.0, 1.0}}, {0.01, 0.0}};
    double momentum = 0, energy = 0;
    for (int k = 0; k < 2; ++k) {
        const double m = unlike.bar[k].density * unlike.bar[k].speed(), v0 = unlike.speeds[k], v1 = unlike.speed_after(k);
        momentum += m * (v1 - v0);
        energy += m * (v1 * v1 - v0 * v0);
    }
    EXPECT_NEAR(momentum, 0.0, 1e-17);
    EXPECT_NEAR(energy, 0.0, 1e-19);
}

}  // namespace
}  // namespace ordo::verification
