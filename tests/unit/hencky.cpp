// Principal axes, logarithms and exponentials of symmetric tensors.
#include "material/hencky.hpp"
#include "support/particles.hpp"
#include "support/rate_equations.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

template <int D>
Symmetric<D> random_stretch(test::Random& random, double size)
{
    Symmetric<D> b = left_cauchy_green(test::random_deformation<D>(random, size));
    for (int a = D; a < 3; ++a) b(a, a) = 1 + test::uniform(random, -size, size);
    return b;
}

template <int D>
double distance(const Symmetric<D>& a, const Symmetric<D>& b)
{
    return std::sqrt(square(a + -1.0 * b));
}

/// The logarithm by Eigen.
template <int D>
Symmetric<D> reference_log(const Symmetric<D>& b)
{
    const Mat<3> m = full(b);
    test::Tensor t;
    for (int c = 0; c < 9; ++c) t(c / 3, c % 3) = m(c / 3, c % 3);
    const test::Tensor l = test::log_of(t) / 2;
    Symmetric<D> r{};
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j)
            if (i == j || j < D) r(i, j) = l(i, j);
    return r;
}

/// Sizes of strains around the limit of the series, tiny, and large; two equal values too.
template <int D>
void check_logarithm()
{
    test::Random random(11);
    for (const double size : {1e-9, 1e-3, 0.02, 0.03, 0.04, 0.05, 0.3, 0.6}) {
        for (int k = 0; k < 100; ++k) {
            Symmetric<D> b = random_stretch<D>(random, size);
            if (k == 0) b = isotropic<D>(1 + size);
            if (k == 1) b = isotropic<D>(1.0), b(0, 0) = 1 + size;
            const HenckyStrain<D> e = hencky_strain(b);
            const Symmetric<D> all  = e.dev + isotropic<D>(e.theta / 3);
            EXPECT_LT(distance(all, reference_log(b)), 4e-15 * (1 + square(b))) << size;
            EXPECT_LT(distance(stretched(e), b), 1e-14 * (1 + square(b))) << size;
            EXPECT_NEAR(trace(e.dev), 0, 1e-14);
        }
    }
}
TEST(Hencky, LogarithmAndExponential)
{
    check_logarithm<1>();
    check_logarithm<2>();
    check_logarithm<3>();
}

template <int D>
void check_spectrum()
{
    test::Random random(12);
    for (int k = 0; k < 500; ++k) {
        Symmetric<D> s{};
        for (double& c : s.c) c = test::uniform(random, -1, 1) * (k % 3 == 0 ? 1e-9 : 1.0);
        if (k % 5 == 0) s(0, 0) = s(1, 1) = 1.0;
        if (k % 7 == 0) s = isotropic<D>(0.0);
        const Spectrum<D> r = spectrum(s);
        EXPECT_LT(distance(compose(r.value, r.axes), s), 4e-15);
        const Mat<D> one = transpose(r.axes) * r.axes;
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) EXPECT_NEAR(one(i, j), i == j, 3e-15);
    }
}
TEST(Hencky, PrincipalAxes)
{
    check_spectrum<2>();
    check_spectrum<3>();
}

/// Five sweeps of rotations leave nothing off the diagonal, also of tensors with close and equal values; `spectrum` takes six.
TEST(Hencky, SweepsAreEnough)
{
    test::Random random(15);
    double worst = 0;
    for (int k = 0; k < 20000; ++k) {
        Mat<3> m{}, axes = Mat<3>::identity();
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j)
                m(i, j) = m(j, i) = test::uniform(random, -1, 1) * std::pow(10.0, -test::uniform(random, 0, 12));
        if (k % 2 == 0)
            for (int a = 0; a < 3; ++a) m(a, a) += 1;
        double largest = 0;
        for (int c = 0; c < 9; ++c) largest = std::max(largest, std::fabs(m(c / 3, c % 3)));
        for (int sweep = 0; sweep < 5; ++sweep) {
            rotate_jacobi(m, axes, 0, 1);
            rotate_jacobi(m, axes, 0, 2);
            rotate_jacobi(m, axes, 1, 2);
        }
        worst = std::max({worst, std::fabs(m(0, 1)) / largest, std::fabs(m(0, 2)) / largest, std::fabs(m(1, 2)) / largest});
    }
    EXPECT_LT(worst, 1e-16);
}

/// The smaller stretch of a shear of 1000 keeps its digits in 2D.
TEST(Hencky, LargeShearKeepsTheSmallStretch)
{
    const double g = 1000, e = std::asinh(g / 2);
    const HenckyStrain<2> strain = hencky_strain(left_cauchy_green(Mat<2>{{{1, g}, {0, 1}}}));
    EXPECT_NEAR(strain.theta, 0, 1e-9);
    EXPECT_NEAR(std::sqrt(square(strain.dev)), std::sqrt(2.0) * e, 1e-9);
}

/// Just below the limit of the series, where their last terms count.
TEST(Hencky, SeriesKeepTheirDigits)
{
    const double e = 0.999 * kSmallStrain / std::sqrt(2.0);
    for (const double sign : {1.0, -1.0}) {
        const Symmetric<3> b{{std::exp(2 * sign * e), std::exp(-2 * sign * e), 1.0, 0.0, 0.0, 0.0}};
        const HenckyStrain<3> strain = hencky_strain(b);
        EXPECT_NEAR(strain.dev(0, 0), sign * e, 4e-16);
        EXPECT_NEAR(strain.dev(1, 1), -sign * e, 4e-16);
        EXPECT_NEAR(strain.theta, 0, 4e-16);
        EXPECT_NEAR(stretched(strain)(0, 0), b(0, 0), 5e-16);
    }
}

/// No lane depends on its neighbours, to the last bit: those beyond the limit of the series go another way.
TEST(Hencky, LanesAreAlone)
{
    test::Random random(14);
    for (int n = 0; n < 20; ++n) {
        const Symmetric<3> own = random_stretch<3>(random, 0.01), other = random_stretch<3>(random, 0.4);
        Symmetric<3, Lanes> calm{}, mixed{};
        for (int k = 0; k < own.size; ++k) {
            calm.c[k] = mixed.c[k] = Lanes(own.c[k]);
            mixed.c[k][5]          = other.c[k];
        }
        const HenckyStrain<3, Lanes> a = hencky_strain(calm), b = hencky_strain(mixed);
        const Symmetric<3, Lanes> c = stretched(a), d = stretched(b);
        EXPECT_EQ(a.theta[0], b.theta[0]);
        for (int k = 0; k < own.size; ++k) {
            EXPECT_EQ(a.dev.c[k][0], b.dev.c[k][0]);
            EXPECT_EQ(c.c[k][0], d.c[k][0]);
        }
    }
}

}  // namespace
}  // namespace ordo
