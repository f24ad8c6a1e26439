// A velocity field of the grid: node records, constraints, and the system of the consistent mass matrix.
#pragma once

#include "grid/condition.hpp"
#include "grid/halo.hpp"
#include "grid/node_rows.hpp"
#include "grid/tiles.hpp"
#include "grid/wall.hpp"
#include "kernels/sweep.hpp"

#include <array>

namespace ordo {

/// The system of the consistent mass matrix; empty with lumped mass.
template <int D>
struct MassSystem {
    NodeRows<D> rows;            ///< the nodes with mass
    bool is_formed = false;      ///< `entries` match the current particles or quadrature points
    Array<double> entries;       ///< half of each row (M is symmetric), kg
    Array<float> factors;        ///< of the preconditioner
    Array<unsigned char> lanes;  ///< see MassRowParts, like the next two
    Array<double> diagonal, scale;
    Array<Lanes> r, p, q;                 ///< residual; direction; M p or the preconditioned residual
    std::array<Array<Lanes>, 2> on_grid;  ///< p and q on all nodes, if the matrix is not formed

    MassRowParts parts() const { return {lanes.data(), diagonal.data(), scale.data()}; }
};

/// The sort rebuilds tiles, halo and constraints, see method/layout.hpp.
template <int D>
struct NodeField {
    Tiles<D> tiles;              ///< of the particles that move in this field
    Halo<D> halo;                ///< periodic images of nodes
    Constraints<D> placed;       ///< by planes and regions
    Constraints<D> constraints;  ///< by these and, found anew in each step, bodies
    WallNodes<D> wall_nodes;     ///< that may lie in walls
    Array<Lanes> nodes;          ///< sums, then velocities and increments; enriched corners follow the grid's nodes
    Array<Lanes> strain_nodes;   ///< velocities for the stress update, if not those of `nodes` (USF, MUSL)
    Array<Lanes> known;          ///< values of constrained components, for the consistent mass matrix
    MassSystem<D> mass;          ///< its system
};

}  // namespace ordo
