#include "setup/obstacles.hpp"

#include "method/contact_points.hpp"
#include "setup/conditions.hpp"
#include "setup/contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo::setup {

namespace {

constexpr double kDeep = 0.1;  ///< cells: contact pushes overlaps out over hundreds of steps

[[noreturn]] void fail(std::size_t k, std::string_view key, std::string_view why)
{
    throw SetupError(Part::obstacle, static_cast<int>(k), key, why);
}

template <int D>
void require_solid(const Solid<D>& solid, std::size_t k, const Model<D>& model)
{
    if (const auto* plane = std::get_if<HalfSpace<D>>(&solid)) {
        if (!(std::fabs(norm(plane->normal) - 1) < 1e-9)) fail(k, "normal", "must not be zero");
        for (int a = 0; a < D; ++a)
            if (model.periodic[a] && plane->normal[a] != 0)
                fail(k, "normal",
                     fmt::format("has a component along the periodic axis {}, and the half-space would have an end there",
                                 "xyz"[a]));
    }
    if (const auto* box = std::get_if<Bounds<D>>(&solid))
        for (int a = 0; a < D; ++a)
            if (!(box->lower[a] < box->upper[a])) fail(k, "upper", "must be above lower along each axis");
    if (const auto* ball = std::get_if<Ball<D>>(&solid); ball && !(ball->radius > 0)) fail(k, "radius", "must be positive");
    if (const auto* round = std::get_if<Cylinder<D>>(&solid); round && !(round->radius > 0 && round->height > 0))
        fail(k, round->radius > 0 ? "height" : "radius", "must be positive");
    if (const auto* surface = std::get_if<TriangleSurface>(&solid); surface && surface->triangles().empty())
        fail(k, "file", "holds no triangle with an area");
}

/// Gives an obstacle with mass its centre of mass and inertia.
template <int D>
void set_mass(const ObstacleSpec<D>& spec, std::size_t k, Obstacle<D>& o)
{
    if (!(*spec.mass > 0)) fail(k, "mass", fmt::format("must be positive (got {})", *spec.mass));
    const auto bulk = bulk_of<D>(o.solid);
    if (const auto* surface = std::get_if<TriangleSurface>(&o.solid); surface && !bulk)
        fail(k, "mass",
             surface->is_closed()
                 ? std::string("cannot be: the surface is inside out; turn its triangles over")
                 : fmt::format("cannot be: the surface has {} open edges, so it has no volume; close it, or remove mass "
                               "and give its velocity",
                               surface->open_edges()));
    if (!bulk) fail(k, "mass", "cannot be with a half-space, which has no end; take a box, or remove mass and give its velocity");
    if (spec.center && norm(*spec.center - bulk->center) > 1e-9 * norm(bounds_of<D>(o.solid).upper - bounds_of<D>(o.solid).lower))
        fail(k, "center", "cannot be with mass: what forces move turns about its centre of mass; remove it");
    o.center = bulk->center;
    for (int a = 0; a < D; ++a) o.inverse_mass[a] = spec.held[a] ? 0.0 : 1 / *spec.mass;
    if (!spec.holds_spin) {
        const Mat<3> inertia = (*spec.mass / bulk->volume) * bulk->inertia;
        if constexpr (D == 3)
            o.inverse_inertia = inverse(inertia);
        else
            o.inverse_inertia(2, 2) = 1 / inertia(2, 2);
    }
    if (!o.is_moved()) fail(k, "held", "holds all motion, so mass has no effect; remove both");
}

template <int D>
Obstacle<D> obstacle_of(const ObstacleSpec<D>& spec, std::size_t k, const Model<D>& model)
{
    require_solid(spec.solid, k, model);
    Obstacle<D> r{.name     = spec.contact.name.empty() ? fmt::format("obstacle_{}", k) : spec.contact.name,
                  .solid    = spec.solid,
                  .velocity = spec.velocity,
                  .spin     = spec.spin};
    r.center     = spec.center.value_or(middle_of<D>(r.solid));
    bool is_held = spec.holds_spin;
    for (int a = 0; a < D; ++a) is_held = is_held || spec.held[a];
    if (is_held && !spec.mass) fail(k, "held", "needs mass; without it all motion is as given");
    if (spec.mass) set_mass(spec, k, r);
    for (int a = 0; a < D; ++a)
        if (r.is_free(a) && !spec.velocity[static_cast<std::size_t>(a)].is_constant())
            fail(k, "velocity",
                 "must be numbers with mass, for it is that at the start; to prescribe components, name their axes in held");
    for (const Field& f : spec.spin)
        if (r.turns_freely() && !f.is_constant())
            fail(k, "rotation",
                 "must be numbers with mass, for it is that at the start; to prescribe it, name \"rotation\" in held");
    if (const auto* plane = std::get_if<HalfSpace<D>>(&r.solid)) {
        const Vec<3> n = padded(plane->normal);
        for (int a = 0; a < D; ++a)  // the component of spin x normal along it
            for (const int b : {(a + 1) % 3, (a + 2) % 3})
                if (model.periodic[a] && !spec.spin[static_cast<std::size_t>(b)].is_zero() && n[3 - a - b] != 0)
                    fail(k, "rotation", "turns a half-space into a periodic axis, where it would have an end; use a box");
    }
    const ObstacleMotion<D> start = start_of(r, 0.0);
    require_finite(start.velocity, Part::obstacle, static_cast<int>(k), "velocity", r.center);
    for (int a = 0; a < 3; ++a)
        if (!std::isfinite(start.spin[a])) fail(k, "rotation", fmt::format("is {} at t = 0", start.spin[a]));
    return r;
}

[[noreturn]] void fail_deep(int k, const std::string& obstacle, double depth)
{
    throw SetupError(
        Part::body, k, "shape",
        fmt::format("begins {:.3g} m deep in obstacle \"{}\", which would push it out over many steps; move one of them", depth,
                    obstacle));
}

}  // namespace

template <int D>
void set_up_obstacles(const CaseSpec<D>& spec, Model<D>& model)
{
    const std::size_t count = spec.bodies.size();
    for (std::size_t k = 0; k < spec.obstacles.size(); ++k) {
        const ObstacleSpec<D>& one = spec.obstacles[k];
        const ContactSpec& c       = one.contact;
        if (const char* why = refusal_of_contact(spec.method, D, true)) fail(k, "shape", why);
        require_law(c, Part::obstacle, k, count);
        if (!has_faces(spec.method) && c.type == ContactType::tied)
            fail(k, "type", "\"tied\" needs bodies with faces: use cpdi1, cpdi2, or type \"no-slip\"");
        if (!has_faces(spec.method) && c.on_faces)
            fail(k, "points", "\"faces\" needs bodies with faces: use cpdi1, cpdi2, or points \"vertices\"");
        model.obstacles.push_back(obstacle_of(one, k, model));
        for (const int b : bodies_of(c, count)) {
            if (has_faces(spec.method)) require_faces(spec, b, Part::obstacle, k);
            ContactPair<D> pair = pair_of(spec, c, b, -1);
            pair.surface        = {has_faces(spec.method) ? b : -1, -1};
            pair.name           = model.obstacles.back().name;
            pair.obstacle       = static_cast<int>(k);
            model.contacts.push_back(std::move(pair));
        }
    }
}

template <int D>
bool needs_surfaces(const Model<D>& model)
{
    return std::any_of(model.contacts.begin(), model.contacts.end(), [](const ContactPair<D>& c) { return c.surface[0] >= 0; });
}

template <int D>
void settle_on_obstacle(Model<D>& model, int k, const std::vector<std::vector<Vec<D>>>& vertices)
{
    if constexpr (D > 1) {
        ContactPair<D>& pair = model.contacts[k];
        if (pair.surface[0] < 0) return;
        const double h              = *std::min_element(model.h.c, model.h.c + D);
        const Obstacle<D>& obstacle = model.obstacles[pair.obstacle];
        const auto& surface         = model.surfaces[pair.surface[0]];
        const auto& x               = vertices[pair.surface[0]];
        if (const double depth = depth_in(obstacle, surface, x, h, period_of(model)); depth > kDeep * h)
            fail_deep(pair.body, obstacle.name, depth);
        if (pair.type == ContactType::tied)
            pair.tied = find_tied_points(k, pair.on_faces, obstacle, surface, x, 0.05 * h, period_of(model));
    }
}

template <int D>
void require_outside_obstacles(const Particles<D>& p, const Model<D>& model, Ranks& ranks)
{
    const double h = *std::min_element(model.h.c, model.h.c + D);
    for (const ContactPair<D>& pair : model.contacts) {
        if (pair.obstacle < 0) continue;
        const Obstacle<D>& obstacle = model.obstacles[pair.obstacle];
        double depth                = 0.0;
        if constexpr (D > 1) depth = largest(ranks, depth_in(obstacle, p, pair.body, 2 * h, period_of(model)));
        if (depth > kDeep * h) fail_deep(pair.body, obstacle.name, depth);
    }
}

#define ORDO_OBSTACLES(D)                                                                      \
    template void set_up_obstacles(const CaseSpec<D>&, Model<D>&);                             \
    template bool needs_surfaces(const Model<D>&);                                             \
    template void settle_on_obstacle(Model<D>&, int, const std::vector<std::vector<Vec<D>>>&); \
    template void require_outside_obstacles(const Particles<D>&, const Model<D>&, Ranks&);
ORDO_OBSTACLES(1)
ORDO_OBSTACLES(2)
ORDO_OBSTACLES(3)
#undef ORDO_OBSTACLES

}  // namespace ordo::setup
