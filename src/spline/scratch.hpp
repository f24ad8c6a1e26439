// The scratch memory of SplineScheme.
#pragma once

#include "base/array.hpp"
#include "base/lanes.hpp"
#include "base/stress.hpp"
#include "base/vec.hpp"
#include "spline/body.hpp"
#include "spline/cut_factor.hpp"
#include "spline/matrix.hpp"

#include <array>
#include <optional>
#include <vector>

namespace ordo {

/// Lanes of a coefficient record of the velocity space: velocity, m/s; body force or acceleration, m/s^2; density, kg/m^D.
/// Fits weigh the lower four with the masses of particles, the upper four with their volumes, see SplineMatrix.
struct SplineLane {
    static constexpr int velocity     = 0;
    static constexpr int acceleration = 4;
    static constexpr int density      = 7;
};

/// The lane of component (a, b) of a symmetric tensor in a coefficient record of the stress space.
template <int D>
constexpr int stress_lane(int a, int b)
{
    const int lo = a < b ? a : b, hi = a < b ? b : a;
    return lo * D - lo * (lo - 1) / 2 + hi - lo;
}

/// Values of the functions of a space at the particles, [particle in order][axis][function].
struct SampleRows {
    int width = 0;  ///< values per particle
    Array<double> weights;
};

/// Kinds of systems.
struct SplineSolve {
    enum Kind { velocity, stress, mass, gradient, surface, count };
};
using SplineIterations = std::array<long, SplineSolve::count>;  ///< of conjugate gradients, per kind

/// All of it is computed from the particles; none of it is state.
template <int D>
struct SplineScratch {
    Array<int> order;        ///< particles sorted by cell
    std::vector<int> first;  ///< index in `order` of the first particle of each cell, then the end
    SampleRows v_rows, s_rows;
    Array<Lanes> v, a;              ///< coefficients: velocity, density and body force; acceleration (SplineLane)
    Array<Lanes> s;                 ///< coefficients of the stress, see stress_lane
    std::array<Array<Lanes>, D> L;  ///< coefficients of the columns of the velocity gradient
    SplineBody<D> body;             ///< for bodies with free surfaces
    Array<Lanes> surface;           ///< coefficients of its level sets, one lane each
    /// The density, kg, and any field, both times the quadrature weights: first at the Gauss points of all cells, cell by cell,
    /// then at the points of cut cells.
    Array<double> density;
    Array<Lanes> at_points;
    bool is_near = false;           ///< `v` and `s` are good first guesses for the next fit: stages after the first
    SplineIterations iterations{};  ///< of conjugate gradients in the last step
    long solves = 0;                ///< systems solved in it
    std::array<std::optional<CutFactor<D>>, SplineSolve::count> factors;  ///< preconditioners for bodies with free surfaces

    SplineMatrix<D> fitted;               ///< of the last fit
    SplineMatrix<D> mass;                 ///< M
    SplineMatrix<D> gradient;             ///< of the projected gradient, for bodies with free surfaces
    Array<Lanes> values;                  ///< of the particles: the data of a fit
    Array<Lanes> r, z, p, q;              ///< vectors of conjugate gradients
    std::vector<double> forces;           ///< on the components that boundaries hold, N
    double ghost_weight = 0.0;            ///< of the ghost penalty in the mass matrix, kg
    Array<Lanes> sums, scale;             ///< row sums of a matrix; scale of its preconditioner
    Array<Lanes> b;                       ///< right-hand sides
    Array<Lanes> part;                    ///< some lanes of `v`, also with those of `a`
    Array<Lanes> column;                  ///< a column of the stress; fields at vertices
    Array<Lanes> force;                   ///< its part of the forces
    std::array<Array<Lanes>, 2> between;  ///< results after some of the axes

    /// Per particle: v_h, a_h and L_h at its position; its fields at the start of a step, and sums over the stages.
    Array<Vec<D>> v_at, a_at, x0, v0, dx, dv;
    Array<Mat<D>> L_at, F0, dF;
    Array<Stress<D>> sigma0, dsigma;
};

}  // namespace ordo
