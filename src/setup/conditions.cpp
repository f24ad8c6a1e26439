#include "setup/conditions.hpp"

#include "method/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(int k, std::string_view key, std::string_view why) { throw SetupError(Part::boundary, k, key, why); }

/// Prescribed values must be numbers where they are asked for: on the nodes of the plane or in the region; of two axes
/// 1000 along each are asked.
template <int D>
void require_finite_values(const Condition<D>& b, int k, const Model<D>& model)
{
    Index<D> n{}, step{};
    for (int a = 0; a < D; ++a) {
        step[a] = D < 3 ? 1 : model.cells[a] / 1000 + 1;
        n[a]    = b.is_plane() && a == b.axis ? 1 : model.cells[a] / step[a] + 1;
    }
    IndexBox<D>{{}, n}.for_each([&](const Index<D>& at) {
        Vec<D> x{}, value{};
        for (int a = 0; a < D; ++a) x[a] = b.is_plane() && a == b.axis ? b.at : model.origin[a] + at[a] * step[a] * model.h[a];
        if (!b.is_plane() && !b.covers(x, model.h)) return;
        for (int a = 0; a < D; ++a)
            if (b.value[a]) value[a] = (*b.value[a])({padded(x), padded(x), 0.0});
        require_finite(value, Part::boundary, k, "value", x);
    });
}

ConditionType type_of(FaceType type)
{
    switch (type) {
    case FaceType::symmetry: return ConditionType::symmetry;
    case FaceType::velocity: return ConditionType::velocity;
    case FaceType::displacement: return ConditionType::displacement;
    case FaceType::fixed:
    case FaceType::wall:
    case FaceType::periodic:
    case FaceType::free: break;
    }
    return ConditionType::fixed;
}

/// Whether a place lies in a region or, up to a small part of a cell, on its surface.
template <int D>
std::function<bool(const Vec<D>&)> inside(const Region<D>& region, double tolerance)
{
    if (const auto* box = std::get_if<Bounds<D>>(&region))
        return [box = *box, tolerance](const Vec<D>& x) {
            for (int a = 0; a < D; ++a)
                if (!(x[a] >= box.lower[a] - tolerance && x[a] <= box.upper[a] + tolerance)) return false;
            return true;
        };
    if (const auto* given = std::get_if<Ball<D>>(&region)) {
        Ball<D> ball = *given;
        ball.radius += tolerance;
        return [ball](const Vec<D>& x) { return ball.contains(x); };
    }
    Tube<D> tube = std::get<Tube<D>>(region);
    tube.inner   = std::max(0.0, tube.inner - tolerance);
    tube.outer += tolerance;
    tube.bottom -= tolerance;
    tube.top += tolerance;
    return [tube](const Vec<D>& x) { return tube.contains(x); };
}

/// The wall of a boundary; its velocity must be a number at t = 0.
template <int D>
Wall<D> wall_of(const BoundarySpec<D>& b, int k, const Model<D>& model)
{
    Wall<D> r{.point = b.point, .normal = {}, .velocity = {}, .friction = b.friction, .boundary = k};
    if (b.normal) {
        const double length = norm(*b.normal);
        if (!(length > 0)) fail(k, "normal", "must not be zero; it points out of the wall");
        r.normal = (1 / length) * *b.normal;
    } else {
        r.normal[b.axis] = b.is_above ? -1.0 : 1.0;
        r.point[b.axis]  = b.at.value_or(model.face(b.axis, b.is_above));
    }
    if (!(b.friction >= 0 && std::isfinite(b.friction)))
        fail(k, "friction", fmt::format("must not be negative (got {})", b.friction));
    if (model.walls.size() == Wall<D>::most) fail(k, "type", fmt::format("there are more than {} walls", Wall<D>::most));
    for (int a = 0; a < D; ++a)
        if (b.value[a]) r.velocity[a] = *b.value[a];
    require_finite(r.velocity_at(0.0), Part::boundary, k, "value", r.point);
    return r;
}

template <int D>
void require_region(const Region<D>& region, int k)
{
    if (const auto* box = std::get_if<Bounds<D>>(&region))
        for (int a = 0; a < D; ++a)
            if (!(box->lower[a] < box->upper[a]))
                fail(k, "region",
                     fmt::format("has lower {} and upper {} along {}; lower must be smaller", box->lower[a], box->upper[a],
                                 "xyz"[a]));
    if (const auto* tube = std::get_if<Tube<D>>(&region); tube && !(tube->inner < tube->outer))
        fail(k, "region",
             fmt::format("has the inner radius {} and the radius {}; the inner must be smaller", tube->inner, tube->outer));
}

template <int D>
void require_place(const BoundarySpec<D>& b, int k, const CaseSpec<D>& spec)
{
    if ((b.region || b.body) && !moves_nodes(b.type) && b.type != FaceType::fixed)
        fail(k, "type", "with a region or a body must be \"fixed\", \"velocity\" or \"displacement\"");
    if (b.body && !(*b.body >= 0 && *b.body < static_cast<int>(spec.bodies.size())))
        fail(k, "body", fmt::format("there is no body {}", *b.body));
    if (b.region) require_region(*b.region, k);
    if (!b.is_on_plane()) return;
    if (!(b.axis >= 0 && b.axis < D)) fail(k, "face", fmt::format("axis {} does not exist in {}D", b.axis, D));
    if (!b.at) return;
    const double low = spec.origin[b.axis], high = low + spec.size[b.axis];
    if (!(*b.at >= low && *b.at <= high))
        fail(k, "at", fmt::format("the plane {} lies outside the grid, {} to {}", *b.at, low, high));
    if (b.type == FaceType::periodic) fail(k, "at", "has no meaning for a periodic axis; remove it");
}

}  // namespace

template <int D>
void require_finite(const Vec<D>& value, Part part, int index, std::string_view key, const Vec<D>& at)
{
    for (int a = 0; a < D; ++a)
        if (!std::isfinite(value[a]))
            throw SetupError(part, index, key,
                             fmt::format("is {} at {}, t = 0; the expression must give a number everywhere", std::fabs(value[a]),
                                         place_text(at)),
                             a);
}

template <int D>
void set_up_conditions(const CaseSpec<D>& spec, Model<D>& model)
{
    for (std::size_t n = 0; n < spec.boundaries.size(); ++n) {
        const BoundarySpec<D>& b = spec.boundaries[n];
        const int k              = static_cast<int>(n);
        require_place(b, k, spec);
        if (b.type == FaceType::periodic) model.periodic[b.axis] = true;
        if (b.type == FaceType::periodic || b.type == FaceType::free) continue;
        if (b.type == FaceType::wall) {
            model.walls.push_back(wall_of(b, k, model));
            continue;
        }
        Condition<D> r{.axis           = b.axis,
                       .outer_is_above = b.is_above,
                       .at             = b.at.value_or(model.face(b.axis, b.is_above)),
                       .type           = type_of(b.type),
                       .value          = b.value,
                       .body           = b.body,
                       .boundary       = k};
        if (b.region) r.region = inside(*b.region, 1e-9 * *std::min_element(model.h.c, model.h.c + D));
        if (r.is_prescribed()) require_finite_values(r, k, model);
        if (is_inner_plane_of_splines(model, r))
            fail(k, "at",
                 fmt::format("the plane {} = {} lies inside the grid, where splines do not interpolate: a wall there "
                             "would be wrong by up to a cell; let the grid end there, or use basis \"hat\"",
                             "xyz"[b.axis], r.at));
        model.conditions.push_back(std::move(r));
    }
    for (std::size_t n = 0; n < spec.boundaries.size(); ++n) {
        const BoundarySpec<D>& b = spec.boundaries[n];
        for (int a = 0; a < D && b.normal; ++a)
            if (model.periodic[a] && (*b.normal)[a] != 0.0)
                fail(static_cast<int>(n), "normal", fmt::format("must have no component along the periodic axis {}", "xyz"[a]));
        if (!b.is_on_plane()) continue;
        if (b.type != FaceType::periodic && model.periodic[b.axis])
            fail(static_cast<int>(n), "face",
                 fmt::format("{} belongs to a periodic axis, which has no faces; remove one of the two entries",
                             face_name(b.axis, b.is_above)));
    }
}

template void set_up_conditions(const CaseSpec<1>&, Model<1>&);
template void set_up_conditions(const CaseSpec<2>&, Model<2>&);
template void set_up_conditions(const CaseSpec<3>&, Model<3>&);
template void require_finite(const Vec<1>&, Part, int, std::string_view, const Vec<1>&);
template void require_finite(const Vec<2>&, Part, int, std::string_view, const Vec<2>&);
template void require_finite(const Vec<3>&, Part, int, std::string_view, const Vec<3>&);

}  // namespace ordo::setup
