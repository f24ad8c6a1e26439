// What steps particles through time, as its users see it: a host interface, called once a step. Explicit steps by passes over
// nodes, SplineScheme by splines.
#pragma once

#include "method/stage_times.hpp"
#include "method/state.hpp"

namespace ordo {

/// A method applied to a model. Owns the model, which must not change.
template <int D>
class Scheme {
  public:
    explicit Scheme(Model<D> model);
    virtual ~Scheme() = default;

    const Model<D>& model() const { return model_; }

    /// The state of particles at rest in their initial domains: half-edges, stresses and reach set up, particles sorted.
    /// `particles` has x, v, m, V0, body, material and, where the method needs them, half0 or edges0.
    State<D> start(Particles<D> particles) const;

    /// The state of particles that are deformed already: `particles` also has X and F. Volumes, stresses and domains
    /// follow from F; rate laws start without stress.
    State<D> start_deformed(Particles<D> particles) const;

    /// Velocities of the nodes as the next step would find them, under boundary conditions, in lanes of the nodes.
    /// Returns what mass and momentum the projection kept before the conditions.
    const ProjectionReport& project(State<D>& s) const;

    /// One step of size dt. Throws NumericalError with step, time, particle and quantity; the state is then that after
    /// the failed step and can still be written.
    void step(State<D>& s, double dt) const;

    /// Adds the time of each stage to `times` from now on; null stops it.
    void measure(StageTimes* times) { times_ = times; }

  protected:
    StageTimes* times() const { return times_; }
    /// Body forces and tractions of all particles at time t.
    void evaluate_external_forces(State<D>& s, double t) const;
    /// Adds a step to `t`.
    static void advance_time(State<D>& s, double dt);

  private:
    /// Finds the domains of particles from their F, and how far they reach.
    virtual void start_domains(State<D>&) const {}
    /// `project` for sorted particles with their external forces.
    virtual void find_projection(State<D>& s) const = 0;
    /// `step` for sorted particles, with their times. Sets `fault` where it fails.
    virtual void take_step(State<D>& s, double dt) const = 0;

    void arrange(State<D>& s) const;

    Model<D> model_;
    bool has_body_force_;
    StageTimes* times_ = nullptr;
};

}  // namespace ordo
