// Rigid half-spaces that bodies cannot enter but may leave, and slide along with Coulomb friction.
#pragma once

#include "base/field.hpp"
#include "base/parallel.hpp"
#include "grid/condition.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <unordered_map>
#include <vector>

namespace ordo {

/// A half-space. It acts on the nodes in it and on its surface.
template <int D>
struct Wall {
    static constexpr int most = 16;  ///< walls of a model

    Vec<D> point{};             ///< on its surface at t = 0, m
    Vec<D> normal{};            ///< of length 1, out of the wall
    VectorField<D> velocity{};  ///< a function of time, m/s
    double friction = 0.0;      ///< Coulomb's coefficient
    int boundary    = 0;        ///< the boundary of the case that it belongs to

    /// Of x from the surface, m; negative in the wall. `shift` is how far the wall has moved since t = 0.
    double distance(const Vec<D>& x, const Vec<D>& shift) const { return dot(x - point - shift, normal); }
    Vec<D> velocity_at(double t) const { return evaluate<D>(velocity, {padded(point), padded(point), t}); }
    bool moves() const { return !is_zero<D>(velocity); }
};

/// The components of a vector along free axes; the others are 0.
template <int D>
Vec<D> along(Vec<D, bool> axes, Vec<D> v)
{
    for (int a = 0; a < D; ++a)
        if (!axes[a]) v[a] = 0.0;
    return v;
}

template <int D>
Vec<D> velocity_of(const Lanes& node)
{
    Vec<D> v{};
    for (int a = 0; a < D; ++a) v[a] = node[NodeLane::velocity + a];
    return v;
}

/// Gives a node the velocity v; the increment changes by as much if `with_increment`.
template <int D>
void set_velocity(Lanes& node, const Vec<D>& v, bool with_increment)
{
    for (int a = 0; a < D; ++a) {
        if (with_increment) node[NodeLane::increment + a] += v[a] - node[NodeLane::velocity + a];
        node[NodeLane::velocity + a] = v[a];
    }
}

/// What a wall does to a node in a step.
enum class Grip : unsigned char { none, slips, sticks };

/// What one wall did to a node: impulses over the node's mass, m/s.
template <int D>
struct WallImpulse {
    double normal = 0.0;  ///< along the wall's normal, >= 0
    Vec<D> tangential{};  ///< friction; at most `friction` times the normal one
    Grip grip = Grip::none;
};
template <int D>
using WallImpulses = std::array<WallImpulse<D>, Wall<D>::most>;

/// The velocities of walls at time t, m/s.
template <int D>
std::vector<Vec<D>> velocities(const std::vector<Wall<D>>& walls, double t)
{
    std::vector<Vec<D>> u;
    for (const Wall<D>& w : walls) u.push_back(w.velocity_at(t));
    return u;
}

/// One wall is done in one sweep; walls at an angle of a take cos^2(a) of the error from sweep to sweep.
inline int sweeps_for(const std::vector<int>& touched) { return touched.size() > 1 ? 40 : 1; }

/// Changes the velocity v of a node to one that does not enter the walls that it is in: the impulses are those of least kinetic
/// energy, each pushing only, with Coulomb friction. Components that other conditions hold are not free and do not change. Nodes in
/// several walls take sweeps of Gauss and Seidel.
/// @param u velocities of the walls, m/s
/// @param touched the walls that the node is in
/// @param impulses one for each wall, all 0 before
template <int D>
Vec<D> push(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& u, const std::vector<int>& touched,
            Vec<D, bool> is_free, Vec<D> v, WallImpulses<D>& impulses)
{
    for (int sweep = 0; sweep < sweeps_for(touched); ++sweep)
        for (const int k : touched) {
            const Wall<D>& wall = walls[k];
            WallImpulse<D>& own = impulses[k];
            const Vec<D> n      = along(is_free, wall.normal);
            const double nn     = dot(n, n);
            if (nn < 1e-12) continue;  // other conditions hold the node across the wall
            const double before = own.normal;
            own.normal          = std::max(0.0, before - dot(v - u[k], wall.normal) / nn);
            v += (own.normal - before) * n;

            const Vec<D> relative = along(is_free, v - u[k]), slip = relative - (dot(relative, n) / nn) * n;
            const Vec<D> sticking = own.tangential - slip, was = own.tangential;
            const double limit = wall.friction * own.normal, size = norm(sticking);
            const bool sticks = size <= limit;
            own.tangential    = sticks ? sticking : (limit / size) * sticking;
            own.grip          = !(own.normal > 0) ? Grip::none : sticks && wall.friction > 0 ? Grip::sticks : Grip::slips;
            v += own.tangential - was;
        }
    return v;
}

/// Notes what walls with velocities u did to a node of mass m that moves with v since. The normal impulse works on the wall's
/// velocity, friction on the node's.
template <int D, class Note>
void note_impulses(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& u, const std::vector<int>& touched,
                   const WallImpulses<D>& impulses, Vec<D, bool> is_free, double m, const Vec<D>& v, const Note& note)
{
    for (const int k : touched) {
        const Vec<D> pushed = m * impulses[k].normal * along(is_free, walls[k].normal), rubbed = m * impulses[k].tangential;
        note({walls[k].boundary, pushed + rubbed, -dot(pushed, u[k]) - dot(rubbed, v)});
    }
}

/// Pushes a node at x out of the walls that it has entered, and notes the impulses.
template <int D, class Note>
void push_out(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, const Vec<D>& x, Vec<D, bool> is_free,
              const Moment& when, Lanes& node, const Note& note)
{
    std::vector<int> touched;
    for (std::size_t k = 0; k < walls.size(); ++k)
        if (walls[k].distance(x, shifts[k]) <= 0) touched.push_back(static_cast<int>(k));
    if (touched.empty()) return;
    WallImpulses<D> impulses{};
    set_velocity(node, push(walls, velocities(walls, when.t), touched, is_free, velocity_of<D>(node), impulses), true);
    note_impulses(walls, velocities(walls, middle_of(when).t), touched, impulses, is_free, node[NodeLane::mass],
                  velocity_of<D>(node), note);
}

/// The nodes that walls may act on, among those that the material touches; rebuilt by the sort.
template <int D>
class WallNodes {
  public:
    WallNodes() = default;
    WallNodes(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, const Lattice<D>& lattice,
              const Tiles<D>& tiles)
        : tolerance_(1e-9 * *std::min_element(lattice.h.c, lattice.h.c + D)), walls_(walls.size())
    {
        if (walls.empty()) return;
        tiles.for_each_node([&](const Index<D>& at, std::ptrdiff_t node) {
            Vec<D> x{};
            for (int a = 0; a < D; ++a) x[a] = lattice.node_position(a, at[a]);
            bool is_near = false;
            for (std::size_t k = 0; k < walls.size(); ++k)
                is_near = is_near || walls[k].moves() || walls[k].distance(x, shifts[k]) <= tolerance_;
            if (is_near) nodes_.push_back({node, x, {}, lattice.is_image(at) || !tiles.counts_record(node)});
        });
        grips_.assign(nodes_.size() * walls_, Grip::none);
    }

    /// From now on walls leave the components alone that conditions hold.
    void leave(const Constraints<D>& held)
    {
        if (nodes_.empty()) return;
        std::unordered_map<std::ptrdiff_t, std::size_t> number;
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            number.emplace(nodes_[i].node, i);
            for (int a = 0; a < D; ++a) nodes_[i].is_free[a] = true;
        }
        held.for_each([&](std::ptrdiff_t node, int component, bool) {
            if (const auto at = number.find(node); at != number.end()) nodes_[at->second].is_free[component] = false;
        });
    }

    /// Pushes the advanced nodes that move into walls, and remembers which. Increments change like velocities.
    /// @param sums get the impulses
    void advance(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, Lanes* nodes, const Moment& when,
                 const ExchangeSums<D>& sums)
    {
        const std::vector<Vec<D>> u = velocities(walls, when.t), middle = velocities(walls, middle_of(when).t);
        for_each(walls, shifts, nodes, sums, [&](std::size_t i, const std::vector<int>& touched, Lanes& node, auto&& note) {
            WallImpulses<D> impulses{};
            set_velocity(node, push(walls, u, touched, nodes_[i].is_free, velocity_of<D>(node), impulses), true);
            for (const int k : touched) grips_[i * walls_ + k] = impulses[k].grip;
            if (!nodes_[i].is_image)
                note_impulses(walls, middle, touched, impulses, nodes_[i].is_free, node[NodeLane::mass], velocity_of<D>(node),
                              note);
        });
    }

    /// Holds the same nodes as the last `advance` once more, in other velocities.
    /// @param u velocities that walls give the nodes, m/s
    /// @param sums get the impulses
    void repeat(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, Lanes* nodes, const std::vector<Vec<D>>& u,
                const Moment& when, const ExchangeSums<D>& sums) const
    {
        const std::vector<Vec<D>> middle = velocities(walls, middle_of(when).t);
        for_each(walls, shifts, nodes, sums, [&](std::size_t i, const std::vector<int>& touched, Lanes& node, auto&& note) {
            Vec<D> v = velocity_of<D>(node);
            for (int sweep = 0; sweep < sweeps_for(touched); ++sweep)
                for (const int k : touched) {
                    const Grip grip = grips_[i * walls_ + k];
                    const Vec<D> n = along(nodes_[i].is_free, walls[k].normal), before = v;
                    if (grip == Grip::sticks) v -= along(nodes_[i].is_free, v - u[k]);
                    if (grip == Grip::slips && dot(n, n) > 0) v -= (dot(v - u[k], walls[k].normal) / dot(n, n)) * n;
                    const Vec<D> impulse = node[NodeLane::mass] * (v - before);
                    if (!nodes_[i].is_image) note({walls[k].boundary, impulse, -dot(impulse, middle[k])});
                }
            set_velocity(node, v, false);
        });
    }

    struct Node {
        std::ptrdiff_t node;
        Vec<D> x;              ///< m
        Vec<D, bool> is_free;  ///< axes that no condition holds
        bool is_image;         ///< repeats another node of a periodic axis or rank
    };
    /// A listed node in walls.
    struct Touch {
        std::size_t number;  ///< in the list
        Node node;
        std::vector<int> walls;
    };

    /// The nodes with mass that lie in walls, without images.
    std::vector<Touch> touches(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, const Lanes* nodes) const
    {
        std::vector<Touch> r;
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            if (std::vector<int> touched = touched_by(nodes_[i], walls, shifts, nodes); !touched.empty() && !nodes_[i].is_image)
                r.push_back({i, nodes_[i], std::move(touched)});
        return r;
    }

    /// What a wall does to a listed node, see `repeat`; for whoever solves for the impulses in place of `advance`.
    void set_grip(std::size_t number, int wall, Grip grip) { grips_[number * walls_ + wall] = grip; }
    Grip grip(std::size_t number, int wall) const { return grips_[number * walls_ + wall]; }

  private:
    std::vector<int> touched_by(const Node& at, const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts,
                                const Lanes* nodes) const
    {
        std::vector<int> r;
        for (std::size_t k = 0; k < walls.size() && nodes[at.node][NodeLane::mass] > 0; ++k)
            if (walls[k].distance(at.x, shifts[k]) <= tolerance_) r.push_back(static_cast<int>(k));
        return r;
    }

    /// f(i, walls, node record, note) for each listed node i with mass in a wall, in parallel.
    template <class F>
    void for_each(const std::vector<Wall<D>>& walls, const std::vector<Vec<D>>& shifts, Lanes* nodes, const ExchangeSums<D>& sums,
                  F&& f) const
    {
        sums.for_each(static_cast<std::ptrdiff_t>(nodes_.size()), [&](std::ptrdiff_t i, auto&& note) {
            const std::vector<int> touched = touched_by(nodes_[i], walls, shifts, nodes);
            if (!touched.empty()) f(static_cast<std::size_t>(i), touched, nodes[nodes_[i].node], note);
        });
    }

    double tolerance_  = 0.0;  ///< m
    std::size_t walls_ = 0;
    std::vector<Node> nodes_;
    std::vector<Grip> grips_;  ///< [node][wall], of the last `advance`
};

}  // namespace ordo
