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

/// Numbers p_k with which sum p_k n_k is nearest to v, for normals n_k; 0 for those that depend on earlier ones.
template <int D, class Normal>
std::vector<double> parts_along(const Vec<D>& v, const Normal& normal, std::size_t count)
{
    std::vector<Vec<D>> unit, basis;  // of Gram and Schmidt, and the normals that they come from
    std::vector<std::size_t> of;
    for (std::size_t k = 0; k < count; ++k) {
        Vec<D> rest = normal(k);
        for (const Vec<D>& e : unit) rest -= dot(rest, e) * e;
        if (!(norm(rest) > 1e-6 * norm(normal(k)))) continue;
        unit.push_back((1 / norm(rest)) * rest);
        basis.push_back(normal(k));
        of.push_back(k);
    }
    std::vector<double> parts(count, 0.0);
    Vec<D> left = v;
    for (std::size_t k = unit.size(); k-- > 0;) {  // the last direction belongs to the last normal alone
        const double part = dot(left, unit[k]) / dot(basis[k], unit[k]);
        parts[of[k]]      = part;
        left -= part * basis[k];
    }
    return parts;
}

template <int D>
Vec<D> lanes_of(const Lanes& node, int first)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = node[first + a];
    return r;
}

/// Adds what a wall demands of a node's free components x: the whole of them if it sticks, else the part along the normal.
/// `target` is what the node gets if the wall holds it, `given` what its components get that are not free.
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
WallContact<D>::WallContact(const Model<D>& model, State<D>& s, Lanes* nodes, const Lanes* known, const Moment& when, double dt)
    : model_(model),
      s_(s),
      nodes_(nodes),
      dt_(dt),
      u_(velocities(model.walls, when.t)),
      middle_(velocities(model.walls, middle_of(when).t))
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
    Reaction r{.normal = parts_along<D>(
                   all, [&](std::size_t k) { return normal(c, c.closed[k]); }, c.closed.size()),
               .tangential = all};
    for (std::size_t k = 0; k < c.closed.size(); ++k) {
        r.tangential -= r.normal[k] * normal(c, c.closed[k]);
        r.limit += model_.walls[c.closed[k]].friction * std::max(0.0, r.normal[k]);
    }
    return r;
}

/// Lets go what is pulled and closes what enters; with `one_wall` only the first of these. Returns whether anything has changed.
template <int D>
bool WallContact<D>::correct_set(Contact& c, bool one_wall) const
{
    const Reaction r = reaction(c);
    const Vec<D> v   = advanced(c);
    bool has_changed = false;
    std::vector<int> closed;
    for (const int k : c.touch.walls) {
        const auto at    = std::find(c.closed.begin(), c.closed.end(), k);
        const bool was   = at != c.closed.end();
        const double gap = dot(v - u_[k], model_.walls[k].normal);
        bool is          = was ? !(r.normal[static_cast<std::size_t>(at - c.closed.begin())] < -least_force(c))
                               : norm(normal(c, k)) > 1e-6 && gap < -1e-9 * speed_;
        if (is != was && has_changed && one_wall) is = was;
        has_changed = has_changed || is != was;
        if (is) closed.push_back(k);
    }
    if (!has_changed) return false;
    c.closed = closed;
    if (c.closed.empty()) c.sticks = false;
    if (c.closed.empty()) c.rubbing = {};
    return true;
}

/// Stops a node whose friction drives it, lets one slip that needs more than Coulomb's limit, and turns friction against the slip. Returns
/// whether anything has changed.
template <int D>
bool WallContact<D>::correct_friction(Contact& c) const
{
    constexpr double close = 1e-7;  // of the limit: friction converges linearly
    if (c.closed.empty()) return false;
    const Reaction r       = reaction(c);
    const double tolerance = close * r.limit + least_force(c);
    if (c.sticks) {
        const double size = norm(r.tangential);
        if (size <= r.limit + tolerance) return false;
        c.sticks  = false;
        c.rubbing = (r.limit / size) * r.tangential;
        return true;
    }
    const Vec<D> now = slip(c);
    if (r.limit > 0 && dot(now, c.rubbing) > 0) {
        c.sticks  = true;
        c.rubbing = {};
        return true;
    }
    const double size   = norm(now);
    const Vec<D> wanted = size > 1e-9 * speed_ ? (-r.limit / size) * now : c.rubbing;
    if (!(norm(wanted - c.rubbing) > tolerance)) return false;
    c.rubbing = wanted;
    return true;
}

template <int D>
void WallContact<D>::report(const Contact& c, const ExchangeSums<D>& sums) const
{
    const Reaction r = reaction(c);
    const Vec<D> v   = advanced(c);
    for (std::size_t k = 0; k < c.closed.size(); ++k) {
        const Wall<D>& wall = model_.walls[c.closed[k]];
        const double share  = r.limit > 0 ? wall.friction * std::max(0.0, r.normal[k]) / r.limit : 0.0;
        const Vec<D> pushed = dt_ * r.normal[k] * normal(c, c.closed[k]), rubbed = dt_ * share * r.tangential;
        sums.add({wall.boundary, pushed + rubbed, -dot(pushed, middle_[c.closed[k]]) - dot(rubbed, v)});
    }
}

template <int D>
void WallContact<D>::solve(const Solve& solve, const std::function<void()>& multiply, const ExchangeSums<D>& sums)
{
    constexpr int at_once = 12, of_friction = 30, most = 600;  // rounds; two or three are usual
    bool is_done     = false;
    int rubbed       = 0;
    const auto found = [](auto& contacts, auto&& correct, bool one) {
        bool r = false;
        for (Contact& c : contacts) {
            r = correct(c) || r;
            if (r && one) break;
        }
        return r;
    };
    for (int round = 0; round < most && !is_done; ++round) {
        put_forces();
        solve(all_held());
        multiply();
        speed_ = 0.0;
        for (const Contact& c : contacts_)
            speed_ = std::max({speed_, norm(advanced(c)), norm(c.v), dt_ * norm(c.force) / c.mass});
        const bool one = round >= at_once;
        if (found(
                contacts_, [&](Contact& c) { return correct_set(c, one); }, one))
            continue;
        is_done = rubbed++ == of_friction || !found(
                                                 contacts_, [&](Contact& c) { return correct_friction(c); }, false);
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
                demand(rows, model.walls[k], touch.node.is_free, grip == Grip::sticks, u[k],
                       {});  // prescribed ones are set later
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
