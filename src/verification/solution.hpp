// Exact and reference solutions, and manufactured solutions: from motion and material, everything else follows by automatic
// differentiation.
#pragma once

#include "base/stress.hpp"
#include "particles/batch.hpp"
#include "particles/particles.hpp"
#include "verification/jet.hpp"

#include <cmath>
#include <optional>

namespace ordo::verification {

/// An exact or a reference solution as a function of material point X and time.
template <int D>
class Solution {
  public:
    virtual ~Solution() = default;

    virtual Vec<D> position(const Vec<D>& X, double t) const    = 0;  ///< x, m
    virtual Vec<D> velocity(const Vec<D>& X, double t) const    = 0;  ///< m/s
    virtual Mat<D> deformation(const Vec<D>& X, double t) const = 0;  ///< F
    virtual Mat<D> stress(const Vec<D>& X, double t) const      = 0;  ///< Cauchy, Pa

    /// L = dv/dX F^-1, 1/s, by central differences: jets have no derivatives in space and time.
    Mat<D> velocity_gradient(const Vec<D>& X, double t) const
    {
        constexpr double step = 1e-5;
        Mat<D> dv{};
        for (int b = 0; b < D; ++b) {
            Vec<D> d{};
            d[b]               = step;
            const Vec<D> slope = (velocity(X + d, t) - velocity(X - d, t)) * (0.5 / step);
            for (int a = 0; a < D; ++a) dv(a, b) = slope[a];
        }
        return dv * inverse(deformation(X, t));
    }
};

/// x, v, a, F and the gradient of F at a material point, T = double or Lanes.
template <int D, class T>
struct Kinematics {
    Vec<D, T> x, v, a;
    Mat<D, Gradient<D, T>> F;
};

template <int D, class T, class Motion>
ORDO_FLAT inline Kinematics<D, T> kinematics(const Motion& motion, const Vec<D, T>& X, const T& t)
{
    using J = Jet<D, T>;
    Vec<D, J> at{};
    for (int a = 0; a < D; ++a) at[a] = J::variable(X[a], a);
    const Vec<D, J> x = motion(at, J::variable(t, D));
    Kinematics<D, T> r{};
    for (int i = 0; i < D; ++i) {
        r.x[i] = x[i].value;
        r.v[i] = x[i].rate();
        r.a[i] = x[i].acceleration();
        for (int j = 0; j < D; ++j) {
            r.F(i, j).value = x[i].slope[j];
            for (int k = 0; k < D; ++k) r.F(i, j).slope[k] = x[i].second(j, k);
        }
    }
    return r;
}

/// F' and its gradient: the kinematics of a time that carries its own derivative.
template <int D, class T, class Motion>
ORDO_FLAT inline Mat<D, Gradient<D, T>> deformation_rate(const Motion& motion, const Vec<D, T>& X, const T& t)
{
    using Timed = Gradient<1, T>;
    Vec<D, Timed> at{};
    for (int a = 0; a < D; ++a) at[a].value = X[a];
    Timed time;
    time.value    = t;
    time.slope[0] = T(1.0);
    const auto k  = kinematics(motion, at, time);
    Mat<D, Gradient<D, T>> rate{};
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
            rate(i, j).value = k.F(i, j).value.slope[0];
            for (int n = 0; n < D; ++n) rate(i, j).slope[n] = k.F(i, j).slope[n].slope[0];
        }
    return rate;
}

/// A law whose stress is a function of F and F'.
template <class Law, int D>
concept DependsOnRate = requires(const Law law, const Mat<D, Gradient<D>>& F)
{
    law.cauchy(F, F);
};

/// The Cauchy stress of a motion and its gradient.
template <int D, class T, class Motion, class Law>
ORDO_FLAT inline Stress<D, Gradient<D, T>> stress_of(const Motion& motion, const Law& law, const Mat<D, Gradient<D, T>>& F,
                                                     const Vec<D, T>& X, const T& t)
{
    if constexpr (DependsOnRate<Law, D>)
        return law.cauchy(F, deformation_rate(motion, X, t));
    else
        return law.cauchy(F);
}

/// Body force per mass that makes the motion a solution: b = a - Div P/rho0, P = sigma cof F, m/s^2.
template <int D, class T>
ORDO_FLAT inline Vec<D, T> body_force(const Kinematics<D, T>& k, const Stress<D, Gradient<D, T>>& sigma, double density)
{
    const auto P  = in_plane(sigma) * cofactor(k.F);
    Vec<D, T> b   = k.a;
    const T scale = T(-1.0 / density);
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) b[i] = b[i] + scale * P(i, j).slope[j];
    return b;
}

/// A motion of a material whose stress is a function of F (a hyperelastic law, or AnyLaw) or of F and F'.
template <int D, class Motion, class Law>
class Manufactured final : public Solution<D> {
  public:
    Manufactured(const Motion& motion, const Law& law, double density) : motion_(motion), law_(law), density_(density) {}

    Vec<D> position(const Vec<D>& X, double t) const override { return kinematics(motion_, X, t).x; }
    Vec<D> velocity(const Vec<D>& X, double t) const override { return kinematics(motion_, X, t).v; }
    Mat<D> deformation(const Vec<D>& X, double t) const override
    {
        const auto k = kinematics(motion_, X, t);
        Mat<D> F{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) F(i, j) = k.F(i, j).value;
        return F;
    }
    Mat<D> stress(const Vec<D>& X, double t) const override
    {
        const auto sigma = stress_of(motion_, law_, kinematics(motion_, X, t).F, X, t);
        Mat<D> r{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) r(i, j) = sigma(i, j).value;
        return r;
    }
    /// One particle at a time: the plain version of `fill_body_force`.
    Vec<D> force(const Vec<D>& X, double t) const { return body_force_at(X, t); }

    /// b of the particles [begin, end), eight at a time.
    void fill_body_force(const ParticleView<D>& p, std::ptrdiff_t begin, std::ptrdiff_t end, double t) const
    {
        const int last = static_cast<int>(end);
        for (int i = static_cast<int>(begin); i < last; i += Batch::size) {
            const Batch batch = Batch::of(i, last);
            store(p.b, batch, body_force_at(load(p.X, batch), Lanes(t)));
        }
    }

  private:
    template <class T>
    ORDO_FLAT Vec<D, T> body_force_at(const Vec<D, T>& X, const T& t) const
    {
        const auto k = kinematics(motion_, X, t);
        return body_force(k, stress_of(motion_, law_, k.F, X, t), density_);
    }

    Motion motion_;
    Law law_;
    double density_;
};

/// The material point that is at x at time t, by Newton's method in increments of time from the start; nothing if it fails.
template <int D>
std::optional<Vec<D>> material_point(const Solution<D>& solution, const Vec<D>& x, double t)
{
    constexpr int stages = 8, iterations = 30;
    constexpr double tolerance = 1e-13;
    Vec<D> X                   = x;
    for (int stage = 1; stage <= stages; ++stage) {
        const double s = t * stage / stages;
        for (int k = 0; k < iterations; ++k) {
            const Vec<D> step = inverse(solution.deformation(X, s)) * (x - solution.position(X, s));
            X += step;
            if (!std::isfinite(norm(X))) return std::nullopt;
            if (norm(step) <= tolerance * (1 + norm(X))) break;
        }
    }
    if (norm(x - solution.position(X, t)) > 1e-10 * (1 + norm(x))) return std::nullopt;
    return X;
}

}  // namespace ordo::verification
