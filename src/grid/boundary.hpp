// Dirichlet conditions on grid nodes: fixed, symmetry (slip) and prescribed velocity, on the grid's faces or on any plane.
#pragma once

#include "base/field.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace ordo {

enum class BoundaryType { fixed, symmetry, velocity };

/// A condition on every node at or beyond the plane x_axis = at, on the outer side.
/// A plane between two nodes thus acts from the first node beyond it.
template <int D>
struct Boundary {
    int axis            = 0;
    bool outer_is_above = false;  ///< x-max faces: nodes with x >= at; x-min faces: nodes with x <= at
    double at           = 0.0;
    BoundaryType type   = BoundaryType::fixed;
    std::array<std::optional<Field>, D> value{};  ///< velocity only; components without a value stay free
};

/// The constrained nodes of the blocks that the material touches. Later conditions win where they overlap.
template <int D>
class Constraints {
  public:
    Constraints() = default;
    Constraints(const std::vector<Boundary<D>>& boundaries, const Lattice<D>& lattice, const Tiles<D>& tiles)
        : boundaries_(&boundaries), nodes_(boundaries.size())
    {
        for (std::size_t k = 0; k < boundaries.size(); ++k)
            for (const Index<D>& block : tiles.blocks())
                outer_part(boundaries[k], lattice, tiles.nodes_of(block)).for_each([&](const Index<D>& at) {
                    Place place{.node = lattice.offset(at), .x = {}};
                    for (int a = 0; a < D; ++a) place.x[a] = lattice.node_position(a, at[a]);
                    nodes_[k].push_back(place);
                });
    }

    /// Sets velocity and increment of constrained nodes; t is the time of the velocities.
    /// Fixed: both are zero, for FLIP reads the increment. Prescribed: the increment leads from the projected velocity
    /// to the prescribed one, a_i = (v_prescribed - v_i)/dt.
    void apply(Lanes* nodes, double t) const
    {
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            const Boundary<D>& b = (*boundaries_)[k];
            for (const Place& place : nodes_[k])
                for (int a = 0; a < D; ++a) {
                    double& v  = nodes[place.node][NodeLane::velocity + a];
                    double& dv = nodes[place.node][NodeLane::increment + a];
                    if (b.type == BoundaryType::velocity) {
                        if (!b.value[a]) continue;
                        const Vec<3> x      = padded(place.x);
                        const double target = (*b.value[a])({x, x, t});
                        dv                  = target - (v - dv);
                        v                   = target;
                    } else if (b.type == BoundaryType::fixed || a == b.axis) {
                        v = dv = 0.0;
                    }
                }
        }
    }

  private:
    struct Place {
        std::ptrdiff_t node;
        Vec<D> x;
    };

    /// The nodes of `box` at or beyond the plane.
    static IndexBox<D> outer_part(const Boundary<D>& b, const Lattice<D>& lattice, IndexBox<D> box)
    {
        constexpr double tolerance = 1e-9;  // of a cell: a plane given at a node's coordinate is on that node
        const double plane         = lattice.cell_coordinate(b.axis, b.at);
        if (b.outer_is_above)
            box.lo[b.axis] = std::max(box.lo[b.axis], static_cast<int>(std::ceil(plane - tolerance)));
        else
            box.hi[b.axis] = std::min(box.hi[b.axis], static_cast<int>(std::floor(plane + tolerance)) + 1);
        return box;
    }

    const std::vector<Boundary<D>>* boundaries_ = nullptr;
    std::vector<std::vector<Place>> nodes_;
};

}  // namespace ordo
