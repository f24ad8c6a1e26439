// The one-dimensional linear rate law.
#pragma once

#include "material/law.hpp"

namespace ordo {

/// sigma' = E dv/dx, Wobbes et al. (2020) sec. 5. 1D only, without lateral stress.
struct LinearRate1D {
    static constexpr std::string_view name = "linear-rate-1d", what = "sigma' = E dv/dx, 1D only (Wobbes et al. 2020)";
    static constexpr Elasticity elasticity = Elasticity::young;
    static constexpr int max_dim           = 1;
    static constexpr NoParameters parameters{};
    static constexpr NoHistory history{};

    double young;  ///< Pa

    ORDO_FLAT static LinearRate1D of(const Material& m) { return {m.p_wave_modulus()}; }

    template <class T>
    ORDO_FLAT Stress<1, T> update(const Step<1, T>& step, const Stress<1, T>& sigma, T*) const
    {
        return sigma + make_stress(T(young) * step.G, T(0));
    }
    template <class T>
    ORDO_FLAT Stress<1, T> rate(const Stress<1, T>&, const Mat<1, T>& L) const
    {
        return make_stress(T(young) * L, T(0));
    }
    template <class T>
    ORDO_FLAT T energy(const Stress<1, T>& sigma, const T*) const
    {
        return sigma(0, 0) * sigma(0, 0) * T(1 / (2 * young));
    }
};
static_assert(RateLaw<LinearRate1D>);

}  // namespace ordo
