// Exact sums: against integers and long double, in any order and however they are split.
#include "base/exact_sum.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <random>
#include <vector>

namespace ordo {
namespace {

double sum_of(const std::vector<double>& terms)
{
    ExactSum sum;
    for (const double x : terms) sum += x;
    return sum.value();
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ExactSum, IsThatOfIntegers)
{
    std::mt19937_64 random(1);
    for (int trial = 0; trial < 200; ++trial) {
        const int exponent = static_cast<int>(random() % 1900) - 1074;  // of the last bit; below -1022 - 52 they are denormal
        std::vector<double> terms;
        long double exact = 0;  // 64 bits: exact for 2^10 terms of 53 bits
        for (int k = 0; k < 1000; ++k) {
            const auto mantissa = static_cast<std::int64_t>(random() >> 11) * (random() % 2 ? 1 : -1);
            exact += static_cast<long double>(mantissa);
            terms.push_back(std::ldexp(static_cast<double>(mantissa), exponent));
        }
        const double expected = static_cast<double>(std::ldexp(exact, exponent));
        EXPECT_EQ(sum_of(terms), expected);
        std::shuffle(terms.begin(), terms.end(), random);
        EXPECT_EQ(sum_of(terms), expected);
        ExactSum parts[3], all;
        for (std::size_t k = 0; k < terms.size(); ++k) parts[k * k % 3] += terms[k];
        for (const ExactSum& one : parts) all += one;
        EXPECT_EQ(all.value(), expected);
    }
}

TEST(ExactSum, LosesNothingBesideLargeTerms)
{
    std::mt19937_64 random(2);
    std::vector<double> terms;
    for (int k = 0; k < 500; ++k) {
        const double x =
            std::ldexp(1.0 + static_cast<double>(random() >> 12) * 0x1p-52, static_cast<int>(random() % 2000) - 1000);
        terms.push_back(x);
        terms.push_back(-x);
    }
    for (const double rest : {0.0, DBL_TRUE_MIN, -3 * DBL_TRUE_MIN, 1.0, -0.1, DBL_MIN, DBL_MAX}) {
        terms.push_back(rest);
        std::shuffle(terms.begin(), terms.end(), random);
        EXPECT_EQ(sum_of(terms), rest);
        terms.erase(std::find(terms.begin(), terms.end(), rest));
    }
}

TEST(ExactSum, RoundsToNearestTiesToEven)
{
    const double up = std::nextafter(1.0, 2.0), upper = std::nextafter(up, 2.0);
    EXPECT_EQ(sum_of({1.0, 0x1p-53}), 1.0);
    EXPECT_EQ(sum_of({1.0, 0x1p-53, DBL_TRUE_MIN}), up);
    EXPECT_EQ(sum_of({1.0, 0x1p-53, -DBL_TRUE_MIN}), 1.0);
    EXPECT_EQ(sum_of({up, 0x1p-53}), upper);
    EXPECT_EQ(sum_of({up, 0x1p-53, -0x1p-200}), up);
    EXPECT_EQ(sum_of({-1.0, -0x1p-53, -DBL_TRUE_MIN}), -up);
    EXPECT_EQ(sum_of({2.0, -0x1p-54}), 2.0);  // a carry that runs through the mantissa
    EXPECT_EQ(sum_of({DBL_MIN, -DBL_TRUE_MIN}), DBL_MIN - DBL_TRUE_MIN);
}

TEST(ExactSum, HasInfinitiesAndNaN)
{
    EXPECT_EQ(sum_of({}), 0.0);
    EXPECT_EQ(sum_of({DBL_MAX, DBL_MAX}), kInfinity);
    EXPECT_EQ(sum_of({DBL_MAX, DBL_MAX, -DBL_MAX}), DBL_MAX);
    EXPECT_EQ(sum_of({1.0, kInfinity}), kInfinity);
    EXPECT_EQ(sum_of({-kInfinity, DBL_MAX}), -kInfinity);
    EXPECT_TRUE(std::isnan(sum_of({kInfinity, 1.0, -kInfinity})));
    EXPECT_TRUE(std::isnan(sum_of({1.0, std::nan("")})));
}

TEST(ExactSum, ForgetsWhatIsCleared)
{
    ExactSum sum;
    sum += DBL_MAX;
    sum += DBL_TRUE_MIN;
    sum += kInfinity;
    sum.clear();
    EXPECT_EQ(sum.value(), 0.0);
    sum += 0.1;
    EXPECT_EQ(sum.value(), 0.1);
}

}  // namespace
}  // namespace ordo
