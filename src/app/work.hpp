// What a step asks of the machine: floating point operations and bytes of memory traffic, counted from the formulas of its
// passes for the particles as they lie; for `ordo bench`. It knows nothing of times and of counters in hardware.
#pragma once

#include "method/scheme.hpp"

#include <array>

namespace ordo {

struct Work {
    double flops = 0.0;
    double bytes = 0.0;

    Work& operator+=(const Work& o)
    {
        flops += o.flops;
        bytes += o.bytes;
        return *this;
    }
};

/// The work of one step, of all particles.
struct StepWork {
    std::array<Work, StageTimes::count> stages{};
    double visits = 0.0;  ///< node records that the particles meet in one pass, each time that they are met

    Work total() const;
};

/// The work of one step from `s`, which a step has led to; it solves the consistent mass matrix `mass_solves` times, in
/// `mass_iterations` iterations altogether.
///
/// **Flops** are those of the records: an addition, multiplication or division of one of eight lanes is one, idle lanes
/// included; then those of the particles' and nodes' own small tensors, with the material neo-Hookean and a logarithm as one.
/// Weights, their gradients and addresses are left out: what is counted is what the sums of a method ask for.
///
/// **Bytes** are what each pass moves if it reads and writes every particle field, and every node or cell record that it
/// touches, once: caches hold a record between its visits, and nothing from one pass to the next. Memory that is written is
/// not read first, as in the triad of `ordo bench --machine`. The sort, body forces, tractions, conditions and images of
/// periodic axes are not counted.
template <int D>
StepWork count_work(const Scheme<D>& scheme, State<D>& s, double mass_solves, double mass_iterations);

/// The same for the stages of splines, with the iterations of each of their systems, see SplineScratch. A sum over the functions of
/// a particle goes axis by axis, as one over the Gauss points of a cell.
template <int D>
StepWork count_spline_work(const Model<D>& model, const State<D>& s, const std::array<long, 4>& iterations);

}  // namespace ordo
