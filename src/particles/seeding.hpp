// Material points of the built-in shapes: centres of Cartesian sub-cells of the grid or of polar cells, or Gauss points.
// Points at left edges would make MPM, cpGIMP and CPDI first order (methods: Gong's errata, 21).
#pragma once

#include "base/gauss_rule.hpp"
#include "base/index.hpp"
#include "particles/particles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace ordo {

/// A future material point: position, volume, and the half-edge vectors of its domain (columns).
template <int D>
struct Seed {
    Vec<D> x;
    double volume;
    Mat<D> edges;
};

/// Makes particle i of `p` from a seed: position, mass, volume, initial domain and number. The half-lengths of a box domain
/// are the norms of the rows of the half-edge matrix.
template <int D>
void plant(Particles<D>& p, int i, const Seed<D>& seed, double density)
{
    p.x[i]  = seed.x;
    p.V0[i] = seed.volume;
    p.m[i]  = seed.volume * density;
    p.id[i] = i;
    if (!p.load.empty()) p.load[i] = -1;
    if (!p.edges0.empty()) p.edges0[i] = seed.edges;
    if (!p.half0.empty())
        for (int a = 0; a < D; ++a) {
            double along = 0;
            for (int d = 0; d < D; ++d) along += seed.edges(a, d) * seed.edges(a, d);
            p.half0[i][a] = std::sqrt(along);
        }
}

/// A region of space by its bounding box.
template <int D>
struct Bounds {
    Vec<D> lower, upper;
};

/// Sub-cells of the grid: n[a] per cell of size h[a] along each axis. Either they are equal with points in their middles, or
/// their lengths are the weights of Gauss' rule and their points those of the rule.
template <int D>
struct SubCells {
    Vec<D> origin, h;
    Index<D> n;
    bool gauss = false;
};

template <int D>
struct Ball {
    Vec<D> center;
    double radius;

    bool contains(const Vec<D>& x) const { return dot(x - center, x - center) < radius * radius; }
    Bounds<D> bounds() const { return {center - Vec<D>::filled(radius), center + Vec<D>::filled(radius)}; }
};

/// A ring in 2D; in 3D a cylinder or tube around the given axis between `bottom` and `top`. Angles in radians, from the first
/// of the two other axes towards the second.
template <int D>
struct Tube {
    Vec<D> center{};
    double inner = 0.0, outer = 0.0;
    double from = 0.0, to = 2 * std::numbers::pi;
    int axis      = 2;
    double bottom = 0.0, top = 0.0;

    int first() const { return D == 3 ? (axis + 1) % 3 : 0; }
    int second() const { return D == 3 ? (axis + 2) % 3 : 1; }

    /// The square of the distance of a place from the axis.
    double square_radius(const Vec<D>& x) const
    {
        const double dx = x[first()] - center[first()], dy = x[second()] - center[second()];
        return dx * dx + dy * dy;
    }

    /// Functions of a place that vanish on the round faces and are negative inside them, m^2.
    std::vector<std::function<double(const Vec<D>&)>> round_faces() const
    {
        std::vector<std::function<double(const Vec<D>&)>> r;
        r.push_back([tube = *this](const Vec<D>& x) { return tube.square_radius(x) - tube.outer * tube.outer; });
        if (inner > 0) r.push_back([tube = *this](const Vec<D>& x) { return tube.inner * tube.inner - tube.square_radius(x); });
        return r;
    }

    bool contains(const Vec<D>& x) const
    {
        const double dx = x[first()] - center[first()], dy = x[second()] - center[second()];
        const double r2 = square_radius(x);
        if (!(r2 < outer * outer) || r2 < inner * inner) return false;
        if constexpr (D == 3)
            if (x[axis] <= bottom || x[axis] >= top) return false;
        const double full = 2 * std::numbers::pi;
        double angle      = std::atan2(dy, dx) - from;
        angle -= full * std::floor(angle / full);
        return angle <= to - from;
    }

    Bounds<D> bounds() const
    {
        const double pi = std::numbers::pi;
        double lo[2]    = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
        double hi[2]    = {-lo[0], -lo[1]};
        auto add        = [&](double angle) {
            for (double r : {inner, outer}) {
                const double at[2] = {r * std::cos(angle), r * std::sin(angle)};
                for (int k = 0; k < 2; ++k) lo[k] = std::min(lo[k], at[k]), hi[k] = std::max(hi[k], at[k]);
            }
        };
        add(from);
        add(to);
        for (double q = std::ceil(from / (pi / 2)) * (pi / 2); q <= to; q += pi / 2) add(q);
        Bounds<D> r{center, center};
        r.lower[first()] += lo[0];
        r.upper[first()] += hi[0];
        r.lower[second()] += lo[1];
        r.upper[second()] += hi[1];
        if constexpr (D == 3) {
            r.lower[axis] = bottom;
            r.upper[axis] = top;
        }
        return r;
    }
};

/// The seed of sub-cell k; `rules` holds the Gauss points of one cell along each axis.
template <int D>
Seed<D> seed_of(const SubCells<D>& cells, const Vec<D, std::vector<GaussPoint>>& rules, const Index<D>& k)
{
    Seed<D> seed{.x = {}, .volume = 1.0, .edges = {}};
    for (int a = 0; a < D; ++a) {
        const int cell           = static_cast<int>(std::floor(static_cast<double>(k[a]) / cells.n[a]));
        const int point          = k[a] - cell * cells.n[a];
        const auto& [at, weight] = rules[a][point];
        double below             = 0.0;  // the weights of the points before it
        for (int j = 0; j < point; ++j) below += rules[a][j].weight;
        seed.x[a] = cells.origin[a] + (cell + at) * cells.h[a];
        seed.volume *= weight * cells.h[a];
        seed.edges(a, a) = std::min(at - below, below + weight - at) * cells.h[a];  // the largest centred box inside the sub-cell
    }
    return seed;
}
template <int D>
Vec<D, std::vector<GaussPoint>> gauss_rules(const SubCells<D>& cells)
{
    Vec<D, std::vector<GaussPoint>> rules;
    for (int a = 0; a < D; ++a) rules[a] = gauss_rule(cells.n[a]);
    return rules;
}

/// f(seed) for the sub-cells of the grid whose point lies in the shape.
template <int D, class Shape, class F>
void walk(const Shape& shape, const SubCells<D>& cells, F&& f)
{
    const Bounds<D> bounds = shape.bounds();
    Index<D> first{}, n{};
    Seed<D> seed{.x = {}, .volume = 1.0, .edges = {}};
    Vec<D> s{};
    for (int a = 0; a < D; ++a) {
        s[a]     = cells.h[a] / cells.n[a];
        first[a] = static_cast<int>(std::floor((bounds.lower[a] - cells.origin[a]) / s[a]));
        n[a]     = static_cast<int>(std::ceil((bounds.upper[a] - cells.origin[a]) / s[a])) - first[a];
        seed.volume *= s[a];
        seed.edges(a, a) = s[a] / 2;
    }
    if (cells.gauss) {
        const auto rules = gauss_rules(cells);
        for (int a = 0; a < D; ++a) first[a] -= 1, n[a] += 2;  // points are not in the middle of sub-cells
        IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
            const Seed<D> at = seed_of(cells, rules, k + first);
            if (shape.contains(at.x)) f(at);
        });
        return;
    }
    IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
        for (int a = 0; a < D; ++a) seed.x[a] = cells.origin[a] + (first[a] + k[a] + 0.5) * s[a];
        if (shape.contains(seed.x)) f(std::as_const(seed));
    });
}

/// f(seed) for a box in equal sub-cells (with Gauss' rule: equal cells) that fit it exactly and are closest in size to those of the
/// grid. The volume is exact wherever the box lies.
template <int D, class F>
void walk_box(const Bounds<D>& box, const SubCells<D>& cells, F&& f)
{
    Index<D> n{};
    Seed<D> seed{.x = {}, .volume = 1.0, .edges = {}};
    Vec<D> s{};
    if (cells.gauss) {
        SubCells<D> own = cells;
        for (int a = 0; a < D; ++a) {
            const double length = box.upper[a] - box.lower[a];
            const int count     = std::max(1, static_cast<int>(std::lround(length / cells.h[a])));
            own.origin[a]       = box.lower[a];
            own.h[a]            = length / count;
            n[a]                = count * cells.n[a];
        }
        const auto rules = gauss_rules(own);
        IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) { f(seed_of(own, rules, k)); });
        return;
    }
    for (int a = 0; a < D; ++a) {
        const double length = box.upper[a] - box.lower[a];
        n[a]                = std::max(1, static_cast<int>(std::lround(length / (cells.h[a] / cells.n[a]))));
        s[a]                = length / n[a];
        seed.volume *= s[a];
        seed.edges(a, a) = s[a] / 2;
    }
    IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
        for (int a = 0; a < D; ++a) seed.x[a] = box.lower[a] + (k[a] + 0.5) * s[a];
        f(std::as_const(seed));
    });
}

/// f(seed) for a ring or tube in polar cells: `radial` x `angular` (x `layers` in 3D). Volumes are those of the exact sectors.
/// Half-edge vectors are radial and along the arc at the middle radius, so 2^D |r1 x r2 ..| is the same volume.
template <int D, class F>
void walk_polar(const Tube<D>& tube, int radial, int angular, int layers, F&& f)
{
    const double dr = (tube.outer - tube.inner) / radial;
    const double da = (tube.to - tube.from) / angular;
    const double dz = D == 3 ? (tube.top - tube.bottom) / layers : 1.0;
    const int e1 = tube.first(), e2 = tube.second();
    for (int k = 0; k < (D == 3 ? layers : 1); ++k)
        for (int j = 0; j < angular; ++j)
            for (int i = 0; i < radial; ++i) {
                const double r = tube.inner + (i + 0.5) * dr, angle = tube.from + (j + 0.5) * da;
                const double c = std::cos(angle), s = std::sin(angle);
                Seed<D> seed{.x = tube.center, .volume = r * dr * da * dz, .edges = {}};
                seed.x[e1] += r * c;
                seed.x[e2] += r * s;
                seed.edges(e1, e1) = c * dr / 2;
                seed.edges(e2, e1) = s * dr / 2;
                seed.edges(e1, e2) = -s * r * da / 2;
                seed.edges(e2, e2) = c * r * da / 2;
                if constexpr (D == 3) {
                    seed.x[tube.axis]                = tube.bottom + (k + 0.5) * dz;
                    seed.edges(tube.axis, tube.axis) = dz / 2;
                }
                f(std::as_const(seed));
            }
}

/// The seeds of these walks.
template <int D, class Shape>
std::vector<Seed<D>> fill(const Shape& shape, const SubCells<D>& cells)
{
    std::vector<Seed<D>> seeds;
    walk(shape, cells, [&](const Seed<D>& seed) { seeds.push_back(seed); });
    return seeds;
}
template <int D>
std::vector<Seed<D>> fill_box(const Bounds<D>& box, const SubCells<D>& cells)
{
    std::vector<Seed<D>> seeds;
    walk_box(box, cells, [&](const Seed<D>& seed) { seeds.push_back(seed); });
    return seeds;
}
template <int D>
std::vector<Seed<D>> fill_polar(const Tube<D>& tube, int radial, int angular, int layers)
{
    std::vector<Seed<D>> seeds;
    walk_polar(tube, radial, angular, layers, [&](const Seed<D>& seed) { seeds.push_back(seed); });
    return seeds;
}

}  // namespace ordo
