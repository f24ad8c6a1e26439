// A case as plain structs: method, grid, materials, bodies, conditions, tractions, times. io fills them from a file, a program
// fills them by hand, and setup/build.hpp checks them. Knows no files and no expressions.
#pragma once

#include "base/error.hpp"
#include "method/stage.hpp"
#include "method/state.hpp"
#include "particles/seeding.hpp"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace ordo::setup {

enum class Part { grid, method, time, damping, material, boundary, traction, contact, obstacle, body, stage };

/// What is wrong with a case, in which part and key. For programs the message begins with "body[1].shape: .."; io replaces this
/// by the place in the file.
struct SetupError : InputError {
    SetupError(Part part, int index, std::string_view key, std::string_view why, int component = -1);

    Part part;
    int index;  ///< of the body, material, boundary or traction
    std::string key;
    std::string why;
    int component;  ///< of the field that is wrong, -1 for the key as a whole
};

/// A ring in 2D, a cylinder or tube in 3D, or a part of one. Polar cells without a hole need the whole of it: they have a square core
/// (particles/round_cells.hpp). If their numbers are not given, they are about as large as the grid's sub-cells.
template <int D>
struct TubeShape {
    Tube<D> tube{};
    bool is_polar = false;
    std::optional<int> radial{}, angular{}, layers{};
};

/// A ball in cells that fit it, around a core (particles/round_cells.hpp); `angular` around the circle, a multiple of 4, `radial` around
/// the core.
template <int D>
struct PolarBall {
    Ball<D> ball{};
    std::optional<int> radial{}, angular{};
};

/// The cells of a mesh. Its center, or in 3D its axis if given, distinguishes faces `inner` and `outer`.
template <int D>
struct MeshShape {
    CellMesh<D> mesh{};
    std::optional<Vec<D>> center{};
    std::optional<int> axis{};
};

/// A box, a ball, a tube, given particles, or the cells of a mesh.
template <int D>
using BodyShape = std::variant<Bounds<D>, Ball<D>, PolarBall<D>, TubeShape<D>, std::vector<Seed<D>>, MeshShape<D>>;

/// The stress of a body at the start: along the axis of gravity the weight above, across it k0 times that; or the same everywhere.
template <int D>
struct InitialStress {
    std::optional<double> k0{};  ///< lateral over vertical stress
    std::optional<double>
        surface{};            ///< coordinate of the ground above along the axis of gravity, m; by default the top of the body
    double overburden = 0.0;  ///< vertical pressure there, Pa
    std::optional<Stress<D>> uniform{};  ///< Pa

    bool is_given() const { return k0 || uniform; }
};

template <int D>
struct BodySpec {
    BodyShape<D> shape;
    std::string name{};               ///< for messages; by default "body" and the number
    int material                = 0;  ///< index in CaseSpec::materials
    Index<D> particles_per_cell = Index<D>::filled(2);
    bool gauss                  = false;  ///< particles at Gauss' points of the cells, not in the middle of sub-cells
    bool keeps_lattice_volumes  = false;  ///< of round bodies: particles on their faces have the volumes of whole sub-cells
    VectorField<D> velocity{};            ///< at the start, m/s
    VectorField<D> body_force{};          ///< per mass, in addition to gravity, m/s^2
    InitialStress<D> stress{};
};

enum class FaceType { fixed, symmetry, velocity, displacement, wall, periodic, free };
inline bool moves_nodes(FaceType t) { return t == FaceType::velocity || t == FaceType::displacement; }

/// A region of space.
template <int D>
using Region = std::variant<Bounds<D>, Ball<D>, Tube<D>>;

/// A condition on a face of the grid, or on the plane `at` across the same axis. One periodic face makes the axis periodic. Walls
/// may have a normal and a point instead; fixed, velocity and displacement a region, or a body whose nodes they hold. These take
/// the place of axis, side and `at`.
template <int D>
struct BoundarySpec {
    std::string name{};  ///< for messages
    int axis      = 0;
    bool is_above = false;  ///< the face with the larger coordinate
    FaceType type = FaceType::fixed;
    std::optional<double> at{};                   ///< m
    std::array<std::optional<Field>, D> value{};  ///< velocity, also of a wall, or displacement; without one free, of a wall 0
    std::optional<Vec<D>> normal{};               ///< out of the wall, of any length
    Vec<D> point{};                               ///< on the wall, m
    double friction = 0.0;                        ///< Coulomb's coefficient of a wall
    std::optional<Region<D>> region{};
    std::optional<int> body{};
    std::vector<int> stages{};  ///< in which it acts; none: in all

    bool is_on_plane() const { return !normal && !region && !body; }
};

/// Which outer faces of a body: all, those that look towards its center or away from it, or those whose normal points mostly
/// along an axis.
struct BodyFace {
    enum Kind { all, inner, outer, along_axis };
    Kind kind     = all;
    int axis      = 0;
    bool is_above = false;

    std::string name() const;  ///< such as x-min
};

template <int D>
struct TractionSpec {
    int body                    = 0;
    std::vector<BodyFace> faces = {BodyFace{}};
    Traction<D> traction{};
    std::vector<int> stages{};  ///< in which it acts; none: in all
};

/// Contact between each two of some bodies.
struct ContactSpec {
    std::string name{};         ///< begins its columns
    std::vector<int> bodies{};  ///< none: all
    ContactType type = ContactType::frictional;
    double friction  = 0.0;  ///< Coulomb's coefficient
    double adhesion  = 0.0;  ///< Pa
    int sweeps       = 1;
    bool on_faces    = false;  ///< contact at Gauss points of faces, not at vertices
};

/// A rigid solid that bodies meet. Without mass it moves as given; with mass its free components begin so.
template <int D>
struct ObstacleSpec {
    ContactSpec contact{};  ///< with bodies: name, law
    Solid<D> solid{};
    std::optional<Vec<D>> center{};  ///< about which it turns, m; by default its middle
    VectorField<D> velocity{};       ///< m/s, a function of t
    std::array<Field, 3> spin{};     ///< rad/s, a function of t; in 2D the last counts
    std::optional<double> mass{};    ///< kg
    Vec<D, bool> held{};             ///< with mass: axes along which it moves as given
    bool holds_spin = false;
};

/// A part of the run.
struct StageSpec {
    /// A body and its new material.
    struct Change {
        int body, material;
    };
    std::string name{};                ///< for messages
    double duration = 0.0;             ///< at most, s
    std::optional<double> residual{};  ///< at which it ends earlier, see method/equilibrium.hpp
    Damping damping{};
    std::vector<Change> materials{};  ///< at its start
    std::vector<int> removed{};       ///< bodies taken out at its start
};

struct TimeSpec {
    double end = 0.0;            ///< s
    std::optional<double> dt{};  ///< s; if not given, `cfl` determines the steps
    double cfl = 0.4;            ///< fraction of the method's Courant number
};

/// A whole case.
template <int D>
struct CaseSpec {
    MethodSpec method{};
    Vec<D> origin{}, size{}, spacing{};  ///< of the grid, m; the spacing divides the size
    Vec<D> gravity{};                    ///< m/s^2
    std::vector<Material> materials{};
    std::vector<BodySpec<D>> bodies{};
    std::vector<BoundarySpec<D>> boundaries{};
    std::vector<TractionSpec<D>> tractions{};
    std::vector<ContactSpec> contacts{};
    std::vector<ObstacleSpec<D>> obstacles{};
    TimeSpec time{};
    Damping damping{};                ///< without stages
    std::vector<StageSpec> stages{};  ///< one after another; none: the run is one
};

/// Such as "x-min".
std::string face_name(int axis, bool is_above);

/// Of a body's particles at the start.
struct BodyReport {
    std::string name;
    int particles = 0;
    double mass = 0.0, volume = 0.0;         ///< kg, m^D
    std::optional<double> true_volume = {};  ///< of its shape, if the particles do not fill it exactly, m^D
};

/// The checked input of a simulation.
template <int D>
struct Built {
    Model<D> model;
    Particles<D> particles;
    TimeSpec time;
    std::vector<Stage<D>> stages;
    std::vector<BodyReport> bodies;
    std::vector<std::string> notes;  ///< what a user may not expect
};

}  // namespace ordo::setup
