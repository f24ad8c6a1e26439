// The consistent mass matrix M_ij = sum_p m_p phi_ip phi_jp. Formed as rows of a stencil where particles have a fixed number of
// nodes (kernels/mass_rows.hpp); else its product is a gather and a scatter.
#pragma once

#include "method/passes.hpp"
#include "method/state.hpp"

namespace ordo {

/// Solves M u = b for velocities or accelerations, by conjugate gradients. They are preconditioned by the row sums, and where M
/// is formed by factors along the axes too: of a full block of particles in a regular order they are the inverse of M.
///
/// Rows of fixed components are removed: their values are known and stand on the right. Those of prescribed velocities are
/// removed for the acceleration only, which leads from the projected velocity to the prescribed one. Rows of nodes that the
/// material fills to less than `lump_below` of their own integral are lumped, for a few particles do not determine them and
/// splines make M nearly singular there: they are decoupled, and what their neighbours lose is added to the neighbours'
/// diagonals, so that row sums, mass and momentum stay (docs/design.md).
template <int D>
class MassSolver {
  public:
    MassSolver(const Passes<D>& passes, double lump_below, bool is_of_points)
        : passes_(passes),
          rows_(is_of_points ? passes.mass_rows_of_points : passes.mass_rows),
          lump_below_(lump_below),
          is_of_points_(is_of_points)
    {}

    /// Momenta (lanes of the velocity) become velocities, forces (lanes of the increment) accelerations; which of them, says
    /// `parts`. `known` has the accelerations of constrained components in the same lanes; fixed velocities are zero. Masses and
    /// volumes of `nodes` must be complete. The matrix is formed unless `s.mass` has it. Throws NumericalError where it does not
    /// converge.
    enum Parts : unsigned { kVelocity = 1u, kAcceleration = 2u };
    void solve(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Lanes* known, unsigned parts) const;

    int iterations() const { return iterations_; }  ///< of the last solve

    /// to = M from on all nodes, without regard to `lump_below` and without forming M; velocities and increments in their lanes.
    void apply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const;

    // What a solution begins with, by itself for the tests.
    /// The rows of the nodes with mass, room for vectors and, unless `s.mass` has them, what all solutions share: lumped rows, the
    /// matrix and its preconditioner where it can be formed.
    void prepare(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const;
    /// to = M from on rows: that of `apply`.
    void multiply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const;

  private:
    /// The components that are solved for.
    struct Components {
        std::vector<int> firsts, lanes;
        Lanes mask{};  ///< 1 in these lanes

        explicit Components(unsigned parts);
    };
    /// What b and r are measured by: the sums of their squares over the masses.
    struct Norms {
        Lanes b{};  ///< or of the first residual where that is larger
        Lanes r{};
    };
    void form(State<D>& s, const Sweep<D>& sweep) const;
    void find_lumped(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const;
    void set_first(State<D>& s, Lanes* nodes, const Lanes* known, const Components& c) const;
    Norms find_residual(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Components& c) const;
    void factor(State<D>& s) const;
    Lanes precondition(State<D>& s) const;
    Lanes multiply_direction(State<D>& s, const Sweep<D>& sweep) const;
    Lanes add_direction(State<D>& s, Lanes* nodes, const Lanes& alpha) const;

    Passes<D> passes_;
    MassRowPasses<D> rows_;
    double lump_below_;
    bool is_of_points_;  ///< sums over quadrature points instead of particles
    mutable int iterations_ = 0;
};

/// The part of the integral of node's function that particles fill, 0 to about 1.
template <int D>
double filled_part(const Lattice<D>& g, const Lanes* nodes, const Index<D>& at)
{
    double whole = 1.0;
    for (int a = 0; a < D; ++a) whole *= g.node_length(a, at[a]);
    return nodes[g.offset(at)][NodeLane::volume] / whole;
}

}  // namespace ordo
