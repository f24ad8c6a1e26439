// Laws with plastic flow: closed forms, and each law against an integration of its rate equations by another method
// (support/rate_equations.hpp).
#include "support/driven.hpp"

#include <gtest/gtest.h>

namespace ordo::test {
namespace {

// ---- von Mises ------------------------------------------------------------------------------------------------------------

double yield_of_j2(const Material& m, double alpha)
{
    const auto& p = m.parameters;
    return p[0] + p[1] * alpha + (p[2] - p[0]) * (1 - std::exp(-p[3] * alpha));
}

RateLawOf rates_of_j2(const Material& m)
{
    const auto stress = hencky_stress(m);
    auto q_of         = [](const Tensor& tau) { return std::sqrt(1.5) * dev_of(tau).norm(); };
    return {.stress = stress,
            .yield  = [=](const RateState& s) { return q_of(stress(s)) - yield_of_j2(m, s.inner[0]); },
            .flow =
                [=](const RateState& s, const Tensor& d) {
                    const auto& p    = m.parameters;
                    const Tensor tau = stress(s), N = 1.5 * dev_of(tau) / q_of(tau);
                    const double slope = p[1] + (p[2] - p[0]) * p[3] * std::exp(-p[3] * s.inner[0]);
                    RateFlow f{.gamma = 2 * m.mu * inner(N, d) / (3 * m.mu + slope), .N = N};
                    f.inner[0] = 1;
                    return f;
                }};
}

TEST(J2, AgreesWithItsRateEquations)
{
    for (const std::vector<std::string>& hardening :
         {std::vector<std::string>{"hardening=60"}, {"hardening=10", "saturation=160", "saturation_rate=6"}, {"hardening=-30"}}) {
        std::vector<std::string> settings{"young=1000", "poisson=0.3", "yield=100"};
        settings.insert(settings.end(), hardening.begin(), hardening.end());
        const Material m   = material_of("j2", settings);
        const Comparison c = compare(
            m, rates_of_j2(m), {}, [](Random& r) { return random_path(r, 0.3); }, 1000, 200);
        EXPECT_LT(c.worst, 1e-6);
        EXPECT_LT(c.worst_work, 1e-5);
        EXPECT_NEAR(c.order, 1, 0.1);
        EXPECT_GT(c.with_events, 150);
    }
}


/// The stress of pure shear of Hencky's elasticity, in any number of steps.
TEST(J2, ElasticShear)
{
    const Material m = material_of("j2", {"young=1000", "poisson=0.3", "yield=1e9"});
    for (const int steps : {1, 7}) {
        Driven<2> point(m);
        const double g = 0.9;
        for (int k = 1; k <= steps; ++k) point.step({{{1, g * k / steps}, {0, 1}}});
        const double shear = 4 * m.mu * std::asinh(g / 2) / std::sqrt(4 + g * g);
        EXPECT_NEAR(point.sigma(0, 1), shear, 1e-12 * m.mu);
        EXPECT_NEAR(point.sigma(0, 0), g * shear / 2, 1e-12 * m.mu);
        EXPECT_NEAR(point.sigma(1, 1), -g * shear / 2, 1e-12 * m.mu);
        EXPECT_NEAR(point.sigma(2, 2), 0, 1e-12 * m.mu);
        EXPECT_EQ(point.column("dissipated"), 0);
    }
}

/// Steady shear without hardening: tau_12 = (Y/sqrt 3)/cosh(2 e), tau_11 = (Y/sqrt 3) tanh(2 e), e = Y/(2 sqrt 3 G), in the limit of
/// small steps.
TEST(J2, SteadyShear)
{
    const Material m = material_of("j2", {"young=1000", "poisson=0.3", "yield=100"});
    const double k = 100 / std::sqrt(3.0), e = k / (2 * m.mu), g = 8;
    auto shear = [&](int steps) {
        Driven<2> point(m);
        for (int n = 1; n <= steps; ++n) point.step({{{1, g * n / steps}, {0, 1}}});
        return point.sigma;
    };
    const Stress<2> coarse = shear(10000), fine = shear(20000), limit = 2.0 * fine + -1.0 * coarse;
    EXPECT_NEAR(limit(0, 1), k / std::cosh(2 * e), 1e-6 * k);
    EXPECT_NEAR(limit(0, 0), k * std::tanh(2 * e), 1e-6 * k);
    EXPECT_NEAR(limit(1, 1), -k * std::tanh(2 * e), 1e-6 * k);
    EXPECT_NEAR((coarse(0, 0) - limit(0, 0)) / (fine(0, 0) - limit(0, 0)), 2, 0.01) << "first order";
}

/// Radial paths are exact in any number of steps: uniaxial strain, and diag(l, 1/l).
template <int D>
void check_j2_radial(int steps, double e)
{
    const Material m = material_of("j2", {"young=1000", "poisson=0.3", "yield=20", "hardening=35"});
    const double G = m.mu, K = m.bulk_modulus(), Y = 20, H = 35;
    Driven<D> point(m);
    for (int k = 1; k <= steps; ++k) {
        Mat<D> F = Mat<D>::identity();
        F(0, 0)  = std::exp(e * k / steps);
        point.step(F);
    }
    const double alpha = (2 * G * std::fabs(e) - Y) / (3 * G + H), sign = e > 0 ? 1 : -1;
    EXPECT_NEAR(point.column("plastic_strain"), alpha, 1e-13);
    EXPECT_NEAR(point.kirchhoff()(0, 0), K * e + sign * 2.0 / 3 * (Y + H * alpha), 1e-11);
    for (int a = 1; a < 3; ++a) EXPECT_NEAR(point.kirchhoff()(a, a), K * e - sign / 3 * (Y + H * alpha), 1e-11);
    if (steps > 1) return;
    EXPECT_NEAR(point.column("dissipated"), (Y + H * alpha) * alpha, 1e-11) << "q lambda of a step";
}
TEST(J2, UniaxialStrain)
{
    for (const double e : {0.3, -0.4})
        for (const int steps : {1, 5}) {
            check_j2_radial<1>(steps, e);
            check_j2_radial<2>(steps, e);
            check_j2_radial<3>(steps, e);
        }
}
TEST(J2, PureShearStretch)
{
    const Material m = material_of("j2", {"young=1000", "poisson=0.3", "yield=20", "hardening=35"});
    Driven<2> point(m);
    const double e = 0.35;
    for (int k = 1; k <= 4; ++k) point.step({{{std::exp(e * k / 4), 0}, {0, std::exp(-e * k / 4)}}});
    EXPECT_NEAR(point.column("plastic_strain"), (2 * std::sqrt(3.0) * m.mu * e - 20) / (3 * m.mu + 35), 1e-13);
}

/// The residual of Voce hardening is solved to rounding, for hardening and softening, also in one huge step.
TEST(J2, VoceIsSolved)
{
    for (const auto& more :
         {std::vector<std::string>{"saturation=200", "saturation_rate=16"}, {"saturation=5", "saturation_rate=3", "hardening=1"}})
        for (const double g : {0.08, 0.5, 40.0}) {
            std::vector<std::string> settings{"young=1000", "poisson=0.3", "yield=50"};
            settings.insert(settings.end(), more.begin(), more.end());
            const Material m = material_of("j2", settings);
            Driven<2> point(m);
            point.step({{{1, g}, {0, 1}}});
            Symmetric<2> s = deviator(point.kirchhoff());
            EXPECT_NEAR(std::sqrt(1.5 * square(s)), yield_of_j2(m, point.column("plastic_strain")), 1e-11) << g;
        }
}

/// Where softening has used up the yield stress, it stays zero.
TEST(J2, SofteningEndsAtZero)
{
    Driven<2> point(material_of("j2", {"young=1000", "poisson=0.3", "yield=10", "hardening=-40"}));
    for (int k = 1; k <= 10; ++k) point.step({{{1, 0.2 * k}, {0, 1}}});
    EXPECT_NEAR(square(deviator(point.kirchhoff())), 0, 1e-20);
    EXPECT_GT(point.column("plastic_strain"), 0.25);
}

}  // namespace
}  // namespace ordo::test
