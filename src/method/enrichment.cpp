#include "method/enrichment.hpp"

#include "material/branches.hpp"
#include "particles/cell_seeding.hpp"
#include "shape/cell_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace ordo {

namespace {

template <int D>
double shortest_distance_of_corners(const Particles<D>& p)
{
    double shortest = std::numeric_limits<double>::infinity();
    for (const CornerIds<D>& cell : p.cell)
        for (int c = 1; c < cell.count(); ++c)
            for (int d = 0; d < c; ++d) shortest = std::min(shortest, norm(p.corner[cell[c]] - p.corner[cell[d]]));
    return shortest;
}

/// Merges corners of different bodies that are closer than 1e-6 of the shortest distance of two corners of a cell; the first
/// velocity is kept. Corners of one body stay apart, because a mesh may have slits.
template <int D>
void weld_bodies(Particles<D>& p)
{
    if (std::all_of(p.body.begin(), p.body.end(), [&](int body) { return body == p.body[0]; })) return;
    std::vector<int> body(p.corner.size(), -1);
    for (int i = p.count - 1; i >= 0; --i)
        for (int c = 0; c < p.cell[i].count(); ++c) body[p.cell[i][c]] = p.body[i];
    const double shortest = shortest_distance_of_corners(p);
    Welder<D> welder(p.corner[0] - Vec<D>::filled(shortest / 2), shortest, 1e-6 * shortest);
    std::map<std::pair<int, int>, int> seen;  // number of corners of a body at a place
    std::map<std::pair<int, int>, int> kept;  // the corner that replaces the first, second, ... of each body at a place
    std::vector<int> number(p.corner.size());
    std::vector<int> first;
    for (int c = 0; c < static_cast<int>(p.corner.size()); ++c) {
        const int place = welder.number(p.corner[c]), rank = seen[{place, body[c]}]++;
        const auto [entry, is_new] = kept.try_emplace({place, rank}, static_cast<int>(first.size()));
        if (is_new) first.push_back(c);
        number[c] = entry->second;
    }
    for (CornerIds<D>& cell : p.cell)
        for (int c = 0; c < cell.count(); ++c) cell[c] = number[cell[c]];
    auto take_first = [&](Array<Vec<D>>& of) {
        if (of.empty()) return;
        Array<Vec<D>> r(first.size());
        for (std::size_t k = 0; k < first.size(); ++k) r[k] = of[first[k]];
        of = std::move(r);
    };
    take_first(p.corner);
    take_first(p.corner_velocity);
}

/// Corners that belong to cells of more than one body.
template <int D>
std::vector<bool> interface_corners(const Particles<D>& p)
{
    std::vector<int> body(p.corner.size(), -1);
    std::vector<bool> is_shared(p.corner.size(), false);
    for (int i = 0; i < p.count; ++i)
        for (int c = 0; c < p.cell[i].count(); ++c) {
            const int corner = p.cell[i][c];
            if (body[corner] >= 0 && body[corner] != p.body[i]) is_shared[corner] = true;
            body[corner] = p.body[i];
        }
    return is_shared;
}

/// All corners of the cells that have a chosen corner.
template <int D>
std::vector<bool> with_neighbours(const Particles<D>& p, const std::vector<bool>& chosen)
{
    std::vector<bool> wider = chosen;
    for (const CornerIds<D>& cell : p.cell) {
        bool touches = false;
        for (int c = 0; c < cell.count(); ++c) touches = touches || chosen[cell[c]];
        for (int c = 0; c < cell.count() && touches; ++c) wider[cell[c]] = true;
    }
    return wider;
}

template <int D>
std::vector<bool> chosen_corners(const MethodSpec& method, const Particles<D>& p)
{
    if (method.enrichment == Enrichment::all) return std::vector<bool>(p.corner.size(), true);
    std::vector<bool> chosen = interface_corners(p);
    const int layers         = method.enrichment == Enrichment::interface  ? 0
                               : method.enrichment == Enrichment::adjacent ? 1
                                                                           : static_cast<int>(method.layers);
    for (int k = 0; k < layers; ++k) chosen = with_neighbours(p, chosen);
    return chosen;
}

/// Corners on both faces of a periodic axis are the same place, but two degrees of freedom: the body would be cut there.
template <int D>
void require_no_seam(const Model<D>& model, const Particles<D>& p)
{
    for (int a = 0; a < D; ++a) {
        bool on_lower = false, on_upper = false;
        for (const int c : p.enriched) {
            const double y = (p.corner[c][a] - model.origin[a]) / model.h[a];
            on_lower       = on_lower || std::fabs(y) < 1e-6;
            on_upper       = on_upper || std::fabs(y - model.cells[a]) < 1e-6;
        }
        if (model.periodic[a] && on_lower && on_upper)
            throw InputError(std::string("enriched corners lie on both faces of the periodic axis ") + "xyz"[a] +
                             ", where a body would be cut; enrich fewer, or let walls with type = \"symmetry\" bound it");
    }
}

/// Numbers the parts, which are sets of corners connected by cells.
template <int D>
void number_parts(Particles<D>& p)
{
    std::vector<int> parent(p.corner.size());
    std::iota(parent.begin(), parent.end(), 0);
    auto root = [&](int c) {
        while (parent[c] != c) c = parent[c] = parent[parent[c]];
        return c;
    };
    for (const CornerIds<D>& cell : p.cell)
        for (int c = 1; c < cell.count(); ++c) {
            const int one = root(cell[0]), other = root(cell[c]);
            parent[std::max(one, other)] = std::min(one, other);  // the root is the first corner of its part
        }
    p.corner_part = Array<std::int32_t>(p.corner.size());
    p.part_count  = 0;
    for (int c = 0; c < static_cast<int>(p.corner.size()); ++c)
        p.corner_part[c] = root(c) == c ? p.part_count++ : p.corner_part[root(c)];
}

/// The nodes of the grid that each corner spreads to.
template <int D>
std::vector<IndexBox<D>> nodes_of_corners(const Lattice<D>& g, const Particles<D>& p)
{
    std::vector<IndexBox<D>> boxes(p.corner.size());
    parallel_for_each(static_cast<std::ptrdiff_t>(boxes.size()), [&](std::ptrdiff_t c) {
        const Vec<D> x = g.inside_period(p.corner[c]);
        for (int a = 0; a < D; ++a) {
            boxes[c].lo[a] = static_cast<int>(std::floor(g.cell_coordinate(a, x[a])));
            boxes[c].hi[a] = boxes[c].lo[a] + g.basis.degree + 1;
        }
    });
    return boxes;
}

/// Corners whose nodes lie in the bounding box of the nodes of another part; all corners if there is a periodic axis or too many
/// parts for this test.
template <int D>
std::vector<int> corners_near_other_parts(const Lattice<D>& g, const Particles<D>& p, const std::vector<IndexBox<D>>& reached)
{
    constexpr int many = 64;
    bool is_periodic   = false;
    for (int a = 0; a < D; ++a) is_periodic = is_periodic || g.periodic[a];
    std::vector<int> near(p.corner.size());
    std::iota(near.begin(), near.end(), 0);
    if (is_periodic || p.part_count > many) return near;
    std::vector<IndexBox<D>> bounds(p.part_count);
    std::vector<bool> is_known(p.part_count, false);
    for (const int c : near) {
        IndexBox<D>& b = bounds[p.corner_part[c]];
        if (!is_known[p.corner_part[c]]) b = reached[c];
        is_known[p.corner_part[c]] = true;
        for (int a = 0; a < D; ++a) {
            b.lo[a] = std::min(b.lo[a], reached[c].lo[a]);
            b.hi[a] = std::max(b.hi[a], reached[c].hi[a]);
        }
    }
    auto meets = [&](const IndexBox<D>& one, const IndexBox<D>& other) {
        bool r = true;
        for (int a = 0; a < D; ++a) r = r && one.lo[a] < other.hi[a] && other.lo[a] < one.hi[a];
        return r;
    };
    std::erase_if(near, [&](int c) {
        for (int part = 0; part < p.part_count; ++part)
            if (part != p.corner_part[c] && meets(reached[c], bounds[part])) return false;
        return true;
    });
    return near;
}

/// The largest row sum of absolute values: a bound of the largest eigenvalue, equal to it if S is diagonal.
template <int D>
double largest_row(const Mat<D>& S)
{
    double largest = 0.0;
    for (int a = 0; a < D; ++a) {
        double sum = 0.0;
        for (int b = 0; b < D; ++b) sum += std::fabs(S(a, b));
        largest = std::max(largest, sum);
    }
    return largest;
}

/// f(corner, its node) for each enriched corner that is a node in this step, in parallel.
template <int D, class F>
void for_each_own_node(const Particles<D>& p, F&& f)
{
    parallel_for_each(static_cast<std::ptrdiff_t>(p.enriched.size()), [&](std::ptrdiff_t e) {
        const int c = p.enriched[e];
        if (p.corner_node[c] >= 0) f(c, p.corner_node[c]);
    });
}

}  // namespace

template <int D>
int enrich(const Model<D>& model, Particles<D>& p)
{
    p.enriched    = {};
    p.corner_node = {};
    if (!has_enrichment(model.method) || p.corner.empty()) return 0;
    weld_bodies(p);
    number_parts(p);
    p.corner_node = Array<std::ptrdiff_t>(p.corner.size());
    std::fill(p.corner_node.begin(), p.corner_node.end(), -1);
    const std::vector<bool> is_chosen = chosen_corners(model.method, p);
    p.enriched                        = Array<std::int32_t>(std::count(is_chosen.begin(), is_chosen.end(), true));
    p.corner_planes                   = Array<std::uint64_t>(p.corner.size());
    if (model.conditions.size() > 64) throw InputError("enriched corners allow at most 64 boundary conditions; merge some");
    int count = 0;
    for (int c = 0; c < static_cast<int>(p.corner.size()); ++c) {
        p.corner_planes[c] = 0;
        if (!is_chosen[c]) continue;
        p.enriched[count++] = c;
        for (std::size_t k = 0; k < model.conditions.size(); ++k) {
            const Condition<D>& b = model.conditions[k];
            if (b.is_plane() && b.covers(p.corner[c], model.h)) p.corner_planes[c] |= std::uint64_t{1} << k;
        }
    }
    require_no_seam(model, p);
    return count;
}

template <int D>
std::size_t add_enriched(const Lattice<D>& lattice, const Particles<D>& p, Halo<D>& halo)
{
    const auto first = static_cast<std::ptrdiff_t>(lattice.node_count()), count = static_cast<std::ptrdiff_t>(p.enriched.size());
    int axes = 0;
    for (int a = 0; a < D; ++a) axes += lattice.periodic[a];
    for (int a = 0, bit = 1; a < D; ++a) {
        if (!lattice.periodic[a]) continue;
        for (int image = 0; image < 1 << axes; ++image)
            for (std::ptrdiff_t e = 0; e < count && (image & bit); ++e)
                halo.add_pair(a, first + image * count + e, first + (image ^ bit) * count + e);
        bit *= 2;
    }
    return static_cast<std::size_t>(count << axes);
}

template <int D>
void number_enriched(State<D>& s)
{
    Particles<D>& p  = s.particles;
    const auto first = static_cast<std::ptrdiff_t>(s.lattice.node_count()),
               count = static_cast<std::ptrdiff_t>(p.enriched.size());
    parallel_for_each(count, [&](std::ptrdiff_t e) { p.corner_node[p.enriched[e]] = first + e; });
    if (count == 0 || p.part_count < 2) return;
    const std::vector<IndexBox<D>> reached = nodes_of_corners(s.lattice, p);
    const std::vector<int> candidates      = corners_near_other_parts(s.lattice, p, reached);
    std::vector<std::pair<std::ptrdiff_t, int>> writes;  // a node and a part that writes to it
    auto for_each_node = [&](int c, auto&& f) {
        reached[c].for_each([&](const Index<D>& k) { f(s.lattice.offset(s.lattice.inside_period(k))); });
    };
    for (const int c : candidates) for_each_node(c, [&](std::ptrdiff_t node) { writes.emplace_back(node, p.corner_part[c]); });
    std::sort(writes.begin(), writes.end());
    std::vector<std::ptrdiff_t> shared;
    for (std::size_t k = 1; k < writes.size(); ++k)
        if (writes[k].first == writes[k - 1].first && writes[k].second != writes[k - 1].second) shared.push_back(writes[k].first);
    for (const int c : candidates)
        if (p.corner_node[c] >= 0)
            for_each_node(c, [&](std::ptrdiff_t node) {
                if (std::binary_search(shared.begin(), shared.end(), node)) p.corner_node[c] = -1;
            });
}

template <int D>
void constrain_enriched(const Model<D>& model, State<D>& s, Lanes* nodes, const Moment& when, const std::vector<Wall<D>>& walls,
                        const ExchangeSums<D>& sums, double pic)
{
    const Particles<D>& p = s.particles;
    sums.for_each(static_cast<std::ptrdiff_t>(p.enriched.size()), [&](std::ptrdiff_t e, auto&& note) {
        const int c = p.enriched[e];
        if (p.corner_node[c] < 0) return;
        Lanes& own         = nodes[p.corner_node[c]];
        const Vec<D> x     = s.lattice.inside_period(p.corner[c]);
        const Lanes before = own;
        auto starts_on     = [&](int k) { return (p.corner_planes[c] >> k & 1) != 0; };
        auto acts          = [&](int k) {
            if (starts_on(k)) return true;
            const Condition<D>& b = model.conditions[k];
            if (!covers_in_periods(b, x, s.lattice)) return false;
            if (!b.is_plane()) return true;
            const double outwards = b.outer_is_above ? 1.0 : -1.0;
            return !b.constrains(b.axis) || outwards * (before[NodeLane::velocity + b.axis] - b.velocity(b.axis, x, when)) > 0;
        };
        Vec<D, bool> is_free{};
        const unsigned by_bodies = s.held_corners.empty() ? 0u : s.held_corners[e];
        for (int a = 0; a < D; ++a) {
            if (by_bodies >> a & 1u) continue;
            const int k = holding(model.conditions, a, acts);
            is_free[a]  = k < 0;
            if (is_free[a]) continue;
            const Condition<D>& b = model.conditions[k];
            const double was = carried(own, a, pic), v = b.velocity(a, x, when);
            hold(own, a, v, (b.is_plane() && !starts_on(k)) || b.is_prescribed());
            NodeImpulse<D> one{.boundary = b.boundary};
            one.impulse[a] = carried(own, a, pic) - was;
            if (b.is_prescribed()) one.work = -one.impulse[a] * b.velocity(a, x, middle_of(when));
            note(one);
        }
        push_out(walls, s.wall_shifts, x, is_free, when, own, note);
    });
}

template <int D>
void keep_velocities(State<D>& s, const Lanes* nodes)
{
    Particles<D>& p = s.particles;
    for_each_own_node(p, [&](int c, std::ptrdiff_t own) {
        for (int a = 0; a < D; ++a) p.corner_velocity[c][a] = nodes[own][NodeLane::velocity + a];
    });
}

template <int D>
void restore_momenta(const State<D>& s, Lanes* nodes)
{
    const Particles<D>& p = s.particles;
    for_each_own_node(p, [&](int c, std::ptrdiff_t own) {
        Lanes& node = nodes[own];
        for (int a = 0; a < D; ++a) node[NodeLane::velocity + a] = node[NodeLane::mass] * p.corner_velocity[c][a];
    });
}

template <int D>
double enriched_time_step(const Model<D>& model, const Particles<D>& p)
{
    if (p.enriched.empty()) return std::numeric_limits<double>::infinity();
    std::vector<bool> is_enriched(p.corner.size(), false);
    for (const int c : p.enriched) is_enriched[c] = true;
    const double largest = parallel_reduce(
        p.count, 0.0,
        [&](std::ptrdiff_t i) {
            const CornerIds<D>& cell = p.cell[i];
            bool has_any             = false;
            for (int c = 0; c < cell.count(); ++c) has_any = has_any || is_enriched[cell[c]];
            if (!has_any) return 0.0;
            Vec<D> x[1 << D];
            get_corners(cell, p.corner.data(), x);
            const CellWeights<D> k = model.method.weights == CornerWeights::exact ? exact_weights<D>(x, cell.is_simplex())
                                                                                  : mean_weights<D>(x, cell.is_simplex());
            Mat<D> S{};
            for (int c = 0; c < k.count; ++c) S += (1 / k.w[c]) * outer(k.g[c], k.g[c]);
            const Material& m = model.materials[p.material[i]];
            const bool stiffens =
                m.law->is_hyperelastic && changes_stiffness<D>(m) && det(p.F[i]) > 0;  // F is 0 before the start
            const double stiffened = stiffens ? stiffness(m, p.F[i], nullptr).modulus / (det(p.F[i]) * m.p_wave_modulus()) : 1.0;
            return stiffened * (D * m.lambda + 2 * m.mu) * k.V / p.m[i] * largest_row(S);
        },
        [](double& total, double one) { total = std::max(total, one); });
    return 2 / std::sqrt(largest);
}

#define ORDO_ENRICHMENT(D)                                                                                           \
    template int enrich(const Model<D>&, Particles<D>&);                                                             \
    template std::size_t add_enriched(const Lattice<D>&, const Particles<D>&, Halo<D>&);                             \
    template void number_enriched(State<D>&);                                                                        \
    template void constrain_enriched(const Model<D>&, State<D>&, Lanes*, const Moment&, const std::vector<Wall<D>>&, \
                                     const ExchangeSums<D>&, double);                                                \
    template void keep_velocities(State<D>&, const Lanes*);                                                          \
    template void restore_momenta(const State<D>&, Lanes*);                                                          \
    template double enriched_time_step(const Model<D>&, const Particles<D>&);
ORDO_ENRICHMENT(1)
ORDO_ENRICHMENT(2)
ORDO_ENRICHMENT(3)
#undef ORDO_ENRICHMENT

}  // namespace ordo
