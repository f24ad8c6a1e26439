// The problem of `ordo bench`, run and measured: no options of the command line, no output.
#pragma once

#include "app/work.hpp"

#include <array>
#include <optional>

namespace ordo::app {

struct BenchTask {
    MethodSpec method;
    int dim       = 3;
    int particles = 0;         ///< about
    std::optional<int> steps;  ///< of a repetition; without it as many as take about two seconds, at most 20
    int repeats = 1;
};

/// Medians over the repetitions.
struct Measurement {
    int particles = 0, cells_per_axis = 0, steps = 0;
    double courant_number = 0;                       ///< dt c/h
    double seconds        = 0;                       ///< of a repetition
    std::array<double, StageTimes::count> stages{};  ///< the parts of it that stages took
    double mass_solves = 0, mass_iterations = 0;     ///< of the consistent mass matrix, a step
    double bytes_per_particle = 0;                   ///< of the particles' own arrays
    /// The most that was resident, less what was before the model was made, over the particles: to the end, sort included,
    /// and until the particles were made from shapes.
    std::optional<double> resident_bytes, setup_bytes;
    StepWork work;  ///< of a step

    double particle_steps() const { return static_cast<double>(particles) * steps; }
};

/// A block of 3/4 of a unit box (all of it with projection spline-fit), 2^D particles a cell, vibrating a little: the problem of
/// the project's speed targets.
Measurement run_bench(const BenchTask& task);

}  // namespace ordo::app
