// Cells of bodies at set-up: corner points of seeds and of polar cells, welding them into a mesh of shared corners, and
// splitting it into simplices. Knows no weights: volumes and centroids are in shape/cell_weights.hpp.
#pragma once

#include "base/error.hpp"
#include "particles/cells.hpp"
#include "particles/seeding.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

namespace ordo {

/// The corners of one segment, quadrilateral or hexahedron in the order of `CornerIds`, m.
template <int D>
struct CornerPoints {
    Vec<D> x[1 << D];
};

/// The corners x +- half-edges of each seed's domain: they tile a body only if the seeds are those of a box or the grid.
template <int D>
std::vector<CornerPoints<D>> corner_points(const std::vector<Seed<D>>& seeds)
{
    std::vector<CornerPoints<D>> cells;
    cells.reserve(seeds.size());
    for (const Seed<D>& seed : seeds) {
        CornerPoints<D> cell{};
        for (int c = 0; c < (1 << D); ++c) {
            cell.x[c] = seed.x;
            for (int d = 0; d < D; ++d) cell.x[c] += (c >> d & 1 ? 1.0 : -1.0) * column(seed.edges, d);
        }
        cells.push_back(cell);
    }
    return cells;
}

/// The polar cells of `fill_polar`, in its order, with corners on the circles: sides are chords, so the total volume is
/// that of the sectors times sin(da)/da. Local axes are those of the seeds: radial, angular and (3D) along the tube.
template <int D>
std::vector<CornerPoints<D>> polar_cells(const Tube<D>& tube, int radial, int angular, int layers)
{
    const double dr = (tube.outer - tube.inner) / radial;
    const double da = (tube.to - tube.from) / angular;
    const double dz = D == 3 ? (tube.top - tube.bottom) / layers : 1.0;
    const int e1 = tube.first(), e2 = tube.second();
    std::vector<CornerPoints<D>> cells;
    IndexBox<3>{{}, {radial, angular, D == 3 ? layers : 1}}.for_each([&](const Index<3>& n) {
        CornerPoints<D> cell{};
        for (int c = 0; c < (1 << D); ++c) {
            const double r     = tube.inner + (n[0] + (c >> e1 & 1)) * dr;
            const double angle = tube.from + (n[1] + (c >> e2 & 1)) * da;
            cell.x[c]          = tube.center;
            cell.x[c][e1] += r * std::cos(angle);
            cell.x[c][e2] += r * std::sin(angle);
            if constexpr (D == 3) cell.x[c][tube.axis] = tube.bottom + (n[2] + (c >> tube.axis & 1)) * dz;
        }
        cells.push_back(cell);
    });
    return cells;
}

/// The shortest side of all cells, m; NaN if a corner is.
template <int D>
double shortest_side(const std::vector<CornerPoints<D>>& cells)
{
    double shortest = std::numeric_limits<double>::infinity();
    for (const CornerPoints<D>& cell : cells)
        for (int d = 0; d < D; ++d)
            for (int c = 0; c < (1 << D); ++c) {
                const double side = norm(cell.x[c | 1 << d] - cell.x[c & ~(1 << d)]);
                if (!(side >= shortest)) shortest = side;
            }
    return shortest;
}

/// Numbers points; points closer than `tolerance` get the same number. A hash grid of bins of side `bin` > 2 `tolerance`: a
/// point is stored in its own bin and looked up in each bin within the tolerance, so borders of bins do not matter.
template <int D>
class Welder {
  public:
    Welder(const Vec<D>& origin, double bin, double tolerance) : origin_(origin), bin_(bin), tolerance_(tolerance) {}

    /// The number of a known point within the tolerance, else a new number.
    int number(const Vec<D>& x)
    {
        const Vec<D> reach = Vec<D>::filled(tolerance_);
        const Bin lo = bin_of(x - reach), hi = bin_of(x + reach);
        for (int k = 0; k < (1 << D); ++k) {
            Bin bin    = lo;
            bool twice = false;
            for (int a = 0; a < D; ++a)
                if (k >> a & 1) {
                    twice  = twice || hi[a] == lo[a];
                    bin[a] = hi[a];
                }
            const int found = twice ? -1 : find(x, bin);
            if (found >= 0) return found;
        }
        const int id = static_cast<int>(points_.size());
        points_.push_back(x);
        bins_.emplace(key(bin_of(x)), id);
        return id;
    }
    std::vector<Vec<D>> take() { return std::move(points_); }

  private:
    using Bin = Vec<D, std::int64_t>;

    Bin bin_of(const Vec<D>& x) const
    {
        constexpr double last = 4e18;  // farther points share the last bins
        Bin bin{};
        for (int a = 0; a < D; ++a)
            bin[a] = static_cast<std::int64_t>(std::clamp(std::floor((x[a] - origin_[a]) / bin_), -last, last));
        return bin;
    }
    /// Different bins may share a key, because positions of points are compared anyway. The multiplier is that of splitmix64.
    static std::uint64_t key(const Bin& bin)
    {
        std::uint64_t k = 0;
        for (int a = 0; a < D; ++a) k = ((k ^ static_cast<std::uint64_t>(bin[a])) * 0xbf58476d1ce4e5b9u) ^ (k >> 31);
        return k;
    }
    int find(const Vec<D>& x, const Bin& bin) const
    {
        const auto range = bins_.equal_range(key(bin));
        for (auto it = range.first; it != range.second; ++it)
            if (norm(x - points_[it->second]) < tolerance_) return it->second;
        return -1;
    }

    Vec<D> origin_;
    double bin_, tolerance_;
    std::vector<Vec<D>> points_;
    std::unordered_multimap<std::uint64_t, int> bins_;
};

/// Makes a mesh of shared corners: points closer than 1e-6 of the shortest side are merged. Corners are numbered in order of
/// first appearance.
template <int D>
CellMesh<D> weld(const std::vector<CornerPoints<D>>& cells)
{
    CellMesh<D> mesh;
    if (cells.empty()) return mesh;
    const double side = shortest_side(cells);
    if (!(side > 0.0))
        throw InputError("a cell has a side of length zero: cells need distinct corners (a ring needs an inner radius > 0)");
    // Bins as wide as the shortest side hold few points; points of a regular mesh lie in the middle of bins and need one lookup.
    Welder<D> welder(cells[0].x[0] - Vec<D>::filled(side / 2), side, 1e-6 * side);
    mesh.cells.reserve(cells.size());
    for (const CornerPoints<D>& cell : cells) {
        CornerIds<D> ids{};
        for (int c = 0; c < (1 << D); ++c) ids[c] = welder.number(cell.x[c]);
        mesh.cells.push_back(ids);
    }
    mesh.corners = welder.take();
    return mesh;
}

/// Splits each quadrilateral into 2 triangles and each hexahedron into 6 tetrahedra around the diagonal from its first to its
/// last corner (Kuhn 1960), one for each order of the axes. Parts of cell k are numbered from 2 k or 6 k on. Neighbours with
/// equal local axes cut their common face alike, so the mesh conforms. Segments and simplices are kept.
template <int D>
CellMesh<D> split(const CellMesh<D>& mesh)
{
    if constexpr (D == 1) return mesh;
    CellMesh<D> r{mesh.corners, {}};
    for (const CornerIds<D>& cell : mesh.cells) {
        if (cell.is_simplex()) {
            r.cells.push_back(cell);
            continue;
        }
        int axes[D];
        std::iota(axes, axes + D, 0);
        do {
            CornerIds<D> part{};
            for (int& id : part.c) id = -1;
            part[0] = cell[0];
            for (int d = 0, corner = 0; d < D; ++d) part[d + 1] = cell[corner |= 1 << axes[d]];
            bool is_odd = false;
            for (int d = 0; d < D; ++d)
                for (int e = 0; e < d; ++e) is_odd ^= axes[e] > axes[d];
            if (is_odd) std::swap(part[D - 1], part[D]);
            r.cells.push_back(part);
        } while (std::next_permutation(axes, axes + D));
    }
    return r;
}

}  // namespace ordo
