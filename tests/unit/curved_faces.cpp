// Outlines of bodies: normals at corners and faces that are curved through them, exact or of the order that they claim on circles,
// spheres and quadratic surfaces.
#include "base/dual.hpp"
#include "shape/curved_face.hpp"
#include "shape/face_search.hpp"

#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace ordo {
namespace {

/// Around a circle, each moved by up to `wobble` of their distance.
std::vector<double> angles(int n, double wobble)
{
    test::Random random(3);
    std::vector<double> r;
    for (int k = 0; k < n; ++k) r.push_back(2 * std::acos(-1.0) * (k + wobble * test::uniform(random, -1, 1)) / n);
    return r;
}

/// Quadrilaterals in rows around a circle of radius 1 with unequal spacing, one layer inwards.
CellMesh<2> ring(const std::vector<double>& angles)
{
    CellMesh<2> mesh;
    const int n = static_cast<int>(angles.size());
    for (const double radius : {0.5, 1.0})
        for (const double a : angles) mesh.corners.push_back({radius * std::cos(a), radius * std::sin(a)});
    for (int k = 0; k < n; ++k) mesh.cells.push_back({k, (k + 1) % n, n + k, n + (k + 1) % n});
    return mesh;
}

/// The ball of radius 1 as one layer of hexahedra around a cube, six sides of n x n; pushed out to the sphere from places that
/// `wobble` moves.
CellMesh<3> shell(int n, double wobble)
{
    test::Random random(5);
    CellMesh<3> mesh;
    std::map<std::array<int, 3>, int> number;
    auto corner = [&](const std::array<int, 3>& k) {
        const auto [it, is_new] = number.try_emplace(k, static_cast<int>(mesh.corners.size()));
        if (is_new) {
            Vec<3> x{};
            for (int a = 0; a < 3; ++a)
                x[a] = std::tan(std::atan(1.0) * (2.0 * k[a] / n - 1)) + wobble / n * test::uniform(random, -1, 1);
            x = x * (1.0 / norm(x));
            mesh.corners.push_back(x);
            mesh.corners.push_back(0.5 * x);
        }
        return it->second;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {0, n})
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    CornerIds<3> cell{};
                    for (int c = 0; c < 8; ++c) {
                        std::array<int, 3> k{};
                        k[axis]           = side;
                        k[(axis + 1) % 3] = i + (c & 1);
                        k[(axis + 2) % 3] = j + (c >> 1 & 1);
                        cell[c]           = corner(k) + (c >> 2 & 1);
                    }
                    mesh.cells.push_back(cell);
                }
    return mesh;
}

template <int D>
struct Surface {
    Outline<D> outline;
    std::vector<Vec<D>> x;
    std::vector<std::array<Vec<D>, Face<D>::max_corners>> n;

    explicit Surface(const CellMesh<D>& mesh) : outline(outline_of(mesh))
    {
        for (const int corner : outline.corners) x.push_back(mesh.corners[corner]);
        n = corner_normals(outline, x.data());
    }
    /// f(x, n) for each corner of each face.
    template <class F>
    void for_each_corner(F&& f) const
    {
        for (std::size_t k = 0; k < n.size(); ++k)
            for (int c = 0; c < outline.faces[k].count; ++c) f(x[outline.vertices[k][c]], n[k][c]);
    }
    /// The corners of face k from `begin` on, `count` of them.
    CurvedFace<D> face(int k, const std::vector<int>& local) const
    {
        Vec<D> at[CurvedFace<D>::max_corners], normal[CurvedFace<D>::max_corners];
        for (std::size_t c = 0; c < local.size(); ++c) {
            at[c]     = x[outline.vertices[k][local[c]]];
            normal[c] = n[k][local[c]];
        }
        return {at, normal, static_cast<int>(local.size())};
    }
    bool is_outer(int k) const { return norm(x[outline.vertices[k][0]]) > 0.75; }
};

TEST(Outline, NormalsAreExactOnCirclesAndSpheres)
{
    const Surface<2> circle(ring(angles(17, 0.3)));
    ASSERT_EQ(circle.x.size(), 34u);
    ASSERT_EQ(circle.outline.faces.size(), 34u);
    circle.for_each_corner([](const Vec<2>& x, const Vec<2>& n) {
        const Vec<2> radial = x * (1 / norm(x));
        EXPECT_NEAR(norm(n - (norm(x) > 0.75 ? radial : -radial)), 0.0, 1e-13);
    });
    const Surface<3> sphere(shell(5, 0.2));
    ASSERT_EQ(sphere.x.size(), 2u * (6 * 5 * 5 + 2));
    ASSERT_EQ(sphere.outline.faces.size(), 2u * 6 * 5 * 5);
    sphere.for_each_corner([](const Vec<3>& x, const Vec<3>& n) {
        if (norm(x) > 0.75) {
            EXPECT_NEAR(norm(n - x), 0.0, 1e-13);
        }
    });
}

/// An eighth of a ball between planes of symmetry has the normals of the whole, on its edges too.
TEST(Outline, GoesOnBeyondPlanesOfSymmetry)
{
    CellMesh<3> eighth = shell(4, 0.0);
    std::erase_if(eighth.cells, [&](const CornerIds<3>& cell) {
        return !std::all_of(cell.c, cell.c + 8, [&](int c) {
            const Vec<3>& x = eighth.corners[c];
            return std::min({x[0], x[1], x[2]}) > -1e-12;
        });
    });
    Surface<3> part(eighth);
    auto largest_error = [&] {
        double r = 0;
        for (std::size_t k = 0; k < part.n.size(); ++k)
            for (int c = 0; c < part.outline.faces[k].count && part.is_outer(static_cast<int>(k)); ++c) {
                bool is_outside = true;  // of the faces in the planes, which keep the normals of these
                for (int other = 0; other < 4; ++other) is_outside &= norm(part.x[part.outline.vertices[k][other]]) > 0.75;
                if (is_outside) r = std::max(r, norm(part.n[k][c] - part.x[part.outline.vertices[k][c]]));
            }
        return r;
    };
    EXPECT_GT(largest_error(), 0.1) << "as if the body ended there";
    for (const Vec<3>& x : part.x) {
        Vec<3>& plane = part.outline.planes.emplace_back();
        for (int a = 0; a < 3; ++a) plane[a] = std::fabs(x[a]) < 1e-12 ? 0.0 : std::nan("");
    }
    part.n = corner_normals(part.outline, part.x.data());
    EXPECT_LT(largest_error(), 1e-13);
    int in_planes = 0;
    for (std::size_t k = 0; k < part.n.size(); ++k)
        for (int a = 0; a < 3; ++a) {
            const auto& own = part.outline.vertices[k];
            if (!std::all_of(own.begin(), own.end(), [&](int v) { return std::fabs(part.x[v][a]) < 1e-12; })) continue;
            Vec<3> outwards{};
            outwards[a] = -1;
            for (int c = 0; c < 4; ++c) EXPECT_LT(norm(part.n[k][c] - outwards), 1e-14);
            ++in_planes;
        }
    EXPECT_EQ(in_planes, 3 * 4) << "faces in the planes have the normals of these";
}

TEST(Outline, OfOneCellHasItsFacesAroundItsCorners)
{
    const CellMesh<3> mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}},
                           {{0, 1, 2, 3, 4, 5, 6, 7}}};
    const Surface<3> cube(mesh);
    EXPECT_EQ(cube.outline.faces.size(), 6u);
    for (int v = 0; v < 8; ++v) EXPECT_EQ(cube.outline.first[v + 1] - cube.outline.first[v], 3);
    cube.for_each_corner([](const Vec<3>& x, const Vec<3>& n) {  // edges are sharp
        int across = 0;
        for (int a = 0; a < 3; ++a)
            if (std::fabs(n[a]) > 0.5) {
                ++across;
                EXPECT_NEAR(n[a], 2 * x[a] - 1, 1e-15);
            }
        EXPECT_EQ(across, 1);
    });
}

/// A slice of a cylinder: its rim is an edge, its side is round up to the rim.
TEST(Outline, RimsAreSharpAndSidesRound)
{
    const std::vector<double> at = angles(12, 0.0);
    CellMesh<3> mesh;
    for (const double z : {0.0, 0.3})
        for (const double radius : {0.5, 1.0})
            for (const double a : at) mesh.corners.push_back({radius * std::cos(a), radius * std::sin(a), z});
    for (int k = 0; k < 12; ++k) {
        CornerIds<3> cell{};
        for (int c = 0; c < 8; ++c) cell[c] = (k + (c & 1)) % 12 + 12 * (c >> 1 & 1) + 24 * (c >> 2);
        mesh.cells.push_back(cell);
    }
    const Surface<3> tube(mesh);
    ASSERT_EQ(tube.outline.faces.size(), 48u);
    int caps = 0;
    tube.for_each_corner([&](const Vec<3>& x, const Vec<3>& n) {
        const double radius = std::hypot(x[0], x[1]), outwards = radius > 0.75 ? 1 : -1;
        const Vec<3> radial{outwards * x[0] / radius, outwards * x[1] / radius, 0}, cap{0, 0, x[2] > 0.1 ? 1.0 : -1.0};
        const bool is_cap = std::fabs(n[2]) > 0.5;
        EXPECT_NEAR(norm(n - (is_cap ? cap : radial)), 0.0, 1e-13);
        caps += is_cap;
    });
    EXPECT_EQ(caps, 2 * 12 * 4);
}

/// The largest distance of curved outer faces of the unit circle or sphere from it. `corners`: which of each face.
template <int D>
double off_the_sphere(const Surface<D>& s, const std::vector<std::vector<int>>& corners)
{
    double most = 0;
    for (int k = 0; k < static_cast<int>(s.outline.faces.size()); ++k) {
        if (!s.is_outer(k)) continue;
        for (const auto& local : corners) {
            const CurvedFace<D> face = s.face(k, local);
            for (int i = 0; i <= 8; ++i)
                for (int j = 0; j <= (D == 3 ? 8 : 0); ++j) {
                    if (local.size() == 3 && i + j > 8) continue;
                    Vec<D - 1> place{};
                    place[0] = i / 8.0;
                    if constexpr (D == 3) place[1] = j / 8.0;
                    most = std::max(most, std::fabs(norm(face.point(place)) - 1));
                }
        }
    }
    return most;
}

TEST(CurvedFace, IsOfFourthOrderOnCirclesAndSpheres)
{
    const std::vector<std::vector<int>> whole2{{0, 1}}, whole3{{0, 1, 2, 3}}, halves{{0, 1, 2}, {0, 2, 3}};
    double circle[3], quads[3], triangles[3];
    for (int k = 0; k < 3; ++k) {
        circle[k] = off_the_sphere(Surface<2>(ring(angles(16 << k, 0.0))), whole2);
        const Surface<3> sphere(shell(4 << k, 0.0));
        quads[k]     = off_the_sphere(sphere, whole3);
        triangles[k] = off_the_sphere(sphere, halves);
    }
    EXPECT_LT(circle[0], 0.02 * (1 - std::cos(std::acos(-1.0) / 16)));  // of the sagitta of a chord
    for (int k = 0; k < 2; ++k) {
        EXPECT_GT(std::log2(circle[k] / circle[k + 1]), 3.8);
        EXPECT_GT(std::log2(quads[k] / quads[k + 1]), 3.5);
        EXPECT_GT(std::log2(triangles[k] / triangles[k + 1]), 2.8);
    }
}

/// z = a x^2 + b x y + c y^2 + d x + e y over any triangle, and without x y over a square.
TEST(CurvedFace, IsExactForQuadraticHeights)
{
    test::Random random(7);
    for (int k = 0; k < 20; ++k) {
        const double a = test::uniform(random, -0.1, 0.1), b = test::uniform(random, -0.1, 0.1),
                     c = test::uniform(random, -0.1, 0.1);
        for (const int count : {3, 4}) {
            const double mixed = count == 3 ? b : 0.0;
            auto z             = [&](double x, double y) { return a * x * x + mixed * x * y + c * y * y; };
            // Heights over the plane z = 0 through the corners: those of the surface less the linear function through the corners.
            Vec<3> x[4]     = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, n[4];
            const double dx = z(1, 0), dy = count == 3 ? z(1, 1) - z(1, 0) : z(0, 1);
            for (int i = 0; i < count; ++i) {
                const double p = x[i][0], q = x[i][1];
                n[i] = {-(2 * a * p + mixed * q - dx), -(2 * c * q + mixed * p - dy), 1};
                n[i] = n[i] * (1 / norm(n[i]));
            }
            const CurvedFace<3> face(x, n, count);
            for (int i = 0; i <= 4; ++i)
                for (int j = 0; j <= 4; ++j) {
                    const Vec<2> s{i / 8.0, j / 8.0};
                    const Vec<3> y = face.point(s);
                    EXPECT_NEAR(y[2], z(y[0], y[1]) - dx * y[0] - dy * y[1], 1e-15);
                }
        }
    }
}

/// A point at a distance along the normal of any point of the face finds that point and the distance.
TEST(CurvedFace, FindsTheNearestPoint)
{
    test::Random random(11);
    const Surface<2> circle(ring(angles(12, 0.2)));
    const Surface<3> sphere(shell(3, 0.2));
    auto check = [&]<int D>(const CurvedFace<D>& face, const Vec<D - 1>& place, int count) {
        const auto y      = face.point(place);
        const auto normal = face.foot(y).normal;
        for (const double gap : {-0.05, 0.0, 1e-6, 0.1}) {
            const auto foot = face.foot(y + gap * normal);
            EXPECT_NEAR(foot.gap, gap, 1e-13);
            EXPECT_NEAR(norm(foot.normal - normal), 0.0, 1e-11);
            EXPECT_NEAR(norm(foot.normal), 1.0, 1e-15);
            EXPECT_TRUE(foot.is_inside);
            std::remove_const_t<std::remove_reference_t<decltype(foot.weight)>> weights{};
            face_weights<D>(count, place, weights);
            for (int c = 0; c < count; ++c) EXPECT_NEAR(foot.weight[c], weights[c], 1e-11);
        }
    };
    for (int k = 0; k < 12; ++k) {
        if (circle.is_outer(k)) check(circle.face(k, {0, 1}), Vec<1>{test::uniform(random, 0.1, 0.9)}, 2);
        if (!sphere.is_outer(k)) continue;
        const Vec<2> s{test::uniform(random, 0.1, 0.45), test::uniform(random, 0.1, 0.45)};
        check(sphere.face(k, {0, 1, 2, 3}), s, 4);
        check(sphere.face(k, {0, 1, 2}), s, 3);
    }
}

/// Slopes of points along places are those of automatic differentiation.
template <int D>
void check_tangents(const CurvedFace<D>& face, const Vec<D>& first, const Vec<D - 1>& place)
{
    const auto t = face.tangents(place);
    EXPECT_NEAR(norm(first + t.point - face.point(place)), 0.0, 1e-15);
    for (int d = 0; d < D - 1; ++d) {
        Vec<D - 1, Dual<>> at{};
        for (int e = 0; e < D - 1; ++e) at[e] = Dual<>(place[e], e == d ? 1.0 : 0.0);
        const Vec<D, Dual<>> y = face.point(at);
        for (int a = 0; a < D; ++a) EXPECT_NEAR(t.along[d][a], y[a].slope, 1e-15);
        EXPECT_NEAR(dot(t.along[d], t.normal()), 0.0, 1e-15);
    }
}

TEST(CurvedFace, HasItsTangents)
{
    test::Random random(13);
    auto some = [&](double size) { return test::uniform(random, -size, size); };
    for (int k = 0; k < 5; ++k) {
        const Vec<2> x2[] = {{some(0.2), 0}, {some(0.2), 1}}, n2[] = {{1, some(0.3)}, {1, some(0.3)}};
        check_tangents(CurvedFace<2>(x2, n2, 2), x2[0], Vec<1>{0.5 + some(0.5)});
        Vec<3> x[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, n[4];
        for (int i = 0; i < 4; ++i) {
            n[i] = {some(0.3), some(0.3), 1};
            x[i] += Vec<3>{some(0.2), some(0.2), some(0.2)};
        }
        for (const int count : {3, 4})
            check_tangents(CurvedFace<3>(x, n, count), x[0], Vec<2>{0.25 + some(0.25), 0.25 + some(0.25)});
    }
}

/// A vertex opposite one of two faces of 1 cm that meet there, 500 km from the origin, where places round to 1e-10 m, has a foot.
TEST(CurvedFace, HasNoGapsFarFromTheOrigin)
{
    const Vec<3> far{5e5, -3e5, 2e5};
    test::Random random(17);
    for (int k = 0; k < 200; ++k) {
        bool is_found = false;
        const Vec<3> turn{test::uniform(random, -0.2, 0.2), test::uniform(random, -0.2, 0.2), 1};
        for (const double side : {0.0, 1.0}) {
            Vec<3> x[4], n[4];
            for (int i = 0; i < 4; ++i) {
                const double u = side - (i == 0 || i == 3), v = i > 1;
                x[i] = far + Vec<3>{0.01 * u, 0.01 * v, -0.01 * (turn[0] * u + turn[1] * v)};
                n[i] = unit(turn);
            }
            const Foot<3> foot = CurvedFace<3>(x, n, 4).foot(far + Vec<3>{0, 0.004, -0.004 * turn[1]});
            is_found           = is_found || foot.is_inside;
            EXPECT_NEAR(foot.gap, 0.0, 1e-9);
        }
        EXPECT_TRUE(is_found);
    }
}

TEST(CurvedFace, KeepsEdgesSharp)
{
    const Surface<2> square(CellMesh<2>{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}, {{0, 1, 2, 3}}});
    for (int k = 0; k < 4; ++k) {
        const CurvedFace<2> face = square.face(k, {0, 1});
        const Vec<2> middle      = face.point(Vec<1>{0.25});
        EXPECT_NEAR(std::max(std::fabs(middle[0] - 0.5), std::fabs(middle[1] - 0.5)), 0.5, 1e-15);
        const Foot<2> beyond = face.foot(middle + 3 * (face.point(Vec<1>{1.0}) - middle));
        EXPECT_FALSE(beyond.is_inside);
        EXPECT_NEAR(beyond.gap, 0.0, 1e-15);
    }
}

/// The definition of FaceSearch::nearest over all faces.
template <int D>
int nearest_of_all(const Surface<D>& s, const Vec<D>& x, const Vec<D>& n, double reach)
{
    int best    = -1;
    double most = 0;
    for (int k = 0; k < static_cast<int>(s.outline.faces.size()); ++k) {
        std::vector<int> local(s.outline.faces[k].count);
        std::iota(local.begin(), local.end(), 0);
        const Foot<D> foot = s.face(k, local).foot(x);
        if (!foot.is_inside || std::fabs(foot.gap) > reach || dot(foot.normal, n) >= -0.3) continue;
        if (best >= 0 && std::fabs(foot.gap) >= most) continue;
        best = k;
        most = std::fabs(foot.gap);
    }
    return best;
}

template <int D>
void check_search(const Surface<D>& s, double reach)
{
    test::Random random(13);
    const FaceSearch<D> search(s.outline, s.x.data(), s.n.data(), reach);
    Extent<D> part       = Extent<D>::everywhere();
    part.low[0]          = 0.3;
    const auto n_of_part = corner_normals(s.outline, s.x.data(), faces_near(s.outline, s.x.data(), part.widened(reach)));
    const FaceSearch<D> search_in_part(s.outline, s.x.data(), n_of_part.data(), reach, part);
    int found = 0, none = 0, in_part = 0;
    for (int k = 0; k < 400; ++k) {
        Vec<D> x{}, n{};
        for (int a = 0; a < D; ++a) {
            x[a] = test::uniform(random, -1, 1);
            n[a] = test::uniform(random, -1, 1);
        }
        x                     = x * (test::uniform(random, 0.9, 1.1) / norm(x));
        n                     = n * (1 / norm(n));
        const int best        = nearest_of_all(s, x, n, reach);
        const auto found_face = search.nearest(x, n);
        ASSERT_EQ(found_face ? found_face->face : -1, best);
        (best < 0 ? none : found) += 1;
        if (!part.has(x)) continue;
        const auto same = search_in_part.nearest(x, n);
        ASSERT_EQ(same ? same->face : -1, best);
        if (best < 0) continue;
        EXPECT_EQ(same->foot.gap, found_face->foot.gap);
        EXPECT_EQ(same->foot.normal, found_face->foot.normal);
        ++in_part;
    }
    EXPECT_GT(found, 50);
    EXPECT_GT(none, 50);
    EXPECT_GT(in_part, 20);
}
TEST(FaceSearch, FindsTheNearestOfAllFaces)
{
    for (const double reach : {0.05, 0.2}) {
        check_search(Surface<2>(ring(angles(40, 0.2))), reach);
        check_search(Surface<3>(shell(4, 0.2)), reach);
    }
}

/// A wall of one face: what projects beyond its end is not in contact, nor what looks away.
TEST(FaceSearch, EndsAtTheOutline)
{
    const Surface<2> square(CellMesh<2>{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}, {{0, 1, 2, 3}}});
    const FaceSearch<2> search(square.outline, square.x.data(), square.n.data(), 0.2);
    const Vec<2> down{0, -1}, up{0, 1};
    ASSERT_TRUE(search.nearest({0.5, 1.1}, down));
    EXPECT_NEAR(search.nearest({0.5, 1.1}, down)->foot.gap, 0.1, 1e-15);
    EXPECT_NEAR(search.nearest({0.5, 0.95}, down)->foot.gap, -0.05, 1e-15);
    EXPECT_FALSE(search.nearest({0.5, 1.1}, up));
    EXPECT_FALSE(search.nearest({0.5, 1.1}, unit(Vec<2>{1, -0.2})));
    EXPECT_FALSE(search.nearest({0.5, 1.21}, down));
    EXPECT_FALSE(search.nearest({1.01, 1.1}, down));
    EXPECT_FALSE(search.nearest({7, 7}, down));
}

}  // namespace
}  // namespace ordo
