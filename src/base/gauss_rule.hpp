// Gauss' rule on the unit interval.
#pragma once

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace ordo {

struct GaussPoint {
    double at, weight;
};

/// The n points of Gauss' rule on [0, 1], ascending, and their weights, which sum to 1. Newton's method on Legendre
/// polynomials finds them.
inline std::vector<GaussPoint> gauss_rule(int n)
{
    std::vector<GaussPoint> rule;
    for (int i = 0; i < n; ++i) {
        double x = -std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 0.0;
        for (int k = 0; k < 100; ++k) {
            double before = 1.0, value = x;
            for (int j = 2; j <= n; ++j) before = std::exchange(value, ((2 * j - 1) * x * value - (j - 1) * before) / j);
            slope             = n * (x * value - before) / (x * x - 1);
            const double step = value / slope;
            x -= step;
            if (std::fabs(step) < 1e-16) break;
        }
        rule.push_back({0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)});
    }
    return rule;
}

}  // namespace ordo
