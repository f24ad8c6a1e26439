// A one-dimensional updated-Lagrangian finite element bar: the reference of `bar-large-strain`. Linear elements, lumped
// mass, symplectic Euler, the rate law sigma' = E dv/dx; after Bathe, Ramm & Wilson (1975), as Wobbes et al. (2020) use it.
#pragma once

#include "verification/solution.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ordo::verification {

/// A bar between fixed ends 0 and `length` with v(X, 0) = v0 sin(pi X/length), computed up to `end`. Known at time 0 and at `end`,
/// where velocities are those at end - dt/2, with the steps of the method that is compared.
class FiniteElementBar final : public Solution<1> {
  public:
    struct Setting {
        double length, density, young, speed;  // m, kg/m, Pa, m/s
        int elements;
        double dt, end;  // s
    };

    explicit FiniteElementBar(const Setting& s) : setting_(s), size_(s.length / s.elements)
    {
        const int n = s.elements;
        x_.resize(n + 1);
        v_.resize(n + 1);
        sigma_.assign(n, 0.0);
        for (int i = 0; i <= n; ++i) {
            x_[i] = i * size_;
            v_[i] = start_velocity(x_[i]);
        }
        const long steps = std::lround(s.end / s.dt);
        const double dt = s.end / static_cast<double>(steps), m = s.density * size_;
        for (long k = 0; k < steps; ++k) {
            const double kick = k == 0 ? dt / 2 : dt;  // velocities live at half steps
            for (int i = 1; i < n; ++i) v_[i] += kick * (sigma_[i] - sigma_[i - 1]) / m;
            v_[0] = v_[n] = 0.0;
            for (int e = 0; e < n; ++e) sigma_[e] += s.young * dt * (v_[e + 1] - v_[e]) / (x_[e + 1] - x_[e]);
            for (int i = 1; i < n; ++i) x_[i] += dt * v_[i];
        }
    }

    Vec<1> position(const Vec<1>& X, double t) const override { return {t > 0 ? at_nodes(x_, X[0]) : X[0]}; }
    Vec<1> velocity(const Vec<1>& X, double t) const override { return {t > 0 ? at_nodes(v_, X[0]) : start_velocity(X[0])}; }
    Mat<1> deformation(const Vec<1>& X, double t) const override
    {
        if (!(t > 0)) return Mat<1>::identity();
        const int e = std::clamp(static_cast<int>(X[0] / size_), 0, setting_.elements - 1);
        return {{{(x_[e + 1] - x_[e]) / size_}}};
    }
    /// Interpolated between the midpoints of the elements.
    Mat<1> stress(const Vec<1>& X, double t) const override
    {
        if (!(t > 0)) return {};
        const double y = X[0] / size_ - 0.5;
        const int e    = std::clamp(static_cast<int>(std::floor(y)), 0, setting_.elements - 2);
        return {{{sigma_[e] + (y - e) * (sigma_[e + 1] - sigma_[e])}}};
    }

  private:
    double start_velocity(double X) const { return setting_.speed * std::sin(std::numbers::pi * X / setting_.length); }
    double at_nodes(const std::vector<double>& f, double X) const
    {
        const int e    = std::clamp(static_cast<int>(X / size_), 0, setting_.elements - 1);
        const double y = X / size_ - e;
        return f[e] + y * (f[e + 1] - f[e]);
    }

    Setting setting_;
    double size_;
    std::vector<double> x_, v_, sigma_;
};

}  // namespace ordo::verification
