// Forward automatic differentiation of motions and materials, which are templates on their scalar: a motion takes Jets (first
// and second derivatives in space and time), a material Gradients. T is double or eight doubles (Lanes).
#pragma once

#include "base/config.hpp"
#include "base/lane_math.hpp"

namespace ordo::verification {

/// A value and its gradient with respect to N variables.
template <int N, class T = double>
struct Gradient {
    T value{};
    T slope[N]{};

    Gradient() = default;
    ORDO_FLAT Gradient(double constant) : value(T(constant)) {}

    ORDO_FLAT Gradient& operator+=(const Gradient& o)
    {
        value = value + o.value;
        for (int i = 0; i < N; ++i) slope[i] = slope[i] + o.slope[i];
        return *this;
    }
    ORDO_FLAT Gradient& operator-=(const Gradient& o) { return *this += -o; }
    ORDO_FLAT Gradient& operator*=(const Gradient& o) { return *this = *this * o; }

    friend ORDO_FLAT Gradient operator+(Gradient a, const Gradient& b) { return a += b; }
    friend ORDO_FLAT Gradient operator-(Gradient a, const Gradient& b) { return a -= b; }
    friend ORDO_FLAT Gradient operator-(Gradient a)
    {
        a.value = -a.value;
        for (int i = 0; i < N; ++i) a.slope[i] = -a.slope[i];
        return a;
    }
    friend ORDO_FLAT Gradient operator*(const Gradient& a, const Gradient& b)
    {
        Gradient r;
        r.value = a.value * b.value;
        for (int i = 0; i < N; ++i) r.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
        return r;
    }
    friend ORDO_FLAT Gradient operator/(const Gradient& a, const Gradient& b)
    {
        Gradient r;
        const T inverse = T(1.0) / b.value;
        r.value         = a.value * inverse;
        for (int i = 0; i < N; ++i) r.slope[i] = (a.slope[i] - r.value * b.slope[i]) * inverse;
        return r;
    }
    /// f(a) from f and f' at a.value.
    friend ORDO_FLAT Gradient chain(const Gradient& a, const T& f, const T& f1)
    {
        Gradient r;
        r.value = f;
        for (int i = 0; i < N; ++i) r.slope[i] = f1 * a.slope[i];
        return r;
    }
    friend ORDO_FLAT Gradient exp(const Gradient& a)
    {
        const T f = exp(a.value);
        return chain(a, f, f);
    }
    friend ORDO_FLAT Gradient log(const Gradient& a) { return chain(a, log(a.value), T(1.0) / a.value); }
    friend ORDO_FLAT Gradient sin(const Gradient& a) { return chain(a, sin(a.value), cos(a.value)); }
    friend ORDO_FLAT Gradient cos(const Gradient& a) { return chain(a, cos(a.value), -1.0 * sin(a.value)); }
    friend ORDO_FLAT Gradient sqrt(const Gradient& a)
    {
        const T f = sqrt(a.value);
        return chain(a, f, T(0.5) / f);
    }
    friend ORDO_FLAT Gradient choose(const Gradient& condition, const Gradient& a, const Gradient& b)
    {
        Gradient r;
        r.value = choose(condition.value, a.value, b.value);
        for (int i = 0; i < N; ++i) r.slope[i] = choose(condition.value, a.slope[i], b.slope[i]);
        return r;
    }
    friend ORDO_FLAT Gradient larger(const Gradient& a, const Gradient& b) { return choose(a - b, a, b); }
    friend ORDO_FLAT bool any_positive(const Gradient& a) { return any_positive(a.value); }
};

/// A value with its derivatives in space and time: the gradient and the Hessian with respect to D coordinates, the first
/// and second derivative in time, no mixed ones.
template <int D, class T = double>
struct Jet {
    static constexpr int pairs = D * (D + 1) / 2;

    T value{};
    T slope[D + 1]{};          ///< with respect to the coordinates, then to time
    T curvature[pairs + 1]{};  ///< entries i <= j of the Hessian, see `at`, then with respect to time

    Jet() = default;
    ORDO_FLAT Jet(double constant) : value(T(constant)) {}
    /// Coordinate i, or for i = D the time.
    ORDO_FLAT static Jet variable(const T& value, int i)
    {
        Jet r;
        r.value    = value;
        r.slope[i] = T(1.0);
        return r;
    }
    ORDO_FLAT static constexpr int at(int i, int j) { return i <= j ? j * (j + 1) / 2 + i : at(j, i); }
    /// The derivative of the i-th slope along coordinate j.
    ORDO_FLAT const T& second(int i, int j) const { return curvature[at(i, j)]; }
    ORDO_FLAT const T& rate() const { return slope[D]; }
    ORDO_FLAT const T& acceleration() const { return curvature[pairs]; }

    /// f(i, j, k) for each second derivative, entry k, with respect to variables i and j.
    template <class F>
    ORDO_FLAT static void for_each_pair(F&& f)
    {
        for (int j = 0; j < D; ++j)
            for (int i = 0; i <= j; ++i) f(i, j, at(i, j));
        f(D, D, pairs);
    }

    /// f(a) from f, f' and f'' at a.value.
    friend ORDO_FLAT Jet chain(const Jet& a, const T& f, const T& f1, const T& f2)
    {
        Jet r;
        r.value = f;
        for (int i = 0; i <= D; ++i) r.slope[i] = f1 * a.slope[i];
        for_each_pair([&](int i, int j, int k) { r.curvature[k] = f1 * a.curvature[k] + f2 * a.slope[i] * a.slope[j]; });
        return r;
    }
    friend ORDO_FLAT Jet operator+(Jet a, const Jet& b)
    {
        a.value = a.value + b.value;
        for (int i = 0; i <= D; ++i) a.slope[i] = a.slope[i] + b.slope[i];
        for (int k = 0; k <= pairs; ++k) a.curvature[k] = a.curvature[k] + b.curvature[k];
        return a;
    }
    friend ORDO_FLAT Jet operator-(const Jet& a, const Jet& b) { return a + -1.0 * b; }
    friend ORDO_FLAT Jet operator*(const Jet& a, const Jet& b)
    {
        Jet r;
        r.value = a.value * b.value;
        for (int i = 0; i <= D; ++i) r.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
        for_each_pair([&](int i, int j, int k) {
            r.curvature[k] =
                a.curvature[k] * b.value + a.value * b.curvature[k] + a.slope[i] * b.slope[j] + a.slope[j] * b.slope[i];
        });
        return r;
    }
    friend ORDO_FLAT Jet operator*(double s, Jet a)
    {
        a.value = s * a.value;
        for (int i = 0; i <= D; ++i) a.slope[i] = s * a.slope[i];
        for (int k = 0; k <= pairs; ++k) a.curvature[k] = s * a.curvature[k];
        return a;
    }
    friend ORDO_FLAT Jet operator+(Jet a, double s)
    {
        a.value = a.value + T(s);
        return a;
    }
    friend ORDO_FLAT Jet operator-(const Jet& a, double s) { return a + -s; }

    friend ORDO_FLAT Jet sin(const Jet& a)
    {
        const T s = sin(a.value), c = cos(a.value);
        return chain(a, s, c, -s);
    }
    friend ORDO_FLAT Jet cos(const Jet& a)
    {
        const T s = sin(a.value), c = cos(a.value);
        return chain(a, c, -s, -c);
    }
    friend ORDO_FLAT Jet log(const Jet& a)
    {
        const T f1 = T(1.0) / a.value;
        return chain(a, log(a.value), f1, -f1 * f1);
    }
    friend ORDO_FLAT Jet choose(const Jet& condition, const Jet& a, const Jet& b)
    {
        Jet r;
        r.value = choose(condition.value, a.value, b.value);
        for (int i = 0; i <= D; ++i) r.slope[i] = choose(condition.value, a.slope[i], b.slope[i]);
        for (int k = 0; k <= pairs; ++k) r.curvature[k] = choose(condition.value, a.curvature[k], b.curvature[k]);
        return r;
    }
    friend ORDO_FLAT Jet operator/(const Jet& a, const Jet& b)
    {
        const T f = T(1.0) / b.value, f1 = -1.0 * f * f;
        return a * chain(b, f, f1, -2.0 * f * f1);
    }
    friend ORDO_FLAT Jet sqrt(const Jet& a)
    {
        const T r = sqrt(a.value), f1 = T(0.5) / r;
        return chain(a, r, f1, -0.5 * f1 / a.value);
    }
};

}  // namespace ordo::verification
