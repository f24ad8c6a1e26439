// Observers of a simulation, called outside the step: files, checkpoints, progress, records of studies, a user's own.
#pragma once

#include "base/error.hpp"

namespace ordo {

template <int D>
class Simulation;

/// The next step or the last one.
struct StepSize {
    double dt;    ///< s
    bool is_cut;  ///< shortened to end at a given time; a simulation that goes on would not take this step
};

/// Called on the host, a few times a step, in the order in which observers were added. May read the state; projecting to the
/// nodes does not change later steps.
template <int D>
class Observer {
  public:
    virtual ~Observer() = default;

    /// Before the first step.
    virtual void started(Simulation<D>&) {}
    virtual void before_step(Simulation<D>&, const StepSize&) {}
    virtual void after_step(Simulation<D>&, const StepSize&) {}
    /// A step failed. The state is that after it, for a last output.
    virtual void failed(Simulation<D>&, const NumericalError&) {}
    /// No step will follow. `ending` is called for all observers before `ended`.
    virtual void ending(Simulation<D>&) {}
    virtual void ended(Simulation<D>&) {}
};

}  // namespace ordo
