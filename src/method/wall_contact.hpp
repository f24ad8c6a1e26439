// Walls with a consistent mass matrix, which couples the nodes in a wall with those out of it: which nodes a wall holds, lets go or
// rubs, and how hard, is found together with the accelerations. Lumped masses need no such search, see grid/wall.hpp.
#pragma once

#include "method/mass_matrix.hpp"

#include <functional>
#include <vector>

namespace ordo {

/// Solves M a = f + R for one step. R acts on nodes in walls: R n >= 0 along the normal, the advanced velocity
/// v + dt (a + g) does not enter the wall, and only one of the two is not zero: a linear complementarity problem with a positive
/// definite matrix, which has one solution (Murty 1974). Coulomb friction: the tangential part is at most `friction` times the
/// normal one; it holds the node, or opposes its slip.
///
/// The set of held nodes is guessed from lumped masses and corrected until all conditions hold. All nodes that break one change at once;
/// after some rounds only one wall of the first of them, which cannot cycle without friction (Murty's rule). Friction is corrected when
/// the set has settled; what has not settled after some such rounds stays as it is.
template <int D>
class WallContact {
  public:
    /// Solves for the accelerations, with the given held directions, from the forces that it finds in `nodes`.
    using Solve = std::function<void(const std::vector<HeldNode<D>>&)>;

    /// `nodes` have projected velocities and forces; `known` the accelerations of constrained components.
    /// @param when of the velocities after the kick
    /// @param dt length of the kick, s
    WallContact(const Model<D>& model, State<D>& s, Lanes* nodes, const Lanes* known, const Moment& when, double dt);

    bool is_empty() const { return contacts_.empty(); }

    /// Leaves the accelerations in the nodes, and grips for `WallNodes::repeat` in the field. `multiply` sets s.field.mass.q to
    /// M a. Throws NumericalError if no set is found.
    void solve(const Solve& solve, const std::function<void()>& multiply, const ExchangeSums<D>& sums);

  private:
    /// A node in walls.
    struct Contact {
        typename WallNodes<D>::Touch touch;
        double mass{};
        Vec<D> v{};                 ///< projected, m/s
        Vec<D> force{};             ///< without walls, N
        Vec<D> known{};             ///< accelerations of components that are not free, minus gravity
        std::vector<int> closed{};  ///< walls that push
        bool sticks = false;
        Vec<D> rubbing{};  ///< friction of a node that slips, N
    };
    /// What walls do to a node: R along the normals of its closed walls, and the rest.
    struct Reaction {
        std::vector<double> normal;  ///< N, by closed wall
        Vec<D> tangential{};         ///< N
        double limit = 0.0;          ///< of its size, N
    };

    Vec<D> normal(const Contact& c, int wall) const { return along(c.touch.node.is_free, model_.walls[wall].normal); }
    Vec<D> acceleration(const Contact& c) const;
    Vec<D> advanced(const Contact& c) const { return c.v + dt_ * (acceleration(c) + model_.gravity); }
    Vec<D> slip(const Contact& c) const;
    void guess(Contact& c) const;
    HeldNode<D> held(const Contact& c) const;
    std::vector<HeldNode<D>> all_held() const;
    void put_forces();
    Reaction reaction(const Contact& c) const;
    double least_force(const Contact& c) const { return 1e-9 * speed_ * c.mass / dt_; }
    bool correct_set(Contact& c, bool one_wall) const;
    bool correct_friction(Contact& c) const;
    void report(const Contact& c, const ExchangeSums<D>& sums) const;

    const Model<D>& model_;
    State<D>& s_;
    Lanes* nodes_;
    double dt_;
    double speed_ = 0.0;              ///< scale of velocities at walls, m/s
    std::vector<Vec<D>> u_, middle_;  ///< velocities of the walls after the kick and at the positions, m/s
    std::vector<Contact> contacts_;
};

/// The nodes that walls held in a step, for velocities at time t.
template <int D>
std::vector<HeldNode<D>> held_by_walls(const Model<D>& model, const State<D>& s, const Lanes* nodes, double t);

}  // namespace ordo
