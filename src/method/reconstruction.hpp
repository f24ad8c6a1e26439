// What a step reconstructs beside the sums of particles: velocities of nodes as fits, fields of cells at quadrature points,
// velocity gradients at the centres of cells.
#pragma once

#include "method/passes.hpp"
#include "method/state.hpp"

namespace ordo {

/// Velocities of the nodes with mass become least-squares fits; masses of `nodes` and momenta must be complete.
template <int D>
void fit_velocities(const Model<D>& model, const VelocityFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep, Lanes* nodes);

/// s.points become the quadrature points of the cells that hold particles, with fields fitted to the particles.
template <int D>
void fit_cells(const Model<D>& model, const CellFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep);

/// Masses of quadrature points instead of those of the particles, which `of_particles` has: nodes that no point reaches but
/// domains do take the particles' record whole, or with `has_velocities` its mass; nodes without a velocity have no mass.
template <int D>
void settle_masses(State<D>& s, Lanes* nodes, const Lanes* of_particles, bool has_velocities);

/// s.gradients become the gradients at cell centres of the velocities of `nodes`: where all nodes of a cell have mass their
/// own, else those of cells nearby; beyond walls they go on linearly, so that quadratic splines interpolate up to the wall.
template <int D>
void find_cell_gradients(const Passes<D>& passes, State<D>& s, const Lanes* nodes);

}  // namespace ordo
