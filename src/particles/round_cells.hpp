// Cells that fit a disk, a ball or a solid cylinder: a square or cube core with slightly bulged faces, and layers of cells around
// it, whose outer corners lie on the circle or sphere (an O-grid; in 3D a cubed sphere).
#pragma once

#include "base/index.hpp"
#include "particles/cell_seeding.hpp"

#include <cmath>
#include <numbers>

namespace ordo {

/// How many cells: `side` along an edge of the core, so 4 side around a circle, and `radial` layers around the core.
struct RoundCount {
    int side   = 2;
    int radial = 1;

    /// Cells of about the side `cell`: the core and the layers then have as many cells as the disk or ball has volume for.
    static RoundCount of(double radius, double cell, int dim)
    {
        return {std::max(2, static_cast<int>(std::lround(1.2 * radius / cell))),
                std::max(1, static_cast<int>(std::lround((dim == 2 ? 0.36 : 0.29) * radius / cell)))};
    }
    double cells(int dim) const
    {
        return dim == 2 ? side * (side + 4.0 * radial) : side * (static_cast<double>(side) * side + 6.0 * side * radial);
    }
};

/// The place of the core at q in [-1, 1]^D, for a radius of 1: x_i = A q_i (1 - k sum_{j != i} q_j^2). Its faces bulge, so that angles
/// at its edges are nearer to the 120 degrees of three cells that meet. A and k make the cells most alike in size and shape: areas of a
/// disk differ by a factor of 2.3 at most, volumes of a ball by 6.5; angles are 53 degrees and more in a disk.
template <int D>
Vec<D> place_in_core(const Vec<D>& q)
{
    constexpr double half_width = D == 2 ? 0.6 : 0.57, bulge = D == 2 ? 0.13 : 0.09;
    Vec<D> r{};
    for (int i = 0; i < D; ++i) r[i] = half_width * q[i] * (1 - bulge * (dot(q, q) - q[i] * q[i]));
    return r;
}

/// The place on the unit circle or sphere of a q with a component of +-1: equal steps of q are equal angles along the circle.
template <int D>
Vec<D> place_on_sphere(const Vec<D>& q)
{
    Vec<D> r{};
    for (int i = 0; i < D; ++i) r[i] = std::tan(std::numbers::pi / 4 * q[i]);
    return (1 / norm(r)) * r;
}

/// The cells of a disk (D = 2) or a ball. Local axes are those of space, in the layers one of them outwards; so neighbours have equal
/// diagonals, and `split` gives a mesh that conforms.
template <int D>
std::vector<CornerPoints<D>> round_cells(const Ball<D>& ball, const RoundCount& count)
{
    std::vector<CornerPoints<D>> cells;
    auto coordinate = [&](int k) { return 2.0 * k / count.side - 1; };
    auto q_of       = [&](const Index<D>& k) {
        Vec<D> q{};
        for (int i = 0; i < D; ++i) q[i] = coordinate(k[i]);
        return q;
    };
    auto bit = [](int corner, int axis) { return corner >> axis & 1; };

    IndexBox<D>{{}, Index<D>::filled(count.side)}.for_each([&](const Index<D>& k) {
        CornerPoints<D> cell{};
        for (int c = 0; c < (1 << D); ++c) {
            Index<D> at = k;
            for (int i = 0; i < D; ++i) at[i] += bit(c, i);
            cell.x[c] = ball.center + ball.radius * place_in_core(q_of(at));
        }
        cells.push_back(cell);
    });
    for (int axis = 0; axis < D; ++axis)
        for (const int side : {-1, 1}) {
            // Of cells on the lower side local axes are swapped, to keep them right-handed.
            const int outwards = side > 0 ? axis : (axis + 1) % D, swapped = side > 0 ? outwards : axis;
            Index<D> box = Index<D>::filled(count.side);
            box[axis]    = count.radial;
            IndexBox<D>{{}, box}.for_each([&](const Index<D>& k) {
                CornerPoints<D> cell{};
                for (int c = 0; c < (1 << D); ++c) {
                    Index<D> at = k;
                    for (int i = 0; i < D; ++i) at[i] += bit(c, i == axis ? outwards : i == outwards ? swapped : i);
                    const double part = static_cast<double>(at[axis]) / count.radial;
                    at[axis]          = side > 0 ? count.side : 0;
                    const Vec<D> q    = q_of(at);
                    cell.x[c]         = ball.center + ball.radius * ((1 - part) * place_in_core(q) + part * place_on_sphere(q));
                }
                cells.push_back(cell);
            });
        }
    return cells;
}

/// The cells of a whole disk (D = 2) or solid cylinder: those of a disk, in 3D `layers` of them along the axis.
template <int D>
std::vector<CornerPoints<D>> round_cells(const Tube<D>& tube, const RoundCount& count, int layers)
{
    std::vector<CornerPoints<D>> cells;
    const int e1 = tube.first(), e2 = tube.second();
    const auto disk = round_cells(Ball<2>{{tube.center[e1], tube.center[e2]}, tube.outer}, count);
    for (int layer = 0; layer < (D == 3 ? layers : 1); ++layer)
        for (const CornerPoints<2>& flat : disk) {
            CornerPoints<D> cell{};
            for (int c = 0; c < (1 << D); ++c) {
                cell.x[c][e1] = flat.x[c & 3][0];
                cell.x[c][e2] = flat.x[c & 3][1];
                if constexpr (D == 3) cell.x[c][tube.axis] = tube.bottom + (layer + (c >> 2)) * (tube.top - tube.bottom) / layers;
            }
            cells.push_back(cell);
        }
    return cells;
}

}  // namespace ordo
