// Small vectors and matrices of fixed size, usable in device code and with any scalar (double, dual numbers).
// Used by every layer; knows nothing of grids or particles.
#pragma once

#include "base/config.hpp"

#include <cmath>

namespace ordo {

/// The larger and the smaller of two numbers; `a` if b is not a number. std::fmax would be a library call.
template <class T>
ORDO_FLAT constexpr T larger(T a, T b)
{
    return b > a ? b : a;
}
template <class T>
ORDO_FLAT constexpr T smaller(T a, T b)
{
    return b < a ? b : a;
}

/// A vector of D components.
template <int D, class T = double>
struct Vec {
    static_assert(D >= 1 && D <= 3);
    T c[D];

    ORDO_FLAT constexpr T& operator[](int a) { return c[a]; }
    ORDO_FLAT constexpr const T& operator[](int a) const { return c[a]; }

    /// The vector whose components are all `value`.
    ORDO_FLAT static constexpr Vec filled(T value)
    {
        Vec r{};
        for (int a = 0; a < D; ++a) r.c[a] = value;
        return r;
    }

    ORDO_FLAT constexpr Vec& operator+=(const Vec& o)
    {
        for (int a = 0; a < D; ++a) c[a] += o.c[a];
        return *this;
    }
    ORDO_FLAT constexpr Vec& operator-=(const Vec& o)
    {
        for (int a = 0; a < D; ++a) c[a] -= o.c[a];
        return *this;
    }
    ORDO_FLAT constexpr Vec& operator*=(const T& s)
    {
        for (int a = 0; a < D; ++a) c[a] *= s;
        return *this;
    }
    friend ORDO_FLAT constexpr Vec operator+(Vec a, const Vec& b) { return a += b; }
    friend ORDO_FLAT constexpr Vec operator-(Vec a, const Vec& b) { return a -= b; }
    friend ORDO_FLAT constexpr Vec operator*(Vec a, const T& s) { return a *= s; }
    friend ORDO_FLAT constexpr Vec operator*(const T& s, Vec a) { return a *= s; }
    friend ORDO_FLAT constexpr Vec operator-(Vec a) { return a *= T(-1); }
    friend ORDO_FLAT constexpr bool operator==(const Vec&, const Vec&) = default;
};

/// A square matrix of D x D components; m(i, j) is row i, column j.
template <int D, class T = double>
struct Mat {
    T c[D][D];

    ORDO_FLAT constexpr T& operator()(int i, int j) { return c[i][j]; }
    ORDO_FLAT constexpr const T& operator()(int i, int j) const { return c[i][j]; }

    ORDO_FLAT static constexpr Mat identity()
    {
        Mat r{};
        for (int i = 0; i < D; ++i) r.c[i][i] = T(1);
        return r;
    }

    ORDO_FLAT constexpr Mat& operator+=(const Mat& o)
    {
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) c[i][j] += o.c[i][j];
        return *this;
    }
    ORDO_FLAT constexpr Mat& operator-=(const Mat& o)
    {
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) c[i][j] -= o.c[i][j];
        return *this;
    }
    ORDO_FLAT constexpr Mat& operator*=(const T& s)
    {
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) c[i][j] *= s;
        return *this;
    }
    friend ORDO_FLAT constexpr Mat operator+(Mat a, const Mat& b) { return a += b; }
    friend ORDO_FLAT constexpr Mat operator-(Mat a, const Mat& b) { return a -= b; }
    friend ORDO_FLAT constexpr Mat operator*(Mat a, const T& s) { return a *= s; }
    friend ORDO_FLAT constexpr Mat operator*(const T& s, Mat a) { return a *= s; }
    friend ORDO_FLAT constexpr Mat operator*(const Mat& a, const Mat& b)
    {
        Mat r{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) {
                T sum = a.c[i][0] * b.c[0][j];
                for (int k = 1; k < D; ++k) sum += a.c[i][k] * b.c[k][j];
                r.c[i][j] = sum;
            }
        return r;
    }
    friend ORDO_FLAT constexpr Vec<D, T> operator*(const Mat& a, const Vec<D, T>& v)
    {
        Vec<D, T> r{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) r[i] += a.c[i][j] * v[j];
        return r;
    }
    friend ORDO_FLAT constexpr bool operator==(const Mat&, const Mat&) = default;
};

template <int D, class T>
ORDO_FLAT constexpr T dot(const Vec<D, T>& a, const Vec<D, T>& b)
{
    T r(0);
    for (int i = 0; i < D; ++i) r += a[i] * b[i];
    return r;
}

template <int D>
ORDO_FLAT inline double norm(const Vec<D>& a)
{
    return std::sqrt(dot(a, a));
}

/// The dyad a (x) b: m(i, j) = a_i b_j.
template <int D, class T>
ORDO_FLAT constexpr Mat<D, T> outer(const Vec<D, T>& a, const Vec<D, T>& b)
{
    Mat<D, T> r{};
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r(i, j) = a[i] * b[j];
    return r;
}

template <int D, class T>
ORDO_FLAT constexpr Mat<D, T> transpose(const Mat<D, T>& a)
{
    Mat<D, T> r{};
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r(i, j) = a(j, i);
    return r;
}

template <int D, class T>
ORDO_FLAT constexpr T trace(const Mat<D, T>& a)
{
    T r(0);
    for (int i = 0; i < D; ++i) r += a(i, i);
    return r;
}

/// The double contraction a : b = sum_ij a_ij b_ij.
template <int D, class T>
ORDO_FLAT constexpr T ddot(const Mat<D, T>& a, const Mat<D, T>& b)
{
    T r(0);
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r += a(i, j) * b(i, j);
    return r;
}

template <int D, class T>
ORDO_FLAT constexpr Vec<D, T> column(const Mat<D, T>& a, int j)
{
    Vec<D, T> r{};
    for (int i = 0; i < D; ++i) r[i] = a(i, j);
    return r;
}

/// The cofactor matrix cof(A) = det(A) A^-T; gradients of corner domains are made of its columns.
template <int D, class T>
ORDO_FLAT constexpr Mat<D, T> cofactor(const Mat<D, T>& a)
{
    Mat<D, T> r{};
    if constexpr (D == 1) {
        r(0, 0) = T(1);
    } else if constexpr (D == 2) {
        r(0, 0) = a(1, 1);
        r(0, 1) = -a(1, 0);
        r(1, 0) = -a(0, 1);
        r(1, 1) = a(0, 0);
    } else {
        for (int i = 0; i < 3; ++i) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
            for (int j = 0; j < 3; ++j) {
                const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                r(i, j) = a(i1, j1) * a(i2, j2) - a(i1, j2) * a(i2, j1);
            }
        }
    }
    return r;
}

template <int D, class T>
ORDO_FLAT constexpr T det(const Mat<D, T>& a)
{
    if constexpr (D == 1) return a(0, 0);
    if constexpr (D == 2) return a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0);
    if constexpr (D == 3)
        return a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) - a(0, 1) * (a(1, 0) * a(2, 2) - a(1, 2) * a(2, 0)) +
               a(0, 2) * (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0));
}

/// The inverse; the caller has checked det(a) != 0.
template <int D, class T>
ORDO_FLAT constexpr Mat<D, T> inverse(const Mat<D, T>& a)
{
    return transpose(cofactor(a)) * (T(1) / det(a));
}

/// `v` with trailing zeros, for output and for expressions of x, y, z.
template <int D>
constexpr Vec<3> padded(const Vec<D>& v)
{
    Vec<3> r{};
    for (int a = 0; a < D; ++a) r[a] = v[a];
    return r;
}
/// The first components of a padded vector.
template <int D>
constexpr Vec<D> first_components(const Vec<3>& v)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = v[a];
    return r;
}

}  // namespace ordo
