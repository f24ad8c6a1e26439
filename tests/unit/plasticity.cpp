// Laws with plastic flow: closed forms, and each law against an integration of its rate equations by another method
// (support/rate_equations.hpp).
#include "material/drucker_prager.hpp"
#include "material/johnson_cook.hpp"
#include "material/mohr_coulomb.hpp"
#include "support/driven.hpp"

#include <gtest/gtest.h>

#include <map>
#include <tuple>

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
    int paths = 200;
    for (const std::vector<std::string>& hardening :
         {std::vector<std::string>{"hardening=60"}, {"hardening=10", "saturation=160", "saturation_rate=6"}, {"hardening=-30"}}) {
        std::vector<std::string> settings{"young=1000", "poisson=0.3", "yield=100"};
        settings.insert(settings.end(), hardening.begin(), hardening.end());
        const Material m   = material_of("j2", settings);
        const Comparison c = compare(
            m, rates_of_j2(m), {}, [](Random& r) { return random_path(r, 0.3); }, 1000, 200, 1.0, paths);
        EXPECT_LT(c.worst, 1e-6);
        EXPECT_LT(c.worst_work, 1e-5);
        EXPECT_NEAR(c.order, 1, 0.1);
        EXPECT_GT(c.with_events, 0.75 * paths);
        paths = 50;  // of the next settings
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

/// Steady shear without hardening: tau_12 = (Y/sqrt 3)/cosh(2 e), tau_11 = (Y/sqrt 3) tanh(2 e), e = Y/(2 sqrt 3 G), in the limit
/// of small steps.
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

// ---- Drucker-Prager -------------------------------------------------------------------------------------------------------

RateLawOf rates_of_drucker_prager(const Material& m)
{
    using P          = DruckerPrager;
    const auto& p    = m.parameters;
    const double eta = p[P::kEta], eta_flow = p[P::kEtaFlow], xi = p[P::kXi], c0 = p[P::kCohesion], H = p[P::kHardening];
    const double K = m.bulk_modulus(), G = m.mu;
    const auto stress = hencky_stress(m);
    auto root_J2      = [](const Tensor& tau) { return dev_of(tau).norm() / std::sqrt(2.0); };
    return {.stress = stress,
            .yield =
                [=](const RateState& s) {
                    const Tensor tau = stress(s);
                    return root_J2(tau) + eta * tau.trace() / 3 - xi * (c0 + H * s.inner[0]);
                },
            .flow =
                [=](const RateState& s, const Tensor& d) {
                    const Tensor tau = stress(s), along = dev_of(tau) / (2 * root_J2(tau));
                    RateFlow f{.gamma = (2 * G * inner(along, d) + K * eta * d.trace()) / (G + K * eta * eta_flow + xi * xi * H),
                               .N     = along + eta_flow / 3 * Tensor::Identity()};
                    f.inner[0] = xi;
                    return f;
                }};
}

/// On the cone: paths that compress, so that none reaches the apex.
TEST(DruckerPrager, AgreesWithItsRateEquations)
{
    int paths = 200;
    for (const auto& more : {std::vector<std::string>{"friction_angle=30", "dilation_angle=10", "cohesion=30", "hardening=40"},
                             {"friction_angle=25", "dilation_angle=25", "cohesion=50", "fit=inner"},
                             {"eta=0.4", "eta_flow=0", "xi=1.1", "cohesion=50", "hardening=-20"}}) {
        std::vector<std::string> settings{"young=1000", "poisson=0.25"};
        settings.insert(settings.end(), more.begin(), more.end());
        const Material m   = material_of("drucker-prager", settings);
        const Comparison c = compare(
            m, rates_of_drucker_prager(m), {}, [](Random& r) { return random_path(r, 0.3, 0.1, 0.04); }, 1000, 200, 1.0, paths);
        EXPECT_LT(c.worst, 1e-6);
        EXPECT_LT(c.worst_work, 1e-5);
        EXPECT_NEAR(c.order, 1, 0.1);
        EXPECT_GT(c.with_events, 0.75 * paths);
        paths = 50;  // of the next settings
    }
}

/// Uniaxial compression: yields at e_y = xi c/(2G/sqrt 3 - eta K), then lambda grows linearly, in any number of steps.
TEST(DruckerPrager, Oedometer)
{
    const Material m = material_of(
        "drucker-prager", {"young=1000", "poisson=0.2", "eta=0.3", "eta_flow=0.1", "xi=1.2", "cohesion=10", "hardening=15"});
    const double G = m.mu, K = m.bulk_modulus(), eta = 0.3, eta_flow = 0.1, xi = 1.2, c = 10, H = 15, e = 0.2;
    const double e_y    = xi * c / (2 * G / std::sqrt(3.0) - eta * K);
    const double lambda = (2 * G / std::sqrt(3.0) - eta * K) * (e - e_y) / (G + K * eta * eta_flow + xi * xi * H);
    ASSERT_GT(lambda, 0);
    for (const int steps : {1, 6}) {
        Driven<3> point(m);
        for (int k = 1; k <= steps; ++k) point.step({{{std::exp(-e * k / steps), 0, 0}, {0, 1, 0}, {0, 0, 1}}});
        EXPECT_NEAR(point.column("plastic_strain"), xi * lambda, 1e-13);
        const double P = K * (-e - eta_flow * lambda), root_J2 = 2 * G / std::sqrt(3.0) * e - G * lambda;
        EXPECT_NEAR(point.kirchhoff()(0, 0), P - 2 / std::sqrt(3.0) * root_J2, 1e-11);
        EXPECT_NEAR(point.kirchhoff()(2, 2), P + 1 / std::sqrt(3.0) * root_J2, 1e-11);
        EXPECT_NEAR(root_J2 + eta * P, xi * (c + H * xi * lambda), 1e-11);
    }
}

/// Extension goes to the apex: P = xi c/eta, alpha = (xi/eta_flow) of the plastic volume strain. With shear it does too.
TEST(DruckerPrager, Apex)
{
    const Material m =
        material_of("drucker-prager", {"young=1000", "poisson=0.2", "eta=0.3", "eta_flow=0.1", "xi=1.2", "cohesion=10"});
    const double K = m.bulk_modulus(), J = 1.331;
    for (const double shear : {0.0, 0.02}) {
        Driven<3> point(m);
        point.step({{{1.1, shear, 0}, {0, 1.1, 0}, {0, 0, 1.1}}});
        const Symmetric<3> tau = point.kirchhoff();
        EXPECT_NEAR(trace(tau) / 3, 1.2 * 10 / 0.3, 1e-11);
        EXPECT_NEAR(square(deviator(tau)), 0, 1e-20);
        EXPECT_NEAR(point.column("plastic_strain"), 1.2 / 0.1 * (std::log(J) - 1.2 * 10 / (0.3 * K)), 1e-12);
        EXPECT_NEAR(point.column("dissipated"), 1.2 * 10 / 0.3 * (std::log(J) - 1.2 * 10 / (0.3 * K)), 1e-11);
    }
    // With hardening the apex moves: K (theta - v) = xi/eta (c + H xi/eta_flow v).
    const Material hard = material_of(
        "drucker-prager", {"young=1000", "poisson=0.2", "eta=0.3", "eta_flow=0.1", "xi=1.2", "cohesion=10", "hardening=3"});
    Driven<3> point(hard);
    point.step({{{1.1, 0, 0}, {0, 1.1, 0}, {0, 0, 1.1}}});
    EXPECT_NEAR(trace(point.kirchhoff()) / 3, 1.2 / 0.3 * (10 + 3 * point.column("plastic_strain")), 1e-11);
    EXPECT_NEAR(trace(point.kirchhoff()) / 3, K * (std::log(J) - 0.1 / 1.2 * point.column("plastic_strain")), 1e-11);
}

/// Without dilation the apex caps the pressure; alpha grows there as at the end of the cone.
TEST(DruckerPrager, ApexWithoutDilation)
{
    const Material m =
        material_of("drucker-prager", {"young=1000", "poisson=0.2", "friction_angle=30", "dilation_angle=0", "cohesion=0"});
    Driven<2> point(m);
    point.step({{{1.01, 0.02}, {0, 1.01}}});
    EXPECT_NEAR(square(point.sigma), 0, 1e-20);
    const HenckyStrain<2> e = hencky_strain(left_cauchy_green(point.F));
    EXPECT_NEAR(point.column("plastic_strain"), m.parameters[DruckerPrager::kXi] * std::sqrt(2 * square(e.dev)), 1e-14);
    EXPECT_NEAR(point.column("dissipated"), 0, 1e-15);
}

/// A step of pure strain with this volume and this norm of the deviator, after plastic strain alpha.
Driven<3> strained(const Material& m, double norm, double theta, double alpha)
{
    Driven<3> point(m);
    point.set_column("plastic_strain", alpha);
    const double e = norm / std::sqrt(2.0), volume = theta / 3;
    point.step({{{std::exp(volume + e), 0, 0}, {0, std::exp(volume - e), 0}, {0, 0, std::exp(volume)}}});
    return point;
}

/// The cone ends in the apex: from elastic states to the apex, stress and alpha change no faster with the volume than they do
/// anywhere, and nothing creates energy. Without dilation the two meet only if alpha grows alike.
TEST(DruckerPrager, ConeMeetsApex)
{
    Random random(17);
    for (const double eta_flow : {0.0, 0.2})
        for (const double H : {-250.0, -20.0, 0.0, 40.0, 150.0}) {
            if (eta_flow > 0 && H < -40) continue;
            const Material m =
                material_of("drucker-prager", {"young=1000", "poisson=0.25", "eta=0.4", "eta_flow=" + std::to_string(eta_flow),
                                               "xi=1.1", "cohesion=50", "hardening=" + std::to_string(H)});
            for (int n = 0; n < 20; ++n) {
                const double norm = uniform(random, 0, 0.6), alpha = n % 2 ? uniform(random, 0, 0.3) : 0.0;
                constexpr double part = 5e-4;
                Driven<3> before      = strained(m, norm, -0.3, alpha);
                bool has_met_apex     = false;
                for (int k = 1; k <= 3200; ++k) {
                    const Driven<3> now = strained(m, norm, -0.3 + k * part, alpha);
                    const double slope  = part * 6 * m.p_wave_modulus();
                    ASSERT_GE(now.column("dissipated"), -1e-12);
                    ASSERT_NEAR(trace(now.kirchhoff()) / 3, trace(before.kirchhoff()) / 3, slope);
                    ASSERT_NEAR(std::sqrt(square(deviator(now.kirchhoff()))), std::sqrt(square(deviator(before.kirchhoff()))),
                                slope);
                    ASSERT_NEAR(now.column("plastic_strain"), before.column("plastic_strain"), 15 * part);
                    has_met_apex = has_met_apex || square(deviator(now.kirchhoff())) < 1e-20;
                    before       = now;
                }
                EXPECT_TRUE(has_met_apex);
            }
        }
    // With sqrt(2/3) |dev eps^p| this state ended at P = 112.80 with dissipated = -3.520.
    const Material m = material_of(
        "drucker-prager", {"young=1000", "poisson=0.25", "eta=0.4", "eta_flow=0", "xi=1.1", "cohesion=50", "hardening=-20"});
    const Driven<3> point = strained(m, 0.55, 92 / m.bulk_modulus(), 0);
    EXPECT_NEAR(trace(point.kirchhoff()) / 3, 1.1 / 0.4 * (50 - 20 * 1.1 * std::sqrt(2.0) * 0.55), 1e-10);
    EXPECT_GT(point.column("dissipated"), 0);
}

/// How far principal stresses are beyond the strength of Mohr-Coulomb, Pa.
double beyond_mohr_coulomb(const Symmetric<3>& tau, double friction, double cohesion)
{
    const auto [low, high] = std::minmax({tau(0, 0), tau(1, 1), tau(2, 2)});
    return high - low + (high + low) * std::sin(friction) - 2 * cohesion * std::cos(friction);
}

/// Flow on the cones of 30 degrees: the outer one meets the Mohr-Coulomb strength in triaxial compression, the inner one in
/// extension; that of plane strain where associated flow in plane strain has become steady.
TEST(DruckerPrager, Fits)
{
    const double friction = std::acos(-1.0) / 6;
    auto cone             = [](const char* fit, const char* dilation) {
        return material_of("drucker-prager",
                                       {"young=1000", "poisson=0.2", "friction_angle=30", std::string("dilation_angle=") + dilation,
                            "cohesion=7", std::string("fit=") + fit});
    };
    auto sheared = [&](const char* fit, double axial) {  // from a pressure of 50, at constant volume
        const Material m = cone(fit, "0");
        Driven<3> point(m);
        const double start = -50 / m.bulk_modulus() / 3;
        for (int k = 0; k <= 5; ++k) {
            const double e = axial * k / 5;
            point.step({{{std::exp(start + e), 0, 0}, {0, std::exp(start - e / 2), 0}, {0, 0, std::exp(start - e / 2)}}});
        }
        EXPECT_GT(point.column("plastic_strain"), 0);
        EXPECT_NEAR(trace(point.kirchhoff()) / 3, -50, 1e-10);
        return beyond_mohr_coulomb(point.kirchhoff(), friction, 7);
    };
    EXPECT_NEAR(sheared("outer", -0.2), 0, 1e-10);
    EXPECT_GT(sheared("outer", 0.2), 5);
    EXPECT_NEAR(sheared("inner", 0.2), 0, 1e-10);
    EXPECT_LT(sheared("inner", -0.2), -5);

    Driven<3> plane(
        cone("plane-strain", "30"));  // steady: strains of volume and shear as Mohr-Coulomb's flow, e1 + e2 = e1 - e2 over 2
    const double start = -50 / plane.material.bulk_modulus() / 3;
    for (int k = 0; k <= 400; ++k) {
        const double t = 0.0025 * k;
        plane.step({{{std::exp(start + 1.5 * t), 0, 0}, {0, std::exp(start - 0.5 * t), 0}, {0, 0, std::exp(start)}}});
    }
    EXPECT_LT(trace(plane.kirchhoff()), 0);
    EXPECT_NEAR(beyond_mohr_coulomb(plane.kirchhoff(), friction, 7), 0, 1e-8);
}

/// Sand that was pulled apart carries no pressure before its gap has closed; without the correction it does.
TEST(DruckerPrager, VolumeCorrection)
{
    for (const bool corrects : {true, false}) {
        const Material m =
            material_of("drucker-prager", {"young=1000", "poisson=0.2", "friction_angle=30", "dilation_angle=0", "cohesion=0",
                                           std::string("volume_correction=") + (corrects ? "true" : "false")});
        Driven<2> point(m);
        auto at = [&](double J) { return point.step({{{std::sqrt(J), 0}, {0, std::sqrt(J)}}}); };
        at(1.1);
        at(1.2);
        EXPECT_EQ(square(point.sigma), 0);
        EXPECT_NEAR(point.column("gap"), corrects ? std::log(1.2) : 0, 1e-15);
        const double half = trace(at(1.1)) / 3 * 1.1;
        EXPECT_NEAR(half, corrects ? 0 : m.bulk_modulus() * std::log(1.1 / 1.2), 1e-10);
        const double closed = trace(at(0.98)) / 3 * 0.98;
        EXPECT_NEAR(closed, m.bulk_modulus() * std::log(0.98 / (corrects ? 1.0 : 1.2)), 1e-10);
        EXPECT_NEAR(point.column("gap"), 0, 1e-15);
    }
}

// ---- Mohr-Coulomb ---------------------------------------------------------------------------------------------------------

/// The rate equations of planes: multipliers gamma >= 0 of all planes such that each plane's yield function f falls at least as
/// -f/(3 h), where h is the step, and does so exactly where its multiplier is positive (a linear complementarity problem, by
/// projected Gauss-Seidel sweeps). f reaches zero smoothly, so the events of edges, corners and unloading need no search; first
/// order in h.
class PlaneFlow {
  public:
    PlaneFlow(const Material& m, double h) : K_(m.bulk_modulus()), G_(m.mu), h_(h), p_(m.parameters.begin(), m.parameters.end())
    {}

    RateState integrate(const SmoothPath& path) const
    {
        RateState s;
        const int steps = static_cast<int>(std::lround(1 / h_));
        for (int k = 0; k < steps; ++k) {  // Heun's method
            const double t     = k * h_;
            const RateState k1 = rate(s, path, t), k2 = rate(s + k1 * h_, path, t + h_);
            s = s + (k1 + k2) * (h_ / 2);
        }
        return s;
    }
    Tensor stress(const RateState& s) const
    {
        const Tensor e = log_of(s.b) / 2;
        return K_ * e.trace() * Tensor::Identity() + 2 * G_ * dev_of(e);
    }

  private:
    using P = MohrCoulomb;
    double soften(double start, double end, double alpha) const
    {
        return std::isfinite(p_[P::kSoftening]) ? end + (start - end) * std::exp(-alpha / p_[P::kSoftening]) : start;
    }
    RateState rate(const RateState& s, const SmoothPath& path, double t) const
    {
        const Tensor l = path.rate(t) * path.F(t).inverse(), d = (l + l.transpose()) / 2;
        // Where two principal stresses are equal, the axes are those of the strain rate: with arbitrary ones flow would zigzag.
        const Eigen::SelfAdjointEigenSolver<Tensor> axes(stress(s) + 2 * G_ * h_ * d);
        const Eigen::Vector3d tau = (axes.eigenvectors().transpose() * stress(s) * axes.eigenvectors()).diagonal();
        const double degree       = std::acos(-1.0) / 180,
                     phi          = degree * soften(p_[P::kFriction], p_[P::kResidualFriction], s.inner[0]);
        const double psi          = degree * soften(p_[P::kDilation], p_[P::kResidualDilation], s.inner[0]);
        const double c            = soften(p_[P::kCohesion], p_[P::kResidualCohesion], s.inner[0]),
                     T            = std::min(p_[P::kTension], c / std::tan(phi));
        std::vector<Eigen::Vector3d> M, N;
        std::vector<double> f;
        auto add = [&](const Eigen::Vector3d& normal, const Eigen::Vector3d& flow, double at) {
            M.push_back(normal);
            N.push_back(flow);
            f.push_back(normal.dot(tau) - at);
        };
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
            if (std::isfinite(p_[P::kTension])) add(e, e, T);
            for (int j = 0; j < 3; ++j)
                if (i != j) {
                    const Eigen::Vector3d o = Eigen::Vector3d::Unit(j);
                    add(e - o + std::sin(phi) * (e + o), e - o + std::sin(psi) * (e + o), 2 * c * std::cos(phi));
                }
        }
        auto stiff = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
            return 2 * G_ * v + (K_ - 2 * G_ / 3) * v.sum() * Eigen::Vector3d::Ones();
        };
        const Tensor in_axes      = axes.eigenvectors().transpose() * d * axes.eigenvectors();
        const Eigen::Vector3d own = in_axes.diagonal();
        Eigen::Vector3d flow      = Eigen::Vector3d::Zero();
        std::vector<double> gamma(f.size());
        for (int sweep = 0; sweep < 400; ++sweep) {
            double change = 0;
            for (std::size_t k = 0; k < f.size(); ++k) {
                const double wanted = M[k].dot(stiff(own - flow)) + f[k] / (3 * h_);
                const double next   = std::max(0.0, gamma[k] + wanted / M[k].dot(stiff(N[k])));
                flow += (next - gamma[k]) * N[k];
                change   = std::max(change, std::fabs(next - gamma[k]));
                gamma[k] = next;
            }
            if (change < 1e-10) break;
        }
        const Tensor plastic = axes.eigenvectors() * flow.asDiagonal() * axes.eigenvectors().transpose();
        RateState r{l * s.b + s.b * l.transpose() - plastic * s.b - s.b * plastic};
        r.inner[0]   = std::sqrt(2.0 / 3) * dev_of(plastic).norm();
        r.dissipated = inner(stress(s), plastic);
        return r;
    }

    double K_, G_, h_;
    std::vector<double> p_;
};

TEST(MohrCoulomb, AgreesWithItsRateEquations)
{
    int paths = 200, n = 500;
    for (const auto& more : {std::vector<std::string>{"friction_angle=30", "dilation_angle=30", "cohesion=40"},
                             {"friction_angle=30", "dilation_angle=0", "cohesion=40", "tension_cutoff=10", "residual_cohesion=20",
                              "residual_friction_angle=20", "softening_strain=0.2"}}) {
        std::vector<std::string> settings{"young=1000", "poisson=0.25"};
        settings.insert(settings.end(), more.begin(), more.end());
        const Material m = material_of("mohr-coulomb", settings);
        Random random(31);
        double worst = 0, order = 0;
        int flows = 0, counted = 0;
        for (int k = 0; k < paths; ++k) {
            const SmoothPath path = random_path(random, 0.3, 0.3, 0.04);
            const PlaneFlow coarse(m, 1.0 / n), fine(m, 0.5 / n);
            const Tensor limit = 2 * fine.stress(fine.integrate(path)) - coarse.stress(coarse.integrate(path));
            const Mat<3> tau   = to_mat(limit);
            Symmetric<3> wanted{};
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j) wanted(i, j) = tau(i, j);
            const PathEnd quarter = drive(m, path, n / 2), one = drive(m, path, n), two = drive(m, path, 2 * n);
            worst = std::max(worst, distance(2.0 * two.tau + -1.0 * one.tau, wanted) / two.largest);
            flows += two.dissipated > 0;
            const double first = distance(quarter.tau, one.tau), second = distance(one.tau, two.tau);
            if (first > 1e-6 * two.largest) order += std::log2(first / second), ++counted;
        }
        std::printf("          largest error %.2g of the stress, mean order %.3f, %d of %d paths with plastic flow\n", worst,
                    order / std::max(counted, 1), flows, paths);
        EXPECT_LT(worst, 5e-4);
        EXPECT_NEAR(order / counted, 1, 0.1);
        EXPECT_GT(flows, 0.75 * paths);
        paths = 50;
        n     = 1000;
    }
}

/// The planes of a pyramid in all orders of the principal stresses, as (normal, flow, at).
std::vector<std::tuple<Eigen::Vector3d, Eigen::Vector3d, double>> planes_of(const MohrCoulombPyramid& p)
{
    std::vector<std::tuple<Eigen::Vector3d, Eigen::Vector3d, double>> r;
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d e = Eigen::Vector3d::Unit(i);
        if (std::isfinite(p.tension)) r.emplace_back(e, e, p.tension);
        for (int j = 0; j < 3; ++j) {
            const Eigen::Vector3d o = Eigen::Vector3d::Unit(j);
            if (i != j) r.emplace_back(e - o + p.sin_phi * (e + o), e - o + p.sin_psi * (e + o), p.rhs);
        }
    }
    return r;
}

/// How far v is from the cone of the flows of the planes on which tau lies (projected Gauss-Seidel sweeps).
double distance_to_cone(const MohrCoulombPyramid& p, const Eigen::Vector3d& tau, const Eigen::Vector3d& v)
{
    std::vector<Eigen::Vector3d> flows;
    for (const auto& [normal, flow, at] : planes_of(p))
        if (normal.dot(tau) > at - 1e-8 * (1 + p.rhs)) flows.push_back(flow);
    Eigen::Vector3d rest = v;
    std::vector<double> gamma(flows.size());
    for (int sweep = 0; sweep < 3000; ++sweep)
        for (std::size_t k = 0; k < flows.size(); ++k) {
            const double next = std::max(0.0, gamma[k] + flows[k].dot(rest) / flows[k].squaredNorm());
            rest -= (next - gamma[k]) * flows[k];
            gamma[k] = next;
        }
    return rest.norm();
}

/// Random trial stresses: the return is inside all planes, and the plastic strain is in the cone of the flows of those on which
/// it lies; with associated flow this makes it the closest point. Faces, edges and corners all occur.
TEST(MohrCoulomb, ReturnsToFacesEdgesAndCorners)
{
    const double K = 700, G = 400, inf = LawParameter::none;
    auto pyramid = [&](double phi, double psi, double T) {
        const double d = std::acos(-1.0) / 180;
        return MohrCoulombPyramid{K, G, std::sin(phi * d), std::sin(psi * d), 2 * 10 * std::cos(phi * d), T};
    };
    const double apex = 10 / std::tan(std::acos(-1.0) / 6);
    Random random(32);
    std::map<std::size_t, int> seen;  // number of planes on which the return lies
    for (const MohrCoulombPyramid& p : {pyramid(30, 30, inf), pyramid(30, 10, inf), pyramid(30, 10, 6), pyramid(30, 0, 6),
                                        pyramid(30, 30, 0), pyramid(0, 0, inf), pyramid(0, 0, 5), pyramid(30, 0, apex)})
        for (int n = 0; n < 400; ++n) {
            double trial[3], tau[3];
            for (double& t : trial) t = uniform(random, -60, 60) + (n % 3 == 0 ? 40 : n % 3 == 1 ? -20 : 0);
            if (n % 5 == 0) trial[1] = trial[0];
            if (n % 25 == 0) trial[2] = trial[1];
            std::sort(trial, trial + 3, std::greater<>());
            if (!(p.excess(trial) > 0)) continue;
            ASSERT_TRUE(p.project(trial, tau)) << trial[0] << " " << trial[1] << " " << trial[2];
            const Eigen::Vector3d now(tau[0], tau[1], tau[2]), lost = Eigen::Vector3d(trial[0], trial[1], trial[2]) - now;
            const double mean       = lost.sum() / 3;
            const Eigen::Vector3d v = (lost.array() - mean) / (2 * G) + mean / (3 * K);
            std::size_t active      = 0;
            for (const auto& [normal, flow, at] : planes_of(p)) {
                EXPECT_LT(normal.dot(now), at + 1e-11);
                active += normal.dot(now) > at - 1e-9;
            }
            ++seen[active];
            EXPECT_LT(distance_to_cone(p, now, v), 1e-9) << trial[0] << " " << trial[1] << " " << trial[2];
        }
    for (const std::size_t planes : {1, 2, 4, 6}) EXPECT_GT(seen[planes], 10) << planes;
}

/// Triaxial compression: s1 = s3 tan^2(45 + phi/2) + 2 c tan(45 + phi/2), in any number of steps and at any confinement.
TEST(MohrCoulomb, TriaxialStrength)
{
    const double phi = 35, c = 12, k = std::tan((45 + phi / 2) * std::acos(-1.0) / 180);
    const Material m =
        material_of("mohr-coulomb", {"young=1000", "poisson=0.3", "friction_angle=35", "dilation_angle=5", "cohesion=12"});
    for (const int steps : {1, 4})
        for (const double pressure : {0.0, 0.01, 0.03}) {
            Driven<3> point(m);
            const double l = std::exp(-pressure);
            point.step({{{l, 0, 0}, {0, l, 0}, {0, 0, l}}});
            for (int n = 1; n <= steps; ++n) {
                const double e = 0.2 * n / steps;
                point.step({{{l * std::exp(-e), 0, 0}, {0, l * std::exp(e / 2), 0}, {0, 0, l * std::exp(e / 2)}}});
            }
            const Symmetric<3> tau = point.kirchhoff();
            EXPECT_NEAR(-tau(0, 0), -tau(1, 1) * k * k + 2 * c * k, 1e-11);
            EXPECT_NEAR(tau(1, 1), tau(2, 2), 1e-11);
            EXPECT_GT(point.column("dissipated"), 0);
        }
}

/// Expansion ends at the apex c cot(phi), or at the cut-off; 1D pull at the cut-off.
TEST(MohrCoulomb, ApexAndCutOff)
{
    Driven<3> apex(
        material_of("mohr-coulomb", {"young=1000", "poisson=0.3", "friction_angle=30", "dilation_angle=30", "cohesion=10"}));
    apex.step({{{1.1, 0.01, 0}, {0, 1.11, 0}, {0, 0, 1.1}}});
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(apex.kirchhoff()(a, a), 10 * std::sqrt(3.0), 1e-11);
    EXPECT_NEAR(apex.kirchhoff()(0, 1), 0, 1e-11);
    Driven<1> pull(material_of("mohr-coulomb", {"young=1000", "poisson=0.2", "friction_angle=30", "dilation_angle=0",
                                                "cohesion=10", "tension_cutoff=4"}));
    pull.step({{{1.02}}});
    EXPECT_NEAR(pull.kirchhoff()(0, 0), 4, 1e-12);
    EXPECT_NEAR(pull.kirchhoff()(1, 1), 1, 1e-12) << "nu/(1 - nu) of it";
    pull.step({{{1.2}}});
    EXPECT_NEAR(pull.kirchhoff()(0, 0), 4, 1e-12);
}

/// Strength falls as r + (p - r) exp(-alpha/a0), with alpha of the start of the step.
TEST(MohrCoulomb, Softening)
{
    const Material m = material_of("mohr-coulomb", {"young=1000", "poisson=0.3", "friction_angle=0", "dilation_angle=0",
                                                    "cohesion=10", "residual_cohesion=4", "softening_strain=0.05"});
    Driven<2> point(m);
    for (int k = 1; k <= 50; ++k) {
        const double before = point.column("plastic_strain");
        point.step({{{std::exp(0.01 * k), 0}, {0, std::exp(-0.01 * k)}}});
        if (point.column("plastic_strain") == before) continue;
        EXPECT_NEAR((point.kirchhoff()(0, 0) - point.kirchhoff()(1, 1)) / 2, 4 + 6 * std::exp(-before / 0.05), 1e-11);
        EXPECT_GT(k, 1);
    }
    EXPECT_GT(point.column("plastic_strain"), 0.3);
}

// ---- Johnson-Cook ---------------------------------------------------------------------------------------------------------

const std::vector<std::string> kCopper{"density=8960",
                                       "young=124e9",
                                       "poisson=0.34",
                                       "A=90e6",
                                       "B=292e6",
                                       "n=0.31",
                                       "C=0.025",
                                       "m=1.09",
                                       "reference_rate=1",
                                       "reference_temperature=298",
                                       "melting_temperature=1356",
                                       "specific_heat=383",
                                       "taylor_quinney=0.9"};
std::vector<std::string> with(std::vector<std::string> settings, const std::vector<std::string>& more)
{
    settings.insert(settings.end(), more.begin(), more.end());
    return settings;
}

/// Above the static yield stress alpha' follows from q = Y: alpha' = r0 exp((q/Y_static - 1)/C). A differential equation, without
/// the implicit step of the law.
RateLawOf rates_of_johnson_cook(const Material& m)
{
    using P           = JohnsonCook;
    const auto p      = m.parameters;
    const auto stress = hencky_stress(m);
    auto q_of         = [](const Tensor& tau) { return std::sqrt(1.5) * dev_of(tau).norm(); };
    auto still        = [=](const RateState& s) {  // inner: alpha, T
        const double hot = (s.inner[1] - p[P::kReference]) / (p[P::kMelting] - p[P::kReference]);
        return (p[P::kA] + p[P::kB0] * std::pow(s.inner[0], p[P::kN])) * (1 - std::pow(std::max(hot, 0.0), p[P::kM]));
    };
    return {.stress = stress,
            .yield  = [=](const RateState& s) { return q_of(stress(s)) - still(s); },
            .flow =
                [=](const RateState& s, const Tensor&) {
                    const Tensor tau = stress(s);
                    const double q   = q_of(tau);
                    RateFlow f{.gamma = p[P::kRate] * std::exp((q / still(s) - 1) / p[P::kC]), .N = 1.5 * dev_of(tau) / q};
                    f.inner = {1, p[P::kQuinney] * q / (m.density * p[P::kHeat]), 0};
                    return f;
                },
            .is_viscous = true};
}

TEST(JohnsonCook, AgreesWithItsRateEquations)
{
    const Material m = material_of("johnson-cook", {"young=1000", "poisson=0.3", "A=60", "B=50", "n=1", "C=0.1", "m=1.2",
                                                    "reference_rate=1e-4", "reference_temperature=290", "temperature=320",
                                                    "melting_temperature=900", "specific_heat=0.001", "taylor_quinney=0.9"});
    RateState start;
    start.inner        = {0, 320, 0};
    const Comparison c = compare(
        m, rates_of_johnson_cook(m), start, [](Random& r) { return random_path(r, 0.3); }, 1000, 300);
    EXPECT_LT(c.worst, 1e-6);
    EXPECT_LT(c.worst_work, 1e-5);
    EXPECT_NEAR(c.order, 1, 0.1);
    EXPECT_GT(c.with_events, 150);
}

/// Rigid-plastic heating with m = 1: 1 - T* = (1 - T0*) exp(-chi (1 + C ln r)(A a + B a^(n+1)/(n+1))/(rho c (Tm - Tr))): 389.987
/// K.
TEST(JohnsonCook, HeatsAsRigidPlastic)
{
    std::vector<std::string> rigid = with(kCopper, {});
    for (std::string& s : rigid) {
        if (s.starts_with("young")) s = "young=124e15";
        if (s.starts_with("m=")) s = "m=1";
    }
    const Material m = material_of("johnson-cook", rigid);
    auto heat        = [&](int steps) {  // diag(l, 1/l): alpha = (2/sqrt 3) ln l
        Driven<2> point(m);
        for (int k = 1; k <= steps; ++k) {
                   const double e = std::sqrt(3.0) / 2 * k / steps;
                   point.step({{{std::exp(e), 0}, {0, std::exp(-e)}}}, 1e-3 / steps);
        }
        EXPECT_NEAR(point.column("plastic_strain"), 1, 1e-6);
        return point.column("temperature");
    };
    const double coarse = heat(2000), fine = heat(4000);
    const double exponent = 0.9 * (1 + 0.025 * std::log(1000.0)) * (90e6 + 292e6 / 1.31) / (8960 * 383.0 * (1356 - 298));
    EXPECT_NEAR(2 * fine - coarse, 298 + (1356 - 298) * (1 - std::exp(-exponent)), 2e-3);
    EXPECT_NEAR(2 * fine - coarse, 389.987, 2e-3);
}

/// The implicit step is solved: q = Y(alpha, lambda/dt, T), from the first step on, where the slope of alpha^n is infinite.
TEST(JohnsonCook, YieldStress)
{
    const Material m = material_of("johnson-cook", kCopper);
    Driven<2> point(m);
    for (const double dt : {1e-9, 1e-5, 1.0, 100.0}) {
        const double before = point.column("plastic_strain"), cold = point.column("temperature"),
                     work = point.column("dissipated");
        point.step({{{1, point.F(0, 1) + 0.02}, {0, 1}}}, dt);
        const double lambda = point.column("plastic_strain") - before, q = std::sqrt(1.5 * square(deviator(point.kirchhoff())));
        ASSERT_GT(lambda, 0);
        const double hot  = (point.column("temperature") - 298) / (1356 - 298);
        const double rate = std::max(1.0, lambda / dt);
        EXPECT_NEAR(
            q / ((90e6 + 292e6 * std::pow(before + lambda, 0.31)) * (1 + 0.025 * std::log(rate)) * (1 - std::pow(hot, 1.09))), 1,
            1e-11)
            << dt;
        EXPECT_NEAR(point.column("dissipated") - work, q * lambda, 1e-9 * q * lambda);
        EXPECT_NEAR(point.column("temperature") - cold, 0.9 * q * lambda / (8960 * 383), 1e-10);
    }
    Driven<2> molten(material_of("johnson-cook", with(kCopper, {"temperature=1355.999"})));
    molten.step({{{1, 0.5}, {0, 1}}});
    EXPECT_LT(std::sqrt(square(deviator(molten.kirchhoff()))), 1e4) << "no strength at the melting temperature";
}

/// Shocked from rest in one step, copper is on its Hugoniot: p = rho0 c0^2 x/(1 - s x)^2 with E = p x/2 (Rankine and Hugoniot).
/// So the law must give it whatever Gruneisen's number is.
TEST(JohnsonCook, ShockIsOnTheHugoniot)
{
    for (const char* gruneisen : {"gruneisen=0", "gruneisen=2.02"}) {
        std::vector<std::string> fluid = with(kCopper, {"sound_speed=3940", "shock_slope=1.489", gruneisen});
        for (std::string& s : fluid) {
            if (s.starts_with("density")) s = "density=8930";
            if (s.starts_with("young")) s = "young=1";  // no deviator
        }
        const Material m = material_of("johnson-cook", fluid);
        const double J = 0.893265, x = 1 - J;
        Driven<1> point(m);
        point.step({{{J}}}, 1e-9);
        EXPECT_NEAR(-point.sigma(0, 0) / (8930 * 3940.0 * 3940 * x / ((1 - 1.489 * x) * (1 - 1.489 * x))), 1, 1e-9);
        EXPECT_NEAR(-point.sigma(0, 0), 2.09163e10, 1e6);
        EXPECT_NEAR(point.stored() + point.column("dissipated"), -point.sigma(0, 0) * x / 2, 1e-6 * 2e10);
        double fault = 0;
        point.functions().update(m, {{{{0.3}}}, {{{0.3 / J - 1}}}, 1e-9}, point.sigma, point.history.data(), fault);
        EXPECT_GT(fault, 0) << "beyond the pole of the Hugoniot";
    }
}

/// The stiffness is that of small compressions: rho0 dp/drho along the isentrope.
TEST(JohnsonCook, SoundOfShockedMaterial)
{
    const Material m = material_of("johnson-cook", with(kCopper, {"sound_speed=3940", "shock_slope=1.489", "gruneisen=2.02"}));
    EXPECT_NEAR(m.bulk_modulus(), 8960 * 3940.0 * 3940, 1e-3);
    for (const double J : {1.02, 0.98, 0.85}) {
        auto pressure = [&](double h) {
            Driven<3> point(m);
            const double l = std::cbrt(J), k = std::cbrt(J + h);
            point.step({{{l, 0, 0}, {0, l, 0}, {0, 0, l}}});
            point.step({{{k, 0, 0}, {0, k, 0}, {0, 0, k}}});
            return -point.sigma(0, 0);
        };
        Driven<3> point(m);
        const double l = std::cbrt(J), h = 1e-6;
        point.step({{{l, 0, 0}, {0, l, 0}, {0, 0, l}}});
        const double slope = (pressure(h) - pressure(-h)) / (2 * h);
        const Stiffness s  = point.functions().stiffness(m, point.F, point.history.data());
        EXPECT_NEAR((s.modulus - 4.0 / 3 * m.mu) / (-J * J * slope), 1, 1e-6) << J;
    }
}

// ---- Cam-Clay -------------------------------------------------------------------------------------------------------------

Material clay(double preconsolidation)
{
    return material_of("cam-clay", {"shear=60", "swelling_index=0.05", "compression_index=0.2", "critical_slope=1.1",
                                    "reference_pressure=10", "preconsolidation=" + std::to_string(preconsolidation)});
}

RateLawOf rates_of_cam_clay(const Material& m)
{
    const double G = m.mu, kappa = m.parameters[0], h = m.parameters[1] - kappa, M2 = m.parameters[2] * m.parameters[2],
                 pr = m.parameters[3];
    auto stress     = [=](const RateState& s) -> Tensor {
        const Tensor e = log_of(s.b) / 2;
        return 2 * G * dev_of(e) - pr * std::exp(-e.trace() / kappa) * Tensor::Identity();
    };
    return {.stress = stress,
            .yield =
                [=](const RateState& s) {
                    const Tensor tau = stress(s);
                    const double p   = -tau.trace() / 3;
                    return 1.5 * dev_of(tau).squaredNorm() / M2 + p * (p - s.inner[0]);
                },
            .flow =
                [=](const RateState& s, const Tensor& d) {
                    const Tensor tau = stress(s), dev = dev_of(tau);
                    const double p = -tau.trace() / 3, pc = s.inner[0], K = p / kappa;
                    RateFlow f{.gamma = 0, .N = 3 / M2 * dev + (pc - 2 * p) / 3 * Tensor::Identity()};
                    f.gamma =
                        (6 * G / M2 * inner(dev, d) + K * (pc - 2 * p) * d.trace()) /
                        (18 * G / (M2 * M2) * dev.squaredNorm() + K * (pc - 2 * p) * (pc - 2 * p) - p * pc * (pc - 2 * p) / h);
                    f.inner[0] = -pc * (pc - 2 * p) / h;
                    return f;
                }};
}

TEST(CamClay, AgreesWithItsRateEquations)
{
    int paths = 200;
    for (const double pc : {12.0, 40.0}) {  // normally consolidated: hardening; overconsolidated: softening on the dry side
        const Material m = clay(pc);
        RateState start;
        start.inner        = {pc, 0, 0};
        const Comparison c = compare(
            m, rates_of_cam_clay(m), start, [](Random& r) { return random_path(r, 0.2, 0.3, 0.02); }, 1000, 500, 1.0, paths);
        EXPECT_LT(c.worst, 1e-5);
        EXPECT_NEAR(c.order, 1, 0.1);
        EXPECT_GT(c.with_events, 0.75 * paths);
        paths = 100;
    }
}

/// Isotropic compression: p = pr J^(-1/kappa) before the preconsolidation pressure, then pc0 (J/J0)^(-1/lambda), in any steps.
TEST(CamClay, IsotropicCompression)
{
    for (const int steps : {1, 10}) {
        Driven<3> point(clay(12));
        for (int k = 1; k <= steps; ++k) {
            const double l = std::exp(-0.1 * k / steps);
            point.step({{{l, 0, 0}, {0, l, 0}, {0, 0, l}}});
        }
        const double theta_y = -0.05 * std::log(12 / 10.0), p = 12 * std::exp(-(-0.3 - theta_y) / 0.2);
        EXPECT_NEAR(-trace(point.kirchhoff()) / 3, p, 1e-11 * p);
        EXPECT_NEAR(point.column("preconsolidation"), p, 1e-11 * p);
        EXPECT_NEAR(point.column("plastic_strain"), 0, 1e-15);
    }
    Driven<3> elastic(clay(12));
    elastic.step({{{1.1, 0, 0}, {0, 1.1, 0}, {0, 0, 1.1}}});
    EXPECT_NEAR(-trace(elastic.kirchhoff()) / 3, 10 * std::pow(1.331, -20), 1e-14);
}

/// At constant volume p^kappa pc^(lambda - kappa) stays what it was, at every step, and the end is the critical state q = M p
/// with p = p0 (R/2)^((lambda - kappa)/lambda), R = pc0/p0, from both sides.
TEST(CamClay, Undrained)
{
    for (const double pc0 : {12.0, 50.0}) {
        Driven<3> point(clay(pc0));
        auto constant = [&] {
            return std::pow(-trace(point.kirchhoff()) / 3, 0.05) * std::pow(point.column("preconsolidation"), 0.15);
        };
        const double before = constant();
        for (int k = 1; k <= 400; ++k) {
            const double e = -0.005 * k;
            point.step({{{std::exp(e), 0, 0}, {0, std::exp(-e / 2), 0}, {0, 0, std::exp(-e / 2)}}});
            EXPECT_NEAR(constant() / before, 1, 1e-13);
        }
        const double p = -trace(point.kirchhoff()) / 3, end = 10 * std::pow(pc0 / 10 / 2, 0.15 / 0.2);
        EXPECT_NEAR(p, end, 1e-6 * end);
        EXPECT_NEAR(std::sqrt(1.5 * square(deviator(point.kirchhoff()))), 1.1 * p, 1e-6 * p);
        EXPECT_NEAR(point.column("preconsolidation"), 2 * p, 1e-6 * p);
    }
}

/// The step ends on the yield surface, whatever its size and direction; p stays positive.
TEST(CamClay, StepsEndOnTheYieldSurface)
{
    Random random(41);
    for (int n = 0; n < 500; ++n) {
        Driven<3> point(clay(n % 2 ? 12 : 60));
        const double before = point.column("dissipated");
        point.step(random_deformation<3>(random, n % 3 ? 0.1 : 0.4));
        const Symmetric<3> tau = point.kirchhoff();
        const double p = -trace(tau) / 3, pc = point.column("preconsolidation"),
                     f = 1.5 * square(deviator(tau)) / 1.21 + p * (p - pc);
        EXPECT_GT(p, 0);
        EXPECT_LT(f, 1e-10 * pc * pc);
        if (point.column("dissipated") > before) {
            EXPECT_GT(f, -1e-10 * (pc * pc + p * p));
        }
    }
}

/// Normally consolidated clay starts on the yield surface: also tiny steps from there are solved.
TEST(CamClay, TinyStepsFromTheYieldSurface)
{
    Random random(42);
    for (int n = 0; n < 200; ++n) {
        Driven<3> point(clay(10));
        for (int k = 0; k < 20; ++k) {
            const double size = std::pow(10.0, -uniform(random, 3, 15));
            Mat<3> f          = Mat<3>::identity();
            for (int c = 0; c < 9; ++c) f(c / 3, c % 3) += uniform(random, -size, size);
            point.step(f * point.F);
            const double p = -trace(point.kirchhoff()) / 3, pc = point.column("preconsolidation");
            EXPECT_LT(1.5 * square(deviator(point.kirchhoff())) / 1.21 + p * (p - pc), 1e-13 * pc * pc);
        }
    }
}

TEST(CamClay, Stiffness)
{
    const Material m = clay(12);
    EXPECT_NEAR(m.bulk_modulus(), 200, 1e-12);
    Driven<3> point(m);
    point.step({{{0.95, 0, 0}, {0, 0.95, 0}, {0, 0, 0.95}}});
    const Stiffness s = point.functions().stiffness(m, point.F, point.history.data());
    EXPECT_NEAR(s.modulus, -trace(point.kirchhoff()) / 3 / 0.05 + 80, 1e-9);
}

}  // namespace
}  // namespace ordo::test
