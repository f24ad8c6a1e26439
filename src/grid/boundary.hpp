// Dirichlet conditions on grid nodes: fixed, symmetry (slip) and prescribed velocity, on the grid's faces or on any plane.
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

enum class BoundaryType { fixed, symmetry, velocity };

/// A condition on every node at or beyond the plane x_axis = at, on the outer side.
/// A plane between two nodes thus acts from the first node beyond it. Splines interpolate at the grid's faces only: on a
/// plane inside the grid they are held from the first Greville point beyond it.
template <int D>
struct Boundary {
    int axis            = 0;
    bool outer_is_above = false;  ///< x-max faces: nodes with x >= at; x-min faces: nodes with x <= at
    double at           = 0.0;
    BoundaryType type   = BoundaryType::fixed;
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
        case BoundaryType::fixed: return true;
        case BoundaryType::symmetry: return component == axis;
        case BoundaryType::velocity: return value[component].has_value();
        }
        return false;
    }
    /// Of a constrained component at a place and a time, m/s.
    double velocity(int component, const Vec<D>& x, double t) const
    {
        return type == BoundaryType::velocity ? (*value[component])({padded(x), padded(x), t}) : 0.0;
    }
};

/// The constrained components of nodes in the blocks that the material touches. Each has one condition: of several the
/// last one given.
template <int D>
class Constraints {
  public:
    Constraints() = default;
    Constraints(const std::vector<Boundary<D>>& boundaries, const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        std::vector<IndexBox<D>> parts(boundaries.size());
        for (const Index<D>& block : tiles.blocks()) {
            const IndexBox<D> nodes = tiles.nodes_of(block);
            bool has_any            = false;
            for (std::size_t k = 0; k < parts.size(); ++k) {
                parts[k] = outer_part(boundaries[k], lattice, nodes);
                has_any  = has_any || !parts[k].is_empty();
            }
            if (!has_any) continue;
            nodes.for_each([&](const Index<D>& at) {
                for (int a = 0; a < D; ++a) hold(boundaries, parts, lattice, at, a);
            });
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
    /// Fixed: both are zero, for FLIP reads the increment. Prescribed: the increment leads from the projected velocity
    /// to the prescribed one, a_i = (v_prescribed - v_i)/dt.
    void apply(const std::vector<Boundary<D>>& boundaries, Lanes* nodes, double t) const
    {
        parallel_for_each(static_cast<std::ptrdiff_t>(held_.size()), [&](std::ptrdiff_t k) {
            const Held& h          = held_[k];
            double& v              = nodes[h.node][NodeLane::velocity + h.component];
            double& dv             = nodes[h.node][NodeLane::increment + h.component];
            const double projected = v - dv;
            v                      = boundaries[h.boundary].velocity(h.component, h.x, t);
            dv                     = h.is_prescribed ? v - projected : 0.0;
        });
    }

    /// f(node, component, whether it is prescribed, its velocity at time t) for each of them.
    template <class F>
    void for_each_velocity(const std::vector<Boundary<D>>& boundaries, double t, F&& f) const
    {
        for (const Held& h : held_) f(h.node, h.component, h.is_prescribed, boundaries[h.boundary].velocity(h.component, h.x, t));
    }

  private:
    struct Held {
        std::ptrdiff_t node;
        int component, boundary;
        bool is_prescribed;
        Vec<D> x;
    };

    /// Component a of a node, by the last of the conditions on it.
    void hold(const std::vector<Boundary<D>>& boundaries, const std::vector<IndexBox<D>>& parts, const Lattice<D>& lattice,
              const Index<D>& at, int a)
    {
        for (int k = static_cast<int>(boundaries.size()) - 1; k >= 0; --k)
            if (boundaries[k].constrains(a) && parts[k].contains(at)) {
                held_.push_back({lattice.offset(at), a, k, boundaries[k].type == BoundaryType::velocity, place_of(lattice, at)});
                return;
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
    static IndexBox<D> outer_part(const Boundary<D>& b, const Lattice<D>& lattice, IndexBox<D> box)
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
