// Rings and tubes of polar particle cells, and the pressure of a solution on their rims.
#pragma once

#include "verification/measure.hpp"
#include "verification/motions.hpp"

#include <algorithm>
#include <cmath>

namespace ordo::verification {

/// Whether a material point lies in a tube.
template <int D>
std::function<bool(const Vec<D>&)> inside(const Tube<D>& tube)
{
    return [tube](const Vec<D>& X) {
        const double R = std::hypot(X[0], X[1]);
        return R >= tube.inner && R <= tube.outer;
    };
}

/// Cells along `length` metres, at least one.
inline int cells_along(double length, int per_metre) { return std::max(1, static_cast<int>(std::lround(length * per_metre))); }

template <int D>
void fill_tube(Problem<D>& p, const Tube<D>& tube, int radial, int angular, int layers)
{
    p.seeds         = fill_polar(tube, radial, angular, layers);
    p.corners       = polar_cells(tube, radial, angular, layers);
    p.model.surface = tube.round_faces();
    p.contains      = inside(tube);
}

/// The planes x = 0 and y = 0 are frictionless.
template <int D>
void add_symmetry_planes(Problem<D>& p)
{
    p.model.conditions.push_back({.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
    p.model.conditions.push_back({.axis = 1, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
}

/// Pressure on the rims: traction 0 acts on the inner, 1 on the outer one.
template <int D>
void load_rims(Problem<D>& p, const Field& inner, const Field& outer)
{
    for (const Field& pressure : {inner, outer}) {
        p.model.tractions.push_back({.type = TractionType::pressure, .value = {}});
        p.model.tractions.back().value[0] = pressure;
    }
    p.load = [](const Vec<D>& normal, const Vec<D>& center) {
        const double along = (normal[0] * center[0] + normal[1] * center[1]) / std::hypot(center[0], center[1]);
        return along < -0.5 ? 0 : along > 0.5 ? 1 : -1;
    };
}

/// The pressure of the solution: the radial stress where the rim of initial radius R meets the x axis.
template <int D>
Field exact_pressure(const Problem<D>& p, double R)
{
    Vec<D> rim{};
    rim[0] = R;
    return Field([rim, solution = p.solution](const FieldPoint& at) { return -solution->stress(rim, at.t)(0, 0); });
}

}  // namespace ordo::verification
