// Rigid solids that bodies meet: how far a point is from their surface, and their mass properties. Used by method/obstacle.hpp.
#pragma once

#include "base/vec.hpp"
#include "particles/seeding.hpp"

#include <array>
#include <optional>
#include <variant>
#include <vector>

namespace ordo {

template <int D>
struct HalfSpace {
    Vec<D> point{};   ///< on its surface, m
    Vec<D> normal{};  ///< of length 1, out of the solid
};

/// A full cylinder, in 3D.
template <int D>
struct Cylinder {
    Vec<D> center{};  ///< of its axis, m
    double radius = 0.0, height = 0.0;
    int axis = 2;
};

/// The triangles of a surface in 3D, their normals outwards. Corners at the same place are one.
class TriangleSurface {
  public:
    TriangleSurface() = default;
    /// Triangles without area, and those whose area is not finite, are left out.
    explicit TriangleSurface(const std::vector<std::array<Vec<3>, 3>>& triangles);

    /// The foot of a point on the surface.
    struct Nearby {
        double gap = 0.0;  ///< m, negative inside
        Vec<3> normal{};   ///< of length 1, outwards
    };
    /// The nearest foot within reach whose normal faces the direction n, if one is given (n . normal < -0.3). Points beyond the end of
    /// an open surface have none.
    std::optional<Nearby> nearest(const Vec<3>& x, const Vec<3>* n, double reach) const;

    bool is_closed() const { return open_edges_ == 0; }
    std::size_t open_edges() const { return open_edges_; }
    const std::vector<Vec<3>>& points() const { return points_; }
    const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }

  private:
    struct Node {
        Vec<3> low{}, high{};
        int begin = 0, end = 0;  ///< triangles of a leaf, in order_
        int right = 0;           ///< of others the second child; the first follows
    };
    void find_normals();
    int add_node(int begin, int end);

    std::vector<Vec<3>> points_;
    std::vector<std::array<int, 3>> triangles_;
    std::vector<Vec<3>> normals_;                      ///< of triangles
    std::vector<Vec<3>> point_normals_;                ///< sums of triangles' normals by their angles
    std::vector<std::array<Vec<3>, 3>> edge_normals_;  ///< of the edge from corner c to the next, sums of both sides
    std::vector<std::array<bool, 3>> is_open_;         ///< edges with one triangle
    std::vector<bool> is_open_point_;
    std::size_t open_edges_ = 0;
    std::vector<int> order_;
    std::vector<Node> nodes_;
};

template <int D>
using Solid = std::variant<HalfSpace<D>, Bounds<D>, Ball<D>, Cylinder<D>, TriangleSurface>;

/// A point's foot on a solid.
template <int D>
struct Clearance {
    double gap = 0.0;  ///< m, negative inside
    Vec<D> normal{};   ///< of length 1, out of the solid
};

/// The nearest part of a solid's surface to x within reach, of those that face a surface with outward normal `n` (n . normal <
/// -0.3), if one is given. No reach limits the depth in a half-space. None in the middle of a ball and beyond the end of an open surface.
template <int D>
std::optional<Clearance<D>> clearance(const Solid<D>& solid, const Vec<D>& x, const Vec<D>* n, double reach);

/// Bounds; infinite for half-spaces.
template <int D>
Bounds<D> bounds_of(const Solid<D>& solid);

/// Of a solid of density 1. The inertia is about the centre, along the axes of space; in 2D for a metre of depth, zz alone counts.
template <int D>
struct Bulk {
    double volume = 0.0;  ///< m^D
    Vec<D> center{};
    Mat<3> inertia{};
};
/// None for half-spaces and open surfaces.
template <int D>
std::optional<Bulk<D>> bulk_of(const Solid<D>& solid);

/// Where a solid naturally turns about: its centre, a point of a half-space, the middle of the bounds of an open surface.
template <int D>
Vec<D> middle_of(const Solid<D>& solid);

}  // namespace ordo
