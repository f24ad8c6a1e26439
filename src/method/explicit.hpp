// The explicit step: USF, USL, MUSL and what lies between the last two, with symplectic Euler or leapfrog, made of the passes of a method.
#pragma once

#include "method/mass_matrix.hpp"
#include "method/passes.hpp"
#include "method/scheme.hpp"
#include "method/stress_update.hpp"

namespace ordo {

template <int D>
class Explicit final : public Scheme<D> {
  public:
    explicit Explicit(Model<D> model);

    using Scheme<D>::model;

  private:
    /// F follows the coming step, or the step that ended at the current positions (USF).
    enum class Deform { next, past };

    /// Advanced by the forces of this step; projected again after that (MUSL); projected before any force is known: these feel no
    /// walls, for whether a wall holds or lets go is known after the kick only.
    enum class Velocity { advanced, remapped, projected };

    /// The kick of a step: the moment of the velocities after it, and its length, s.
    struct Kick {
        Moment when{};
        double dt = 0.0;
    };

    void start_domains(State<D>& s) const override;
    void find_projection(State<D>& s) const override;
    void take_step(State<D>& s, double dt) const override;

    const MethodSpec& method() const { return model().method; }
    using Scheme<D>::times;

    bool find_forces(State<D>& s, Lanes* nodes, Lanes* strain, const Kick& by) const;
    void change_nodes(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const;
    void update_particles(State<D>& s, Lanes* nodes, Lanes* update, Lanes* strain, double dt, const Kick& by) const;
    template <class Held>
    void project_velocities(State<D>& s, Lanes* nodes, const Held& held) const;
    bool filters(const State<D>& s) const;
    Lanes* filter(State<D>& s, Lanes* nodes, const Kick& by) const;
    void set_velocities(State<D>& s, Lanes* nodes) const;
    void hold_term(State<D>& s, Lanes* term, const Kick& by) const;
    void keep_forces(State<D>& s, const Lanes* nodes) const;
    void add_kick(State<D>& s, const Lanes* nodes, const Kick& by) const;
    const Lanes* find_load_forces(State<D>& s, const Lanes* nodes) const;
    void clear_nodes(State<D>& s, Lanes* nodes) const;
    void find_held_by_bodies(State<D>& s) const;
    double least_mass(State<D>& s, int body) const;
    void scatter_body(State<D>& s, int body, Lanes* nodes) const;
    void find_velocities(State<D>& s, Lanes* nodes, const Kick& by, const std::vector<HeldNode<D>>& held = {}) const;
    void solve_mass(State<D>& s, Lanes* nodes, unsigned parts, const std::vector<HeldNode<D>>& held) const;
    template <class Solve>
    void account_for(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by, const Solve& solve) const;
    void find_accelerations(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by) const;
    void kick(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const;
    void find_momenta(State<D>& s, Lanes* nodes) const;
    bool find_momenta_and_forces(State<D>& s, Lanes* nodes, const Kick& by) const;
    void add_forces(State<D>& s, Lanes* nodes, bool has_points) const;
    void find_force_stress(State<D>& s) const;
    void fit_cells(State<D>& s) const;
    void report_projection(State<D>& s, const Lanes* nodes, bool has_velocities) const;
    void find_gradients(State<D>& s, const Lanes* nodes) const;
    void move_corners(State<D>& s, Lanes* nodes, double dt) const;
    void move_corners(State<D>& s, const Sweep<D>& view) const;
    void scatter(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void scatter_points(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void gather(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt) const;
    void gather(State<D>& s, typename Passes<D>::Gather pass, const Sweep<D>& view) const;
    void deform(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt, Deform by = Deform::next) const;
    void deform_all(State<D>& s, typename Passes<D>::Gather pass, Sweep<D> view) const;
    template <class RunPass>
    void gather_tiles(State<D>& s, const RunPass& run) const;
    void constrain(State<D>& s, Lanes* nodes, const Kick& by, Velocity of) const;
    Sweep<D> sweep(State<D>& s, Lanes* nodes, double dt) const;
    /// Shared corners of cells have velocities, which fits take as samples.
    bool has_corner_samples() const { return method().samples == Samples::corners && has_cells(method()); }
    /// The part of the nodes' velocity in that of particles after the coming step.
    double pic_fraction(const State<D>& s) const
    {
        return method().update != Update::flip || filters(s) ? 1.0 : method().pic_fraction;
    }
    ExchangeSums<D> exchange_sums(State<D>& s, const Kick& by) const
    {
        return {s.account.is_wanted ? &s.account.of_boundaries : nullptr, by.dt};
    }

    Passes<D> passes_;
    StressUpdate<D> update_stress_;
    MassSolver<D> mass_solver_;
};

}  // namespace ordo
