#include "setup/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace ordo::setup {

namespace {

/// Whether a plane across an axis is a face of the grid that a wall or a period closes.
template <int D>
bool is_closed(const Model<D>& model, int axis, bool above, double at)
{
    if (std::fabs(at - model.face(axis, above)) > 1e-9 * model.h[axis]) return false;
    return model.periodic[axis] || std::any_of(model.conditions.begin(), model.conditions.end(), [&](const Condition<D>& b) {
               return b.is_plane() && b.axis == axis && b.outer_is_above == above && !is_inner_plane(model, b);
           });
}

/// Collects the level sets of a surface.
template <int D>
struct Surface {
    const Model<D>& model;
    std::vector<LevelSet<D>> sets{};

    void add_plane(const Vec<D>& normal, const Vec<D>& through)
    {
        for (int a = 0; a < D; ++a)
            if (std::fabs(normal[a]) > 1 - 1e-12 && is_closed(model, a, normal[a] > 0, through[a])) return;
        sets.push_back([normal, through](const Vec<D>& X) { return dot(normal, X - through); });
    }

    /// The two faces across axis a.
    void add_faces(int a, double lower, double upper)
    {
        Vec<D> normal{}, through{};
        normal[a]  = -1;
        through[a] = lower;
        add_plane(normal, through);
        normal[a]  = 1;
        through[a] = upper;
        add_plane(normal, through);
    }

    void add(const Ball<D>& ball)
    {
        if constexpr (D == 1)
            add_faces(0, ball.center[0] - ball.radius, ball.center[0] + ball.radius);
        else
            sets.push_back([center = ball.center, square = ball.radius * ball.radius](const Vec<D>& X) {
                return dot(X - center, X - center) - square;
            });
    }

    void add(const Tube<D>& tube)
    {
        sets = tube.round_faces();
        if constexpr (D == 3) add_faces(tube.axis, tube.bottom, tube.top);
        if (!(tube.to - tube.from < 2 * std::numbers::pi * (1 - 1e-12))) return;
        if (tube.to - tube.from > std::numbers::pi * (1 + 1e-12))
            throw SetupError(Part::body, 0, "angle",
                             "leaves a notch in the body: with splines fitted to particles a part may have at most 180 degrees");
        for (const auto& [angle, sign] : {std::pair{tube.from, 1.0}, {tube.to, -1.0}}) {
            Vec<D> normal{};
            normal[tube.first()]  = sign * std::sin(angle);
            normal[tube.second()] = -sign * std::cos(angle);
            add_plane(normal, tube.center);
        }
    }
};

}  // namespace

template <int D>
std::vector<LevelSet<D>> free_surface(const BodyShape<D>& shape, const Model<D>& model)
{
    Surface<D> surface{model};
    if (const auto* box = std::get_if<Bounds<D>>(&shape))
        for (int a = 0; a < D; ++a) surface.add_faces(a, box->lower[a], box->upper[a]);
    if (const auto* ball = std::get_if<Ball<D>>(&shape)) surface.add(*ball);
    if (const auto* polar = std::get_if<PolarBall<D>>(&shape)) surface.add(polar->ball);
    if constexpr (D >= 2)
        if (const auto* tube = std::get_if<TubeShape<D>>(&shape)) surface.add(tube->tube);
    return std::move(surface.sets);
}

template std::vector<LevelSet<1>> free_surface(const BodyShape<1>&, const Model<1>&);
template std::vector<LevelSet<2>> free_surface(const BodyShape<2>&, const Model<2>&);
template std::vector<LevelSet<3>> free_surface(const BodyShape<3>&, const Model<3>&);

}  // namespace ordo::setup
