// Where bodies touch: the vertices of each surface near the other, and their feet on its curved faces.
#pragma once

#include "method/state.hpp"

#include <algorithm>

namespace ordo {

/// The surface of a body whose cells, in their order, are the particles from `first` on, at the start. Without the faces where it
/// meets its own image on a periodic axis.
template <int D>
ContactSurface<D> surface_of(int body, const CellMesh<D>& mesh, const Particles<D>& p, int first, const Vec<D>& period = {});

/// Notes where the vertices of a surface lie in planes of symmetry, at the start, m: there the surface goes on as its image.
template <int D>
void find_planes_of_symmetry(const Model<D>& model, const CellMesh<D>& mesh, ContactSurface<D>& surface);

/// Forgets the planes that are none under other conditions, as those of another stage.
template <int D>
void keep_planes_of_symmetry(const std::vector<Condition<D>>& conditions, ContactSurface<D>& surface);

/// The lengths after which the grid repeats itself, m; 0 on axes that are not periodic.
template <int D>
Vec<D> period_of(const Model<D>& model);

/// The vertices of a surface at x^n, m; on periodic axes full periods count, so that the surface is whole. None if the body has been
/// taken out.
template <int D>
std::vector<Vec<D>> vertices_of(const ContactSurface<D>& surface, const Model<D>& model, const State<D>& s);

/// The points of all contacts, also with obstacles, whose gap is within reach. Ascending keys. `vertices` are those of each surface of
/// the model. Anchors are those of the points of the last step that pressed.
/// @param dt in which obstacles move, s
/// @param reach m, to which that motion is added; see contact_reach
template <int D>
std::vector<ContactPoint<D>> find_contact_points(const Model<D>& model, const State<D>& s,
                                                 const std::vector<std::vector<Vec<D>>>& vertices, double dt, double reach);
/// How far points are usually looked for, m: half a cell, and what bodies can close in a step like the last.
template <int D>
double contact_reach(const Model<D>& model, const State<D>& s)
{
    return (0.5 + 2 * s.move) * *std::max_element(model.h.c, model.h.c + D);
}

/// The vertices that touch the other surface of a pair to within `distance`, m, with their feet.
template <int D>
std::vector<TiedPoint<D>> find_tied_points(const ContactPair<D>& pair, int number, const std::vector<ContactSurface<D>>& surfaces,
                                           const std::vector<std::vector<Vec<D>>>& vertices, double distance,
                                           const Vec<D>& period);

/// The same on an obstacle, at the start.
template <int D>
std::vector<TiedPoint<D>> find_tied_points(int number, bool on_faces, const Obstacle<D>& obstacle,
                                           const ContactSurface<D>& surface, const std::vector<Vec<D>>& vertices, double distance,
                                           const Vec<D>& period);

/// How deep the vertices of a surface, or the particles of a body, are in an obstacle at the start, at most, m.
template <int D>
double depth_in(const Obstacle<D>& obstacle, const ContactSurface<D>& surface, const std::vector<Vec<D>>& vertices, double reach,
                const Vec<D>& period);
template <int D>
double depth_in(const Obstacle<D>& obstacle, const Particles<D>& p, int body, double reach, const Vec<D>& period);

}  // namespace ordo
