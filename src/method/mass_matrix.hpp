// The consistent mass matrix M_ij = sum_p m_p phi_ip phi_jp. If particles have a fixed number of nodes, it is formed as rows of a
// stencil (kernels/mass_rows.hpp); else its product is a gather and a scatter.
#pragma once

#include "method/passes.hpp"
#include "method/state.hpp"

namespace ordo {

/// A node whose solution is known along some directions: u = free u + known.
template <int D>
struct HeldNode {
    std::ptrdiff_t node;
    Mat<D> free;  ///< a symmetric projection
    Vec<D> known;
};

/// Solves M u = b for velocities or accelerations, by conjugate gradients. The preconditioner is the row sums, and if M is formed
/// also factors along the axes, which give the inverse of M for a full block of particles in a regular order.
///
/// Rows of fixed components are removed: their known values go to the right-hand side. Rows of prescribed velocities are removed
/// for the acceleration only, which leads from the projected velocity to the prescribed one. Rows of nodes with a filled fraction
/// below `lump_below` are lumped, because a few particles do not determine them and splines make M nearly singular there. They
/// are decoupled, and what their neighbours lose is added to the neighbours' diagonals, which conserves row sums, mass and
/// momentum (docs/design.md).
template <int D>
class MassSolver {
  public:
    MassSolver(const Passes<D>& passes, double lump_below, bool is_of_points)
        : passes_(passes),
          rows_(is_of_points ? passes.mass_rows_of_points : passes.mass_rows),
          lump_below_(lump_below),
          is_of_points_(is_of_points)
    {}

    /// Turns momenta (velocity lanes) into velocities and forces (increment lanes) into accelerations; `parts` selects which.
    /// `known` has the accelerations of constrained components in the same lanes; fixed velocities are zero. Masses and volumes
    /// of `nodes` must be complete. Forms the matrix unless `s.mass` has it. Throws NumericalError if it does not converge.
    /// Nodes of `held` are not images, and need that there is one part.
    enum Parts : unsigned { kVelocity = 1u, kAcceleration = 2u };
    void solve(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Lanes* known, unsigned parts,
               const std::vector<HeldNode<D>>& held = {}) const;

    int iterations() const { return iterations_; }  ///< of the last solve

    /// s.mass.q = A u for each row, u the solution that `solve` left in `nodes`.
    void multiply_solution(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const;

    /// to = M from on all nodes, for the lanes of velocities and increments. Ignores `lump_below` and does not form M.
    void apply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const;

    // The beginning of a solution, public for tests.
    /// Numbers the rows of nodes with mass, makes room for vectors and, unless `s.mass` has them, finds lumped rows and forms the
    /// matrix and its preconditioner, if it can be formed.
    void prepare(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const;
    /// to = M from on rows, with the same M as `apply`.
    void multiply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const;

  private:
    /// The components that are solved for.
    struct Components {
        std::vector<int> firsts, lanes;
        Lanes mask{};  ///< 1 in these lanes
        const std::vector<HeldNode<D>>& held;

        Components(unsigned parts, const std::vector<HeldNode<D>>& held);

        /// A sum of products in each lane. Each component is a system of its own, unless held nodes couple them: then all get the sum
        /// over the components.
        Lanes joined(const Lanes& sums) const;
    };
    /// The squared norms of b and r: sums of their squares divided by the masses.
    struct Norms {
        Lanes b{};  ///< or of the first residual if that is larger
        Lanes r{};
    };
    /// Projects the vector x of the rows of held nodes onto their free directions.
    static void project(const NodeRows<D>& rows, const Components& c, Lanes* x);
    void form(State<D>& s, const Sweep<D>& sweep) const;
    void find_lumped(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const;
    void set_first(State<D>& s, Lanes* nodes, const Lanes* known, const Components& c) const;
    Norms find_residual(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Components& c) const;
    void factor(State<D>& s) const;
    Lanes precondition(State<D>& s, const Components& c) const;
    Lanes multiply_direction(State<D>& s, const Sweep<D>& sweep, const Components& c) const;
    Lanes add_direction(State<D>& s, Lanes* nodes, const Lanes& alpha) const;

    Passes<D> passes_;
    MassRowPasses<D> rows_;
    double lump_below_;
    bool is_of_points_;  ///< sums over quadrature points instead of particles
    mutable int iterations_ = 0;
};

/// The fraction of the integral of a node's function that particles fill, 0 to about 1.
template <int D>
double filled_part(const Lattice<D>& g, const Lanes* nodes, const Index<D>& at)
{
    double whole = 1.0;
    for (int a = 0; a < D; ++a) whole *= g.node_length(a, at[a]);
    return nodes[g.offset(at)][NodeLane::volume] / whole;
}

}  // namespace ordo
