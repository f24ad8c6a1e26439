// Third and fourth order at large deformation: fields of particles become splines by weighted least squares, the velocity
// gradient is projected onto the splines of the stress, and particles are the data of Runge-Kutta stages (docs/high_order.md).
#pragma once

#include "kernels/sweep.hpp"
#include "method/scheme.hpp"
#include "spline/axis_mass.hpp"
#include "spline/axis_matrix.hpp"
#include "spline/cell.hpp"
#include "spline/cut_factor.hpp"
#include "spline/scratch.hpp"

#include <array>
#include <memory>
#include <utility>
#include <vector>

namespace ordo {

/// Values of an axis' functions, or their slopes, at the Gauss points of each of its cells.
struct GaussRows {
    int points = 0, width = 0;  ///< of a cell; functions that do not vanish there
    std::vector<double> at;     ///< [cell][point][function]

    const double* of_cell(int cell) const { return at.data() + static_cast<std::ptrdiff_t>(cell) * points * width; }
};

/// Cells along an axis between walls below which there are no splines with the knots that a method leaves out.
int least_spline_cells(const MethodSpec& method);

/// Throws InputError for a model that projection `spline-fit` cannot hold: faces without walls, prescribed velocities, planes
/// inside the grid, tractions, several materials, fewer cells than the spaces need.
template <int D>
void require_spline_model(const Model<D>& model);

/// Projection `spline-fit` with quadrature `spline`, gradient `projected` and a scheme of Runge and Kutta:
///
///     v_h = argmin sum_p m_p (v_p - v_h(x_p))^2       s_h = argmin sum_p V_p (sigma_p - s_h(x_p))^2
///     rho_h, b_h: the same of m_p/V_p and b_p, weight V_p
///     M a_h = f,   M_ij = int rho_h N_i N_j,   f_i = int -s_h grad N_i + N_i rho_h b_h
///     L_h = the L2 projection of grad v_h onto the splines of the stress
///     x' = v_h(x),  v' = a_h(x),  F' = L_h(x) F
///
/// Steps one state at a time: what it works with is its own.
template <int D>
class SplineScheme final : public Scheme<D> {
  public:
    /// Throws InputError, see require_spline_model.
    explicit SplineScheme(Model<D> model);

    using Scheme<D>::model;

    /// v_h, a_h and L_h at the particles, in `scratch`, for particles as they are with the body forces that they have.
    void evaluate(State<D>& s) const;

    const SplineScratch<D>& scratch() const { return *scratch_; }
    const SplineSpace<D>& velocity_space() const { return v_space_; }
    const SplineSpace<D>& stress_space() const { return s_space_; }

  private:
    /// What walls hold: lanes of these functions are 0 in the masks, others 1.
    struct Held {
        std::size_t function;
        Lanes velocity, acceleration;
    };
    /// A symmetric positive definite system of functions, eight right-hand sides at a time.
    struct System;
    struct Conjugate;
    using Factors = std::array<Banded<Lanes>, D>;

    /// Fits velocities and densities alone: velocity and mass at the vertices of cells, in the records of the nodes, and mass and
    /// momentum of grid and particles.
    void find_projection(State<D>& s) const override;
    /// The stages; records of nodes become those of the start of the step. Throws NumericalError, the particles being those of the
    /// start.
    void take_step(State<D>& s, double dt) const override;
    using Scheme<D>::times;

    void find_slopes(State<D>& s) const;
    void sort(State<D>& s) const;
    void find_body(State<D>& s) const;
    void show(State<D>& s) const;
    void report(State<D>& s) const;
    void fit_velocity(State<D>& s) const;
    void fit_stress(State<D>& s) const;
    void find_density(State<D>& s) const;
    void solve_acceleration(State<D>& s) const;
    void project_gradient(State<D>& s) const;
    /// On bodies with free surfaces, by quadrature: b -= int s_h grad N_i, and the projection of the gradient.
    void subtract_force() const;
    void project_gradient_of_body(State<D>& s) const;
    void damp_surface(const Lanes& ghost_weight) const;
    /// work.at_points = weights, volumes, times splines of a space, or times their slopes along an axis; and to += the transposed
    /// of value(work.at_points).
    void evaluate_at_points(const SplineSpace<D>& space, int slope_axis, const Lanes* from) const;
    template <class Value>
    void integrate_at_points(const SplineSpace<D>& space, int slope_axis, const Value& value, Lanes* to) const;
    void integrate_functions(const SplineSpace<D>& space, Lanes* to) const;
    /// work.at_points = value(k).
    template <class Value>
    void fill_points(const Value& value) const;
    double point_weight(const CutPoints& points, std::ptrdiff_t k) const;
    template <int P>
    std::array<double, D*(P + 1)> cut_row(const CutPoints& points, std::ptrdiff_t k, const SplineSpace<D>& space,
                                          int slope_axis) const;
    CutFactor<D> factor_at_points(const SplineSpace<D>& space, const GhostPenalty<D>& ghost, double ghost_weight) const;
    /// Lane by lane the mass or the volume of a particle.
    struct Weight {
        ParticleView<D> p;
        Lanes volume;  ///< 1 in lanes whose weight is the volume, 0 in those of the mass

        Lanes operator()(std::ptrdiff_t i) const { return (1.0 - volume) * p.m[i] + volume * p.V[i]; }
    };
    static Lanes mean_weight(const Weight& weight);
    Cover cover_of(int cell) const;
    bool is_seen(const Index<D>& vertex) const;
    void subtract_force_of_full_grid() const;
    Vec<D, const double*> tables(const SplineSpace<D>& space, int slope_axis, const Index<D>& cell) const;
    void multiply_mass(const Lanes* from, Lanes* to) const;
    /// What fits of particles differ in.
    struct FitTask {
        typename SplineScratch<D>::Solve solve;
        const char* what;  ///< for messages
        const SplineSpace<D>& space;
        const SampleRows& rows;
        const Factors& factors;
        const Lanes Held::*free;       ///< null without walls
        Lanes volume;                  ///< 1 in lanes whose weight is the volume
        const GhostPenalty<D>* ghost;  ///< of bodies with free surfaces, else null
        bool is_known;                 ///< where the body is
    };
    /// work.values = value(i) of the particles.
    template <class Value>
    void set_values(const State<D>& s, const Value& value) const;
    void fit(State<D>& s, const FitTask& task, Array<Lanes>& x) const;
    void solve(State<D>& s, const System& system, Lanes* x, Lanes* b) const;
    void precondition(const System& system) const;
    void hold(const System& system, Lanes* records) const;
    void require_enough(State<D>& s, const System& system, const Lanes& unit, int singular) const;
    void hold_walls();
    void set_axis(int a);
    void set_colours();
    void remember(State<D>& s) const;
    void restore(State<D>& s) const;
    TileReport add_slope(State<D>& s, double part, double further, bool is_last) const;

    template <class F>
    void for_each_cell(F&& f) const;
    template <class F>
    void for_each_covered_cell(F&& f) const;

    std::unique_ptr<SplineScratch<D>> scratch_ = std::make_unique<SplineScratch<D>>();
    SplineSpace<D> v_space_, s_space_;
    Index<D> cells_{};
    int cell_count_             = 0;
    int points_                 = 0;                       ///< Gauss points of a cell along an axis
    std::ptrdiff_t per_cell_    = 0;                       ///< of a cell
    std::ptrdiff_t gauss_count_ = 0;                       ///< of all cells
    double cell_volume_         = 0.0;                     ///< m^D
    GaussRows gauss_[D], gauss_slopes_[D], s_gauss_[D];    ///< of the velocity's functions, and of the stress'
    std::vector<double> gauss_weights_;                    ///< of the Gauss points of a cell, m^D
    bool is_cut_ = false;                                  ///< bodies have free surfaces
    std::array<std::vector<IndexBox<D>>, 1 << D> blocks_;  ///< of cells; those of a colour share no function

    std::vector<Held> held_;
    /// Lanes of a record that the walls at both ends of an axis leave free are 1.
    std::array<std::array<Lanes, 2>, D> velocity_free_, acceleration_free_;

    Factors v_factors_, a_factors_, s_factors_;  ///< of the mass matrix of unit density along each axis
    std::array<AxisMatrix, D> values_, slopes_;  ///< int N^S N and int N^S dN/dx over cells of length 1, velocity to stress
    std::array<AxisMatrix, D> values_back_, slopes_back_;  ///< transposed
    std::array<AxisMatrix, D> at_vertices_;                ///< the velocity's functions there
};

}  // namespace ordo
