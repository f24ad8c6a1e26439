// Particle domains that are cells of a mesh: corners are stored once and shared by the cells around them.
#pragma once

#include "base/vec.hpp"

#include <vector>

namespace ordo {

/// The corners of a cell. A segment, quadrilateral or hexahedron has 2^D: corner c lies on the + side of local axis d if bit d
/// of c is set. A triangle or tetrahedron has D + 1, in positive orientation; its other entries are -1.
template <int D>
struct CornerIds {
    int c[1 << D];

    ORDO_FLAT int& operator[](int k) { return c[k]; }
    ORDO_FLAT int operator[](int k) const { return c[k]; }
    ORDO_FLAT bool is_simplex() const { return D > 1 && c[(1 << D) - 1] < 0; }
    ORDO_FLAT int count() const { return is_simplex() ? D + 1 : 1 << D; }
};

/// Cells that tile a body.
template <int D>
struct CellMesh {
    std::vector<Vec<D>> corners;  ///< m
    std::vector<CornerIds<D>> cells;
};

}  // namespace ordo
