#include "setup/inside.hpp"

#include "method/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(int k, std::string_view why) { throw SetupError(Part::body, k, "shape", why); }

template <int D>
Bounds<D> nothing()
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    return {Vec<D>::filled(infinity), Vec<D>::filled(-infinity)};
}
template <int D>
void add(Bounds<D>& to, const Vec<D>& x, const Vec<D>& reach)
{
    for (int a = 0; a < D; ++a) {
        to.lower[a] = std::min(to.lower[a], x[a] - reach[a]);
        to.upper[a] = std::max(to.upper[a], x[a] + reach[a]);
    }
}

/// The bounding box of a body: of its mesh, else of the domains of its seeds.
template <int D>
Bounds<D> box_of(const Filling<D>& body)
{
    if (body.mesh.corners.empty()) return bounds_of(std::vector<SeedWalk<D>>{body.walk})[0];
    Bounds<D> r = nothing<D>();
    for (const Vec<D>& x : body.mesh.corners) add(r, x, {});
    return r;
}

template <int D>
void require_in_periods(const BodySpec<D>& b, int k, const Bounds<D>& bounds, const Model<D>& model)
{
    for (int a = 0; a < D; ++a) {
        if (!model.periodic[a]) continue;
        const double low = model.origin[a], period = model.cells[a] * model.h[a];
        if (!(bounds.upper[a] - bounds.lower[a] <= period * (1 + 1e-6)))
            fail(k, fmt::format("body \"{}\" overlaps itself: it is longer than the period {} of axis {}", b.name, period,
                                "xyz"[a]));
        if (!(bounds.lower[a] >= low - period && bounds.upper[a] <= low + 2 * period))
            fail(k, fmt::format("body \"{}\" lies outside the grid and the adjacent periods: it runs from {:.6g} to {:.6g} "
                                "along axis {}, the grid from {} to {}; move the body",
                                b.name, bounds.lower[a], bounds.upper[a], "xyz"[a], low, low + period));
    }
}

/// Checks a seed on an axis that is not periodic. Polar cells are not their parallelograms: for them, and for meshes, only the
/// centre is checked.
template <int D>
void require_seed_inside(const BodySpec<D>& b, int k, const Seed<D>& s, int a, const Model<D>& model)
{
    const double tolerance = 1e-9 * model.h[a];
    const double reach     = is_polar(b) || is_mesh(b) ? 0.0 : reach_of_domain(s)[a];
    const double low = model.origin[a], high = low + model.cells[a] * model.h[a];
    if (!(s.x[a] - reach >= low - tolerance && s.x[a] + reach <= high + tolerance))
        fail(k, fmt::format("body \"{}\" lies outside the grid: its particle at {} reaches beyond the range {} to {} of axis "
                            "{}; move the body or enlarge [grid] size",
                            b.name, place_text(s.x), low, high, "xyz"[a]));
    for (const Condition<D>& plane : model.conditions)
        if (plane.is_plane() && plane.axis == a &&
            (plane.outer_is_above ? s.x[a] > plane.at + tolerance : s.x[a] < plane.at - tolerance))
            fail(k,
                 fmt::format("body \"{}\" lies beyond the boundary at {} = {}: a particle is at {}; move the body or the plane",
                             b.name, "xyz"[a], plane.at, place_text(s.x)));
}

template <int D>
void require_out_of_walls(const BodySpec<D>& b, int k, const Seed<D>& s, const Model<D>& model)
{
    const double tolerance = 1e-9 * *std::min_element(model.h.c, model.h.c + D);
    for (const Wall<D>& wall : model.walls)
        if (wall.distance(s.x, {}) < -tolerance)
            fail(k, fmt::format(
                        "body \"{}\" lies in a wall: its particle at {} is {:.3g} m inside; move the body or the wall, or let "
                        "the wall's normal point to the other side",
                        b.name, place_text(s.x), -wall.distance(s.x, {})));
}

template <int D>
void require_mesh_inside(const BodySpec<D>& b, int k, const CellMesh<D>& mesh, const Model<D>& model)
{
    for (const Vec<D>& x : mesh.corners)
        for (int a = 0; a < D; ++a) {
            const double low = model.origin[a], high = low + model.cells[a] * model.h[a], tolerance = 1e-9 * model.h[a];
            if (!model.periodic[a] && !(x[a] >= low - tolerance && x[a] <= high + tolerance))
                fail(k,
                     fmt::format("body \"{}\" lies outside the grid: its corner at {} is not in the range {} to {} of axis {}; "
                                 "move the mesh or enlarge [grid] size",
                                 b.name, place_text(x), low, high, "xyz"[a]));
        }
}

}  // namespace

template <int D>
Vec<D> reach_of_domain(const Seed<D>& s)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a)
        for (int d = 0; d < D; ++d) r[a] += std::fabs(s.edges(a, d));
    return r;
}

template <int D>
std::vector<Bounds<D>> bounds_of(const std::vector<SeedWalk<D>>& bodies)
{
    std::vector<Bounds<D>> r(bodies.size(), nothing<D>());
    for_each_seed(bodies, [&](const Seed<D>& s, int k) { add(r[k], s.x, reach_of_domain(s)); });
    return r;
}

template <int D>
bool is_near_another(const Vec<D>& x, const Vec<D>& reach, int body, const std::vector<Bounds<D>>& bounds)
{
    for (std::size_t k = 0; k < bounds.size(); ++k) {
        bool meets = static_cast<int>(k) != body;
        for (int a = 0; a < D; ++a) meets = meets && x[a] + reach[a] > bounds[k].lower[a] && x[a] - reach[a] < bounds[k].upper[a];
        if (meets) return true;
    }
    return false;
}

template <int D>
void require_near(const BodySpec<D>& b, int k, const Bounds<D>& bounds, const Model<D>& model)
{
    for (int a = 0; a < D; ++a) {
        const double length = model.cells[a] * model.h[a], around = model.periodic[a] ? length : 0.0;
        const double low = model.origin[a] - around, high = model.origin[a] + length + around;
        if (!(bounds.upper[a] >= low && bounds.lower[a] <= high))
            fail(k, fmt::format("body \"{}\" lies outside the grid: it runs from {:.6g} to {:.6g} along axis {}, but must meet "
                                "the range {} to {}; move the body or enlarge [grid] size",
                                b.name, bounds.lower[a], bounds.upper[a], "xyz"[a], low, high));
    }
}

template <int D>
void require_inside(const BodySpec<D>& b, int k, const Filling<D>& filling, const Model<D>& model)
{
    require_in_periods(b, k, box_of(filling), model);
    filling.walk([&](const Seed<D>& s) {
        for (int a = 0; a < D; ++a)
            if (!model.periodic[a]) require_seed_inside(b, k, s, a, model);
    });
    if (!model.walls.empty()) filling.walk([&](const Seed<D>& s) { require_out_of_walls(b, k, s, model); });
    require_mesh_inside(b, k, filling.mesh, model);
}

#define ORDO_INSIDE(D)                                                                               \
    template Vec<D> reach_of_domain(const Seed<D>&);                                                 \
    template std::vector<Bounds<D>> bounds_of(const std::vector<SeedWalk<D>>&);                      \
    template bool is_near_another(const Vec<D>&, const Vec<D>&, int, const std::vector<Bounds<D>>&); \
    template void require_near(const BodySpec<D>&, int, const Bounds<D>&, const Model<D>&);          \
    template void require_inside(const BodySpec<D>&, int, const Filling<D>&, const Model<D>&);
ORDO_INSIDE(1)
ORDO_INSIDE(2)
ORDO_INSIDE(3)
#undef ORDO_INSIDE

}  // namespace ordo::setup
