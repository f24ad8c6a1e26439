#include "io/mesh_file.hpp"

#include "io/gmsh.hpp"
#include "io/schema.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <tuple>
#include <unordered_map>

namespace ordo::io {

namespace {

/// Lengths and sines below this are round-off of coordinates with 16 digits.
constexpr double kRoundOff = 1e-9;

/// Cells with the numbers and types of their elements, for messages.
template <int D>
struct NumberedCells {
    std::string file;
    CellMesh<D> mesh;
    std::vector<std::size_t> numbers;
    std::vector<const std::string*> types;

    [[noreturn]] void fail_at(std::size_t cell, std::string_view message) const
    {
        fail({file}, fmt::format("element {} ({})", numbers[cell], *types[cell]), message);
    }
};

void require_dimension(const std::string& file, const GmshMesh& mesh, int dim)
{
    const GmshMesh::Block* top = nullptr;
    for (const GmshMesh::Block& block : mesh.blocks)
        if (!block.elements.empty() && (!top || block.dim > top->dim)) top = &block;
    if (top && top->dim == dim) return;
    const std::string has = top ? fmt::format("has dimension {} ({})", top->dim, top->name) : "holds no elements";
    const std::string set = top && top->dim > 0 ? fmt::format("set grid.dim = {} or ", top->dim) : "";
    fail({file}, "mesh",
         fmt::format("{}, the case {}; {}save one of dimension {}: gmsh -{} part.geo -o part.msh. If there are physical "
                     "groups, Gmsh saves only their elements",
                     has, dim, set, dim, dim));
}

/// The entities of a group, or of all elements.
std::set<int> entities_of(const std::string& file, const GmshMesh& mesh, int dim, const std::string& name)
{
    std::set<int> entities;
    std::vector<std::string> names;
    int other_dim = -1;
    for (const GmshMesh::Block& block : mesh.blocks)
        if (name.empty() && block.dim == dim) entities.insert(block.entity);
    for (const GmshMesh::Group& group : mesh.groups) {
        if (group.dim == dim) names.push_back(group.name);
        if (group.dim != dim && group.name == name) other_dim = group.dim;
        if (group.dim == dim && group.name == name) entities.insert(group.entities.begin(), group.entities.end());
    }
    if (!entities.empty()) return entities;
    if (names.empty())
        fail({file}, "group",
             fmt::format("the mesh has no physical group of dimension {}; leave the group out for all elements", dim));
    if (other_dim >= 0)
        fail({file}, "group",
             fmt::format("\"{}\" has dimension {}, cells need {}. There is: {}", name, other_dim, dim, fmt::join(names, ", ")));
    fail({file}, "group",
         fmt::format("there is no physical group \"{}\" of dimension {}. {}", name, dim, suggestion(name, names)));
}

/// The places of a cell's corners in an element of Gmsh; empty for a type that cannot be a cell. Gmsh goes around quadrilaterals
/// and the ends of hexahedra, while corners of cells are numbered by bits.
std::vector<int> corner_order(int type)
{
    switch (type) {  // numbers of the format, Gmsh's manual, "MSH file format"
    case 1: return {0, 1};
    case 2: return {0, 1, 2};
    case 3: return {0, 1, 3, 2};
    case 4: return {0, 1, 2, 3};
    case 5: return {0, 1, 3, 2, 4, 5, 7, 6};
    }
    return {};
}

using Point = std::array<double, 3>;

/// The nodes that cells use, in the order of their first use.
class UsedNodes {
  public:
    explicit UsedNodes(const GmshMesh& mesh) : mesh_(mesh)
    {
        for (std::size_t k = 0; k < mesh.nodes.size(); ++k) place_[mesh.nodes[k]] = k;
    }
    /// The dense number of a node; -1 if the mesh does not have it.
    int number(std::size_t node)
    {
        const auto found = place_.find(node);
        if (found == place_.end()) return -1;
        const auto [entry, is_new] = dense_.try_emplace(node, static_cast<int>(points.size()));
        const double* x            = &mesh_.x[3 * found->second];
        if (is_new) points.push_back({x[0], x[1], x[2]});
        return entry->second;
    }
    std::vector<Point> points;

  private:
    const GmshMesh& mesh_;
    std::unordered_map<std::size_t, std::size_t> place_;
    std::unordered_map<std::size_t, int> dense_;
};

/// The points in D dimensions; the other coordinates must be constant.
template <int D>
std::vector<Vec<D>> project(const std::string& file, const std::vector<Point>& points)
{
    Point low = points.front(), high = low;
    double extent = 0;
    for (const Point& p : points)
        for (int a = 0; a < 3; ++a) {
            low[a]  = std::min(low[a], p[a]);
            high[a] = std::max(high[a], p[a]);
            extent  = std::max(extent, high[a] - low[a]);
        }
    for (int a = D; a < 3; ++a)
        if (high[a] - low[a] > kRoundOff * extent)
            fail({file}, "mesh",
                 fmt::format("{} runs from {:.6g} to {:.6g}; a body of {} dimension{} must lie {}", "xyz"[a], low[a], high[a], D,
                             D > 1 ? "s" : "", D > 1 ? "in a plane z = const" : "on a line parallel to the x axis"));
    std::vector<Vec<D>> r(points.size());
    for (std::size_t k = 0; k < points.size(); ++k)
        for (int a = 0; a < D; ++a) r[k][a] = points[k][a];
    return r;
}

template <int D>
NumberedCells<D> cells_of(const std::string& file, const GmshMesh& mesh, const std::set<int>& entities)
{
    constexpr std::string_view kCells[] = {"segments", "triangles and quadrilaterals", "tetrahedra and hexahedra"};
    NumberedCells<D> r{file, {}, {}, {}};
    UsedNodes used(mesh);
    for (const GmshMesh::Block& block : mesh.blocks) {
        if (block.dim != D || !entities.contains(block.entity)) continue;
        const std::vector<int> order = corner_order(block.type);
        for (std::size_t e = 0; e < block.elements.size(); ++e) {
            r.numbers.push_back(block.elements[e]);
            r.types.push_back(&block.name);
            const std::size_t cell = r.mesh.cells.size();
            if (order.empty())
                r.fail_at(cell, fmt::format("cells are first-order {}; mesh the part with those, of order 1", kCells[D - 1]));
            CornerIds<D>& corners = r.mesh.cells.emplace_back();
            std::fill(std::begin(corners.c), std::end(corners.c), -1);
            for (int k = 0; const int place : order) {
                const std::size_t node = block.nodes[e * block.nodes_per_element + place];
                corners[k]             = used.number(node);
                if (corners[k++] < 0) r.fail_at(cell, fmt::format("its node {} is not in the file; save the mesh again", node));
            }
        }
    }
    if (r.mesh.cells.empty()) fail({file}, "group", "holds no elements; save the mesh again");
    r.mesh.corners = project<D>(file, used.points);
    return r;
}

/// The Jacobian at a corner divided by the lengths of its edges, a sine; zero if an edge has length zero.
template <int D>
double sine_at(const CellMesh<D>& mesh, const CornerIds<D>& cell, int corner)
{
    Mat<D> edges;
    double lengths = 1;
    for (int d = 0; d < D; ++d) {
        const int from = cell.is_simplex() ? 0 : corner & ~(1 << d), to = cell.is_simplex() ? d + 1 : corner | 1 << d;
        const Vec<D> edge = mesh.corners[cell[to]] - mesh.corners[cell[from]];
        for (int a = 0; a < D; ++a) edges(a, d) = edge[a];
        lengths *= norm(edge);
    }
    return lengths > 0 ? det(edges) / lengths : 0;
}

template <int D>
void turn_over(CornerIds<D>& cell)
{
    if (cell.is_simplex()) return std::swap(cell[D - 1], cell[D]);
    for (int k = 0; k < 1 << D; k += 2) std::swap(cell[k], cell[k + 1]);
}

/// Makes the orientation of each cell positive.
template <int D>
void orient(NumberedCells<D>& cells)
{
    for (std::size_t k = 0; k < cells.numbers.size(); ++k) {
        CornerIds<D>& cell = cells.mesh.cells[k];
        const int count    = cell.is_simplex() ? 1 : cell.count();
        int positive = 0, negative = 0;
        for (int c = 0; c < count; ++c) {
            const double sine = sine_at(cells.mesh, cell, c);
            if (sine > kRoundOff) ++positive;
            if (sine < -kRoundOff) ++negative;
        }
        if (negative == count)
            turn_over(cell);
        else if (positive < count)
            cells.fail_at(k, "is flat, not convex or partly turned inside out: its Jacobian is not positive at each corner; mesh "
                             "the part with other sizes or with gmsh -optimize");
    }
}

/// The corners of each face of a cell, anticlockwise when seen from outside.
template <int D>
std::vector<std::vector<int>> faces_of(bool simplex)
{
    if (D == 1) return {{0}, {1}};
    if (D == 2 && simplex) return {{0, 1}, {1, 2}, {2, 0}};
    if (D == 2) return {{0, 1}, {1, 3}, {3, 2}, {2, 0}};
    if (simplex) return {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    return {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
}

/// A face of a cell: a key that two cells share, and the side on which the cell lies.
struct Side {
    std::array<int, 4> face{-1, -1, -1, -1};
    bool positive    = false;
    std::size_t cell = 0;

    friend bool operator<(const Side& a, const Side& b)
    {
        return std::tie(a.face, a.positive, a.cell) < std::tie(b.face, b.positive, b.cell);
    }
};

template <int D>
std::vector<Side> sides_of(const CellMesh<D>& mesh)
{
    const auto simplex = faces_of<D>(true), box = faces_of<D>(false);
    std::vector<Side> sides;
    for (std::size_t k = 0; k < mesh.cells.size(); ++k) {
        const CornerIds<D>& cell = mesh.cells[k];
        const auto& faces        = cell.is_simplex() ? simplex : box;
        for (std::size_t i = 0; i < faces.size(); ++i) {
            Side side{.cell = k};
            const std::size_t n = faces[i].size();
            for (std::size_t c = 0; c < n; ++c) side.face[c] = cell[faces[i][c]];
            const auto begin = side.face.begin(), end = begin + n;
            if (D == 1) side.positive = i == 1;
            if (D == 2) side.positive = side.face[0] < side.face[1];
            std::rotate(begin, std::min_element(begin, end), end);
            if (D == 3) side.positive = side.face[1] < side.face[n - 1];
            std::sort(side.face.begin(), side.face.end());
            sides.push_back(side);
        }
    }
    std::sort(sides.begin(), sides.end());
    return sides;
}

/// Cells on the same side of a common face overlap.
template <int D>
void require_tiling(const NumberedCells<D>& cells)
{
    const std::vector<Side> sides = sides_of(cells.mesh);
    for (std::size_t k = 1; k < sides.size(); ++k)
        if (sides[k].face == sides[k - 1].face && sides[k].positive == sides[k - 1].positive)
            cells.fail_at(sides[k].cell,
                          fmt::format("overlaps element {}: they lie on the same side of a common face; remove one. If elements "
                                      "are in two groups, save the mesh as format 4.1: 2.2 repeats them",
                                      cells.numbers[sides[k - 1].cell]));
}

}  // namespace

template <int D>
CellMesh<D> read_mesh(const std::filesystem::path& path, const std::string& group)
{
    const std::string file = path.string();
    const GmshMesh mesh    = load_gmsh(path);
    require_dimension(file, mesh, D);
    NumberedCells<D> cells = cells_of<D>(file, mesh, entities_of(file, mesh, D, group));
    orient(cells);
    require_tiling(cells);
    return std::move(cells.mesh);
}

template CellMesh<1> read_mesh(const std::filesystem::path&, const std::string&);
template CellMesh<2> read_mesh(const std::filesystem::path&, const std::string&);
template CellMesh<3> read_mesh(const std::filesystem::path&, const std::string&);

}  // namespace ordo::io
