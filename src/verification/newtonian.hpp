// `fluid` as a function of F and F', as manufactured solutions need.
#pragma once

#include "material/fluid.hpp"

namespace ordo::verification {

/// The pressure and the viscous stress of the law itself, with the rate of deformation d = sym(F' F^-1).
struct NewtonianFlow {
    Fluid law;

    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F, const Mat<D, T>& rate) const
    {
        const Mat<D, T> L       = rate * inverse(F);
        const Symmetric<D, T> d = make_stress(T(0.5) * (L + transpose(L)), T(0.0));
        return law.stress(F, static_cast<const T*>(nullptr)) + law.viscous_stress(deviator(d));
    }
};

}  // namespace ordo::verification
