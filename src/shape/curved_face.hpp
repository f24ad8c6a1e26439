// Faces of an outline that are curved through the normals of its surface at their corners. Chords of curved bodies overlap or gape by
// their sagitta, which is more than small loads displace them.
#pragma once

#include "base/parallel.hpp"
#include "shape/outline.hpp"

#include <algorithm>
#include <cmath>

namespace ordo {

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

/// The largest height of a curved face over its corners, in its largest side: that of the slopes allowed at corners.
inline constexpr double kLargestHeight = 0.2;

/// Whether each curved face may meet a region.
template <int D>
std::vector<char> faces_near(const Outline<D>& outline, const Vec<D>* x, const Extent<D>& region)
{
    std::vector<char> r(outline.faces.size());
    parallel_for_each(outline.faces.size(), [&](std::ptrdiff_t k) {
        const Extent<D> corners = outline.extent_of(k, x);
        r[k]                    = corners.widened(kLargestHeight * corners.largest_side()).meets(region);
    });
    return r;
}

/// The outward unit normals of the surface at the corners of each face, for vertices at x, m: of the faces around the vertex that
/// turn from this one by less than `crease`, radians. The others lie beyond an edge of the body. Beyond planes of symmetry the body goes
/// on as its image. Only of the faces that are near; those of others are not set.
template <int D>
std::vector<std::array<Vec<D>, Face<D>::max_corners>> corner_normals(const Outline<D>& outline, const Vec<D>* x,
                                                                     const std::vector<char>& is_near, double crease = 0.7)
{
    const auto faces    = static_cast<std::ptrdiff_t>(outline.faces.size());
    const auto vertices = static_cast<std::ptrdiff_t>(outline.corners.size());
    std::vector<char> has_normals(vertices);
    parallel_for_each(vertices, [&](std::ptrdiff_t v) {
        for (int i = outline.first[v]; i < outline.first[v + 1]; ++i)
            has_normals[v] = has_normals[v] || is_near[outline.around[i].first];
    });
    std::vector<Vec<D>> normals(faces);
    parallel_for_each(faces, [&](std::ptrdiff_t k) {
        const int corners = outline.faces[k].count;
        const auto& own   = outline.vertices[k];
        if (std::any_of(own.begin(), own.begin() + corners, [&](int v) { return has_normals[v]; }))
            normals[k] = unit(face_area(outline.corners_of(k, x).data(), corners));
    });
    std::vector<std::array<Vec<D>, Face<D>::max_corners>> r(faces);
    const double least = std::cos(crease), half_way = std::cos(crease / 2);
    parallel_for_each(vertices, [&](std::ptrdiff_t v) {
        if (!has_normals[v]) return;
        const auto begin = outline.around.begin() + outline.first[v], end = outline.around.begin() + outline.first[v + 1];
        // f(other, its corner, sign, cosine of the angle between) for the faces around the vertex and their images, seen from one.
        auto for_each_around = [&](int face, const auto& f) {
            for (auto at = begin; at != end; ++at)
                outline.for_each_image(v, [&](const Vec<D>& sign) {
                    const bool is_own = at->first == face && sign == Vec<D>::filled(1.0);
                    f(at->first, at->second, sign, is_own ? 1.0 : dot(normals[face], mirrored(normals[at->first], sign)));
                });
        };
        auto least_cosine = [&](int face) {
            double least_of_all = 1.0;
            for_each_around(face, [&](int, int, const Vec<D>&, double cosine) { least_of_all = std::min(least_of_all, cosine); });
            return least_of_all;
        };
        auto normal_of = [&](int face) {
            Vec<D> sum{};
            for_each_around(face, [&](int other, int corner, const Vec<D>& sign, double cosine) {
                if (!(cosine > least)) return;
                const auto at = outline.corners_of(other, x);
                sum += mirrored(part_of_normal<D>(at.data(), outline.faces[other].count, corner), sign);
            });
            return unit(sum);
        };
        // Where all join all, the normals are equal: surely if none turns from the first by half of the crease.
        const bool is_smooth = least_cosine(begin->first) > half_way ||
                               std::all_of(begin, end, [&](const auto& one) { return least_cosine(one.first) > least; });
        Vec<D> normal{};
        for (auto at = begin; at != end; ++at) {
            if (!is_smooth || at == begin) normal = normal_of(at->first);
            r[at->first][at->second] = normal;
        }
    });
    return r;
}

/// The same of all faces.
template <int D>
std::vector<std::array<Vec<D>, Face<D>::max_corners>> corner_normals(const Outline<D>& outline, const Vec<D>* x)
{
    return corner_normals(outline, x, std::vector<char>(outline.faces.size(), 1));
}

/// Linear weights of the corners at a place of a face: along one edge from corner 0, in 3D also along the other.
template <int D, class T>
void face_weights(int count, const Vec<D - 1, T>& s, T* w)
{
    if constexpr (D == 2) {
        w[0] = T(1.0) - s[0];
        w[1] = s[0];
    } else if (count == 3) {
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

/// A Gauss point of a face.
template <int D>
struct FacePoint {
    Vec<D - 1> place;
    double weight[Face<D>::max_corners];  ///< of the corners
    double part;                          ///< of |dx/ds|, in 3D of |dx/ds x dx/dt|: its area
};

/// Those of a face with `count` corners: two a direction, exact for cubics along it; of a triangle three, exact for quadratics.
template <int D>
const std::vector<FacePoint<D>>& face_points(int count)
{
    auto points_at = [](int corners, const std::vector<Vec<D - 1>>& places, double part) {
        std::vector<FacePoint<D>> r;
        for (const Vec<D - 1>& s : places) {
            r.push_back({s, {}, part});
            face_weights<D>(corners, s, r.back().weight);
        }
        return r;
    };
    static const double low = 0.5 - std::sqrt(1.0 / 12), high = 0.5 + std::sqrt(1.0 / 12);
    if constexpr (D == 2) {
        static const auto line = points_at(2, {{low}, {high}}, 1.0 / 2);
        return line;
    } else {
        static const auto square   = points_at(4, {{low, low}, {high, low}, {high, high}, {low, high}}, 1.0 / 4);
        static const auto triangle = points_at(3, {{1.0 / 6, 1.0 / 6}, {2.0 / 3, 1.0 / 6}, {1.0 / 6, 2.0 / 3}}, 1.0 / 6);
        return count == 3 ? triangle : square;
    }
}

/// The point of a face that is nearest to a given one.
template <int D>
struct Foot {
    static constexpr int max_corners = Face<D>::max_corners;

    double weight[max_corners];  ///< of the corners of the face, sum 1: the point is sum weight x on the flat face
    Vec<D> normal;               ///< outward unit normal there
    double gap;                  ///< distance along it, m, positive outside
    bool is_inside;  ///< of the face, not beyond its edges, where a far point may have no foot, and so no normal and gap
};

/// A face with a height over it along its normal N, such that it has the given normals at its corners: along an edge from corner
/// i to j a cubic with the slopes b_ij = -n_i . (x_j - x_i)/(n_i . N) at its ends, between the edges of a quadrilateral a Coons
/// patch, in a triangle sum w_i^2 w_j b_ij + w_0 w_1 w_2 sum b_ij/2, exact for quadratic heights.
template <int D>
class CurvedFace {
  public:
    static constexpr int max_corners = Face<D>::max_corners;
    template <class T = double>
    using Place = Vec<D - 1, T>;

    CurvedFace() = default;
    CurvedFace(const Vec<D>* x, const Vec<D>* n, int count) : count_(count), normal_(unit(face_area(x, count))), first_(x[0])
    {
        for (int i = 0; i < count; ++i) {
            x_[i]               = x[i] - first_;
            const double across = dot(n[i], normal_);
            const int next = (i + 1) % count, last = (i + count - 1) % count;
            to_next_[i] = -dot(n[i], x[next] - x[i]) / across;
            to_last_[i] = -dot(n[i], x[last] - x[i]) / across;
        }
    }

    /// The point of the curved face at a place, m.
    template <class T>
    Vec<D, T> point(const Place<T>& s) const
    {
        T w[max_corners];
        face_weights<D>(count_, s, w);
        const T h = height(s, w);
        Vec<D, T> r{};
        for (int a = 0; a < D; ++a) {
            r[a] = T(first_[a]) + h * T(normal_[a]);
            for (int i = 0; i < count_; ++i) r[a] += w[i] * T(x_[i][a]);
        }
        return r;
    }
    /// The face at a place: its point from corner 0 and the slopes of this along the place, m.
    struct Tangents {
        Vec<D> point, along[D - 1];

        /// Outward unit normal.
        Vec<D> normal() const { return unit(area()); }
        /// Of a unit of place, along the outward normal, m^(D-1).
        Vec<D> area() const
        {
            if constexpr (D == 2)
                return {along[0][1], -along[0][0]};
            else
                return cross(along[0], along[1]);
        }
    };
    /// Corner 0, m.
    const Vec<D>& first() const { return first_; }
    Tangents tangents(const Place<>& s) const
    {
        Tangents r{};
        double h[D];  // the height and its slopes
        heights(s, h);
        r.along[0] = x_[1] + h[1] * normal_;
        r.point    = s[0] * x_[1] + h[0] * normal_;
        if constexpr (D == 3) {
            const bool is_triangle = count_ == 3;
            const Vec<D>& other    = is_triangle ? x_[2] : x_[3];
            const Vec<D> warp      = is_triangle ? Vec<D>{} : x_[2] - x_[1] - x_[3];
            r.along[0] += s[1] * warp;
            r.along[1] = other + s[0] * warp + h[2] * normal_;
            r.point += s[1] * (other + s[0] * warp);
        }
        return r;
    }
    int corner_count() const { return count_; }
    /// Outward unit normal of the plane.
    const Vec<D>& plane_normal() const { return normal_; }
    Place<> middle() const { return Place<>::filled(count_ == 3 ? 1.0 / 3 : 0.5); }
    Foot<D> foot(const Vec<D>& x) const { return foot(x, middle()); }
    /// Gauss-Newton from the place s: x - point(s) becomes normal to the face.
    Foot<D> foot(const Vec<D>& x, Place<> s) const
    {
        constexpr int most         = 40;
        constexpr double converged = 1e-13, edge = 1e-7;  // places: edges are no gaps for bodies far from the origin
        const Vec<D> from_first = x - first_;
        Foot<D> r{};
        for (int k = 0; k < most; ++k) {
            for (int d = 0; d < D - 1; ++d) s[d] = std::min(2.0, std::max(-1.0, s[d]));  // beyond that the cubic has no meaning
            const Tangents t   = tangents(s);
            const Vec<D> away  = from_first - t.point;
            const Place<> step = towards(away, t);
            double size        = 0.0;
            for (int d = 0; d < D - 1; ++d) size = std::max(size, std::fabs(step[d]));
            if (size < converged) {
                r.is_inside = true;
                r.normal    = t.normal();
                r.gap       = dot(away, r.normal);
                break;
            }
            s += step;
        }
        face_weights<D>(count_, s, r.weight);
        for (int i = 0; i < count_; ++i) r.is_inside = r.is_inside && r.weight[i] > -edge;
        return r;
    }

  private:
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

    /// Value and slope of over_edge.
    void over_edge(int i, double u, double& value, double& slope) const
    {
        const double a = to_next_[i], b = to_last_[(i + 1) % count_], v = 1 - u, mean = a * v + b * u;
        value = u * v * mean;
        slope = (v - u) * mean + u * v * (b - a);
    }
    /// The height and its slopes along the place, m.
    void heights(const Place<>& s, double (&h)[D]) const
    {
        if constexpr (D == 2) {
            over_edge(0, s[0], h[0], h[1]);
        } else if (count_ == 3) {
            double w[max_corners], along[3], middle = 0.0;
            face_weights<D>(count_, s, w);
            for (int i = 0; i < 3; ++i) middle += (to_next_[i] + to_last_[i]) / 2;
            h[0] = w[0] * w[1] * w[2] * middle;
            for (int i = 0; i < 3; ++i) {
                const int next = (i + 1) % 3, last = (i + 2) % 3;
                const double over = to_next_[i] * w[next] + to_last_[i] * w[last];
                h[0] += w[i] * w[i] * over;
                along[i] = 2 * w[i] * over + w[last] * w[last] * to_next_[last] + w[next] * w[next] * to_last_[next] +
                           w[next] * w[last] * middle;
            }
            h[1] = along[1] - along[0];
            h[2] = along[2] - along[0];
        } else {
            const double u = s[0], v = s[1];
            double edge[4], slope[4];
            over_edge(0, u, edge[0], slope[0]);
            over_edge(1, v, edge[1], slope[1]);
            over_edge(2, 1 - u, edge[2], slope[2]);
            over_edge(3, 1 - v, edge[3], slope[3]);
            h[0] = (1 - v) * edge[0] + u * edge[1] + v * edge[2] + (1 - u) * edge[3];
            h[1] = (1 - v) * slope[0] + edge[1] - v * slope[2] - edge[3];
            h[2] = -edge[0] + u * slope[1] + edge[2] - (1 - u) * slope[3];
        }
    }

    int count_ = 0;
    Vec<D> normal_{}, first_{}, x_[max_corners]{};            ///< x_: corners from the first, m
    double to_next_[max_corners]{}, to_last_[max_corners]{};  ///< slopes b_ij times lengths, m
};

}  // namespace ordo
