// The explicit step: USF, USL and MUSL on symplectic Euler or leapfrog, from the passes of a method; or the stages of
// splines.
#pragma once

#include "method/mass_matrix.hpp"
#include "method/passes.hpp"
#include "method/stage_times.hpp"
#include "method/state.hpp"
#include "method/stress_update.hpp"

#include <memory>

namespace ordo {

template <int D>
class SplineScheme;

/// A method applied to a model. Owns the model, which must not change.
template <int D>
class Explicit {
  public:
    explicit Explicit(Model<D> model);

    const Model<D>& model() const { return model_; }

    /// The state of particles at rest in their initial domains: half-edges, stresses and reach set up, particles sorted.
    /// `particles` has x, v, m, V0, body, material and, where the method needs them, half0 or edges0.
    State<D> start(Particles<D> particles) const;

    /// The state of particles that are deformed already: `particles` also has X and F. Volumes, stresses and domains
    /// follow from F; rate laws start without stress.
    State<D> start_deformed(Particles<D> particles) const;

    /// Velocities of the nodes as the next step would find them, under boundary conditions, in lanes of `s.nodes`.
    /// Returns what mass and momentum the projection kept before the conditions.
    const ProjectionReport& project(State<D>& s) const;

    /// One step of size dt. Throws NumericalError with step, time, particle and quantity; the state is then that after
    /// the failed step and can still be written.
    void step(State<D>& s, double dt) const;

    /// The splines of projection spline-fit; null without it.
    const SplineScheme<D>* splines() const { return splines_.get(); }

    /// Adds the time of each stage to `times` from now on; null stops it.
    void measure(StageTimes* times) { times_ = times; }

  private:
    /// By the step to come, or by that which led here (USF).
    enum class Deform { next, past };

    void arrange(State<D>& s) const;
    void step_splines(State<D>& s, double dt) const;
    bool find_forces(State<D>& s, Lanes* nodes, Lanes* strain) const;
    void update_particles(State<D>& s, Lanes* nodes, Lanes* strain, double dt, double t_kicked) const;
    void finish_step(State<D>& s, double dt) const;
    void evaluate_external_forces(State<D>& s, double t) const;
    void clear_nodes(State<D>& s, Lanes* nodes) const;
    void velocities(State<D>& s, Lanes* nodes) const;
    void solve_mass(State<D>& s, Lanes* nodes, const Lanes* known, unsigned parts) const;
    void advance(State<D>& s, Lanes* nodes, double dt, double t, bool has_velocities) const;
    void project(State<D>& s, Lanes* nodes) const;
    bool project_and_force(State<D>& s, Lanes* nodes) const;
    void add_forces(State<D>& s, Lanes* nodes, bool has_points) const;
    void fit_cells(State<D>& s) const;
    void report_projection(State<D>& s, const Lanes* nodes, bool has_velocities) const;
    void find_gradients(State<D>& s, const Lanes* nodes) const;
    void move_corners(State<D>& s, Lanes* nodes, double dt) const;
    void scatter(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void scatter_points(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void gather(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt) const;
    void deform(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt, Deform by = Deform::next) const;
    template <class RunPass>
    void gather_tiles(State<D>& s, const RunPass& run) const;
    void constrain(State<D>& s, Lanes* nodes, double t) const;
    Sweep<D> sweep(State<D>& s, Lanes* nodes, double dt) const;

    Model<D> model_;
    Passes<D> passes_;
    StressUpdate<D> update_stress_;
    MassSolver<D> mass_solver_;
    std::shared_ptr<const SplineScheme<D>> splines_;  ///< of projection spline-fit, which takes its own steps
    bool has_body_force_;
    StageTimes* times_ = nullptr;
};

/// That of its method and bodies, see method/courant.hpp.
template <int D>
double stable_courant_number(const Model<D>& model);

/// h over the P-wave speed plus |v|, smallest over axes and particles, s: times courant_scale, of which `cfl` is a part, or
/// times stable_courant_number, which no time step may pass.
template <int D>
double courant_time_step(const Model<D>& model, const Particles<D>& particles);
template <int D>
double stable_time_step(const Model<D>& model, const Particles<D>& particles);

/// The time step for a `cfl`, s.
template <int D>
double automatic_time_step(const Model<D>& model, const Particles<D>& particles, double cfl);

}  // namespace ordo
