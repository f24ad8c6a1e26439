#include "method/scheme.hpp"

#include "base/agree.hpp"
#include "method/diagnostics.hpp"
#include "method/enrichment.hpp"
#include "method/external_work.hpp"
#include "method/layout.hpp"
#include "method/place.hpp"
#include "method/sharing.hpp"
#include "method/step_damping.hpp"
#include "method/stress_update.hpp"
#include "method/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

namespace ordo {

std::string describe(Fault fault, const MethodSpec& method)
{
    switch (fault) {
    case Fault::inverted:
        return std::string("its volume ratio J = det F is not positive (the deformation of one step is too large); a smaller "
                           "time step") +
               (projects_again(method) || keeps_corner_velocity(method) ? "" : ", scheme = \"musl\"") +
               (domains_deform(method) ? "" : fmt::format(" or a {}", kDeformingMethods)) + " may help";
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
    case Fault::not_solved:
        return "the equations of its material law were not solved: the deformation of one step is too large for the law; a "
               "smaller time step may help";
    case Fault::none: break;
    }
    return "nothing is wrong";
}

namespace {

/// The tile of the first fault of a step on this rank; nowhere if there is none.
template <int D>
double tile_of_fault(const State<D>& s)
{
    return tile_of_particle(s, s.report.fault == Fault::none ? s.particles.count : s.report.particle);
}

/// Makes what fits report that of all ranks.
template <int D>
void agree_on_fits(const MethodSpec& method, State<D>& s)
{
    const bool has_fits =
        fits_velocity(method) || method.quadrature != Quadrature::particle || method.gradient == Gradient::adjoint;
    if (s.ranks->is_alone() || !has_fits) return;
    ProjectionReport& p   = s.projection;
    std::int64_t counts[] = {p.fit.dropped, p.fit.fallback};
    s.ranks->add(counts);
    const double block = p.fit.dropped > 0 ? p.first_block : kNowhere;
    const Bytes first  = bytes_of_first(*s.ranks, block, [&] {
        Bytes bytes;
        put(bytes, p.dropped_at);
        return bytes;
    });
    if (!first.empty()) std::memcpy(&p.dropped_at, first.data(), sizeof(p.dropped_at));
    p.fit.dropped  = counts[0];
    p.fit.fallback = counts[1];
}

/// What else a particle says that is faster than the waves in it.
template <int D>
std::string speed_text(const Model<D>& model, const Particles<D>& p, int i)
{
    const double c = model.materials[p.material[i]].wave_speed(), v = norm(p.v[i]);
    if (!(v > c)) return "";
    return fmt::format(
        "; it moves at {:.4g} m/s and waves in it at {:.4g} m/s: if nothing drove it that fast, the run has gained energy "
        "or torn: use a {} (docs/which-method.md)",
        v, c, domains_deform(model.method) ? "smaller time step or another method" : kDeformingMethods);
}

/// Takes the reports of all ranks on a step. Throws what is wrong in the first tile with a fault.
template <int D>
void agree(const Model<D>& model, State<D>& s)
{
    agree_on_fits(model.method, s);
    const double faulty = tile_of_fault(s);
    double all[]        = {s.report.move, s.report.reach, -faulty};
    s.ranks->largest(all);
    s.move = all[0];
    s.drift += s.move;
    if (all[1] >= 0) s.reach = all[1];
    if (all[2] == -kNowhere) return;
    throw NumericalError(text_of_first(*s.ranks, faulty, [&] {
        const Particles<D>& p = s.particles;
        const int i           = s.report.particle;
        return fmt::format("step {}, t = {:.6g} s: particle {} of body {} at {}, J = {:.4g}: {}{}", s.n, s.t, p.id[i], p.body[i],
                           place_text(p.x[i]), det(p.F[i]), describe(s.report.fault, model.method), speed_text(model, p, i));
    }));
}

}  // namespace

template <int D>
Scheme<D>::Scheme(Model<D> model) : model_(std::move(model)), has_body_force_(field_groups(model_).body_force)
{
    require_allowed(model_.method);
}

template <int D>
State<D> Scheme<D>::start(Particles<D> particles, Ranks& ranks) const
{
    parallel_for_each(particles.count, [&](std::ptrdiff_t i) {
        particles.X[i] = particles.x[i];
        particles.F[i] = Mat<D>::identity();
    });
    State<D> s = start_deformed(std::move(particles), ranks);
    if (has_cells(model_.method))  // with mean weights x is not at the centroid
        for (int i = 0; i < s.particles.count; ++i) s.particles.X[i] += displacement(model_, s.particles, i);
    return s;
}

template <int D>
State<D> Scheme<D>::start_deformed(Particles<D> particles, Ranks& ranks) const
{
    if (!ranks.is_alone()) require_shareable(model_);
    State<D> s{};
    s.ranks            = &ranks;
    s.newton.is_wanted = is_implicit(model_.method);
    s.particles        = std::move(particles);
    s.wall_shifts.assign(model_.walls.size(), {});
    s.account.boundaries.resize(boundary_count(model_));
    s.account.tractions.resize(model_.tractions.size());
    for (const ContactPair<D>& pair : model_.contacts)
        if (pair.obstacle < 0) s.contacts.pairs.emplace_back();
    for (const Obstacle<D>& obstacle : model_.obstacles) s.contacts.obstacles.push_back(start_of(obstacle, 0.0));
    const ParticleView<D> p = s.particles.view();
    s.lattice               = Lattice<D>(model_.origin, model_.h, model_.cells, model_.periodic, 0, grid_basis(model_.method));
    start_stresses(model_.materials, s.particles);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        p.V[i] = det(p.F[i]) * p.V0[i];
        if (p.J) p.J[i] = det(p.F[i]);
    });
    agree(ranks, [&] { start_domains(s); });
    s.reach = largest(ranks, s.reach);
    sort_particles(model_, s);
    return s;
}

template <int D>
const ProjectionReport& Scheme<D>::project(State<D>& s) const
{
    arrange(s);
    s.projection.fit = {};
    evaluate_external_forces(s, s.t);
    find_projection(s);
    agree_on_fits(model_.method, s);
    return s.projection;
}

template <int D>
void Scheme<D>::step(State<D>& s, double dt) const
{
    ORDO_EXPECT(dt > 0);
    arrange(s);
    s.projection.fit = {};
    s.report         = {};
    const StepDamping<D> damping(model_, s);
    if (s.account.is_wanted)
        take_accounted_step(s, dt);
    else
        take_step(s, dt);
    damping.apply(s, dt);
    s.dt_prev = dt;
    ++s.n;
    s.field.mass.is_formed = false;  // particles have moved
    agree(model_, s);                // only here: in the last output, time and particles must match
}

template <int D>
void Scheme<D>::begin(const Stage<D>& stage, int number, State<D>& s)
{
    begin_stage(stage, number, model_, s);
}

template <int D>
void Scheme<D>::prepare(const std::vector<Stage<D>>& stages, int number, State<D>& s)
{
    for (; s.stage < number; ++s.stage) {
        const Stage<D>& next = stages.at(static_cast<std::size_t>(s.stage) + 1);
        remove_bodies(next, model_, s);
        put_in_force(next, model_);
    }
}

template <int D>
void Scheme<D>::take_accounted_step(State<D>& s, double dt) const
{
    s.account.begin_step();
    evaluate_external_forces(s, s.t);
    s.has_external_forces = model_.method.scheme != TimeScheme::usf;  // take_step begins with the same; USF updates F before
    const ExternalWork<D> work(model_, s);
    take_step(s, dt);
    s.account.settle(*s.ranks);
    evaluate_external_forces(s, s.t);
    work.add(s);
}

template <int D>
void Scheme<D>::advance_time(State<D>& s, double dt)
{
    const double step = dt + s.t_rest, t = s.t + step;
    s.t_rest = step - (t - s.t);
    s.t      = t;
}

template <int D>
void Scheme<D>::arrange(State<D>& s) const
{
    Stopwatch watch(times_, StageTimes::sort);
    s.field.mass.is_formed = false;  // particles were changed from outside
    if (is_sorted_enough(s))
        number_enriched(s);
    else
        sort_particles(model_, s);
}

template <int D>
void Scheme<D>::evaluate_external_forces(State<D>& s, double t) const
{
    if (std::exchange(s.has_external_forces, false)) return;
    Stopwatch watch(times_, StageTimes::body_force);
    const ParticleView<D> p = s.particles.view();
    if (!model_.tractions.empty()) evaluate_loads(model_.loads, model_.tractions, s.lattice, p, t);
    if (model_.body_force_kernel) {
        parallel_pieces(p.count, [&](std::ptrdiff_t begin, std::ptrdiff_t end) { model_.body_force_kernel(p, begin, end, t); });
    } else if (has_body_force_) {
        parallel_for_each(p.count, [&](std::ptrdiff_t i) {
            p.b[i] = evaluate<D>(model_.body_forces[p.body[i]],
                                 {padded(place_in_period(model_, s.particles, static_cast<int>(i))), padded(p.X[i]), t});
        });
    } else if (added_body_force_) {
        std::fill_n(p.b, p.count, Vec<D>{});
    }
    if (added_body_force_) added_body_force_(p, t);
}

template <int D>
void Scheme<D>::add_body_force(AddedBodyForce<D> force, State<D>& s)
{
    const bool has_room = has_body_force_ || force;
    if (has_room == s.particles.b.empty()) s.particles.b = Array<Vec<D>>(has_room ? s.particles.x.size() : 0);
    added_body_force_     = std::move(force);
    s.has_external_forces = false;
}

template <int D>
void Scheme<D>::on_nodes(OnNodes<D> change)
{
    if (change && is_spline_fit(model_.method))
        throw InputError("method: projection spline-fit has no nodes that forces act on; take another method, such as bscpdi2");
    if (change && is_implicit(model_.method))
        throw InputError("method: implicit schemes solve for the nodes, so nothing can change their forces in a step; take "
                         "scheme usl or musl");
    on_nodes_ = std::move(change);
}

template class Scheme<1>;
template class Scheme<2>;
template class Scheme<3>;

}  // namespace ordo
