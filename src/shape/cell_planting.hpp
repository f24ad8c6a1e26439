// Particles that are cells of a mesh: mass, volume and position from the corners.
#pragma once

#include "particles/cell_seeding.hpp"
#include "particles/particles.hpp"
#include "particles/seeding.hpp"
#include "shape/cell_weights.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ordo {

/// A cell as a seed, for domains that have no corners of their own. Half-edges are those in the middle of the cell (for a
/// simplex those of a cube), scaled to the volume of the cell.
template <int D>
Seed<D> seed_of(const CellMesh<D>& mesh, const CornerIds<D>& cell)
{
    Vec<D> x[1 << D];
    get_corners(cell, mesh.corners.data(), x);
    const CellWeights<D> weights = exact_weights<D>(x, cell.is_simplex());
    Seed<D> seed{.x = centroid<D>(weights, x), .volume = weights.V, .edges = Mat<D>::identity()};
    if (!cell.is_simplex())
        for (int d = 0; d < D; ++d)
            for (int a = 0; a < D; ++a) {
                double sum = 0.0;
                for (int c = 0; c < (1 << D); ++c) sum += (c >> d & 1 ? 1.0 : -1.0) * x[c][a];
                seed.edges(a, d) = sum / (1 << D);
            }
    seed.edges *= std::pow(weights.V / (std::pow(2.0, D) * det(seed.edges)), 1.0 / D);
    return seed;
}

/// Seeds of hexahedra, quadrilaterals or segments.
template <int D>
std::vector<Seed<D>> seeds_of(const std::vector<CornerPoints<D>>& cells)
{
    const CellMesh<D> mesh = weld(cells);
    std::vector<Seed<D>> seeds;
    for (const CornerIds<D>& cell : mesh.cells) seeds.push_back(seed_of(mesh, cell));
    return seeds;
}

/// Makes particles [first, first + cells) of `p` from a mesh: position, mass, volume, corners and number. V0 is the volume
/// between the corners. The corners of the mesh are appended to those of `p`. A shared corner is a sample of the first cell
/// that has it.
template <int D>
void plant_cells(Particles<D>& p, int first, const CellMesh<D>& mesh, double density)
{
    const int offset = static_cast<int>(p.corner.size());
    auto append      = [](Array<Vec<D>>& to, const std::vector<Vec<D>>& more) {
        Array<Vec<D>> all(to.size() + more.size());
        std::copy(to.begin(), to.end(), all.begin());
        std::copy(more.begin(), more.end(), all.begin() + to.size());
        to = std::move(all);
    };
    append(p.corner, mesh.corners);
    if (p.has_corner_velocity) append(p.corner_velocity, std::vector<Vec<D>>(mesh.corners.size()));
    std::vector<bool> is_taken(p.corner.size(), false);
    for (int k = 0; k < static_cast<int>(mesh.cells.size()); ++k) {
        const int i = first + k;
        p.cell[i]   = mesh.cells[k];
        for (int& c : p.cell[i].c)
            if (c >= 0) c += offset;
        Vec<D> x[1 << D];
        get_corners(p.cell[i], p.corner.data(), x);
        const CellWeights<D> weights = exact_weights<D>(x, p.cell[i].is_simplex());
        p.x[i]                       = centroid<D>(weights, x);
        p.V0[i]                      = weights.V;
        p.m[i]                       = weights.V * density;
        p.id[i]                      = i;
        if (!p.load.empty()) p.load[i] = -1;
        for (int c = 0; c < p.cell[i].count() && !p.samples.empty(); ++c) {
            if (is_taken[p.cell[i][c]]) continue;
            is_taken[p.cell[i][c]] = true;
            p.samples[i] |= 1 << c;
        }
    }
}

}  // namespace ordo
