// Dirichlet conditions: fixed, symmetry (slip), prescribed velocity and displacement, on the grid's faces, on any plane, in a region
// or on the nodes that a body reaches. The explicit step, the consistent mass matrix, enriched corners and splines ask here what
// is held, and how.
#pragma once

#include "base/field.hpp"
#include "base/parallel.hpp"
#include "grid/exchange.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

namespace ordo {

enum class ConditionType { fixed, symmetry, velocity, displacement };

/// Of velocities: their time, and the length of the step between the positions around it.
struct Moment {
    double t  = 0.0;  ///< s
    double dt = 0.0;  ///< s; 0 before the first step
};
/// Half a step before, at the positions that the forces belong to: work is force times the velocity there.
inline Moment middle_of(const Moment& when) { return {when.t - 0.5 * when.dt, when.dt}; }

/// A condition on the nodes at or beyond the plane x_axis = at, on the outer side, or on those in a region, or on those that
/// the particles of a body reach. A plane between two nodes thus acts from the first node beyond it. Splines interpolate at the
/// grid's faces only: on a plane inside the grid they are held from the first Greville point beyond it.
template <int D>
struct Condition {
    int axis            = 0;
    bool outer_is_above = false;  ///< x-max faces: nodes with x >= at; x-min faces: nodes with x <= at
    double at           = 0.0;
    ConditionType type  = ConditionType::fixed;
    std::array<std::optional<Field>, D> value{};  ///< velocity, or displacement as a function of t; without a value free
    std::function<bool(const Vec<D>&)> region{};  ///< if given, takes the place of the plane
    std::optional<int> body{};                    ///< if given, takes the place of the plane
    int boundary = 0;                             ///< the boundary of the case that it belongs to

    bool is_plane() const { return !region && !body; }
    /// Whether it gives nodes an acceleration that particles receive.
    bool is_prescribed() const { return type == ConditionType::velocity || type == ConditionType::displacement; }

    /// Whether a place is at or beyond the plane, or in the region; on a grid of this spacing, so that a plane given at a
    /// node's coordinate is on that node. False for conditions of bodies, which have no place of their own.
    bool covers(const Vec<D>& x, const Vec<D>& spacing) const
    {
        if (body) return false;
        if (region) return region(x);
        const double tolerance = 1e-9 * spacing[axis];
        return outer_is_above ? x[axis] >= at - tolerance : x[axis] <= at + tolerance;
    }
    bool constrains(int component) const
    {
        switch (type) {
        case ConditionType::fixed: return true;
        case ConditionType::symmetry: return component == axis;
        case ConditionType::velocity:
        case ConditionType::displacement: return value[component].has_value();
        }
        return false;
    }
    /// Of a constrained component at a place, m/s. Displacements change in a step by exactly dt times this.
    double velocity(int component, const Vec<D>& x, const Moment& when) const
    {
        if (!is_prescribed()) return 0.0;
        const auto at_time = [&](double t) { return (*value[component])({padded(x), padded(x), std::max(t, 0.0)}); };
        if (type == ConditionType::velocity) return at_time(when.t);
        if (!(when.dt > 0)) return 0.0;
        return (at_time(when.t + 0.5 * when.dt) - at_time(when.t - 0.5 * when.dt)) / when.dt;
    }
};

/// Whether a condition covers a place in the first period or its images; only regions may cross the seams of periodic axes.
template <int D>
bool covers_in_periods(const Condition<D>& b, const Vec<D>& x, const Lattice<D>& lattice)
{
    if (!b.region) return b.covers(x, lattice.h);
    bool r = false;
    IndexBox<D>{Index<D>::filled(-1), Index<D>::filled(2)}.for_each([&](const Index<D>& turn) {
        Vec<D> image = x;
        bool is_one  = true;
        for (int a = 0; a < D; ++a) {
            image[a] += turn[a] * (lattice.cells[a] * lattice.h[a]);
            is_one = is_one && (turn[a] == 0 || lattice.periodic[a]);
        }
        r = r || (is_one && b.covers(image, lattice.h));
    });
    return r;
}

/// The condition that holds a component at a place, or -1: the last one given of those for which `acts(k)` holds.
template <int D, class Acts>
int holding(const std::vector<Condition<D>>& conditions, int component, Acts&& acts)
{
    int k = static_cast<int>(conditions.size()) - 1;
    while (k >= 0 && !(conditions[k].constrains(component) && acts(k))) --k;
    return k;
}

/// Holds a component of a node at the velocity v. With `has_increment` the increment leads from the projected velocity to v,
/// a_i = (v - v_i)/dt; else it is zero, because FLIP reads it.
inline void hold(Lanes& node, int component, double v, bool has_increment)
{
    double& velocity       = node[NodeLane::velocity + component];
    double& increment      = node[NodeLane::increment + component];
    const double projected = velocity - increment;
    velocity               = v;
    increment              = has_increment ? v - projected : 0.0;
}

/// Velocity and increment lanes of a node as they leave to particles: with PIC part `pic` of a step these gain the momentum
/// m ((1 - pic) increment + pic velocity).
inline double carried(const Lanes& node, int component, double pic)
{
    return node[NodeLane::mass] *
           ((1.0 - pic) * node[NodeLane::increment + component] + pic * node[NodeLane::velocity + component]);
}

/// The constrained components of nodes in the blocks that the material touches.
template <int D>
class Constraints {
  public:
    Constraints() = default;

    /// By planes and regions.
    Constraints(const std::vector<Condition<D>>& conditions, const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        std::vector<bool> covers(conditions.size());
        for (const Block<D>& block : tiles.blocks()) {
            const IndexBox<D> nodes = tiles.nodes_of(block);
            if (std::none_of(conditions.begin(), conditions.end(), [&](const auto& b) { return may_cover(b, lattice, nodes); }))
                continue;
            nodes.for_each([&](const Index<D>& at) {
                const Vec<D> x = position_of(lattice, lattice.inside_period(at));
                for (std::size_t k = 0; k < covers.size(); ++k) covers[k] = covers_in_periods(conditions[k], x, lattice);
                for (int a = 0; a < D; ++a)
                    if (const int k = holding(conditions, a, [&](int c) { return covers[c]; }); k >= 0)
                        add(conditions, k, a, block.first_node + lattice.offset(at), place_of(lattice, at),
                            lattice.is_image(at) || !tiles.counts_record(block.first_node + lattice.offset(at)));
            });
        }
    }

    /// Adds the components that condition k constrains at a node with a place. `is_image`: the node repeats another of a periodic
    /// axis or rank, whose force counts for both.
    void add(const std::vector<Condition<D>>& conditions, int k, std::ptrdiff_t node, const Vec<D>& x, bool is_image)
    {
        for (int a = 0; a < D; ++a)
            if (conditions[k].constrains(a)) add(conditions, k, a, node, x, is_image);
    }
    /// Of several conditions that were added for a component of a node, keeps the last.
    void keep_last()
    {
        auto same = [](const Held& a, const Held& b) { return a.node == b.node && a.component == b.component; };
        std::stable_sort(held_.begin(), held_.end(), [](const Held& a, const Held& b) {
            return std::pair(a.node, a.component) < std::pair(b.node, b.component);
        });
        held_.erase(held_.begin(), std::unique(held_.rbegin(), held_.rend(), same).base());
    }
    void clear() { held_.clear(); }
    bool is_empty() const { return held_.empty(); }

    /// f(node, component, whether a velocity is prescribed) for each of them.
    template <class F>
    void for_each(F&& f) const
    {
        for (const Held& h : held_) f(h.node, h.component, h.is_prescribed);
    }
    bool has_prescribed() const
    {
        return std::any_of(held_.begin(), held_.end(), [](const Held& h) { return h.is_prescribed; });
    }

    /// Sets velocity and increment of constrained components. `sums` gets what this changes, see `carried`.
    void apply(const std::vector<Condition<D>>& conditions, Lanes* nodes, const Moment& when, const ExchangeSums<D>& sums,
               double pic) const
    {
        sums.for_each(static_cast<std::ptrdiff_t>(held_.size()), [&](std::ptrdiff_t k, auto&& note) {
            const Held& h       = held_[k];
            Lanes& node         = nodes[h.node];
            const double before = carried(node, h.component, pic);
            hold(node, h.component, velocity_of(h, conditions, when), h.is_prescribed);
            if (sums.is_wanted() && !h.is_image) note(impulse_of(h, conditions, when, carried(node, h.component, pic) - before));
        });
    }

    /// Adds the impulses impulse(node, component), N s, that a solution found for the constrained components.
    template <class Impulse>
    void add_impulses(const std::vector<Condition<D>>& conditions, const Moment& when, const ExchangeSums<D>& sums,
                      const Impulse& impulse) const
    {
        for (const Held& h : held_) {
            const double one = impulse(h.node, h.component);
            if (!h.is_image) sums.add(impulse_of(h, conditions, when, one));
        }
    }

    /// f(node, component, whether it is prescribed, its velocity) for each of them.
    template <class F>
    void for_each_velocity(const std::vector<Condition<D>>& conditions, const Moment& when, F&& f) const
    {
        for (const Held& h : held_) f(h.node, h.component, h.is_prescribed, velocity_of(h, conditions, when));
    }

    /// Where a node's value is asked for: nodes of the margin take that of the grid's edge, the expression need not
    /// mean anything outside.
    static Vec<D> place_of(const Lattice<D>& lattice, Index<D> at)
    {
        for (int a = 0; a < D; ++a)
            at[a] = std::clamp(at[a], lattice.margin, lattice.margin + lattice.cells[a] + lattice.basis.degree - 1);
        return position_of(lattice, at);
    }

  private:
    struct Held {
        std::ptrdiff_t node;
        int component, condition;
        bool is_prescribed, is_image;
        Vec<D> x;
    };

    void add(const std::vector<Condition<D>>& conditions, int k, int component, std::ptrdiff_t node, const Vec<D>& x,
             bool is_image)
    {
        held_.push_back({node, component, k, conditions[k].is_prescribed(), is_image, x});
    }

    static double velocity_of(const Held& h, const std::vector<Condition<D>>& conditions, const Moment& when)
    {
        return conditions[h.condition].velocity(h.component, h.x, when);
    }

    /// The work is that of the force over the step around the positions, with the velocity there.
    static NodeImpulse<D> impulse_of(const Held& h, const std::vector<Condition<D>>& conditions, const Moment& when,
                                     double impulse)
    {
        NodeImpulse<D> r{.boundary = conditions[h.condition].boundary};
        r.impulse[h.component] = impulse;
        if (h.is_prescribed) r.work = -impulse * velocity_of(h, conditions, middle_of(when));
        return r;
    }

    static Vec<D> position_of(const Lattice<D>& lattice, const Index<D>& at)
    {
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = lattice.node_position(a, at[a]);
        return x;
    }

    /// Whether a condition may hold nodes of a box; exact for planes.
    static bool may_cover(const Condition<D>& b, const Lattice<D>& lattice, const IndexBox<D>& nodes)
    {
        if (b.body) return false;
        if (b.region) return true;
        Index<D> outermost = nodes.lo;
        if (b.outer_is_above) outermost[b.axis] = nodes.hi[b.axis] - 1;
        return b.covers(position_of(lattice, outermost), lattice.h);
    }

    std::vector<Held> held_;
};

}  // namespace ordo
