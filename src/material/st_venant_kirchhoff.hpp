// St. Venant-Kirchhoff's law.
#pragma once

#include "material/hencky.hpp"
#include "material/law.hpp"

#include <algorithm>

namespace ordo {

/// S = lambda tr(E) I + 2 mu E with the Green strain E = (F^T F - I)/2; sigma = F S F^T/J.
/// It loses all stiffness under strong compression (J -> 0): Bonet & Wood (2008), sec. 6.4.
struct StVenantKirchhoff {
    static constexpr std::string_view name = "st-venant-kirchhoff", what = "S = lambda tr(E) I + 2 mu E with the Green strain E";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr NoParameters parameters{};
    static constexpr NoHistory history{};

    double lambda, mu;  ///< Pa

    ORDO_FLAT static StVenantKirchhoff of(const Material& m) { return {m.lambda, m.mu}; }

    template <int D, class T>
    ORDO_FLAT static Mat<D, T> green(const Mat<D, T>& F)
    {
        return T(0.5) * (transpose(F) * F - Mat<D, T>::identity());
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F) const
    {
        const Mat<D, T> E = green(F);
        Mat<D, T> S       = T(2 * mu) * E;
        const T p = T(lambda) * trace(E), inv_J = T(1) / det(F);
        for (int a = 0; a < D; ++a) S(a, a) += p;
        return make_stress(F * S * transpose(F) * inv_J, p * inv_J);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const Mat<D, T> E = green(F);
        const T tr        = trace(E);
        return T(lambda / 2) * tr * tr + T(mu) * ddot(E, E);
    }
    /// It stiffens with the fourth power of a stretch. With stretches l_i and stresses S_i along the axes waves in a direction n have J times
    /// the acoustic tensor (n.F S F^T n) I + lambda (b n)(b n)^T + mu ((n.b n) b + (b n)(b n)^T), whose values are at most max l_i^2 S_i +
    /// l^4 (lambda + 2 mu) with the largest stretch l.
    template <int D>
    Stiffness stiffness(const Mat<D>& F, const double*) const
    {
        const Spectrum<D> b = positive_spectrum(left_cauchy_green(F));
        double sum = 0.0, largest = 0.0, pulled = -1e300;
        for (int a = 0; a < D; ++a) sum += 0.5 * (b.value[a] - 1);
        for (int a = 0; a < D; ++a) {
            largest = std::max(largest, b.value[a]);
            pulled  = std::max(pulled, b.value[a] * (lambda * sum + mu * (b.value[a] - 1)));
        }
        const double at_rest = lambda + 2 * mu;
        return {std::max(at_rest, pulled + largest * largest * at_rest), 0.0};
    }
};
static_assert(Hyperelastic<StVenantKirchhoff> && ChangesStiffness<StVenantKirchhoff>);

}  // namespace ordo
