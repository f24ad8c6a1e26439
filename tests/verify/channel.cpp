// The series of `couette` and `poiseuille` against numbers computed elsewhere, and against their differential equation.
#include "verification/channel.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace ordo::verification {
namespace {

/// The velocity in the middle, of an independent program (finite differences).
TEST(Channel, VelocityInTheMiddle)
{
    const std::pair<double, double> couette[]    = {{0.02, 0.012419}, {0.05, 0.113844}, {0.1, 0.262756}, {0.2, 0.411566}},
                                    poiseuille[] = {{0.02, 0.019904}, {0.05, 0.046298}, {0.1, 0.076919}, {0.2, 0.107080}};
    for (const auto& [t, u] : couette) EXPECT_NEAR((StartingCouette{1.0, 1.0}(0.5, t).velocity), u, 2e-6) << t;
    for (const auto& [t, u] : poiseuille) EXPECT_NEAR((StartingPoiseuille{1.0, 1.0}(0.5, t).velocity), u, 2e-6) << t;
    EXPECT_NEAR((StartingCouette{3.0, 0.5}(0.5, 0.2).velocity), 3 * 0.262756, 1e-5) << "nu t counts";
    EXPECT_NEAR((StartingPoiseuille{3.0, 0.5}(0.5, 0.2).velocity), 3 / 0.5 * 0.076919, 1e-5);
}

/// du/dt = nu d2u/dy2 + f; shear rate, displacement and shear are derivatives and integrals of the velocity.
template <class Profile>
void check_flow(const Profile& flow, double force, double upper)
{
    const double e = 1e-4;
    for (const double t : {0.01, 0.1, 0.7}) {
        for (const double y : {0.2, 0.5, 0.9}) {
            auto at           = [&](double dy, double dt) { return flow(y + dy, t + dt); };
            const double u    = at(0, 0).velocity;
            const double u_t  = (at(0, e).velocity - at(0, -e).velocity) / (2 * e);
            const double bend = (at(e, 0).velocity - 2 * u + at(-e, 0).velocity) / (e * e);
            EXPECT_NEAR(u_t, flow.nu * bend + force, 2e-4 * (1 + std::fabs(u_t))) << y << ' ' << t;
            EXPECT_NEAR(at(0, 0).shear_rate, (at(e, 0).velocity - at(-e, 0).velocity) / (2 * e), 1e-5);
            EXPECT_NEAR(u, (at(0, e).displacement - at(0, -e).displacement) / (2 * e), 1e-5);
            EXPECT_NEAR(at(0, 0).shear, (at(e, 0).displacement - at(-e, 0).displacement) / (2 * e), 1e-5);
        }
        EXPECT_NEAR(flow(0.0, t).velocity, 0.0, 1e-13);
        EXPECT_NEAR(flow(1.0, t).velocity, upper, 1e-13);
    }
    EXPECT_EQ(flow(0.3, 0.0).displacement, 0.0);
    EXPECT_NEAR(flow(0.3, 1e-5).displacement, force * 0.5e-10, 1e-12) << "from rest";
}
TEST(Channel, SolvesItsEquation)
{
    check_flow(StartingCouette{2.0, 0.5}, 0.0, 2.0);
    check_flow(StartingPoiseuille{2.0, 0.5}, 2.0, 0.0);
}

/// I and the velocity at the surface, of an independent program; mu(I) = tan(slope) everywhere with the shear rate of the profile.
TEST(PlaneOfGrains, IsInBalance)
{
    const PlaneOfGrains plane{};
    EXPECT_NEAR(plane.inertial_number(), 0.13299, 1e-5);
    EXPECT_NEAR(plane.steady_velocity(plane.depth), 1.295079, 1e-6);
    EXPECT_EQ(plane.steady_velocity(0.0), 0.0);
    for (const double y : {0.01, 0.05, 0.09}) {
        const double rate = (plane.steady_velocity(y + 1e-6) - plane.steady_velocity(y - 1e-6)) / 2e-6;
        const double I    = rate * plane.grain * std::sqrt(plane.grain_density / plane.pressure(y));
        const double mu   = plane.slow + (plane.fast - plane.slow) / (plane.I0 / I + 1);
        EXPECT_NEAR(mu, std::tan(plane.slope), 1e-7) << y;
    }
    EXPECT_EQ(PlaneOfGrains{.slope = 0.3}.steady_velocity(0.1), 0.0) << "below arctan mu_s";
}

}  // namespace
}  // namespace ordo::verification
