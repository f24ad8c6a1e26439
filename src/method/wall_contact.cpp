#include "method/wall_contact.hpp"

#include "kernels/nodes.hpp"
#include "method/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

/// The solution x of normals: rows n_k x = b_k of least size, and the projection onto what the rows leave free: by Gram and Schmidt.
template <int D>
struct Rows {
    std::vector<Vec<D>> unit;
    std::vector<double> value;

    void add(Vec<D> n, double b)
    {
        const double size = norm(n);
        for (std::size_t k = 0; k < unit.size(); ++k) {
            const double part = dot(n, unit[k]);
            n -= part * unit[k];
            b -= part * value[k];
        }
        const double rest = norm(n);
        if (!(rest > 1e-6 * size)) return;
        unit.push_back((1 / rest) * n);
        value.push_back(b / rest);
    }
    HeldNode<D> held(std::ptrdiff_t node) const
    {
        HeldNode<D> r{node, Mat<D>::identity(), {}};
        for (std::size_t k = 0; k < unit.size(); ++k) {
            r.free = r.free - outer(unit[k], unit[k]);
            r.known += value[k] * unit[k];
        }
        return r;
    }
};

template <int D>
Vec<D> lanes_of(const Lanes& node, int first)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = node[first + a];
    return r;
}

/// Adds what a wall demands of a node's free components x: the whole of them if it sticks, else the part along the normal.
/// `target` is what the node gets if the wall holds it, with components that are not free as they are.
template <int D>
void demand(Rows<D>& rows, const Wall<D>& wall, Vec<D, bool> is_free, bool sticks, const Vec<D>& target, const Vec<D>& given)
{
    double fixed = 0.0;  // the part of the components that are not free
    for (int a = 0; a < D; ++a)
        if (!is_free[a]) fixed += wall.normal[a] * given[a];
    rows.add(along(is_free, wall.normal), dot(wall.normal, target) - fixed);
    for (int a = 0; sticks && a < D; ++a) {
        Vec<D> axis{};
        axis[a] = 1.0;
        if (is_free[a]) rows.add(axis, target[a]);
    }
}

}  // namespace

template <int D>
WallContact<D>::WallContact(const Model<D>& model, State<D>& s, Lanes* nodes, const Lanes* known, double t, double dt)
    : model_(model), s_(s), nodes_(nodes), dt_(dt), u_(velocities(model.walls, t))
{
    for (auto& touch : s.field.wall_nodes.touches(model.walls, s.wall_shifts, nodes)) {
        const Lanes& node = nodes[touch.node.node];
        Contact c{.touch = touch,
                  .mass  = node[NodeLane::mass],
                  .v     = velocity_of<D>(node),
                  .force = lanes_of<D>(node, NodeLane::increment)};
        for (int a = 0; a < D; ++a)
            if (!touch.node.is_free[a]) c.known[a] = known[touch.node.node][NodeLane::increment + a];
        guess(c);
        contacts_.push_back(std::move(c));
    }
    if (contacts_.empty()) return;
    make_room(s.wall_forces, s.field.nodes.size());
    copy(s.wall_forces.data(), nodes, s.field.tiles);
}

/// What the walls would do with lumped masses.
template <int D>
void WallContact<D>::guess(Contact& c) const
{
    Vec<D> v = c.v + dt_ * ((1 / c.mass) * c.force + model_.gravity);
    for (int a = 0; a < D; ++a)
        if (!c.touch.node.is_free[a]) v[a] = c.v[a] + dt_ * (c.known[a] + model_.gravity[a]);
    WallImpulses<D> impulses{};
    push(model_.walls, u_, c.touch.walls, c.touch.node.is_free, v, impulses);
    for (const int k : c.touch.walls) {
        if (!(impulses[k].normal > 0)) continue;
        c.closed.push_back(k);
        c.sticks = c.sticks || impulses[k].grip == Grip::sticks;
        c.rubbing += (c.mass / dt_) * impulses[k].tangential;
    }
}

template <int D>
Vec<D> WallContact<D>::acceleration(const Contact& c) const
{
    return lanes_of<D>(nodes_[c.touch.node.node], NodeLane::increment);
}

/// The advanced velocity relative to the wall, without what closed walls and conditions hold.
template <int D>
Vec<D> WallContact<D>::slip(const Contact& c) const
{
    Rows<D> rows;
    for (const int k : c.closed) rows.add(normal(c, k), 0.0);
    return rows.held(0).free * along(c.touch.node.is_free, advanced(c) - u_[c.closed.front()]);
}

template <int D>
HeldNode<D> WallContact<D>::held(const Contact& c) const
{
    Rows<D> rows;
    for (const int k : c.closed) {
        const Vec<D> target = (1 / dt_) * (u_[k] - c.v) - model_.gravity;  // the acceleration that leads to the wall's velocity
        demand(rows, model_.walls[k], c.touch.node.is_free, c.sticks, target, c.known);
    }
    return rows.held(c.touch.node.node);
}

template <int D>
std::vector<HeldNode<D>> WallContact<D>::all_held() const
{
    std::vector<HeldNode<D>> r;
    for (const Contact& c : contacts_)
        if (!c.closed.empty()) r.push_back(held(c));
    return r;
}

/// The forces without walls, and friction where nodes slip.
template <int D>
void WallContact<D>::put_forces()
{
    copy(nodes_, s_.wall_forces.data(), s_.field.tiles);
    for (const Contact& c : contacts_) {
        if (c.closed.empty() || c.sticks) continue;
        for (int a = 0; a < D; ++a) nodes_[c.touch.node.node][NodeLane::increment + a] += c.rubbing[a];
    }
}

template <int D>
typename WallContact<D>::Reaction WallContact<D>::reaction(const Contact& c) const
{
    const Vec<D> all =
        along(c.touch.node.is_free,
              lanes_of<D>(s_.field.mass.q[s_.field.mass.rows.row(c.touch.node.node)], NodeLane::increment) - c.force);
    Reaction r{.normal = std::vector<double>(c.closed.size(), 0.0), .tangential = all};
    // Parts along normals that are not orthogonal: sweeps of Gauss and Seidel, as for lumped masses.
    const int sweeps = sweeps_for(c.closed);
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (std::size_t k = 0; k < c.closed.size(); ++k) {
            const Vec<D> n = normal(c, c.closed[k]);
            if (dot(n, n) < 1e-12) continue;
            const double more = dot(r.tangential, n) / dot(n, n);
            r.normal[k] += more;
            r.tangential -= more * n;
        }
    for (std::size_t k = 0; k < c.closed.size(); ++k) r.limit += model_.walls[c.closed[k]].friction * std::max(0.0, r.normal[k]);
    return r;
}

/// Changes what a node breaks; returns whether it does. Without `may_rub` friction stays as it is.
template <int D>
bool WallContact<D>::correct(Contact& c, bool may_rub) const
{
    const double least_speed = 1e-9 * speed_, least_force = least_speed * c.mass / dt_;
    const Reaction r = reaction(c);
    std::vector<int> closed;
    for (std::size_t k = 0; k < c.closed.size(); ++k)
        if (!(r.normal[k] < -least_force)) closed.push_back(c.closed[k]);
    const Vec<D> v = advanced(c);
    for (const int k : c.touch.walls)
        if (std::find(c.closed.begin(), c.closed.end(), k) == c.closed.end() && norm(normal(c, k)) > 1e-6 &&
            dot(v - u_[k], model_.walls[k].normal) < -least_speed)
            closed.push_back(k);
    std::sort(closed.begin(), closed.end());
    const bool has_changed = closed != c.closed;
    if (has_changed) {
        c.closed = closed;
        if (c.closed.empty()) c.sticks = false, c.rubbing = {};
        return true;
    }
    if (c.closed.empty() || !may_rub) return false;
    if (c.sticks) {
        const double size = norm(r.tangential);
        if (size <= r.limit + least_force) return false;
        c.sticks  = false;
        c.rubbing = (r.limit / size) * r.tangential;
        return true;
    }
    const Vec<D> now = slip(c);
    if (r.limit > 0 && dot(now, c.rubbing) > 0) {  // friction would drive it
        c.sticks  = true;
        c.rubbing = {};
        return true;
    }
    const double size   = norm(now);
    const Vec<D> wanted = size > least_speed ? (-r.limit / size) * now : c.rubbing;
    const bool is_other = norm(wanted - c.rubbing) > 1e-9 * r.limit + least_force;
    if (is_other) c.rubbing = wanted;
    return is_other;
}

template <int D>
void WallContact<D>::report(const Contact& c, const ExchangeSums<D>& sums) const
{
    const Reaction r = reaction(c);
    const Vec<D> v   = advanced(c);
    for (std::size_t k = 0; k < c.closed.size(); ++k) {
        const Wall<D>& wall = model_.walls[c.closed[k]];
        const Vec<D> pushed = dt_ * r.normal[k] * normal(c, c.closed[k]), rubbed = k == 0 ? dt_ * r.tangential : Vec<D>{};
        sums.add({wall.boundary, pushed + rubbed, -dot(pushed, u_[c.closed[k]]) - dot(rubbed, v)});
    }
}

template <int D>
void WallContact<D>::solve(const Solve& solve, const std::function<void()>& multiply, const ExchangeSums<D>& sums)
{
    constexpr int at_once = 12, with_friction = 30, most = 400;  // rounds; two or three are usual
    bool is_done = false;
    for (int round = 0; round < most && !is_done; ++round) {
        put_forces();
        solve(all_held());
        multiply();
        speed_ = 0.0;
        for (const Contact& c : contacts_)
            speed_ = std::max({speed_, norm(advanced(c)), norm(c.v), dt_ * norm(c.force) / c.mass});
        is_done = true;
        for (Contact& c : contacts_)
            if (correct(c, round < with_friction)) {
                is_done = false;
                if (round >= at_once) break;
            }
    }
    if (!is_done && std::isfinite(speed_))
        throw NumericalError(
            fmt::format("step {}, t = {:.6g} s: no set of nodes was found that walls hold in {} rounds, near {}; "
                        "use method.mass = \"lumped\" or a smaller time step",
                        s_.n, s_.t, most, place_text(contacts_.front().touch.node.x)));
    for (const Contact& c : contacts_) {
        for (const int k : c.touch.walls) {
            const bool is_closed = std::find(c.closed.begin(), c.closed.end(), k) != c.closed.end();
            s_.field.wall_nodes.set_grip(c.touch.number, k, !is_closed ? Grip::none : c.sticks ? Grip::sticks : Grip::slips);
        }
        report(c, sums);
    }
}

template <int D>
std::vector<HeldNode<D>> held_by_walls(const Model<D>& model, const State<D>& s, const Lanes* nodes, double t)
{
    std::vector<HeldNode<D>> r;
    const std::vector<Vec<D>> u = velocities(model.walls, t);
    for (const auto& touch : s.field.wall_nodes.touches(model.walls, s.wall_shifts, nodes)) {
        Rows<D> rows;
        for (const int k : touch.walls)
            if (const Grip grip = s.field.wall_nodes.grip(touch.number, k); grip != Grip::none)
                demand(rows, model.walls[k], touch.node.is_free, grip == Grip::sticks, u[k], {});
        if (!rows.unit.empty()) r.push_back(rows.held(touch.node.node));
    }
    return r;
}

template class WallContact<1>;
template class WallContact<2>;
template class WallContact<3>;
template std::vector<HeldNode<1>> held_by_walls(const Model<1>&, const State<1>&, const Lanes*, double);
template std::vector<HeldNode<2>> held_by_walls(const Model<2>&, const State<2>&, const Lanes*, double);
template std::vector<HeldNode<3>> held_by_walls(const Model<3>&, const State<3>&, const Lanes*, double);

}  // namespace ordo
