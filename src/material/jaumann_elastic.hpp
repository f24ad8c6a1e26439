// Linear elastic law with the Jaumann rate.
#pragma once

#include "material/law.hpp"

namespace ordo {

/// sigma' = W sigma - sigma W + lambda tr(d) I + 2 mu d.
/// Integrated at the midpoint with the rotation of Hughes & Winget (1980); half of it turns the increment. Exact for rigid
/// rotations of any size, second order in dt.
struct JaumannElastic {
    static constexpr std::string_view
        name = "jaumann-elastic",
        what = "linear elastic rate law with the Jaumann rate, midpoint rule of Hughes & Winget (1980)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr NoParameters parameters{};
    static constexpr NoHistory history{};

    double lambda, mu;  ///< Pa

    ORDO_FLAT static JaumannElastic of(const Material& m) { return {m.lambda, m.mu}; }

    template <int D, class T>
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, const Stress<D, T>& sigma, T*) const
    {
        const T half(0.5), quarter(0.25);
        const Mat<D, T> I = Mat<D, T>::identity();
        const Mat<D, T> M = step.G * inverse(I + half * step.G);  // gradient with respect to the middle of the step
        const Mat<D, T> e = half * (M + transpose(M));
        const Mat<D, T> w = half * (M - transpose(M));
        const Mat<D, T> Q = inverse(I - half * w) * (I + half * w);        // rotation of the step
        const Mat<D, T> q = inverse(I - quarter * w) * (I + quarter * w);  // rotation of its second half, for the increment
        Mat<D, T> s       = T(2 * mu) * e;
        const T p         = T(lambda) * trace(e);
        for (int a = 0; a < D; ++a) s(a, a) += p;
        const Mat<D, T> turned = Q * in_plane(sigma) * transpose(Q) + q * s * transpose(q);
        return make_stress(turned, sigma(2, 2) + p);
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> rate(const Stress<D, T>& sigma, const Mat<D, T>& L) const
    {
        const T half(0.5), p = T(lambda) * trace(L);
        const Mat<D, T> d = half * (L + transpose(L)), w = half * (L - transpose(L)), now = in_plane(sigma);
        Mat<D, T> s = w * now - now * w + T(2 * mu) * d;
        for (int a = 0; a < D; ++a) s(a, a) += p;
        return make_stress(s, p);
    }
    /// sigma : C^-1 : sigma / 2.
    template <int D, class T>
    ORDO_FLAT T energy(const Stress<D, T>& sigma, const T*) const
    {
        const T tr = trace(sigma);
        return (square(sigma) - T(lambda / (3 * lambda + 2 * mu)) * tr * tr) * T(1 / (4 * mu));
    }
};
static_assert(RateLaw<JaumannElastic>);

}  // namespace ordo
