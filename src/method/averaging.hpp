// The axis `averaging`: the stresses that forces come from and F have volume averages A in place of their volumetric parts. Both
// sides take the same A, which is self-adjoint in its weights, so that forces do the work of the averaged strains; and A keeps
// sums, so that total volume is kept. F-bar by patches (docs/design.md). Of laws whose stress is a function of F, A averages
// volume ratios J with the weights V0; of those with memory the dilations of the step with the weights V.
#pragma once

#include "method/state.hpp"

namespace ordo {

/// Makes room, and sets s.averages.weights: V0 of particles whose stress is a function of F, else V.
template <int D>
void prepare_averages(const Model<D>& model, State<D>& s);

/// u = A u of a scalar of each particle, with s.averages.weights.
template <int D>
void average(const MethodSpec& method, State<D>& s, double* u);

/// Sets s.force_stress = (det F/J) (sigma - s I) + A s I in the plane, s the mean of the D normal stresses, J = V/V0; with the
/// artificial pressure q in sigma. For methods with has_force_stress.
template <int D>
void find_force_stress(const Model<D>& model, State<D>& s);

/// After a gather that has updated F and V and stored the displacement gradients G of the step in s.averages: scales f = I + G and
/// F, so that det F = A J where stress is a function of F, else det f = 1 + A theta, theta = det f - 1 before. After
/// prepare_averages at the start of the step.
template <int D>
void average_increments(const Model<D>& model, State<D>& s);

}  // namespace ordo
