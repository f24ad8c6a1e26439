// Reconstruction in a step: nodal velocities as fits, fields of cells at quadrature points, velocity gradients at the centres
// of cells.
#pragma once

#include "method/passes.hpp"
#include "method/state.hpp"

namespace ordo {

/// Sets the velocities of nodes with mass to least-squares fits; masses and momenta of `nodes` must be complete.
template <int D>
void fit_velocities(const Model<D>& model, const VelocityFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep, Lanes* nodes);

/// Sets s.points to the quadrature points of the cells that hold particles, with fields fitted to the particles.
template <int D>
void fit_cells(const Model<D>& model, const CellFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep);

/// Completes nodal masses of quadrature points by those of the particles, `of_particles`. A node that domains reach but no point
/// reaches takes the whole record of the particles, or with `has_velocities` only its mass. With `has_velocities` nodes without a
/// velocity get no mass.
template <int D>
void settle_masses(State<D>& s, Lanes* nodes, const Lanes* of_particles, bool has_velocities);

/// Sets s.gradients to the gradients at cell centres of the velocities of `nodes`: from the cell's own nodes if all have mass,
/// else from cells nearby. Beyond walls they are extrapolated linearly, so that quadratic splines interpolate up to the wall.
template <int D>
void find_cell_gradients(const Passes<D>& passes, State<D>& s, const Lanes* nodes);

}  // namespace ordo
