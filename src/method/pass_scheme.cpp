#include "method/pass_scheme.hpp"

#include "kernels/nodes.hpp"
#include "method/averaging.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ordo {

namespace {

/// The arguments of a pass over the particles of a tile: with the nodes of its velocity field.
template <int D>
Sweep<D> in_field_of(const Tile& tile, Sweep<D> view)
{
    if (view.nodes) view.nodes += tile.first_node;
    return view;
}

constexpr double kRounding = 1e-9;  // of a particle's mass: less reaches a node by round-off alone, where a face is on nodes

}  // namespace

template <int D>
PassScheme<D>::PassScheme(Model<D> of)
    : Scheme<D>(std::move(of)),
      passes_(choose_passes<D>(method())),
      update_stress_(this->model().materials, artificial_viscosity(method(), this->model().h)),
      mass_solver_(passes_, lump_below_of(method()), has_tls_velocity(method()))
{}

template <int D>
void PassScheme<D>::start_domains(State<D>& s) const
{
    const ParticleView<D> p = s.particles.view();
    const Sweep<D> view     = sweep(s, nullptr, 0.0);
    for (int i = 0; i < p.count; ++i) {
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
}

template <int D>
Sweep<D> PassScheme<D>::sweep(State<D>& s, Lanes* nodes, double dt) const
{
    return {s.lattice,
            s.particles.view(),
            nodes,
            model().materials.data(),
            dt,
            pic_fraction(s),
            method().stretch_limit,
            stores_gradient(method()),
            s.gradients.data(),
            s.account.is_wanted};
}

template <int D>
void PassScheme<D>::clear_nodes(State<D>& s, Lanes* nodes) const
{
    Stopwatch watch(times(), StageTimes::nodes);
    clear(nodes, s.field.tiles);
}

template <int D>
void PassScheme<D>::solve_mass(State<D>& s, Lanes* nodes, unsigned parts, const std::vector<HeldNode<D>>& held) const
{
    mass_solver_.solve(s, sweep(s, nodes, 0.0), nodes, s.field.known.data(), parts, held);
    if (!times()) return;
    ++times()->mass_solves;
    times()->mass_iterations += mass_solver_.iterations();
}

template <int D>
void PassScheme<D>::move_corners(State<D>& s, Lanes* nodes, double dt) const
{
    Sweep<D> view = sweep(s, nodes, dt);
    if (has_corner_samples()) view.p.corner_velocity = nullptr;  // they have it already
    move_corners(s, view);
    gather(s, passes_.follow_corners, nodes, dt);
}

template <int D>
void PassScheme<D>::move_corners(State<D>& s, const Sweep<D>& view) const
{
    Stopwatch watch(times(), StageTimes::gather);
    for (const CornerRun& run : s.field.corner_runs) {
        Sweep<D> in_field = view;
        in_field.nodes += run.first_node;
        parallel_pieces(run.end - run.begin, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            passes_.move_corners(in_field, run.begin + begin, run.begin + end);
        });
    }
}

template <int D>
void PassScheme<D>::scatter(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane, int last_lane) const
{
    Stopwatch watch(times(), StageTimes::scatter);
    Sweep<D> view = sweep(s, nodes, 0.0);
    if (!s.force_stress.empty()) view.p.sigma = s.force_stress.data();
    s.field.tiles.for_each_by_colour({{nodes}}, [&](const Tile& tile) { pass(in_field_of(tile, view), tile.begin, tile.end); });
    s.field.halo.add(nodes, first_lane, last_lane);
}

template <int D>
void PassScheme<D>::scatter_points(State<D>& s, typename Passes<D>::Scatter pass, Lanes* nodes, int first_lane,
                                   int last_lane) const
{
    Stopwatch watch(times(), StageTimes::scatter);
    Sweep<D> view = sweep(s, nodes, 0.0);
    view.p        = s.points.view();
    s.points.for_each_by_colour([&](const Tile& tile) { pass(view, tile.begin, tile.end); });
    s.field.halo.add(nodes, first_lane, last_lane);
}

template <int D>
void PassScheme<D>::gather(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt) const
{
    gather(s, pass, sweep(s, nodes, dt));
}

template <int D>
void PassScheme<D>::gather(State<D>& s, typename Passes<D>::Gather pass, const Sweep<D>& view) const
{
    gather_tiles(s, [&](const Tile& tile, TileReport& report) { pass(in_field_of(tile, view), tile.begin, tile.end, report); });
}

/// A gather that updates F, then the stresses.
template <int D>
void PassScheme<D>::deform(State<D>& s, typename Passes<D>::Gather pass, Lanes* nodes, double dt, Deform by) const
{
    Sweep<D> view = sweep(s, nodes, dt);
    view.is_past  = by == Deform::past;
    if (method().averaging != Averaging::none || update_stress_.has_outside_laws()) return deform_all(s, pass, view);
    gather_tiles(s, [&](const Tile& tile, TileReport& report) {
        update_stress_(pass, in_field_of(tile, view), tile.begin, tile.end, report);
    });
}

/// The same where stresses need F of all particles: with averages of the dilations and for laws from outside.
template <int D>
void PassScheme<D>::deform_all(State<D>& s, typename Passes<D>::Gather pass, Sweep<D> view) const
{
    const bool is_averaged = method().averaging != Averaging::none;
    if (is_averaged) prepare_averages(model(), s);
    if (s.increments.size() != s.particles.x.size()) s.increments = Array<Mat<D>>(s.particles.x.size());
    view.increments      = s.increments.data();
    view.increment_first = 0;
    gather(s, pass, view);
    if (is_averaged) {
        Stopwatch watch(times(), StageTimes::fit);
        average_increments(model(), s);
    }
    gather_tiles(s, [&](const Tile& tile, TileReport& report) { update_stress_.update(view, tile.begin, tile.end, report); });
    if (s.report.fault == Fault::none) update_stress_.update_outside(s, view.dt);  // else there may be no F for them
}

/// run(tile, report) for all tiles; collects the reports.
template <int D>
template <class RunPass>
void PassScheme<D>::gather_tiles(State<D>& s, const RunPass& run) const
{
    Stopwatch watch(times(), StageTimes::gather);
    std::vector<TileReport> reports(s.field.tiles.tiles().size());
    s.field.tiles.for_each([&](std::ptrdiff_t k, const Tile& tile) { run(tile, reports[k]); });
    double move = 0.0, reach = TileReport{}.reach;
    for (const TileReport& r : reports) {
        move  = std::max(move, r.move);
        reach = std::max(reach, r.reach);
        if (s.account.is_wanted) {
            s.account.of_stresses += r.kicked;
            s.account.of_filters += r.filtered;
        }
        if (r.fault != Fault::none) s.report.flag(r.fault, r.particle);
    }
    s.report.move += move;
    if (reach >= 0) s.report.reach = reach;  // measured by passes that move particles
}

/// Adds the nodes that bodies with conditions reach to those that planes and regions hold.
template <int D>
void PassScheme<D>::find_held_by_bodies(State<D>& s) const
{
    const auto& conditions = model().conditions;
    if (std::none_of(conditions.begin(), conditions.end(), [](const auto& b) { return b.body.has_value(); })) return;
    s.field.constraints = s.field.placed;
    s.held_corners.assign(s.particles.enriched.size(), 0);
    make_room(s.body_nodes, s.field.nodes.size());
    Lanes* reached = s.body_nodes.data();
    for (std::size_t k = 0; k < conditions.size(); ++k) {
        if (!conditions[k].body) continue;
        scatter_body(s, *conditions[k].body, reached);
        const double least = kRounding * least_mass(s, *conditions[k].body);
        const int number   = static_cast<int>(k);
        s.field.tiles.for_each_node([&](const Index<D>& at, std::ptrdiff_t node) {
            if (reached[node][NodeLane::mass] > least)
                s.field.constraints.add(conditions, number, node, Constraints<D>::place_of(s.lattice, at),
                                        s.lattice.is_image(at) || !s.field.tiles.counts_record(node));
        });
        for (std::size_t e = 0; e < s.particles.enriched.size(); ++e) {
            const int c               = s.particles.enriched[e];
            const std::ptrdiff_t node = s.particles.corner_node[c];
            if (node < 0 || !(reached[node][NodeLane::mass] > least)) continue;
            s.field.constraints.add(conditions, number, node, s.lattice.inside_period(s.particles.corner[c]), false);
            for (int a = 0; a < D; ++a)
                if (conditions[k].constrains(a)) s.held_corners[e] |= static_cast<unsigned char>(1u << a);
        }
    }
    s.field.constraints.keep_last();
    s.field.wall_nodes.leave(s.field.constraints);
}

/// Of the particles of a body, kg. Found once, because masses do not change.
template <int D>
double PassScheme<D>::least_mass(State<D>& s, int body) const
{
    if (s.least_masses.empty()) {
        const Particles<D>& p = s.particles;
        s.least_masses.assign(static_cast<std::size_t>(body_count(s)), HUGE_VAL);
        for (int i = 0; i < p.count; ++i) s.least_masses[p.body[i]] = std::min(s.least_masses[p.body[i]], p.m[i]);
        for (double& m : s.least_masses) m *= -1;
        s.ranks->largest(s.least_masses);
        for (double& m : s.least_masses) m *= -1;
    }
    return s.least_masses[body];
}

/// Masses and momenta of one body's particles at the nodes.
template <int D>
void PassScheme<D>::scatter_body(State<D>& s, int body, Lanes* nodes) const
{
    clear_nodes(s, nodes);
    const Sweep<D> view    = sweep(s, nodes, 0.0);
    const std::int32_t* of = s.particles.body.data();
    s.field.tiles.for_each_by_colour({{nodes}}, [&](const Tile& tile) {
        for (int begin = tile.begin, end = begin; begin < tile.end; begin = end + 1) {
            end = begin;
            while (end < tile.end && of[end] == body) ++end;
            if (begin < end) passes_.project(in_field_of(tile, view), begin, end);
        }
    });
    s.field.halo.add(nodes, 0, NodeLane::end);
}

template class PassScheme<1>;
template class PassScheme<2>;
template class PassScheme<3>;

}  // namespace ordo
