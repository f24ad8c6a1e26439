// Cells: corner weights against Gauss integration, welding, splitting, conforming faces.
#include "particles/cell_seeding.hpp"
#include "particles/round_cells.hpp"
#include "shape/cell_weights.hpp"
#include "shape/corners.hpp"
#include "shape/faces.hpp"
#include "shape/hat.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace ordo {
namespace {

template <int D>
double hat(int c, const Vec<D>& xi, int without = -1)
{
    double r = 1;
    for (int d = 0; d < D; ++d)
        if (d != without) r *= (1 + (c >> d & 1 ? 1 : -1) * xi[d]) / 2;
    return r;
}

/// The plain version: six Gauss points an axis (Abramowitz & Stegun 1964, table 25.4), corner by corner.
template <int D>
CellWeights<D> integrate(const Vec<D> (&x)[1 << D])
{
    const double at[]     = {-0.932469514203152, -0.661209386466265, -0.238619186083197,
                             0.238619186083197,  0.661209386466265,  0.932469514203152};
    const double weight[] = {0.171324492379170, 0.360761573048139, 0.467913934572691,
                             0.467913934572691, 0.360761573048139, 0.171324492379170};
    CellWeights<D> r{};
    IndexBox<D>{{}, Index<D>::filled(6)}.for_each([&](const Index<D>& q) {
        double volume = 1;
        Vec<D> xi{}, dN[1 << D]{};
        for (int d = 0; d < D; ++d) {
            xi[d] = at[q[d]];
            volume *= weight[q[d]];
        }
        Mat<D> J{};
        for (int c = 0; c < (1 << D); ++c) {
            for (int d = 0; d < D; ++d) dN[c][d] = (c >> d & 1 ? 0.5 : -0.5) * hat<D>(c, xi, d);
            J += outer(x[c], dN[c]);
        }
        volume *= det(J);
        r.V += volume;
        for (int c = 0; c < (1 << D); ++c) {
            r.w[c] += volume * hat<D>(c, xi);
            r.g[c] += volume * (transpose(inverse(J)) * dN[c]);
        }
    });
    for (int c = 0; c < (1 << D); ++c) {
        r.w[c] /= r.V;
        r.g[c] *= 1 / r.V;
    }
    return r;
}

/// A cell of size h near `place` whose corners are off a parallelepiped's by up to `warp` h.
template <int D>
void make_cell(test::Random& random, double h, double place, double warp, Vec<D> (&x)[1 << D])
{
    const Mat<D> F = test::random_deformation<D>(random, 0.4);
    Vec<D> at{};
    for (int a = 0; a < D; ++a) at[a] = test::uniform(random, -place, place);
    for (int c = 0; c < (1 << D); ++c) {
        Vec<D> s{};
        for (int a = 0; a < D; ++a) s[a] = (c >> a & 1) + (warp > 0 ? test::uniform(random, -warp, warp) : 0.0);
        x[c] = at + h * (F * s);
    }
}

/// Partition of unity, linear reproduction: sum w = 1, sum g = 0, sum x (x) g = I.
template <int D>
void check_moments(const CellWeights<D>& r, const Vec<D> (&x)[1 << D], double h, double tolerance)
{
    double sum = 0;
    Vec<D> dsum{};
    Mat<D> xg{};
    for (int c = 0; c < (1 << D); ++c) {
        sum += r.w[c];
        dsum += r.g[c];
        if (c < r.count) xg += outer(x[c] - x[0], r.g[c]);
    }
    EXPECT_NEAR(sum, 1, tolerance);
    for (int a = 0; a < D; ++a) {
        EXPECT_NEAR(dsum[a] * h, 0, tolerance);
        for (int b = 0; b < D; ++b) EXPECT_NEAR(xg(a, b), a == b, tolerance);
    }
}

template <int D>
void check_against_gauss(double warp)
{
    test::Random random(3);
    const double h = 0.01;
    int checked    = 0;
    while (checked < 200) {
        Vec<D> x[1 << D];
        make_cell<D>(random, h, h, warp, x);
        const auto fast = exact_weights<D>(x, false), mean = mean_weights<D>(x, false);
        if (!fast.is_sound) continue;
        ++checked;
        const auto plain  = integrate<D>(x);
        const double size = std::pow(fast.V, 1.0 / D);
        ASSERT_EQ(fast.count, 1 << D);
        EXPECT_TRUE(mean.is_sound);
        EXPECT_NEAR(fast.V / plain.V, 1, 2e-14);
        for (int c = 0; c < (1 << D); ++c) {
            EXPECT_NEAR(fast.w[c], plain.w[c], 1e-14);
            EXPECT_EQ(mean.w[c], 1.0 / (1 << D));
            EXPECT_EQ(mean.g[c], fast.g[c]);
            for (int a = 0; a < D; ++a) EXPECT_NEAR(fast.g[c][a] * size, plain.g[c][a] * size, 5e-14);
        }
        check_moments<D>(fast, x, size, 1e-13);
    }
}
TEST(CellWeights, AreTheIntegrals)
{
    check_against_gauss<1>(0.1);
    check_against_gauss<2>(0.3);
    check_against_gauss<3>(0.2);
}

/// The centroid by the divergence theorem over triangles, of a polygon; that of a hexahedron is in the Gauss test's w.
TEST(CellWeights, CentroidOfQuadrilaterals)
{
    test::Random random(4);
    for (int k = 0; k < 100; ++k) {
        Vec<2> x[4];
        make_cell<2>(random, 1.0, 1.0, 0.3, x);
        const auto r = exact_weights<2>(x, false);
        Vec<2> sum{};
        double area = 0;
        for (const auto& t : {Vec<3, int>{0, 1, 3}, Vec<3, int>{0, 3, 2}}) {
            const Vec<2> corners[4] = {x[t[0]], x[t[1]], x[t[2]], {}};
            const auto part         = exact_weights<2>(corners, true);
            area += part.V;
            sum += part.V * centroid(part, corners);
        }
        EXPECT_NEAR(r.V, area, 1e-14);
        for (int a = 0; a < 2; ++a) EXPECT_NEAR(centroid(r, x)[a], sum[a] / area, 1e-13);
    }
}

template <int D>
void check_parallelepipeds()
{
    test::Random random(5);
    for (int k = 0; k < 100; ++k) {
        Vec<D> x[1 << D];
        make_cell<D>(random, 0.1, 1.0, 0.0, x);
        const auto r = exact_weights<D>(x, false);
        Mat<D> edges{};  // half-edges
        for (int d = 0; d < D; ++d)
            for (int a = 0; a < D; ++a) edges(a, d) = (x[1 << d][a] - x[0][a]) / 2;
        const Mat<D> dual = Parallelepiped<D, Hat>::scaled_duals(edges);
        EXPECT_TRUE(r.is_sound);
        EXPECT_NEAR(r.V / ((1 << D) * det(edges)), 1, 1e-12);
        for (int c = 0; c < (1 << D); ++c) {
            Vec<D> g{};
            for (int d = 0; d < D; ++d) g += Parallelepiped<D, Hat>::sign(c, d) * column(dual, d);
            EXPECT_NEAR(r.w[c], 1.0 / (1 << D), 1e-13);
            for (int a = 0; a < D; ++a) EXPECT_NEAR(r.g[c][a], g[a], 1e-11);
        }
    }
}
TEST(CellWeights, OfParallelepipedsAreThoseOfHalfEdges)
{
    check_parallelepipeds<1>();
    check_parallelepipeds<2>();
    check_parallelepipeds<3>();
}

template <int D>
void check_simplices()
{
    test::Random random(6);
    for (int k = 0; k < 100; ++k) {
        Vec<D> x[1 << D]{};
        const Mat<D> F = test::random_deformation<D>(random, 0.4);
        for (int d = 0; d < D; ++d) x[d + 1] = column(F, d);
        const auto r = exact_weights<D>(x, true);
        EXPECT_EQ(r.count, D + 1);
        EXPECT_TRUE(r.is_sound);
        EXPECT_NEAR(r.V, det(F) / (D == 3 ? 6 : D), 1e-14);
        for (int c = 0; c <= D; ++c) EXPECT_DOUBLE_EQ(r.w[c], 1.0 / (D + 1));
        check_moments<D>(r, x, 1.0, 1e-13);
        std::swap(x[0], x[1]);
        EXPECT_FALSE(exact_weights<D>(x, true).is_sound);
    }
}
TEST(CellWeights, OfSimplices)
{
    check_simplices<1>();
    check_simplices<2>();
    check_simplices<3>();
}

/// Sadeghirad et al. (2013, 21) is exact for parallelograms only, its (20) likewise (errata).
TEST(CellWeights, TheMeanIsNotExactOnATrapezium)
{
    const Vec<2> x[4] = {{0, 0}, {2, 0}, {0, 1}, {1, 1}};  // centroid (7/9, 4/9)
    const auto exact = exact_weights<2>(x, false), mean = mean_weights<2>(x, false);
    EXPECT_DOUBLE_EQ(exact.V, 1.5);
    EXPECT_NEAR(centroid(exact, x)[0], 7.0 / 9, 1e-15);
    EXPECT_NEAR(centroid(exact, x)[1], 4.0 / 9, 1e-15);
    EXPECT_NEAR(centroid(mean, x)[0], 0.75, 1e-15);
    EXPECT_NEAR(centroid(mean, x)[1], 0.5, 1e-15);
    EXPECT_NEAR(exact.w[0], 5.0 / 18, 1e-15);  // widest at its base: both base corners 5/18, the others 4/18
    EXPECT_NEAR(exact.w[3], 4.0 / 18, 1e-15);
}

TEST(CellWeights, FoldedCellsAreNotSound)
{
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    const auto quad = [](Vec<2> a, Vec<2> b, Vec<2> c, Vec<2> d) {
        const Vec<2> x[4] = {a, b, c, d};
        return exact_weights<2>(x, false);
    };
    EXPECT_TRUE(quad({0, 0}, {1, 0}, {0, 1}, {1, 1}).is_sound);
    EXPECT_FALSE(quad({1, 0}, {0, 0}, {1, 1}, {0, 1}).is_sound);      // inverted
    EXPECT_FALSE(quad({0, 0}, {1, 0}, {1, 1}, {0, 1}).is_sound);      // corners in a circle: a bow tie
    EXPECT_GT(quad({0, 0}, {1, 0}, {0, 1}, {0.3, 0.3}).V, 0);         // a dart has a volume
    EXPECT_FALSE(quad({0, 0}, {1, 0}, {0, 1}, {0.3, 0.3}).is_sound);  // but is folded
    EXPECT_FALSE(quad({0, 0}, {1, 0}, {0, 1}, {0.5, 0.5}).is_sound);  // straight angle
    EXPECT_FALSE(quad({0, 0}, {0, 0}, {0, 0}, {0, 0}).is_sound);      // nothing
    for (double bad : {nan, inf, -inf}) EXPECT_FALSE(quad({0, 0}, {1, 0}, {0, 1}, {bad, 1}).is_sound);

    for (int c = 0; c < 8; ++c) {
        Vec<3> x[8];
        for (int k = 0; k < 8; ++k) x[k] = {1.0 * (k & 1), 1.0 * (k >> 1 & 1), 1.0 * (k >> 2 & 1)};
        EXPECT_TRUE(exact_weights<3>(x, false).is_sound);
        const Vec<3> corner = x[c], middle = Vec<3>::filled(0.5);
        x[c] = corner + 0.7 * (middle - corner);
        EXPECT_FALSE(exact_weights<3>(x, false).is_sound) << "dented corner " << c;
        EXPECT_GT(exact_weights<3>(x, false).V, 0);
        for (double bad : {nan, inf, -inf}) {
            x[c][c % 3] = bad;
            EXPECT_FALSE(exact_weights<3>(x, false).is_sound);
            EXPECT_FALSE(mean_weights<3>(x, false).is_sound);
        }
        x[c] = corner;
        for (int k = 0; k < 8; k += 2) std::swap(x[k], x[k + 1]);
        EXPECT_LT(exact_weights<3>(x, false).V, 0);
        EXPECT_FALSE(exact_weights<3>(x, false).is_sound);
    }
    const Vec<1> backwards[2] = {{1.0}, {0.0}}, endless[2] = {{0.0}, {inf}};
    EXPECT_FALSE(exact_weights<1>(backwards, false).is_sound);
    EXPECT_FALSE(exact_weights<1>(endless, false).is_sound);
}

/// The volume of all cells, m^D; each must be sound.
template <int D>
double volume(const CellMesh<D>& mesh)
{
    double sum = 0;
    for (const auto& cell : mesh.cells) {
        Vec<D> x[1 << D];
        get_corners(cell, mesh.corners.data(), x);
        const auto r = exact_weights<D>(x, cell.is_simplex());
        EXPECT_TRUE(r.is_sound);
        sum += r.V;
    }
    return sum;
}

/// How many faces belong to k cells, by k.
template <int D>
std::map<int, int> faces(const CellMesh<D>& mesh)
{
    std::map<std::vector<int>, int> owners;
    for (const auto& cell : mesh.cells)
        for (int face = 0; face < (cell.is_simplex() ? D + 1 : 2 * D); ++face) {
            std::vector<int> ids;
            for (int c = 0; c < cell.count(); ++c)
                if (cell.is_simplex() ? c != face : (c >> face / 2 & 1) == face % 2) ids.push_back(cell[c]);
            std::sort(ids.begin(), ids.end());
            ++owners[ids];
        }
    std::map<int, int> count;
    for (const auto& face : owners) ++count[face.second];
    return count;
}

template <int D>
void check_box(int n, double offset)
{
    const Vec<D> lower = Vec<D>::filled(offset), upper = Vec<D>::filled(offset + 0.7);
    const SubCells<D> cells{{}, Vec<D>::filled(0.7 / n), Index<D>::filled(1)};
    const auto mesh     = weld(corner_points(fill_box(Bounds<D>{lower, upper}, cells)));
    const int of_cell[] = {1, 2, 6}, of_face[] = {1, 1, 2};
    int count = 1, corners = 1;
    for (int a = 0; a < D; ++a) count *= n, corners *= n + 1;
    ASSERT_EQ(mesh.cells.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(mesh.corners.size(), static_cast<std::size_t>(corners));
    EXPECT_NEAR(volume(mesh), std::pow(0.7, D), 1e-13 * (1 + offset * offset));
    const int outside = 2 * D * count / n;
    using Count       = std::map<int, int>;
    EXPECT_EQ(faces(mesh), (Count{{1, outside}, {2, (2 * D * count - outside) / 2}}));
    const auto parts = split(mesh);
    ASSERT_EQ(parts.cells.size(), mesh.cells.size() * of_cell[D - 1]);
    EXPECT_NEAR(volume(parts), volume(mesh), 1e-12 * (1 + offset));
    const int sides = D == 1 ? 2 : D + 1, cut = outside * of_face[D - 1];
    EXPECT_EQ(faces(parts), (Count{{1, cut}, {2, (sides * count * of_cell[D - 1] - cut) / 2}}));
}
TEST(CellSeeding, BoxesShareTheirCorners)
{
    for (double offset : {0.0, 0.1, -0.35, 1000.0 / 3}) {
        check_box<1>(7, offset);
        check_box<2>(6, offset);
        check_box<3>(5, offset);
    }
}

template <int D>
void check_ring(double angle, int axis)
{
    const double pi  = std::numbers::pi;
    const bool full  = angle == 2 * pi;
    const int radial = 3, angular = 16, layers = D == 3 ? 4 : 1;
    const Tube<D> tube{.center = Vec<D>::filled(0.3),
                       .inner  = 0.4,
                       .outer  = 0.6,
                       .from   = -0.2,
                       .to     = angle - 0.2,
                       .axis   = axis,
                       .bottom = 0.1,
                       .top    = 0.9};
    const auto points = polar_cells(tube, radial, angular, layers);
    const auto seeds  = fill_polar(tube, radial, angular, layers);
    ASSERT_EQ(points.size(), seeds.size());
    const double da = angle / angular;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        const auto r = exact_weights<D>(points[i].x, false);
        EXPECT_TRUE(r.is_sound);
        EXPECT_NEAR(r.V, seeds[i].volume * std::sin(da) / da, 1e-15);
        EXPECT_LT(norm(centroid(r, points[i].x) - seeds[i].x), 0.03 * 0.6);  // the same cell
    }
    const auto mesh   = weld(points);
    const int columns = full ? angular : angular + 1;
    EXPECT_EQ(mesh.corners.size(), static_cast<std::size_t>((radial + 1) * columns * (D == 3 ? layers + 1 : 1)));
    int outside = 2 * angular * layers + (full ? 0 : 2 * radial * layers) + (D == 3 ? 2 * radial * angular : 0);
    int count   = radial * angular * layers;
    using Count = std::map<int, int>;
    EXPECT_EQ(faces(mesh), (Count{{1, outside}, {2, (2 * D * count - outside) / 2}}));
    const auto parts = split(mesh);
    EXPECT_NEAR(volume(parts), volume(mesh), 1e-14);
    outside *= D - 1;
    count *= D == 3 ? 6 : 2;
    EXPECT_EQ(faces(parts), (Count{{1, outside}, {2, ((D + 1) * count - outside) / 2}}));
}
TEST(CellSeeding, RingsShareTheirCornersAndClose)
{
    for (double angle : {std::numbers::pi / 2, 2 * std::numbers::pi}) {
        check_ring<2>(angle, 2);
        for (int axis = 0; axis < 3; ++axis) check_ring<3>(angle, axis);
    }
}

/// The least determinant of the map from [0, 1]^D to a cell at its corners, over the product of the sides there: 1 for a box.
template <int D>
double squareness(const CornerPoints<D>& cell)
{
    double least = 1;
    for (int c = 0; c < (1 << D); ++c) {
        Mat<D> sides{};
        double lengths = 1;
        for (int d = 0; d < D; ++d) {
            const Vec<D> side = cell.x[c | 1 << d] - cell.x[c & ~(1 << d)];
            for (int a = 0; a < D; ++a) sides(a, d) = side[a];
            lengths *= norm(side);
        }
        least = std::min(least, det(sides) / lengths);
    }
    return least;
}

template <int D>
Vec<D> face_normal(const CellMesh<D>& mesh, const Face<D>& face)
{
    Vec<D> at[Face<D>::max_corners]{};
    for (int c = 0; c < face.count; ++c) at[c] = mesh.corners[mesh.cells[face.cell][face.corner[c]]];
    const Vec<D> area = face_area(at, face.count);
    return (1 / norm(area)) * area;
}

/// Round cells of about the size 1/n: their mesh and its parts conform, its outer faces have their corners on the circle, and their
/// number is that of the outline. Returns the volume.
template <int D, class Shape>
double check_round(const Shape& shape, const std::vector<CornerPoints<D>>& cells, int outer, double least_squareness,
                   double volumes)
{
    double least = HUGE_VAL, largest = 0;
    for (const CornerPoints<D>& cell : cells) {
        EXPECT_GT(squareness(cell), least_squareness);
        const auto r = exact_weights<D>(cell.x, false);
        EXPECT_TRUE(r.is_sound);
        least   = std::min(least, r.V);
        largest = std::max(largest, r.V);
    }
    EXPECT_LT(largest / least, volumes);
    const auto mesh = weld(cells);
    using Count     = std::map<int, int>;
    const int count = static_cast<int>(cells.size());
    EXPECT_EQ(faces(mesh), (Count{{1, outer}, {2, (2 * D * count - outer) / 2}}));
    double off = 0;
    for (const Face<D>& face : outer_faces(mesh))
        for (int c = 0; c < face.count; ++c) {
            const Vec<D> x = mesh.corners[mesh.cells[face.cell][face.corner[c]]];
            if constexpr (requires { shape.outer; }) {
                if (D == 2 || std::fabs(face_normal(mesh, face)[shape.axis]) < 0.5)
                    off = std::max(off, std::fabs(std::sqrt(shape.square_radius(x)) - shape.outer));
            } else {
                off = std::max(off, std::fabs(norm(x - shape.center) - shape.radius));
            }
        }
    EXPECT_LT(off, 1e-15);
    const auto parts = split(mesh);
    const int cut = outer * (D - 1), tetrahedra = count * (D == 3 ? 6 : 2);
    EXPECT_NEAR(volume(parts), volume(mesh), 1e-2 * volume(mesh));  // faces of hexahedra are not flat
    EXPECT_EQ(faces(parts), (Count{{1, cut}, {2, ((D + 1) * tetrahedra - cut) / 2}}));
    return volume(mesh);
}

TEST(CellSeeding, DisksAndBallsAreFittedByCellsAroundACore)
{
    const double pi = std::numbers::pi, radius = 0.4;
    double before[3]{};
    for (const double cell : {0.1, 0.05, 0.025}) {
        double error[3]{};
        {
            const Ball<2> disk{{0.3, 0.2}, radius};
            const RoundCount n = RoundCount::of(radius, cell, 2);
            const auto cells   = round_cells(disk, n);
            EXPECT_EQ(static_cast<double>(cells.size()), n.cells(2));
            EXPECT_NEAR(n.cells(2) * cell * cell / (pi * radius * radius), 1, 0.15);
            const double area = check_round<2>(disk, cells, 4 * n.side, 0.8, 2.3);
            // The polygon on the circle.
            EXPECT_NEAR(area, 2 * n.side * radius * radius * std::sin(pi / 2 / n.side), 1e-14);
            error[0] = 1 - area / (pi * radius * radius);
        }
        {
            const Ball<3> ball{{0.3, 0.2, 0.1}, radius};
            const RoundCount n = RoundCount::of(radius, cell, 3);
            const auto cells   = round_cells(ball, n);
            EXPECT_EQ(static_cast<double>(cells.size()), n.cells(3));
            EXPECT_NEAR(n.cells(3) * std::pow(cell, 3) / (4 * pi / 3 * std::pow(radius, 3)), 1, 0.15);
            error[1] = 1 - check_round<3>(ball, cells, 6 * n.side * n.side, 0.7, 6.5) / (4 * pi / 3 * std::pow(radius, 3));
        }
        for (int axis = 0; axis < 3; ++axis) {
            const Tube<3> rod{.center = {0.3, 0.2, 0.1}, .outer = radius, .axis = axis, .bottom = 0.1, .top = 0.7};
            const RoundCount n = RoundCount::of(radius, cell, 2);
            const int layers   = static_cast<int>(std::lround(0.6 / cell));
            const auto cells   = round_cells(rod, n, layers);
            const int end      = static_cast<int>(n.cells(2));
            error[2] = 1 - check_round<3>(rod, cells, 4 * n.side * layers + 2 * end, 0.8, 2.3) / (0.6 * pi * radius * radius);
        }
        for (int k = 0; k < 3; ++k) {
            EXPECT_GT(error[k], 0);
            if (before[k] > 0) {
                EXPECT_GT(std::log2(before[k] / error[k]), 1.8) << k;
            }
            before[k] = error[k];
        }
    }
}

/// Points off by rounding and more, wherever bin borders are: found up to the tolerance, apart beyond it.
TEST(CellSeeding, WeldingToleratesRoundingAtBinBorders)
{
    test::Random random(8);
    const CornerPoints<2> square{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
    for (double noise : {1e-15, 3e-7}) {
        std::vector<CornerPoints<2>> cells{square};  // the shortest side is 1, so bins lie between multiples of 1 and 1/2
        for (int j = 0; j < 20; ++j)
            for (int i = 0; i < 20; ++i) {
                CornerPoints<2> cell{};
                for (int c = 0; c < 4; ++c)
                    for (int a = 0; a < 2; ++a)
                        cell.x[c][a] = 3 + 1.5 * ((a ? j : i) + (c >> a & 1)) + test::uniform(random, -noise, noise);
                cells.push_back(cell);
            }
        const auto mesh = weld(cells);
        EXPECT_EQ(mesh.corners.size(), 4u + 21u * 21u);
        for (int c = 0; c < 4; ++c) {  // numbers in order of first appearance
            EXPECT_EQ(mesh.cells[0][c], c);
            EXPECT_EQ(mesh.cells[1][c], 4 + c);
        }
        const int next[] = {5, 8, 7, 9};
        for (int c = 0; c < 4; ++c) EXPECT_EQ(mesh.cells[2][c], next[c]);
    }
    const CornerPoints<2> apart{{{1 + 2e-6, 0}, {2, 0}, {1 + 2e-6, 1}, {2, 1}}};
    EXPECT_EQ(weld(std::vector{square, apart}).corners.size(), 8u);
    EXPECT_TRUE(weld(std::vector<CornerPoints<2>>{}).cells.empty());
    EXPECT_THROW(weld(polar_cells(Tube<2>{.center = {}, .inner = 0.0, .outer = 1.0}, 2, 8, 1)), InputError);
}

TEST(CellSeeding, DisksOfGridCellsTileWithoutGaps)
{
    const auto seeds = fill(Ball<2>{{0.3, 0.3}, 0.2}, SubCells<2>{{}, Vec<2>::filled(0.05), {3, 3}});
    const auto mesh  = weld(corner_points(seeds));
    double sum       = 0;
    for (const auto& seed : seeds) sum += seed.volume;
    EXPECT_NEAR(volume(mesh), sum, 1e-14);
    const auto count = faces(mesh);
    EXPECT_EQ(count.rbegin()->first, 2);
    // Euler: corners - edges + cells = 1 for a disk without holes.
    EXPECT_EQ(static_cast<int>(mesh.corners.size()) - count.at(1) - count.at(2) + static_cast<int>(mesh.cells.size()), 1);
}

}  // namespace
}  // namespace ordo
