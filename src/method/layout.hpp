// The sort: particles in the order of tiles and cells, and all that depends on it: lattice margin, tiles, halo and constraints.
#pragma once

#include "method/state.hpp"
#include "particles/sort.hpp"

namespace ordo {

/// Whether the tiles still fit their particles: no domain has moved beyond the halo since the last sort.
template <int D>
bool is_sorted_enough(const State<D>& s)
{
    return s.drift + s.reach + s.extra_reach <= s.field.tiles.halo();
}

/// Moves particles back into the first period of periodic axes.
template <int D>
void wrap_periodic(const Model<D>& model, Particles<D>& particles);

/// Sorts the particles and rebuilds lattice, tiles, halo and constraints. Wider domains get wider tiles.
template <int D>
void sort_particles(const Model<D>& model, State<D>& s);

/// Sets what depends on lattice and tiles: halo, nodes, constraints, enriched corners.
template <int D>
void arrange_nodes(const Model<D>& model, State<D>& s, const Lattice<D>& lattice, Tiles<D> tiles);

/// Restores the layout of an earlier sort, for particles in its order; `s` has their reach and drift. Of ranks each has the particles from
/// place `first` of this order on, and gets those of its tiles. Returns false if `record` and `halo` do not match these particles.
template <int D>
bool restore_layout(const Model<D>& model, State<D>& s, TileRecord record, int halo, std::int64_t first = 0);

}  // namespace ordo
