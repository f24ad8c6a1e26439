// What schemes made of passes over particles and nodes have in common: the arguments of a pass, scatters and gathers over tiles, the motion of
// domains, the nodes that conditions of bodies hold.
#pragma once

#include "method/mass_matrix.hpp"
#include "method/passes.hpp"
#include "method/scheme.hpp"
#include "method/stress_update.hpp"

namespace ordo {

template <int D>
class PassScheme : public Scheme<D> {
  public:
    using Scheme<D>::model;

  protected:
    explicit PassScheme(Model<D> model);

    /// F follows the coming step, or the step that ended at the current positions (USF).
    enum class Deform { next, past };

    void start_domains(State<D>& s) const override;

    const MethodSpec& method() const { return model().method; }
    const Passes<D>& passes() const { return passes_; }
    const StressUpdate<D>& stress_update() const { return update_stress_; }
    const MassSolver<D>& mass_solver() const { return mass_solver_; }
    using Scheme<D>::times;

    Sweep<D> sweep(State<D>& s, Lanes* nodes, double dt) const;
    void clear_nodes(State<D>& s, Lanes* nodes) const;
    void scatter(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void scatter_points(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const;
    void gather(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt) const;
    void gather(State<D>& s, typename Passes<D>::Gather pass, const Sweep<D>& view) const;
    void deform(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt, Deform by = Deform::next) const;
    void move_corners(State<D>& s, Lanes* nodes, double dt) const;
    void move_corners(State<D>& s, const Sweep<D>& view) const;
    void solve_mass(State<D>& s, Lanes* nodes, unsigned parts, const std::vector<HeldNode<D>>& held) const;
    void find_held_by_bodies(State<D>& s) const;

    /// Shared corners of cells have velocities, which fits take as samples.
    bool has_corner_samples() const { return method().samples == Samples::corners && has_cells(method()); }
    /// Whether the coming step filters the velocities of particles.
    bool filters(const State<D>& s) const
    {
        return method().filter != Filter::none && (s.n + 1) % static_cast<long>(method().filter_every) == 0;
    }
    /// The part of the nodes' velocity in that of particles after the coming step.
    double pic_fraction(const State<D>& s) const
    {
        return method().update != Update::flip || filters(s) ? 1.0 : method().pic_fraction;
    }

  private:
    void deform_all(State<D>& s, typename Passes<D>::Gather pass, Sweep<D> view) const;
    template <class RunPass>
    void gather_tiles(State<D>& s, const RunPass& run) const;
    double least_mass(State<D>& s, int body) const;
    void scatter_body(State<D>& s, int body, Lanes* nodes) const;

    Passes<D> passes_;
    StressUpdate<D> update_stress_;
    MassSolver<D> mass_solver_;
};

}  // namespace ordo
