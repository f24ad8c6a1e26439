// What SplineScheme works with.
#pragma once

#include "base/array.hpp"
#include "base/lanes.hpp"
#include "base/stress.hpp"
#include "base/vec.hpp"
#include "spline/body.hpp"

#include <array>
#include <vector>

namespace ordo {

/// Lanes of a record of the velocity's splines: velocity m/s, density kg/m^D, body force or acceleration m/s^2.
struct SplineLane {
    static constexpr int velocity     = 0;
    static constexpr int density      = 3;
    static constexpr int acceleration = 4;
};

/// The lane of component (a, b) of a symmetric tensor in a record of the stress' splines.
template <int D>
constexpr int stress_lane(int a, int b)
{
    const int lo = a < b ? a : b, hi = a < b ? b : a;
    return lo * D - lo * (lo - 1) / 2 + hi - lo;
}

/// Weights of particles at the functions of a space, [particle in order][axis][function].
struct SampleRows {
    int width = 0;  ///< of a particle
    Array<double> weights;
};

/// All of it follows from the particles: nothing of it is state.
template <int D>
struct SplineScratch {
    Array<int> order;        ///< particles in the order of their cells
    std::vector<int> first;  ///< of `order` in each cell, and the end
    SampleRows v_rows, s_rows;
    Array<Lanes> v, a;              ///< splines of velocity, density and body force, and of the acceleration, see SplineLane
    Array<Lanes> s;                 ///< of the stress, see stress_lane
    std::array<Array<Lanes>, D> L;  ///< of the columns of the velocity gradient
    SplineBody<D> body;             ///< of bodies with free surfaces
    Array<Lanes> surface;           ///< splines of its functions, a lane each
    /// Times their weights, at the Gauss points of all cells, cell by cell, and behind them at those of cut cells: kg; any field.
    Array<double> density;
    Array<Lanes> at_points;
    bool is_near = false;  ///< `v` and `s` are near those of the next fit: stages of a step
    enum Solve { kVelocity, kStress, kMass, kGradient };
    std::array<long, 4> iterations{};  ///< of conjugate gradients, in the last step

    Array<Lanes> values;       ///< of particles, that are fitted
    Array<Lanes> r, z, p, q;   ///< of conjugate gradients
    Array<Lanes> sums, scale;  ///< of rows of a matrix; of its preconditioner
    Array<Lanes> b;            ///< right-hand sides
    Array<Lanes> part;         ///< some lanes of `v`
    Array<Lanes> column;       ///< of the stress, and what it adds to forces
    Array<Lanes> force;
    std::array<Array<Lanes>, 2> between;  ///< axes

    /// Of particles: v_h, a_h and L_h where they are; the start of a step, and sums over its stages.
    Array<Vec<D>> v_at, a_at, x0, v0, dx, dv;
    Array<Mat<D>> L_at, F0, dF;
    Array<Stress<D>> sigma0, dsigma;
};

}  // namespace ordo
