// Bodies in contact, one material and one velocity field each, for the cases contact-layers, contact-ring and contact-bars.
#pragma once

#include "method/contact_points.hpp"
#include "method/planting.hpp"
#include "verification/measure.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace ordo::verification {

/// Gives two bodies a contact; their surfaces come with `plant_bodies`.
inline void add_contact(Model<2>& model, double friction, bool on_faces = false)
{
    double speed = 0.0;
    for (const Material& m : model.materials) speed = std::max(speed, m.wave_speed());
    model.field_of_body = {0, 1};
    model.contacts      = {{.surface = {0, 1}, .friction = friction, .on_faces = on_faces, .wave_speed = speed}};
}

/// The particles of bodies from their meshes, body k of material k, with velocities v(body, x); also gives the model their surfaces.
/// Meshes are split where the method has simplices.
inline Particles<2> plant_bodies(Model<2>& model, std::vector<CellMesh<2>>& meshes,
                                 const std::function<Vec<2>(int body, const Vec<2>& x)>& velocity)
{
    std::vector<int> first{0};
    for (CellMesh<2>& mesh : meshes) {
        if (model.method.domain == Domain::simplex) mesh = split(mesh);
        first.push_back(first.back() + static_cast<int>(mesh.cells.size()));
    }
    Particles<2> p(first.back(), field_groups(model));
    for (int body = 0; body < static_cast<int>(meshes.size()); ++body) {
        const CellMesh<2>& mesh = meshes[body];
        const int begin = first[body], end = first[body + 1];
        if (has_cells(model.method)) {
            plant_cells(p, begin, mesh, model.materials[body].density);
        } else {
            for (int i = begin; i < end; ++i) plant(p, i, seed_of(mesh, mesh.cells[i - begin]), model.materials[body].density);
        }
        for (int i = begin; i < end; ++i) p.body[i] = p.material[i] = body;
        set_velocities<2>(
            p, begin, end, [&](const Vec<2>& x) { return velocity(body, x); }, model.h);
        model.surfaces.push_back(surface_of(body, mesh, p, begin));
        find_planes_of_symmetry(model, mesh, model.surfaces.back());
    }
    return p;
}

/// Sums of squares over particles, weighted by volume.
struct ErrorSum {
    double error = 0, exact = 0;

    void add(double e, double x, double V)
    {
        error += V * e;
        exact += V * x;
    }
    double relative() const { return std::sqrt(error / exact); }
};

/// The largest overlap of points that press, in cells of size h.
inline double largest_overlap(const State<2>& s, double h)
{
    double r = 0;
    for (const ContactPoint<2>& q : s.contacts.points)
        if (q.p > 0) r = std::max(r, -q.gap / h);
    return r;
}

}  // namespace ordo::verification
