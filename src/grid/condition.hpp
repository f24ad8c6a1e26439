// Dirichlet conditions: fixed, symmetry (slip) and prescribed velocity, on the grid's faces or on any plane. The explicit step, the
// consistent mass matrix, enriched corners and splines ask here what is held, and how.
#pragma once

#include "base/field.hpp"
#include "base/parallel.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace ordo {

enum class ConditionType { fixed, symmetry, velocity };

/// A condition on every node at or beyond the plane x_axis = at, on the outer side.
/// A plane between two nodes thus acts from the first node beyond it. Splines interpolate at the grid's faces only: on a
/// plane inside the grid they are held from the first Greville point beyond it.
template <int D>
struct Condition {
    int axis            = 0;
    bool outer_is_above = false;  ///< x-max faces: nodes with x >= at; x-min faces: nodes with x <= at
    double at           = 0.0;
    ConditionType type  = ConditionType::fixed;
    std::array<std::optional<Field>, D> value{};  ///< velocity only; components without a value stay free

    /// Whether a coordinate along `axis` is at or beyond the plane; on a grid of this spacing, so that a plane given at a
    /// node's coordinate is on that node.
    bool covers(double x, double spacing) const
    {
        const double tolerance = 1e-9 * spacing;
        return outer_is_above ? x >= at - tolerance : x <= at + tolerance;
    }
    bool constrains(int component) const
    {
        switch (type) {
        case ConditionType::fixed: return true;
        case ConditionType::symmetry: return component == axis;
        case ConditionType::velocity: return value[component].has_value();
        }
        return false;
    }
    /// Of a constrained component at a place and a time, m/s.
    double velocity(int component, const Vec<D>& x, double t) const
    {
        return type == ConditionType::velocity ? (*value[component])({padded(x), padded(x), t}) : 0.0;
    }
};

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

/// The constrained components of nodes in the blocks that the material touches.
template <int D>
class Constraints {
  public:
    Constraints() = default;
    Constraints(const std::vector<Condition<D>>& conditions, const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        std::vector<IndexBox<D>> parts(conditions.size());
        for (const Index<D>& block : tiles.blocks()) {
            const IndexBox<D> nodes = tiles.nodes_of(block);
            bool has_any            = false;
            for (std::size_t k = 0; k < parts.size(); ++k) {
                parts[k] = outer_part(conditions[k], lattice, nodes);
                has_any  = has_any || !parts[k].is_empty();
            }
            if (!has_any) continue;
            nodes.for_each([&](const Index<D>& at) { find_held(conditions, parts, lattice, at); });
        }
    }

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

    /// Sets velocity and increment of constrained components; t is the time of the velocities.
    void apply(const std::vector<Condition<D>>& conditions, Lanes* nodes, double t) const
    {
        parallel_for_each(static_cast<std::ptrdiff_t>(held_.size()), [&](std::ptrdiff_t k) {
            const Held& h = held_[k];
            hold(nodes[h.node], h.component, conditions[h.condition].velocity(h.component, h.x, t), h.is_prescribed);
        });
    }

    /// f(node, component, whether it is prescribed, its velocity at time t) for each of them.
    template <class F>
    void for_each_velocity(const std::vector<Condition<D>>& conditions, double t, F&& f) const
    {
        for (const Held& h : held_)
            f(h.node, h.component, h.is_prescribed, conditions[h.condition].velocity(h.component, h.x, t));
    }

  private:
    struct Held {
        std::ptrdiff_t node;
        int component, condition;
        bool is_prescribed;
        Vec<D> x;
    };

    void find_held(const std::vector<Condition<D>>& conditions, const std::vector<IndexBox<D>>& parts, const Lattice<D>& lattice,
                   const Index<D>& at)
    {
        for (int a = 0; a < D; ++a) {
            const int k = holding(conditions, a, [&](int c) { return parts[c].contains(at); });
            if (k < 0) continue;
            held_.push_back({lattice.offset(at), a, k, conditions[k].type == ConditionType::velocity, place_of(lattice, at)});
        }
    }

    /// Where a node's value is asked for: nodes of the margin take that of the grid's edge, the expression need not
    /// mean anything outside.
    static Vec<D> place_of(const Lattice<D>& lattice, const Index<D>& at)
    {
        Vec<D> x{};
        for (int a = 0; a < D; ++a)
            x[a] = lattice.node_position(
                a, std::clamp(at[a], lattice.margin, lattice.margin + lattice.cells[a] + lattice.basis.degree - 1));
        return x;
    }

    /// The nodes of `box` at or beyond the plane.
    static IndexBox<D> outer_part(const Condition<D>& b, const Lattice<D>& lattice, IndexBox<D> box)
    {
        auto is_inner = [&](int k) { return !b.covers(lattice.node_position(b.axis, k), lattice.h[b.axis]); };
        int &lo = box.lo[b.axis], &hi = box.hi[b.axis];
        if (b.outer_is_above)
            while (lo < hi && is_inner(lo)) ++lo;
        else
            while (lo < hi && is_inner(hi - 1)) --hi;
        return box;
    }

    std::vector<Held> held_;
};

}  // namespace ordo
