// The explicit step: USF, USL, MUSL and what lies between the last two, with symplectic Euler or leapfrog, made of the passes of a method.
#pragma once

#include "method/pass_scheme.hpp"

namespace ordo {

template <int D>
class Explicit final : public PassScheme<D> {
  public:
    explicit Explicit(Model<D> model);

    using Scheme<D>::model;

  private:
    /// Advanced by the forces of this step; projected again after that (MUSL); projected before any force is known: these feel no
    /// walls, for whether a wall holds or lets go is known after the kick only.
    enum class Velocity { advanced, remapped, projected };

    /// The kick of a step: the moment of the velocities after it, and its length, s.
    struct Kick {
        Moment when{};
        double dt = 0.0;
    };

    using PassScheme<D>::method;
    using PassScheme<D>::passes;
    using PassScheme<D>::mass_solver;
    using PassScheme<D>::times;
    using PassScheme<D>::sweep;
    using PassScheme<D>::clear_nodes;
    using PassScheme<D>::scatter;
    using PassScheme<D>::scatter_points;
    using PassScheme<D>::gather;
    using PassScheme<D>::deform;
    using PassScheme<D>::move_corners;
    using PassScheme<D>::solve_mass;
    using PassScheme<D>::find_held_by_bodies;
    using PassScheme<D>::has_corner_samples;
    using PassScheme<D>::filters;
    using PassScheme<D>::pic_fraction;
    using typename PassScheme<D>::Deform;

    void find_projection(State<D>& s) const override;
    void take_step(State<D>& s, double dt) const override;

    bool find_forces(State<D>& s, Lanes* nodes, Lanes* strain, const Kick& by) const;
    void change_nodes(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const;
    void update_particles(State<D>& s, Lanes* nodes, Lanes* update, Lanes* strain, double dt, const Kick& by) const;
    template <class Held>
    void project_velocities(State<D>& s, Lanes* nodes, const Held& held) const;
    Lanes* filter(State<D>& s, Lanes* nodes, const Kick& by) const;
    void set_velocities(State<D>& s, Lanes* nodes) const;
    void hold_term(State<D>& s, Lanes* term, const Kick& by) const;
    void keep_forces(State<D>& s, const Lanes* nodes) const;
    void add_kick(State<D>& s, const Lanes* nodes, const Kick& by) const;
    const Lanes* find_load_forces(State<D>& s, const Lanes* nodes) const;
    void find_velocities(State<D>& s, Lanes* nodes, const Kick& by, const std::vector<HeldNode<D>>& held = {}) const;
    template <class Solve>
    void account_for(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by, const Solve& solve) const;
    void find_accelerations(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by) const;
    void kick(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const;
    void find_momenta(State<D>& s, Lanes* nodes) const;
    bool find_momenta_and_forces(State<D>& s, Lanes* nodes, const Kick& by) const;
    void add_forces(State<D>& s, Lanes* nodes, bool has_points) const;
    void add_surface_forces(State<D>& s, Lanes* nodes) const;
    void find_force_stress(State<D>& s) const;
    void fit_cells(State<D>& s) const;
    void report_projection(State<D>& s, const Lanes* nodes, bool has_velocities) const;
    void find_gradients(State<D>& s, const Lanes* nodes) const;
    void constrain(State<D>& s, Lanes* nodes, const Kick& by, Velocity of) const;
    ExchangeSums<D> exchange_sums(State<D>& s, const Kick& by) const
    {
        return {s.account.is_wanted ? &s.account.of_boundaries : nullptr, by.dt};
    }
};

}  // namespace ordo
