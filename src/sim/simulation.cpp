#include "sim/simulation.hpp"

#include "method/energy_account.hpp"
#include "setup/schemes.hpp"
#include "setup/time_step.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace ordo {

namespace {

// Steps add up to the end except for rounding: a smaller rest is no step.
constexpr double kRounding = 1e-6;  // of a step

}  // namespace

template <int D>
Simulation<D>::Simulation(setup::Built<D> built, const WatchSpec& watch, Warn warn, Ranks& ranks)
    : scheme_(make_scheme(std::move(built.model))),
      state_(scheme_->start(std::move(built.particles), ranks)),
      time_(built.time),
      stages_(std::move(built.stages)),
      bodies_(std::move(built.bodies)),
      notes_(std::move(built.notes))
{
    if (!warn) warn = [](const std::string&) {};
    if (!stages_.empty()) state_.account.boundaries.resize(boundary_count(stages_));
    start_account(scheme_->model(), state_);
    watch_.emplace(scheme_->model(), watch, std::move(warn));
    watch_->start(state_);
}

template <int D>
Simulation<D>::Simulation(Model<D> model, const Start& start, const setup::TimeSpec& time)
    : scheme_(make_scheme(std::move(model))), state_(start(*scheme_)), time_(time)
{}

template <int D>
bool Simulation<D>::is_at(double t) const
{
    return t - state_.t <= kRounding * state_.dt_prev;
}

template <int D>
void Simulation<D>::begin()
{
    if (std::exchange(has_begun_, true)) return;
    for (Observer<D>* o : observers_) o->started(*this);
}

template <int D>
bool Simulation<D>::is_stage_over() const
{
    if (stages_.empty()) return false;
    const Stage<D>& stage = stages_[static_cast<std::size_t>(state_.stage)];
    return is_at(stage.end) || (stage.residual > 0 && state_.residual <= stage.residual);
}

template <int D>
void Simulation<D>::begin_stage_if_due()
{
    if (is_in_last_stage() || !is_stage_over()) return;
    const int next = state_.stage + 1;
    scheme_->begin(stages_[static_cast<std::size_t>(next)], next, state_);
}

/// A step, and what must hold after it.
template <int D>
void Simulation<D>::take(double dt, bool is_given)
{
    if (watch_ && is_given) watch_->before_step(state_, dt);
    scheme_->step(state_, dt);
    if (watch_) watch_->after_step(state_);
    if (!stages_.empty()) require_rest(stages_[static_cast<std::size_t>(state_.stage)], state_, is_stage_over());
}

template <int D>
void Simulation<D>::step_towards(double t, std::optional<double> given)
{
    try {
        begin_stage_if_due();
    } catch (const NumericalError& e) {
        for (Observer<D>* o : observers_) o->failed(*this, e);
        throw;
    }
    if (is_at(t)) return;  // the clock has jumped
    const double end   = stages_.empty() ? t : std::min(t, stages_[static_cast<std::size_t>(state_.stage)].end);
    double dt          = given ? *given : setup::time_step(time_, model(), state_.particles, *state_.ranks);
    const double left  = end - state_.t;
    const bool is_less = left < dt * (1 - kRounding);
    if (is_less) dt = left;
    is_cut_ = is_less && end == t;  // every run makes the last step of a stage that another one follows
    const StepSize size{dt, is_cut_};
    for (Observer<D>* o : observers_) o->before_step(*this, size);
    try {
        take(dt, given || time_.dt);
    } catch (const NumericalError& e) {
        for (Observer<D>* o : observers_) o->failed(*this, e);
        throw;
    }
    if (is_less) {
        state_.t      = end;
        state_.t_rest = 0;
    }
    for (Observer<D>* o : observers_) o->after_step(*this, size);
}

template <int D>
void Simulation<D>::step()
{
    ORDO_EXPECT(!is_complete());
    begin();
    step_towards(time_.end);
}

template <int D>
void Simulation<D>::step_on(std::optional<double> dt)
{
    ORDO_EXPECT(stages_.empty() || !is_complete());
    begin();
    step_towards(std::numeric_limits<double>::infinity(), dt);
}

template <int D>
void Simulation<D>::advance(double t, const Stop& stop)
{
    begin();
    while (!is_at(t) && !(!stages_.empty() && is_complete()) && !(stop && stop())) step_towards(t);
}

template <int D>
void Simulation<D>::run(const Stop& stop)
{
    advance(time_.end, stop);
    for (Observer<D>* o : observers_) o->ending(*this);
    for (Observer<D>* o : observers_) o->ended(*this);
}

template class Simulation<1>;
template class Simulation<2>;
template class Simulation<3>;

}  // namespace ordo
