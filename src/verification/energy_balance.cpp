#include "verification/energy_balance.hpp"

#include "method/diagnostics.hpp"
#include "method/explicit.hpp"
#include "method/sums.hpp"

#include <vector>

namespace ordo::verification {

namespace {

/// sum_i v_i . u_i over nodes, with the lanes of two records from `of_v` and `of_u` on.
template <int D>
double product(const State<D>& s, const Lanes* v, int of_v, const Lanes* u, int of_u)
{
    return sum_over_nodes<1>(s, [&](std::ptrdiff_t i) {
        Numbers<1> r;
        for (int a = 0; a < D; ++a) r[0] += v[i][of_v + a] * u[i][of_u + a];
        return r;
    })[0];
}

/// The momenta M v of velocities of nodes, in the same lanes.
template <int D>
void momenta(const Model<D>& model, const MassSolver<D>& mass_matrix, State<D>& s, const Lanes* nodes, Lanes* to)
{
    if (model.method.mass == MassMatrix::lumped) {
        s.field.tiles.for_each_node_run([&](std::ptrdiff_t first, std::ptrdiff_t end) {
            for (std::ptrdiff_t i = first; i < end; ++i) to[i] = nodes[i] * nodes[i][NodeLane::mass];
        });
        return;
    }
    const Sweep<D> view{s.lattice, s.particles.view(), nullptr, model.materials.data(), 0.0, 0.0, model.method.stretch_limit};
    mass_matrix.apply(s, view, nodes, to);
}

}  // namespace

EnergyBalance& EnergyBalance::operator+=(const EnergyBalance& o)
{
    projection += o.projection;
    motion += o.motion;
    work += o.work;
    update += o.update;
    stress += o.stress;
    return *this;
}

template <int D>
EnergyBalance step_with_balance(Simulation<D>& sim)
{
    const Model<D>& model = sim.model();
    State<D>& s           = sim.state();
    const double dt       = sim.time().dt.value();
    const Totals before   = totals(model, s);
    if (!dynamic_cast<const Explicit<D>*>(&sim.scheme())) {  // nodes only show what splines are
        sim.step();
        const Totals after = totals(model, s);
        return {.update = after.kinetic_energy - before.kinetic_energy, .stress = after.strain_energy - before.strain_energy};
    }
    const MassSolver<D> mass_matrix(choose_passes<D>(model.method), lump_below_of(model.method), has_tls_velocity(model.method));
    constexpr int velocity = NodeLane::velocity, increment = NodeLane::increment;
    const double dt_of_kick = 0.5 * (s.dt_prev + dt);

    // Velocities, momenta and forces of the nodes before the step, which computes the same.
    sim.scheme().project(s);
    Array<Lanes> momentum(s.field.nodes.size());
    momenta(model, mass_matrix, s, s.field.nodes.data(), momentum.data());
    const double kinetic_before = 0.5 * product(s, s.field.nodes.data(), velocity, momentum.data(), velocity);
    std::vector<Lanes> forces(s.field.nodes.begin(), s.field.nodes.end());

    sim.step();
    const Totals after = totals(model, s);
    momenta(model, mass_matrix, s, s.field.nodes.data(), momentum.data());
    EnergyBalance e;
    const double kinetic_after = 0.5 * product(s, s.field.nodes.data(), velocity, momentum.data(), velocity);
    e.projection               = kinetic_before - before.kinetic_energy;
    e.motion                   = kinetic_after - kinetic_before;
    e.update                   = after.kinetic_energy - kinetic_after;
    // The mean of the velocities before and after is that after minus half of the increment.
    e.work = dt_of_kick * (product(s, s.field.nodes.data(), velocity, forces.data(), increment) -
                           0.5 * product(s, s.field.nodes.data(), increment, forces.data(), increment));
    if (model.method.scheme == TimeScheme::usf || model.method.filter == Filter::fmpm) e.work = e.motion;
    e.stress = after.strain_energy - before.strain_energy + e.work;
    return e;
}

template EnergyBalance step_with_balance(Simulation<1>&);
template EnergyBalance step_with_balance(Simulation<2>&);
template EnergyBalance step_with_balance(Simulation<3>&);

}  // namespace ordo::verification
