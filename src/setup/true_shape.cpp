#include "setup/true_shape.hpp"

#include "shape/faces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ordo::setup {

namespace {

constexpr double kPi = std::numbers::pi;

template <int D>
double height_of(const Tube<D>& tube)
{
    return D == 3 ? tube.top - tube.bottom : 1.0;
}

/// The area between the arcs of a tube, across its axis.
template <int D>
double section_of(const Tube<D>& tube)
{
    return (tube.to - tube.from) / 2 * (tube.outer * tube.outer - tube.inner * tube.inner);
}

}  // namespace

template <int D>
std::optional<double> true_volume(const BodyShape<D>& shape)
{
    if (const auto* ball = std::get_if<Ball<D>>(&shape)) {
        const double r = ball->radius;
        return D == 1 ? 2 * r : D == 2 ? kPi * r * r : 4 * kPi / 3 * r * r * r;
    }
    if (const auto* tube = std::get_if<TubeShape<D>>(&shape); tube && !tube->is_polar)
        return section_of(tube->tube) * height_of(tube->tube);
    return {};
}

template <int D>
bool is_cut(const BodyShape<D>& shape, const Vec<D>& center, const std::vector<Vec<D>>& corners)
{
    constexpr double inwards = 1e-6;  // corners on a face that the grid's lines follow are inside
    return std::any_of(corners.begin(), corners.end(), [&](const Vec<D>& corner) {
        const Vec<D> x = corner + inwards * (center - corner);
        if (const auto* ball = std::get_if<Ball<D>>(&shape)) return !ball->contains(x);
        if constexpr (D > 1)
            if (const auto* tube = std::get_if<TubeShape<D>>(&shape)) return !tube->tube.contains(x);
        return false;
    });
}

template <int D>
std::vector<typename TrueAreas<D>::Smooth> TrueAreas<D>::faces_of(const BodyShape<D>& shape)
{
    std::vector<Smooth> r;
    if constexpr (D > 1) {
        if (const auto* ball = std::get_if<Ball<D>>(&shape)) {
            const Vec<D> middle = ball->center;
            const double radius = ball->radius, area = D == 2 ? 2 * kPi * radius : 4 * kPi * radius * radius;
            r.push_back({area, [=](const Vec<D>& x) { return std::fabs(norm(x - middle) - radius); },
                         [=](const Vec<D>& x) { return (1 / norm(x - middle)) * (x - middle); }});
            return r;
        }
        const auto* shaped = std::get_if<TubeShape<D>>(&shape);
        if (!shaped || shaped->is_polar) return r;
        const Tube<D> tube = shaped->tube;
        const auto arm     = [tube](Vec<D> x) {
            x = x - tube.center;
            if (D == 3) x[tube.axis] = 0.0;
            return x;
        };
        const auto direction = [tube](double angle) {
            Vec<D> d{};
            d[tube.first()]  = std::cos(angle);
            d[tube.second()] = std::sin(angle);
            return d;
        };
        for (const auto& [radius, side] : {std::pair{tube.outer, 1.0}, {tube.inner, -1.0}})
            if (radius > 0)
                r.push_back({(tube.to - tube.from) * radius * height_of(tube),
                             [=, radius = radius](const Vec<D>& x) { return std::fabs(norm(arm(x)) - radius); },
                             [=, side = side](const Vec<D>& x) { return (side / norm(arm(x))) * arm(x); }});
        for (const auto& [angle, side] : {std::pair{tube.from, -1.0}, {tube.to, 1.0}}) {
            if (tube.to - tube.from > 2 * kPi * (1 - 1e-12)) break;
            const Vec<D> along = direction(angle), across = side * direction(angle + kPi / 2);
            r.push_back({(tube.outer - tube.inner) * height_of(tube),
                         [=](const Vec<D>& x) { return dot(arm(x), along) > 0 ? std::fabs(dot(arm(x), across)) : norm(arm(x)); },
                         [=](const Vec<D>&) { return across; }});
        }
        for (const auto& [level, side] : {std::pair{tube.bottom, -1.0}, {tube.top, 1.0}}) {
            if (D < 3) break;
            Vec<D> normal{};
            normal[D - 1 < tube.axis ? 0 : tube.axis] = side;
            r.push_back({section_of(tube),
                         [=, side = side, level = level](const Vec<D>& x) { return std::fabs(dot(x, normal) * side - level); },
                         [=](const Vec<D>&) { return normal; }});
        }
    }
    return r;
}

template <int D>
TrueAreas<D>::TrueAreas(const BodyShape<D>& shape, const CellMesh<D>& mesh) : faces_(faces_of(shape))
{
    if (faces_.empty()) return;
    for (const Face<D>& f : outer_faces(mesh)) {
        Vec<D> at[Face<D>::max_corners]{};
        for (int c = 0; c < f.count; ++c) at[c] = mesh.corners[mesh.cells[f.cell][f.corner[c]]];
        const Vec<D> center = face_center(at, f.count), area = face_area(at, f.count);
        Smooth& smooth = faces_[find(area * (1 / norm(area)), center)];
        smooth.stairs += std::max(0.0, dot(area, smooth.normal(center)));
    }
}

template <int D>
std::size_t TrueAreas<D>::find(const Vec<D>& normal, const Vec<D>& center) const
{
    std::size_t best = 0;
    double least     = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < faces_.size(); ++k)
        if (const double d = faces_[k].distance(center); d < least && dot(normal, faces_[k].normal(center)) > 0.01)
            best = k, least = d;
    return best;
}

template <int D>
double TrueAreas<D>::share(const Vec<D>& normal, const Vec<D>& center) const
{
    if (faces_.empty()) return 1.0;
    const Smooth& smooth = faces_[find(normal, center)];
    return smooth.stairs > 0 ? std::max(0.0, dot(normal, smooth.normal(center))) * smooth.area / smooth.stairs : 0.0;
}

#define ORDO_TRUE_SHAPE(D)                                                                \
    template std::optional<double> true_volume(const BodyShape<D>&);                      \
    template bool is_cut(const BodyShape<D>&, const Vec<D>&, const std::vector<Vec<D>>&); \
    template class TrueAreas<D>;
ORDO_TRUE_SHAPE(1)
ORDO_TRUE_SHAPE(2)
ORDO_TRUE_SHAPE(3)
#undef ORDO_TRUE_SHAPE

}  // namespace ordo::setup
