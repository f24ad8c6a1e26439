// The interface of time stepping, on the host, called once a step. Explicit uses passes over particles and nodes, Implicit solves equations
// made of them, SplineScheme fits splines.
#pragma once

#include "method/node_list.hpp"
#include "method/stage.hpp"
#include "method/stage_times.hpp"
#include "method/state.hpp"

#include <string>

namespace ordo {

/// What is wrong with a particle, and what may help.
std::string describe(Fault fault, const MethodSpec& method);

/// A method applied to a model. Owns the model, which changes with the stages of a run only.
template <int D>
class Scheme {
  public:
    explicit Scheme(Model<D> model);
    virtual ~Scheme() = default;

    const Model<D>& model() const { return model_; }

    /// The state of undeformed particles: sets half-edges, stresses and reach, and sorts the particles. `particles` has x, v,
    /// m, V0, body, material and, if the method needs them, half0 or edges0; sigma, if not zero, is the initial stress where the
    /// law can have it (LawFunctions::set_stress). Of ranks each has some of the particles, in the order of their numbers; they go to
    /// the ranks of their tiles. Throws InputError, on all ranks, for domains that the method cannot have.
    State<D> start(Particles<D> particles, Ranks& ranks = alone()) const;

    /// The state of deformed particles: `particles` also has X and F; F determines volumes, stresses and domains. Rate laws
    /// start without stress.
    State<D> start_deformed(Particles<D> particles, Ranks& ranks = alone()) const;

    /// Sets the velocities of the nodes as the next step would, with boundary conditions. Returns mass and momentum of
    /// particles and nodes before these conditions.
    const ProjectionReport& project(State<D>& s) const;

    /// One step of size dt. If a particle fails, throws NumericalError with step, time, particle and quantity; the state is
    /// then that after the failed step and can still be written.
    void step(State<D>& s, double dt) const;

    /// Begins stage `number` of a run, see method/stage.hpp.
    void begin(const Stage<D>& stage, int number, State<D>& s);
    /// Makes an initial state one of stage `number` in the numbers of its particles and walls, for a restart that reads the rest.
    void prepare(const std::vector<Stage<D>>& stages, int number, State<D>& s);

    /// From now on `force` adds to the body forces of the model: to b of all particles at time t. Null ends this.
    void add_body_force(AddedBodyForce<D> force, State<D>& s);
    /// From now on `change` sees the nodes of each step after the forces and before the kick. Null ends this. Throws InputError for a
    /// method without a kick of nodes.
    void on_nodes(OnNodes<D> change);

    /// From now on adds the time of each stage to `times`; null stops this.
    void measure(StageTimes* times) { times_ = times; }

  protected:
    StageTimes* times() const { return times_; }
    bool has_loads() const { return has_body_force_ || added_body_force_ || !model_.tractions.empty(); }
    const OnNodes<D>& changes_nodes() const { return on_nodes_; }
    /// Sets body forces and tractions of all particles at time t.
    void evaluate_external_forces(State<D>& s, double t) const;
    /// Adds a step to `t`.
    static void advance_time(State<D>& s, double dt);
    /// Sorts the particles if they have moved too far since the last sort.
    void arrange(State<D>& s) const;

  private:
    /// Sets the domains of the particles from F, and their reach.
    virtual void start_domains(State<D>&) const {}
    /// `project` for sorted particles whose external forces are set.
    virtual void find_projection(State<D>& s) const = 0;
    /// `step` for sorted particles; advances the times. Sets `fault` if it fails.
    virtual void take_step(State<D>& s, double dt) const = 0;
    /// The same, and adds to `account`.
    void take_accounted_step(State<D>& s, double dt) const;

    Model<D> model_;
    bool has_body_force_;
    AddedBodyForce<D> added_body_force_;
    OnNodes<D> on_nodes_;
    StageTimes* times_ = nullptr;
};

}  // namespace ordo
