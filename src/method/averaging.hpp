// The axis `averaging`: the stresses that forces come from and the increments of F have volume averages A in place of their
// volumetric parts. Both sides take the same A, which is self-adjoint in the volumes, so that forces do the work of the averaged
// strains; and A keeps sums, so that total volume is kept. F-bar by patches (docs/design.md).
#pragma once

#include "method/state.hpp"

namespace ordo {

/// u = A u of a scalar of each particle, with the volumes V as weights.
template <int D>
void average(const MethodSpec& method, State<D>& s, const double* V, double* u);

/// Sets s.force_stress = sigma + (A s - s) I in the plane, s the mean of the D normal stresses; with the artificial pressure q in
/// sigma. For methods with has_force_stress.
template <int D>
void find_force_stress(const MethodSpec& method, State<D>& s);

/// After a gather that has updated F and V and stored the displacement gradients G of the step: replaces f = I + G by
/// ((1 + A theta)/(1 + theta))^(1/D) f, theta = det f - 1, in G, F and V. `before`: the volumes before the step.
template <int D>
void average_increments(const MethodSpec& method, State<D>& s, const double* before, Mat<D>* increments);

}  // namespace ordo
