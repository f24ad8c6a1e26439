// Stresses of bodies at the start.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// The stress of body k at x. `top` is the largest height of the body against gravity. Throws SetupError if there is no vertical.
template <int D>
Stress<D> initial_stress(const CaseSpec<D>& spec, int k, double top, const Vec<D>& x);

/// The axis of gravity and the sign of upwards along it. Throws SetupError if body k has k0 and gravity is along none.
struct Vertical {
    int axis    = 0;
    double sign = 1.0;
};
template <int D>
Vertical vertical_of(const CaseSpec<D>& spec, int k);

/// Gives particles [begin, end) of body k, planted and at rest, their stresses. Throws SetupError at a stress that the law cannot have.
template <int D>
void set_initial_stress(const CaseSpec<D>& spec, int k, double top, int begin, int end, Particles<D>& p);

}  // namespace ordo::setup
