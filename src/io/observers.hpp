// Checkpoints and the progress line as observers of a simulation; io/writer.hpp is one itself.
#pragma once

#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "io/progress.hpp"
#include "io/writer.hpp"
#include "sim/simulation.hpp"

#include <functional>
#include <optional>
#include <utility>

namespace ordo::io {

/// Writes the checkpoints that [checkpoint] asks for, and one if is_stopped() says that the run was stopped. Must be added after
/// the writer.
template <int D>
class KeepCheckpoints : public Observer<D> {
  public:
    KeepCheckpoints(Checkpoints<D>& checkpoints, Writer<D>& writer, std::function<bool()> is_stopped)
        : checkpoints_(checkpoints), writer_(writer), is_stopped_(std::move(is_stopped))
    {}

    /// A run with a later end would not take a shortened step: it continues from the state before it.
    void before_step(Simulation<D>& sim, const StepSize& step) override
    {
        if (step.is_cut && checkpoints_.are_wanted()) write(sim, written(sim));
    }
    void after_step(Simulation<D>& sim, const StepSize& step) override
    {
        if (!step.is_cut && !sim.is_complete() && checkpoints_.is_due(sim.state())) write(sim, written(sim));
    }

    /// A run that continues from here does not have the last row and frame. At the end the checkpoint is written last, because it
    /// marks that nothing is left to do. Before the end it is written first, because it matters most.
    void ending(Simulation<D>& sim) override
    {
        if (sim.is_cut() || !has_hdf5() || !(is_stopped_() || checkpoints_.are_wanted())) return;
        at_end_ = written(sim);
        if (!sim.is_complete()) write(sim, *at_end_);
    }
    void ended(Simulation<D>& sim) override
    {
        if (at_end_) write(sim, *at_end_);
    }

  private:
    void write(Simulation<D>& sim, const Written& w) { checkpoints_.write(sim.state(), w); }

    Written written(Simulation<D>& sim)
    {
        Written w = writer_.written();
        w.step    = sim.state().n;
        w.stage   = sim.state().stage;
        if (const Watch<D>* watch = sim.watch()) w.watched.assign(watch->energies().begin(), watch->energies().end());
        return w;
    }

    Checkpoints<D>& checkpoints_;
    Writer<D>& writer_;
    std::function<bool()> is_stopped_;
    std::optional<Written> at_end_;
};

/// The progress line.
template <int D>
class ShowProgress : public Observer<D> {
  public:
    explicit ShowProgress(bool quiet) : quiet_(quiet) {}

    void started(Simulation<D>& sim) override { line_.emplace(quiet_, sim.state().t, sim.time().end); }
    void after_step(Simulation<D>& sim, const StepSize& step) override { line_->show(sim.state().n, sim.state().t, step.dt); }
    void failed(Simulation<D>& sim, const NumericalError&) override { line_->done(sim.state().n, sim.state().t); }
    void ended(Simulation<D>& sim) override { line_->done(sim.state().n, sim.state().t); }

  private:
    bool quiet_;
    std::optional<Progress> line_;
};

}  // namespace ordo::io
