// Gauss points in the part of a box that lies inside a body, on lines across its surface that are split where they meet it
// (Saye 2015, SIAM J. Sci. Comput. 37, A993). The surface is the zero set of smooth functions.
#pragma once

#include "base/field.hpp"
#include "base/gauss_rule.hpp"
#include "base/index.hpp"
#include "base/vec.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ordo {

/// How much of a cell is inside a body.
enum class Cover : unsigned char { none, part, all };

namespace cut {

/// How often a box is halved at most if the surface is not a graph over one of its faces, or if two parts of the surface meet
/// in it. The smallest boxes get one point at their centre.
constexpr int kHalvings = 6;

/// The point with coordinate `value` on axis k and the coordinates x on the other axes.
template <int D>
Vec<D> with_axis(const Vec<D - 1>& x, int k, double value)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = a == k ? value : x[a - (a > k)];
    return r;
}
template <int D>
Vec<D - 1> without_axis(const Vec<D>& x, int k)
{
    Vec<D - 1> r{};
    for (int a = 0; a < D - 1; ++a) r[a] = x[a + (a >= k)];
    return r;
}

/// A root of f between a and b, by the Illinois method (Dowell & Jarratt 1971).
template <class F>
double root_between(const F& f, double a, double b, double f_a, double f_b)
{
    const double tolerance = 1e-15 * std::fabs(b - a);
    double x = a, before = b;
    for (int step = 0; step < 100 && std::fabs(x - before) > tolerance; ++step) {
        before           = x;
        x                = (a * f_b - b * f_a) / (f_b - f_a);
        const double f_x = f(x);
        if (f_x == 0) break;
        if ((f_x < 0) != (f_b < 0)) {
            a   = b;
            f_a = f_b;
        } else {
            f_a *= 0.5;
        }
        b   = x;
        f_b = f_x;
    }
    return x;
}

/// Bounds on a function in a box, estimated from samples.
template <int D>
struct Signs {
    bool vanishes    = true;  ///< it may have a zero there
    Vec<D> steepness = {};    ///< on each axis the least slope over the largest gradient; 0 if the slope changes sign

    Signs(const LevelSet<D>& f, const Vec<D>& lower, const Vec<D>& upper)
    {
        constexpr int parts = 2;
        Vec<D> least{}, most{};
        double steepest = 0.0, nearest = HUGE_VAL, half_diagonal = 0.0;
        bool is_first = true;
        for (int a = 0; a < D; ++a) half_diagonal += 0.25 * (upper[a] - lower[a]) * (upper[a] - lower[a]) / (parts * parts);
        half_diagonal = std::sqrt(half_diagonal);
        IndexBox<D>{{}, Index<D>::filled(parts + 1)}.for_each([&](const Index<D>& k) {
            Vec<D> x{}, slope{};
            for (int a = 0; a < D; ++a) x[a] = lower[a] + (upper[a] - lower[a]) * k[a] / parts;
            nearest       = std::min(nearest, std::fabs(f(x)));
            double square = 0.0;
            for (int a = 0; a < D; ++a) {
                const double step = 1e-4 * (upper[a] - lower[a]);
                Vec<D> ahead = x, behind = x;
                ahead[a] += step;
                behind[a] -= step;
                slope[a] = (f(ahead) - f(behind)) / (2 * step);
                square += slope[a] * slope[a];
                least[a] = is_first ? slope[a] : std::min(least[a], slope[a]);
                most[a]  = is_first ? slope[a] : std::max(most[a], slope[a]);
            }
            steepest = std::max(steepest, std::sqrt(square));
            is_first = false;
        });
        vanishes = nearest <= 1.5 * steepest * half_diagonal;
        for (int a = 0; a < D; ++a)
            steepness[a] = least[a] * most[a] <= 0 ? 0.0 : std::min(std::fabs(least[a]), std::fabs(most[a])) / steepest;
    }
};

/// The ends of an interval and the roots of the functions in it, sorted.
inline std::vector<double> edges_of_parts(const std::vector<LevelSet<1>>& functions, double lower, double upper)
{
    constexpr int parts       = 4;  // subintervals searched for roots
    std::vector<double> edges = {lower, upper};
    for (const LevelSet<1>& f : functions) {
        auto g    = [&](double x) { return f(Vec<1>{x}); };
        double x0 = lower, f0 = g(x0);
        for (int k = 1; k <= parts; ++k) {
            const double x1 = lower + (upper - lower) * k / parts, f1 = g(x1);
            if ((f0 < 0) != (f1 < 0)) edges.push_back(root_between(g, x0, x1, f0, f1));
            x0 = x1;
            f0 = f1;
        }
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

/// The functions that may vanish in a box, and the least of their values of `steepness` on each axis.
template <int D>
struct Surfaces {
    std::vector<LevelSet<D>> functions;
    Vec<D> steepness = Vec<D>::filled(1.0);

    Surfaces(const std::vector<LevelSet<D>>& all, const Vec<D>& lower, const Vec<D>& upper)
    {
        for (const LevelSet<D>& f : all) {
            const Signs<D> signs(f, lower, upper);
            if (!signs.vanishes) continue;
            functions.push_back(f);
            for (int a = 0; a < D; ++a) steepness[a] = std::min(steepness[a], signs.steepness[a]);
        }
    }
    int steepest_axis() const
    {
        int axis = 0;
        for (int a = 1; a < D; ++a)
            if (steepness[a] > steepness[axis]) axis = a;
        return axis;
    }
    /// Whether the surface is a graph over the faces normal to this axis.
    bool is_graph(int axis) const { return !(steepness[axis] < 0.2 || functions.size() > 1); }
};

/// use(x, weight) at the Gauss points of a whole box.
template <int D, class Use>
void for_each_point_of_box(const std::vector<GaussPoint>& rule, const Vec<D>& lower, const Vec<D>& upper, const Use& use)
{
    IndexBox<D>{{}, Index<D>::filled(static_cast<int>(rule.size()))}.for_each([&](const Index<D>& k) {
        Vec<D> x{};
        double weight = 1.0;
        for (int a = 0; a < D; ++a) {
            const auto [at, part] = rule[k[a]];
            const double length   = upper[a] - lower[a];
            x[a]                  = lower[a] + at * length;
            weight *= part * length;
        }
        use(x, weight);
    });
}

/// use(lower, upper) for the 2^D halves of a box.
template <int D, class Use>
void for_each_half(const Vec<D>& lower, const Vec<D>& upper, const Use& use)
{
    const Vec<D> middle = 0.5 * (lower + upper);
    IndexBox<D>{{}, Index<D>::filled(2)}.for_each([&](const Index<D>& k) {
        Vec<D> lo{}, hi{};
        for (int a = 0; a < D; ++a) {
            lo[a] = k[a] ? middle[a] : lower[a];
            hi[a] = k[a] ? upper[a] : middle[a];
        }
        use(lo, hi);
    });
}

template <int D, class Use>
void for_each_point_of_parts(const std::vector<LevelSet<D>>& functions, const Vec<D>& lower, const Vec<D>& upper, int points,
                             int halvings, const Use& use);

/// use(x, weight) at Gauss points on lines parallel to an axis that cross the surface. The rule for the feet of the lines is
/// split where the surface meets the two faces at the ends of the lines.
template <int D, class Use>
void for_each_point_of_lines(const std::vector<LevelSet<D>>& functions, int axis, const Vec<D>& lower, const Vec<D>& upper,
                             int points, int halvings, const Use& use)
{
    std::vector<LevelSet<D - 1>> at_faces;
    for (const LevelSet<D>& f : functions)
        for (const double end : {lower[axis], upper[axis]})
            at_faces.push_back([&f, axis, end](const Vec<D - 1>& x) { return f(with_axis<D>(x, axis, end)); });
    for_each_point_of_parts<D - 1>(at_faces, without_axis<D>(lower, axis), without_axis<D>(upper, axis), points, halvings,
                                   [&](const Vec<D - 1>& foot, double of_foot) {
                                       std::vector<LevelSet<1>> on_line;
                                       for (const LevelSet<D>& f : functions)
                                           on_line.push_back([&](const Vec<1>& y) { return f(with_axis<D>(foot, axis, y[0])); });
                                       for_each_point_of_parts<1>(on_line, Vec<1>{lower[axis]}, Vec<1>{upper[axis]}, points,
                                                                  halvings, [&](const Vec<1>& y, double weight) {
                                                                      use(with_axis<D>(foot, axis, y[0]), of_foot * weight);
                                                                  });
                                   });
}

/// use(x, weight) at Gauss points of the parts into which the zero sets of the functions cut a box.
template <int D, class Use>
void for_each_point_of_parts(const std::vector<LevelSet<D>>& functions, const Vec<D>& lower, const Vec<D>& upper, int points,
                             int halvings, const Use& use)
{
    const std::vector<GaussPoint> rule = gauss_rule(points);
    if constexpr (D == 1) {
        const std::vector<double> edges = edges_of_parts(functions, lower[0], upper[0]);
        for (std::size_t k = 0; k + 1 < edges.size(); ++k)
            for (const auto& [at, weight] : rule)
                use(Vec<1>{edges[k] + at * (edges[k + 1] - edges[k])}, weight * (edges[k + 1] - edges[k]));
    } else {
        const Surfaces<D> surfaces(functions, lower, upper);
        const int axis = surfaces.steepest_axis();
        if (surfaces.functions.empty()) {
            for_each_point_of_box(rule, lower, upper, use);
        } else if (surfaces.is_graph(axis)) {
            for_each_point_of_lines(surfaces.functions, axis, lower, upper, points, halvings, use);
        } else if (halvings > 0) {
            for_each_half(lower, upper, [&](const Vec<D>& lo, const Vec<D>& hi) {
                for_each_point_of_parts<D>(surfaces.functions, lo, hi, points, halvings - 1, use);
            });
        } else {
            double volume = 1.0;
            for (int a = 0; a < D; ++a) volume *= upper[a] - lower[a];
            use(0.5 * (lower + upper), volume);
        }
    }
}

}  // namespace cut

/// How much of a box is inside, estimated from samples; `part` also if they cannot decide.
template <int D>
Cover cover_of(const std::vector<LevelSet<D>>& functions, const Vec<D>& lower, const Vec<D>& upper)
{
    Cover r = Cover::all;
    for (const LevelSet<D>& f : functions) {
        if (cut::Signs<D>(f, lower, upper).vanishes)
            r = Cover::part;
        else if (f(lower) > 0)
            return Cover::none;
    }
    return r;
}

/// use(x, weight) at Gauss points of the part of a box in which all functions are negative, with `points` points per interval
/// of a line. Weights are positive. Exact for polynomials of degree 2 points - 1 if no function vanishes in the box.
template <int D, class Use>
void for_each_point_inside(const std::vector<LevelSet<D>>& functions, const Vec<D>& lower, const Vec<D>& upper, int points,
                           const Use& use)
{
    cut::for_each_point_of_parts<D>(functions, lower, upper, points, cut::kHalvings, [&](const Vec<D>& x, double weight) {
        for (const LevelSet<D>& f : functions)
            if (!(f(x) < 0)) return;
        use(x, weight);
    });
}

}  // namespace ordo
