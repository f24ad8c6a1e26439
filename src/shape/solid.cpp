#include "shape/solid.hpp"

#include "shape/face_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

namespace ordo {

namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();

template <int D>
bool is_facing(const Vec<D>& normal, const Vec<D>* n)
{
    return !n || dot(normal, *n) < kFacing;
}

/// The shallowest of the faces above a point inside, of those that face n.
template <int D>
struct Shallowest {
    const Vec<D>* n;
    std::optional<Clearance<D>> best{};

    void add(double depth, const Vec<D>& normal)
    {
        if (is_facing(normal, n) && (!best || depth < -best->gap)) best = Clearance<D>{-depth, normal};
    }
};

/// Outside, at `distance` from the nearest point of the solid.
template <int D>
std::optional<Clearance<D>> outside(const Vec<D>& distance, const Vec<D>* n)
{
    const double gap = norm(distance);
    const Clearance<D> r{gap, (1 / gap) * distance};
    return is_facing(r.normal, n) ? std::optional(r) : std::nullopt;
}

template <int D>
std::optional<Clearance<D>> find(const HalfSpace<D>& s, const Vec<D>& x, const Vec<D>* n, double)
{
    if (!is_facing(s.normal, n)) return {};
    return Clearance<D>{dot(x - s.point, s.normal), s.normal};
}

template <int D>
std::optional<Clearance<D>> find(const Bounds<D>& s, const Vec<D>& x, const Vec<D>* n, double)
{
    Vec<D> distance{};
    for (int a = 0; a < D; ++a) distance[a] = x[a] - std::clamp(x[a], s.lower[a], s.upper[a]);
    if (dot(distance, distance) > 0) return outside(distance, n);
    Shallowest<D> r{n};
    for (int a = 0; a < D; ++a) {
        Vec<D> up{};
        up[a] = 1.0;
        r.add(x[a] - s.lower[a], -up);
        r.add(s.upper[a] - x[a], up);
    }
    return r.best;
}

template <int D>
std::optional<Clearance<D>> find(const Ball<D>& s, const Vec<D>& x, const Vec<D>* n, double)
{
    const double distance = norm(x - s.center);
    if (!(distance > 0)) return {};
    const Clearance<D> r{distance - s.radius, (1 / distance) * (x - s.center)};
    return is_facing(r.normal, n) ? std::optional(r) : std::nullopt;
}

template <int D>
std::optional<Clearance<D>> find(const Cylinder<D>& s, const Vec<D>& x, const Vec<D>* n, double)
{
    Vec<D> along{}, across = x - s.center;
    along[s.axis]    = 1.0;
    const double z   = across[s.axis];
    across[s.axis]   = 0.0;
    const double rho = norm(across), end = s.height / 2;
    const double out = std::max(0.0, rho - s.radius), over = z - std::clamp(z, -end, end);
    if (out > 0 || over != 0) return outside((rho > 0 ? out / rho : 0.0) * across + over * along, n);
    Shallowest<D> r{n};
    if (rho > 0) r.add(s.radius - rho, (1 / rho) * across);
    r.add(z + end, -along);
    r.add(end - z, along);
    return r.best;
}

template <int D>
std::optional<Clearance<D>> find(const TriangleSurface& s, const Vec<D>& x, const Vec<D>* n, double reach)
{
    if constexpr (D == 3) {
        const auto r = s.nearest(x, n, reach);
        if (r) return Clearance<3>{r->gap, r->normal};
    }
    return {};
}

template <int D>
Bounds<D> bounds(const HalfSpace<D>&)
{
    return {Vec<D>::filled(-kAll), Vec<D>::filled(kAll)};
}
template <int D>
Bounds<D> bounds(const Bounds<D>& s)
{
    return s;
}
template <int D>
Bounds<D> bounds(const Ball<D>& s)
{
    return s.bounds();
}
template <int D>
Bounds<D> bounds(const Cylinder<D>& s)
{
    Vec<D> half  = Vec<D>::filled(s.radius);
    half[s.axis] = s.height / 2;
    return {s.center - half, s.center + half};
}
template <int D>
Bounds<D> bounds(const TriangleSurface& s)
{
    Bounds<D> r{Vec<D>::filled(kAll), Vec<D>::filled(-kAll)};
    for (const Vec<3>& x : s.points())
        for (int a = 0; a < D; ++a) {
            r.lower[a] = std::min(r.lower[a], x[a]);
            r.upper[a] = std::max(r.upper[a], x[a]);
        }
    return r;
}

template <int D>
std::optional<Bulk<D>> bulk(const HalfSpace<D>&)
{
    return {};
}

/// Of squares of lengths along the axes, mean over the volume: the inertia about the centre.
Mat<3> inertia_of(double volume, const Vec<3>& square)
{
    Mat<3> r{};
    for (int a = 0; a < 3; ++a) r(a, a) = volume * (square[(a + 1) % 3] + square[(a + 2) % 3]);
    return r;
}

template <int D>
std::optional<Bulk<D>> bulk(const Bounds<D>& s)
{
    Bulk<D> r{1.0, 0.5 * (s.lower + s.upper), {}};
    Vec<3> square{};
    for (int a = 0; a < D; ++a) {
        const double length = s.upper[a] - s.lower[a];
        r.volume *= length;
        square[a] = length * length / 12;
    }
    r.inertia = inertia_of(r.volume, square);
    return r;
}

template <int D>
std::optional<Bulk<D>> bulk(const Ball<D>& s)
{
    constexpr double pi = std::numbers::pi;
    const double r = s.radius, volume = D == 3 ? 4.0 / 3 * pi * r * r * r : D == 2 ? pi * r * r : 2 * r;
    Vec<3> square{};
    for (int a = 0; a < D; ++a) square[a] = r * r / (D + 2);
    return Bulk<D>{volume, s.center, inertia_of(volume, square)};
}

template <int D>
std::optional<Bulk<D>> bulk(const Cylinder<D>& s)
{
    const double volume = std::numbers::pi * s.radius * s.radius * s.height;
    Vec<3> square       = Vec<3>::filled(s.radius * s.radius / 4);
    square[s.axis]      = s.height * s.height / 12;
    return Bulk<D>{volume, s.center, inertia_of(volume, square)};
}

/// By tetrahedra from the origin to each triangle.
template <int D>
std::optional<Bulk<D>> bulk(const TriangleSurface& s)
{
    if (D != 3 || !s.is_closed() || s.triangles().empty()) return {};
    const Bounds<D> box = bounds<D>(s);
    Vec<3> at           = padded(0.5 * (box.lower + box.upper)), first{};
    Mat<3> second{};
    double volume = 0.0;
    for (const auto& t : s.triangles()) {
        const std::array<Vec<3>, 3> x = {s.points()[t[0]] - at, s.points()[t[1]] - at, s.points()[t[2]] - at};
        const double six              = dot(x[0], cross(x[1], x[2]));
        const Vec<3> sum              = x[0] + x[1] + x[2];
        volume += six / 6;
        first += (six / 24) * sum;
        second += (six / 120) * (outer(sum, sum) + outer(x[0], x[0]) + outer(x[1], x[1]) + outer(x[2], x[2]));
    }
    if (!(volume > 0)) return {};
    const Vec<3> center = (1 / volume) * first;
    second -= volume * outer(center, center);
    Bulk<D> r{volume, {}, {}};
    for (int a = 0; a < D; ++a) r.center[a] = at[a] + center[a];
    r.inertia = -1.0 * second;
    for (int a = 0; a < 3; ++a) r.inertia(a, a) += trace(second);
    return r;
}

/// The nearest point of a triangle as weights of its corners; those that are zero say on which edge or corner it lies. By regions, Ericson
/// (2005), Real-Time Collision Detection, sec. 5.1.5.
std::array<double, 3> nearest_weights(const Vec<3>& x, const Vec<3>& a, const Vec<3>& b, const Vec<3>& c)
{
    const Vec<3> ab = b - a, ac = c - a, ax = x - a;
    const double d1 = dot(ab, ax), d2 = dot(ac, ax);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const Vec<3> bx = x - b;
    const double d3 = dot(ab, bx), d4 = dot(ac, bx);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc < 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
    const Vec<3> cx = x - c;
    const double d5 = dot(ab, cx), d6 = dot(ac, cx);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb < 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
    const double va = d3 * d6 - d5 * d4;
    if (va < 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - w, w};
    }
    const double all = va + vb + vc;
    return {va / all, vb / all, vc / all};
}

}  // namespace

TriangleSurface::TriangleSurface(const std::vector<std::array<Vec<3>, 3>>& triangles)
{
    auto less = [](const Vec<3>& a, const Vec<3>& b) { return std::lexicographical_compare(a.c, a.c + 3, b.c, b.c + 3); };
    std::map<Vec<3>, int, decltype(less)> number(less);
    for (const auto& t : triangles) {
        std::array<int, 3> of{};
        for (int c = 0; c < 3; ++c) {
            const auto [it, is_new] = number.try_emplace(t[c], static_cast<int>(points_.size()));
            if (is_new) points_.push_back(t[c]);
            of[c] = it->second;
        }
        const double area = norm(cross(t[1] - t[0], t[2] - t[0]));
        if (area > 0 && std::isfinite(area)) triangles_.push_back(of);
    }
    find_normals();
    order_.resize(triangles_.size());
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) add_node(0, static_cast<int>(order_.size()));
}

/// Pseudonormals tell inside from outside at edges and corners too: sums of normals by angles (Baerentzen & Aanaes 2005, IEEE Trans. Vis.
/// Comput. Graph. 11:243).
void TriangleSurface::find_normals()
{
    std::map<std::pair<int, int>, std::vector<std::pair<int, int>>>
        edges;  // by their ends, ascending: triangles and local numbers
    point_normals_.assign(points_.size(), {});
    is_open_point_.assign(points_.size(), false);
    for (int k = 0; k < static_cast<int>(triangles_.size()); ++k) {
        const auto& t = triangles_[k];
        normals_.push_back(unit(cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]])));
        for (int c = 0; c < 3; ++c) {
            const Vec<3> next = unit(points_[t[(c + 1) % 3]] - points_[t[c]]),
                         last = unit(points_[t[(c + 2) % 3]] - points_[t[c]]);
            point_normals_[t[c]] += std::acos(std::clamp(dot(next, last), -1.0, 1.0)) * normals_.back();
            edges[std::minmax(t[c], t[(c + 1) % 3])].emplace_back(k, c);
        }
    }
    edge_normals_.resize(triangles_.size());
    is_open_.resize(triangles_.size());
    for (const auto& [ends, of] : edges) {
        Vec<3> sum{};
        for (const auto& [k, c] : of) sum += normals_[k];
        const bool is_open = of.size() == 1;
        for (const auto& [k, c] : of) {
            edge_normals_[k][c] = sum;
            is_open_[k][c]      = is_open;
        }
        if (!is_open) continue;
        ++open_edges_;
        is_open_point_[ends.first] = is_open_point_[ends.second] = true;
    }
}

/// Adds the node of triangles [begin, end) of the order and those below it, halved along its longest axis. Returns its number.
int TriangleSurface::add_node(int begin, int end)
{
    constexpr int most = 4;  // triangles of a leaf
    const int number   = static_cast<int>(nodes_.size());
    Node node{Vec<3>::filled(kAll), Vec<3>::filled(-kAll), begin, end, 0};
    for (int k = begin; k < end; ++k)
        for (const int v : triangles_[order_[k]])
            for (int a = 0; a < 3; ++a) {
                node.low[a]  = std::min(node.low[a], points_[v][a]);
                node.high[a] = std::max(node.high[a], points_[v][a]);
            }
    nodes_.push_back(node);
    if (end - begin <= most) return number;
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (node.high[a] - node.low[a] > node.high[axis] - node.low[axis]) axis = a;
    auto place = [&](int k) {
        const auto& t = triangles_[k];
        return std::pair(points_[t[0]][axis] + points_[t[1]][axis] + points_[t[2]][axis], k);
    };
    const int middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) { return place(a) < place(b); });
    add_node(begin, middle);
    nodes_[number].right = add_node(middle, end);
    return number;
}

std::optional<TriangleSurface::Nearby> TriangleSurface::nearest(const Vec<3>& x, const Vec<3>* n, double reach) const
{
    // Feet inside triangles, over those that face n; feet on edges count only where they are the nearest of all.
    constexpr double equal = 1e-9;  // of reach
    double nearest         = reach;
    int edge_triangle      = -1;
    std::array<double, 3> edge_weight{};
    std::optional<Nearby> inner;
    int inner_triangle = 0;
    std::array<int, 64> stack{};
    int size = nodes_.empty() ? 0 : 1;
    while (size > 0) {
        const int at     = stack[--size];
        const Node& node = nodes_[at];
        double square    = 0.0;
        for (int a = 0; a < 3; ++a) {
            const double d = x[a] - std::clamp(x[a], node.low[a], node.high[a]);
            square += d * d;
        }
        if (square > reach * reach) continue;
        if (node.right > 0) {
            stack[size++] = at + 1;
            stack[size++] = node.right;
            continue;
        }
        for (int i = node.begin; i < node.end; ++i) {
            const int k              = order_[i];
            const auto& t            = triangles_[k];
            const auto w             = nearest_weights(x, points_[t[0]], points_[t[1]], points_[t[2]]);
            const Vec<3> d           = x - (w[0] * points_[t[0]] + w[1] * points_[t[1]] + w[2] * points_[t[2]]);
            const double at_distance = norm(d);
            if (!(at_distance <= reach)) continue;
            const bool is_inside = w[0] > 0 && w[1] > 0 && w[2] > 0;
            if (at_distance < nearest || (at_distance == nearest && (edge_triangle < 0 || k < edge_triangle))) {
                nearest       = at_distance;
                edge_triangle = is_inside ? -1 : k;
                edge_weight   = w;
            }
            if (!is_inside || !is_facing(normals_[k], n)) continue;
            const double gap     = dot(d, normals_[k]);
            const bool is_nearer = !inner || std::fabs(gap) < std::fabs(inner->gap) ||
                                   (std::fabs(gap) == std::fabs(inner->gap) && k < inner_triangle);
            if (!is_nearer) continue;
            inner          = Nearby{gap, normals_[k]};
            inner_triangle = k;
        }
    }
    if (edge_triangle < 0 || (inner && std::fabs(inner->gap) <= nearest + equal * reach)) return inner;
    const auto& t = triangles_[edge_triangle];
    Vec<3> pseudo{}, foot{};
    bool is_open = false;
    for (int c = 0; c < 3; ++c) {
        foot += edge_weight[c] * points_[t[c]];
        if (edge_weight[(c + 2) % 3] == 0 && edge_weight[c] > 0 && edge_weight[(c + 1) % 3] > 0) {
            pseudo  = edge_normals_[edge_triangle][c];
            is_open = is_open_[edge_triangle][c];
        }
        if (edge_weight[c] == 1) {
            pseudo  = point_normals_[t[c]];
            is_open = is_open_point_[t[c]];
        }
    }
    if (is_open) return inner;
    const Vec<3> d    = x - foot;
    const double sign = dot(d, pseudo) < 0 ? -1.0 : 1.0;
    // On the edge itself the direction is that of its pseudonormal, which is none where two sides lie on each other.
    const bool is_apart = nearest > equal * reach;
    if (!is_apart && !(norm(pseudo) > 1e-9)) return inner;
    const Nearby r{sign * nearest, is_apart ? (sign / nearest) * d : unit(pseudo)};
    return is_facing(r.normal, n) ? std::optional(r) : inner;
}

template <int D>
std::optional<Clearance<D>> clearance(const Solid<D>& solid, const Vec<D>& x, const Vec<D>* n, double reach)
{
    const auto r = std::visit([&](const auto& s) { return find(s, x, n, reach); }, solid);
    if (!r || r->gap > reach) return {};
    return r->gap >= -reach || std::holds_alternative<HalfSpace<D>>(solid) ? r : std::nullopt;
}

template <int D>
Bounds<D> bounds_of(const Solid<D>& solid)
{
    return std::visit(
        [](const auto& s) -> Bounds<D> {
            if constexpr (std::is_same_v<std::decay_t<decltype(s)>, TriangleSurface>)
                return bounds<D>(s);
            else
                return bounds(s);
        },
        solid);
}

template <int D>
std::optional<Bulk<D>> bulk_of(const Solid<D>& solid)
{
    return std::visit(
        [](const auto& s) -> std::optional<Bulk<D>> {
            if constexpr (std::is_same_v<std::decay_t<decltype(s)>, TriangleSurface>)
                return bulk<D>(s);
            else
                return bulk(s);
        },
        solid);
}

template <int D>
Vec<D> middle_of(const Solid<D>& solid)
{
    if (const auto* plane = std::get_if<HalfSpace<D>>(&solid)) return plane->point;
    if (const auto bulk = bulk_of<D>(solid)) return bulk->center;
    const Bounds<D> box = bounds_of<D>(solid);
    return 0.5 * (box.lower + box.upper);
}

#define ORDO_SOLID(D)                                                                                      \
    template std::optional<Clearance<D>> clearance(const Solid<D>&, const Vec<D>&, const Vec<D>*, double); \
    template Bounds<D> bounds_of(const Solid<D>&);                                                         \
    template std::optional<Bulk<D>> bulk_of(const Solid<D>&);                                              \
    template Vec<D> middle_of(const Solid<D>&);
ORDO_SOLID(1)
ORDO_SOLID(2)
ORDO_SOLID(3)
#undef ORDO_SOLID

}  // namespace ordo
