#include "setup/build.hpp"

#include "method/contact_points.hpp"
#include "method/planting.hpp"
#include "method/tables.hpp"
#include "particles/remove.hpp"
#include "setup/conditions.hpp"
#include "setup/contacts.hpp"
#include "setup/initial_stress.hpp"
#include "setup/inside.hpp"
#include "setup/loads.hpp"
#include "setup/notes.hpp"
#include "setup/obstacles.hpp"
#include "setup/overlap.hpp"
#include "setup/schemes.hpp"
#include "setup/seeding.hpp"
#include "setup/stages.hpp"
#include "setup/time_step.hpp"
#include "setup/true_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo::setup {

namespace {

template <int D>
void require_materials(const CaseSpec<D>& spec)
{
    if (spec.materials.empty()) throw SetupError(Part::material, 0, "", "there is none; a case needs at least one material");
    for (std::size_t k = 0; k < spec.materials.size(); ++k) {
        const Material& m = spec.materials[k];
        auto fail         = [&](const char* key, const std::string& why) {
            throw SetupError(Part::material, static_cast<int>(k), key, why);
        };
        if (!(m.density > 0)) fail("density", fmt::format("must be positive (got {})", m.density));
        if (!(m.p_wave_modulus() > 0)) fail("lambda", "makes the P-wave modulus zero or negative; the material would collapse");
        if (!m.law) fail("model", "is missing; take one of find_law");
        if (D > m.law->max_dim) fail("model", fmt::format("{} exists in {}D only", m.law->name, m.law->max_dim));
    }
}

/// Also gives nameless bodies a name.
template <int D>
void require_bodies(CaseSpec<D>& spec)
{
    if (spec.bodies.empty()) throw SetupError(Part::body, 0, "", "there is none; a case needs at least one body");
    for (std::size_t k = 0; k < spec.bodies.size(); ++k) {
        BodySpec<D>& b = spec.bodies[k];
        if (b.name.empty()) b.name = fmt::format("body {}", k);
        if (!(b.material >= 0 && b.material < static_cast<int>(spec.materials.size())))
            throw SetupError(Part::body, static_cast<int>(k), "material", fmt::format("there is no material {}", b.material));
    }
}

void require_damping(const Damping& d, const MethodSpec& method)
{
    auto fail = [](const char* key, const std::string& why) { throw SetupError(Part::damping, 0, key, why); };
    if (d.type != DampingType::none && is_static(method))
        fail("type", "has no meaning with scheme static, which has no motion to damp; remove it");
    if (d.type == DampingType::local && !(d.factor > 0 && d.factor <= 1))
        fail("factor", fmt::format("must be above 0 and at most 1 (got {})", d.factor));
    if (d.type == DampingType::viscous && !(d.rate > 0 && std::isfinite(d.rate)))
        fail("rate", fmt::format("must be positive (got {})", d.rate));
}

/// The model without loaded faces and free surface, which need the bodies.
template <int D>
Model<D> model_of(const CaseSpec<D>& spec)
{
    Model<D> model{};
    model.method = spec.method;
    if (spec.method.lump_below < 0) {
        const bool has_motion   = std::any_of(spec.boundaries.begin(), spec.boundaries.end(),
                                              [](const BoundarySpec<D>& b) { return moves_nodes(b.type); });
        model.method.lump_below = default_lump_below(spec.method, has_motion);
    }
    model.origin  = spec.origin;
    model.gravity = spec.gravity;
    model.damping = spec.damping;
    for (int a = 0; a < D; ++a) {
        model.cells[a] = static_cast<int>(std::lround(spec.size[a] / spec.spacing[a]));
        model.h[a]     = spec.size[a] / model.cells[a];
    }
    model.materials = spec.materials;
    set_up_conditions(spec, model);
    set_up_contacts(spec, model);
    set_up_obstacles(spec, model);
    for (const TractionSpec<D>& t : spec.tractions) model.tractions.push_back(t.traction);
    for (const BodySpec<D>& b : spec.bodies) model.body_forces.push_back(b.body_force);
    return model;
}

/// Particles by number, those from `begin` up to `end`, and their places among these.
struct Range {
    int begin, end;

    bool has(int id) const { return begin <= id && id < end; }
    int place(int id) const { return std::clamp(id, begin, end) - begin; }
};

/// The particles of a share of all.
Range range_of(const Share& share, int count)
{
    const auto [begin, end] = part_of(count, share.index, share.count);
    return {static_cast<int>(begin), static_cast<int>(end)};
}

/// Bodies before they become particles.
template <int D>
struct Seeded {
    std::vector<SeedWalk<D>> walks{};
    std::vector<CellMesh<D>> meshes{};  ///< of bodies, if the method, tractions or contacts need them
    std::vector<int> first{};           ///< first particle of each body, and the end of the last
    Range made{};                       ///< the particles that are made

    int count() const { return first.back(); }
    Range of_body(int k) const { return {made.place(first[k]), made.place(first[k + 1])}; }  ///< places
};

template <int D>
Seeded<D> seed_bodies(CaseSpec<D>& spec, const Model<D>& model, double most_particles, const Share& share)
{
    Seeded<D> r;
    double count = 0;
    for (std::size_t n = 0; n < spec.bodies.size(); ++n) {
        const int k          = static_cast<int>(n);
        const Filling<D> own = fill_body(spec.bodies[n], k, model, most_particles);
        std::ptrdiff_t seeds = 0;
        own.walk([&](const Seed<D>&) { ++seeds; });
        require_some(k, seeds);
        require_inside(spec.bodies[n], k, own, model);
        r.first.push_back(static_cast<int>(count));
        if (has_cells(model.method) || !spec.tractions.empty() || needs_surfaces(model))
            r.meshes.push_back(mesh_body(own, k, model.method));
        count += static_cast<double>(r.meshes.empty() ? static_cast<std::size_t>(seeds) : r.meshes.back().cells.size());
        require_count(k, count, most_particles);
        r.walks.push_back(own.walk);
    }
    r.first.push_back(static_cast<int>(count));
    r.made = range_of(r.meshes.empty() ? share : Share{}, r.count());
    return r;
}

template <int D>
void plant_body(const BodySpec<D>& b, int k, const Seeded<D>& seeded, const Model<D>& model, Particles<D>& p)
{
    const double density    = model.materials[b.material].density;
    const auto [begin, end] = seeded.of_body(k);
    if (has_cells(model.method)) {
        plant_cells(p, begin, seeded.meshes[k], density);
    } else {
        int id = seeded.first[k];
        seeded.walks[k]([&](const Seed<D>& seed) {
            if (const int i = seeded.made.place(id); seeded.made.has(id)) {
                plant(p, i, seed, density);
                p.id[i] = id;
            }
            ++id;
        });
    }
    for (int i = begin; i < end; ++i) {
        const Vec<D> x = p.x[i];
        p.body[i]      = k;
        p.material[i]  = b.material;
        require_finite(evaluate<D>(b.body_force, {padded(x), padded(x), 0.0}), Part::body, k, "body_force", x);
    }
    const auto velocity_at = [&](const Vec<D>& x) { return evaluate<D>(b.velocity, {padded(x), padded(x), 0.0}); };
    set_velocities(p, begin, end, velocity_at, model.h);
    for (int i = begin; i < end; ++i) require_finite(p.v[i], Part::body, k, "velocity", p.x[i]);
}

template <int D>
std::vector<Vec<D>> corners_of(const Seed<D>& seed)
{
    std::vector<Vec<D>> r;
    IndexBox<D>{{}, Index<D>::filled(2)}.for_each([&](const Index<D>& k) {
        Vec<D> sides{};
        for (int a = 0; a < D; ++a) sides[a] = 2 * k[a] - 1;
        r.push_back(seed.x + seed.edges * sides);
    });
    return r;
}
template <int D>
std::vector<Vec<D>> corners_of(const CellMesh<D>& mesh, int cell)
{
    std::vector<Vec<D>> r;
    for (int c = 0; c < mesh.cells[cell].count(); ++c) r.push_back(mesh.corners[mesh.cells[cell][c]]);
    return r;
}

/// Gives a round body its true volume and mass: by a factor for the particles that its faces cut. The sums are over all particles, also
/// those that are not made.
template <int D>
void make_volume_true(const BodySpec<D>& b, int k, const Seeded<D>& seeded, const MethodSpec& method, Particles<D>& p)
{
    const std::optional<double> volume = true_volume(b.shape);
    if (!volume || b.keeps_lattice_volumes) return;
    int id = seeded.first[k];
    std::vector<int> cut;
    double of_cut = 0.0, of_whole = 0.0;
    auto add = [&](const Vec<D>& x, double V0, const std::vector<Vec<D>>& corners) {
        const bool is = is_cut(b.shape, x, corners);
        if (is && seeded.made.has(id)) cut.push_back(seeded.made.place(id));
        (is ? of_cut : of_whole) += V0;
        ++id;
    };
    if (has_cells(method))
        for (int c = 0; id < seeded.first[k + 1]; ++c) add(p.x[id], p.V0[id], corners_of(seeded.meshes[k], c));
    else
        seeded.walks[k]([&](const Seed<D>& seed) { add(seed.x, seed.volume, corners_of(seed)); });
    const double factor = of_cut > 0 ? (*volume - of_whole) / of_cut : 1.0;
    for (const int i : cut) {
        p.V0[i] *= factor;
        p.m[i] *= factor;
    }
}

/// The largest height of a body against gravity, m; for those with k0.
template <int D>
double top_of(const CaseSpec<D>& spec, int k, const Seeded<D>& seeded)
{
    if (!spec.bodies[k].stress.k0) return 0.0;
    const Vertical up = vertical_of(spec, k);
    double top        = -HUGE_VAL;
    auto reach        = [&](const std::vector<Vec<D>>& corners) {
        for (const Vec<D>& x : corners) top = std::max(top, up.sign * x[up.axis]);
    };
    if (seeded.meshes.empty())
        seeded.walks[k]([&](const Seed<D>& seed) { reach(corners_of(seed)); });
    else
        for (int i = seeded.first[k]; i < seeded.first[k + 1]; ++i) reach(corners_of(seeded.meshes[k], i - seeded.first[k]));
    return top;
}

template <int D>
BodyReport report_on(const BodySpec<D>& b, int begin, int end, const Particles<D>& p)
{
    BodyReport r{.name = b.name, .particles = end - begin, .true_volume = true_volume(b.shape)};
    for (int i = begin; i < end; ++i) {
        r.mass += p.m[i];
        r.volume += p.V0[i];
    }
    return r;
}

template <int D>
void set_up_enrichment(const Model<D>& model, Particles<D>& p)
{
    auto fail = [](std::string_view why) { throw SetupError(Part::method, 0, "enrichment", why); };
    int count = 0;
    try {
        count = enrich(model, p);
    } catch (const InputError& e) {
        fail(e.what());
    }
    if (count == 0)
        fail("finds no interface: no two bodies share a corner. Meshes must conform, and shapes must have the same cells on "
             "both sides; or choose enrichment = \"all\" or a method without enrichment (cpdi2)");
}

}  // namespace

void require_grid(const double* size, const double* spacing, int dim)
{
    auto fail    = [](const char* key, const std::string& why) { throw SetupError(Part::grid, 0, key, why); };
    double cells = 1;
    for (int a = 0; a < dim; ++a) {
        if (!(size[a] > 0)) fail("size", fmt::format("must be positive (got {})", size[a]));
        if (!(spacing[a] > 0)) fail("spacing", fmt::format("must be positive (got {})", spacing[a]));
        const double n = size[a] / spacing[a];
        cells *= n;
        if (std::fabs(n - std::round(n)) > 1e-6 * std::max(1.0, n) || std::round(n) < 1)
            fail("spacing", fmt::format("must divide the size {} of axis {} into whole cells (got {}); {} would", size[a],
                                        "xyz"[a], spacing[a], size[a] / std::max(1.0, std::round(n))));
        if (n > 1e6) fail("spacing", fmt::format("gives {:.3g} cells along axis {}; at most 1e6 are allowed", n, "xyz"[a]));
    }
    if (cells > 1e11) fail("spacing", fmt::format("gives {:.3g} cells; at most 1e11 are allowed", cells));
}

template <int D>
Built<D> build(CaseSpec<D> spec, double most_particles, const Share& share)
{
    require_grid(spec.size.c, spec.spacing.c, D);
    if (const Rule* rule = broken_rule(spec.method))
        throw SetupError(Part::method, 0, "", fmt::format("{} is not allowed: {}", rule->what, rule->why));
    if (D == 1 && spec.method.averaging != Averaging::none)
        throw SetupError(Part::method, 0, "averaging", "has no use in 1D, where all strain is dilation: remove it");
    require_materials(spec);
    require_bodies(spec);
    require_faces(spec.tractions, spec.bodies);
    require_damping(spec.damping, spec.method);
    for (const StageSpec& stage : spec.stages) require_damping(stage.damping, spec.method);
    Model<D> model               = model_of(spec);
    std::vector<Stage<D>> stages = stages_of(spec, model);
    if (!stages.empty()) {
        spec.time.end = stages.back().end;
        put_in_force(stages.front(), model);
    }
    const Seeded<D> seeded = seed_bodies(spec, model, most_particles, share);
    require_apart(spec.bodies, seeded.walks, model);

    Particles<D> p(seeded.made.end - seeded.made.begin, field_groups(model));
    std::vector<std::string> notes = notes_on(spec, seeded.walks, model);
    std::vector<BodyReport> bodies;
    for (std::size_t n = 0; n < spec.bodies.size(); ++n) {
        const int k             = static_cast<int>(n);
        const auto [begin, end] = seeded.of_body(k);
        plant_body(spec.bodies[n], k, seeded, model, p);
        make_volume_true(spec.bodies[n], k, seeded, model.method, p);
        set_initial_stress(spec, k, top_of(spec, k, seeded), begin, end, p);
        bodies.push_back(report_on(spec.bodies[n], begin, end, p));
        if (!spec.tractions.empty()) load_faces(spec.tractions, spec.bodies[n], k, seeded.meshes[n], begin, model, p);
    }
    if (has_enrichment(model.method)) set_up_enrichment(model, p);
    find_surfaces(seeded.meshes, seeded.first, p, model);
    if constexpr (D > 1)
        for (const Stage<D>& stage : stages)
            for (ContactSurface<D>& surface : model.surfaces) keep_planes_of_symmetry(stage.conditions, surface);
    set_up_scheme(spec, model, seeded.count());
    if (!seeded.meshes.empty() && share.count > 1) {
        const Range own = range_of(share, seeded.count());
        keep_particles(p, own.begin, own.end);
    }
    Built<D> built{std::move(model), std::move(p), spec.time, std::move(stages), std::move(bodies), std::move(notes)};
    if (share.count == 1) require_runnable(built, alone());
    return built;
}

template <int D>
void require_runnable(const Built<D>& built, Ranks& ranks)
{
    require_outside_obstacles(built.particles, built.model, ranks);
    require_stable(built.time, built.model, built.particles, ranks);
}

#define ORDO_BUILD(D)                                           \
    template Built<D> build(CaseSpec<D>, double, const Share&); \
    template void require_runnable(const Built<D>&, Ranks&);
ORDO_BUILD(1)
ORDO_BUILD(2)
ORDO_BUILD(3)
#undef ORDO_BUILD

}  // namespace ordo::setup
