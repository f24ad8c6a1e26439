// Particles of one material from seeds, with the domains that a method wants.
#pragma once

#include "method/state.hpp"
#include "particles/cell_seeding.hpp"
#include "particles/seeding.hpp"
#include "shape/cell_planting.hpp"

namespace ordo {

/// A body as cells with shared corners, for domains that are cells and for faces that carry tractions.
/// Without `corners` they are those of the seeds' parallelepipeds.
template <int D>
CellMesh<D> mesh_of(const MethodSpec& method, const std::vector<Seed<D>>& seeds, const std::vector<CornerPoints<D>>& corners = {})
{
    const CellMesh<D> mesh = weld(corners.empty() ? corner_points(seeds) : corners);
    return method.domain == Domain::simplex ? split(mesh) : mesh;
}

/// Particles of material 0 of the model, one a seed or one a cell.
template <int D>
Particles<D> plant_all(const Model<D>& model, const std::vector<Seed<D>>& seeds, const std::vector<CornerPoints<D>>& corners = {})
{
    const double density     = model.materials[0].density;
    const FieldGroups groups = field_groups(model);
    if (groups.cells) {
        const CellMesh<D> mesh = mesh_of(model.method, seeds, corners);
        Particles<D> p(static_cast<int>(mesh.cells.size()), groups);
        plant_cells(p, 0, mesh, density);
        return p;
    }
    Particles<D> p(static_cast<int>(seeds.size()), groups);
    for (int i = 0; i < p.count; ++i) plant(p, i, seeds[i], density);
    return p;
}

}  // namespace ordo
