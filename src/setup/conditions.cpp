#include "setup/conditions.hpp"

#include "method/place.hpp"

#include <fmt/format.h>

#include <cmath>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(int k, std::string_view key, std::string_view why) { throw SetupError(Part::boundary, k, key, why); }

/// Prescribed velocities must be numbers on the nodes of their plane; of a plane of two axes 1000 along each are asked.
template <int D>
void require_finite_on_plane(const Condition<D>& b, int k, const Model<D>& model)
{
    Index<D> n{}, step{};
    for (int a = 0; a < D; ++a) {
        step[a] = D < 3 ? 1 : model.cells[a] / 1000 + 1;
        n[a]    = a == b.axis ? 1 : model.cells[a] / step[a] + 1;
    }
    IndexBox<D>{{}, n}.for_each([&](const Index<D>& at) {
        Vec<D> x{}, value{};
        for (int a = 0; a < D; ++a) x[a] = a == b.axis ? b.at : model.origin[a] + at[a] * step[a] * model.h[a];
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
    case FaceType::fixed:
    case FaceType::wall:
    case FaceType::periodic:
    case FaceType::free: break;
    }
    return ConditionType::fixed;
}

/// The wall of a boundary; its velocity must be a number at t = 0.
template <int D>
Wall<D> wall_of(const BoundarySpec<D>& b, int k, const CaseSpec<D>& spec, const Model<D>& model)
{
    Wall<D> r{.point = b.point, .normal = {}, .velocity = {}, .friction = b.friction};
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
    if (spec.method.mass == MassMatrix::consistent)
        fail(k, "type",
             "\"wall\" needs lumped masses, because a consistent mass matrix couples the nodes on both sides of it; use "
             "method.mass = "
             "\"lumped\" where the method allows it, or another method, such as cpdi2");
    if (model.walls.size() == Wall<D>::most) fail(k, "type", fmt::format("there are more than {} walls", Wall<D>::most));
    for (int a = 0; a < D; ++a)
        if (b.value[a]) r.velocity[a] = *b.value[a];
    require_finite(r.velocity_at(0.0), Part::boundary, k, "value", r.point);
    return r;
}

template <int D>
void require_plane(const BoundarySpec<D>& b, int k, const CaseSpec<D>& spec)
{
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
        require_plane(b, k, spec);
        if (b.type == FaceType::periodic) model.periodic[b.axis] = true;
        if (b.type == FaceType::periodic || b.type == FaceType::free) continue;
        if (b.type == FaceType::wall) {
            model.walls.push_back(wall_of(b, k, spec, model));
            continue;
        }
        Condition<D> r{.axis           = b.axis,
                       .outer_is_above = b.is_above,
                       .at             = b.at.value_or(model.face(b.axis, b.is_above)),
                       .type           = type_of(b.type),
                       .value          = {}};
        if (r.type == ConditionType::velocity) {
            r.value = b.value;
            require_finite_on_plane(r, k, model);
        }
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
        if (b.normal) continue;
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
