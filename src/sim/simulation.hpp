// A simulation: the method's step, its state, the choice of time steps, the watch over them, and who observes. `ordo run`,
// `ordo verify`, `ordo bench` and programs on the library step by it. Knows no files.
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

    /// From setup::build, at rest in the initial configuration or with the velocities of its bodies. `warn` gets what the watch
    /// finds and does not end the run. Throws InputError where there is nothing to watch.
    explicit Simulation(setup::Built<D> built, const WatchSpec& watch = {}, Warn warn = {});

    /// From a state that `start` makes by the scheme of the model, such as a deformed one. Not watched.
    Simulation(Model<D> model, const Start& start, const setup::TimeSpec& time);

    Simulation(const Simulation&)            = delete;  // the watch looks at the model
    Simulation& operator=(const Simulation&) = delete;

    const Model<D>& model() const { return scheme_->model(); }
    Scheme<D>& scheme() { return *scheme_; }
    const Scheme<D>& scheme() const { return *scheme_; }
    State<D>& state() { return state_; }
    const State<D>& state() const { return state_; }
    const setup::TimeSpec& time() const { return time_; }
    /// Null for a simulation that is not watched.
    Watch<D>* watch() { return watch_ ? &*watch_ : nullptr; }

    /// The observer must outlive the simulation's steps.
    void add(Observer<D>& observer) { observers_.push_back(&observer); }

    /// One step, cut at the end of the case. Throws NumericalError after observers were told.
    void step();
    /// Steps to time t, s; the last one is cut to end there. Ends before where stop() says so after a step.
    void advance(double t, const Stop& stop = {});
    /// Steps to the end of the case, or until stop() says so, and tells observers that it has ended.
    void run(const Stop& stop = {});

    /// Whether the end of the case is reached.
    bool is_complete() const { return is_at(time_.end); }
    /// Whether the last step was cut to end at a given time.
    bool is_cut() const { return is_cut_; }

  private:
    bool is_at(double t) const;
    void begin();
    void step_towards(double t);

    std::unique_ptr<Scheme<D>> scheme_;
    State<D> state_;
    setup::TimeSpec time_;
    std::optional<Watch<D>> watch_;
    std::vector<Observer<D>*> observers_;
    bool has_begun_ = false;
    bool is_cut_    = false;
};

}  // namespace ordo
