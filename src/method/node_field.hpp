// The velocity fields of the grid: node records, constraints, and the system of the consistent mass matrix.
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

/// Shared corners [begin, end) that move in one velocity field.
struct CornerRun {
    std::ptrdiff_t begin = 0, end = 0;
    std::ptrdiff_t first_node = 0;  ///< where the records of the field begin
};

/// One velocity field, or one for each body in contact and one for all others, see Model::field_of_body; one after the other in
/// each array of nodes. The sort rebuilds tiles, halo and constraints, see method/layout.hpp.
template <int D>
struct NodeField {
    Tiles<D> tiles;
    Halo<D> halo;                ///< periodic images of nodes
    Constraints<D> placed;       ///< by planes and regions
    Constraints<D> constraints;  ///< by these and, found anew in each step, bodies
    WallNodes<D> wall_nodes;     ///< that may lie in walls
    std::vector<CornerRun> corner_runs;
    Array<Lanes> nodes;         ///< sums, then velocities and increments; enriched corners follow the grid's nodes
    Array<Lanes> strain_nodes;  ///< velocities for the stress update, if not those of `nodes` (USF, MUSL)
    Array<Lanes> known;         ///< values of constrained components, for the consistent mass matrix
    MassSystem<D> mass;         ///< its system

    /// The record of all fields together at a node: masses and volumes add up, velocities are weighted by mass. Zero where no
    /// material is.
    Lanes sum_at(const Lattice<D>& lattice, const Index<D>& at) const
    {
        Lanes sum(0.0);
        int found = 0;
        for (int k = 0; k < tiles.fields(); ++k) {
            if (!tiles.is_active(at, k)) continue;
            const Lanes& n = nodes[tiles.first_node(k) + lattice.offset(at)];
            if (!(n[NodeLane::mass] > 0)) continue;
            if (found++ == 0) {
                sum = n;
                continue;
            }
            const double all = sum[NodeLane::mass] + n[NodeLane::mass], old = sum[NodeLane::mass] / all, own = 1 - old;
            const Lanes keep = make_lanes(old, old, old, 1, old, old, old, 1);
            sum              = sum * keep + n * make_lanes(own, own, own, 1, own, own, own, 1);
        }
        return sum;
    }
};

}  // namespace ordo
