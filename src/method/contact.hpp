// Contact between bodies as a model holds it, and what a state remembers of it. The solve is in contact_step.hpp.
#pragma once

#include "base/array.hpp"
#include "shape/outline.hpp"

#include <array>
#include <compare>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

/// frictional: Coulomb's law; frictionless; no_slip: bodies part but never slide; tied: what touches at the start stays together,
/// what meets later is no_slip.
enum class ContactType { frictional, frictionless, no_slip, tied };

/// The outer faces of a body. Their vertices are corners of cells, or move with the parallelepipeds around them: each carries the
/// vertex at one place in itself, and the vertex is their mean.
template <int D>
struct ContactSurface {
    int body = 0;
    Outline<D> outline;
    struct Holder {
        int particle;  ///< its id
        int corner;    ///< of the cell
        Vec<D> place;  ///< in the parallelepiped, 1 at the ends of its edges
    };
    std::vector<int> first;  ///< of each vertex, and the end of the last: where its holders begin
    std::vector<Holder> holders;
};

/// Which point of which contact: a vertex of one of its two surfaces, which may have a foot on more than one face of the other, or
/// a Gauss point of a face. Against obstacles particles without faces are points themselves.
struct ContactKey {
    int pair    = 0;  ///< in Model::contacts
    int side    = 0;  ///< which of its surfaces has the point
    int of      = 0;  ///< the vertex, the face, or the id of the particle
    int ordinal = 0;  ///< of the feet of this vertex, or of the Gauss points of this face

    auto operator<=>(const ContactKey&) const = default;  // NOLINT(modernize-use-nullptr): a false alarm of clang-tidy 14
};

/// A point that stays with its foot for good.
template <int D>
struct TiedPoint {
    ContactKey key;
    int face = 0;
    std::array<double, Face<D>::max_corners> weight{};
    Vec<D> normal{};  ///< of an obstacle, at the start; in place of a face
    Vec<D> shift{};   ///< whole periods from the point to where it meets the obstacle, m
};

/// Two surfaces in contact, or one and an obstacle.
template <int D>
struct ContactPair {
    std::array<int, 2> surface{};  ///< in Model::surfaces; -1 for particles without faces, and in place of an obstacle's
    ContactType type  = ContactType::frictional;
    double friction   = 0.0;  ///< Coulomb's coefficient
    double adhesion   = 0.0;  ///< shear stress that holds without pressure, Pa
    int sweeps        = 1;
    bool on_faces     = false;  ///< points are Gauss points of faces, not vertices
    double wave_speed = 0.0;    ///< the faster of the two materials, m/s
    std::string name{};         ///< begins its columns
    std::vector<TiedPoint<D>> tied{};
    int obstacle = -1;  ///< in Model::obstacles, the second of the pair
    int body     = 0;   ///< that meets it
};

/// A point of contact in a step.
template <int D>
struct ContactPoint {
    static constexpr int max_corners = Face<D>::max_corners;

    ContactKey key;
    int face = 0;                              ///< of the other surface; -1 on an obstacle
    std::array<double, max_corners> weight{};  ///< of its corners: the foot
    Vec<D> x{};                                ///< m
    Vec<D> at{};                               ///< the same, on an obstacle by whole periods where it meets it, m
    Vec<D> normal{};                           ///< of length 1, out of the other surface
    double gap  = 0.0;                         ///< m; negative: overlap
    double area = 0.0;                         ///< half of the point's share of its faces, all of it on an obstacle, m^(D-1)
    double p    = 0.0;                         ///< normal impulse an area of the last step, N s/m^(D-1)
    Vec<D> t{};                                ///< tangential impulse an area, N s/m^(D-1)
    Vec<D> anchor{};                           ///< slip since the point sticks, m; of tied points all of their motion
    Vec<D> slip{};                             ///< tangential velocity after the last step, m/s
    bool is_tied = false, sticks = false, has_pressed = false;  ///< has_pressed: in the step before
};

/// The names of types in input.
inline constexpr std::array<std::string_view, 4> kContactNames = {"frictional", "frictionless", "no-slip", "tied"};

/// What a contact did.
struct ContactExchange {
    Vec<3> force{};           ///< on the first body, mean over the last step, N
    Vec<3> moment{};          ///< of these forces about the origin, N m
    double friction   = 0.0;  ///< work that friction has taken since the start, J
    double dissipated = 0.0;  ///< kinetic energy that normal impulses have taken since the start, J
};

/// Where an obstacle is and how it moves, and what bodies did to it.
template <int D>
struct ObstacleMotion {
    Vec<D> center{};                            ///< m
    std::array<double, 4> turn = {1, 0, 0, 0};  ///< since t = 0, a unit quaternion
    Vec<D> velocity{};                          ///< of the centre at the time of velocities, m/s
    Vec<3> spin{};                              ///< rad/s; in 2D the last counts
    ContactExchange exchange{};                 ///< with forces on the obstacle, and moments about its centre
    double work = 0.0;                          ///< that bodies have done on it since the start, J
};

/// What a state remembers of contact.
template <int D>
struct Contacts {
    std::vector<ContactPoint<D>> points;       ///< of the last step, ascending keys; those that press hold anchors
    std::vector<ContactExchange> pairs;        ///< by Model::contacts, those of two bodies
    std::vector<ObstacleMotion<D>> obstacles;  ///< by Model::obstacles
    double dt = 0.0;                           ///< of the last impulses, s
    std::vector<int> place_of;                 ///< where the sort has put the particle of an id; -1 where there is none
    Array<int> number;                         ///< scratch: of nodes

    /// Whether the model has any.
    bool are_there() const { return !pairs.empty() || !obstacles.empty(); }
    /// Energy that contacts and obstacles have taken since the start, J.
    double work() const
    {
        double r = 0.0;
        for (const ContactExchange& one : pairs) r += one.friction + one.dissipated;
        for (const ObstacleMotion<D>& one : obstacles) r += one.exchange.friction + one.exchange.dissipated + one.work;
        return r;
    }
    /// Forgets the forces of the last step.
    void clear_forces()
    {
        for (ContactExchange& one : pairs) one.force = one.moment = {};
        for (ObstacleMotion<D>& one : obstacles) one.exchange.force = one.exchange.moment = {};
    }
};

}  // namespace ordo
