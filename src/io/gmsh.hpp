// The content of a mesh file as Gmsh's library reads it, unchecked. Used by mesh_file.cpp; must not include Gmsh's headers.
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
    /// A physical group; its name is its number if it has none.
    struct Group {
        int dim;
        std::string name;
        std::vector<int> entities;
    };
    std::vector<std::size_t> nodes;
    std::vector<double> x;  ///< three coordinates per node
    std::vector<Block> blocks;
    std::vector<Group> groups;
};

/// Whether this build can read meshes.
bool has_gmsh();

/// Reads a file of format 2.2 or 4.1. Throws InputError if there is no such file or library, or if Gmsh cannot read the file.
/// Gmsh runs in a forked process, because damaged files crash it (4.8.4, tests/fuzz/mesh_file.cpp).
GmshMesh load_gmsh(const std::filesystem::path& file);

}  // namespace ordo::io
