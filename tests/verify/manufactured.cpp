// Manufactured solutions by automatic differentiation against the formulas that the papers print, as corrected; each
// misprint is shown to fail. u, v, F and stresses of the papers are typed here and nowhere else.
#include "material/j2.hpp"
#include "material/neo_hookean.hpp"
#include "material/st_venant_kirchhoff.hpp"
#include "support/particles.hpp"
#include "verification/monotone_j2.hpp"
#include "verification/motions.hpp"
#include "verification/newtonian.hpp"
#include "verification/solution.hpp"

#include <gtest/gtest.h>

namespace ordo::verification {
namespace {

using std::cos;
using std::log;
using std::pow;
using std::sin;
using std::sqrt;

constexpr double pi     = kPi;
constexpr double kYoung = 1e7, kDensity = 1000;

NeoHookean neo_hookean(double E, double nu) { return {E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))}; }

/// |a - b| over the size of b.
template <int D>
double difference(const Vec<D>& a, const Vec<D>& b)
{
    return norm(a - b) / norm(b);
}
template <int D>
double difference(const Mat<D>& a, const Mat<D>& b)
{
    return sqrt(ddot(a - b, a - b) / ddot(b, b));
}

constexpr double kSame = 1e-10, kOther = 1e-3;

// ---- the tool itself -------------------------------------------------------------------------------------------------

/// Every derivative of a motion against differences of its positions, and the body force against differences of P.
template <int D, class Motion, class Law>
void check_derivatives(const Motion& motion, const Law& law, const Vec<D>& X, double t)
{
    const Manufactured<D, Motion, Law> solution(motion, law, kDensity);
    const auto k   = kinematics(motion, X, t);
    const double e = 1e-5, et = 1e-5 / motion.frequency;
    auto x            = [&](const Vec<D>& Y, double s) { return solution.position(Y, s); };
    const double size = norm(k.v) + 1, speed = norm(k.a) + 1;
    EXPECT_LT(norm(k.v - (x(X, t + et) - x(X, t - et)) * (1 / (2 * et))) / size, 1e-8);
    const Vec<D> a = (solution.velocity(X, t + et) - solution.velocity(X, t - et)) * (1 / (2 * et));
    EXPECT_LT(norm(k.a - a) / speed, 1e-8);
    Vec<D> div{};
    for (int j = 0; j < D; ++j) {
        Vec<D> up = X, down = X;
        up[j] += e;
        down[j] -= e;
        const Vec<D> column_of_F = (x(up, t) - x(down, t)) * (1 / (2 * e));
        for (int i = 0; i < D; ++i) EXPECT_NEAR(solution.deformation(X, t)(i, j), column_of_F[i], 1e-8);
        auto P = [&](const Vec<D>& Y) { return solution.stress(Y, t) * cofactor(solution.deformation(Y, t)); };
        div += column(P(up) - P(down), j) * (1 / (2 * e));
    }
    EXPECT_LT(norm(solution.force(X, t) - (k.a - div * (1 / kDensity))) / norm(k.a), 1e-7);
}

TEST(Manufactured, DerivativesAreThoseOfTheMotion)
{
    const NeoHookean neo = neo_hookean(kYoung, 0.3);
    const StVenantKirchhoff venant{neo.lambda, neo.mu};
    const double w = 100 * pi, t = 0.0042;
    check_derivatives(StandingWave{0.1, pi, w, 0.3}, neo, Vec<1>{0.3}, t);
    check_derivatives(StandingWave{0.1, 2 * pi, w}, venant, Vec<1>{0.3}, t);
    check_derivatives(StandingWave{0.1, pi, w}, neo, Vec<2>{0.3, 0.8}, t);
    check_derivatives(StandingWave{0.1, pi, w}, venant, Vec<3>{0.3, 0.8, 0.45}, t);
    check_derivatives(RingExpansion{0.1, 0.4, 0.6, w}, neo, Vec<2>{0.3, 0.4}, t);
    check_derivatives(RingExpansion{0.1, 0.4, 0.6, w}, venant, Vec<3>{0.3, 0.4, 0.1}, t);
    check_derivatives(Vortex{1.0, w}, neo, Vec<2>{-0.7, 0.6}, t);
    check_derivatives(Vortex{1.0, w, 0.3, 0.25}, neo, Vec<3>{-0.7, 0.6, 0.1}, t);
    check_derivatives(ShearRotation{1.0, w}, venant, Vec<2>{0.3, 0.6}, t);
    check_derivatives(ShearRotation{1.0, w}, neo, Vec<3>{0.3, 0.6, 0.4}, t);
    const MonotoneJ2 plastic{{neo.lambda + 2.0 / 3 * neo.mu, neo.mu}, 2e5, 1e6};
    check_derivatives(GrowingStretch{1.03, 0.1, w}, plastic, Vec<1>{0.3}, t);
    check_derivatives(GrowingStretch{0.97, -0.1, w}, plastic, Vec<2>{0.3, 0.1}, t);
    check_derivatives(RingGrowth{0.02, 0.06, w}, plastic, Vec<2>{0.3, 0.4}, t);
    for (const NewtonianFlow& flow :
         {NewtonianFlow{{1e7, 7.0, 1e4, 0.0, 0.01, true}}, NewtonianFlow{{1e7, 7.0, 1e4, 2e5, 1.0, true}}}) {
        check_derivatives(BentBox{0.03, w, 1.0}, flow, Vec<2>{0.3, 0.6}, t);
        check_derivatives(BentBox{0.03, w, 1.0}, flow, Vec<3>{0.3, 0.6, 0.4}, t);
        check_derivatives(StandingWave{0.1, pi, w}, flow, Vec<1>{0.3}, t);
    }
}

// ---- laws as functions of F and F' ------------------------------------------------------------------------------------------

/// Follows the motion of X in n steps from F(0) to F(t), starting from `start`; the largest history column 0 and the stress.
template <int D, class Law, class Motion>
Stress<D> followed(const Law& law, const Motion& motion, const Vec<D>& X, double t, int n, double* history)
{
    auto F_at = [&](double s) {
        const auto k = kinematics(motion, X, s);
        Mat<D> F{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) F(i, j) = k.F(i, j).value;
        return F;
    };
    Mat<D> F = F_at(0);
    law.start(F, history);
    Stress<D> sigma{};
    double fault = 0;
    for (int k = 1; k <= n; ++k) {
        const Mat<D> next = F_at(t * k / n);
        sigma             = law.update(Step<D>{next, next * inverse(F) - Mat<D>::identity(), t / n}, history, fault);
        F                 = next;
    }
    EXPECT_EQ(fault, 0);
    return sigma;
}

/// The law of the solver along the motions of plastic-bar and plastic-ring, from the yield point or from F = I.
TEST(MonotoneJ2, IsTheLawWhereStrainGrows)
{
    const NeoHookean neo = neo_hookean(kYoung, 0.3);
    const double K = neo.lambda + 2.0 / 3 * neo.mu, yield = 2e5, H = 1e6, w = 100 * pi, t = 0.004;
    const J2 law{{K, neo.mu}, yield, H, yield, 0.0};
    const MonotoneJ2 monotone{{K, neo.mu}, yield, H};
    for (const double sign : {1.0, -1.0})
        for (const int steps : {1, 7}) {
            const GrowingStretch bar{std::exp(sign * yield / (2 * neo.mu)), 0.1 * sign, w};
            double history[Material::most_history]{};
            const Stress<2> sigma = followed(law, bar, Vec<2>{0.3, 0.1}, t, steps, history);
            const Mat<2> F{{{kinematics(bar, Vec<2>{0.3, 0.1}, t).F(0, 0).value, 0}, {0, 1}}};
            const double e = std::fabs(std::log(F(0, 0))), alpha = (2 * neo.mu * e - yield) / (3 * neo.mu + H);
            EXPECT_NEAR(history[J2::kAlpha], alpha, 1e-13);
            EXPECT_NEAR(monotone.plastic_strain(F), alpha, 1e-13);
            const double tau = sign * (K * e + 2.0 / 3 * (yield + H * alpha));
            EXPECT_NEAR(monotone.cauchy(F)(0, 0) * F(0, 0), tau, 1e-12 * K);
            for (int k = 0; k < Stress<2>::size; ++k) EXPECT_NEAR(sigma.c[k], monotone.cauchy(F).c[k], 1e-12 * K);
        }
    const RingGrowth ring{0.0, 0.08, w};
    const Vec<2> X{0.3, 0.4};
    double history[Material::most_history]{};
    const Stress<2> sigma = followed(law, ring, X, t, 5, history);
    const Mat<2> F        = Manufactured<2, RingGrowth, MonotoneJ2>(ring, monotone, kDensity).deformation(X, t);
    const double e        = 0.5 * std::log(1 + 0.08 * std::sin(w * t) / 0.25);
    EXPECT_NEAR(history[J2::kAlpha], (2 * sqrt(3) * neo.mu * e - yield) / (3 * neo.mu + H), 1e-13);
    for (int k = 0; k < Stress<2>::size; ++k) EXPECT_NEAR(sigma.c[k], monotone.cauchy(F).c[k], 1e-12 * K);
}

/// The law of the solver tends to it with the step, first order.
TEST(NewtonianFlow, IsTheLimitOfTheLaw)
{
    const Fluid law{1e7, 7.0, 1e4, 0.0, 0.01, true};
    const BentBox motion{0.03, 100 * pi, 1.0};
    const Vec<2> X{0.3, 0.6};
    const double t     = 0.004;
    const Mat<2> exact = Manufactured<2, BentBox, NewtonianFlow>(motion, {law}, kDensity).stress(X, t);
    double error[2];
    for (const int k : {0, 1}) {
        double history[Material::most_history]{};
        error[k] = difference(in_plane(followed(law, motion, X, t, k ? 8000 : 4000, history)), exact);
    }
    EXPECT_LT(error[1], 1e-3);
    EXPECT_NEAR(error[0] / error[1], 2, 0.02);
    const Mat<2> inviscid = in_plane(law.stress(
        Manufactured<2, BentBox, NewtonianFlow>(motion, {law}, kDensity).deformation(X, t), static_cast<const double*>(nullptr)));
    EXPECT_GT(difference(exact, inviscid), 0.1) << "viscosity counts";
}

/// Eight lanes at a time equal one particle at a time, also where the count is no multiple of eight.
TEST(Manufactured, LanesEqualOneByOne)
{
    const Manufactured<2, Vortex, NeoHookean> solution({1.0, pi}, neo_hookean(1e3, 0.3), kDensity);
    Model<2> model          = test::unit_box<2>(5, Domain::point);
    model.body_force_kernel = [](const ParticleView<2>&, std::ptrdiff_t, std::ptrdiff_t, double) {};
    Particles<2> p          = plant_all(model, fill_polar(Tube<2>{.inner = 0.75, .outer = 1.25}, 3, 9, 1));
    for (int i = 0; i < p.count; ++i) p.X[i] = p.x[i];
    ASSERT_EQ(p.count, 27);
    for (const Vec<2>& b : p.b) EXPECT_EQ(b, Vec<2>{});
    solution.fill_body_force(p.view(), 0, 3, 0.3);
    EXPECT_EQ(p.b[3], Vec<2>{});
    solution.fill_body_force(p.view(), 3, 27, 0.3);
    for (int i = 0; i < p.count; ++i) EXPECT_LT(difference(p.b[i], solution.force(p.X[i], 0.3)), 1e-13);
}

TEST(Manufactured, MaterialPointsAreFound)
{
    const Manufactured<2, Vortex, NeoHookean> vortex({1.0, pi}, neo_hookean(1e3, 0.3), kDensity);
    const Manufactured<3, ShearRotation, NeoHookean> turn({1.0, pi}, neo_hookean(1e3, 0.3), kDensity);
    for (double t : {0.1, 0.5, 1.0}) {
        for (const Vec<2>& X : {Vec<2>{0.8, 0.1}, Vec<2>{-0.7, 0.7}, Vec<2>{0.2, -1.1}}) {
            const auto found = material_point(vortex, vortex.position(X, t), t);
            ASSERT_TRUE(found);
            EXPECT_LT(norm(*found - X), 1e-11);
        }
        const Vec<3> X{0.4, 0.7, 0.3};
        const auto found = material_point(turn, turn.position(X, t), t);
        ASSERT_TRUE(found);
        EXPECT_LT(norm(*found - X), 1e-11);
    }
}

/// Walls and rims do not feel what is not applied: no motion or shear at walls, no traction on rims.
TEST(Manufactured, WallsAndRimsAreFree)
{
    const double w = 100 * pi, t = 0.0042;
    const NeoHookean law = neo_hookean(kYoung, 0.3), no_poisson = neo_hookean(kYoung, 0.0);
    const Manufactured<2, StandingWave, NeoHookean> wave({0.1, pi, w}, law, kDensity);
    const Manufactured<2, ShearRotation, NeoHookean> turn({1.0, w}, law, kDensity);
    for (double Y : {0.0, 0.3, 1.0})
        for (double wall : {0.0, 1.0}) {
            EXPECT_NEAR(wave.position({wall, Y}, t)[0], wall, 1e-15);
            EXPECT_NEAR(wave.stress({wall, Y}, t)(0, 1), 0.0, 1e-8);
            EXPECT_LT(norm(turn.position({wall, Y}, t) - Vec<2>{wall, Y}), 1e-15);
            EXPECT_LT(norm(column(turn.stress({wall, Y}, t), 0)), 1e-6);
        }
    const Manufactured<2, RingExpansion, NeoHookean> ring({0.1, 0.4, 0.6, w}, no_poisson, kDensity),
        loaded({0.1, 0.4, 0.6, w}, law, kDensity);
    const Manufactured<3, Vortex, NeoHookean> vortex({1.0, w, 0.3, 0.25}, law, kDensity);
    for (double angle : {0.1, 0.9}) {
        for (double R : {0.4, 0.6}) {
            const Vec<2> n{cos(angle), sin(angle)};
            EXPECT_LT(norm(ring.stress(R * n, t) * n) / kYoung, 1e-13);
            EXPECT_GT(norm(loaded.stress(R * n, t) * n) / kYoung, 0.02) << "nu = 0.3 loads the rim";
        }
        for (double R : {0.75, 1.25}) {
            const Vec<3> n{cos(angle), sin(angle), 0.0};
            EXPECT_LT(norm(vortex.stress(R * n + Vec<3>{0, 0, 0.1}, t) * n) / kYoung, 1e-13);
        }
        for (double Z : {0.0, 0.25}) EXPECT_LT(norm(column(vortex.stress({cos(angle), sin(angle), Z}, t), 2)) / kYoung, 1e-13);
    }
}

// ---- vibration: Tran et al. (2019) eqs. 45, 46, 48 to 51; Gong (2015) eqs. 4.33, 4.39, 4.46 --------------------------

TEST(PrintedFormulas, VibrationOfTran)
{
    const double A = 0.1, c = sqrt(kYoung / kDensity), w = c * pi;
    for (double nu : {0.0, 0.3})
        for (double k : {pi, 2 * pi}) {  // the published code and the paper
            const NeoHookean law = neo_hookean(kYoung, nu);
            const Manufactured<1, StandingWave, NeoHookean> exact({A, k, w}, law, kDensity);
            for (double X : {0.1, 0.35, 0.8})
                for (double t : {0.001, 0.0042, 0.013}) {
                    const double u = A * sin(k * X) * sin(w * t), F = 1 + A * k * cos(k * X) * sin(w * t);
                    EXPECT_NEAR(exact.position({X}, t)[0], X + u, 1e-15);
                    EXPECT_NEAR(exact.velocity({X}, t)[0], A * w * sin(k * X) * cos(w * t), 1e-12);
                    EXPECT_NEAR(exact.deformation({X}, t)(0, 0), F, 1e-14);
                    auto b = [&](double prefactor) {  // eq. 51 for k = 2 pi; its prefactor is pi^2, printed pi
                        const double q = k / pi;
                        return prefactor * u *
                               (q * q * law.mu / kDensity - c * c -
                                q * q * (law.lambda * (log(F) - 1) - law.mu) / (kDensity * F * F));
                    };
                    EXPECT_LT(difference(exact.force({X}, t), Vec<1>{b(pi * pi)}), kSame);
                    EXPECT_GT(difference(exact.force({X}, t), Vec<1>{b(pi)}), kOther);
                }
        }
}

TEST(PrintedFormulas, VibrationOfGong)
{
    const double G = 0.1, w = 100 * pi;
    const NeoHookean law = neo_hookean(kYoung, 0.3);
    const Manufactured<2, StandingWave, NeoHookean> exact({G, pi, w}, law, kDensity);
    for (const Vec<2>& X : {Vec<2>{0.1, 0.7}, Vec<2>{0.35, 0.2}})
        for (double t : {0.001, 0.0042}) {
            Vec<2> u{}, F{}, b{};
            for (int a = 0; a < 2; ++a) {
                u[a] = G * sin(pi * X[a]) * sin(w * t);
                F[a] = 1 + G * pi * cos(pi * X[a]) * sin(w * t);
            }
            for (int a = 0; a < 2; ++a)  // eq. 4.46
                b[a] = pi * pi * u[a] / kDensity *
                       (law.lambda / (F[a] * F[a]) * (1 - log(F[0] * F[1])) + law.mu * (1 + 1 / (F[a] * F[a])) - kYoung);
            EXPECT_LT(difference(exact.force(X, t), b), kSame);
        }
    // After eq. 4.39: E = lambda (1 + nu)(1 - 2 nu)/nu, printed with mu for nu.
    const double nu = 0.3;
    EXPECT_NEAR(law.lambda * (1 + nu) * (1 - 2 * nu) / nu, kYoung, 1e-8 * kYoung);
    EXPECT_GT(std::fabs(law.lambda * (1 + law.mu) * (1 - 2 * law.mu) / law.mu - kYoung), kYoung);
}

/// P of Gong eq. 4.33 needs F F^T, printed F^T F; that of Tran eq. 45 is the nominal stress, the transpose of P.
TEST(PrintedFormulas, FirstPiolaKirchhoffStress)
{
    const NeoHookean law = neo_hookean(kYoung, 0.3);
    const Mat<2> F{{{1.1, 0.4}, {-0.1, 0.9}}}, I = Mat<2>::identity();
    const Mat<2> inverse_F = inverse(F), P = in_plane(law.cauchy(F)) * cofactor(F);
    const double p = law.lambda * log(det(F));
    EXPECT_LT(difference((p * I + law.mu * (F * transpose(F) - I)) * transpose(inverse_F), P), kSame);
    EXPECT_GT(difference((p * I + law.mu * (transpose(F) * F - I)) * transpose(inverse_F), P), kOther);
    const Mat<2> printed = p * inverse_F + law.mu * (inverse_F * (F * transpose(F) - I));
    EXPECT_LT(difference(transpose(printed), P), kSame);
    EXPECT_GT(difference(printed, P), kOther);
    EXPECT_LT(difference(P * transpose(F) * (1 / det(F)), in_plane(law.cauchy(F))), kSame);         // eq. 46
    EXPECT_GT(difference(printed * transpose(F) * (1 / det(F)), in_plane(law.cauchy(F))), kOther);  // with eq. 45 as printed
}

/// Tran eq. 55, U = sigma : eps/2, is not the stored energy of the law.
TEST(PrintedFormulas, StoredEnergy)
{
    const NeoHookean law = neo_hookean(kYoung, 0.3);
    const Mat<2> F{{{1.1, 0.4}, {-0.1, 0.9}}}, I = Mat<2>::identity();
    const double W = law.lambda / 2 * pow(log(det(F)), 2) + law.mu / 2 * (ddot(F, F) - 2 - 2 * log(det(F)));
    EXPECT_NEAR(law.energy(F), W, 1e-12 * W);
    const double printed = det(F) * ddot(in_plane(law.cauchy(F)), 0.5 * (F + transpose(F)) - I) / 2;
    EXPECT_GT(std::fabs(printed - W), kOther * W);
}

// ---- ring: Tran et al. eqs. 57 to 59 ---------------------------------------------------------------------------------

TEST(PrintedFormulas, Ring)
{
    const double A = 0.1, ri = 0.4, ro = 0.6, rm = 0.5, c = sqrt(kYoung / kDensity), w = c * pi / (2 * rm);
    const double c1 = -6 * ri / (ro * (ro - 3 * ri)), c2 = 3 * (ri + ro) / (ro * ro * (ro - 3 * ri)),
                 c3 = -2 / (ro * ro * (ro - 3 * ri));
    const Manufactured<2, RingExpansion, NeoHookean> exact({A, ri, ro, w}, neo_hookean(kYoung, 0.0), kDensity);
    for (double R : {0.4, 0.47, 0.6})
        for (double t : {0.001, 0.0042}) {
            const Vec<2> n{0.6, 0.8};
            auto g = [&](double last) { return c3 * R * R * R + c2 * R * R + c1 * last; };  // last: R, printed r_1
            EXPECT_LT(difference(exact.position(R * n, t) - R * n, A * sin(w * t) * g(R) * n), kSame);
            EXPECT_LT(difference(exact.velocity(R * n, t), A * w * cos(w * t) * g(R) * n), kSame);
            if (R > ri) {
                EXPECT_GT(difference(exact.velocity(R * n, t), A * w * cos(w * t) * g(ri) * n), kOther);
            }
        }
}

// ---- vortex: Tran et al. eqs. 61 to 74 -------------------------------------------------------------------------------

TEST(PrintedFormulas, Vortex)
{
    const double A = 0.5, rho = 1000, E = 1000, c = sqrt(E / rho);
    const NeoHookean law = neo_hookean(E, 0.3);
    const double mu      = law.mu;
    const Manufactured<2, Vortex, NeoHookean> exact({A, c * pi}, law, rho);
    for (double R : {0.82, 1.1})
        for (double theta : {0.4, 2.5})
            for (double t : {0.11, 0.3}) {
                const Vec<2> X{R * cos(theta), R * sin(theta)};
                const double g = A * sin(c * pi * t), dg = A * c * pi * cos(c * pi * t);
                const double h = 1 - 32 * pow(R - 1, 2) + 256 * pow(R - 1, 4), dh = -64 * (R - 1) + 1024 * pow(R - 1, 3);
                const double alpha = g * h, beta = std::atan2(X[1], X[0]) + alpha;
                const Vec<2> x{X[0] * cos(alpha) - X[1] * sin(alpha), X[0] * sin(alpha) + X[1] * cos(alpha)};
                EXPECT_LT(difference(exact.position(X, t), x), kSame);
                EXPECT_GT(difference(exact.position(X, t) - X, A * x), kOther) << "eq. 65 as printed";
                const Vec<2> turn{-X[0] * sin(alpha) - X[1] * cos(alpha), X[0] * cos(alpha) - X[1] * sin(alpha)};
                EXPECT_LT(difference(exact.velocity(X, t), dg * h * turn), kSame);
                EXPECT_GT(difference(exact.velocity(X, t), A * dg * h * turn), kOther) << "A^2 of eq. 66";
                EXPECT_GT(std::fabs(std::atan(X[0] / X[1]) - std::atan2(X[1], X[0])), kOther) << "eq. 61 as printed";

                const Mat<2> q{{{cos(beta), -sin(beta)}, {sin(beta), cos(beta)}}};
                auto stress = [&](double slope) {  // eqs. 67 to 69
                    const double rb = mu * R * g * slope, bb = mu * pow(R * g * slope, 2);
                    return q * Mat<2>{{{0, rb}, {rb, bb}}} * transpose(q);
                };
                EXPECT_LT(difference(exact.stress(X, t), stress(dh)), kSame);
                EXPECT_GT(difference(exact.stress(X, t), stress(-64 * (-1 - R) + 1024 * pow(R - 1, 3))), kOther) << "eq. 68";
                const double rb = mu * R * g * dh, bb = mu * pow(R * g * dh, 2), s = sin(beta), k = cos(beta);
                const double xy = rb * (k * k - s * s) - bb * s * k;  // eq. 71
                const Mat<2> sigma{{{s * (bb * s - 2 * rb * k), xy}, {xy, k * (2 * rb * s + bb * k)}}};
                EXPECT_LT(difference(exact.stress(X, t), sigma), kSame);

                const double P = (4 * R - 5) * (4 * R - 5) * (4 * R - 3) * (4 * R - 3);  // h
                EXPECT_NEAR(P, h, 1e-12);
                const double br = -R * dg * dg * h * h + mu / rho * R * g * g * dh * dh;
                const double in_bracket =
                    -c * c * pi * pi * pow(cos(c * pi * t), 2) * P + 4096 * mu / rho * pow(R - 1, 2) * pow(sin(c * pi * t), 2);
                EXPECT_NEAR(R * A * A * P * in_bracket, br, 1e-10 * std::fabs(br));  // eq. 73 without its minus sign
                const double poly         = 96 * R * R * R - 240 * R * R + 188 * R - 45;
                const double bb_corrected = -A * sin(c * pi * t) * (R * c * c * pi * pi * h + 64 * mu / rho * poly);
                const double bb_printed   = -R * A * c * c * pi * pi * sin(c * pi * t) * P + 64 * mu * poly / rho;
                EXPECT_LT(difference(exact.force(X, t), q * Vec<2>{br, bb_corrected}), kSame);
                EXPECT_GT(difference(exact.force(X, t), q * Vec<2>{-br, bb_corrected}), kOther) << "sign of eq. 73";
                EXPECT_GT(difference(exact.force(X, t), q * Vec<2>{br, bb_printed}), kOther) << "eq. 74 as printed";
            }
}

}  // namespace
}  // namespace ordo::verification
