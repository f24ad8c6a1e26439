// Enriched CPDI2 (Sadeghirad, Brannon & Guilkey 2013, sec. 4): corners of cells that are degrees of freedom of their own,
// beside the nodes of the grid. Their records lie behind those of the grid, so that every pass over nodes finds them there.
#pragma once

#include "method/state.hpp"

namespace ordo {

/// Chooses the enriched corners of the particles by `model.method.enrichment`, on bodies and corners as they are planted.
/// Corners at one place that belong to different bodies become one; corners on planes of conditions are noted. Clears an
/// earlier choice. Returns how many there are: none where method.enrichment asks for an interface and no bodies share a corner.
template <int D>
int enrich(const Model<D>& model, Particles<D>& p);

/// Makes room for the records of enriched corners behind the nodes of the grid, as many for each image of a periodic axis.
/// Returns how many records there are.
template <int D>
std::size_t add_enriched(const Lattice<D>& lattice, const Particles<D>& p, Halo<D>& halo);

/// Says which node each enriched corner is in the step to come. One that shares a node of the grid with corners of another
/// part, which no cells connect with its own, spreads to the grid instead: there parts meet, as bodies of MPM do.
template <int D>
void number_enriched(State<D>& s);

/// Conditions on enriched corners, for velocities at time t. A corner that starts on a plane is held by it as nodes are. One
/// that comes to it later takes the condition while it moves on, and may leave.
template <int D>
void constrain_enriched(const Model<D>& model, State<D>& s, Lanes* nodes, double t);

/// Kept velocities: those of the nodes are stored, and come back as momenta in the place of the projected ones.
template <int D>
void keep_velocities(State<D>& s, const Lanes* nodes);
template <int D>
void restore_momenta(const State<D>& s, Lanes* nodes);

/// The longest stable time step of the enriched cells at rest, s; infinite without any. It is that of the cell alone,
/// 2/w: for stresses sigma = C grad v, w^2 <= |C|/rho |sum_c g_c (x) g_c/w_c| bounds the frequencies of all of them
/// together (Irons & Treharne 1971), and those of corners that spread to the grid too.
template <int D>
double enriched_time_step(const Model<D>& model, const Particles<D>& p);

}  // namespace ordo
