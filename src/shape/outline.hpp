// The outline of a body as contact sees it: its outer faces, which move with their corners.
#pragma once

#include "shape/extent.hpp"
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
    /// Bounds of the corners of face k, m.
    Extent<D> extent_of(std::size_t k, const Vec<D>* x) const
    {
        Extent<D> r;
        for (int c = 0; c < faces[k].count; ++c) r.add(x[vertices[k][c]]);
        return r;
    }
    /// f(sign) for each image of the body in the planes of symmetry through vertex v, itself included: vectors change by sign[a] along
    /// axis a.
    template <class F>
    void for_each_image(std::ptrdiff_t v, F&& f) const
    {
        if (planes.empty()) return f(Vec<D>::filled(1.0));
        int mirrors = 0;
        for (int a = 0; a < D; ++a)
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

}  // namespace ordo
