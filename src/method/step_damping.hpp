// Damping of the velocities that particles carry, after each step and for every method, and how far a state is from rest.
#pragma once

#include "method/state.hpp"

#include <vector>

namespace ordo {

/// Made before a step, applied after it; no sort may lie between.
template <int D>
class StepDamping {
  public:
    StepDamping(const Model<D>& model, State<D>& s);

    /// Damps the velocities of particles, their gradients and polynomials, and those of corners. Adds the kinetic energy that
    /// particles lose to the account. Sets State::residual if the model asks for it.
    void apply(State<D>& s, double dt) const;

  private:
    void damp(State<D>& s, double dt) const;

    const Model<D>& model_;
    std::vector<Array<double>> before_;  ///< velocities before the step, by field, if they are needed
};

}  // namespace ordo
