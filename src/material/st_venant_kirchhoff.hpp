// St. Venant-Kirchhoff's law.
#pragma once

#include "material/law.hpp"

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
};
static_assert(Hyperelastic<StVenantKirchhoff>);

}  // namespace ordo
