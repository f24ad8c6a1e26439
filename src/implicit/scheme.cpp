#include "implicit/scheme.hpp"

#include "kernels/nodes.hpp"
#include "kernels/sample.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "method/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ordo {

namespace {

/// A field that is as it was once this goes out of scope.
template <class T>
class Restored {
  public:
    explicit Restored(Array<T>& field) : field_(field) { copy(was_, field); }
    ~Restored() { copy(field_, was_); }
    Restored(const Restored&)            = delete;
    Restored& operator=(const Restored&) = delete;

  private:
    Array<T>& field_;
    Array<T> was_;
};

}  // namespace

template <int D>
Implicit<D>::Implicit(Model<D> of) : PassScheme<D>(std::move(of)), multigrid_(multigrid_choices<D>(method()))
{
    require_implicit_model(model());
}

template <int D>
void Implicit<D>::find_projection(State<D>& s) const
{
    Lanes* nodes = s.field.nodes.data();
    this->find_held_by_bodies(s);
    this->clear_nodes(s, nodes);
    this->scatter(s, passes().project, nodes, 0, NodeLane::end);
    s.projection.set(mass_and_momentum(s),
                     sum_over_nodes<4>(s, [&](std::ptrdiff_t i) { return mass_and_momentum_of(nodes[i]); }));
    if (method().mass == MassMatrix::consistent)
        this->solve_mass(s, nodes, MassSolver<D>::kVelocity, {});
    else
        momenta_to_velocities(nodes, s.field.tiles);
    s.field.constraints.apply(model().conditions, nodes, {s.t, s.dt_prev}, ExchangeSums<D>(nullptr, 0.0), method().pic_fraction);
    s.field.halo.copy(nodes);
}

/// In one step, or in parts of it where that does not converge.
template <int D>
void Implicit<D>::take_step(State<D>& s, double dt) const
{
    s.has_external_forces = false;
    s.newton.begin_step();
    double left = dt, part = dt;
    int halved = 0;
    for (bool is_first = true; left > 1e-12 * dt; is_first = false) {
        if (!is_first) {
            s.drift += std::exchange(s.report.move, 0.0);
            if (s.report.reach >= 0) s.reach = s.report.reach;
            this->arrange(s);
        }
        part = std::min(part, left);
        std::string why;
        if (try_step(s, part, why)) {
            if (s.report.fault != Fault::none) return;
            left -= part;
            continue;
        }
        ++s.newton.halvings;
        if (++halved > static_cast<int>(method().step_halvings))
            throw NumericalError(fmt::format("step {}, t = {:.6g} s: a step of {:.3g} s fails after {} halvings: {}", s.n, s.t,
                                             part, halved - 1, why));
        part *= 0.5;
    }
}

/// Where it fails, nothing but s.newton changes that the next try does not set again.
template <int D>
bool Implicit<D>::try_step(State<D>& s, double dt, std::string& why) const
{
    this->find_held_by_bodies(s);
    StepEquations<D> step(model(), passes(), mass_solver(), s, dt, [this](State<D>& of, double t) {
        of.has_external_forces = false;
        this->evaluate_external_forces(of, t);
    });
    if (s.projection.is_wanted) s.projection.set(mass_and_momentum(s), mass_and_momentum(s));
    NewtonResult r = solve_step(step, method(), s.lattice.periodic, s.lattice.cells, multigrid_);
    r.report.t     = s.t;
    r.report.dt    = dt;
    s.newton.add(r.report);
    if (!r.report.converged) {
        why = r.is_singular && is_static(method()) ? loose_body(s, step) : "";
        if (r.particle >= 0)
            why = fmt::format(
                "{} would change its volume by a factor of {:.3g}: a solution that far away, as of a soil that is torn, is "
                "not taken; a smaller load or time step may help",
                particle_text(s, r.particle), r.change);
        if (why.empty())
            why = r.why + blame(s, step, r.missing) + "; a smaller time step or load, or more newton_iterations may help";
        return false;
    }
    if (const int missed = step.missed_obstacle(r.u); missed >= 0) {
        why = fmt::format(
            "a body would come into obstacle \"{}\" from further away than contact is looked for; a smaller time step may help",
            model().obstacles[missed].name);
        return false;
    }
    if (const TileReport moved = move_of_cells(s, step, r.u, dt); moved.fault != Fault::none) {
        why = fmt::format("{}: {}", particle_text(s, moved.particle), describe(moved.fault, method()));
        return false;
    }
    finish(s, step, r.u, r.missing, dt);
    return true;
}

/// What cells report whose corners move with nodes by u. Moves them there and back.
template <int D>
TileReport Implicit<D>::move_of_cells(State<D>& s, const StepEquations<D>& step, const std::vector<double>& u, double dt) const
{
    if (!passes().move_corners) return {};
    make_room(s.load_nodes, s.field.nodes.size());
    Lanes* nodes            = s.load_nodes.data();
    Particles<D>& p         = s.particles;
    const TileReport before = std::exchange(s.report, TileReport{});
    {
        const Restored corner(p.corner);
        const Restored x(p.x);
        const Restored V(p.V);
        clear(nodes, s.field.tiles);
        step.set_mean_velocities(u, nodes);
        move_corners(s, nodes, dt);
    }
    return std::exchange(s.report, before);
}

template <int D>
std::string Implicit<D>::particle_text(const State<D>& s, int i) const
{
    const Particles<D>& p = s.particles;
    return fmt::format("particle {} of body {} at {}, law {}", p.id[i], p.body[i], place_text(p.x[i]),
                       model().materials[p.material[i]].law->name);
}

/// Where a solution is wanting most: a particle that fails, or the particle that has most of the node with the largest missing force.
template <int D>
std::string Implicit<D>::blame(State<D>& s, const StepEquations<D>& step, const std::vector<double>& residual) const
{
    const Particles<D>& p = s.particles;
    auto particle         = [&](int i) { return particle_text(s, i); };
    if (const Fault fault = step.report().fault; fault != Fault::none)
        return fmt::format(" ({}: {})", particle(step.report().particle),
                           fault == Fault::inverted     ? "turns over"
                           : fault == Fault::not_finite ? "its stress or a load on it is not finite"
                                                        : "its law has no stress");
    std::size_t worst = residual.size();
    double most       = 0.0;
    for (std::size_t k = 0; k < residual.size(); ++k)
        if (!step.held()[k] && std::fabs(residual[k]) > most) {
            most  = std::fabs(residual[k]);
            worst = k;
        }
    if (worst == residual.size()) return "";
    const std::ptrdiff_t node = step.node_of(worst);
    const Sweep<D> view       = sweep(s, nullptr, 0.0);
    std::vector<NodeWeight<D>> weights;
    double largest = 0.0;
    int own        = 0;
    for (int i = 0; i < p.count; ++i) {
        passes().list_weights(view, i, weights);
        for (const NodeWeight<D>& w : weights)
            if (w.node == node && w.value > largest) {
                largest = w.value;
                own     = i;
            }
    }
    return fmt::format(" (most at the node at {}, {})", place_text(Constraints<D>::place_of(s.lattice, s.lattice.index(node))),
                       particle(own));
}

/// What to do about the first body of which no condition and no obstacle holds a node along an axis, nor a node of others that share nodes with it; empty
/// if there is none.
template <int D>
std::string Implicit<D>::loose_body(State<D>& s, const StepEquations<D>& step) const
{
    const Particles<D>& p                     = s.particles;
    const auto bodies                         = static_cast<std::size_t>(*std::max_element(p.body.begin(), p.body.end())) + 1;
    const std::vector<Vec<D, bool>> held_axes = step.held_axes();
    std::vector<int> group(bodies), body_at(held_axes.size(), -1);
    std::iota(group.begin(), group.end(), 0);
    const Sweep<D> view = sweep(s, nullptr, 0.0);
    std::vector<NodeWeight<D>> weights;
    for (int i = 0; i < p.count; ++i) {
        passes().list_weights(view, i, weights);
        for (const NodeWeight<D>& w : weights) {
            const int row = step.rows().row(w.node);
            if (row <= 0 || w.value == 0.0) continue;
            int& there = body_at[row];
            if (there < 0) there = p.body[i];
            const int from = group[p.body[i]], to = group[there];
            if (from != to) std::replace(group.begin(), group.end(), from, to);
        }
    }
    std::vector<Vec<D, bool>> is_held(bodies, Vec<D, bool>{});
    for (std::size_t row = 1; row < body_at.size(); ++row)
        for (int a = 0; a < D && body_at[row] >= 0; ++a)
            is_held[group[body_at[row]]][a] = is_held[group[body_at[row]]][a] || held_axes[row][a];
    for (int i = 0; i < p.count; ++i) {
        const Vec<D, bool>& axes = is_held[group[p.body[i]]];
        const bool has_obstacles = !model().obstacles.empty();
        if (axes == Vec<D, bool>{})
            return fmt::format("nothing holds body {}: no boundary has a node of it{}", p.body[i],
                               has_obstacles ? ", and it touches no obstacle, or those that it touches leave it; hold it by a "
                                               "boundary, or place it on an obstacle to a billionth of a cell"
                                             : "; hold it by one");
        for (int a = 0; a < D; ++a)
            if (!axes[a])
                return fmt::format(
                    "nothing holds body {} along {}: neither a boundary nor the friction of an obstacle does; hold "
                    "it by one",
                    p.body[i], "xyz"[a]);
    }
    return "";
}

/// Moves the particles: velocities, deformation and stresses, positions.
template <int D>
void Implicit<D>::finish(State<D>& s, StepEquations<D>& step, const std::vector<double>& u, const std::vector<double>& missing,
                         double dt) const
{
    Lanes* nodes = s.field.nodes.data();
    if (s.account.is_wanted) account_for(s, step, u, missing, dt);
    if (is_static(method())) {
        parallel_for_each(s.particles.count, [&](std::ptrdiff_t i) { s.particles.v[i] = {}; });
        step.keep_load_step(u);
    } else {
        step.set_velocities(u, nodes);
        gather(s, passes().update_velocity, nodes, dt);
    }
    step.set_mean_velocities(u, nodes);
    deform(s, passes().deform, nodes, dt);
    if (passes().move) gather(s, passes().move, nodes, dt);
    if (passes().move_corners) move_corners(s, nodes, dt);
    step.set_velocities(u, nodes);  // what outputs of nodes show
    step.finish_contact();
    this->advance_time(s, dt);
    s.t_v = s.t_F = s.t;
}

/// Adds the step to the account: forces over the mean velocity, and the impulses of conditions.
template <int D>
void Implicit<D>::account_for(State<D>& s, StepEquations<D>& step, const std::vector<double>& u,
                              const std::vector<double>& missing, double dt) const
{
    Lanes* nodes = s.field.nodes.data();
    make_room(s.forces, s.field.nodes.size());
    make_room(s.load_nodes, s.field.nodes.size());
    step.set_mean_forces(s.forces.data(), false);
    step.add_penalty_forces(u, s.forces.data());  // its work counts as the stresses': what particles do not store
    step.set_mean_forces(s.load_nodes.data(), true);
    if (is_static(method()))
        step.set_mean_velocities(u, nodes);
    else
        step.set_velocities(u, nodes);
    const bool is_consistent = method().mass == MassMatrix::consistent;
    if (is_consistent) mass_solver().multiply_solution(s, sweep(s, nullptr, 0.0), nodes);
    auto momentum = [&](std::ptrdiff_t i) {
        return is_consistent ? s.field.mass.q[s.field.mass.rows.row(i)] : nodes[i] * nodes[i][NodeLane::mass];
    };
    add_kick(s, model().gravity, dt, nodes, s.forces.data(), s.load_nodes.data(), momentum);
    for (ExchangeParts& e : s.account.of_boundaries)  // forces are those of the last part of a step
        for (ExactSum& f : e.force) f.clear();
    const ExchangeSums<D> sums(&s.account.of_boundaries, dt);
    s.field.constraints.add_impulses(model().conditions, {s.t + dt, dt}, sums, [&](std::ptrdiff_t node, int a) {
        const int row       = step.rows().row(node);
        const std::size_t k = row > 0 ? step.unknown(row, a) : 0;
        return row > 0 && step.rows().node(row) == node
                   ? step.impulse_of_condition(k, missing[k], momentum(node)[NodeLane::increment + a])
                   : 0.0;
    });
}

template <int D>
void require_implicit_model(const Model<D>& model)
{
    auto refuse = [](const std::string& what) {
        throw InputError(fmt::format("scheme midpoint, newmark or static does not take {} yet: take scheme usl or musl", what));
    };
    for (const ContactPair<D>& pair : model.contacts)
        if (pair.obstacle < 0) refuse("[[contact]]");
    for (const Obstacle<D>& obstacle : model.obstacles)
        if (obstacle.is_moved()) refuse(fmt::format("obstacle \"{}\", which forces move,", obstacle.name));
    if (!model.walls.empty()) refuse("boundaries of type wall (an [[obstacle]] of shape half-space takes their place)");
    for (const Material& m : model.materials)
        if (m.law->outside) refuse(fmt::format("the law {} from outside, whose derivatives are not known,", m.law->name));
}

#define ORDO_IMPLICIT(D)        \
    template class Implicit<D>; \
    template void require_implicit_model(const Model<D>&);
ORDO_IMPLICIT(1)
ORDO_IMPLICIT(2)
ORDO_IMPLICIT(3)
#undef ORDO_IMPLICIT

}  // namespace ordo
