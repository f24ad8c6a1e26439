// The equations of an implicit step for the displacements u of nodes: forces less inertia, their derivative as a product, and as a matrix for
// preconditioners.
#pragma once

#include "implicit/jump_penalty.hpp"
#include "implicit/obstacle_forces.hpp"
#include "implicit/particle_forces.hpp"
#include "implicit/tangent_matrix.hpp"
#include "method/mass_matrix.hpp"
#include "method/passes.hpp"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace ordo {

/// r(u) = f_ext - f_int(u) - c M (u - dt v) + k f_n + l f_c(u) - G u = 0 for the unknowns that no condition holds. f are forces at the end of the step, or
/// with scheme midpoint those that act in its middle; f_n those at the start, with scheme newmark. f_c are those of obstacles, at the end and over all of
/// the step: they move nodes by dt^2 f_c/2m and dt f_c/m, so l is 1, with newmark 1/(2 beta). Unknown D k + a is component a of row k + 1. The
/// functions of nodes are those of the start of the step, x_n.
template <int D>
class StepEquations {
  public:
    using Vector = std::vector<double>;
    /// Sets the body forces of all particles, at their positions, at a time.
    using SetBodyForces = std::function<void(State<D>&, double t)>;

    /// Projects masses and velocities to the nodes. Arguments must outlive the object.
    StepEquations(const Model<D>& model, const Passes<D>& passes, const MassSolver<D>& mass_solver, State<D>& s, double dt,
                  SetBodyForces set_body_forces);

    std::size_t size() const { return held_.size(); }
    const std::vector<unsigned char>& held() const { return held_; }
    /// The axes along which a condition or an obstacle acts on the node of each row, from 1, at the last residual.
    std::vector<Vec<D, bool>> held_axes() const;
    /// The displacements of held unknowns in the step, m; others are 0.
    const Vector& known() const { return known_; }
    /// Where to begin: the displacements by velocities of the lumped mass, which are bounded by those of the particles, or those of the last load
    /// step, m.
    const Vector& guess() const { return guess_; }

    /// r(u) in all unknowns: the force that is missing, and at held ones with the opposite sign that of their conditions. False if a particle
    /// or law fails, see report().
    bool find_residual(std::span<const double> u, std::span<double> r, bool with_derivatives);
    const TileReport& report() const { return report_; }
    /// The largest norm of forces there, reactions included, N: what residuals are compared with.
    double force() const { return force_; }
    /// What rounding may leave of the last residual, N ..
    double rounding() const { return rounding_; }
    /// .. and whether it may leave this one at each node that no condition holds, with the stiffness of the particles there.
    bool may_be_rounding(std::span<const double> residual);

    /// Of the particle whose volume grows or shrinks most, by a factor.
    struct ChangeOfVolume {
        int particle  = -1;
        double factor = 1.0;
    };
    ChangeOfVolume largest_change_of_volume(std::span<const double> u);

    /// y = -dr/du x, at the last residual with derivatives, in all unknowns.
    void multiply(std::span<const double> x, std::span<double> y);
    /// The same as a matrix, but without changes of loads, and with averages over cells without the part that their stresses have in it.
    SparseRows<Mat<D>> matrix();
    /// Whether the matrix is symmetric at the last residual: forces are the derivatives of an energy, or of a potential of the step as with
    /// associated flow.
    bool is_symmetric() const;
    /// The lattice index of each row's node; on periodic axes from 0.
    std::vector<Index<D>> places() const;

    /// Sets the velocity lanes of `nodes` to the velocities after the step and the increments to their change, m/s ..
    void set_velocities(std::span<const double> u, Lanes* nodes) const;
    /// .. or both to the mean velocity of the step and zero.
    void set_mean_velocities(std::span<const double> u, Lanes* nodes) const;
    /// Sets the increment lanes of `nodes` to forces without gravity, or loads alone, over the step up to the last residual, N.
    void set_mean_forces(Lanes* nodes, bool loads_alone);
    /// The impulse of a condition at a held unknown, for the residual and the change of momentum there, N s.
    double impulse_of_condition(std::size_t k, double residual, double momentum) const;
    /// Adds those of the ghost penalty.
    void add_penalty_forces(std::span<const double> u, Lanes* nodes) const;

    /// Keeps how nodes move in a load step, for the guess of the next one.
    void keep_load_step(std::span<const double> u) const;
    /// The obstacle that a body would enter from further away than contact is looked for; -1 if there is none.
    int missed_obstacle(std::span<const double> u) const { return obstacles_->misses(u); }
    /// Leaves what obstacles did at the last residual in the state, and moves them.
    void finish_contact() { obstacles_->finish(); }

    const NodeRows<D>& rows() const { return rows_; }
    /// Of component a of a row.
    static std::size_t unknown(int row, int a) { return static_cast<std::size_t>(row - 1) * D + static_cast<std::size_t>(a); }
    std::ptrdiff_t node_of(std::size_t k) const { return rows_.node(static_cast<int>(k / D) + 1); }

  private:
    Sweep<D> sweep(Lanes* nodes) const;
    const MethodSpec& method() const { return model_.method; }
    void scatter(typename Passes<D>::Scatter pass, const Sweep<D>& view);
    void project_velocities();
    void number_rows(const Lanes* nodes);
    bool is_newmark() const { return method().scheme == TimeScheme::newmark; }
    void fit_guess();
    void find_start_forces();
    void set_forces(Lanes* nodes, bool loads_alone);
    double rounding_of(double modulus, double mass) const;
    double late_contact(std::size_t k) const;
    int row_at(Index<D> node) const;
    void find_held();
    void find_penalty();
    void add_mass();
    void sample(std::span<const double> x, Array<Vec<D>>& value, Array<Mat<D>>& gradient);
    void put(std::span<const double> x, Lanes* nodes, int lane) const;
    void subtract_inertia(std::span<const double> x, std::span<double> r, double factor);
    template <class F>
    void for_each_unknown(const F& f) const
    {
        parallel_for_each(rows_.count(), [&](std::ptrdiff_t k) {
            for (int a = 0; a < D; ++a) f(static_cast<std::size_t>(D * k + a), rows_.node(static_cast<int>(k) + 1), a);
        });
    }

    const Model<D>& model_;
    const Passes<D>& passes_;
    const MassSolver<D>& mass_solver_;
    State<D>& s_;
    double dt_, inertia_ = 0.0;  ///< s; the factor c, 1/s^2
    bool is_middle_;
    SetBodyForces set_body_forces_;
    NodeRows<D> rows_;
    Vector mass_, velocity_, start_, guess_, known_, known_velocity_;
    Vector stopped_;        ///< projected velocities of fixed components, m/s
    Vector end_force_;      ///< at the last residual, without inertia, N
    Vector contact_force_;  ///< f_c there, if there are obstacles
    // With scheme newmark those at the start of the step: all but those of obstacles, the same without gravity, and loads alone.
    Vector start_force_, start_nodal_force_, start_load_;
    std::vector<unsigned char> held_;
    ParticleForces<D> forces_;
    BlockRows<D> block_rows_;
    std::optional<TangentMatrix<D>> tangent_matrix_;
    JumpPenalty<D> penalty_;
    std::optional<ObstacleForces<D>> obstacles_;
    Array<Lanes> nodes_;
    Array<Vec<D>> u_, d_force_, moved_;
    Array<Mat<D>> f_, d_moment_;
    TileReport report_;
    Vector modulus_;  ///< of the stiffest particle at each row, once needed, Pa
    double force_ = 0.0, rounding_ = 0.0, largest_ = 0.0, largest_mass_ = 0.0, largest_modulus_ = 0.0;
    double end_part_ = 1.0, start_factor_ = 0.0, contact_factor_ = 1.0;  ///< of f at the end in the mean force; k; l
};

}  // namespace ordo
