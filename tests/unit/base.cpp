// Vectors, matrices, dual numbers and reductions.
#include "base/dual.hpp"
#include "base/parallel.hpp"
#include "base/vec.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

template <int D>
void check_inverse_and_cofactor()
{
    test::Random random(1);
    for (int k = 0; k < 50; ++k) {
        const Mat<D> A = test::random_deformation<D>(random, 0.5);
        const Mat<D> I = A * inverse(A);
        const Mat<D> C = transpose(A) * cofactor(A);
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) {
                EXPECT_NEAR(I(i, j), i == j, 1e-13);
                EXPECT_NEAR(C(i, j), i == j ? det(A) : 0.0, 1e-13);
            }
    }
}

TEST(Mat, InverseAndCofactor)
{
    check_inverse_and_cofactor<1>();
    check_inverse_and_cofactor<2>();
    check_inverse_and_cofactor<3>();
}

TEST(Mat, DeterminantOfAKnownMatrix)
{
    EXPECT_DOUBLE_EQ(det(Mat<3>{{{2, 1, 0}, {0, 3, 1}, {1, 0, 4}}}), 25.0);
    EXPECT_DOUBLE_EQ(det(Mat<2>{{{2, 1}, {3, 4}}}), 5.0);
}

TEST(Dual, FirstAndSecondDerivative)
{
    using Second   = Dual<Dual<double>>;
    const double x = 0.7;
    const Second X{{x, 1.0}, {1.0, 0.0}};
    const Second y = sin(X * X) / (exp(X) + Second(2.0)) + log(X) * sqrt(X) - cos(X);
    auto f         = [](double s) { return std::sin(s * s) / (std::exp(s) + 2) + std::log(s) * std::sqrt(s) - std::cos(s); };
    const double e = 1e-4;
    EXPECT_NEAR(y.value.value, f(x), 1e-15);
    EXPECT_NEAR(y.value.slope, (f(x + e) - f(x - e)) / (2 * e), 1e-7);
    EXPECT_EQ(y.value.slope, y.slope.value);
    EXPECT_NEAR(y.slope.slope, (f(x + e) - 2 * f(x) + f(x - e)) / (e * e), 1e-6);
}

TEST(Parallel, ReductionDoesNotDependOnThreads)
{
    const int before = thread_count();
    auto sum         = [] {
        return parallel_reduce(
                    100000, 0.0, [](std::ptrdiff_t i) { return 1.0 / (1.0 + static_cast<double>(i)); },
                    [](double& t, double v) { t += v; });
    };
    set_thread_count(1);
    const double one = sum();
    for (int n : {2, 3, 8}) {
        set_thread_count(n);
        EXPECT_EQ(sum(), one);
    }
    set_thread_count(before);
    EXPECT_NEAR(one, 12.090146129863428, 1e-12);
}

}  // namespace
}  // namespace ordo
