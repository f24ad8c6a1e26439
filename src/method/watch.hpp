// Watches a run for growing energy, a time step above the limit, fits that samples do not determine, and points that lose contact. What ends every run is
// checked by require_sound in explicit.cpp.
#pragma once

#include "method/state.hpp"

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

struct WatchSpec {
    enum Kind { energy, time_step, dropped_pivots, gaps, count };
    static constexpr std::array<std::string_view, count> names{"energy", "time-step", "dropped-pivots", "gaps"};

    std::array<bool, count> is_fatal{true, false, false, false};
    /// By how much energy may grow that nothing has given, as a fraction of all energy that was there or was exchanged: kinetic and
    /// strain energy at the start, and the largest changes since by gravity, dissipation, boundaries, tractions, body forces, damping and changes between stages. Energies of
    /// strains below 1e-6 do not count: what is left of them may be round-off.
    double energy_growth = 1.0;
};

template <int D>
class Watch {
  public:
    /// Calls warn(message) at the first finding of each kind that is not fatal. Dropped pivots are fatal or not watched: with
    /// moving least squares they are usual at free surfaces.
    Watch(const Model<D>& model, const WatchSpec& spec, std::function<void(const std::string&)> warn)
        : model_(model), spec_(spec), warn_(std::move(warn))
    {}

    /// Stores the initial energy, or continues from `energies()`.
    void start(const State<D>& s);
    void resume(const std::vector<double>& energies, const State<D>& s);

    /// `before_step` is for steps whose size the user gave, `after_step` for all. Both throw NumericalError.
    void before_step(const State<D>& s, double dt);
    void after_step(const State<D>& s);

    /// How many steps had findings that are not fatal.
    const std::array<long, WatchSpec::count>& found() const { return found_; }

    /// For restarts, J: energy and gravitational energy at the start, then the largest exchanges since by gravity, materials
    /// (dissipation), boundaries, tractions, body forces, damping and changes between stages.
    const std::array<double, 10>& energies() const { return energies_; }

  private:
    void find_least(const State<D>& s);
    void look_for_growth(const State<D>& s);
    std::string remedy_for_growth() const;
    void look_for_gaps(const State<D>& s);
    void find(WatchSpec::Kind kind, const std::string& message);
    std::string fastest_particle(const State<D>& s) const;

    const Model<D>& model_;
    WatchSpec spec_;
    std::function<void(const std::string&)> warn_;
    std::array<double, 10> energies_{};
    double least_ = 0.0;  ///< energies below it do not count, J
    std::array<long, WatchSpec::count> found_{};
};

}  // namespace ordo
