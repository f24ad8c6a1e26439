// Vectors, matrices, dual numbers, lanes, batches and reductions.
#include "base/dual.hpp"
#include "base/parallel.hpp"
#include "base/vec.hpp"
#include "particles/batch.hpp"
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

TEST(Lanes, LargerAndSmallerTakeTheFirstWhereTheSecondIsNoNumber)
{
    const double none = std::nan(""), inf = INFINITY;
    const Lanes a = make_lanes(1, -2, 3, none, -inf, 5, none, -7), b = make_lanes(2, -3, none, 4, inf, 5, none, 7);
    const double large[8] = {2, -2, 3, none, inf, 5, none, 7}, small[8] = {1, -3, 3, none, -inf, 5, none, -7};
    for (int k = 0; k < 8; ++k) {
        auto expect = [k](double found, double wanted) {
            EXPECT_TRUE(found == wanted || (std::isnan(found) && std::isnan(wanted))) << k << ": " << found << ", " << wanted;
        };
        expect(larger(a, b)[k], large[k]);
        expect(smaller(a, b)[k], small[k]);
        expect(fabs(a)[k], std::fabs(a[k]));
    }
}

/// Batches of every size, from the third particle on.
template <int N>
void check_batches()
{
    std::vector<double> field(N * 12);
    for (std::size_t i = 0; i < field.size(); ++i) field[i] = static_cast<double>(i);
    for (int count = 1; count <= Batch::size; ++count) {
        const Batch b{2, count};
        Lanes number[N];
        load(field.data(), b, number);
        std::vector<double> stored(field.size(), -1.0);
        store(stored.data(), b, number);
        for (int c = 0; c < N; ++c) {
            for (int k = 0; k < Batch::size; ++k) EXPECT_EQ(number[c][k], field[static_cast<std::size_t>(b.particle(k) * N + c)]);
            for (int i = 0; i < 12; ++i) {
                const std::size_t at = static_cast<std::size_t>(i * N + c);
                EXPECT_EQ(stored[at], i >= 2 && i < 2 + count ? field[at] : -1.0) << N << " numbers, " << count << " particles";
            }
        }
    }
}

TEST(Batch, LoadsAndStoresItsParticlesAlone)
{
    check_batches<1>();
    check_batches<2>();
    check_batches<3>();
    check_batches<4>();
    check_batches<6>();
    check_batches<9>();
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
