#include "method/stage.hpp"

#include "base/agree.hpp"
#include "method/energy_account.hpp"
#include "method/layout.hpp"
#include "method/place.hpp"
#include "particles/remove.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>

namespace ordo {

namespace {

template <class T>
bool contains(const std::vector<T>& all, const T& one)
{
    return std::find(all.begin(), all.end(), one) != all.end();
}

/// Gives particle i another material at time t. It keeps its Cauchy stress if the new law can have it at the same F, and the columns that
/// both laws have; others start anew. A stress outside the yield surface returns to it at once.
template <int D>
void change_material(const std::vector<Material>& materials, int to, double t, Particles<D>& p, int i)
{
    const Material &before = materials[p.material[i]], &m = materials[to];
    const std::vector<HistoryColumn> columns = history_of(m, D), had = history_of(before, D);
    double history[Material::most_history];
    start_history(m, p.F[i], history);
    int k = 0;
    for (const HistoryColumn& c : columns) {
        if (std::any_of(had.begin(), had.end(), [&](const HistoryColumn& other) { return other.name == c.name; }))
            history[k] = p.history[p.history_column(c.name)][i];
        ++k;
    }
    double fault          = can_have_stress<D>(m) && !set_stress(m, p.F[i], p.sigma[i], history) ? 1.0 : 0.0;
    const Stress<D> sigma = update_stress(m, Step<D>{p.F[i], {}, 0.0}, p.sigma[i], history, fault);
    if (fault > 0)
        throw NumericalError(fmt::format(
            "t = {:.6g} s: particle {} of body {} at {}: the law {} of its new material cannot have its stress; let an "
            "earlier stage end in a state that it can, or take another law",
            t, p.id[i], p.body[i], place_text(p.x[i]), m.law->name));
    p.sigma[i]    = sigma;
    p.material[i] = to;
    k             = 0;
    for (const HistoryColumn& c : columns) p.history[p.history_column(c.name)][i] = history[k++];
}

/// The same for the particles of a body.
template <int D>
void change_materials(const std::vector<Material>& materials, int body, int to, State<D>& s)
{
    int i = 0;
    std::string fault;
    try {
        for (; i < s.particles.count; ++i)
            if (s.particles.body[i] == body) change_material(materials, to, s.t, s.particles, i);
    } catch (const NumericalError& e) {
        fault = e.what();
    }
    fault = text_of_first(*s.ranks, tile_of_particle(s, i), [&] { return fault; });
    if (!fault.empty()) throw NumericalError(fault);
}

/// How far walls have moved: those that go on keep their places, others begin at theirs.
template <int D>
std::vector<Vec<D>> shifts_of(const std::vector<Wall<D>>& next, const std::vector<Wall<D>>& walls,
                              const std::vector<Vec<D>>& shifts)
{
    std::vector<Vec<D>> r(next.size());
    for (std::size_t k = 0; k < next.size(); ++k)
        for (std::size_t j = 0; j < walls.size(); ++j)
            if (walls[j].boundary == next[k].boundary) r[k] = shifts[j];
    return r;
}

/// The clock at the planned start: later than it was if the stage before ended by its residual.
template <int D>
void set_clock(double t, State<D>& s)
{
    const double jump = t - s.t;
    s.t               = t;
    s.t_rest          = 0.0;
    s.t_v += jump;
    s.t_F += jump;
}

}  // namespace

template <int D>
void put_in_force(const Stage<D>& stage, Model<D>& model)
{
    model.conditions = stage.conditions;
    model.walls      = stage.walls;
    model.tractions  = stage.tractions;
    model.damping    = stage.damping;
    model.residual   = stage.residual;
}

template <int D>
void remove_bodies(const Stage<D>& stage, const Model<D>& model, State<D>& s)
{
    s.wall_shifts = shifts_of(stage.walls, model.walls, s.wall_shifts);
    s.least_masses.clear();
    if (stage.removed.empty()) return;
    auto is_out = [&](int i) { return contains(stage.removed, static_cast<int>(s.particles.body[i])); };
    s.field.tiles.keep_particles([&](int i) { return !is_out(i); });
    remove_particles(*s.ranks, s.particles, is_out);
}

template <int D>
void begin_stage(const Stage<D>& stage, int number, Model<D>& model, State<D>& s)
{
    const EnergyParts before = energy_parts(totals(model, s));
    remove_bodies(stage, model, s);
    put_in_force(stage, model);
    sort_particles(model, s);
    for (const auto& change : stage.materials) change_materials(model.materials, change.body, change.material, s);
    const EnergyParts added = energy_parts(totals(model, s)) - before;
    s.account.start += added;
    s.account.staged -= added.all();
    set_clock(stage.start, s);
    s.stage               = number;
    s.kinetic_energy      = 0.0;
    s.residual            = std::numeric_limits<double>::infinity();
    s.has_external_forces = false;
}

template <int D>
void require_rest(const Stage<D>& stage, const State<D>& s, bool is_over)
{
    if (!is_over || !(stage.residual > 0) || s.residual <= stage.residual) return;
    throw NumericalError(fmt::format(
        "step {}, t = {:.6g} s: stage \"{}\" ends with a residual of {:.3g}, above {:.3g}: the bodies are not at rest; a "
        "longer duration, damping = \"kinetic\" or a larger residual may help",
        s.n, s.t, stage.name, s.residual, stage.residual));
}

template <int D>
std::size_t boundary_count(const std::vector<Stage<D>>& stages)
{
    int count = 0;
    for (const Stage<D>& stage : stages) {
        for (const Condition<D>& b : stage.conditions) count = std::max(count, b.boundary + 1);
        for (const Wall<D>& w : stage.walls) count = std::max(count, w.boundary + 1);
    }
    return static_cast<std::size_t>(count);
}

#define ORDO_STAGE(D)                                                         \
    template void put_in_force(const Stage<D>&, Model<D>&);                   \
    template void remove_bodies(const Stage<D>&, const Model<D>&, State<D>&); \
    template void begin_stage(const Stage<D>&, int, Model<D>&, State<D>&);    \
    template void require_rest(const Stage<D>&, const State<D>&, bool);       \
    template std::size_t boundary_count(const std::vector<Stage<D>>&);
ORDO_STAGE(1)
ORDO_STAGE(2)
ORDO_STAGE(3)
#undef ORDO_STAGE

}  // namespace ordo
