// Compressible neo-Hookean law.
#pragma once

#include "base/lane_math.hpp"
#include "material/law.hpp"

namespace ordo {

/// sigma = [lambda ln J I + mu (F F^T - I)]/J.
/// Gong (2015) eq. 4.5; energy: Tran et al. (2019), corrected (errata cpls, eq. 55). Plane strain in 2D, uniaxial in 1D.
struct NeoHookean {
    static constexpr std::string_view name = "neo-hookean",
                                      what = "sigma = [lambda ln J I + mu (F F^T - I)]/J (Gong 2015; Tran et al. 2019)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr NoParameters parameters{};
    static constexpr NoHistory history{};

    double lambda, mu;  ///< Pa

    ORDO_FLAT static NeoHookean of(const Material& m) { return {m.lambda, m.mu}; }

    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F) const
    {
        const T J = det(F), inv_J = T(1) / J, p = T(lambda) * log(J);
        Mat<D, T> s = T(mu) * (F * transpose(F) - Mat<D, T>::identity());
        for (int a = 0; a < D; ++a) s(a, a) += p;
        return make_stress(s * inv_J, p * inv_J);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const T l = log(det(F));
        return T(lambda / 2) * l * l + T(mu / 2) * (ddot(F, F) - T(D) - T(2) * l);
    }
};
static_assert(Hyperelastic<NeoHookean>);

}  // namespace ordo
