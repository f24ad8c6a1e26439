// The work of tractions and body forces in a step: the mean of the forces before and after it, times the displacement of where
// they act. Two evaluations of the forces a step, so it is for runs that want an account.
#pragma once

#include "method/state.hpp"

#include <vector>

namespace ordo {

/// Made before a step, with forces evaluated; `add` after it, with forces evaluated again. No sort may lie between.
template <int D>
class ExternalWork {
  public:
    ExternalWork(const Model<D>& model, State<D>& s);

    /// Adds what the step took to the account, and sets the forces of tractions, those of the step.
    void add(State<D>& s) const;

  private:
    /// A point with a force on it.
    struct Loaded {
        Vec<D> x, force;
    };
    std::vector<Loaded> faces(State<D>& s) const;
    std::vector<Loaded> particles(const State<D>& s) const;

    const Model<D>& model_;
    bool has_body_force_;
    std::vector<Loaded> faces_, particles_;
};

}  // namespace ordo
