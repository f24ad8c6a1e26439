// Cells from Gmsh meshes: exact volumes, conformity, orientation, groups, and a message for each bad mesh.
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "io/gmsh.hpp"
#include "io/mesh_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <clocale>
#include <fstream>
#include <map>
#include <numbers>
#include <set>

/// Gmsh 4.8.4 loses a kilobyte or so a process by itself; what it hands to ordo is freed.
extern "C" const char* __lsan_default_suppressions() { return "leak:libgmsh\n"; }  // NOLINT: its name is the sanitizer's

namespace ordo::io {
namespace {

using Cycles = std::vector<std::vector<int>>;

const std::filesystem::path data = ORDO_TEST_DATA;

bool says(std::string_view message, std::string_view part) { return message.find(part) != message.npos; }

/// The faces of a cell by their corners, in no particular orientation.
template <int D>
Cycles faces(const CornerIds<D>& cell)
{
    Cycles r;
    if (cell.is_simplex())
        for (int skip = 0; skip <= D; ++skip) {
            r.emplace_back();
            for (int k = 0; k <= D; ++k)
                if (k != skip) r.back().push_back(cell[k]);
        }
    else
        for (int d = 0; d < D; ++d)
            for (int side : {0, 1 << d}) {
                r.emplace_back();
                for (int k = 0; k < 1 << D; ++k)
                    if ((k & 1 << d) == side) r.back().push_back(cell[k]);
            }
    return r;
}

template <int D>
Vec<D> mean(const CellMesh<D>& mesh, const std::vector<int>& corners)
{
    Vec<D> r{};
    for (int c : corners) r += mesh.corners[c] * (1.0 / static_cast<double>(corners.size()));
    return r;
}

/// The area of a flat face times its unit normal, away from `inside`.
template <int D>
Vec<D> outward_area(const CellMesh<D>& mesh, const std::vector<int>& face, const Vec<D>& inside)
{
    Vec<D> area{};
    const Vec<D> x0 = mesh.corners[face[0]];
    if constexpr (D == 1) area[0] = 1;
    if constexpr (D == 2) {
        const Vec<2> e = mesh.corners[face[1]] - x0;
        area           = {e[1], -e[0]};
    }
    if constexpr (D == 3) {
        const bool quad = face.size() == 4;  // corners by bits: the diagonals are 0-3 and 1-2
        const Vec<3> e  = quad ? mesh.corners[face[3]] - x0 : mesh.corners[face[1]] - x0;
        const Vec<3> g  = quad ? mesh.corners[face[2]] - mesh.corners[face[1]] : mesh.corners[face[2]] - x0;
        for (int a = 0; a < 3; ++a) area[a] = 0.5 * (e[(a + 1) % 3] * g[(a + 2) % 3] - e[(a + 2) % 3] * g[(a + 1) % 3]);
    }
    return dot(area, mean(mesh, face) - inside) > 0 ? area : -area;
}

/// What the cells of a mesh amount to.
struct Sums {
    double volume = 0, surface = 0;  ///< m^D, and of the faces that one cell has m^(D-1)
    int interior = 0;                ///< faces that two cells have
};

/// The divergence theorem gives the volumes; each cell must be positive and each inner face have two opposite sides.
template <int D>
Sums check(const CellMesh<D>& mesh)
{
    Sums sums;
    std::map<std::set<int>, std::vector<Vec<D>>> sides;
    std::set<int> used;
    for (const CornerIds<D>& cell : mesh.cells) {
        const std::vector<int> corners(cell.c, cell.c + cell.count());
        used.insert(corners.begin(), corners.end());
        const Vec<D> centre = mean(mesh, corners);
        double volume       = 0;
        for (const std::vector<int>& face : faces(cell)) {
            const Vec<D> area = outward_area(mesh, face, centre);
            volume += dot(area, mean(mesh, face) - centre) / D;
            sides[{face.begin(), face.end()}].push_back(area);
        }
        EXPECT_GT(volume, 0);
        sums.volume += volume;

        Mat<D> edges;
        for (int d = 0; d < D; ++d)
            for (int a = 0; a < D; ++a)
                edges(a, d) = (mesh.corners[cell[cell.is_simplex() ? d + 1 : 1 << d]] - mesh.corners[cell[0]])[a];
        EXPECT_GT(det(edges), 0);
    }
    for (const auto& [face, areas] : sides) {
        EXPECT_LE(areas.size(), 2u);
        if (areas.size() == 1) sums.surface += norm(areas[0]);
        if (areas.size() == 2) {
            EXPECT_LT(norm(areas[0] + areas[1]), 1e-12);
            ++sums.interior;
        }
    }
    EXPECT_EQ(used.size(), mesh.corners.size());
    EXPECT_TRUE(!used.empty() && *used.begin() == 0 && *used.rbegin() == static_cast<int>(used.size()) - 1);
    return sums;
}

template <int D>
int simplices(const CellMesh<D>& mesh)
{
    int n = 0;
    for (const CornerIds<D>& cell : mesh.cells) n += cell.is_simplex();
    return n;
}

/// Tests that need Gmsh, with a folder of their own for the meshes that they write.
class Meshes : public testing::Test {
  protected:
    void SetUp() override
    {
        if (!has_gmsh()) GTEST_SKIP() << "built without Gmsh";
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        folder_          = std::filesystem::temp_directory_path() / fmt::format("ordo_meshes_{}_{}", test->name(), getpid());
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override
    {
        if (!folder_.empty()) std::filesystem::remove_all(folder_);
    }
    std::filesystem::path write(const std::string& text, const std::string& name = "bad.msh") const
    {
        std::ofstream(folder_ / name) << text;
        return folder_ / name;
    }
    /// A mesh of format 2.2; a node is "x y z", an element "type 2 group entity nodes..".
    std::filesystem::path write_mesh(const std::vector<std::string>& nodes, const std::vector<std::string>& elements) const
    {
        std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes.size()) + "\n";
        for (std::size_t k = 0; k < nodes.size(); ++k) text += std::to_string(10 * k + 10) + " " + nodes[k] + "\n";
        text += "$EndNodes\n$Elements\n" + std::to_string(elements.size()) + "\n";
        for (std::size_t k = 0; k < elements.size(); ++k) text += std::to_string(k + 7) + " " + elements[k] + "\n";
        return write(text + "$EndElements\n");
    }
    template <int D>
    static std::string error(const std::filesystem::path& file, const std::string& group = {})
    {
        try {
            read_mesh<D>(file, group);
        } catch (const InputError& e) {
            EXPECT_TRUE(std::string_view(e.what()).starts_with(file.string() + ": ")) << e.what();
            return e.what();
        }
        return "no error";
    }

  private:
    std::filesystem::path folder_;
};

const std::vector<std::string> unit_square = {"0 0 0", "1 0 0", "1 1 0", "0 1 0"};

TEST_F(Meshes, SegmentsOfABar)
{
    const auto mesh = read_mesh<1>(data / "bar.msh");
    const Sums sums = check(mesh);
    EXPECT_EQ(mesh.cells.size(), 7u);
    EXPECT_EQ(sums.interior, 6);
    EXPECT_NEAR(sums.volume, 2, 1e-14);
    EXPECT_NEAR(check(read_mesh<1>(data / "bar.msh", "right")).volume, 1.5, 1e-14);  // meshed from right to left
}

TEST_F(Meshes, QuadrilateralsOfAQuarterRing)
{
    const auto mesh  = read_mesh<2>(data / "quarter_ring.msh", "ring");
    const Sums sums  = check(mesh);
    const double arc = std::numbers::pi / 2 / 12;
    EXPECT_EQ(mesh.cells.size(), 36u);
    EXPECT_EQ(mesh.corners.size(), 4u * 13u);
    EXPECT_EQ(simplices(mesh), 0);
    EXPECT_EQ(sums.interior, 2 * 12 + 3 * 11);
    EXPECT_NEAR(sums.volume, 12 * 0.5 * std::sin(arc) * (0.36 - 0.16), 1e-9);  // Gmsh spaces the nodes to 1e-11
    EXPECT_NEAR(sums.surface, 0.4 + 24 * std::sin(arc / 2), 1e-9);
}

TEST_F(Meshes, TrianglesOfASquare)
{
    const auto mesh = read_mesh<2>(data / "square.msh");
    const Sums sums = check(mesh);
    EXPECT_EQ(simplices(mesh), static_cast<int>(mesh.cells.size()));
    EXPECT_NEAR(sums.volume, 1, 1e-13);
    EXPECT_NEAR(sums.surface, 4, 1e-13);
}

TEST_F(Meshes, QuadrilateralsBesideTriangles)
{
    const auto mesh = read_mesh<2>(data / "mixed.msh");
    const Sums sums = check(mesh);
    EXPECT_EQ(mesh.cells.size() - static_cast<std::size_t>(simplices(mesh)), 16u);
    EXPECT_GT(simplices(mesh), 0);
    EXPECT_NEAR(sums.volume, 1, 1e-13);
    EXPECT_NEAR(sums.surface, 4, 1e-13);  // conforming across the line between them
}

TEST_F(Meshes, TetrahedraOfACube)
{
    const auto mesh = read_mesh<3>(data / "cube_tets.msh");
    const Sums sums = check(mesh);
    EXPECT_EQ(simplices(mesh), static_cast<int>(mesh.cells.size()));
    EXPECT_NEAR(sums.volume, 1, 1e-13);
    EXPECT_NEAR(sums.surface, 6, 1e-13);
}

TEST_F(Meshes, HexahedraOfACube)
{
    const auto mesh = read_mesh<3>(data / "cube_hexes.msh", "cube");
    const Sums sums = check(mesh);
    EXPECT_EQ(mesh.cells.size(), 27u);
    EXPECT_EQ(mesh.corners.size(), 64u);
    EXPECT_EQ(simplices(mesh), 0);
    EXPECT_EQ(sums.interior, 54);
    EXPECT_NEAR(sums.volume, 1, 1e-9);
    EXPECT_NEAR(sums.surface, 6, 1e-9);
}

TEST_F(Meshes, CornersOfBoxesGoByBits)
{
    const auto quads = read_mesh<2>(data / "mixed.msh", "left");
    for (const auto& c : quads.cells) {
        const auto& x = quads.corners;
        EXPECT_LT(norm(x[c[1]] - x[c[0]] - x[c[3]] + x[c[2]]), 1e-9);  // squares: opposite sides are equal
    }
    const auto hexes = read_mesh<3>(data / "cube_hexes.msh");
    for (const auto& c : hexes.cells)
        for (int k = 0; k < 8; ++k)
            for (int d = 0; d < 3; ++d) {
                const auto& x = hexes.corners;
                EXPECT_LT(norm(x[c[k | 1 << d]] - x[c[k & ~(1 << d)]] - x[c[1 << d]] + x[c[0]]), 1e-9);
            }
}

TEST_F(Meshes, GroupsAreChosenByName)
{
    const auto file = data / "mixed.msh";
    const auto left = read_mesh<2>(file, "left"), right = read_mesh<2>(file, "right");
    EXPECT_EQ(left.cells.size(), 16u);
    EXPECT_EQ(simplices(left), 0);
    EXPECT_EQ(simplices(right), static_cast<int>(right.cells.size()));
    EXPECT_EQ(left.cells.size() + right.cells.size(), read_mesh<2>(file).cells.size());
    EXPECT_NEAR(check(left).volume, 0.5, 1e-9);
    EXPECT_NEAR(check(right).volume, 0.5, 1e-9);

    const auto unnamed = write_mesh(unit_square, {"2 2 5 1 10 20 30", "2 2 6 2 10 30 40"});
    EXPECT_EQ(read_mesh<2>(unnamed, "6").cells.size(), 1u);
}

TEST_F(Meshes, CellsInsideOutAreTurned)
{
    const auto clockwise = read_mesh<2>(write_mesh(unit_square, {"3 2 1 1 10 40 30 20"}));
    EXPECT_NEAR(check(clockwise).volume, 1, 1e-15);
    const auto mixed = read_mesh<2>(write_mesh(unit_square, {"2 2 1 1 10 20 30", "2 2 1 1 10 40 30"}));
    EXPECT_EQ(check(mixed).interior, 1);
    const std::vector<std::string> nodes = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
    EXPECT_NEAR(check(read_mesh<3>(write_mesh(nodes, {"4 2 1 1 10 30 20 40"}))).volume, 1.0 / 6, 1e-15);
}

TEST_F(Meshes, NodesAtOnePlaceStayApart)
{
    const auto mesh = read_mesh<2>(
        write_mesh({"0 0 0", "1 0 0", "1 1 0", "0 0 0", "1 1 0", "0 1 0"}, {"2 2 1 1 10 20 30", "2 2 1 1 40 50 60"}));
    EXPECT_EQ(mesh.corners.size(), 6u);
    EXPECT_EQ(check(mesh).interior, 0);
}

TEST_F(Meshes, ReadingLeavesTheProcessAsItWas)
{
    const std::string locale = std::setlocale(LC_ALL, nullptr);
    const int threads        = thread_count();
    set_thread_count(3);
    const int given  = thread_count();
    const auto first = read_mesh<2>(data / "mixed.msh"), second = read_mesh<2>(data / "mixed.msh");
    EXPECT_EQ(thread_count(), given);
    EXPECT_EQ(std::setlocale(LC_ALL, nullptr), locale);
    EXPECT_EQ(first.corners, second.corners);
    set_thread_count(threads);
}

TEST_F(Meshes, ScriptsBesideAMeshAreNotRun)
{
    const auto file = write_mesh(unit_square, {"3 2 1 1 10 20 30 40"}), made = write("", "made");
    std::filesystem::remove(made);
    write("SystemCall \"touch " + made.string() + "\";\n", "bad.msh.opt");
    read_mesh<2>(file);
    EXPECT_FALSE(std::filesystem::exists(made));
}

TEST_F(Meshes, WhatIsNotAMeshIsRefused)
{
    EXPECT_PRED2(says, error<2>("absent.msh"), "cannot be opened");
    EXPECT_PRED2(says, error<2>(data), "cannot be opened");
    EXPECT_PRED2(says, error<2>(data / "make_meshes.py"), "is not a Gmsh mesh");
    EXPECT_PRED2(says, error<2>(write("")), "is not a Gmsh mesh");
    EXPECT_PRED2(says, error<2>(write("$MeshFormat\n4.0 0 8\n$EndMeshFormat\n")), "format version 4.0");
    EXPECT_PRED2(says, error<2>(write_mesh({}, {})), "holds no elements");
    EXPECT_PRED2(says, error<2>(write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n")), "Gmsh cannot read it");
    EXPECT_PRED2(says, error<2>(write_mesh(unit_square, {"2 2 1 1 10 20 99"})), "Gmsh cannot read it");
}

/// A node more than its file counts ends Gmsh 4.8.4 with a signal, in the process that reads for this one.
TEST_F(Meshes, CrashesOfGmshAreRefused)
{
    const auto file =
        write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 0 0\n5 1 1 0\n6 0 1 0\n"
              "$EndNodes\n$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 4 5 6\n$EndElements\n");
    for (int k = 0; k < 3; ++k) {
        const std::string why = error<2>(file);
        EXPECT_TRUE(says(why, "Gmsh crashed (signal 11)") || says(why, "Gmsh cannot read it")) << why;
    }
    EXPECT_NEAR(check(read_mesh<2>(data / "square.msh")).volume, 1, 1e-13);
}

TEST_F(Meshes, OtherDimensionsAreRefused)
{
    EXPECT_PRED2(says, error<2>(data / "cube_tets.msh"), "has dimension 3 (Tetrahedron 4), the case 2; set grid.dim = 3 or");
    EXPECT_PRED2(says, error<3>(data / "square.msh"), "has dimension 2");
    EXPECT_PRED2(says, error<2>(write_mesh({"0 0 0", "1 0 0", "1 1 0.1"}, {"2 2 1 1 10 20 30"})),
                 "z runs from 0 to 0.1; a body of 2 dimensions must lie in a plane z = const");
    EXPECT_PRED2(says, error<1>(write_mesh({"0 0 0", "1 0.5 0"}, {"1 2 1 1 10 20"})), "y runs from 0 to 0.5");
}

TEST_F(Meshes, OtherElementsAreRefused)
{
    EXPECT_PRED2(
        says, error<2>(write_mesh({"0 0 0", "1 0 0", "0 1 0", "0.5 0 0", "0.5 0.5 0", "0 0.5 0"}, {"9 2 1 1 10 20 30 40 50 60"})),
        "element 7 (Triangle 6): cells are first-order triangles and quadrilaterals");
    EXPECT_PRED2(says,
                 error<3>(write_mesh({"0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 1", "0 1 1"}, {"6 2 1 1 10 20 30 40 50 60"})),
                 "element 7 (Prism 6): cells are first-order tetrahedra and hexahedra");
    EXPECT_PRED2(says, error<3>(write_mesh({"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1"}, {"7 2 1 1 10 20 30 40 50"})),
                 "element 7 (Pyramid 5)");
}

TEST_F(Meshes, CellsWithoutPositiveJacobiansAreRefused)
{
    const std::string why = "its Jacobian is not positive at each corner";
    EXPECT_PRED2(says, error<2>(write_mesh({"0 0 0", "1 0 0", "2 0 0"}, {"2 2 1 1 10 20 30"})), why);
    EXPECT_PRED2(says, error<2>(write_mesh({"0 0 0", "1 0 0", "0.2 0.2 0", "0 1 0"}, {"3 2 1 1 10 20 30 40"})),
                 "element 7 (Quadrilateral 4): is flat, not convex or partly turned");
    EXPECT_PRED2(says, error<2>(write_mesh(unit_square, {"3 2 1 1 10 30 20 40"})), why);
    EXPECT_PRED2(says, error<1>(write_mesh({"1 0 0", "1 0 0"}, {"1 2 1 1 10 20"})), why);
    EXPECT_PRED2(says, error<2>(write_mesh(unit_square, {"2 2 1 1 10 20 30", "2 2 1 1 10 20 20"})), "element 8");
}

TEST_F(Meshes, CellsThatOverlapAreRefused)
{
    EXPECT_PRED2(says, error<2>(write_mesh(unit_square, {"2 2 1 1 10 20 30", "2 2 1 1 10 20 40"})),
                 "element 8 (Triangle 3): overlaps element 7");
    EXPECT_PRED2(says, error<1>(write_mesh({"0 0 0", "1 0 0", "2 0 0"}, {"1 2 1 1 10 20", "1 2 1 1 10 30"})), "overlaps");
}

TEST_F(Meshes, UnknownGroupsAreRefusedWithTheNearest)
{
    EXPECT_PRED2(says, error<2>(data / "mixed.msh", "rihgt"),
                 "no physical group \"rihgt\" of dimension 2. Did you mean \"right\"?");
    EXPECT_PRED2(says, error<2>(data / "mixed.msh", "edge"), "\"edge\" has dimension 1, cells need 2. There is: left, right");
    EXPECT_PRED2(says, error<2>(write_mesh(unit_square, {"3 0 10 20 30 40"}), "part"), "no physical group of dimension 2");
}

TEST(MeshesWithoutGmsh, SayWhatToInstall)
{
    if (has_gmsh()) GTEST_SKIP() << "built with Gmsh";
    try {
        read_mesh<2>(data / "square.msh");
        FAIL();
    } catch (const InputError& e) {
        EXPECT_PRED2(says, std::string(e.what()), "install the package libgmsh-dev");
    }
}

}  // namespace
}  // namespace ordo::io
