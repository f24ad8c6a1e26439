// Every material: stress is the derivative of the energy, objectivity, closed forms, small-strain limit.
#include "support/materials.hpp"
#include "base/dual.hpp"
#include "material/laws.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

constexpr double kLambda = 577.0, kMu = 385.0;
double none[1];  // the history of laws without one

/// f(law, std::integral_constant<int, D>) for each law of the list with an energy that gives its stress, in each dimension.
template <class F, class... L>
void for_each_hyperelastic(LawList<L...>, F&& f)
{
    auto in_each_dimension = [&](auto law) {
        f(law, std::integral_constant<int, 1>());
        f(law, std::integral_constant<int, 2>());
        f(law, std::integral_constant<int, 3>());
    };
    auto try_law = [&]<class Law>(Law*) {
        if constexpr (Hyperelastic<Law>) in_each_dimension(Law::of(test::sample_material(Law::name)));
    };
    (try_law(static_cast<L*>(nullptr)), ...);
}

/// P = J sigma F^-T against dW/dF by dual numbers.
template <int D, class Law>
void check_stress_is_energy_derivative(const Law& law)
{
    test::Random random(3);
    for (int k = 0; k < 50; ++k) {
        const Mat<D> F = test::random_deformation<D>(random, 0.4);
        const Mat<D> P = det(F) * (in_plane(law.cauchy(F)) * transpose(inverse(F)));
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) {
                Mat<D, Dual<>> G{};
                for (int a = 0; a < D; ++a)
                    for (int b = 0; b < D; ++b) G(a, b) = Dual<>(F(a, b), a == i && b == j ? 1.0 : 0.0);
                EXPECT_NEAR(law.energy(G).slope, P(i, j), 1e-10 * (kLambda + kMu) * (1 + std::fabs(P(i, j)) / kMu));
            }
    }
}
TEST(Materials, StressIsTheDerivativeOfTheEnergy)
{
    for_each_hyperelastic(Laws{}, [](const auto& law, auto dim) {
        SCOPED_TRACE(std::string(law.name));
        check_stress_is_energy_derivative<dim()>(law);
    });
}

template <int D>
Mat<D> rotation(double angle)
{
    Mat<D> Q = Mat<D>::identity();
    if constexpr (D >= 2) {
        Q(0, 0) = Q(1, 1) = std::cos(angle);
        Q(0, 1)           = -std::sin(angle);
        Q(1, 0)           = std::sin(angle);
    }
    if constexpr (D == 3) {
        Mat<D> R = Mat<D>::identity();
        R(1, 1) = R(2, 2) = std::cos(2 * angle);
        R(1, 2)           = -std::sin(2 * angle);
        R(2, 1)           = std::sin(2 * angle);
        Q                 = R * Q;
    }
    return Q;
}

/// sigma(Q F) = Q sigma(F) Q^T and the same energy.
template <int D, class Law>
void check_objectivity(const Law& law)
{
    test::Random random(5);
    const Mat<D> F = test::random_deformation<D>(random, 0.3), Q = rotation<D>(0.8);
    const Mat<D> turned = in_plane(law.cauchy(Q * F)), expected = Q * in_plane(law.cauchy(F)) * transpose(Q);
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) EXPECT_NEAR(turned(i, j), expected(i, j), 1e-10);
    EXPECT_NEAR(law.energy(Q * F), law.energy(F), 1e-10);
}
TEST(Materials, HyperelasticLawsAreObjective)
{
    for_each_hyperelastic(Laws{}, [](const auto& law, auto dim) {
        SCOPED_TRACE(std::string(law.name));
        check_objectivity<dim()>(law);
    });
}

/// A rigid rotation in large steps turns the stress exactly and stores no energy.
template <int D>
void check_jaumann_rotation()
{
    const JaumannElastic law{kLambda, kMu};
    test::Random random(6);
    Stress<D> sigma;
    for (double& s : sigma.c) s = test::uniform(random, -10, 10);
    // Hughes & Winget turn by the Cayley form: the step of angle a is the rotation of 2 atan(tan(a/2)) = a in a plane.
    Mat<D> Q = Mat<D>::identity();
    Q(0, 0) = Q(1, 1)      = std::cos(0.5);
    Q(0, 1)                = -std::sin(0.5);
    Q(1, 0)                = std::sin(0.5);
    const Stress<D> turned = law.update(Step<D>{Q, Q - Mat<D>::identity(), 1.0}, sigma, none);
    const Stress<D> exact  = make_stress(Q * in_plane(sigma) * transpose(Q), sigma(2, 2));
    for (int k = 0; k < Stress<D>::size; ++k) EXPECT_NEAR(turned.c[k], exact.c[k], 1e-12);
    EXPECT_NEAR(law.energy(turned, none), law.energy(sigma, none), 1e-12);
}
TEST(Materials, JaumannLawTurnsWithRigidRotations)
{
    check_jaumann_rotation<2>();
    check_jaumann_rotation<3>();
}

/// Uniaxial strain in small steps: sigma_xx = (lambda + 2 mu) ln F, and the energy is the work done.
template <int D>
void check_jaumann_uniaxial()
{
    const JaumannElastic law{kLambda, kMu};
    const int steps = 2000;
    Stress<D> sigma{};
    double work = 0, stretch = 1;
    for (int k = 0; k < steps; ++k) {
        Mat<D> G{};
        G(0, 0)             = std::pow(1.05, 1.0 / steps) - 1;
        const double before = sigma(0, 0);
        sigma               = law.update(Step<D>{{}, G, 1.0}, sigma, none);
        work += 0.5 * (before + sigma(0, 0)) * std::log1p(G(0, 0));
        stretch *= 1 + G(0, 0);
    }
    const double expected = (kLambda + 2 * kMu) * std::log(stretch);
    EXPECT_NEAR(sigma(0, 0), expected, 1e-6 * expected);
    EXPECT_NEAR(law.energy(sigma, none), work, 1e-6 * work);
    for (int a = 1; a < 3; ++a) EXPECT_NEAR(sigma(a, a), kLambda * std::log(stretch), 1e-6 * expected);
}
TEST(Materials, JaumannLawUniaxialStrain)
{
    check_jaumann_uniaxial<1>();
    check_jaumann_uniaxial<2>();
    check_jaumann_uniaxial<3>();
}

/// Simple shear has the closed form sigma_xx = mu (1 - cos g), sigma_xy = mu sin g: second order in the step.
TEST(Materials, JaumannLawSimpleShearIsSecondOrder)
{
    const JaumannElastic law{kLambda, kMu};
    double previous = 0;
    for (int steps : {10, 20, 40}) {
        const double g = 1.2;
        Stress<2> sigma{};
        for (int k = 0; k < steps; ++k) sigma = law.update(Step<2>{{}, {{{0, g / steps}, {0, 0}}}, 1.0}, sigma, none);
        const double error = std::hypot(sigma(0, 0) - kMu * (1 - std::cos(g)), sigma(0, 1) - kMu * std::sin(g));
        if (previous > 0) {
            EXPECT_GT(std::log2(previous / error), 1.9);
        }
        previous = error;
    }
}

TEST(Materials, LinearRateLawOfWobbes)
{
    const LinearRate1D law{2e4};
    Stress<1> sigma{};
    for (int k = 0; k < 10; ++k) sigma = law.update(Step<1>{{}, {{{1e-3}}}, 1.0}, sigma, none);
    EXPECT_NEAR(sigma(0, 0), 2e4 * 1e-2, 1e-9);
    EXPECT_NEAR(law.energy(sigma, none), 0.5 * 2e4 * 1e-4, 1e-12);
    EXPECT_EQ(sigma(1, 1), 0) << "across it";
}

TEST(Materials, NeoHookeanClosedForms)
{
    const NeoHookean law{kLambda, kMu};
    const double F = 1.3;
    EXPECT_NEAR(law.cauchy(Mat<1>{{{F}}})(0, 0), (kLambda * std::log(F) + kMu * (F * F - 1)) / F, 1e-10);
    const double g          = 0.4;  // simple shear: sigma = mu [g^2 g; g 0]
    const Stress<2> sheared = law.cauchy(Mat<2>{{{1, g}, {0, 1}}});
    EXPECT_NEAR(sheared(0, 0), kMu * g * g, 1e-10);
    EXPECT_NEAR(sheared(0, 1), kMu * g, 1e-10);
    EXPECT_NEAR(sheared(1, 1), 0, 1e-10);
}

/// All models agree with linear elasticity at small strain, in plane and across.
TEST(Materials, SmallStrainLimit)
{
    const double e = 1e-6;
    const Mat<2> H{{{1.0 * e, 0.3 * e}, {0.5 * e, -0.4 * e}}};
    const Mat<2> F = Mat<2>::identity() + H;
    Mat<2> linear  = kMu * (H + transpose(H));
    for (int a = 0; a < 2; ++a) linear(a, a) += kLambda * trace(H);
    const Stress<2> all[] = {NeoHookean{kLambda, kMu}.cauchy(F), StVenantKirchhoff{kLambda, kMu}.cauchy(F),
                             JaumannElastic{kLambda, kMu}.update(Step<2>{F, H, 1.0}, {}, none)};
    for (const Stress<2>& s : all) {
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) EXPECT_NEAR(s(i, j), linear(i, j), 1e-5 * e * 1e6 * 1e-3);
        EXPECT_NEAR(s(2, 2), kLambda * trace(H), 1e-8);
    }
}

/// The functions of a row are those of the struct, for one particle and for eight.
TEST(Materials, RowsAreTheirLaws)
{
    test::Random random(7);
    const Mat<2> F = test::random_deformation<2>(random, 0.3);
    Mat<2, Lanes> of_eight;
    for (int c = 0; c < 4; ++c) of_eight(c / 2, c % 2) = Lanes(F(c / 2, c % 2));
    for (const char* name : {"neo-hookean", "st-venant-kirchhoff"}) {
        const Material m{find_law(name), 1000.0, kLambda, kMu};
        const bool is_neo      = m.law->name == NeoHookean::name;
        const Stress<2> stress = is_neo ? NeoHookean::of(m).cauchy(F) : StVenantKirchhoff::of(m).cauchy(F);
        const double energy    = 0.2 * (is_neo ? NeoHookean::of(m).energy(F) : StVenantKirchhoff::of(m).energy(F));
        EXPECT_EQ(m.law->in_2d.initial_stress(m, F), stress);
        EXPECT_EQ(m.law->in_2d.stress_rate(m, stress, F), Stress<2>{});
        EXPECT_EQ(strain_energy(m, F, stress, 0.2, 7.0), energy) << "V0 counts, not V";
        EXPECT_NEAR(m.law->in_2d.energy_of_eight(m, of_eight, {}, Lanes(0.2), Lanes(7.0), nullptr)[5], energy, 1e-13);
    }
    const Material rate{find_law("jaumann-elastic"), 1000.0, kLambda, kMu};
    const Stress<2> some{{1.0, 2.0, -3.0, 0.5}};
    EXPECT_EQ(rate.law->in_2d.initial_stress(rate, F), Stress<2>{});
    EXPECT_EQ(rate.law->in_2d.stress_rate(rate, some, F), JaumannElastic::of(rate).rate(some, F));
    EXPECT_EQ(strain_energy(rate, F, some, 7.0, 0.2), 0.2 * JaumannElastic::of(rate).energy(some, none)) << "V counts, not V0";
    EXPECT_EQ(find_law("linear-rate-1d")->max_dim, 1);
    EXPECT_EQ(find_law("no-such-law"), nullptr);
}

TEST(Materials, WaveSpeed)
{
    const Material m{find_law("neo-hookean"), 1000.0, kLambda, kMu};
    EXPECT_NEAR(m.wave_speed(), std::sqrt((kLambda + 2 * kMu) / 1000), 1e-14);
}

/// Uniaxial, planar and sheared: tau_1 - tau_2 = sum mu (l1^a - l2^a) with isochoric stretches, tr tau/3 = K ln J.
TEST(Materials, OgdenClosedForms)
{
    const Material m = test::sample_material("ogden");
    EXPECT_NEAR(m.mu, (200 * 2.6 + 50 * 4) / 2, 1e-12);
    EXPECT_NEAR(m.bulk_modulus(), 833, 1e-12);
    const Ogden law  = Ogden::of(m);
    const double l[] = {1.7, 0.8, 0.9}, J = l[0] * l[1] * l[2];
    auto of = [&](double stretch) {
        const double i = stretch / std::cbrt(J);
        return 200 * std::pow(i, 2.6) - 50 * std::pow(i, -4);
    };
    const Stress<3> s = law.cauchy(Mat<3>{{{l[0], 0, 0}, {0, l[1], 0}, {0, 0, l[2]}}});
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(J * (s(a, a) - s(2, 2)), of(l[a]) - of(l[2]), 1e-10);
    EXPECT_NEAR(J * trace(s) / 3, 833 * std::log(J), 1e-10);
    // Simple shear: stretches 1/l, l, 1 with l - 1/l = g; the shear stress is their difference times the axes' product.
    const double g = 0.8, big = (g + std::sqrt(g * g + 4)) / 2;
    const Stress<2> sheared = law.cauchy(Mat<2>{{{1, g}, {0, 1}}});
    auto shear              = [](double x) { return 200 * std::pow(x, 2.6) - 50 * std::pow(x, -4); };
    EXPECT_NEAR(sheared(0, 1), (shear(big) - shear(1 / big)) / (big + 1 / big), 1e-10);
}

/// Waves of St. Venant-Kirchhoff's law are as fast as its stiffness says at most, and along a stretch as fast.
template <int D>
void check_stiffening()
{
    using T         = Dual<Dual<double>>;
    const auto law  = StVenantKirchhoff::of(test::sample_material("st-venant-kirchhoff"));
    auto modulus_of = [&](const Mat<D>& F, const Vec<D>& along, const Vec<D>& by) {  // d^2 W/de^2 for F' = (I + e by along^T) F
        const Mat<D> change = outer(by, along) * F;
        Mat<D, T> f;
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) f(i, j) = T(Dual<double>(F(i, j), change(i, j)), Dual<double>(change(i, j), 0.0));
        return law.energy(f).slope.slope;
    };
    test::Random random(9);
    const double at_rest = law.lambda + 2 * law.mu;
    for (int n = 0; n < 200; ++n) {
        const Mat<D> F = (n % 3 + 1) * 0.6 * test::random_deformation<D>(random, 0.6);
        Vec<D> along{}, by{};
        for (int a = 0; a < D; ++a) {
            along[a] = test::uniform(random, -1, 1);
            by[a]    = test::uniform(random, -1, 1);
        }
        along *= 1 / norm(along);
        by *= 1 / norm(by);
        EXPECT_LE(modulus_of(F, along, by), law.stiffness(F, nullptr).modulus * (1 + 1e-12));
        EXPECT_GE(law.stiffness(F, nullptr).modulus, at_rest);
    }
    Mat<D> pulled = Mat<D>::identity();
    pulled(0, 0)  = 1.8;
    Vec<D> first{};
    first[0] = 1.0;
    EXPECT_NEAR(modulus_of(pulled, first, first), law.stiffness(pulled, nullptr).modulus, 1e-9 * at_rest);
}
TEST(Materials, StVenantKirchhoffStiffens)
{
    check_stiffening<1>();
    check_stiffening<2>();
    check_stiffening<3>();
}

/// Mooney and Rivlin's law is Ogden's with exponents 2 and -2: mu_1 = 2 c10, mu_2 = -2 c01.
template <int D>
void check_mooney_is_ogden()
{
    const Material mooney = test::material_of("mooney-rivlin", {"bulk=500", "c10=70", "c01=30"});
    const Material ogden  = test::material_of("ogden", {"bulk=500", "moduli=[140, -60]", "exponents=[2, -2]"});
    EXPECT_NEAR(mooney.mu, ogden.mu, 1e-12);
    EXPECT_NEAR(mooney.lambda, ogden.lambda, 1e-12);
    test::Random random(8);
    for (int n = 0; n < 50; ++n) {
        const Mat<D> F    = test::random_deformation<D>(random, 0.5);
        const Stress<D> a = MooneyRivlin::of(mooney).cauchy(F), b = Ogden::of(ogden).cauchy(F);
        for (int k = 0; k < a.size; ++k) EXPECT_NEAR(a.c[k], b.c[k], 1e-11 * (1 + std::sqrt(square(b))));
        EXPECT_NEAR(MooneyRivlin::of(mooney).energy(F), Ogden::of(ogden).energy(F), 1e-10);
        EXPECT_NEAR(MooneyRivlin::of(mooney).stiffness(F, nullptr).modulus, Ogden::of(ogden).stiffness(F, nullptr).modulus, 1e-9);
    }
}
TEST(Materials, MooneyRivlinIsOgden)
{
    check_mooney_is_ogden<1>();
    check_mooney_is_ogden<2>();
    check_mooney_is_ogden<3>();
}

/// Derivatives of the stress at equal stretches, where axes are arbitrary: those of linear elasticity.
TEST(Materials, OgdenDerivativesAtRest)
{
    const Material m = test::sample_material("ogden");
    const Ogden law  = Ogden::of(m);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            Mat<3, Dual<>> F{};
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b) F(a, b) = Dual<>(a == b ? 1.0 : 0.0, a == i && b == j ? 1.0 : 0.0);
            const Stress<3, Dual<>> s = law.cauchy(F);
            for (int a = 0; a < 3; ++a)
                for (int b = a; b < 3; ++b) {
                    const bool is_same = (a == i && b == j) || (a == j && b == i);
                    EXPECT_NEAR(s(a, b).slope, m.mu * (is_same ? (i == j ? 2 : 1) : 0) + (a == b && i == j ? m.lambda : 0), 1e-9);
                }
        }
}

/// The same at equal and nearly equal stretches away from rest, against differences.
TEST(Materials, OgdenDerivativesAtEqualStretches)
{
    const Material m = test::sample_material("ogden");
    const Ogden law  = Ogden::of(m);
    for (const double other : {1.3, 1.3001, 1.31})
        for (int k = 0; k < 9; ++k) {
            constexpr double h = 1e-5;
            Mat<3> up{{{1.3, 0, 0}, {0, other, 0}, {0, 0, 1.3}}}, down = up;
            Mat<3, Dual<>> F{};
            for (int c = 0; c < 9; ++c) F(c / 3, c % 3) = Dual<>(up(c / 3, c % 3), c == k ? 1.0 : 0.0);
            up(k / 3, k % 3) += h;
            down(k / 3, k % 3) -= h;
            const Stress<3, Dual<>> s = law.cauchy(F);
            const Stress<3> change    = (law.cauchy(up) + -1.0 * law.cauchy(down)) * (1 / (2 * h));
            for (int c = 0; c < s.size; ++c) EXPECT_NEAR(s.c[c].slope, change.c[c], 1e-6 * m.p_wave_modulus());
        }
}

}  // namespace
}  // namespace ordo
