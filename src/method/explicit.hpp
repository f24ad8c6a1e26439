// The explicit step: USF, USL and MUSL with symplectic Euler or leapfrog, made of the passes of a method.
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

    void start_domains(State<D>& s) const override;
    void find_projection(State<D>& s) const override;
    void take_step(State<D>& s, double dt) const override;

    const MethodSpec& method() const { return model().method; }
    using Scheme<D>::times;

    bool find_forces(State<D>& s, Lanes* nodes, Lanes* strain) const;
    void update_particles(State<D>& s, Lanes* nodes, Lanes* strain, double dt, double t_kicked) const;
    void clear_nodes(State<D>& s, Lanes* nodes) const;
    void find_velocities(State<D>& s, Lanes* nodes) const;
    void solve_mass(State<D>& s, Lanes* nodes, const Lanes* known, unsigned parts) const;
    void kick(State<D>& s, Lanes* nodes, double dt, double t, bool has_velocities) const;
    void find_momenta(State<D>& s, Lanes* nodes) const;
    bool find_momenta_and_forces(State<D>& s, Lanes* nodes) const;
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
    void constrain(State<D>& s, Lanes* nodes, double t, Velocity of) const;
    Sweep<D> sweep(State<D>& s, Lanes* nodes, double dt) const;

    Passes<D> passes_;
    StressUpdate<D> update_stress_;
    MassSolver<D> mass_solver_;
};

}  // namespace ordo
