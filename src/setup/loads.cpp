#include "setup/loads.hpp"

#include "method/place.hpp"
#include "setup/true_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(std::size_t t, std::string_view key, std::string_view why)
{
    throw SetupError(Part::traction, static_cast<int>(t), key, why);
}

/// The reference for inner and outer faces: a center, or in 3D the axis through it if there is one.
template <int D>
struct Middle {
    std::optional<Vec<D>> center{};
    std::optional<int> axis{};

    /// The vector from the middle to the centre of a face.
    Vec<D> arm(const Vec<D>& face) const
    {
        Vec<D> r = center ? face - *center : face;
        if (D == 3 && axis) r[*axis] = 0.0;
        return r;
    }
};

template <int D>
Middle<D> middle_of(const BodyShape<D>& shape)
{
    if (const auto* ball = std::get_if<Ball<D>>(&shape)) return {ball->center, {}};
    if (const auto* ball = std::get_if<PolarBall<D>>(&shape)) return {ball->ball.center, {}};
    if (const auto* tube = std::get_if<TubeShape<D>>(&shape)) return {tube->tube.center, tube->tube.axis};
    if (const auto* mesh = std::get_if<MeshShape<D>>(&shape)) return {mesh->center, mesh->axis};
    return {};
}

/// Whether a face looks in the direction `where`.
template <int D>
bool looks(const BodyFace& where, const Vec<D>& normal, const Vec<D>& from_center)
{
    if (where.kind == BodyFace::all) return true;
    if (where.kind != BodyFace::along_axis) {
        const double cosine = dot(normal, from_center) / norm(from_center);
        return where.kind == BodyFace::inner ? cosine < -0.01 : cosine > 0.01;  // all stairs of a round body, no cut of a sector
    }
    const double along = normal[where.axis];
    for (int a = 0; a < D; ++a)
        if (std::fabs(normal[a]) > std::fabs(along) * (1 + 1e-9)) return false;
    return (along > 0) == where.is_above;
}

template <int D>
Bounds<D> extent_of(const CellMesh<D>& mesh)
{
    Bounds<D> extent{mesh.corners[0], mesh.corners[0]};
    for (const Vec<D>& x : mesh.corners)
        for (int a = 0; a < D; ++a) {
            extent.lower[a] = std::min(extent.lower[a], x[a]);
            extent.upper[a] = std::max(extent.upper[a], x[a]);
        }
    return extent;
}

/// The ends of a body that fills a periodic axis meet: they are no surface.
template <int D>
bool is_on_seam(const Model<D>& model, const Bounds<D>& extent, const Vec<D>& normal, const Vec<D>& center)
{
    for (int a = 0; a < D; ++a) {
        const double tolerance = 1e-9 * model.h[a], period = model.cells[a] * model.h[a];
        if (model.periodic[a] && extent.upper[a] - extent.lower[a] > period - tolerance && std::fabs(normal[a]) > 1 - 1e-9 &&
            (center[a] < extent.lower[a] + tolerance || center[a] > extent.upper[a] - tolerance))
            return true;
    }
    return false;
}

template <int D>
void require_value(const VectorField<D>& value, std::size_t t, const Vec<D>& center)
{
    for (const Field& component : value)
        if (const double start = component({padded(center), padded(center), 0.0}); !std::isfinite(start))
            fail(t, "value",
                 fmt::format("is {} at {}, t = 0; the expression must give a number everywhere", std::fabs(start),
                             place_text(center)));
}

}  // namespace

template <int D>
void require_faces(const std::vector<TractionSpec<D>>& tractions, const std::vector<BodySpec<D>>& bodies)
{
    for (std::size_t t = 0; t < tractions.size(); ++t) {
        const TractionSpec<D>& traction = tractions[t];
        if (!(traction.body >= 0 && traction.body < static_cast<int>(bodies.size())))
            fail(t, "body", fmt::format("there is no body {}", traction.body));
        const BodySpec<D>& body = bodies[traction.body];
        if (traction.faces.empty()) fail(t, "face", "must name at least one face");
        if (std::holds_alternative<std::vector<Seed<D>>>(body.shape))
            fail(t, "body", fmt::format("body \"{}\" is a list of particles, whose outer faces are not known", body.name));
        for (const BodyFace& face : traction.faces) {
            const bool is_round = face.kind == BodyFace::inner || face.kind == BodyFace::outer;
            if (is_round && !middle_of(body.shape).center)
                fail(t, "face", fmt::format("\"{}\" needs a body with a center; body \"{}\" has none", face.name(), body.name));
            if (face.kind == BodyFace::along_axis && !(face.axis >= 0 && face.axis < D))
                fail(t, "face", fmt::format("axis {} does not exist in {}D", face.axis, D));
        }
    }
}

template <int D>
void load_faces(const std::vector<TractionSpec<D>>& tractions, const BodySpec<D>& body, int k, const CellMesh<D>& mesh, int first,
                Model<D>& model, Particles<D>& p)
{
    const Bounds<D> extent = extent_of(mesh);
    const Middle<D> middle = middle_of(body.shape);
    const TrueAreas<D> areas(body.shape, mesh);
    for (std::size_t t = 0; t < tractions.size(); ++t) {
        const TractionSpec<D>& traction = tractions[t];
        if (traction.body != k) continue;
        std::vector<bool> found(traction.faces.size(), false);
        auto share = [&](const Vec<D>& normal, const Vec<D>& center) {
            if (is_on_seam(model, extent, normal, center)) return 0.0;
            bool chosen = false;
            for (std::size_t f = 0; f < traction.faces.size(); ++f)
                if (looks(traction.faces[f], normal, middle.arm(center))) chosen = found[f] = true;
            if (chosen) require_value<D>(traction.traction.value, t, center);
            return chosen ? areas.share(normal, center) : 0.0;
        };
        add_loads<D>(model.loads, p, mesh, first, static_cast<int>(t), share);
        for (std::size_t f = 0; f < found.size(); ++f)
            if (!found[f])
                fail(t, "face",
                     fmt::format("body \"{}\" has no face \"{}\"; choose another, or \"all\"", body.name,
                                 traction.faces[f].name()));
    }
}

template void require_faces(const std::vector<TractionSpec<1>>&, const std::vector<BodySpec<1>>&);
template void require_faces(const std::vector<TractionSpec<2>>&, const std::vector<BodySpec<2>>&);
template void require_faces(const std::vector<TractionSpec<3>>&, const std::vector<BodySpec<3>>&);
template void load_faces(const std::vector<TractionSpec<1>>&, const BodySpec<1>&, int, const CellMesh<1>&, int, Model<1>&,
                         Particles<1>&);
template void load_faces(const std::vector<TractionSpec<2>>&, const BodySpec<2>&, int, const CellMesh<2>&, int, Model<2>&,
                         Particles<2>&);
template void load_faces(const std::vector<TractionSpec<3>>&, const BodySpec<3>&, int, const CellMesh<3>&, int, Model<3>&,
                         Particles<3>&);

}  // namespace ordo::setup
