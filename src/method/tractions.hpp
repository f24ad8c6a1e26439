// Tractions and pressures on the faces of bodies, which are the outer faces of the particles' domains.
#pragma once

#include "base/field.hpp"
#include "grid/lattice.hpp"
#include "particles/particles.hpp"
#include "shape/faces.hpp"

#include <functional>
#include <vector>

namespace ordo {

enum class TractionType {
    pressure,  ///< against the normal of the current face, Pa of current area
    traction,  ///< in a given direction, Pa of current area
    dead       ///< in a given direction, Pa of initial area: the total force does not depend on the deformation
};

template <int D>
struct Traction {
    TractionType type = TractionType::pressure;
    VectorField<D> value{};  ///< pressures use the first component
};

/// A traction on one face of a particle. Faces of points, boxes and parallelepipeds follow F, faces of cells their corners.
template <int D>
struct Load {
    int traction = 0;      ///< index in Model::tractions
    bool is_last = false;  ///< the last load of its particle
    Vec<D> area0{};        ///< initial area vector, outwards, m^(D-1)
    double share =
        1.0;           ///< of the face that counts for given directions: the area of the body's true surface over that of stairs
    Vec<D> arm0{};     ///< initial vector from the particle to the centre of the face, m
    Vec<D> center0{};  ///< initial centre of the face, m
    Face<D> face{};    ///< for cells
};

/// Puts traction `index` on the chosen outer faces of a body whose particles begin at `first`, in the order of the cells of
/// `mesh`. `share` gets the outward unit normal and the centre of a face; faces with 0 are not chosen, see Load. The particles must be
/// undeformed, because faces are taken from the mesh. Returns the number of chosen faces.
template <int D>
int add_loads(std::vector<Load<D>>& loads, Particles<D>& p, const CellMesh<D>& mesh, int first, int index,
              const std::function<double(const Vec<D>& normal, const Vec<D>& center)>& share);

/// The area vector, outwards, m^(D-1), of a loaded face and its centre from the particle, m.
template <int D>
struct FaceShape {
    Vec<D> area, arm;
};

/// The face of particle i with this load.
template <int D>
FaceShape<D> shape_of_face(const Load<D>& load, const Lattice<D>& g, const ParticleView<D>& p, std::ptrdiff_t i);
/// The force, N, of a load on a face with this area vector and centre at time t.
template <int D>
Vec<D> force_on(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Vec<D>& area, const Vec<D>& center,
                double t);
/// Its change with the area vector, in the direction d_area.
template <int D>
Vec<D> force_by_area(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Vec<D>& area, const Vec<D>& d_area,
                     const Vec<D>& center, double t);

/// A loaded face at a time.
template <int D>
struct LoadedFace {
    Vec<D> force;  ///< on it, N
    Vec<D> arm;    ///< from the particle to its centre, m
};

/// The face of particle i with this load, at time t.
template <int D>
LoadedFace<D> loaded_face(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Lattice<D>& g,
                          const ParticleView<D>& p, std::ptrdiff_t i, double t);

/// Sets the force and moment of each particle's loads at time t.
template <int D>
void evaluate_loads(const std::vector<Load<D>>& loads, const std::vector<Traction<D>>& tractions, const Lattice<D>& g,
                    const ParticleView<D>& p, double t);

}  // namespace ordo
