#include "method/explicit.hpp"

#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/enrichment.hpp"
#include "method/layout.hpp"
#include "method/place.hpp"
#include "method/reconstruction.hpp"
#include "method/spline_scheme.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ordo {

namespace {

std::string describe(Fault fault, const MethodSpec& method)
{
    switch (fault) {
    case Fault::inverted:
        return std::string("its volume ratio J = det F is not positive (the deformation of one step is too large); a smaller "
                           "time step") +
               (method.scheme == Scheme::musl ? "" : ", scheme = \"musl\"") +
               (method.domain == Domain::point ? " or a method with particle domains (cpdi1)" : "") + " may help";
    case Fault::not_finite: return "its state is not a finite number; a smaller time step may help";
    case Fault::left_grid: return "it left the grid; make [grid] size larger or put a [[boundary]] on that face";
    case Fault::domain_turned:
        return has_cells(method) ? "its cell has turned over or folded; a smaller time step, a finer mesh of particles or a "
                                   "method whose domains cannot fold (cpdi1) may help"
                                 : "its box has no positive length left along an axis: a stretched box does not follow large "
                                   "rotations; use a method whose domains do (cpdi1)";
    case Fault::domain_too_wide:
        return "its domain has grown wider than the grid pass can hold; a method with fixed domains (ugimp), a coarser grid "
               "or, for parallelepipeds, method.stretch_limit may help";
    case Fault::none: break;
    }
    return "nothing is wrong";
}

template <int D>
void require_sound(const MethodSpec& method, const State<D>& s)
{
    if (s.fault.fault == Fault::none) return;
    const Particles<D>& p = s.particles;
    const int i           = s.fault.particle;
    throw NumericalError(fmt::format("step {}, t = {:.6g} s: particle {} of body {} at {}, J = {:.4g}: {}", s.n, s.t, p.id[i],
                                     p.body[i], place_text(p.x[i]), det(p.F[i]), describe(s.fault.fault, method)));
}

template <int D>
void advance_time(State<D>& s, double dt)
{
    const double step = dt + s.t_rest, t = s.t + step;
    s.t_rest = step - (t - s.t);
    s.t      = t;
}

}  // namespace

template <int D>
Explicit<D>::Explicit(Model<D> model)
    : model_(std::move(model)),
      passes_(choose_passes<D>(model_.method)),
      update_stress_(model_.materials),
      mass_solver_(passes_, model_.method.lump_below, has_tls_velocity(model_.method)),
      splines_(is_spline_fit(model_.method) ? std::make_shared<const SplineScheme<D>>(model_) : nullptr),
      has_body_force_(field_groups(model_).body_force)
{}

template <int D>
State<D> Explicit<D>::start(Particles<D> particles) const
{
    for (int i = 0; i < particles.count; ++i) {
        particles.X[i] = particles.x[i];
        particles.F[i] = Mat<D>::identity();
    }
    State<D> s = start_deformed(std::move(particles));
    if (has_cells(model_.method))  // with mean weights they are not at the centroids
        for (int i = 0; i < s.particles.count; ++i) s.particles.X[i] += displacement(model_, s.particles, i);
    return s;
}

template <int D>
State<D> Explicit<D>::start_deformed(Particles<D> particles) const
{
    State<D> s{};
    s.particles             = std::move(particles);
    const ParticleView<D> p = s.particles.view();
    s.lattice               = Lattice<D>(model_.origin, model_.h, model_.cells, model_.periodic, 0, grid_basis(model_.method));
    const Sweep<D> view     = sweep(s, nullptr, 0.0);
    start_stresses(model_.materials, s.particles);
    for (int i = 0; i < p.count; ++i) {
        p.V[i] = det(p.F[i]) * p.V0[i];
        if (p.half) p.half[i] = p.half0[i];
        passes_.evolve(view, i);
        const double reach = passes_.reach(s.lattice, p, i);
        if (std::isnan(reach))
            throw InputError(
                fmt::format("particle {} of body {}: its domain has no positive volume, or is folded", p.id[i], p.body[i]));
        if (!(reach <= passes_.max_reach))
            throw InputError(fmt::format(
                "particle {} of body {}: its domain reaches {:.3g} cells from its centre, more than the {} that the method's "
                "passes hold; use smaller particle domains or a coarser [grid] spacing",
                p.id[i], p.body[i], reach, passes_.max_reach));
        s.reach = std::max(s.reach, reach);
    }
    sort_particles(model_, s);
    return s;
}

template <int D>
void Explicit<D>::step(State<D>& s, double dt) const
{
    ORDO_EXPECT(dt > 0);
    if (splines_) {
        step_splines(s, dt);
        return;
    }
    if (s.n == 0 && model_.method.start == Start::plain) {  // as if a step had led here
        s.dt_prev = dt;
        s.t_v     = s.t - 0.5 * dt;
    }
    const double dt_kick  = 0.5 * (s.dt_prev + dt);  // velocities live at half steps; the first kick of a leapfrog is half
    const double t_kicked = s.t_v + dt_kick;

    arrange(s);
    Lanes* nodes  = s.nodes.data();
    Lanes* strain = model_.method.scheme == Scheme::usl ? nodes : s.strain_nodes.data();

    clear_nodes(s, nodes);
    s.projection.fit          = {};
    const bool has_velocities = find_forces(s, nodes, strain);  // m_i, (m v)_i or v_i, f_i <- particles
    if (s.projection.is_wanted) report_projection(s, nodes, has_velocities);
    advance(s, nodes, dt_kick, t_kicked, has_velocities);  // v_i; a_i = f_i/m_i + g; v_i += dt a_i
    constrain(s, nodes, t_kicked);
    if (keeps_corner_velocity(model_.method)) keep_velocities(s, nodes);

    update_particles(s, nodes, strain, dt, t_kicked);
    if (passes_.move_corners) move_corners(s, nodes, dt);  // cells: x_c, then x_p and V_p
    s.t_v = t_kicked;
    finish_step(s, dt);
}

/// A step of projection spline-fit, whose stages are its own.
template <int D>
void Explicit<D>::step_splines(State<D>& s, double dt) const
{
    arrange(s);
    s.projection.fit = {};
    splines_->step(
        model_, s, dt, [&](double t) { evaluate_external_forces(s, t); }, times_);
    if (times_) {
        for (const long n : s.spline.iterations) times_->mass_iterations += n;
        times_->mass_solves += static_cast<long>(s.spline.iterations.size()) * stages_of(model_.method.scheme);
    }
    finish_step(s, dt);
}

/// What nodes have before the kick; USF updates the stress first. True where they have velocities already instead of momenta.
template <int D>
bool Explicit<D>::find_forces(State<D>& s, Lanes* nodes, Lanes* strain) const
{
    if (model_.method.scheme != Scheme::usf) {
        evaluate_external_forces(s, s.t);
        return project_and_force(s, nodes);
    }
    project(s, nodes);     // m_i, (m v)_i <- particles
    velocities(s, nodes);  // v_i
    s.halo.copy(nodes);
    copy(strain, nodes, s.tiles);
    constrain(s, strain, s.t_v);
    find_gradients(s, strain);
    deform(s, passes_.deform, strain, s.dt_prev, Deform::past);  // F_p, sigma_p at t_n from v_i of the step that led here
    evaluate_external_forces(s, s.t);
    add_forces(s, nodes, false);  // f_i <- sigma_p
    return true;
}

/// v_p, F_p, sigma_p and x_p from the kicked nodes. The motion comes last, so that every phi before it is at x_n.
template <int D>
void Explicit<D>::update_particles(State<D>& s, Lanes* nodes, Lanes* strain, double dt, double t_kicked) const
{
    const Scheme scheme = model_.method.scheme;
    if (scheme == Scheme::usl) {
        if (passes_.keep && !stores_gradient(model_.method)) gather(s, passes_.keep, nodes, dt);
        find_gradients(s, nodes);
        deform(s, passes_.update_all, nodes, dt);
        return;
    }
    if (scheme == Scheme::usf && passes_.keep) gather(s, passes_.keep, nodes, dt);
    gather(s, passes_.update_velocity, nodes, dt);  // v_p <- a_i
    if (scheme == Scheme::musl) {
        if (passes_.keep) gather(s, passes_.keep, nodes, dt);
        clear_nodes(s, strain);
        project(s, strain);  // the same nodes again, with the new v_p
        velocities(s, strain);
        constrain(s, strain, t_kicked);
        find_gradients(s, strain);
        deform(s, passes_.deform, strain, dt);  // F_p, sigma_p from the remapped velocity
    }
    if (passes_.move) gather(s, passes_.move, nodes, dt);
}

/// Times of what the step has changed.
template <int D>
void Explicit<D>::finish_step(State<D>& s, double dt) const
{
    const double t_before = s.t;
    advance_time(s, dt);
    s.t_F = model_.method.scheme == Scheme::usf ? t_before : s.t;
    if (splines_) s.t_v = s.t;
    s.dt_prev = dt;
    ++s.n;
    s.mass.is_formed = false;         // particles have moved
    require_sound(model_.method, s);  // now, so that time and particles belong together in the last output
}

template <int D>
const ProjectionReport& Explicit<D>::project(State<D>& s) const
{
    arrange(s);
    Lanes* nodes = s.nodes.data();
    clear_nodes(s, nodes);
    s.projection.fit = {};
    evaluate_external_forces(s, s.t);
    if (splines_) {
        splines_->project(model_, s);
        return s.projection;
    }
    const bool has_velocities = project_and_force(s, nodes);
    report_projection(s, nodes, has_velocities);
    if (!has_velocities) velocities(s, nodes);
    constrain(s, nodes, s.t_v);
    return s.projection;
}

template <int D>
void Explicit<D>::arrange(State<D>& s) const
{
    Stopwatch watch(times_, StageTimes::sort);
    s.mass.is_formed = false;  // particles were changed from outside
    if (is_sorted_enough(s))
        number_enriched(s);
    else
        sort_particles(model_, s);
}

template <int D>
void Explicit<D>::evaluate_external_forces(State<D>& s, double t) const
{
    Stopwatch watch(times_, StageTimes::body_force);
    const ParticleView<D> p = s.particles.view();
    if (!model_.tractions.empty()) evaluate_loads(model_.loads, model_.tractions, s.lattice, p, t);
    if (!has_body_force_) return;
    if (model_.body_force_kernel) {
        parallel_pieces(p.count, [&](std::ptrdiff_t begin, std::ptrdiff_t end) { model_.body_force_kernel(p, begin, end, t); });
        return;
    }
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        p.b[i] = evaluate<D>(model_.body_forces[p.body[i]],
                             {padded(place_in_period(model_, s.particles, static_cast<int>(i))), padded(p.X[i]), t});
    });
}

template <int D>
Sweep<D> Explicit<D>::sweep(State<D>& s, Lanes* nodes, double dt) const
{
    return {s.lattice,
            s.particles.view(),
            nodes,
            model_.materials.data(),
            dt,
            model_.method.update == Update::flip ? model_.method.pic_fraction : 1.0,
            model_.method.stretch_limit,
            stores_gradient(model_.method),
            s.gradients.data()};
}

template <int D>
void Explicit<D>::clear_nodes(State<D>& s, Lanes* nodes) const
{
    Stopwatch watch(times_, StageTimes::nodes);
    clear(nodes, s.tiles);
}

template <int D>
void Explicit<D>::velocities(State<D>& s, Lanes* nodes) const
{
    Stopwatch watch(times_, passes_.velocity_fit.solve ? StageTimes::fit : StageTimes::nodes);
    if (passes_.velocity_fit.solve)
        fit_velocities(model_, passes_.velocity_fit, s, sweep(s, nodes, 0.0), nodes);
    else if (model_.method.mass == MassMatrix::lumped)
        ordo::velocities(nodes, s.tiles);
    else
        solve_mass(s, nodes, s.known.data(), MassSolver<D>::kVelocity);
}

template <int D>
void Explicit<D>::solve_mass(State<D>& s, Lanes* nodes, const Lanes* known, unsigned parts) const
{
    mass_solver_.solve(s, sweep(s, nodes, 0.0), nodes, known, parts);
    if (!times_) return;
    ++times_->mass_solves;
    times_->mass_iterations += mass_solver_.iterations();
}

template <int D>
void Explicit<D>::advance(State<D>& s, Lanes* nodes, double dt, double t, bool has_velocities) const
{
    const bool is_lumped = model_.method.mass == MassMatrix::lumped;
    if (!has_velocities && !is_lumped && s.constraints.has_prescribed()) {
        velocities(s, nodes);
        has_velocities = true;
    }
    Stopwatch watch(times_, StageTimes::nodes);
    if (!is_lumped) {
        // Constrained components have no acceleration, or the one that leads to the prescribed velocity.
        Lanes* known = s.known.data();
        s.constraints.for_each_velocity(model_.boundaries, t, [&](std::ptrdiff_t node, int a, bool is_prescribed, double v) {
            const double total                   = is_prescribed ? (v - nodes[node][NodeLane::velocity + a]) / dt : 0.0;
            known[node][NodeLane::increment + a] = total - model_.gravity[a];
        });
        solve_mass(s, nodes, known, MassSolver<D>::kAcceleration | (has_velocities ? 0u : MassSolver<D>::kVelocity));
    }
    const NodeState state = !is_lumped ? NodeState::solved : has_velocities ? NodeState::velocity : NodeState::momentum;
    ordo::advance(nodes, s.tiles, model_.gravity, dt, state);
}

/// m_i and (m v)_i of particles, or of Gauss points.
template <int D>
void Explicit<D>::project(State<D>& s, Lanes* nodes) const
{
    if (has_tls_velocity(model_.method)) {
        fit_cells(s);
        scatter_points(s, passes_.project_points, nodes, 0, NodeLane::end);
        if (model_.method.domain == Domain::point) return;
        make_room(s.particle_nodes, s.nodes.size());
        Lanes* of_particles = s.particle_nodes.data();
        clear_nodes(s, of_particles);
        scatter(s, passes_.project, of_particles, 0, NodeLane::end);
        settle_masses(s, nodes, of_particles, false);
    } else {
        scatter(s, passes_.project, nodes, 0, NodeLane::end);
        if (keeps_corner_velocity(model_.method)) restore_momenta(s, nodes);
    }
}

/// The same and f_i; true where the nodes have velocities already instead of momenta: fits, and where m_i is not that of the
/// projection.
template <int D>
bool Explicit<D>::project_and_force(State<D>& s, Lanes* nodes) const
{
    const bool finds_velocities = passes_.velocity_fit.solve || model_.method.quadrature == Quadrature::cell;
    const bool is_fused         = passes_.project_and_force && !passes_.cell_fit.spread;
    if (is_fused) {
        scatter(s, passes_.project_and_force, nodes, 0, NodeLane::end);
        if (keeps_corner_velocity(model_.method)) restore_momenta(s, nodes);
    } else {
        project(s, nodes);
    }
    if (finds_velocities) velocities(s, nodes);
    if (is_fused) return finds_velocities;
    s.halo.copy(nodes);
    add_forces(s, nodes, has_tls_velocity(model_.method));
    return finds_velocities;
}

/// f_i of the quadrature; with quadrature `cell` m_i too, then nodes must have velocities. `has_points`: they are there.
template <int D>
void Explicit<D>::add_forces(State<D>& s, Lanes* nodes, bool has_points) const
{
    constexpr int force = NodeLane::increment;
    const bool is_cell  = model_.method.quadrature == Quadrature::cell;
    if (!is_cell && !has_gauss_forces(model_.method)) {
        scatter(s, passes_.force, nodes, force, NodeLane::volume);
        return;
    }
    if (!has_points) fit_cells(s);
    if (is_cell) {
        make_room(s.particle_nodes, s.nodes.size());
        Lanes* of_particles = s.particle_nodes.data();
        copy(of_particles, nodes, s.tiles);
        clear_masses(nodes, s.tiles);
        if (passes_.project_and_force_points) {
            scatter_points(s, passes_.project_and_force_points, nodes, NodeLane::mass, NodeLane::end);
        } else {
            scatter_points(s, passes_.project_points, nodes, NodeLane::mass, NodeLane::end);
            s.halo.copy(nodes);
            scatter_points(s, passes_.force_points, nodes, force, NodeLane::volume);
        }
        settle_masses(s, nodes, of_particles, true);
    } else {
        scatter_points(s, passes_.force_points, nodes, force, NodeLane::volume);
    }
    if (!model_.tractions.empty()) scatter(s, passes_.surface_force, nodes, force, NodeLane::volume);
}

template <int D>
void Explicit<D>::fit_cells(State<D>& s) const
{
    Stopwatch watch(times_, StageTimes::fit);
    ordo::fit_cells(model_, passes_.cell_fit, s, sweep(s, nullptr, 0.0));
}

/// Where particles take their gradients from the centres of cells: those of the velocities of `nodes`.
template <int D>
void Explicit<D>::find_gradients(State<D>& s, const Lanes* nodes) const
{
    if (!passes_.gradient_at_center) return;
    Stopwatch watch(times_, StageTimes::fit);
    find_cell_gradients(passes_, s, nodes);
}

/// Sums over nodes that hold velocities, or momenta; images of periodic axes do not count.
template <int D>
void Explicit<D>::report_projection(State<D>& s, const Lanes* nodes, bool has_velocities) const
{
    const ParticleView<D> p = s.particles.view();
    const auto& blocks      = s.tiles.blocks();
    std::vector<Lanes> partial(blocks.size(), Lanes{});
    auto sum_of = [&](const Lanes& n) {
        const double factor = has_velocities ? n[NodeLane::mass] : 1.0;
        return n * make_lanes(factor, factor, factor, 1, 0, 0, 0, 0);
    };
    s.tiles.for_each_block([&](std::ptrdiff_t k) {
        s.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& at) {
            if (!s.lattice.is_image(at)) partial[k] += sum_of(nodes[s.lattice.offset(at)]);
        });
    });
    const Lanes* enriched = nodes + s.lattice.node_count();
    Lanes after           = parallel_reduce(
                  p.enriched_count, Lanes{}, [&](std::ptrdiff_t e) { return sum_of(enriched[e]); },
                  [](Lanes& total, const Lanes& one) { total += one; });
    for (const Lanes& one : partial) after += one;
    s.projection.set(mass_and_momentum(p), after);
}

template <int D>
void Explicit<D>::move_corners(State<D>& s, Lanes* nodes, double dt) const
{
    {
        Stopwatch watch(times_, StageTimes::gather);
        const Sweep<D> view = sweep(s, nodes, dt);
        parallel_pieces(static_cast<std::ptrdiff_t>(s.particles.corner.size()),
                        [&](std::ptrdiff_t begin, std::ptrdiff_t end) { passes_.move_corners(view, begin, end); });
    }
    gather(s, passes_.follow_corners, nodes, dt);
}

template <int D>
void Explicit<D>::scatter(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const
{
    Stopwatch watch(times_, StageTimes::scatter);
    const Sweep<D> view = sweep(s, nodes, 0.0);
    s.tiles.for_each_by_colour([&](const Tile& tile) { pass(view, tile.begin, tile.end); });
    s.halo.add(nodes, first_lane, last_lane);
}

template <int D>
void Explicit<D>::scatter_points(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const
{
    Stopwatch watch(times_, StageTimes::scatter);
    Sweep<D> view = sweep(s, nodes, 0.0);
    view.p        = s.points.view();
    s.points.for_each_by_colour([&](const Tile& tile) { pass(view, tile.begin, tile.end); });
    s.halo.add(nodes, first_lane, last_lane);
}

template <int D>
void Explicit<D>::gather(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt) const
{
    const Sweep<D> view = sweep(s, nodes, dt);
    gather_tiles(s, [&](const Tile& tile, TileReport& report) { pass(view, tile.begin, tile.end, report); });
}

/// A gather that changes F, and the stresses that follow.
template <int D>
void Explicit<D>::deform(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt, Deform by) const
{
    Sweep<D> view = sweep(s, nodes, dt);
    view.is_past  = by == Deform::past;
    gather_tiles(s, [&](const Tile& tile, TileReport& report) { update_stress_(pass, view, tile.begin, tile.end, report); });
}

/// run(tile, report) for all tiles, and what they report.
template <int D>
template <class RunPass>
void Explicit<D>::gather_tiles(State<D>& s, const RunPass& run) const
{
    Stopwatch watch(times_, StageTimes::gather);
    std::vector<TileReport> reports(s.tiles.tiles().size());
    s.tiles.for_each([&](std::ptrdiff_t k, const Tile& tile) { run(tile, reports[k]); });
    double move = 0.0, reach = TileReport{}.reach;
    for (const TileReport& r : reports) {
        move  = std::max(move, r.move);
        reach = std::max(reach, r.reach);
        if (r.fault != Fault::none) s.fault.flag(r.fault, r.particle);
    }
    s.drift += move;
    if (reach < 0) return;
    s.reach = reach;  // a pass that moved particles has measured them
    s.move  = move;
}

template <int D>
void Explicit<D>::constrain(State<D>& s, Lanes* nodes, double t) const
{
    Stopwatch watch(times_, StageTimes::nodes);
    s.constraints.apply(model_.boundaries, nodes, t);
    constrain_enriched(model_, s, nodes, t);
    s.halo.copy(nodes);
}

namespace {

/// The shortest time in which a wave crosses a cell, s: h over the P-wave speed plus |v| for particles that write to the grid,
/// half the period over pi of the fastest wave of enriched cells.
template <int D>
double crossing_time(const Model<D>& model, const Particles<D>& particles)
{
    const double enriched = enriched_time_step(model, particles);
    if (model.method.enrichment == Enrichment::all) return enriched;
    std::vector<double> c;
    for (const Material& m : model.materials) c.push_back(m.wave_speed());
    const double rate = parallel_reduce(
        particles.count, 0.0,
        [&](std::ptrdiff_t i) {
            double r = 0.0;
            for (int a = 0; a < D; ++a) r = std::max(r, (c[particles.material[i]] + norm(particles.v[i])) / model.h[a]);
            return r;
        },
        [](double& total, double r) { total = std::max(total, r); });
    return std::min(enriched, rate > 0 ? 1 / rate : std::numeric_limits<double>::infinity());
}

}  // namespace

namespace {

template <int D>
double courant_scale(const Model<D>& model)
{
    return courant_scale(model.method, D, !model.surface.empty());
}

}  // namespace

template <int D>
double stable_courant_number(const Model<D>& model)
{
    return stable_courant_number(model.method, D, !model.surface.empty());
}

template <int D>
double courant_time_step(const Model<D>& model, const Particles<D>& particles)
{
    return courant_scale(model) * crossing_time(model, particles);
}

template <int D>
double stable_time_step(const Model<D>& model, const Particles<D>& particles)
{
    return stable_courant_number(model) * crossing_time(model, particles);
}

template <int D>
double automatic_time_step(const Model<D>& model, const Particles<D>& particles, double cfl)
{
    return std::min(cfl * courant_scale(model), stable_courant_number(model)) * crossing_time(model, particles);
}

#define ORDO_EXPLICIT(D)                                                     \
    template class Explicit<D>;                                              \
    template double stable_courant_number(const Model<D>&);                  \
    template double courant_time_step(const Model<D>&, const Particles<D>&); \
    template double stable_time_step(const Model<D>&, const Particles<D>&);  \
    template double automatic_time_step(const Model<D>&, const Particles<D>&, double);
ORDO_EXPLICIT(1)
ORDO_EXPLICIT(2)
ORDO_EXPLICIT(3)
#undef ORDO_EXPLICIT

}  // namespace ordo
