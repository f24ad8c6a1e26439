// Stands in for src/io/gmsh.cpp: what Gmsh's library hands over, read from text like its format 2.2. Without any judgement:
// nodes may be missing, repeated or not finite, numbers of entities anything.
#include "io/gmsh.hpp"

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <tuple>

namespace ordo::io {

namespace {

/// Corners of the types 1 to 9 of elements, and 15, a point.
int corners_of(int type)
{
    constexpr int count[] = {0, 2, 3, 4, 4, 8, 6, 5, 3, 6};
    return type == 15 ? 1 : type >= 0 && type < 10 ? count[type] : 0;
}
int dim_of(int type)
{
    constexpr int dim[] = {0, 1, 2, 2, 3, 3, 3, 3, 1, 2};
    return type >= 0 && type < 10 ? dim[type] : 0;
}

std::vector<double> numbers(const std::string& line)
{
    std::vector<double> r;
    const char* at = line.c_str();
    for (char* end = nullptr;; at = end) {
        const double value = std::strtod(at, &end);
        if (end == at) return r;
        r.push_back(value);
    }
}

int to_int(double value) { return value > -1e9 && value < 1e9 ? static_cast<int>(value) : 0; }
std::size_t to_number(double value) { return value >= 0 && value < 1e18 ? static_cast<std::size_t>(value) : 0; }

using Key = std::tuple<int, int, int>;  // dimension, entity, type

/// "number type count tags.. nodes.."; the first tag is the group, the second the entity.
void add_element(const std::vector<double>& line, std::map<Key, GmshMesh::Block>& blocks, std::map<Key, GmshMesh::Group>& groups)
{
    if (line.size() < 3) return;
    const int type = to_int(line[1]), tags = to_int(line[2]), corners = corners_of(type), dim = dim_of(type);
    if (corners == 0 || tags < 0 || line.size() < std::size_t(3 + tags + corners)) return;
    const int group = tags > 0 ? to_int(line[3]) : 0, entity = tags > 1 ? to_int(line[4]) : 0;
    GmshMesh::Block& block = blocks[{dim, entity, type}];
    block.dim = dim, block.entity = entity, block.type = type, block.nodes_per_element = corners;
    block.name = "Type " + std::to_string(type);
    block.elements.push_back(to_number(line[0]));
    for (int c = 0; c < corners; ++c) block.nodes.push_back(to_number(line[3 + tags + c]));
    GmshMesh::Group& g = groups[{dim, group, 0}];
    g.dim              = dim;
    g.name             = group == 1 ? "part" : std::to_string(group);
    g.entities.push_back(entity);
}

}  // namespace

bool has_gmsh() { return true; }

GmshMesh load_gmsh(const std::filesystem::path& path)
{
    std::ifstream in(path);
    GmshMesh mesh;
    std::map<Key, GmshMesh::Block> blocks;
    std::map<Key, GmshMesh::Group> groups;
    std::string section;
    for (std::string line; std::getline(in, line);) {
        if (line.starts_with('$')) {
            section = line;
            if (!line.starts_with("$End")) std::getline(in, line);  // how many there are: not asked
            continue;
        }
        const std::vector<double> of = numbers(line);
        if (section == "$Elements") add_element(of, blocks, groups);
        if (section != "$Nodes" || of.size() < 4) continue;
        mesh.nodes.push_back(to_number(of[0]));
        mesh.x.insert(mesh.x.end(), of.begin() + 1, of.begin() + 4);
    }
    for (auto& [key, block] : blocks) mesh.blocks.push_back(std::move(block));
    for (auto& [key, group] : groups) mesh.groups.push_back(std::move(group));
    return mesh;
}

}  // namespace ordo::io
