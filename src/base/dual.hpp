// Dual numbers a + b eps, eps^2 = 0: forward differentiation of anything templated on its scalar.
// Nesting, Dual<Dual<double>>, gives second derivatives. Used by materials' tests and by manufactured solutions.
#pragma once

#include "base/config.hpp"

#include <cmath>

namespace ordo {

/// Value and derivative along one direction.
template <class T = double>
struct Dual {
    T value{};
    T slope{};

    constexpr Dual() = default;
    ORDO_HD constexpr Dual(double v) : value(v), slope(0.0) {}
    ORDO_HD constexpr Dual(T v, T s) : value(v), slope(s) {}

    ORDO_HD constexpr Dual& operator+=(const Dual& o) { return *this = *this + o; }
    ORDO_HD constexpr Dual& operator-=(const Dual& o) { return *this = *this - o; }
    ORDO_HD constexpr Dual& operator*=(const Dual& o) { return *this = *this * o; }
    ORDO_HD constexpr Dual& operator/=(const Dual& o) { return *this = *this / o; }

    friend ORDO_HD constexpr Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.slope + b.slope}; }
    friend ORDO_HD constexpr Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.slope - b.slope}; }
    friend ORDO_HD constexpr Dual operator-(const Dual& a) { return {-a.value, -a.slope}; }
    friend ORDO_HD constexpr Dual operator*(const Dual& a, const Dual& b)
    {
        return {a.value * b.value, a.slope * b.value + a.value * b.slope};
    }
    friend ORDO_HD constexpr Dual operator/(const Dual& a, const Dual& b)
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

template <class T>
ORDO_HD Dual<T> log(const Dual<T>& a)
{
    return {log(a.value), a.slope / a.value};
}
template <class T>
ORDO_HD Dual<T> exp(const Dual<T>& a)
{
    const T e = exp(a.value);
    return {e, e * a.slope};
}
template <class T>
ORDO_HD Dual<T> sqrt(const Dual<T>& a)
{
    const T r = sqrt(a.value);
    return {r, a.slope / (r + r)};
}
template <class T>
ORDO_HD Dual<T> sin(const Dual<T>& a)
{
    return {sin(a.value), cos(a.value) * a.slope};
}
template <class T>
ORDO_HD Dual<T> cos(const Dual<T>& a)
{
    return {cos(a.value), -(sin(a.value) * a.slope)};
}

}  // namespace ordo
