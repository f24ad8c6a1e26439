// Particles that are cells of a mesh: mass, volume and place from the corners.
#pragma once

#include "particles/particles.hpp"
#include "shape/cell_weights.hpp"

#include <algorithm>
#include <vector>

namespace ordo {

/// Makes particles [first, first + cells) of `p` from a mesh: place, mass, volume, corners and number. V0 is the volume
/// between the corners. The corners of the mesh come behind those that `p` has already; of the cells that share one the
/// first stands for it as a sample.
template <int D>
void plant_cells(Particles<D>& p, int first, const CellMesh<D>& mesh, double density)
{
    const int offset = static_cast<int>(p.corner.size());
    Array<Vec<D>> all(p.corner.size() + mesh.corners.size());
    std::copy(p.corner.begin(), p.corner.end(), all.begin());
    std::copy(mesh.corners.begin(), mesh.corners.end(), all.begin() + offset);
    p.corner = std::move(all);
    std::vector<bool> is_taken;
    if (!p.samples.empty()) {
        p.corner_velocity = Array<Vec<D>>(p.corner.size());
        is_taken.resize(p.corner.size());
    }
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
