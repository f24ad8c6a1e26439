// A stage of a run: what is in force during it, and what changes at its start.
#pragma once

#include "method/state.hpp"

#include <string>
#include <vector>

namespace ordo {

template <int D>
struct Stage {
    /// The material of a body from now on.
    struct Change {
        int body, material;
    };

    std::string name{};
    double start = 0.0, end = 0.0;  ///< planned, s
    double residual = 0.0;          ///< State::residual at which it ends earlier; 0: it does not
    Damping damping{};
    std::vector<Condition<D>> conditions{};
    std::vector<Wall<D>> walls{};
    std::vector<Traction<D>> tractions{};  ///< those that do not act are zero
    std::vector<int> removed{};            ///< bodies that are taken out at its start
    std::vector<Change> materials{};       ///< changes at its start
};

/// Puts conditions, walls, tractions and damping of a stage in force.
template <int D>
void put_in_force(const Stage<D>& stage, Model<D>& model);

/// Takes the bodies out that a stage removes, and arranges what depends on the numbers of particles and walls. The state must be
/// sorted after that. `model` is that of the stage before.
template <int D>
void remove_bodies(const Stage<D>& stage, const Model<D>& model, State<D>& s);

/// Begins a stage: `model` and `s` are those of the stage before, and become those of stage `number`. The clock goes to the
/// planned start. Particles whose material changes keep their Cauchy stress and the history columns that both laws have; the
/// account gets the energy that leaves. Throws NumericalError if a law cannot have a stress.
template <int D>
void begin_stage(const Stage<D>& stage, int number, Model<D>& model, State<D>& s);

/// Throws NumericalError if a stage is over and its residual, if it has one, is not reached.
template <int D>
void require_rest(const Stage<D>& stage, const State<D>& s, bool is_over);

/// How many boundaries the conditions and walls of all stages belong to.
template <int D>
std::size_t boundary_count(const std::vector<Stage<D>>& stages);

}  // namespace ordo
