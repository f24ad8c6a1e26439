// Enriched CPDI2 (Sadeghirad, Brannon & Guilkey 2013, sec. 4): corners of cells that are degrees of freedom in addition to the
// nodes of the grid. Their records follow those of the grid, so every pass over nodes includes them.
#pragma once

#include "method/state.hpp"

namespace ordo {

/// Chooses the enriched corners by `model.method.enrichment`, for bodies and corners as planted. Merges corners of different
/// bodies at the same place, and records which corners lie on planes of conditions. Clears an earlier choice. Returns the number
/// of enriched corners: none if method.enrichment asks for an interface and no bodies share a corner.
template <int D>
int enrich(const Model<D>& model, Particles<D>& p);

/// Makes room for the records of enriched corners after the nodes of the grid, and for those of their images on periodic axes.
/// Returns the number of records.
template <int D>
std::size_t add_enriched(const Lattice<D>& lattice, const Particles<D>& p, Halo<D>& halo);

/// Sets the node of each enriched corner for the next step. A corner that shares a node of the grid with another part (which no
/// cells connect with its own) spreads to the grid instead: parts interact there, like bodies in MPM.
template <int D>
void number_enriched(State<D>& s);

/// Applies conditions to enriched corners. A plane or region holds corners that start on it, as it holds nodes. A corner that
/// reaches a plane later gets the condition only while it moves outwards; it may leave. A region holds those that are in it.
/// @param walls those that act
/// @param sums get what this changes, see `carried`
template <int D>
void constrain_enriched(const Model<D>& model, State<D>& s, Lanes* nodes, const Moment& when, const std::vector<Wall<D>>& walls,
                        const ExchangeSums<D>& sums, double pic);

/// Kept velocities: `keep_velocities` stores the velocities of the nodes, `restore_momenta` replaces the projected momenta by them.
template <int D>
void keep_velocities(State<D>& s, const Lanes* nodes);
template <int D>
void restore_momenta(const State<D>& s, Lanes* nodes);

/// The longest stable time step of the enriched cells at rest, s; infinite if there are none. It is the limit 2/w of single cells:
/// for stresses sigma = C grad v, w^2 <= |C|/rho |sum_c g_c (x) g_c/w_c| bounds the frequencies of the assembly of cells
/// (Irons & Treharne 1971), also of corners that spread to the grid.
template <int D>
double enriched_time_step(const Model<D>& model, const Particles<D>& p);

}  // namespace ordo
