// Faces of cells, for surface tractions: which of them bound a body, and their areas.
#pragma once

#include "particles/cells.hpp"
#include "shape/cell_weights.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace ordo {

/// A face of a cell by its local corners, ordered so that its area vector points outwards. In 1D one corner.
template <int D>
struct Face {
    static constexpr int max_corners = D == 3 ? 4 : D;

    int cell;
    int count;  ///< of corners
    int corner[max_corners];
};

/// The area vector of a face with corners x, m^(D-1); exact for bilinear faces too. In 1D it is 1, without a direction.
template <int D>
ORDO_FLAT inline Vec<D> face_area(const Vec<D>* x, int count)
{
    if constexpr (D == 1) {
        return {1.0};
    } else if constexpr (D == 2) {
        return {x[1][1] - x[0][1], x[0][0] - x[1][0]};
    } else {
        return count == 4 ? 0.5 * cross(x[2] - x[0], x[3] - x[1]) : 0.5 * cross(x[1] - x[0], x[2] - x[0]);
    }
}

template <int D>
ORDO_FLAT inline Vec<D> face_center(const Vec<D>* x, int count)
{
    Vec<D> sum{};
    for (int c = 0; c < count; ++c) sum += x[c];
    return sum * (1.0 / count);
}

/// The integrals of the corners' own (bi)linear functions over a face, m^(D-1): what each corner stands for.
template <int D>
std::array<double, Face<D>::max_corners> shares_of_corners(const Vec<D>* x, int count)
{
    std::array<double, Face<D>::max_corners> r{};
    if (count < 4) {
        std::fill_n(r.begin(), count, norm(face_area(x, count)) / count);
        return r;
    }
    if constexpr (D == 3)
        for (int k = 0; k < 4; ++k) {
            constexpr double weight[] = {4, 2, 1, 2};  // of the corner itself, its neighbours, and the one opposite, over 36
            const double size         = norm(cross(x[(k + 1) % 4] - x[k], x[(k + 3) % 4] - x[k]));
            for (int corner = 0; corner < 4; ++corner) r[corner] += weight[(k - corner + 4) % 4] * size;
        }
    for (double& share : r) share /= 36;
    return r;
}

/// The faces of one cell: 2 D of a segment, quadrilateral or hexahedron, D + 1 of a simplex. Not oriented.
template <int D>
std::vector<Face<D>> faces_of(const CornerIds<D>& ids, int cell)
{
    std::vector<Face<D>> faces;
    if (ids.is_simplex()) {
        for (int opposite = 0; opposite <= D; ++opposite) {
            Face<D> f{.cell = cell, .count = 0, .corner = {}};
            for (int c = 0; c <= D; ++c)
                if (c != opposite) f.corner[f.count++] = c;
            faces.push_back(f);
        }
        return faces;
    }
    for (int d = 0; d < D; ++d)
        for (int side = 0; side < 2; ++side) {
            Face<D> f{.cell = cell, .count = 1 << (D - 1), .corner = {}};
            const int e = 1 << (d + 1) % D, g = 1 << (d + 2) % D, at = side << d;
            const int around[] = {at, at | e, at | e | g, at | g};
            for (int c = 0; c < f.count; ++c) f.corner[c] = around[c];
            faces.push_back(f);
        }
    return faces;
}

/// The faces that belong to one cell only: the boundary of the meshed body, oriented outwards.
template <int D>
std::vector<Face<D>> outer_faces(const CellMesh<D>& mesh)
{
    using Key = std::array<int, Face<D>::max_corners>;
    std::vector<std::pair<Key, Face<D>>> all;
    for (int k = 0; k < static_cast<int>(mesh.cells.size()); ++k)
        for (const Face<D>& f : faces_of<D>(mesh.cells[k], k)) {
            Key key;
            key.fill(-1);
            for (int c = 0; c < f.count; ++c) key[c] = mesh.cells[k][f.corner[c]];
            std::sort(key.begin(), key.end());
            all.emplace_back(key, f);
        }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Face<D>> outer;
    for (std::size_t i = 0, next = 0; i < all.size(); i = next) {
        while (next < all.size() && all[next].first == all[i].first) ++next;
        if (next != i + 1) continue;
        Face<D> f = all[i].second;
        Vec<D> x[1 << D], at[Face<D>::max_corners]{};
        get_corners(mesh.cells[f.cell], mesh.corners.data(), x);
        for (int c = 0; c < f.count; ++c) at[c] = x[f.corner[c]];
        const Vec<D> middle = face_center(x, mesh.cells[f.cell].count());
        if (D > 1 && dot(face_area(at, f.count), face_center(at, f.count) - middle) < 0)
            std::reverse(f.corner, f.corner + f.count);
        outer.push_back(f);
    }
    std::sort(outer.begin(), outer.end(), [](const Face<D>& a, const Face<D>& b) {
        return std::pair{a.cell, a.corner[0]} < std::pair{b.cell, b.corner[0]};
    });
    return outer;
}

/// Without pairs of faces that are one `period` apart along an axis; 0: none.
template <int D>
std::vector<Face<D>> without_images(std::vector<Face<D>> faces, const CellMesh<D>& mesh, const Vec<D>& period)
{
    for (int a = 0; a < D; ++a) {
        if (!(period[a] > 0) || faces.empty()) continue;
        std::vector<std::pair<Vec<D>, std::size_t>> low, high;  // middles of faces at the ends, and their numbers
        double lowest    = std::numeric_limits<double>::max();
        const double off = 1e-9 * period[a];
        auto middle_of   = [&](const Face<D>& f) {
            Vec<D> sum{};
            for (int c = 0; c < f.count; ++c) sum += mesh.corners[mesh.cells[f.cell][f.corner[c]]];
            return (1.0 / f.count) * sum;
        };
        for (const Face<D>& f : faces) lowest = std::min(lowest, middle_of(f)[a]);
        for (std::size_t k = 0; k < faces.size(); ++k) {
            const Vec<D> x = middle_of(faces[k]);
            if (std::fabs(x[a] - lowest) < off) low.emplace_back(x, k);
            if (std::fabs(x[a] - lowest - period[a]) < off) high.emplace_back(x, k);
        }
        const int across = (a + 1) % D;
        std::sort(high.begin(), high.end(),
                  [&](const auto& one, const auto& other) { return one.first[across] < other.first[across]; });
        std::vector<bool> is_image(faces.size(), false);
        for (const auto& [x, k] : low) {
            Vec<D> wanted = x;
            wanted[a] += period[a];
            auto at = std::lower_bound(high.begin(), high.end(), wanted[across] - off,
                                       [&](const auto& one, double least) { return one.first[across] < least; });
            for (; at != high.end() && at->first[across] < wanted[across] + off; ++at)
                if (norm(at->first - wanted) < off) is_image[k] = is_image[at->second] = true;
        }
        std::size_t k = 0;
        std::erase_if(faces, [&](const Face<D>&) { return is_image[k++]; });
    }
    return faces;
}

}  // namespace ordo
