#include "method/mass_matrix.hpp"

#include "kernels/nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

/// Lanes of `free`, beside one for each component that is solved for: whether the row takes part, and its extra diagonal.
constexpr int kCoupled = NodeLane::mass, kDiagonal = NodeLane::volume;

template <int D, class F>
void for_each_node_of(const Tiles<D>& tiles, F&& f)
{
    tiles.for_each_node_run([&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = begin; i < end; ++i) f(i);
    });
}

/// The sum of f(i) over all nodes, the same for any number of threads.
template <int D, class F>
Lanes sum_over_nodes(const Tiles<D>& tiles, F&& f)
{
    std::vector<Lanes> partial(tiles.blocks().size(), Lanes{});
    tiles.for_each_block_run([&](std::ptrdiff_t block, std::ptrdiff_t begin, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = begin; i < end; ++i) partial[block] += f(i);
    });
    Lanes total{};
    for (const Lanes& p : partial) total += p;
    return total;
}

}  // namespace

template <int D>
void MassSolver<D>::apply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const
{
    clear(to, s.tiles);
    Sweep<D> view = sweep;
    view.nodes    = to;
    if (is_of_points_) {
        view.p = s.points.view();
        s.points.for_each_by_colour([&](const Tile& tile) { passes_.apply_mass_points(view, from, tile.begin, tile.end); });
    } else {
        s.tiles.for_each_by_colour([&](const Tile& tile) { passes_.apply_mass(view, from, tile.begin, tile.end); });
    }
    s.halo.add(to, 0, NodeLane::end);
}

template <int D>
void MassSolver<D>::solve(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Lanes* known, unsigned parts) const
{
    constexpr int max_iterations = 3000;                  // the condition of cubic splines in 3D is some thousands
    constexpr double tolerance = 1e-13, bearable = 1e-9;  // of the norm of b
    const Tiles<D>& tiles = s.tiles;
    for (Array<Lanes>& a : s.solver)
        if (a.size() != s.nodes.size()) a = Array<Lanes>(s.nodes.size());
    Lanes *free = s.solver[0].data(), *u = s.solver[1].data(), *r = s.solver[2].data(), *p = s.solver[3].data(),
          *q = s.solver[4].data();
    std::vector<int> firsts, lanes;
    if (parts & kVelocity) firsts.push_back(NodeLane::velocity);
    if (parts & kAcceleration) firsts.push_back(NodeLane::increment);
    for (const int first : firsts)
        for (int a = 0; a < D; ++a) lanes.push_back(first + a);
    auto mass = [&](std::ptrdiff_t i) { return nodes[i][NodeLane::mass]; };

    // Which rows are solved for.
    std::vector<char> has_lumped(tiles.blocks().size(), 0);
    tiles.for_each_block_run([&](std::ptrdiff_t block, std::ptrdiff_t begin, std::ptrdiff_t end) {
        Index<D> at = s.lattice.index(begin);
        for (std::ptrdiff_t i = begin; i < end; ++i, ++at[0]) {
            free[i] = Lanes{};
            u[i]    = Lanes{};
            if (!(mass(i) > 0)) continue;
            const bool is_lumped = filled_part(s.lattice, nodes, at) < lump_below_;
            if (is_lumped) has_lumped[block] = 1;
            free[i][kCoupled] = is_lumped ? 0.0 : 1.0;
            for (const int a : lanes) free[i][a] = is_lumped ? 0.0 : 1.0;
        }
    });
    s.halo.copy(free);
    if (std::find(has_lumped.begin(), has_lumped.end(), 1) != has_lumped.end()) {
        apply(s, sweep, free, q);  // lane kCoupled: the part of each row sum that stays coupled
        for_each_node_of(tiles, [&](std::ptrdiff_t i) {
            if (mass(i) > 0) free[i][kDiagonal] = mass(i) - (free[i][kCoupled] > 0 ? q[i][kCoupled] : 0.0);
        });
    }
    auto for_each_known = [&](auto&& f) {
        s.constraints.for_each([&](std::ptrdiff_t node, int component, bool is_prescribed) {
            for (const int first : firsts)
                if (first != NodeLane::velocity || !is_prescribed) f(node, first + component);
        });
    };
    for_each_known([&](std::ptrdiff_t node, int a) { free[node][a] = 0.0; });

    // u: known values, else those of the lumped matrix.
    for_each_node_of(tiles, [&](std::ptrdiff_t i) {
        if (!(mass(i) > 0)) return;
        for (const int a : lanes) u[i][a] = nodes[i][a] / mass(i);
    });
    for_each_known([&](std::ptrdiff_t node, int a) { u[node][a] = a < NodeLane::mass ? 0.0 : known[node][a]; });
    s.halo.copy(u);
    s.halo.clear(free);  // images are no rows of their own

    // r = b - M u on the free rows.
    for_each_node_of(tiles, [&](std::ptrdiff_t i) { p[i] = u[i] * free[i][kCoupled]; });
    s.halo.copy(p);
    apply(s, sweep, p, q);
    for_each_node_of(tiles, [&](std::ptrdiff_t i) {
        Lanes b{};
        for (const int a : lanes) b[a] = nodes[i][a];
        r[i]           = free[i] * (b - q[i] - u[i] * free[i][kDiagonal]);
        r[i][kCoupled] = r[i][kDiagonal] = 0.0;
        p[i]                             = Lanes{};
    });

    auto inverse_mass = [&](std::ptrdiff_t i) { return mass(i) > 0 ? 1 / mass(i) : 0.0; };
    const Lanes size  = sum_over_nodes(tiles, [&](std::ptrdiff_t i) {
        Lanes b{};
        for (const int a : lanes) b[a] = nodes[i][a] * nodes[i][a] * inverse_mass(i);
        return b * free[i];
    });
    Lanes rz          = sum_over_nodes(tiles, [&](std::ptrdiff_t i) { return r[i] * r[i] * inverse_mass(i); });
    Lanes scale{}, beta{};
    for (const int a : lanes) scale[a] = std::max(size[a], rz[a]);
    auto is_finite = [&] {
        double sum = 0.0;
        for (const int a : lanes) sum += rz[a];
        return std::isfinite(sum);
    };
    auto is_below = [&](double part) {
        for (const int a : lanes)
            if (!(rz[a] <= part * part * scale[a])) return false;
        return true;
    };
    for (iterations_ = 0; iterations_ < max_iterations && is_finite() && !is_below(tolerance); ++iterations_) {
        for_each_node_of(tiles, [&](std::ptrdiff_t i) { p[i] = r[i] * inverse_mass(i) + p[i] * beta; });
        s.halo.copy(p);
        apply(s, sweep, p, q);
        for_each_node_of(tiles, [&](std::ptrdiff_t i) { q[i] = free[i] * (q[i] + p[i] * free[i][kDiagonal]); });
        const Lanes pq = sum_over_nodes(tiles, [&](std::ptrdiff_t i) { return p[i] * q[i]; });
        Lanes alpha{};
        for (const int a : lanes) alpha[a] = pq[a] > 0 ? rz[a] / pq[a] : 0.0;
        for_each_node_of(tiles, [&](std::ptrdiff_t i) {
            u[i] += p[i] * alpha;
            r[i] = r[i] - q[i] * alpha;
        });
        const Lanes next = sum_over_nodes(tiles, [&](std::ptrdiff_t i) { return r[i] * r[i] * inverse_mass(i); });
        for (const int a : lanes) beta[a] = rz[a] > 0 ? next[a] / rz[a] : 0.0;
        rz = next;
    }
    if (is_finite() && !is_below(bearable))  // else the particles will tell
        throw NumericalError(fmt::format(
            "step {}, t = {:.6g} s: the consistent mass matrix was not solved in {} iterations: particles are too few for its "
            "nodes; use smaller particles (more of them in a cell), a larger method.lump_below (now {}) or method.mass = "
            "\"lumped\"",
            s.n, s.t, iterations_, lump_below_));
    for_each_node_of(tiles, [&](std::ptrdiff_t i) {
        for (const int a : lanes) nodes[i][a] = u[i][a];
    });
    s.halo.copy(nodes);
}

template class MassSolver<1>;
template class MassSolver<2>;
template class MassSolver<3>;

}  // namespace ordo
