// Third and fourth order at large deformation: splines are fitted to the fields of the particles by weighted least squares, the
// velocity gradient is projected onto the splines of the stress, and Runge-Kutta stages update the particles
// (docs/high_order.md).
#pragma once

#include "kernels/sweep.hpp"
#include "method/scheme.hpp"
#include "spline/axis_mass.hpp"
#include "spline/axis_matrix.hpp"
#include "spline/cell.hpp"
#include "spline/scratch.hpp"

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace ordo {

/// Values or slopes of the functions of one axis at the Gauss points of each cell.
struct GaussRows {
    int points = 0, width = 0;  ///< per cell: Gauss points, functions that do not vanish
    std::vector<double> at;     ///< [cell][point][function]

    const double* of_cell(int cell) const { return at.data() + static_cast<std::ptrdiff_t>(cell) * points * width; }
};

/// The least number of cells between walls for the splines of a method, which leaves out some knots.
int least_spline_cells(const MethodSpec& method);

/// Throws InputError for a model that projection `spline-fit` cannot treat: too few cells, materials with history, several
/// materials, tractions, free surfaces with hats, prescribed velocities, walls inside the grid, or, without free surfaces,
/// faces of the grid without walls.
template <int D>
void require_spline_model(const Model<D>& model);

/// Projection `spline-fit` with quadrature `spline`, gradient `projected` and a Runge-Kutta scheme:
///
///     v_h = argmin sum_p m_p (v_p - v_h(x_p))^2       s_h = argmin sum_p V_p (sigma_p - s_h(x_p))^2
///     rho_h, b_h: the same for m_p/V_p and b_p, with weight V_p
///     M a_h = f,   M_ij = int rho_h N_i N_j,   f_i = int -s_h grad N_i + N_i rho_h b_h
///     L_h = the L2 projection of grad v_h onto the splines of the stress
///     x' = v_h(x),  v' = a_h(x),  F' = L_h(x) F
///
/// Steps one state at a time, because it owns its scratch memory.
template <int D>
class SplineScheme final : public Scheme<D> {
  public:
    /// Throws InputError, see require_spline_model.
    explicit SplineScheme(Model<D> model);

    using Scheme<D>::model;

    /// Computes v_h, a_h and L_h at the particles, in `scratch`, from their current positions and body forces.
    void evaluate(State<D>& s) const;

    const SplineScratch<D>& scratch() const { return *scratch_; }
    const SplineSpace<D>& velocity_space() const { return v_space_; }
    const SplineSpace<D>& stress_space() const { return s_space_; }

  private:
    /// A function that a wall holds: the masks are 0 in the held lanes, 1 in the others.
    struct Held {
        std::size_t function;
        Lanes velocity, acceleration;
    };
    /// A component of a function that a boundary holds.
    struct Holder {
        std::size_t function;
        int component, boundary;
    };
    /// A symmetric positive definite system over the functions of a space, with eight right-hand sides.
    struct System;
    struct Conjugate;
    /// A tensor product over the axes, factored.
    struct Factors {
        std::array<Banded<Lanes>, D> of;
        std::optional<std::size_t> poor{};  ///< a function that has too few points, if there is one
    };

    /// Fits velocity and density only. Sets velocity and mass at the cell vertices, in the node records, and reports mass and
    /// momentum of grid and particles.
    void find_projection(State<D>& s) const override;
    /// All stages of a step; node records show the fields at its start. If a fit fails, puts the particles back to the start of
    /// the step, up to the damping of their velocities (null_damping), and throws NumericalError.
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
    /// For bodies with free surfaces, by quadrature: b -= int s_h grad N_i, and the projection of the gradient.
    void subtract_force() const;
    void project_gradient_of_body(State<D>& s) const;
    void damp_surface() const;
    /// work.at_points = splines of a space, or their slopes along an axis, times the quadrature weights, m^D; and the
    /// transposed operator: to += sums of value(work.at_points) times functions or slopes.
    void evaluate_at_points(const SplineSpace<D>& space, int slope_axis, const Lanes* from) const;
    template <class Value>
    void integrate_at_points(const SplineSpace<D>& space, int slope_axis, const Value& value, Lanes* to) const;
    void integrate_functions(const SplineSpace<D>& space, Lanes* to) const;
    double point_weight(const CutPoints& points, std::ptrdiff_t k) const;
    template <int P>
    std::array<double, D*(P + 1)> cut_row(const CutPoints& points, std::ptrdiff_t k, const SplineSpace<D>& space,
                                          int slope_axis) const;
    template <class Value>
    void find_matrix(const SplineSpace<D>& space, const GhostPenalty<D>& ghost, double ghost_weight, SplineMatrix<D>& matrix,
                     const Value& weight) const;
    /// The weights of particles in a fit: their volumes, or their masses in the lower four lanes.
    struct Weight {
        ParticleView<D> p;
        bool has_mass;

        Lanes operator()(std::ptrdiff_t i) const { return halves(has_mass ? p.m[i] : p.V[i], p.V[i]); }
    };
    static Lanes mean_weight(const Weight& weight);
    Cover cover_of(int cell) const;
    bool is_seen(const Index<D>& vertex) const;
    void subtract_force_of_full_grid() const;
    Vec<D, const double*> tables(const SplineSpace<D>& space, int slope_axis, const Index<D>& cell) const;
    void find_mass(State<D>& s) const;
    /// The differences between the fits.
    struct FitTask {
        SplineSolve::Kind solve;
        const char* what;  ///< for messages
        const SplineSpace<D>& space;
        const SampleRows& rows;
        const GhostPenalty<D>* ghost;                        ///< for bodies with free surfaces, else null
        const Lanes Held::*free                  = nullptr;  ///< null without walls
        const std::array<AxisEnds, D>* axes_free = nullptr;  ///< the same for each axis
        bool has_mass                            = false;    ///< see Weight
        bool is_known                            = false;    ///< the shape of the body is known
    };
    /// work.values[i] = value(i) for all particles.
    template <class Value>
    void set_values(const State<D>& s, const Value& value) const;
    void fit(State<D>& s, const FitTask& task, Array<Lanes>& x) const;
    template <int P, int W>
    void find_system_of_particles(const FitTask& task, const Weight& weight, const Lanes& ghost_weight) const;
    void solve(State<D>& s, const System& system, Lanes* x, Lanes* b) const;
    void find_row_sums(SplineMatrix<D>& matrix, std::size_t n) const;
    Factors factor_axes(const SplineMatrix<D>& matrix, const SplineSpace<D>& space, const std::array<AxisEnds, D>* free) const;
    void precondition(const System& system) const;
    void hold(const System& system, Lanes* records) const;
    CutFactor<D>& factor_of(SplineSolve::Kind solve, const SplineMatrix<D>& matrix) const;
    void require_enough(State<D>& s, const System& system) const;
    void hold_walls();
    void find_holders();
    std::vector<double> of_holders(const Lanes* records) const;
    void add_work(State<D>& s, double part) const;
    void add_reactions(State<D>& s, double part) const;
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
    int points_                 = 0;                       ///< Gauss points per cell and axis
    std::ptrdiff_t per_cell_    = 0;                       ///< Gauss points per cell
    std::ptrdiff_t gauss_count_ = 0;                       ///< Gauss points of all cells
    double cell_volume_         = 0.0;                     ///< m^D
    GaussRows gauss_[D], gauss_slopes_[D], s_gauss_[D];    ///< of the velocity's functions and of the stress's
    std::vector<double> gauss_weights_;                    ///< per Gauss point of a cell, m^D
    bool is_cut_ = false;                                  ///< bodies have free surfaces
    std::array<std::vector<IndexBox<D>>, 1 << D> blocks_;  ///< of cells; blocks of one colour share no function

    std::vector<Held> held_;
    std::vector<Holder> holders_;  ///< each component once
    /// For each axis and end: 1 in the lanes of a record that the wall leaves free.
    std::array<AxisEnds, D> velocity_free_, acceleration_free_;

    std::array<Banded<Lanes>, D> s_factors_;               ///< of int N^S_i N^S_j, for each axis, cells of length 1
    std::array<AxisMatrix, D> values_, slopes_;            ///< int N^S N and int N^S dN/dx, cells of length 1, slopes per m
    std::array<AxisMatrix, D> values_back_, slopes_back_;  ///< their transposes
    std::array<AxisMatrix, D> at_vertices_;                ///< values of the velocity's functions at the cell vertices
};

}  // namespace ordo
