// A simulation: the method's step, its state, the choice of time steps, the watch and the observers. Used by `ordo run`,
// `ordo verify`, `ordo bench` and programs on the library. Knows no files.
#pragma once

#include "method/scheme.hpp"
#include "method/watch.hpp"
#include "setup/spec.hpp"
#include "sim/observer.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace ordo {

template <int D>
class Simulation {
  public:
    using Warn  = std::function<void(const std::string&)>;
    using Stop  = std::function<bool()>;
    using Start = std::function<State<D>(const Scheme<D>& scheme)>;

    /// From setup::build: the initial configuration with the velocities of its bodies, of which each rank has a share. `warn` gets the
    /// findings of the watch that do not end the run. Throws InputError if there is nothing to watch.
    explicit Simulation(setup::Built<D> built, const WatchSpec& watch = {}, Warn warn = {}, Ranks& ranks = alone());

    /// From a state that `start` makes with the scheme of the model, such as a deformed one. Not watched.
    Simulation(Model<D> model, const Start& start, const setup::TimeSpec& time);

    Simulation(const Simulation&)            = delete;  // the watch refers to the model
    Simulation& operator=(const Simulation&) = delete;

    const Model<D>& model() const { return scheme_->model(); }
    Scheme<D>& scheme() { return *scheme_; }
    const Scheme<D>& scheme() const { return *scheme_; }
    State<D>& state() { return state_; }
    const State<D>& state() const { return state_; }
    const setup::TimeSpec& time() const { return time_; }
    /// One after another; none if the run is one.
    const std::vector<Stage<D>>& stages() const { return stages_; }
    /// Of the start; empty for a simulation from a state.
    const std::vector<setup::BodyReport>& bodies() const { return bodies_; }
    /// What a user of the case may not expect; empty for a simulation from a state.
    const std::vector<std::string>& notes() const { return notes_; }
    /// Null for a simulation that is not watched.
    Watch<D>* watch() { return watch_ ? &*watch_ : nullptr; }

    /// The observer must outlive the simulation's steps.
    void add(Observer<D>& observer) { observers_.push_back(&observer); }
    void remove(Observer<D>& observer) { std::erase(observers_, &observer); }

    /// One step, shortened at the end of a stage and of the case. Throws NumericalError after notifying observers.
    void step();
    /// One step of dt, s, or of the case's own time step, shortened at the end of a stage only; without stages the end of the case may
    /// pass. Throws NumericalError after notifying observers.
    void step_on(std::optional<double> dt = {});
    /// Before a restart reads the state: arranges the initial one as one of stage `number`.
    void prepare_stage(int number) { scheme_->prepare(stages_, number, state_); }
    /// Steps to time t, s; the last step is shortened to end there. Stops earlier if stop() is true after a step.
    void advance(double t, const Stop& stop = {});
    /// Steps to the end of the case, or until stop() is true, and tells observers that the run has ended.
    void run(const Stop& stop = {});

    /// Whether the end of the case is reached.
    bool is_complete() const { return is_in_last_stage() && (is_stage_over() || is_at(time_.end)); }
    /// Whether the stage has ended, by its time or its residual; the next step begins the next one.
    bool is_stage_over() const;
    /// Whether the last step was shortened to end at a given time.
    bool is_cut() const { return is_cut_; }

  private:
    bool is_at(double t) const;
    bool is_in_last_stage() const { return state_.stage + 1 >= static_cast<int>(stages_.size()); }
    void begin();
    void begin_stage_if_due();
    void take(double dt, bool is_given);
    void step_towards(double t, std::optional<double> dt = {});

    std::unique_ptr<Scheme<D>> scheme_;
    State<D> state_;
    setup::TimeSpec time_;
    std::vector<Stage<D>> stages_;
    std::vector<setup::BodyReport> bodies_;
    std::vector<std::string> notes_;
    std::optional<Watch<D>> watch_;
    std::vector<Observer<D>*> observers_;
    bool has_begun_ = false;
    bool is_cut_    = false;
};

}  // namespace ordo
