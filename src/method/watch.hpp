// What a run is watched for beyond what no step survives (see require_sound in explicit.cpp): energy that grows, a time step above
// the limit, fits that samples do not determine.
#pragma once

#include "method/state.hpp"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

struct WatchSpec {
    enum Kind { energy, time_step, dropped_pivots, count };
    static constexpr std::array<std::string_view, count> names{"energy", "time-step", "dropped-pivots"};

    std::array<bool, count> is_fatal{true, false, false};
    /// How much kinetic, strain and gravity's potential energy together may grow, as a part of what there was to begin with:
    /// kinetic and strain energy at the start and all that gravity has given or taken. Not watched without it.
    std::optional<double> energy_growth;
};

template <int D>
class Watch {
  public:
    /// warn(message) where something is found that is not fatal: the first time of its kind. Dropped pivots are fatal or not
    /// looked at: with moving least squares they are usual at free surfaces.
    Watch(const Model<D>& model, const WatchSpec& spec, std::function<void(const std::string&)> warn)
        : model_(model), spec_(spec), warn_(std::move(warn))
    {}

    /// Notes the energy to begin with, or goes on from `energies()`. Throw InputError where there is none to compare with.
    void start(const State<D>& s);
    void resume(const std::vector<double>& energies);

    /// Before a step of a size that the user gave, and after each. Throw NumericalError.
    void before_step(const State<D>& s, double dt);
    void after_step(const State<D>& s);

    /// How many steps had what is not fatal.
    const std::array<long, WatchSpec::count>& found() const { return found_; }

    /// What a restart must know, J: the energy at the start, that of gravity then, and the largest difference of the latter.
    const std::array<double, 3>& energies() const { return energies_; }

  private:
    void require_energy() const;
    void find(WatchSpec::Kind kind, const std::string& message);
    std::string fastest_particle(const State<D>& s) const;

    const Model<D>& model_;
    WatchSpec spec_;
    std::function<void(const std::string&)> warn_;
    std::array<double, 3> energies_{};
    std::array<long, WatchSpec::count> found_{};
};

}  // namespace ordo
