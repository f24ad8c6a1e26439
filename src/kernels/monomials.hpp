// Monomials of the coordinates, in the order that all fits use.
#pragma once

#include "base/config.hpp"
#include "base/index.hpp"

namespace ordo {

ORDO_HD constexpr int binomial(int n, int k)
{
    int r = 1;
    for (int j = 1; j <= k; ++j) r = r * (n - k + j) / j;
    return r;
}

/// Monomials of D coordinates up to a degree: 1, x, y, z, x^2, x y, x z, y^2, ..., sorted by degree, then by axis. If samples
/// do not determine all of them, the first ones in this order are kept.
template <int D, int degree>
struct Monomials {
    static constexpr int count = binomial(degree + D, D);

    Index<D> exponent[count]{};

    ORDO_HD constexpr Monomials()
    {
        int n = 0;
        for (int total = 0; total <= degree; ++total) add(n, 0, total, {});
    }

    /// The number of the monomial with these exponents.
    ORDO_HD constexpr int find(const Index<D>& e) const
    {
        for (int k = 0; k < count; ++k)
            if (exponent[k] == e) return k;
        return -1;
    }

    /// The values at y.
    template <class T>
    ORDO_FLAT static void evaluate(const Vec<D, T>& y, T (&p)[count])
    {
        constexpr Monomials all;  // a local copy, for devices
        T power[D][degree + 1];
        for (int a = 0; a < D; ++a) {
            power[a][0] = T(1.0);
            for (int e = 1; e <= degree; ++e) power[a][e] = power[a][e - 1] * y[a];
        }
        for (int k = 0; k < count; ++k) {
            p[k] = T(1.0);
            for (int a = 0; a < D; ++a) p[k] *= power[a][all.exponent[k][a]];
        }
    }

  private:
    ORDO_HD constexpr void add(int& n, int axis, int left, Index<D> e)
    {
        if (axis == D - 1) {
            e[axis]       = left;
            exponent[n++] = e;
            return;
        }
        for (int k = left; k >= 0; --k) {
            e[axis] = k;
            add(n, axis + 1, left - k, e);
        }
    }
};

template <int D, int degree>
inline constexpr Monomials<D, degree> monomials{};

}  // namespace ordo
