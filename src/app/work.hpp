// The work of a step: floating point operations and bytes of memory traffic, counted from the formulas of its passes for the
// given particles; for `ordo bench`. It measures no time and reads no hardware counters.
#pragma once

#include "method/scheme.hpp"
#include "spline/scratch.hpp"

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

/// The work of one step for all particles.
struct StepWork {
    std::array<Work, StageTimes::count> stages{};
    double visits = 0.0;  ///< visits of node records by particles in one pass

    Work total() const;
};

/// The work of one step from `s`, a state after at least one step. The step solves with the consistent mass matrix
/// `mass_solves` times, in `mass_iterations` iterations in total.
///
/// **Flops** are counted for records: an addition, multiplication or division of one of eight lanes is one, idle lanes
/// included, and of forces, fluxes and gradients one of four; and for small tensors of particles and nodes, with the neo-Hookean material and a logarithm as one. Weights, their
/// gradients and addresses are not counted, only the sums of the method.
///
/// **Bytes** are counted as if each pass read and wrote every particle field, and every node or cell record that it touches,
/// once: caches keep a record between its visits within a pass, and nothing from one pass to the next. Memory that is written
/// is not read first, as in the triad of `ordo bench --machine`. The sort, body forces, tractions, boundary conditions and
/// periodic images are not counted.
template <int D>
StepWork count_work(const Scheme<D>& scheme, State<D>& s, double mass_solves, double mass_iterations);

/// The same for projection spline-fit, with the iterations of each kind of system, see SplineScratch. Sums over the functions
/// at a particle are counted axis by axis, like those over the Gauss points of a cell.
template <int D>
StepWork count_spline_work(const Model<D>& model, const State<D>& s, const SplineIterations& iterations);

}  // namespace ordo
