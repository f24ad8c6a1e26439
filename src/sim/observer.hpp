// What watches a simulation from outside of the step: files, checkpoints, progress, records of studies, a user's own.
#pragma once

#include "base/error.hpp"

namespace ordo {

template <int D>
class Simulation;

/// A step that is about to be made or was made.
struct StepSize {
    double dt;    ///< s
    bool is_cut;  ///< to end at a given time: a simulation that goes further would not make this step
};

/// Called on the host, a few times a step, in the order in which observers were added. May read the state; a projection of the
/// nodes changes nothing in the steps to come.
template <int D>
class Observer {
  public:
    virtual ~Observer() = default;

    /// Before the first step.
    virtual void started(Simulation<D>&) {}
    virtual void before_step(Simulation<D>&, const StepSize&) {}
    virtual void after_step(Simulation<D>&, const StepSize&) {}
    /// A step could not be made. The state is that after it, for a last output.
    virtual void failed(Simulation<D>&, const NumericalError&) {}
    /// No step will follow: first all observers are told that it ends, then that it has ended.
    virtual void ending(Simulation<D>&) {}
    virtual void ended(Simulation<D>&) {}
};

}  // namespace ordo
