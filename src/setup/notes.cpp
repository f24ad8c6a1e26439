#include "setup/notes.hpp"

#include "method/tables.hpp"
#include "setup/contacts.hpp"
#include "setup/inside.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>

namespace ordo::setup {

namespace {

template <int D>
void note_thin_boxes(const CaseSpec<D>& spec, const Model<D>& model, std::vector<std::string>& notes)
{
    for (const BodySpec<D>& b : spec.bodies) {
        const auto* box = std::get_if<Bounds<D>>(&b.shape);
        for (int a = 0; box && a < D; ++a)
            if (box->upper[a] - box->lower[a] < 1.5 * model.h[a] / b.particles_per_cell[a] && b.particles_per_cell[a] > 1)
                notes.push_back(
                    fmt::format("body \"{}\" is one particle thick along {}: it cannot bend, and cells there hold too few "
                                "particles; refine [grid] spacing or use more particles_per_cell",
                                b.name, "xyz"[a]));
    }
}

/// Whether a condition covers a node of the cell that a seed is in.
template <int D>
bool reaches(const Seed<D>& s, const Condition<D>& b, const Model<D>& model)
{
    bool r = false;
    IndexBox<D>{{}, Index<D>::filled(2)}.for_each([&](const Index<D>& side) {
        Vec<D> x{};
        for (int a = 0; a < D; ++a)
            x[a] = model.origin[a] + model.h[a] * (std::floor((s.x[a] - model.origin[a]) / model.h[a]) + side[a]);
        r = r || b.covers(x, model.h);
    });
    return r;
}

/// A clamp or a grip that holds no body is most likely misplaced.
template <int D>
void note_idle_conditions(const CaseSpec<D>& spec, const std::vector<SeedWalk<D>>& seeds, const Model<D>& model,
                          std::vector<std::string>& notes)
{
    auto is_idle = [&](const Condition<D>& b) {
        bool is = true;
        for_each_seed(seeds, [&](const Seed<D>& s, int) { is = is && !reaches(s, b, model); });
        return is;
    };
    for (const Condition<D>& b : model.conditions)
        if (b.region && is_idle(b))
            notes.push_back(
                fmt::format("the region of boundary \"{}\" holds no node of a body at the start; it must be at least a "
                            "cell thick where a body is",
                            spec.boundaries[static_cast<std::size_t>(b.boundary)].name));
    for (const BoundarySpec<D>& b : spec.boundaries) {
        if (!b.is_on_plane()) continue;
        if (b.type != FaceType::fixed && !moves_nodes(b.type)) continue;
        const double at = b.at.value_or(model.face(b.axis, b.is_above));
        double nearest  = HUGE_VAL;
        for_each_seed(seeds, [&](const Seed<D>& s, int) {
            nearest = std::min(nearest, (b.is_above ? at - s.x[b.axis] : s.x[b.axis] - at) - reach_of_domain(s)[b.axis]);
        });
        if (nearest > model.h[b.axis])
            notes.push_back(fmt::format("the boundary {} = {} ({}) holds no body at the start: the nearest is {:.3g} m away",
                                        "xyz"[b.axis], at,
                                        b.type == FaceType::fixed      ? "fixed"
                                        : b.type == FaceType::velocity ? "velocity"
                                                                       : "displacement",
                                        nearest));
    }
}

/// The cells of the grid that a body fills, by one number each.
template <int D>
struct Cells {
    const Model<D>& model;

    Index<D> at(const Vec<D>& x) const
    {
        Index<D> k{};
        for (int a = 0; a < D; ++a)
            k[a] = static_cast<int>(std::clamp((x[a] - model.origin[a]) / model.h[a], 0.0, model.cells[a] - 0.5));
        return k;
    }
    std::uint64_t number(const Index<D>& k) const
    {
        std::uint64_t r = 0;
        for (int a = D - 1; a >= 0; --a) r = r * static_cast<std::uint64_t>(model.cells[a]) + static_cast<std::uint64_t>(k[a]);
        return r;
    }
};

template <int D>
void note_bodies_that_stick(const CaseSpec<D>& spec, const std::vector<SeedWalk<D>>& seeds, const Model<D>& model,
                            std::vector<std::string>& notes)
{
    if (spec.bodies.size() < 2 || spec.method.enrichment == Enrichment::all) return;
    const Cells<D> cells{model};
    std::unordered_map<std::uint64_t, int> owner;  // of each cell; the first of several
    std::set<std::pair<int, int>> pairs;
    auto meet = [&](int one, int other) {
        if (one != other) pairs.insert(std::minmax(one, other));
    };
    std::vector<std::pair<Index<D>, int>> filled;
    const std::vector<Bounds<D>> bounds = bounds_of(seeds);
    for_each_seed(seeds, [&](const Seed<D>& s, int own) {
        const Vec<D> reach = reach_of_domain(s);
        if (!is_near_another(s.x, reach + 2.0 * model.h, own, bounds)) return;  // cells of others are not next to its own
        const Index<D> low = cells.at(s.x - (1 - 1e-6) * reach), high = cells.at(s.x + (1 - 1e-6) * reach);
        IndexBox<D>{low, high + Index<D>::filled(1)}.for_each([&](const Index<D>& k) {
            const auto [it, is_new] = owner.emplace(cells.number(k), own);
            if (is_new) filled.emplace_back(k, own);
            meet(it->second, own);
        });
    });
    for (const auto& [k, own] : filled)  // cells that share a node
        IndexBox<D>{Index<D>::filled(-1), Index<D>::filled(2)}.for_each([&, k = k, own = own](const Index<D>& step) {
            const Index<D> next = k + step;
            for (int a = 0; a < D; ++a)
                if (next[a] < 0 || next[a] >= model.cells[a]) return;
            if (const auto it = owner.find(cells.number(next)); it != owner.end()) meet(own, it->second);
        });
    auto is_driven = [&](int k) {  // a grip or a punch is meant to stick
        return std::any_of(spec.boundaries.begin(), spec.boundaries.end(), [&](const auto& b) { return b.body == k; });
    };
    for (const auto& [one, other] : pairs)
        if (!is_driven(one) && !is_driven(other) && model.field_of(one) == model.field_of(other))
            notes.push_back(
                fmt::format("bodies \"{}\" and \"{}\" are closer than a cell: they stick together like one body, also where they "
                            "should slide or part; a [[contact]] between them lets them",
                            spec.bodies[one].name, spec.bodies[other].name));
}

/// Bodies with fields of their own see only those that they are in contact with.
template <int D>
void note_bodies_that_pass(const CaseSpec<D>& spec, const Model<D>& model, std::vector<std::string>& notes)
{
    const int count = static_cast<int>(spec.bodies.size());
    for (int one = 0; one < count; ++one)
        for (int other = one + 1; other < count; ++other) {
            const bool is_pair = std::any_of(model.contacts.begin(), model.contacts.end(), [&](const ContactPair<D>& c) {
                return c.surface == std::array{one, other};
            });
            if (model.field_of(one) == model.field_of(other) || is_pair) continue;
            notes.push_back(fmt::format(
                "bodies \"{}\" and \"{}\" do not see each other: at least one of them is in a [[contact]], but not with "
                "the other",
                spec.bodies[one].name, spec.bodies[other].name));
        }
}

/// Stairs of sub-cells meet before round faces would, and lock.
template <int D>
void note_stairs_in_contact(const CaseSpec<D>& spec, const Model<D>& model, std::vector<std::string>& notes)
{
    for (int k = 0; k < static_cast<int>(spec.bodies.size()); ++k) {
        const BodySpec<D>& b = spec.bodies[k];
        const auto* tube     = std::get_if<TubeShape<D>>(&b.shape);
        if (!(std::holds_alternative<Ball<D>>(b.shape) || (tube && !tube->is_polar)) || !is_in_contact(model, k)) continue;
        notes.push_back(fmt::format(
            "body \"{}\" is round and in contact, and its faces are stairs of sub-cells, which meet early and lock into "
            "others; cells = \"polar\" fit it",
            b.name));
    }
}

/// Where the volume hardly changes, stresses of single particles lock.
template <int D>
void note_locking(const CaseSpec<D>& spec, std::vector<std::string>& notes)
{
    constexpr double most    = 0.45;  // Poisson's ratio
    const MethodSpec& method = spec.method;
    if (D < 2 || method.averaging != Averaging::none || method.quadrature != Quadrature::particle) return;
    for (std::size_t k = 0; k < spec.materials.size(); ++k) {
        const Material& m  = spec.materials[k];
        const double ratio = m.lambda / (2 * (m.lambda + m.mu));
        const bool is_used =
            std::any_of(spec.bodies.begin(), spec.bodies.end(), [&](const auto& b) { return b.material == static_cast<int>(k); });
        if (!is_used || !(m.law->keeps_volume || ratio > most)) continue;
        notes.push_back(fmt::format(
            "a body of {}{}: single particles lock where the volume cannot change, and pressures oscillate; "
            "averaging = \"cell\" in [method] avoids both",
            m.law->name,
            m.law->keeps_volume ? ", which flows at constant volume" : fmt::format(" with Poisson's ratio {:.3g}", ratio)));
        return;
    }
}

template <int D>
void note_lost_velocities(const CaseSpec<D>& spec, std::vector<std::string>& notes)
{
    for (const BodySpec<D>& b : spec.bodies)
        if (is_static(spec.method) && !is_zero<D>(b.velocity))
            notes.push_back(fmt::format("the velocity of body \"{}\" has no effect with scheme static", b.name));
}

/// What costs implicit steps in motion their worth.
template <int D>
void note_implicit_motion(const CaseSpec<D>& spec, std::vector<std::string>& notes)
{
    const MethodSpec& method = spec.method;
    if (!is_implicit(method) || is_static(method)) return;
    MethodSpec consistent = method;
    consistent.mass       = MassMatrix::consistent;
    if (D > 1 && method.mass == MassMatrix::lumped && !broken_rule(consistent))
        notes.emplace_back(
            "with lumped mass implicit steps take energy from bodies that turn; mass = \"consistent\" in [method] keeps "
            "it (docs/implicit.md)");
    if (!spec.time.dt && spec.time.cfl <= 1)
        notes.push_back(fmt::format(
            "with cfl = {:.3g} steps are as short as explicit ones; give a larger one or dt in [time], as long as the "
            "motion that is to be seen allows",
            spec.time.cfl));
}

}  // namespace

template <int D>
std::vector<std::string> notes_on(const CaseSpec<D>& spec, const std::vector<SeedWalk<D>>& seeds, const Model<D>& model)
{
    std::vector<std::string> notes;
    note_thin_boxes(spec, model, notes);
    note_idle_conditions(spec, seeds, model, notes);
    note_bodies_that_stick(spec, seeds, model, notes);
    note_bodies_that_pass(spec, model, notes);
    note_stairs_in_contact(spec, model, notes);
    note_locking(spec, notes);
    note_lost_velocities(spec, notes);
    note_implicit_motion(spec, notes);
    return notes;
}

template std::vector<std::string> notes_on(const CaseSpec<1>&, const std::vector<SeedWalk<1>>&, const Model<1>&);
template std::vector<std::string> notes_on(const CaseSpec<2>&, const std::vector<SeedWalk<2>>&, const Model<2>&);
template std::vector<std::string> notes_on(const CaseSpec<3>&, const std::vector<SeedWalk<3>>&, const Model<3>&);

}  // namespace ordo::setup
