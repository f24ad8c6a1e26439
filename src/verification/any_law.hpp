// A hyperelastic law for manufactured solutions: its stress for F, and with derivatives for F with derivatives. Laws are
// compiled only in any_law.cpp, not once for each motion.
#pragma once

#include "base/lanes.hpp"
#include "base/stress.hpp"
#include "material/material.hpp"
#include "verification/jet.hpp"

namespace ordo::verification {

template <int D>
class AnyLaw {
  public:
    /// Throws InputError if the stress is not a function of F.
    explicit AnyLaw(const Material& material);

    /// Cauchy stress, Pa.
    Stress<D> cauchy(const Mat<D>& F) const { return material_.law->in<D>().initial_stress(material_, F); }
    Stress<D, Gradient<D>> cauchy(const Mat<D, Gradient<D>>& F) const;
    Stress<D, Gradient<D, Lanes>> cauchy(const Mat<D, Gradient<D, Lanes>>& F) const;

  private:
    Material material_;
};

}  // namespace ordo::verification
