#include "method/explicit.hpp"

#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "method/averaging.hpp"
#include "method/contact_step.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "method/enrichment.hpp"
#include "method/place.hpp"
#include "method/reconstruction.hpp"
#include "method/wall_contact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ordo {

template <int D>
Explicit<D>::Explicit(Model<D> of) : PassScheme<D>(std::move(of))
{}

template <int D>
void Explicit<D>::take_step(State<D>& s, double dt) const
{
    if (s.n == 0 && method().start == Start::plain) {  // as if a step had been taken before
        s.dt_prev = dt;
        s.t_v     = s.t - 0.5 * dt;
    }
    const double dt_kick = 0.5 * (s.dt_prev + dt);  // velocities live at half steps; leapfrog starts with half a kick
    const Kick by{{s.t_v + dt_kick, dt}, dt_kick};

    Lanes* nodes  = s.field.nodes.data();
    Lanes* strain = strains_by_advanced(method()) ? nodes : s.field.strain_nodes.data();

    find_held_by_bodies(s);
    clear_nodes(s, nodes);
    const bool has_velocities = find_forces(s, nodes, strain, by);  // m_i, (m v)_i or v_i, f_i <- particles
    if (s.projection.is_wanted) report_projection(s, nodes, has_velocities);
    if (s.account.is_wanted) keep_forces(s, nodes);
    if (this->changes_nodes()) change_nodes(s, nodes, by, has_velocities);
    kick(s, nodes, by, has_velocities);  // v_i; a_i = f_i/m_i + g; v_i += dt a_i
    constrain(s, nodes, by, Velocity::advanced);
    if (s.account.is_wanted) add_kick(s, nodes, by);
    if (keeps_corner_velocity(method())) keep_velocities(s, nodes);
    Lanes* update = filters(s) ? filter(s, nodes, by) : nodes;

    if (has_corner_samples()) move_corners(s, sweep(s, update, 0.0));  // v_c
    update_particles(s, nodes, update, strain, dt, by);
    if (passes().move_corners) move_corners(s, nodes, dt);  // cells: x_c, then x_p and V_p
    for (std::size_t k = 0; k < model().walls.size(); ++k) s.wall_shifts[k] += dt * model().walls[k].velocity_at(by.when.t);
    if (!model().obstacles.empty()) ordo::move(model().obstacles, model().contacts, dt, s.contacts);
    const double before = s.t;
    this->advance_time(s, dt);
    s.t_v = by.when.t;
    s.t_F = method().scheme == TimeScheme::usf ? before : s.t;
}

/// Sets the nodes before the kick; USF updates the stress first. Returns whether the nodes have velocities instead of momenta.
template <int D>
bool Explicit<D>::find_forces(State<D>& s, Lanes* nodes, Lanes* strain, const Kick& by) const
{
    if (method().scheme != TimeScheme::usf) {
        this->evaluate_external_forces(s, s.t);
        return find_momenta_and_forces(s, nodes, by);
    }
    find_momenta(s, nodes);         // m_i, (m v)_i <- particles
    find_velocities(s, nodes, by);  // v_i
    s.field.halo.copy(nodes);
    copy(strain, nodes, s.field.tiles);
    constrain(s, strain, {{s.t_v, s.dt_prev}}, Velocity::projected);
    find_gradients(s, strain);
    deform(s, passes().deform, strain, s.dt_prev, Deform::past);  // F_p, sigma_p at t_n from v_i of the previous step
    this->evaluate_external_forces(s, s.t);
    add_forces(s, nodes, false);  // f_i <- sigma_p
    return true;
}

/// Lets a user change momenta and forces before the kick. What is not changed keeps its bits. For the account the changes are like those
/// of constraints: by an impulse now, and by forces over the kick.
template <int D>
void Explicit<D>::change_nodes(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const
{
    NodeForces<D> now{.nodes = nodes_with_mass(s), .momentum = {}, .force = {}, .t = s.t, .dt = by.dt};
    for (std::size_t k = 0; k < now.nodes.record.size(); ++k) {
        const Lanes& n  = nodes[now.nodes.record[k]];
        const double m  = now.nodes.mass[k];
        Vec<D>&momentum = now.momentum.emplace_back(), &force = now.force.emplace_back();
        for (int a = 0; a < D; ++a) {
            momentum[a] = n[NodeLane::velocity + a] * (has_velocities ? m : 1.0);
            force[a]    = n[NodeLane::increment + a] + m * model().gravity[a];
        }
    }
    const NodeForces<D> before = now;
    double of_impulses = 0.0, of_forces = 0.0;  // work, J
    this->changes_nodes()(now);
    for (std::size_t k = 0; k < now.nodes.record.size(); ++k) {
        Lanes& n       = nodes[now.nodes.record[k]];
        const double m = now.nodes.mass[k];
        for (int a = 0; a < D; ++a) {
            const double momentum = now.momentum[k][a], force = now.force[k][a];
            if (!std::isfinite(momentum) || !std::isfinite(force))
                throw NumericalError(fmt::format("on_nodes: {} of the node at {} is not finite",
                                                 std::isfinite(force) ? "momentum" : "force", place_text(now.nodes.place[k])));
            const double old = before.momentum[k][a], old_force = before.force[k][a];
            if (momentum != old) n[NodeLane::velocity + a] = momentum / (has_velocities ? m : 1.0);
            if (force != old_force) n[NodeLane::increment + a] = force - m * model().gravity[a];
            of_impulses += (momentum * momentum - old * old) / (2 * m);
            of_forces += by.dt * (force - old_force) * (momentum + 0.5 * by.dt * force) / m;
        }
    }
    s.account.nodes.constraints += of_impulses;
    s.account.nodes_work -= of_impulses + of_forces;
    s.field.halo.copy(nodes);
}

/// Updates v_p from the nodes of `update`, and F_p, sigma_p and x_p from the kicked nodes. x_p comes last, so that phi is evaluated at x_n
/// until then.
template <int D>
void Explicit<D>::update_particles(State<D>& s, Lanes* nodes, Lanes* update, Lanes* strain, double dt, const Kick& by) const
{
    const bool is_remapped = projects_again(method()), is_advanced = strains_by_advanced(method());
    if (is_advanced && method().averaging == Averaging::none && update == nodes) {
        if (passes().keep && !stores_gradient(method())) gather(s, passes().keep, nodes, dt);
        find_gradients(s, nodes);
        deform(s, passes().update_all, nodes, dt);
        return;
    }
    if (!is_remapped && passes().keep && !stores_gradient(method())) gather(s, passes().keep, nodes, dt);
    gather(s, passes().update_velocity, update, dt);  // v_p <- a_i
    if (is_advanced) {                                // the same in parts, because averages need F of all particles
        find_gradients(s, nodes);
        deform(s, passes().deform, nodes, dt);
    }
    if (is_remapped) {
        if (passes().keep) gather(s, passes().keep, nodes, dt);
        project_velocities(s, strain, [&] {  // the same nodes again, with the new v_p
            const bool is_coupled = method().mass == MassMatrix::consistent;
            return is_coupled ? held_by_walls(model(), s, strain, by.when.t) : std::vector<HeldNode<D>>{};
        });
        constrain(s, strain, by, Velocity::remapped);
        blend_velocities(strain, nodes, s.field.tiles, strain_velocity_of(method()));
        find_gradients(s, strain);
        deform(s, passes().deform, strain, dt);  // F_p, sigma_p from the remapped velocity, blended with the advanced one
    }
    if (passes().move) gather(s, passes().move, nodes, dt);
}

/// Velocities of nodes from those of the particles. held() lists nodes that walls hold, once masses are known.
template <int D>
template <class Held>
void Explicit<D>::project_velocities(State<D>& s, Lanes* nodes, const Held& held) const
{
    clear_nodes(s, nodes);
    find_momenta(s, nodes);
    find_velocities(s, nodes, {}, held());
}

/// Filters the velocities of the kicked nodes, of which particles then take all (docs/energy.md). Returns the nodes that they take them
/// from. FMPM: v_i = sum_{l < k} (1 - R S)^l v_i, also for positions and strains (Nairn & Hammerquist 2021). XPIC: that sum of the
/// velocities before the kick, and the kick (Hammerquist & Nairn 2017).
template <int D>
Lanes* Explicit<D>::filter(State<D>& s, Lanes* nodes, const Kick& by) const
{
    const bool is_xpic = method().filter == Filter::xpic;
    FilterNodes<D>& f  = s.filter;
    for (Array<Lanes>* one : {&f.sum, &f.term, &f.again}) make_room(*one, s.field.nodes.size());
    Lanes *sum = is_xpic ? f.sum.data() : nodes, *term = f.term.data(), *again = f.again.data();
    if (is_xpic) copy(sum, nodes, s.field.tiles);
    copy(term, nodes, s.field.tiles);
    if (is_xpic) take_increments(term, s.field.tiles);

    Particles<D>& p = s.particles;
    copy(f.kept, p.v);
    copy(f.kept_of_corners, p.corner_velocity);
    for (int order = 1; order < static_cast<int>(method().filter_order); ++order) {
        set_velocities(s, term);
        project_velocities(s, again, [] { return std::vector<HeldNode<D>>{}; });
        add_velocities(term, again, s.field.tiles, -1.0);
        hold_term(s, term, by);
        s.field.halo.copy(term);
        add_velocities(sum, term, s.field.tiles, 1.0);
    }
    std::swap(f.kept, p.v);
    std::swap(f.kept_of_corners, p.corner_velocity);
    return sum;
}

/// Gives particles the velocities of the nodes, and what they carry besides.
template <int D>
void Explicit<D>::set_velocities(State<D>& s, Lanes* nodes) const
{
    Sweep<D> view    = sweep(s, nodes, 0.0);
    view.pic         = 1.0;
    view.sums_energy = false;
    gather(s, passes().update_velocity, view);
    if (passes().keep) gather(s, passes().keep, view);
    if (has_corner_samples()) move_corners(s, view);
}

/// Takes the components of a term of the filter that conditions and walls hold: they give their impulses to the particles.
template <int D>
void Explicit<D>::hold_term(State<D>& s, Lanes* term, const Kick& by) const
{
    std::vector<ExchangeParts> taken(s.account.is_wanted ? s.account.boundaries.size() : 0);
    const ExchangeSums<D> sums(s.account.is_wanted ? &taken : nullptr, by.dt);
    s.field.constraints.add_impulses(model().conditions, by.when, sums, [&](std::ptrdiff_t node, int a) {
        return -term[node][NodeLane::mass] * std::exchange(term[node][NodeLane::velocity + a], 0.0);
    });
    s.field.wall_nodes.repeat(model().walls, s.wall_shifts, term, std::vector<Vec<D>>(model().walls.size()), by.when, sums);
    ExactSum work;  // on top of the kick's, which the account has
    for (std::size_t k = 0; k < taken.size(); ++k) {
        s.account.of_boundaries[k] += taken[k];
        work += taken[k].work;
    }
    const double given = -total(*s.ranks, work);
    s.account.nodes.constraints += given;
    s.account.filtered += given;
}

/// Keeps the nodes before a kick, for the account.
template <int D>
void Explicit<D>::keep_forces(State<D>& s, const Lanes* nodes) const
{
    Stopwatch watch(times(), StageTimes::nodes);
    make_room(s.forces, s.field.nodes.size());
    copy(s.forces.data(), nodes, s.field.tiles);
}

/// Adds a kick to the account.
template <int D>
void Explicit<D>::add_kick(State<D>& s, const Lanes* nodes, const Kick& by) const
{
    const Lanes* loads = this->has_loads() ? find_load_forces(s, nodes) : nullptr;
    auto add = [&](const auto& momentum) { ordo::add_kick(s, model().gravity, by.dt, nodes, s.forces.data(), loads, momentum); };
    if (method().mass == MassMatrix::lumped) return add([&](std::ptrdiff_t i) { return nodes[i] * nodes[i][NodeLane::mass]; });
    mass_solver().multiply_solution(s, sweep(s, nullptr, 0.0), nodes);
    const MassSystem<D>& mass = s.field.mass;
    add([&](std::ptrdiff_t i) { return mass.q[mass.rows.row(i)]; });
}

/// The part of nodal forces that is of tractions and body forces.
template <int D>
const Lanes* Explicit<D>::find_load_forces(State<D>& s, const Lanes* nodes) const
{
    make_room(s.load_nodes, s.field.nodes.size());
    Lanes* loads = s.load_nodes.data();
    copy(loads, nodes, s.field.tiles);  // some functions depend on masses and volumes
    clear_increments(loads, s.field.tiles);
    const bool is_of_points = method().quadrature == Quadrature::cell || has_gauss_forces(method());
    Array<Stress<D>>& sigma = is_of_points ? s.points.sigma : s.force_stress;
    const auto count        = static_cast<std::size_t>(is_of_points ? s.points.sigma.size() : s.particles.count);
    if (s.no_stress.size() != count) s.no_stress = Array<Stress<D>>(count);
    std::swap(sigma, s.no_stress);
    if (is_of_points)
        scatter_points(s, passes().force_points, loads, NodeLane::increment, NodeLane::volume);
    else
        scatter(s, passes().force, loads, NodeLane::increment, NodeLane::volume);
    std::swap(sigma, s.no_stress);
    if (is_of_points) add_surface_forces(s, loads);
    return loads;
}

template <int D>
void Explicit<D>::find_projection(State<D>& s) const
{
    Lanes* nodes = s.field.nodes.data();
    find_held_by_bodies(s);
    clear_nodes(s, nodes);
    const bool has_velocities = find_momenta_and_forces(s, nodes, {});
    report_projection(s, nodes, has_velocities);
    if (!has_velocities) find_velocities(s, nodes, {});
    constrain(s, nodes, {{s.t_v, s.dt_prev}}, Velocity::projected);
}

template <int D>
void Explicit<D>::find_velocities(State<D>& s, Lanes* nodes, const Kick& by, const std::vector<HeldNode<D>>& held) const
{
    Stopwatch watch(times(), passes().velocity_fit.solve ? StageTimes::fit : StageTimes::nodes);
    if (passes().velocity_fit.solve)
        fit_velocities(model(), passes().velocity_fit, s, sweep(s, nodes, 0.0), nodes);
    else if (method().mass == MassMatrix::lumped)
        momenta_to_velocities(nodes, s.field.tiles);
    else
        account_for(s, nodes, MassSolver<D>::kVelocity, by, [&] {
            solve_mass(s, nodes, MassSolver<D>::kVelocity, held);
            return false;
        });
}

/// Solves, by solve() that says whether s.mass.q has the product with the solution, and adds the impulses of constraints in a kick: the particles gain what A u - b is short of at the components that they
/// hold, velocities in their PIC part.
template <int D>
template <class Solve>
void Explicit<D>::account_for(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by, const Solve& solve) const
{
    const ExchangeSums<D> sums = exchange_sums(s, by);
    auto weighted              = [&, pic = pic_fraction(s)](const Lanes& n, int a) {  // N s
        double r = 0.0;
        if (parts & MassSolver<D>::kVelocity) r += pic * n[NodeLane::velocity + a];
        if (parts & MassSolver<D>::kAcceleration) r += by.dt * n[NodeLane::increment + a];
        return r;
    };
    std::vector<double> given;
    const bool leaves_momentum = pic_fraction(s) == 0.0 && !(parts & MassSolver<D>::kAcceleration);
    if (by.dt > 0 && sums.is_wanted() && !leaves_momentum)
        s.field.constraints.for_each([&](std::ptrdiff_t node, int a, bool) { given.push_back(weighted(nodes[node], a)); });
    const bool has_product = solve();
    if (given.empty()) return;
    if (!has_product) mass_solver().multiply_solution(s, sweep(s, nodes, 0.0), nodes);
    std::size_t k = 0;
    s.field.constraints.add_impulses(model().conditions, by.when, sums, [&](std::ptrdiff_t node, int a) {
        const int row    = s.field.mass.rows.row(node);
        const double was = given[k++];
        return row > 0 ? weighted(s.field.mass.q[row], a) - was : 0.0;
    });
}

/// Accelerations with a consistent mass matrix, and with them velocities if `parts` says so.
template <int D>
void Explicit<D>::find_accelerations(State<D>& s, Lanes* nodes, unsigned parts, const Kick& by) const
{
    account_for(s, nodes, parts, by, [&] {
        WallContact<D> walls(model(), s, nodes, s.field.known.data(), by.when, by.dt);
        if (walls.is_empty()) {
            solve_mass(s, nodes, parts, {});
            return false;
        }
        walls.solve([&](const std::vector<HeldNode<D>>& held) { solve_mass(s, nodes, parts, held); },
                    [&] { mass_solver().multiply_solution(s, sweep(s, nodes, 0.0), nodes); }, exchange_sums(s, by));
        return true;
    });
}

template <int D>
void Explicit<D>::kick(State<D>& s, Lanes* nodes, const Kick& by, bool has_velocities) const
{
    const bool is_lumped = method().mass == MassMatrix::lumped;
    if (!has_velocities && !is_lumped && (s.field.constraints.has_prescribed() || !model().walls.empty())) {
        find_velocities(s, nodes, by);
        has_velocities = true;
    }
    Stopwatch watch(times(), StageTimes::nodes);
    if (!is_lumped) {
        // The acceleration of constrained components is zero, or leads to the prescribed velocity.
        Lanes* known = s.field.known.data();
        s.field.constraints.for_each_velocity(
            model().conditions, by.when, [&](std::ptrdiff_t node, int a, bool is_prescribed, double v) {
                const double total                   = is_prescribed ? (v - nodes[node][NodeLane::velocity + a]) / by.dt : 0.0;
                known[node][NodeLane::increment + a] = total - model().gravity[a];
            });
        find_accelerations(s, nodes, MassSolver<D>::kAcceleration | (has_velocities ? 0u : MassSolver<D>::kVelocity), by);
    }
    const NodeState state = !is_lumped ? NodeState::solved : has_velocities ? NodeState::velocity : NodeState::momentum;
    ordo::kick(nodes, s.field.tiles, model().gravity, by.dt, state);
}

/// m_i and (m v)_i, summed over particles or Gauss points.
template <int D>
void Explicit<D>::find_momenta(State<D>& s, Lanes* nodes) const
{
    if (has_tls_velocity(method())) {
        fit_cells(s);
        scatter_points(s, passes().project_points, nodes, 0, NodeLane::end);
        if (method().domain == Domain::point) return;
        make_room(s.particle_nodes, s.field.nodes.size());
        Lanes* of_particles = s.particle_nodes.data();
        clear_nodes(s, of_particles);
        scatter(s, passes().project, of_particles, 0, NodeLane::end);
        settle_masses(s, nodes, of_particles, false);
    } else {
        scatter(s, passes().project, nodes, 0, NodeLane::end);
        if (keeps_corner_velocity(method())) restore_momenta(s, nodes);
    }
}

/// The same and f_i. Returns whether the nodes have velocities instead of momenta: with fits, and if m_i is not the mass of the
/// projection.
template <int D>
bool Explicit<D>::find_momenta_and_forces(State<D>& s, Lanes* nodes, const Kick& by) const
{
    const bool finds_velocities = passes().velocity_fit.solve || method().quadrature == Quadrature::cell;
    const bool is_fused         = passes().project_and_force && !passes().cell_fit.spread;
    if (is_fused) {
        find_force_stress(s);
        scatter(s, passes().project_and_force, nodes, 0, NodeLane::end);
        if (keeps_corner_velocity(method())) restore_momenta(s, nodes);
    } else {
        find_momenta(s, nodes);
    }
    if (finds_velocities) find_velocities(s, nodes, by);
    if (is_fused) return finds_velocities;
    s.field.halo.copy(nodes);
    add_forces(s, nodes, has_tls_velocity(method()));
    return finds_velocities;
}

/// f_i by the quadrature. Quadrature `cell` also sets m_i, so nodes must have velocities. `has_points`: the points are set.
template <int D>
void Explicit<D>::add_forces(State<D>& s, Lanes* nodes, bool has_points) const
{
    constexpr int force = NodeLane::increment;
    const bool is_cell  = method().quadrature == Quadrature::cell;
    if (!is_cell && !has_gauss_forces(method())) {
        find_force_stress(s);
        scatter(s, passes().force, nodes, force, NodeLane::volume);
        return;
    }
    if (!has_points) fit_cells(s);
    if (is_cell) {
        make_room(s.particle_nodes, s.field.nodes.size());
        Lanes* of_particles = s.particle_nodes.data();
        copy(of_particles, nodes, s.field.tiles);
        clear_masses(nodes, s.field.tiles);
        if (passes().project_and_force_points) {
            scatter_points(s, passes().project_and_force_points, nodes, NodeLane::mass, NodeLane::end);
        } else {
            scatter_points(s, passes().project_points, nodes, NodeLane::mass, NodeLane::end);
            s.field.halo.copy(nodes);
            scatter_points(s, passes().force_points, nodes, force, NodeLane::volume);
        }
        settle_masses(s, nodes, of_particles, true);
    } else {
        scatter_points(s, passes().force_points, nodes, force, NodeLane::volume);
    }
    add_surface_forces(s, nodes);
}

/// To those of the points of quadratures, which the margin has already given to the nodes that it repeats.
template <int D>
void Explicit<D>::add_surface_forces(State<D>& s, Lanes* nodes) const
{
    if (model().tractions.empty()) return;
    s.field.halo.clear(nodes, NodeLane::increment, NodeLane::volume);
    scatter(s, passes().surface_force, nodes, NodeLane::increment, NodeLane::volume);
}

/// Sets the stresses that forces come from, if they are not those of the laws.
template <int D>
void Explicit<D>::find_force_stress(State<D>& s) const
{
    if (!has_force_stress(method())) return;
    Stopwatch watch(times(), StageTimes::fit);
    ordo::find_force_stress(model(), s);
}

template <int D>
void Explicit<D>::fit_cells(State<D>& s) const
{
    Stopwatch watch(times(), StageTimes::fit);
    ordo::fit_cells(model(), passes().cell_fit, s, sweep(s, nullptr, 0.0));
}

/// Sets the gradients at cell centres from the velocities of `nodes`, if the method takes particle gradients from there.
template <int D>
void Explicit<D>::find_gradients(State<D>& s, const Lanes* nodes) const
{
    if (!passes().gradient_at_center) return;
    Stopwatch watch(times(), StageTimes::fit);
    find_cell_gradients(passes(), s, nodes);
}

/// Reports the sums over nodes, which have velocities or momenta; periodic images are not counted.
template <int D>
void Explicit<D>::report_projection(State<D>& s, const Lanes* nodes, bool has_velocities) const
{
    const MassAndMomentum after = sum_over_nodes<4>(s, [&](std::ptrdiff_t i) {
        const double factor = has_velocities ? nodes[i][NodeLane::mass] : 1.0;
        return mass_and_momentum_of(nodes[i] * make_lanes(factor, factor, factor, 1, 0, 0, 0, 0));
    });
    s.projection.set(mass_and_momentum(s), after);
}

template <int D>
void Explicit<D>::constrain(State<D>& s, Lanes* nodes, const Kick& by, Velocity of) const
{
    Stopwatch watch(times(), StageTimes::nodes);
    const ExchangeSums<D> sums = of == Velocity::advanced ? exchange_sums(s, by) : ExchangeSums<D>(nullptr, by.dt);
    s.field.constraints.apply(model().conditions, nodes, by.when, sums, pic_fraction(s));
    if constexpr (D > 1)
        if (of == Velocity::advanced && !model().contacts.empty()) meet(model(), s, nodes, by.when, by.dt, sums);
    const std::vector<Wall<D>> none;  // act before the kick
    const std::vector<Wall<D>>& walls = of == Velocity::projected ? none : model().walls;
    if (of == Velocity::advanced && method().mass == MassMatrix::lumped)  // else the kick has done it
        s.field.wall_nodes.advance(walls, s.wall_shifts, nodes, by.when, sums);
    if (of == Velocity::remapped)
        s.field.wall_nodes.repeat(walls, s.wall_shifts, nodes, velocities(walls, by.when.t), by.when, {nullptr, by.dt});
    constrain_enriched(model(), s, nodes, by.when, walls, sums, pic_fraction(s));
    s.field.halo.copy(nodes);
}

template class Explicit<1>;
template class Explicit<2>;
template class Explicit<3>;

}  // namespace ordo
