// The impulses of contact in a step, on nodes that have advanced and before particles move.
#pragma once

#include "method/state.hpp"

namespace ordo {

/// Pushes the advanced nodes of bodies that meet apart, and holds or rubs them along their surfaces.
///
/// At a point q of area A with gap g and normal n, a vertex of one surface against its foot sum_c w_c x_c on another, the relative
/// velocity is u = sum_i N_i(x_q) v_i - sum_c w_c sum_i N_i(x_c) v_i, each sum over the nodes of the body's own field. Impulses an
/// area p n + t act on nodal momenta through the same weights, so momentum is kept to round-off. In each sweep, at all points at once,
///
///     p <- max(0, p - (u.n + need)/D),   need = g/dt before bodies meet, then r g, slower in an overlap than in a gap
///     t <- t - (u_t + r_t s)/D, scaled back to |t| <= mu p + dt c_a
///
/// with D = sum_i N_i S_i/m_i, S_i the areas of the points in contact spread to the nodes: the row sum of the Delassus operator,
/// with areas as unknowns. Overlaps, and gaps of points that have pressed, are taken back slowly, since haste rings; s is the slip
/// since the point sticks.
/// An obstacle has its own velocity in place of the second sum, and the whole area of a vertex meets it. What forces move is an unknown
/// like the nodes, with its mass and inertia.
/// Components that conditions hold are not moved; `sums` gets what the conditions do then.
/// @param nodes with velocities and increments; images of periodic axes are not set
/// @param when of the velocities; its length is that of the motion
/// @param dt length of the kick, s
template <int D>
void meet(const Model<D>& model, State<D>& s, Lanes* nodes, const Moment& when, double dt, const ExchangeSums<D>& sums);

}  // namespace ordo
