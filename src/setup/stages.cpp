#include "setup/stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(std::size_t k, std::string_view key, std::string_view why)
{
    throw SetupError(Part::stage, static_cast<int>(k), key, why);
}

bool acts_in(const std::vector<int>& stages, std::size_t k)
{
    return stages.empty() || std::find(stages.begin(), stages.end(), static_cast<int>(k)) != stages.end();
}

template <int D>
void require_times(const CaseSpec<D>& spec)
{
    for (std::size_t k = 0; k < spec.stages.size(); ++k) {
        const StageSpec& stage = spec.stages[k];
        if (!(stage.duration > 0 && std::isfinite(stage.duration)))
            fail(k, "duration", fmt::format("must be positive (got {})", stage.duration));
        if (!stage.residual) continue;
        if (!(*stage.residual > 0 && *stage.residual < 1))
            fail(k, "residual", fmt::format("must be above 0 and below 1 (got {})", *stage.residual));
    }
    double end = 0.0;
    for (const StageSpec& stage : spec.stages) end += stage.duration;
    if (!spec.stages.empty() && spec.time.end > 0 && std::fabs(spec.time.end - end) > 1e-9 * end)
        throw SetupError(Part::time, 0, "end",
                         fmt::format("must be the sum of the durations of the stages, {} (got {}), or 0", end, spec.time.end));
}

/// What bodies there are in each stage, and what changes.
template <int D>
void require_changes(const CaseSpec<D>& spec)
{
    std::set<int> removed;
    std::vector<int> material;
    for (const BodySpec<D>& b : spec.bodies) material.push_back(b.material);
    const int bodies = static_cast<int>(spec.bodies.size()), materials = static_cast<int>(spec.materials.size());
    for (std::size_t k = 0; k < spec.stages.size(); ++k) {
        const StageSpec& stage = spec.stages[k];
        if (k == 0 && !stage.removed.empty())
            fail(k, "remove", "has no meaning for the first stage; leave the body out of the case");
        if (k == 0 && !stage.materials.empty())
            fail(k, "materials", "has no meaning for the first stage; give the bodies these materials");
        for (const int b : stage.removed) {
            if (!(b >= 0 && b < bodies)) fail(k, "remove", fmt::format("there is no body {}", b));
            if (!removed.insert(b).second)
                fail(k, "remove", fmt::format("body \"{}\" was taken out before; remove it here", spec.bodies[b].name));
        }
        if (static_cast<int>(removed.size()) == bodies) fail(k, "remove", "takes the last body out; one must stay");
        for (const auto& change : stage.materials) {
            if (!(change.body >= 0 && change.body < bodies))
                fail(k, "materials", fmt::format("there is no body {}", change.body));
            if (!(change.material >= 0 && change.material < materials))
                fail(k, "materials", fmt::format("there is no material {}", change.material));
            const LawRow& law = *spec.materials[change.material].law;
            if (law.outside)
                fail(k, "materials",
                     fmt::format("cannot give a body the law {}, which knows no stress to start with; bodies have it from the "
                                 "start of the run or not at all",
                                 law.name));
            const std::string& name = spec.bodies[change.body].name;
            if (removed.count(change.body))
                fail(k, "materials", fmt::format("body \"{}\" has been taken out; remove it here", name));
            const double before = spec.materials[material[change.body]].density, after = spec.materials[change.material].density;
            if (before != after)
                fail(
                    k, "materials",
                    fmt::format("body \"{}\" keeps its mass, but its density would change from {} to {}; give both materials the "
                                "same",
                                name, before, after));
            material[change.body] = change.material;
        }
    }
}

/// Boundaries and tractions that act in some stages only.
template <int D>
void require_parts(const CaseSpec<D>& spec)
{
    const auto count = static_cast<int>(spec.stages.size());
    auto check       = [&](const auto& items, Part part) {
        for (std::size_t n = 0; n < items.size(); ++n) {
            const int index = static_cast<int>(n);
            for (const int stage : items[n].stages)
                if (!(stage >= 0 && stage < count))
                    throw SetupError(part, index, "stages", fmt::format("there is no stage {}", stage));
        }
    };
    check(spec.boundaries, Part::boundary);
    check(spec.tractions, Part::traction);
    for (std::size_t n = 0; n < spec.boundaries.size(); ++n) {
        const BoundarySpec<D>& b = spec.boundaries[n];
        if (b.stages.empty()) continue;
        auto refuse = [&](std::string_view why) { throw SetupError(Part::boundary, static_cast<int>(n), "stages", why); };
        if (b.type == FaceType::periodic) refuse("has no meaning for a periodic axis, which is one throughout; remove it");
        if (has_enrichment(spec.method))
            refuse("cannot be with enriched corners, which begin on their planes; use a method without enrichment (cpdi2)");
        if (is_spline_fit(spec.method)) refuse("cannot be with spline fits, whose walls are fixed; use bscpdi2");
    }
}

/// Methods that build on the bodies and materials of the start.
template <int D>
void require_method(const CaseSpec<D>& spec)
{
    const char* remedy = is_spline_fit(spec.method)    ? "spline fits, which take one law and one shape; use bscpdi2"
                         : has_enrichment(spec.method) ? "enriched corners, which bodies share; use cpdi2"
                                                       : nullptr;
    for (std::size_t k = 0; k < spec.stages.size() && remedy; ++k) {
        const StageSpec& stage = spec.stages[k];
        if (!stage.removed.empty()) fail(k, "remove", fmt::format("cannot be with {}", remedy));
        if (!stage.materials.empty() && is_spline_fit(spec.method))
            fail(k, "materials", fmt::format("cannot be with {}", remedy));
    }
}

/// Whether a field changes with time in a stage, by samples.
template <int D>
bool changes(const Field& f, const Stage<D>& stage, const Model<D>& model)
{
    constexpr int times = 17, places = 3;
    for (int n = 1; n <= places; ++n) {
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = model.origin[a] + n * model.cells[a] * model.h[a] / (places + 1);
        const double first = f({padded(x), padded(x), stage.start});
        for (int k = 1; k < times; ++k)
            if (f({padded(x), padded(x), stage.start + k * (stage.end - stage.start) / (times - 1)}) != first) return true;
    }
    return false;
}

/// Whether a velocity is not zero there.
template <int D>
bool moves(const Field& f, const Stage<D>& stage, const Model<D>& model)
{
    Vec<D> x{};
    for (int a = 0; a < D; ++a) x[a] = model.origin[a] + 0.4 * model.cells[a] * model.h[a];
    return f({padded(x), padded(x), 0.5 * (stage.start + stage.end)}) != 0 || changes(f, stage, model);
}

/// A stage that ends at rest needs something that moves it and stays the same: else it ends before a load has grown, and the jump of
/// the clock would leave out what a boundary still has to go.
template <int D>
void require_steady(const CaseSpec<D>& spec, const Model<D>& model, int number, const Stage<D>& stage,
                    const std::set<int>& removed)
{
    if (!(stage.residual > 0)) return;
    if (is_static(spec.method))
        fail(number, "residual", "has no meaning with scheme static, whose states are all at rest; give the duration alone");
    auto refuse = [&](std::string_view what, const std::string& name) {
        fail(number, "residual",
             fmt::format(
                 "cannot be where {} \"{}\" changes with time: let it change in a stage of its own that ends by its duration",
                 what, name));
    };
    bool is_pulled = norm(model.gravity) > 0;
    for (std::size_t b = 0; b < spec.bodies.size(); ++b) {
        if (removed.count(static_cast<int>(b))) continue;
        is_pulled = is_pulled || !is_zero<D>(spec.bodies[b].body_force);
        for (const Field& f : spec.bodies[b].body_force)
            if (changes(f, stage, model)) refuse("the body_force of", spec.bodies[b].name);
    }
    if (!is_pulled)
        fail(number, "residual",
             "is relative to gravity and body forces, and no body of this stage has any; give the duration alone");
    for (const Condition<D>& b : stage.conditions)
        for (const auto& value : b.value)
            if (value && (changes(*value, stage, model) || (b.type == ConditionType::velocity && moves(*value, stage, model))))
                refuse("the place of boundary", spec.boundaries[static_cast<std::size_t>(b.boundary)].name);
    for (const Obstacle<D>& o : model.obstacles) {
        bool is_moved = o.is_moved();
        for (const Field& f : o.velocity) is_moved = is_moved || moves(f, stage, model);
        for (const Field& f : o.spin) is_moved = is_moved || moves(f, stage, model);
        if (is_moved) refuse("the place of obstacle", o.name);
    }
    for (const Wall<D>& w : stage.walls)
        for (const Field& f : w.velocity)
            if (!f.is_zero()) refuse("the place of wall", spec.boundaries[static_cast<std::size_t>(w.boundary)].name);
    for (std::size_t n = 0; n < stage.tractions.size(); ++n)
        for (const Field& f : stage.tractions[n].value)
            if (changes(f, stage, model)) refuse("traction", std::to_string(n));
}

}  // namespace

template <int D>
std::vector<Stage<D>> stages_of(const CaseSpec<D>& spec, const Model<D>& model)
{
    require_times(spec);
    require_changes(spec);
    require_parts(spec);
    require_method(spec);
    std::vector<Stage<D>> r;
    std::set<int> removed;
    double t = 0.0;
    for (std::size_t k = 0; k < spec.stages.size(); ++k) {
        const StageSpec& of = spec.stages[k];
        removed.insert(of.removed.begin(), of.removed.end());
        Stage<D>& stage = r.emplace_back();
        stage           = {.name     = of.name,
                           .start    = t,
                           .end      = t + of.duration,
                           .residual = of.residual.value_or(0.0),
                           .damping  = of.damping,
                           .removed  = of.removed};
        t               = stage.end;
        for (const auto& change : of.materials) stage.materials.push_back({change.body, change.material});
        auto acts = [&](int boundary) { return acts_in(spec.boundaries[static_cast<std::size_t>(boundary)].stages, k); };
        for (const Condition<D>& b : model.conditions)
            if (acts(b.boundary) && !(b.body && removed.count(*b.body))) stage.conditions.push_back(b);
        for (const Wall<D>& w : model.walls)
            if (acts(w.boundary)) stage.walls.push_back(w);
        stage.tractions = model.tractions;
        for (std::size_t n = 0; n < spec.tractions.size(); ++n)
            if (!acts_in(spec.tractions[n].stages, k)) stage.tractions[n].value = {};
        require_steady(spec, model, static_cast<int>(k), stage, removed);
    }
    return r;
}

template std::vector<Stage<1>> stages_of(const CaseSpec<1>&, const Model<1>&);
template std::vector<Stage<2>> stages_of(const CaseSpec<2>&, const Model<2>&);
template std::vector<Stage<3>> stages_of(const CaseSpec<3>&, const Model<3>&);

}  // namespace ordo::setup
