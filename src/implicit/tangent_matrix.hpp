// The stiffness of particles as a matrix between nodes, cell by cell.
#pragma once

#include "grid/node_rows.hpp"
#include "implicit/block_rows.hpp"
#include "implicit/particle_forces.hpp"
#include "kernels/sample.hpp"
#include "method/passes.hpp"

#include <array>
#include <span>
#include <vector>

namespace ordo {

/// Sums over the particles of a step's start, whose functions do not change in it.
template <int D>
class TangentMatrix {
  public:
    /// Passes and rows must outlive the object.
    TangentMatrix(const Sweep<D>& view, const Passes<D>& passes, const NodeRows<D>& rows, bool is_averaged);

    /// Adds -d f : d u of the stresses of particles at their last trial, block (k, l) for rows k + 1 and l + 1. With averages over cells it lacks
    /// what the stresses themselves have of it; averages at vertices are taken for those over cells.
    void add_stiffness(const ParticleForces<D>& forces, BlockRows<D>& to) const;
    /// Adds factor m phi_k phi_l for rows k + 1 and l + 1 that both are coupled.
    void add_mass(double factor, const std::vector<unsigned char>& is_coupled, BlockRows<D>& to) const;

  private:
    struct Cell;
    template <class Fill>
    void add(const Fill& fill, BlockRows<D>& to) const;
    void find_weights(Cell& cell) const;
    void add_own(const ParticleForces<D>& forces, Cell& cell) const;
    void add_averaged(const ParticleForces<D>& forces, Cell& cell) const;

    Sweep<D> view_;
    const Passes<D>& passes_;
    const NodeRows<D>& rows_;
    bool is_averaged_;
    std::vector<int> particle_;             ///< by body and cell
    std::vector<std::ptrdiff_t> begin_{0};  ///< of each body's cells therein, and the end
};

}  // namespace ordo
