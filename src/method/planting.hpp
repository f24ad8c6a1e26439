// Particles of one material from seeds, with the domains that a method needs.
#pragma once

#include "method/enrichment.hpp"
#include "particles/cell_seeding.hpp"
#include "particles/seeding.hpp"
#include "shape/cell_planting.hpp"

#include <cmath>

namespace ordo {

/// A body as cells with shared corners, for methods with cells and to find the faces that tractions act on. Without `corners`
/// the cells are the parallelepipeds of the seeds.
template <int D>
CellMesh<D> mesh_of(const MethodSpec& method, const std::vector<Seed<D>>& seeds, const std::vector<CornerPoints<D>>& corners = {})
{
    const CellMesh<D> mesh = weld(corners.empty() ? corner_points(seeds) : corners);
    return method.domain == Domain::simplex ? split(mesh) : mesh;
}

/// Sets the velocities v(x), m/s, of particles [begin, end), with gradients and corner velocities if the method has them.
/// Gradients are central differences over a small fraction of the cell size h; their components are zero where v is not finite
/// near a particle.
template <int D, class Velocity>
void set_velocities(Particles<D>& p, int begin, int end, const Velocity& v, const Vec<D>& h)
{
    for (int i = begin; i < end; ++i) {
        p.v[i] = v(p.x[i]);
        for (int b = 0; b < D && !p.L.empty(); ++b) {
            Vec<D> d{};
            d[b]               = 1e-4 * h[b];
            const Vec<D> slope = (v(p.x[i] + d) - v(p.x[i] - d)) * (0.5 / d[b]);
            for (int a = 0; a < D; ++a) p.L[i](a, b) = std::isfinite(slope[a]) ? slope[a] : 0.0;
        }
        if (p.has_corner_velocity)
            for (int c = 0; c < p.cell[i].count(); ++c) p.corner_velocity[p.cell[i][c]] = v(p.corner[p.cell[i][c]]);
    }
}

/// Particles of material 0 of the model, one per seed or per cell.
template <int D>
Particles<D> plant_all(const Model<D>& model, const std::vector<Seed<D>>& seeds, const std::vector<CornerPoints<D>>& corners = {})
{
    const double density     = model.materials[0].density;
    const FieldGroups groups = field_groups(model);
    if (groups.cells) {
        const CellMesh<D> mesh = mesh_of(model.method, seeds, corners);
        Particles<D> p(static_cast<int>(mesh.cells.size()), groups);
        plant_cells(p, 0, mesh, density);
        enrich(model, p);
        return p;
    }
    Particles<D> p(static_cast<int>(seeds.size()), groups);
    for (int i = 0; i < p.count; ++i) plant(p, i, seeds[i], density);
    return p;
}

}  // namespace ordo
