// Dual numbers a + b eps, eps^2 = 0: forward differentiation of anything templated on its scalar, double or Lanes.
// Nesting, Dual<Dual<double>>, gives second derivatives. Used by laws, for their tangents, and by tests.
#pragma once

#include "base/lanes.hpp"

#include <cmath>
#include <type_traits>

namespace ordo {

/// Value and derivative along one direction. What is decided, is decided by values; slopes follow the branch taken.
template <class T = double>
struct Dual {
    T value{};
    T slope{};

    constexpr Dual() = default;
    ORDO_FLAT constexpr Dual(double v) : value(v), slope(0.0) {}
    ORDO_FLAT constexpr explicit Dual(const T& v) requires(!std::is_same_v<T, double>) : value(v), slope(0.0) {}
    ORDO_FLAT constexpr Dual(T v, T s) : value(v), slope(s) {}

    ORDO_FLAT constexpr Dual& operator+=(const Dual& o) { return *this = *this + o; }
    ORDO_FLAT constexpr Dual& operator-=(const Dual& o) { return *this = *this - o; }
    ORDO_FLAT constexpr Dual& operator*=(const Dual& o) { return *this = *this * o; }
    ORDO_FLAT constexpr Dual& operator/=(const Dual& o) { return *this = *this / o; }

    friend ORDO_FLAT constexpr Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.slope + b.slope}; }
    friend ORDO_FLAT constexpr Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.slope - b.slope}; }
    friend ORDO_FLAT constexpr Dual operator-(const Dual& a) { return {-a.value, -a.slope}; }
    friend ORDO_FLAT constexpr Dual operator*(const Dual& a, const Dual& b)
    {
        return {a.value * b.value, a.slope * b.value + a.value * b.slope};
    }
    friend ORDO_FLAT constexpr Dual operator/(const Dual& a, const Dual& b)
    {
        const T q = a.value / b.value;
        return {q, (a.slope - q * b.slope) / b.value};
    }
};

using std::cos;
using std::exp;
using std::log;
using std::sin;
using std::sqrt;

/// The parts of what is not chosen do not matter, not even NaN.
template <class T>
ORDO_FLAT inline Dual<T> choose(const Dual<T>& condition, const Dual<T>& a, const Dual<T>& b)
{
    return {choose(condition.value, a.value, b.value), choose(condition.value, a.slope, b.slope)};
}
template <class T>
ORDO_FLAT inline bool any_positive(const Dual<T>& a)
{
    return any_positive(a.value);
}
/// As for numbers: `a` where both are equal.
template <class T>
ORDO_FLAT inline Dual<T> larger(const Dual<T>& a, const Dual<T>& b)
{
    return choose(b - a, b, a);
}
template <class T>
ORDO_FLAT inline Dual<T> smaller(const Dual<T>& a, const Dual<T>& b)
{
    return choose(a - b, b, a);
}
template <class T>
ORDO_FLAT inline Dual<T> fabs(const Dual<T>& a)
{
    return larger(a, -a);
}

template <class T>
ORDO_FLAT inline Dual<T> log(const Dual<T>& a)
{
    return {log(a.value), a.slope / a.value};
}
template <class T>
ORDO_FLAT inline Dual<T> exp(const Dual<T>& a)
{
    const T e = exp(a.value);
    return {e, e * a.slope};
}
/// The slope of the root of zero is zero, the mean of those on both sides if it is the norm of a vector.
template <class T>
ORDO_FLAT inline Dual<T> sqrt(const Dual<T>& a)
{
    const T r = sqrt(a.value);
    return {r, choose(a.value, a.slope / (r + r), T(0.0))};
}
template <class T>
ORDO_FLAT inline Dual<T> sin(const Dual<T>& a)
{
    return {sin(a.value), cos(a.value) * a.slope};
}
template <class T>
ORDO_FLAT inline Dual<T> cos(const Dual<T>& a)
{
    return {cos(a.value), -(sin(a.value) * a.slope)};
}

/// The number of a scalar without its derivatives, and a scalar without derivatives.
template <class T>
ORDO_FLAT constexpr auto primal(const T& x)
{
    if constexpr (requires { x.value; })
        return primal(x.value);
    else
        return x;
}
template <class T, class P>
ORDO_FLAT constexpr void set_primal(T& x, const P& number)
{
    if constexpr (requires { x.value; })
        set_primal(x.value, number);
    else
        x = number;
}
template <class T, class P>
ORDO_FLAT constexpr T without_slope(const P& number)
{
    T r(0.0);
    set_primal(r, number);
    return r;
}

/// A root x of a residual, found without slopes, with that slope which keeps the residual zero. `residual` is that of x without
/// a slope, `by_x` its derivative by x (theorem of the implicit function).
template <class T>
ORDO_FLAT inline Dual<T> as_root(const T& x, const Dual<T>& residual, const T& by_x)
{
    return {x, -1.0 * residual.slope / by_x};
}

}  // namespace ordo
