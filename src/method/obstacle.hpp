// Rigid obstacles: solids whose motion is given, or follows from their mass and the forces on them. Bodies meet them by the solve of
// contact_step.hpp.
#pragma once

#include "base/field.hpp"
#include "method/contact.hpp"
#include "shape/solid.hpp"

namespace ordo {

/// What a model knows of an obstacle.
template <int D>
struct Obstacle {
    std::string name{};           ///< begins its columns
    Solid<D> solid{};             ///< at t = 0
    Vec<D> center{};              ///< about which it turns, at t = 0; its centre of mass if it has mass, m
    VectorField<D> velocity{};    ///< of the centre, a function of t, or for free components that at the start, m/s
    std::array<Field, 3> spin{};  ///< angular velocity, likewise, rad/s; in 2D the last counts
    Vec<D> inverse_mass{};        ///< along the axes, 0 where the velocity is given, 1/kg
    Mat<3> inverse_inertia{};     ///< at t = 0; zero where the spin is given, 1/(kg m^2)

    bool is_free(int a) const { return inverse_mass[a] > 0; }
    bool turns_freely() const { return inverse_inertia(2, 2) > 0; }
    /// Whether forces move it.
    bool is_moved() const
    {
        bool r = turns_freely();
        for (int a = 0; a < D; ++a) r = r || is_free(a);
        return r;
    }
};

/// The rotation of a unit quaternion.
Mat<3> rotation_of(const std::array<double, 4>& turn);

/// Its place and motion at the start, with the velocities of time t.
template <int D>
ObstacleMotion<D> start_of(const Obstacle<D>& obstacle, double t);

/// Of the point x that moves with it, m/s.
template <int D>
Vec<D> velocity_at(const ObstacleMotion<D>& motion, const Vec<D>& x);

/// Of the same point, its displacement by `move`, m.
template <int D>
Vec<D> displacement_at(const ObstacleMotion<D>& motion, const Vec<D>& x, double dt);

/// The nearest part of its surface, see shape/solid.hpp.
template <int D>
std::optional<Clearance<D>> clearance(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion, const Vec<D>& x,
                                      const Vec<D>* n, double reach);

/// The inverse of its inertia as it lies now, 1/(kg m^2).
template <int D>
Mat<3> inverse_inertia(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion);

/// Bounds of the solid as it lies now, m; infinite for half-spaces.
template <int D>
Bounds<D> bounds_of(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion);

/// Sets given velocities to those of time t, and adds gravity to the others.
/// @param dt length of the kick, s
template <int D>
void kick(const std::vector<Obstacle<D>>& obstacles, std::vector<ObstacleMotion<D>>& motions, const Vec<D>& gravity, double t,
          double dt);

/// Moves obstacles by their velocities, and turns the anchors of points on them. A spin without moments keeps its angular momentum.
template <int D>
void move(const std::vector<Obstacle<D>>& obstacles, const std::vector<ContactPair<D>>& pairs, double dt, Contacts<D>& contacts);

}  // namespace ordo
