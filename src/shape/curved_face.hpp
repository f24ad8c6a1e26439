// The outline of a body as contact sees it: its outer faces, the normals of its surface at their corners, and faces that are curved
// through these. Chords of curved bodies overlap or gape by their sagitta, which is more than small loads displace them.
#pragma once

#include "base/dual.hpp"
#include "base/parallel.hpp"
#include "shape/faces.hpp"

#include <cmath>
#include <map>

namespace ordo {

/// The outer faces of a body. Their corners are numbered from 0: these are its vertices.
template <int D>
struct Outline {
    using Vertices = std::array<int, Face<D>::max_corners>;

    std::vector<Face<D>> faces;               ///< oriented outwards
    std::vector<Vertices> vertices;           ///< of each face, in the order of its corners
    std::vector<int> corners;                 ///< the corner of the mesh that each vertex is
    std::vector<int> first;                   ///< of each vertex, and the end of the last: where its faces begin in `around`
    std::vector<std::pair<int, int>> around;  ///< faces and their local corners around the vertices
    /// Of each vertex, where along an axis a plane of symmetry through it lies, m; not a number without one. Empty if there are none.
    std::vector<Vec<D>> planes{};

    /// The corners of face k, for vertices at x. Entries beyond their count are zero.
    std::array<Vec<D>, Face<D>::max_corners> corners_of(std::size_t k, const Vec<D>* x) const
    {
        std::array<Vec<D>, Face<D>::max_corners> r{};
        for (int c = 0; c < faces[k].count; ++c) r[c] = x[vertices[k][c]];
        return r;
    }
    /// f(sign) for each image of the body in the planes of symmetry through vertex v, itself included: vectors change by sign[a] along
    /// axis a.
    template <class F>
    void for_each_image(int v, F&& f) const
    {
        int mirrors = 0;
        for (int a = 0; a < D && !planes.empty(); ++a)
            if (!std::isnan(planes[v][a])) mirrors |= 1 << a;
        for (int image = 0; image < 1 << D; ++image) {
            if (image & ~mirrors) continue;
            Vec<D> sign{};
            for (int a = 0; a < D; ++a) sign[a] = image >> a & 1 ? -1.0 : 1.0;
            f(sign);
        }
    }
};

/// The image of a vector, see Outline::for_each_image.
template <int D>
ORDO_FLAT inline Vec<D> mirrored(const Vec<D>& v, const Vec<D>& sign)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = sign[a] * v[a];
    return r;
}

template <int D>
ORDO_FLAT inline Vec<D> unit(const Vec<D>& v)
{
    return v * (1.0 / norm(v));
}

/// Without the faces where the body meets its own image on an axis whose `period`, m, is not zero.
template <int D>
Outline<D> outline_of(const CellMesh<D>& mesh, const Vec<D>& period = {})
{
    Outline<D> r;
    r.faces = without_images(outer_faces(mesh), mesh, period);
    std::map<int, int> number;
    std::vector<std::vector<std::pair<int, int>>> around;
    for (int k = 0; k < static_cast<int>(r.faces.size()); ++k) {
        const Face<D>& face = r.faces[k];
        auto& vertices      = r.vertices.emplace_back();
        vertices.fill(-1);
        for (int c = 0; c < face.count; ++c) {
            const int corner       = mesh.cells[face.cell][face.corner[c]];
            const auto [it, isnew] = number.try_emplace(corner, static_cast<int>(r.corners.size()));
            if (isnew) {
                r.corners.push_back(corner);
                around.emplace_back();
            }
            vertices[c] = it->second;
            around[it->second].emplace_back(k, c);
        }
    }
    r.first.push_back(0);
    for (const auto& one : around) {
        r.around.insert(r.around.end(), one.begin(), one.end());
        r.first.push_back(static_cast<int>(r.around.size()));
    }
    return r;
}

/// The part of a face in the normal of the surface at its corner c: face normals over lengths in 2D, exact on circles; those of
/// Max (1999), J. Graphics Tools 4(2):1, in 3D, exact on spheres.
template <int D>
ORDO_FLAT inline Vec<D> part_of_normal(const Vec<D>* x, int count, int c)
{
    static_assert(D > 1);
    if constexpr (D == 2) {
        const Vec<2> area = face_area(x, count);
        return area * (1.0 / dot(area, area));
    } else {
        const Vec<3> next = x[(c + 1) % count] - x[c], last = x[(c + count - 1) % count] - x[c];
        return cross(next, last) * (1.0 / (dot(next, next) * dot(last, last)));
    }
}

/// The outward unit normals of the surface at the corners of each face, for vertices at x, m: of the faces around the vertex that
/// turn from this one by less than `crease`, radians. The others lie beyond an edge of the body. Beyond planes of symmetry the body goes
/// on as its image.
template <int D>
std::vector<std::array<Vec<D>, Face<D>::max_corners>> corner_normals(const Outline<D>& outline, const Vec<D>* x,
                                                                     double crease = 0.7)
{
    const std::size_t count = outline.faces.size();
    std::vector<std::array<Vec<D>, Face<D>::max_corners>> parts(count), r(count);
    std::vector<Vec<D>> normals(count);
    parallel_for_each(count, [&](std::ptrdiff_t k) {
        const auto at     = outline.corners_of(k, x);
        const int corners = outline.faces[k].count;
        normals[k]        = unit(face_area(at.data(), corners));
        for (int c = 0; c < corners; ++c) parts[k][c] = part_of_normal<D>(at.data(), corners, c);
    });
    const double least = std::cos(crease);
    parallel_for_each(count, [&](std::ptrdiff_t k) {
        for (int c = 0; c < outline.faces[k].count; ++c) {
            const int v = outline.vertices[k][c];
            Vec<D> sum{};
            for (int i = outline.first[v]; i < outline.first[v + 1]; ++i) {
                const int other = outline.around[i].first, corner = outline.around[i].second;
                outline.for_each_image(v, [&](const Vec<D>& sign) {
                    const bool is_own = other == k && sign == Vec<D>::filled(1.0);
                    if (is_own || dot(normals[k], mirrored(normals[other], sign)) > least)
                        sum += mirrored(parts[other][corner], sign);
                });
            }
            r[k][c] = unit(sum);
        }
    });
    return r;
}

/// The point of a face that is nearest to a given one.
template <int D>
struct Foot {
    static constexpr int max_corners = Face<D>::max_corners;

    double weight[max_corners];  ///< of the corners of the face, sum 1: the point is sum weight x on the flat face
    Vec<D> normal;               ///< outward unit normal there
    double gap;                  ///< distance along it, m, positive outside
    bool is_inside;              ///< of the face, not beyond its edges, where a far point may have no foot
};

/// A face with a height over it along its normal N, such that it has the given normals at its corners: along an edge from corner
/// i to j a cubic with the slopes b_ij = -n_i . (x_j - x_i)/(n_i . N) at its ends, between the edges of a quadrilateral a Coons
/// patch, in a triangle sum w_i^2 w_j b_ij + w_0 w_1 w_2 sum b_ij/2, exact for quadratic heights.
template <int D>
class CurvedFace {
  public:
    static constexpr int max_corners = Face<D>::max_corners;
    /// Along one edge from corner 0; in 3D also along the other.
    template <class T = double>
    using Place = Vec<D - 1, T>;

    CurvedFace(const Vec<D>* x, const Vec<D>* n, int count) : count_(count), normal_(unit(face_area(x, count)))
    {
        for (int i = 0; i < count; ++i) {
            x_[i]               = x[i];
            const double across = dot(n[i], normal_);
            const int next = (i + 1) % count, last = (i + count - 1) % count;
            to_next_[i] = -dot(n[i], x[next] - x[i]) / across;
            to_last_[i] = -dot(n[i], x[last] - x[i]) / across;
        }
    }

    /// Linear weights of the corners at a place.
    template <class T>
    void weights(const Place<T>& s, T (&w)[max_corners]) const
    {
        if constexpr (D == 2) {
            w[0] = T(1.0) - s[0];
            w[1] = s[0];
        } else if (count_ == 3) {
            w[0] = T(1.0) - s[0] - s[1];
            w[1] = s[0];
            w[2] = s[1];
            w[3] = T(0.0);
        } else {
            w[0] = (T(1.0) - s[0]) * (T(1.0) - s[1]);
            w[1] = s[0] * (T(1.0) - s[1]);
            w[2] = s[0] * s[1];
            w[3] = (T(1.0) - s[0]) * s[1];
        }
    }
    /// The point of the curved face at a place, m.
    template <class T>
    Vec<D, T> point(const Place<T>& s) const
    {
        T w[max_corners];
        weights(s, w);
        const T h = height(s, w);
        Vec<D, T> r{};
        for (int a = 0; a < D; ++a) {
            r[a] = h * T(normal_[a]);
            for (int i = 0; i < count_; ++i) r[a] += w[i] * T(x_[i][a]);
        }
        return r;
    }
    /// Gauss-Newton from the middle: x - point(s) becomes normal to the face.
    Foot<D> foot(const Vec<D>& x) const
    {
        constexpr int most = 40;
        Place<> s          = Place<>::filled(count_ == 3 ? 1.0 / 3 : 0.5);
        Foot<D> r{};
        bool is_found = false;
        Tangents t    = tangents(s);
        for (int k = 0; k < most && !is_found; ++k) {
            const Place<> step = towards(x - t.point, t);
            double size        = 0.0;
            for (int d = 0; d < D - 1; ++d) {
                s[d] = std::fmin(std::fmax(s[d] + step[d], -1.0), 2.0);  // beyond that the cubic has no meaning
                size = std::fmax(size, std::fabs(step[d]));
            }
            t        = tangents(s);
            is_found = size < 1e-14;
        }
        weights(s, r.weight);
        r.normal    = t.normal;
        r.gap       = dot(x - t.point, t.normal);
        r.is_inside = is_found;
        for (int i = 0; i < count_; ++i) r.is_inside = r.is_inside && r.weight[i] > -1e-12;
        return r;
    }

  private:
    struct Tangents {
        Vec<D> point, along[D - 1], normal;
    };
    Tangents tangents(const Place<>& s) const
    {
        Tangents r{};
        for (int d = 0; d < D - 1; ++d) {
            Place<Dual<>> at{};
            for (int e = 0; e < D - 1; ++e) at[e] = Dual<>(s[e], e == d ? 1.0 : 0.0);
            const Vec<D, Dual<>> y = point(at);
            for (int a = 0; a < D; ++a) {
                r.point[a]    = y[a].value;
                r.along[d][a] = y[a].slope;
            }
        }
        if constexpr (D == 2)
            r.normal = unit(Vec<2>{r.along[0][1], -r.along[0][0]});
        else
            r.normal = unit(cross(r.along[0], r.along[1]));
        return r;
    }
    /// The change of place that brings the point nearest to one at a distance, to first order.
    static Place<> towards(const Vec<D>& distance, const Tangents& t)
    {
        Mat<D - 1> metric{};
        Place<> along{};
        for (int d = 0; d < D - 1; ++d) {
            along[d] = dot(distance, t.along[d]);
            for (int e = 0; e < D - 1; ++e) metric(d, e) = dot(t.along[d], t.along[e]);
        }
        return inverse(metric) * along;
    }
    /// Over the edge from corner i to the next, at u from 0 to 1.
    template <class T>
    T over_edge(int i, const T& u) const
    {
        const T v = T(1.0) - u;
        return u * v * (T(to_next_[i]) * v + T(to_last_[(i + 1) % count_]) * u);
    }
    template <class T>
    T height(const Place<T>& s, const T (&w)[max_corners]) const
    {
        if constexpr (D == 2) {
            return over_edge(0, s[0]);
        } else if (count_ == 3) {
            T r(0.0), middle(0.0);
            for (int i = 0; i < 3; ++i) {
                r += w[i] * w[i] * (T(to_next_[i]) * w[(i + 1) % 3] + T(to_last_[i]) * w[(i + 2) % 3]);
                middle += T((to_next_[i] + to_last_[i]) / 2);
            }
            return r + w[0] * w[1] * w[2] * middle;
        } else {
            const T u = s[0], v = s[1];
            return (T(1.0) - v) * over_edge(0, u) + u * over_edge(1, v) + v * over_edge(2, T(1.0) - u) +
                   (T(1.0) - u) * over_edge(3, T(1.0) - v);
        }
    }

    int count_;
    Vec<D> normal_, x_[max_corners]{};
    double to_next_[max_corners]{}, to_last_[max_corners]{};  ///< slopes b_ij times lengths, m
};

}  // namespace ordo
