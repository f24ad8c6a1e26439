// What Gmsh's library finds in a mesh file, unjudged. Used by mesh_file.cpp; must not show Gmsh's own headers.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

struct GmshMesh {
    /// The elements of one type in one entity (a curve, surface or volume of the geometry).
    struct Block {
        int dim, entity, type, nodes_per_element;
        std::string name;  ///< of the type, such as "Triangle 6"
        std::vector<std::size_t> elements, nodes;
    };
    /// A physical group; its number where it has no name.
    struct Group {
        int dim;
        std::string name;
        std::vector<int> entities;
    };
    std::vector<std::size_t> nodes;
    std::vector<double> x;  ///< three coordinates a node
    std::vector<Block> blocks;
    std::vector<Group> groups;
};

/// Whether this build can read meshes.
bool has_gmsh();

/// Reads a file of format 2.2 or 4.1; throws InputError where there is no such file or library, and where Gmsh cannot read
/// it. Gmsh runs in a process of its own, a fork of this one: damaged files crash it (4.8.4, tests/fuzz/mesh_file.cpp).
GmshMesh load_gmsh(const std::filesystem::path& file);

}  // namespace ordo::io
