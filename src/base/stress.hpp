// The Cauchy stress of a particle: symmetric, including the out-of-plane normal components of 1D and 2D problems.
#pragma once

#include "base/vec.hpp"

namespace ordo {

/// xx, yy, zz, then in 2D xy, in 3D xy, yz, zx. Out-of-plane strains of a 1D or 2D problem are zero, stresses are not.
template <int D, class T = double>
struct Stress {
    static_assert(D >= 1 && D <= 3);
    static constexpr int size = D == 1 ? 3 : D == 2 ? 4 : 6;
    T c[size];

    /// The place of component (i, j): i = j < 3, or i, j < D.
    ORDO_FLAT static constexpr int place(int i, int j) { return i == j ? i : D < 3 || i + j == 1 ? 3 : i + j == 3 ? 4 : 5; }

    ORDO_FLAT constexpr T& operator()(int i, int j) { return c[place(i, j)]; }
    ORDO_FLAT constexpr const T& operator()(int i, int j) const { return c[place(i, j)]; }

    ORDO_FLAT constexpr Stress& operator+=(const Stress& o)
    {
        for (int k = 0; k < size; ++k) c[k] += o.c[k];
        return *this;
    }
    ORDO_FLAT constexpr Stress& operator*=(const T& s)
    {
        for (int k = 0; k < size; ++k) c[k] *= s;
        return *this;
    }
    friend ORDO_FLAT constexpr Stress operator+(Stress a, const Stress& b) { return a += b; }
    friend ORDO_FLAT constexpr Stress operator*(Stress a, const T& s) { return a *= s; }
    friend ORDO_FLAT constexpr Stress operator*(const T& s, Stress a) { return a *= s; }
    friend ORDO_FLAT constexpr bool operator==(const Stress&, const Stress&) = default;
};

/// The stress with the in-plane components `plane` (only its upper triangle is read) and out-of-plane normal stresses `lateral`.
template <int D, class T>
ORDO_FLAT constexpr Stress<D, T> make_stress(const Mat<D, T>& plane, const T& lateral)
{
    Stress<D, T> r{};
    for (int a = D; a < 3; ++a) r(a, a) = lateral;
    for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) r(a, b) = plane(a, b);
    return r;
}

/// The components along the axes of the problem.
template <int D, class T>
ORDO_FLAT constexpr Mat<D, T> in_plane(const Stress<D, T>& s)
{
    Mat<D, T> r{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r(a, b) = s(a, b);
    return r;
}

/// All components.
template <int D, class T>
constexpr Mat<3, T> full(const Stress<D, T>& s)
{
    Mat<3, T> r{};
    for (int a = 0; a < 3; ++a) r(a, a) = s(a, a);
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < a; ++b) r(a, b) = r(b, a) = s(a, b);
    return r;
}

/// xx + yy + zz.
template <int D, class T>
ORDO_FLAT constexpr T trace(const Stress<D, T>& s)
{
    return s.c[0] + s.c[1] + s.c[2];
}

/// a : b, over all components.
template <int D, class T>
ORDO_FLAT constexpr T ddot(const Stress<D, T>& a, const Stress<D, T>& b)
{
    T normal(0), shear(0);
    for (int k = 0; k < 3; ++k) normal += a.c[k] * b.c[k];
    for (int k = 3; k < Stress<D, T>::size; ++k) shear += a.c[k] * b.c[k];
    return normal + T(2) * shear;
}
template <int D, class T>
ORDO_FLAT constexpr T square(const Stress<D, T>& s)
{
    return ddot(s, s);
}

}  // namespace ordo
