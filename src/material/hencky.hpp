// Symmetric tensors in principal axes: logarithms, exponentials and products of the elastic left Cauchy-Green tensor b_e, for
// laws that carry it. Templates on the scalar, double or Lanes, or Dual of these; no lane depends on its neighbours.
#pragma once

#include "base/dual.hpp"
#include "base/lane_math.hpp"
#include "base/stress.hpp"

namespace ordo {

/// A symmetric tensor with the normal components across the problem, stored like a stress.
template <int D, class T = double>
using Symmetric = Stress<D, T>;

template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> isotropic(const T& s)
{
    Symmetric<D, T> r{};
    for (int a = 0; a < 3; ++a) r.c[a] = s;
    for (int k = 3; k < r.size; ++k) r.c[k] = T(0.0);
    return r;
}

/// Reads and writes the components in an array of history.
template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> read_symmetric(const T* from)
{
    Symmetric<D, T> r{};
    for (int k = 0; k < r.size; ++k) r.c[k] = from[k];
    return r;
}
template <int D, class T>
ORDO_FLAT constexpr void write_symmetric(const Symmetric<D, T>& s, T* to)
{
    for (int k = 0; k < s.size; ++k) to[k] = s.c[k];
}

template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> choose(const T& condition, const Symmetric<D, T>& a, const Symmetric<D, T>& b)
{
    Symmetric<D, T> r{};
    for (int k = 0; k < r.size; ++k) r.c[k] = choose(condition, a.c[k], b.c[k]);
    return r;
}

template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> deviator(Symmetric<D, T> s)
{
    const T mean = trace(s) * T(1.0 / 3);
    for (int a = 0; a < 3; ++a) s.c[a] -= mean;
    return s;
}

/// F F^T; lengths across the problem stay as they are.
template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> left_cauchy_green(const Mat<D, T>& F)
{
    return make_stress(F * transpose(F), T(1.0));
}

/// (I + G) b (I + G)^T; components across the problem stay as they are.
template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> pushed(const Mat<D, T>& G, const Symmetric<D, T>& b)
{
    const Mat<D, T> f    = Mat<D, T>::identity() + G;
    const Mat<D, T> half = f * in_plane(b);
    Symmetric<D, T> r    = b;
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) {
            T sum = half(i, 0) * f(j, 0);
            for (int k = 1; k < D; ++k) sum += half(i, k) * f(j, k);
            r(i, j) = sum;
        }
    return r;
}

/// a b of symmetric tensors with the same principal axes, so that the product is symmetric too.
template <int D, class T>
ORDO_FLAT constexpr Symmetric<D, T> coaxial_product(const Symmetric<D, T>& a, const Symmetric<D, T>& b)
{
    Symmetric<D, T> r{};
    for (int i = D; i < 3; ++i) r(i, i) = a(i, i) * b(i, i);
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) {
            T sum = a(i, 0) * b(0, j);
            for (int k = 1; k < D; ++k) sum += a(i, k) * b(k, j);
            r(i, j) = sum;
        }
    return r;
}

/// Principal values and, in columns, unit vectors of a symmetric tensor. Values D, .. are those across the problem.
template <int D, class T = double>
struct Spectrum {
    T value[3];
    Mat<D, T> axes;
};

/// A Jacobi rotation in the plane of axes p and q that makes m(p, q) zero (Golub & Van Loan 2013, algorithm 8.5.1).
template <int D, class T>
ORDO_FLAT inline void rotate_jacobi(Mat<D, T>& m, Mat<D, T>& axes, int p, int q)
{
    const T off = m(p, q), gap = m(q, q) - m(p, p), sign = choose(gap, T(1.0), T(-1.0));
    constexpr double tiny = 1e-300;  // no rotation where gap and off are zero
    const T t             = T(2.0) * sign * off / (sign * gap + sqrt(gap * gap + T(4.0) * off * off) + T(tiny));
    const T c = T(1.0) / sqrt(T(1.0) + t * t), s = t * c;
    m(p, p) = m(p, p) - t * off;
    m(q, q) = m(q, q) + t * off;
    m(p, q) = m(q, p) = T(0.0);
    for (int r = 0; r < D; ++r) {
        if (r != p && r != q) {
            const T mp = m(r, p), mq = m(r, q);
            m(r, p) = m(p, r) = c * mp - s * mq;
            m(r, q) = m(q, r) = s * mp + c * mq;
        }
        const T vp = axes(r, p), vq = axes(r, q);
        axes(r, p) = c * vp - s * vq;
        axes(r, q) = s * vp + c * vq;
    }
}

/// Turns the axes of those pairs whose `near` is positive until m has no component that mixes them.
template <int D, class T>
ORDO_FLAT inline void turn_equal(const T (&near)[3][3], Mat<D, T>& m, Mat<D, T>& axes)
{
    constexpr int sweeps = D == 3 ? 6 : 1;
    for (int k = 0; k < sweeps; ++k)
        for (int p = 0; p < D; ++p)
            for (int q = p + 1; q < D; ++q) {
                if (!any_positive(near[p][q])) continue;
                Mat<D, T> n = m, turned = axes;
                rotate_jacobi(n, turned, p, q);
                for (int i = 0; i < D; ++i)
                    for (int j = 0; j < D; ++j) {
                        m(i, j)    = choose(near[p][q], n(i, j), m(i, j));
                        axes(i, j) = choose(near[p][q], turned(i, j), axes(i, j));
                    }
            }
}

/// Principal values by Jacobi rotations: one is exact in 2D; 3D takes a fixed number of sweeps, so that eight particles go the
/// same way. The formula with arc cosines would lose half of the digits at equal values.
template <int D, class T>
ORDO_FLAT inline Spectrum<D, T> spectrum(const Symmetric<D, T>& s)
{
    Mat<D, T> m = in_plane(s);
    Spectrum<D, T> r;
    r.axes = Mat<D, T>::identity();
    if constexpr (D == 2) rotate_jacobi(m, r.axes, 0, 1);
    if constexpr (D == 3) {
        constexpr int sweeps = 6;  // off-diagonals were below 1e-16 of the largest value after 5 (tests/unit/hencky.cpp)
        for (int k = 0; k < sweeps; ++k) {
            rotate_jacobi(m, r.axes, 0, 1);
            rotate_jacobi(m, r.axes, 0, 2);
            rotate_jacobi(m, r.axes, 1, 2);
        }
    }
    for (int a = 0; a < 3; ++a) r.value[a] = a < D ? m(a < D ? a : 0, a < D ? a : 0) : s(a, a);
    return r;
}

/// The principal axes of a tensor m and what `compose` needs of its slope: `turned` are the axes for slopes, and `ratio` is
/// m'_ab/(m_a - m_b) in these, zero for equal values.
template <int D, class T>
struct DualAxes {
    Mat<D, T> axes, turned, ratio;
};
template <int D, class T>
struct Spectrum<D, Dual<T>> {
    Dual<T> value[3];
    DualAxes<D, T> axes;
};

/// Axes of equal values are turned until the slope has no component that mixes them; then values along these axes follow their
/// diagonal components, and a function of all values, composed again, has its exact slope along the direction (Daleckii & Krein 1965),
/// if it gives equal values for equal values. Values are taken as equal, and as different, with a relative error of about 1e-8 of
/// the slope at the limit. First derivatives only.
template <int D, class T>
ORDO_CALL Spectrum<D, Dual<T>> spectrum(const Symmetric<D, Dual<T>>& s)
{
    constexpr double limit = 1e-8;  // of the largest value: between the errors of a quotient and of equality
    Symmetric<D, T> value, slope;
    for (int k = 0; k < s.size; ++k) {
        value.c[k] = s.c[k].value;
        slope.c[k] = s.c[k].slope;
    }
    const Spectrum<D, T> of_value = spectrum(value);
    const T(&v)[3]                = of_value.value;
    DualAxes<D, T> r{of_value.axes, of_value.axes, {}};
    Mat<D, T> m = transpose(r.axes) * in_plane(slope) * r.axes;
    T size(0.0), near[3][3];  // `near` is positive for equal values, also for those that a third one joins
    for (int a = 0; a < D; ++a) size = larger(size, T(limit * limit) * v[a] * v[a]);
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) near[a][b] = size - (v[a] - v[b]) * (v[a] - v[b]);
    if constexpr (D == 3)
        for (int a = 0; a < 3; ++a) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            near[a][b] = near[b][a] = larger(near[a][b], smaller(near[a][c], near[c][b]));
        }
    turn_equal(near, m, r.turned);
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r.ratio(a, b) = choose(near[a][b], T(0.0), m(a, b) / (v[a] - v[b]));
    Spectrum<D, Dual<T>> out;
    for (int a = 0; a < 3; ++a) out.value[a] = a < D ? Dual<T>(v[a], m(a < D ? a : 0, a < D ? a : 0)) : s(a, a);
    out.axes = r;
    return out;
}

/// The spectrum of a tensor with positive values. In 2D the smaller one comes from the determinant: the difference of large
/// components would leave few of its digits after a large shear.
template <int D, class T>
ORDO_FLAT inline Spectrum<D, T> positive_spectrum(const Symmetric<D, T>& s)
{
    Spectrum<D, T> r = spectrum(s);
    if constexpr (D == 2) {
        const T first = r.value[0] - r.value[1];
        const T high = choose(first, r.value[0], r.value[1]), low = (s(0, 0) * s(1, 1) - s(0, 1) * s(0, 1)) / high;
        r.value[0] = choose(first, high, low);
        r.value[1] = choose(first, low, high);
    }
    return r;
}

/// The symmetric tensor with these principal values and axes.
template <int D, class T>
ORDO_FLAT inline Symmetric<D, T> compose(const T (&value)[3], const Mat<D, T>& axes)
{
    Symmetric<D, T> r{};
    for (int a = D; a < 3; ++a) r(a, a) = value[a];
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) {
            T sum = value[0] * axes(i, 0) * axes(j, 0);
            for (int k = 1; k < D; ++k) sum += value[k] * axes(i, k) * axes(j, k);
            r(i, j) = sum;
        }
    return r;
}

template <int D, class T>
ORDO_CALL Symmetric<D, Dual<T>> compose(const Dual<T> (&value)[3], const DualAxes<D, T>& axes)
{
    T plain[3];
    for (int a = 0; a < 3; ++a) plain[a] = value[a].value;
    const Symmetric<D, T> now = compose(plain, axes.axes);
    Mat<D, T> m{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) m(a, b) = a == b ? value[a].slope : axes.ratio(a, b) * (plain[a] - plain[b]);
    const Mat<D, T> slope = axes.turned * m * transpose(axes.turned);
    Symmetric<D, Dual<T>> r{};
    for (int a = D; a < 3; ++a) r(a, a) = value[a];
    for (int i = 0; i < D; ++i)
        for (int j = i; j < D; ++j) r(i, j) = {now(i, j), slope(i, j)};
    return r;
}

/// The logarithmic strain (ln b)/2 in two parts, theta/3 I + dev.
template <int D, class T = double>
struct HenckyStrain {
    T theta;
    Symmetric<D, T> dev;
};

/// Below this norm of a deviatoric strain series give its logarithm and exponential to a relative 1e-15.
constexpr double kSmallStrain = 0.04;

/// The logarithmic strain of b. Where the deviator is small, ln Y = 2 artanh X with X = (Y - I)(Y + I)^-1 and Y = b/mean(b) by
/// the series of artanh; else in principal axes.
template <int D, class T>
ORDO_FLAT inline HenckyStrain<D, T> hencky_strain(const Symmetric<D, T>& b)
{
    const T mean = trace(b) * T(1.0 / 3), scale = T(1.0) / mean;
    Symmetric<D, T> N = b * scale, M = N;
    for (int a = 0; a < 3; ++a) {
        N.c[a] -= T(1.0);
        M.c[a] += T(1.0);
    }
    // M^-1: along the axes of the problem by the cofactors.
    const Mat<D, T> inner           = inverse(in_plane(M));
    const Symmetric<D, T> inverse_M = make_stress(inner, D < 3 ? T(1.0) / M(2, 2) : T(1.0));
    Symmetric<D, T> across          = inverse_M;
    if constexpr (D == 1) across(1, 1) = T(1.0) / M(1, 1);
    const Symmetric<D, T> X = coaxial_product(N, across), Z = coaxial_product(X, X), Z2 = coaxial_product(Z, Z);
    const Symmetric<D, T> high     = coaxial_product(Z2, isotropic<D>(T(1.0 / 5)) + T(1.0 / 7) * Z + T(1.0 / 9) * Z2);
    const Symmetric<D, T> half_log = coaxial_product(X, isotropic<D>(T(1.0)) + T(1.0 / 3) * Z + high);
    const T half_trace             = trace(half_log);
    HenckyStrain<D, T> r{T(1.5) * log(mean) + half_trace, half_log};
    for (int a = 0; a < 3; ++a) r.dev.c[a] -= half_trace * T(1.0 / 3);

    const T beyond = square(X) - T(kSmallStrain * kSmallStrain);
    if (any_positive(beyond)) {
        const Spectrum<D, T> s = positive_spectrum(b);
        T e[3];
        for (int a = 0; a < 3; ++a) e[a] = T(0.5) * log(s.value[a]);
        const T theta = e[0] + e[1] + e[2];
        for (T& one : e) one -= theta * T(1.0 / 3);
        r.theta = choose(beyond, theta, r.theta);
        r.dev   = choose(beyond, compose(e, s.axes), r.dev);
    }
    return r;
}

/// b = exp(2 eps). Small deviators by the series of cosh and sinh, else in principal axes.
template <int D, class T>
ORDO_FLAT inline Symmetric<D, T> stretched(const HenckyStrain<D, T>& eps)
{
    const Symmetric<D, T> E = T(2.0) * eps.dev, one = isotropic<D>(T(1.0)), Z = coaxial_product(E, E), Z2 = coaxial_product(Z, Z);
    const Symmetric<D, T> even =
        coaxial_product(Z2, isotropic<D>(T(1.0 / 24)) + T(1.0 / 720) * Z + T(1.0 / 40320) * Z2) + T(0.5) * Z + one;
    const Symmetric<D, T> odd =
        coaxial_product(Z2, isotropic<D>(T(1.0 / 120)) + T(1.0 / 5040) * Z + T(1.0 / 362880) * Z2) + T(1.0 / 6) * Z + one;
    Symmetric<D, T> r = even + coaxial_product(E, odd);
    const T beyond    = square(eps.dev) - T(kSmallStrain * kSmallStrain);
    if (any_positive(beyond)) {
        const Spectrum<D, T> s = spectrum(eps.dev);
        T value[3];
        for (int a = 0; a < 3; ++a) value[a] = exp(T(2.0) * s.value[a]);
        r = choose(beyond, compose(value, s.axes), r);
    }
    return r * exp(eps.theta * T(2.0 / 3));
}

}  // namespace ordo
