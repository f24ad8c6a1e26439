// The problem of `ordo bench`, run and measured: no options of the command line, no output.
#pragma once

#include "app/work.hpp"
#include "material/material.hpp"

#include <array>
#include <optional>

namespace ordo::app {

struct BenchTask {
    MethodSpec method;
    Material material;  ///< of density 1000 kg/m^3
    int dim       = 3;
    int particles = 0;         ///< approximately
    std::optional<int> steps;  ///< per repetition; default: as many as take about two seconds, at most 20
    int repeats = 1;
};

/// Medians over the repetitions.
struct Measurement {
    int particles = 0, cells_per_axis = 0, steps = 0;
    double courant_number = 0;                       ///< dt c/h
    double seconds        = 0;                       ///< of a repetition
    std::array<double, StageTimes::count> stages{};  ///< of these, in each stage
    double mass_solves = 0, mass_iterations = 0;     ///< of the consistent mass matrix, per step
    double bytes_per_particle = 0;                   ///< of the particles' own arrays
    /// Peak resident memory minus that before the model was made, per particle: until the end, including the sort, and until
    /// particles were made from shapes.
    std::optional<double> resident_bytes, setup_bytes;
    StepWork work;  ///< per step

    double particle_steps() const { return static_cast<double>(particles) * steps; }
};

/// A block of 3/4 of a unit box (all of it with projection spline-fit), 2^D particles per cell, vibrating slightly: the problem
/// of the project's speed targets.
Measurement run_bench(const BenchTask& task);

}  // namespace ordo::app
