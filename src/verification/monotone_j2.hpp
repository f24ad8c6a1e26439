// `j2` with linear hardening along paths on which the logarithmic strain grows in a fixed direction: stress is then a function of F
// (Hencky's deformation theory), as manufactured solutions need. Not for use in the solver.
#pragma once

#include "material/elastic_state.hpp"
#include "verification/jet.hpp"

#include <cmath>

namespace ordo::verification {

/// With the total logarithmic strain eps and q_tr = sqrt(6) G |dev eps|: alpha = (q_tr - Y0)/(3G + H),
/// s = 2G (Y0 + H alpha)/q_tr dev eps. In uniaxial strain e this is alpha = (2G|e| - Y0)/(3G + H), in diag(l, 1/l) with e = ln l
/// alpha = (2 sqrt(3) G e - Y0)/(3G + H). Beyond yield only: it has no elastic branch. In 3D its gradient needs three different stretches.
struct MonotoneJ2 {
    HenckyElasticity elastic;
    double yield, hardening;  ///< Y0 and H, Pa

    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F) const
    {
        return cauchy_of(elastic.kirchhoff(elastic_strain(F)), F);
    }
    /// alpha; negative before yield.
    template <int D, class T>
    ORDO_FLAT T plastic_strain(const Mat<D, T>& F) const
    {
        return alpha(trial(hencky_strain(left_cauchy_green(F))));
    }
    /// The elastic part of the logarithmic strain.
    template <int D, class T>
    ORDO_FLAT HenckyStrain<D, T> elastic_strain(const Mat<D, T>& F) const
    {
        HenckyStrain<D, T> e = hencky_strain(left_cauchy_green(F));
        const T q            = trial(e);
        e.dev                = (T(yield) + T(hardening) * alpha(q)) / q * e.dev;
        return e;
    }

  private:
    template <int D, class T>
    ORDO_FLAT T trial(const HenckyStrain<D, T>& e) const
    {
        return T(std::sqrt(6.0) * elastic.shear) * sqrt(square(e.dev));
    }
    template <class T>
    ORDO_FLAT T alpha(const T& q) const
    {
        return (q - T(yield)) * T(1 / (3 * elastic.shear + hardening));
    }
};

}  // namespace ordo::verification
