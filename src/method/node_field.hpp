// A velocity field of the grid: its nodes, what they hold and what holds them.
#pragma once

#include "grid/condition.hpp"
#include "grid/halo.hpp"
#include "grid/node_rows.hpp"
#include "grid/tiles.hpp"

#include <array>

namespace ordo {

/// What the solution of the consistent mass matrix works with; empty without it.
template <int D>
struct MassSystem {
    NodeRows<D> rows;            ///< the nodes with mass
    bool is_formed = false;      ///< `entries` are those of the particles where they are, of the points as they are
    Array<double> entries;       ///< half of each row, kg
    Array<float> factors;        ///< of the preconditioner
    Array<unsigned char> lanes;  ///< see MassRowParts, as the next two
    Array<double> diagonal, scale;
    Array<Lanes> r, p, q;                 ///< residual, direction and its product, or the preconditioned residual
    std::array<Array<Lanes>, 2> on_grid;  ///< p and q on all nodes, where the matrix is not formed

    MassRowParts parts() const { return {lanes.data(), diagonal.data(), scale.data()}; }
};

/// Tiles, halo and constraints are rebuilt by the sort, see method/layout.hpp.
template <int D>
struct NodeField {
    Tiles<D> tiles;              ///< of the particles that move in this field
    Halo<D> halo;                ///< its images across periodic faces
    Constraints<D> constraints;  ///< what boundaries hold
    Array<Lanes> nodes;          ///< sums, then velocities and increments; behind the grid's those of enriched corners
    Array<Lanes> strain_nodes;   ///< velocities that update the stress, where they are not those of `nodes` (USF, MUSL)
    Array<Lanes> known;          ///< values of constrained components, for the consistent mass matrix
    MassSystem<D> mass;          ///< of the same
};

}  // namespace ordo
