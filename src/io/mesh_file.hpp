// Bodies from meshes: the elements of a Gmsh file as particle cells. gmsh.hpp reads the file.
#pragma once

#include "particles/cells.hpp"

#include <filesystem>
#include <string>

namespace ordo::io {

/// The cells of a mesh of format 2.2 or 4.1, lengths in m: first-order segments (D = 1, parallel to the x axis), triangles
/// and quadrilaterals (D = 2, in a plane z = const), tetrahedra and hexahedra (D = 3). `group` is the name of a physical group
/// of dimension D, or its number if it has no name; empty takes all elements of dimension D, which must be the mesh's highest.
/// Corners are in the order of first use; cells with negative orientation are turned over. Two nodes at one place stay two
/// corners, as along a crack; `Coherence Mesh` in Gmsh merges them.
///
/// Throws InputError "file: what: why; remedy", also for elements of other types, cells whose Jacobian is not positive at each
/// corner, cells that lie on the same side of a common face, and in a build without Gmsh.
template <int D>
CellMesh<D> read_mesh(const std::filesystem::path& file, const std::string& group = {});

}  // namespace ordo::io
