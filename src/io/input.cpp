#include "io/input.hpp"

#include "io/expression.hpp"
#include "io/hdf5.hpp"
#include "material/outside_law.hpp"
#include "setup/build.hpp"
#include "setup/schemes.hpp"
#include "sim/output_fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

namespace ordo::io {

namespace {

const std::vector<std::string> kFaces     = {"x-min", "x-max", "y-min", "y-max", "z-min", "z-max"};
const std::vector<std::string> kBodyFaces = {"x-min", "x-max", "y-min", "y-max", "z-min", "z-max", "inner", "outer", "all"};

// clang-format off
// ---- the schema ------------------------------------------------------------------------------------------------------

// Wrapped by hand: clang-format gives every item of a long row a line of its own, which hides the rows.
const Section<CaseInput>& case_section()
{
    static const Section<CaseInput> s{
        .name = "", .what = "The title of the case, and gravity.",
        .keys = {
            {&CaseInput::title, {.name = "title", .what = "one line that describes the case"}},
            {&CaseInput::gravity, {.name = "gravity",
                .what = "acceleration of all bodies", .unit = "m/s^2", .default_text = "0 per axis", .per_axis = true, .is_vector = true}}}};
    return s;
}

const Section<GridInput>& grid_section()
{
    static const Section<GridInput> s{
        .name = "grid", .what = "The background grid: a box of equal cells.",
        .keys = {
            {&GridInput::dim, {.name = "dim",
                .what = "number of dimensions: 1 (uniaxial strain), 2 (plane strain) or 3", .default_text = "as many as size has, else 2",
                .min = 1, .max = 3}},
            {&GridInput::origin, {.name = "origin",
                .what = "smallest coordinates", .unit = "m", .default_text = "0 per axis", .per_axis = true}},
            {&GridInput::size, {.name = "size",
                .what = "lengths", .unit = "m", .required = true, .per_axis = true, .min = 0, .open_min = true}},
            {&GridInput::spacing, {.name = "spacing",
                .what = "cell size; must divide the size", .unit = "m", .required = true, .per_axis = true, .min = 0,
                .open_min = true}}}};
    return s;
}

const Section<MethodInput>& method_section()
{
    static const Section<MethodInput> s = [] {
        Section<MethodInput> r{.name = "method", .what = "A preset, and any axis to override it.", .keys = {}};
        r.keys.push_back({&MethodInput::preset, {.name = "preset",
            .what = "a row of choices, see `ordo list methods`", .choices = preset_names()}});
        for_each_axis([&](auto axis) {
            using E = std::decay_t<decltype(MethodSpec{}.*axis)>;
            r.keys.push_back({&MethodInput::axes, {.name = std::string(Axis<E>::key),
                .what = std::string(Axis<E>::what), .default_text = "of the preset", .choices = choice_names<E>()}});
        });
        for (const Setting& number : settings())
            r.keys.push_back({&MethodInput::numbers, {.name = std::string(number.name),
                .what = std::string(number.what),
                .default_text = number.is_integer ? "of the preset"
                    : number.default_text.empty() ? fmt::format("{}", MethodSpec{}.*number.value)
                                                  : std::string(number.default_text),
                .min = number.min, .max = number.max}});
        return r;
    }();
    return s;
}

const Section<TimeInput>& time_section()
{
    static const Section<TimeInput> s{
        .name = "time", .what = "Duration and time steps.",
        .keys = {
            {&TimeInput::end, {.name = "end",
                .what = "time at which the run ends; required without [[stage]]", .unit = "s", .default_text = "the durations of all stages",
                .min = 0, .open_min = true}},
            {&TimeInput::dt, {.name = "dt",
                .what = "fixed time step; excludes cfl", .unit = "s", .default_text = "from cfl", .min = 0, .open_min = true}},
            {&TimeInput::cfl, {.name = "cfl",
                .what = "time step as a fraction of h/(c + |v|), with the P-wave speed c, times the Courant number that basis "
                        "and mass matrix allow (1 for hats with lumped mass); at most the stability limit of the method "
                        "(docs/design.md), which implicit schemes do not have; evaluated each step",
                .default_text = "0.4 without dt", .min = 0, .max = 1e6, .open_min = true}}}};
    return s;
}

const Section<DampingInput>& damping_section()
{
    static const Section<DampingInput> s{
        .name = "damping",
        .what = "How the velocities of particles are damped after each step, for states at rest under loads. `history.csv` has the "
                "energy that damping takes.",
        .keys = {
            {&DampingInput::type, {.name = "type",
                .what = "local: a force against each component of the velocity, factor times the force out of balance (Cundall 1987), for "
                        "loads that change slowly; viscous: velocities decay by exp(-rate t); kinetic: all velocities become "
                        "zero when the kinetic energy has passed a peak (Cundall 1982), the fastest way to rest",
                .choices = {kDampingNames.begin(), kDampingNames.end()}}},
            {&DampingInput::factor, {.name = "factor",
                .what = "of local damping, such as 0.7", .min = 0, .max = 1, .open_min = true}},
            {&DampingInput::rate, {.name = "rate",
                .what = "of viscous damping; a period is damped critically by 4 pi over it", .unit = "1/s", .min = 0,
                .open_min = true}}}};
    return s;
}

// clang-format on

/// The elastic constant of laws that take no pair, "" for none; null for laws that take a pair.
const char* elastic_constant(Elasticity e)
{
    switch (e) {
    case Elasticity::isotropic: return nullptr;
    case Elasticity::young: return "young";
    case Elasticity::bulk: return "bulk";
    case Elasticity::shear: return "shear";
    case Elasticity::none: return "";
    }
    return nullptr;
}

/// The elastic constants of laws that take no pair, in words.
std::string other_elasticity()
{
    std::string r;
    for (const LawRow& law : laws())
        if (const char* one = elastic_constant(law.elasticity))
            r += fmt::format("{}{} takes {}", r.empty() ? "" : ", ", law.name, *one ? std::string(one) + " alone" : "none");
    return r;
}

/// The default of a parameter, in words; empty if it has none.
std::string default_text(const LawParameter& p)
{
    if (!p.fallback_of.empty()) return std::string(p.fallback_of);
    if (p.fallback == LawParameter::required) return "";
    if (p.fallback == LawParameter::none) return "none";
    if (p.kind == ParameterKind::flag) return p.fallback > 0 ? "true" : "false";
    if (p.kind == ParameterKind::word) return to_toml(std::string(p.choices[static_cast<std::size_t>(p.fallback)]));
    return fmt::format("{}", p.fallback);
}

/// The key of a parameter of a law.
KeyInfo key_of(const LawParameter& p, const LawRow& law)
{
    constexpr double all = 1e300;  // stands for no limit in LawParameter
    KeyInfo info{.name         = std::string(p.name),
                 .what         = fmt::format("{}, of {}", p.what, law.name),
                 .unit         = std::string(p.unit),
                 .default_text = default_text(p),
                 .open_min     = p.open_min};
    const bool is_number = p.kind == ParameterKind::number || p.kind == ParameterKind::numbers;
    if (is_number && p.min > -all) info.min = p.min;
    if (is_number && p.max < all) info.max = p.max;
    for (const std::string_view& choice : p.choices)
        if (!choice.empty()) info.choices.emplace_back(choice);
    return info;
}

/// Adds a key for a parameter of a law. Laws may share a name: then the key allows what any of them does, and
/// resolve_material checks what the law of the material allows.
void add_parameter(Section<MaterialInput>& section, const LawParameter& p, const LawRow& law)
{
    KeyInfo info = key_of(p, law);
    for (auto& key : section.keys)
        if (key.info.name == info.name) {
            KeyInfo& both = key.info;
            both.what += "; " + info.what;
            if (both.default_text != info.default_text) both.default_text = "depends on the model";
            both.open_min = info.min < both.min ? info.open_min : both.open_min && (info.open_min || info.min > both.min);
            both.min      = std::min(both.min, info.min);
            both.max      = std::max(both.max, info.max);
            return;
        }
    auto add = [&](Member<MaterialInput> member) { section.keys.push_back({member, std::move(info)}); };
    switch (p.kind) {
    case ParameterKind::number: return add(&MaterialInput::parameters);
    case ParameterKind::numbers: return add(&MaterialInput::lists);
    case ParameterKind::word: return add(&MaterialInput::words);
    case ParameterKind::flag: return add(&MaterialInput::flags);
    }
}

// clang-format off
const Section<MaterialInput>& material_section()
{
    return kept_with_laws([] {
        std::vector<std::string> models;
        for (const LawRow* law : all_laws()) models.emplace_back(law->name);
        Section<MaterialInput> section{
            .name = "material",
            .what = "A material. Elastic constants come as one pair: young and poisson, lambda and mu, or bulk and shear; " +
                    other_elasticity() + ".",
            .repeated = true,
            .keys = {
                {&MaterialInput::name, {.name = "name", .what = "name, to which bodies refer", .required = true}},
                {&MaterialInput::model, {.name = "model",
                    .what = "constitutive model, see `ordo list materials`", .choices = models}},
                {&MaterialInput::density, {.name = "density",
                    .what = "initial density", .unit = "kg/m^3", .required = true, .min = 0, .open_min = true}},
                {&MaterialInput::young, {.name = "young", .what = "Young's modulus", .unit = "Pa", .min = 0, .open_min = true}},
                {&MaterialInput::poisson, {.name = "poisson",
                    .what = "Poisson's ratio; at 0.5 the material would be incompressible", .min = -1, .max = 0.5,
                    .open_min = true, .open_max = true}},
                {&MaterialInput::lambda, {.name = "lambda", .what = "first Lame constant", .unit = "Pa"}},
                {&MaterialInput::mu, {.name = "mu", .what = "second Lame constant", .unit = "Pa", .min = 0, .open_min = true}},
                {&MaterialInput::bulk, {.name = "bulk", .what = "bulk modulus", .unit = "Pa", .min = 0, .open_min = true}},
                {&MaterialInput::shear, {.name = "shear", .what = "shear modulus", .unit = "Pa", .min = 0, .open_min = true}}}};
        section.keys.push_back({&MaterialInput::branch_shear, {.name = "branch_shear",
            .what = "shear moduli of Maxwell branches beside the law, up to 8", .unit = "Pa", .min = 0, .open_min = true}});
        section.keys.push_back({&MaterialInput::branch_time, {.name = "branch_time",
            .what = "their relaxation times", .unit = "s", .min = 0, .open_min = true}});
        for (const LawRow& law : laws())
            for (const LawParameter& p : law.parameters) add_parameter(section, p, law);
        return section;
    });
}

/// The keys of shapes, of bodies and of regions.
template <class Owner>
std::vector<Key<Owner>> shape_keys()
{
    return {
        {&Owner::center, {.name = "center", .what = "centre of a round shape", .unit = "m", .per_axis = true}},
        {&Owner::radius, {.name = "radius", .what = "(outer) radius", .unit = "m", .min = 0, .open_min = true}},
        {&Owner::inner_radius, {.name = "inner_radius",
            .what = "inner radius of a ring or hollow cylinder", .unit = "m", .min = 0}},
        {&Owner::height, {.name = "height",
            .what = "length of a cylinder along its axis", .unit = "m", .min = 0, .open_min = true}},
        {&Owner::axis, {.name = "axis",
            .what = "axis of a cylinder, or of a mesh whose faces inner and outer carry tractions",
            .default_text = "\"z\"", .choices = {"x", "y", "z"}}},
        {&Owner::angle, {.name = "angle",
            .what = "first and last angle of a part of a ring or cylinder, measured from the first of "
                    "the two transverse axes towards the second",
            .unit = "degree", .default_text = "[0, 360]", .min = -360, .max = 720}},
        {&Owner::lower, {.name = "lower", .what = "smallest coordinates of a box", .unit = "m", .per_axis = true}},
        {&Owner::upper, {.name = "upper", .what = "largest coordinates of a box", .unit = "m", .per_axis = true}}};
}

const Section<BodyInput>& body_section()
{
    static const Section<BodyInput> s = [] {
        std::vector<std::string> names;
        for (const ShapeInfo& i : shapes()) names.push_back(i.name);
        Section<BodyInput> section{
            .name = "body", .what = "A body. Bodies stick together where they share cells of the grid, unless a [[contact]] lets them slide and part.", .repeated = true,
            .keys = {
                {&BodyInput::name, {.name = "name", .what = "for messages", .default_text = "body and its number"}},
                {&BodyInput::material, {.name = "material", .what = "name of a [[material]]", .required = true}},
                {&BodyInput::shape, {.name = "shape", .what = "see `ordo list shapes`", .required = true, .choices = names}},
                {&BodyInput::cells, {.name = "cells",
                    .what = "particle cells of a round body: sub-cells of the grid, or polar cells, which fit it: rings of cells with "
                            "corners on circles; in a ball or solid cylinder around a square or cube core (2D, 3D)",
                    .default_text = "\"cartesian\"", .choices = {"cartesian", "polar"}}},
                {&BodyInput::radial, {.name = "radial",
                    .what = "polar cells along the radius; without a hole: around the core", .default_text = "from particles_per_cell", .min = 1}},
                {&BodyInput::angular, {.name = "angular",
                    .what = "polar cells along the angle; without a hole: a multiple of 4, the core has a quarter of it along each side", .default_text = "from particles_per_cell", .min = 1}},
                {&BodyInput::layers, {.name = "layers",
                    .what = "polar cells along the axis of a cylinder", .default_text = "from particles_per_cell", .min = 1}},
                {&BodyInput::file, {.name = "file",
                    .what = "relative to the case file. For shape particles a CSV file with columns x, y, z, volume and "
                            "optional half-edge vectors r1x, r1y, ..; for shape mesh a Gmsh file (.msh, 2.2 or 4.1)"}},
                {&BodyInput::group, {.name = "group", .what = "physical group of the mesh", .default_text = "all elements"}},
                {&BodyInput::seeding, {.name = "seeding",
                    .what = "particles at the centres of equal sub-cells, or at Gauss points with Gauss's weights "
                            "(method.domain point)",
                    .default_text = "\"centres\"", .choices = {"centres", "gauss"}}},
                {&BodyInput::volumes, {.name = "volumes",
                    .what = "of round bodies in cartesian cells: exact: particles that the body's faces cut get volumes whose sum is exact; "
                            "lattice: those of whole sub-cells",
                    .default_text = "\"exact\"", .choices = {"exact", "lattice"}}},
                {&BodyInput::particles_per_cell, {.name = "particles_per_cell",
                    .what = "particles in a whole cell (4 in 2D is 2 x 2), or one number per axis", .default_text = "2 per axis",
                    .per_axis = true, .min = 1, .max = 1000}},
                {&BodyInput::velocity, {.name = "velocity",
                    .what = "initial velocity", .unit = "m/s", .default_text = "0 per axis", .per_axis = true}},
                {&BodyInput::body_force, {.name = "body_force",
                    .what = "force per mass, in addition to gravity; may use the initial position X, Y, Z", .unit = "m/s^2",
                    .default_text = "0 per axis", .per_axis = true}},
                {&BodyInput::k0, {.name = "k0",
                    .what = "stress at the start: along the axis of gravity the weight above, across it k0 times that; for laws that carry "
                            "elastic strain or stress (docs/stages.md)",
                    .min = 0}},
                {&BodyInput::surface, {.name = "surface",
                    .what = "of k0: coordinate of the ground along the axis of gravity; the weight between it and a particle has the density of "
                            "this body", .unit = "m", .default_text = "the top of the body"}},
                {&BodyInput::overburden, {.name = "overburden",
                    .what = "of k0: vertical pressure at the surface, such as the weight of other bodies", .unit = "Pa", .default_text = "0",
                    .min = 0}},
                {&BodyInput::initial_stress, {.name = "initial_stress",
                    .what = "the same stress everywhere at the start, in place of k0: xx, yy, zz, tension positive, then shear stresses if "
                            "there are any: xy in 2D, xy, yz, zx in 3D", .unit = "Pa"}}}};
        const auto keys = shape_keys<BodyInput>();
        section.keys.insert(section.keys.begin() + 3, keys.begin(), keys.end());  // after the shape
        return section;
    }();
    return s;
}

const Section<BoundaryInput>& boundary_section()
{
    static const Section<BoundaryInput> s{
        .name = "boundary",
        .what = "A condition on the nodes of a face, or of a plane parallel to it and all nodes beyond, or of a region, or on the "
                "nodes that the particles of a body reach. Planes and regions stay in their place and do not follow the material. "
                "Faces without a condition are free: particles that leave there end the run. Where entries meet, the later one "
                "wins, and bodies come before planes and regions. history.csv has the force and work of each.",
        .repeated = true,
        .keys = {
            {&BoundaryInput::name, {.name = "name",
                .what = "of the columns in history.csv: letters, digits and _", .default_text = "boundary_ and its number"}},
            {&BoundaryInput::face, {.name = "face",
                .what = "one face or a list of them; or else region, body or, for a wall, normal and point", .choices = kFaces}},
            {&BoundaryInput::body, {.name = "body",
                .what = "name of a [[body]] that moves as given: a grip or a punch. All nodes that its particles reach are held, up to "
                        "a cell around it: forces are best where its faces are on nodes, and jump in the step in which it leaves one"}},
            {&BoundaryInput::type, {.name = "type",
                .what = "fixed: zero velocity; symmetry: a plane of symmetry, zero velocity across it in both directions, so that "
                        "bodies do not leave it (a floor is a wall); wall: a rigid half-space that pushes and lets go, with friction; it acts "
                        "on the nodes in it, so contact begins up to a cell early, and a body is up to a cell deep in a wall that moves "
                        "into it (to press by a given way, use a body); velocity: prescribed by value, "
                        "and particles nearby receive the velocity increment of the nodes (so value 0 differs from fixed, "
                        "which gives them no increment); displacement: the same, with the velocity that follows from value; "
                        "periodic: both faces of the axis are one; free: no condition",
                .required = true, .choices = {"fixed", "symmetry", "wall", "velocity", "displacement", "periodic", "free"}}},
            {&BoundaryInput::at_coordinate, {.name = "at",
                .what = "coordinate of the plane; a plane between nodes acts from the first node beyond", .unit = "m",
                .default_text = "the face of the grid"}},
            {&BoundaryInput::normal, {.name = "normal",
                .what = "direction out of a wall at any angle, towards the bodies, in place of face", .per_axis = true}},
            {&BoundaryInput::point, {.name = "point", .what = "a point on a wall with a normal", .unit = "m", .per_axis = true}},
            {&BoundaryInput::friction, {.name = "friction",
                .what = "Coulomb's coefficient of friction of a wall; round bodies on coarse grids resist rolling, because they touch along a cell", .default_text = "0", .min = 0}},
            {&BoundaryInput::value, {.name = "value",
                .what = "type velocity: velocity per axis; type displacement: displacement per axis since t = 0, m, a function of t; "
                        "\"free\" leaves an axis alone. Type wall: its velocity, a function of t; the wall moves with it",
                .unit = "m/s", .per_axis = true}},
            {&BoundaryInput::stages, {.name = "stages",
                .what = "names of the [[stage]]s in which it acts; a wall moves in these only, and is in its first place when it comes back",
                .default_text = "all"}}}};
    return s;
}

const Section<ShapeInput>& region_section()
{
    static const Section<ShapeInput> s = [] {
        Section<ShapeInput> section{
        .name = "boundary.region",
        .what = "The region of a [[boundary]], `region = {shape = \"box\", lower = [..], upper = [..]}`: nodes in it and on its "
                "surface are held. It must hold nodes of the grid: a clamp is at least a cell thick.",
        .keys = {{&ShapeInput::shape,
                  {.name = "shape", .what = "with the keys of a [[body]] of that shape", .required = true,
                   .choices = {"box", "ball", "ring", "cylinder"}}}}};
        for (auto& key : shape_keys<ShapeInput>()) section.keys.push_back(std::move(key));
        return section;
    }();
    return s;
}

const Section<TractionInput>& traction_section()
{
    static const Section<TractionInput> s{
        .name = "traction",
        .what = "A pressure or traction on faces of a body. It acts on the outer faces of the particles' domains (for points: "
                "of the sub-cells in which they were seeded) and moves with them. On round bodies, types traction and dead count the area of the true surface. Several entries add up.",
        .repeated = true,
        .keys = {
            {&TractionInput::name, {.name = "name",
                .what = "of the columns in history.csv: letters, digits and _", .default_text = "traction_ and its number"}},
            {&TractionInput::body, {.name = "body", .what = "name of the [[body]]", .required = true}},
            {&TractionInput::face, {.name = "face",
                .what = "which outer faces, one or a list: x-min selects faces whose outward normal at the start points mostly "
                        "along -x, inner and outer those that look towards or away from the center of a round body, all every "
                        "face",
                .required = true, .choices = kBodyFaces}},
            {&TractionInput::type, {.name = "type",
                .what = "pressure: against the normal, which follows the face; traction: in a fixed direction, by current area; "
                        "dead: in a fixed direction, by initial area",
                .choices = {"pressure", "traction", "dead"}}},
            {&TractionInput::value, {.name = "value",
                .what = "one number or expression for a pressure, else one per axis; may use the initial position X, Y, Z",
                .unit = "Pa", .required = true}},
            {&TractionInput::stages, {.name = "stages",
                .what = "names of the [[stage]]s in which it acts", .default_text = "all"}}}};
    return s;
}

/// The keys that say how surfaces act on each other, of contacts and obstacles.
template <class Owner>
std::vector<Key<Owner>> law_keys()
{
    return {
        {&Owner::type, {.name = "type",
            .what = "frictional: Coulomb's law; frictionless; no-slip: bodies part but never slide; tied: what touches at the start (to a "
                    "twentieth of a cell) neither parts nor slides, what meets later does not slide",
            .choices = {kContactNames.begin(), kContactNames.end()}}},
        {&Owner::friction, {.name = "friction", .what = "Coulomb's coefficient, of frictional", .default_text = "0", .min = 0}},
        {&Owner::adhesion, {.name = "adhesion",
            .what = "shear stress that holds in addition to friction where bodies press, of frictional", .unit = "Pa", .default_text = "0",
            .min = 0}},
        {&Owner::sweeps, {.name = "sweeps",
            .what = "over all points in a step; one is enough but for piles of stiff bodies. The largest of all contacts counts",
            .min = 1, .max = 1000}},
        {&Owner::points, {.name = "points",
            .what = "where contact acts: at the vertices of bodies, or at Gauss points of their faces (2 of a segment, 4 of a "
                    "quadrilateral, 3 of a triangle), which meet round surfaces of few cells and unlike meshes better and cost more",
            .choices = {"vertices", "faces"}}}};
}

const Section<ContactInput>& contact_section()
{
    static const Section<ContactInput> s = [] {
        Section<ContactInput> section{
        .name = "contact",
        .what = "Contact between each two of some bodies, which meet at their true faces, slide and part (docs/contact.md). Bodies without "
                "contact stick together where they share cells of the grid. Methods with corners only: domain parallelepiped, cell or "
                "simplex. history.csv has the force, moment and work of each pair.",
        .repeated = true,
        .keys = {
            {&ContactInput::name, {.name = "name",
                .what = "of the columns in history.csv: letters, digits and _", .default_text = "contact_ and its number"}},
            {&ContactInput::bodies, {.name = "bodies",
                .what = "names of two or more [[body]]s, or \"all\"", .required = true}}}};
        for (auto& key : law_keys<ContactInput>()) section.keys.push_back(std::move(key));
        return section;
    }();
    return s;
}

const Section<ObstacleInput>& obstacle_section()
{
    static const Section<ObstacleInput> s = [] {
        std::vector<std::string> names;
        for (const ShapeInfo& i : obstacle_shapes()) names.push_back(i.name);
        Section<ObstacleInput> section{
            .name = "obstacle",
            .what = "A rigid solid that bodies meet at their true faces, slide along and leave. It moves as given, or by the forces on it if it "
                    "has mass. Methods with domain parallelepiped, cell or simplex; with domain point or box, and scheme musl, each particle "
                    "is a point of contact. history.csv has the force of the bodies on it, the moment of this force about its centre, the "
                    "energy that friction and contact took, the work of the bodies on it, and its place and motion.",
            .repeated = true,
            .keys = {
                {&ObstacleInput::name, {.name = "name",
                    .what = "of the columns in history.csv: letters, digits and _", .default_text = "obstacle_ and its number"}},
                {&ObstacleInput::shape, {.name = "shape", .what = "see `ordo list shapes`", .required = true, .choices = names}},
                {&ObstacleInput::point, {.name = "point", .what = "a point on the surface of a half-space", .unit = "m", .per_axis = true}},
                {&ObstacleInput::normal, {.name = "normal",
                    .what = "direction out of a half-space, towards the bodies, of any length", .per_axis = true}},
                {&ObstacleInput::lower, {.name = "lower", .what = "smallest coordinates of a box", .unit = "m", .per_axis = true}},
                {&ObstacleInput::upper, {.name = "upper", .what = "largest coordinates of a box", .unit = "m", .per_axis = true}},
                {&ObstacleInput::center, {.name = "center",
                    .what = "centre of a ball or cylinder; of other shapes the point about which they turn", .unit = "m",
                    .default_text = "the middle of a box, the centre of volume of a closed stl surface, the middle of the bounds of an open one, "
                                    "the point of a half-space", .per_axis = true}},
                {&ObstacleInput::radius, {.name = "radius", .what = "of a ball or cylinder", .unit = "m", .min = 0, .open_min = true}},
                {&ObstacleInput::height, {.name = "height",
                    .what = "length of a cylinder along its axis", .unit = "m", .min = 0, .open_min = true}},
                {&ObstacleInput::axis, {.name = "axis", .what = "of a cylinder", .default_text = "\"z\"", .choices = {"x", "y", "z"}}},
                {&ObstacleInput::file, {.name = "file",
                    .what = "STL file, binary or text, relative to the case file; corners of triangles go round counterclockwise, seen from "
                            "outside. An open surface acts on the side of its normals"}},
                {&ObstacleInput::scale, {.name = "scale",
                    .what = "factor on the coordinates of the file, such as 0.001 for millimetres", .default_text = "1.0", .min = 0, .open_min = true}},
                {&ObstacleInput::velocity, {.name = "velocity",
                    .what = "velocity of the centre, a function of t; with mass that at the start", .unit = "m/s", .default_text = "0 per axis",
                    .per_axis = true}},
                {&ObstacleInput::rotation, {.name = "rotation",
                    .what = "angular velocity about the centre, a function of t: one value in 2D, three in 3D; with mass that at the start",
                    .unit = "rad/s", .default_text = "0"}},
                {&ObstacleInput::mass, {.name = "mass",
                    .what = "the obstacle moves by gravity and the forces of bodies, with the inertia of a solid of equal density; in 2D of a "
                            "metre of depth. Damping does not act on it", .unit = "kg", .default_text = "none: it moves as given", .min = 0,
                    .open_min = true}},
                {&ObstacleInput::held, {.name = "held",
                    .what = "with mass: axes along which it moves as velocity says, and rotation if it turns as rotation says",
                    .choices = {"x", "y", "z", "rotation"}}},
                {&ObstacleInput::bodies, {.name = "bodies", .what = "names of the [[body]]s that meet it, or \"all\""}}}};
        for (auto& key : law_keys<ObstacleInput>()) section.keys.push_back(std::move(key));
        return section;
    }();
    return s;
}

const Section<OutputInput>& output_section()
{
    return kept_with_laws([] {
        std::vector<std::string> names;
        for (const OutputFieldText& f : output_fields()) names.push_back(f.name);
        return Section<OutputInput>{
            .name = "output", .what = "What is written, and where.",
            .keys = {
                {&OutputInput::directory, {.name = "directory",
                    .what = "where files go, relative to the working directory; {case} stands for the name of the case, {hash} for a hash of "
                            "all other keys, so that each run of a sweep gets a directory of its own", .default_text = "results/NAME of the case"}},
                {&OutputInput::interval, {.name = "interval",
                    .what = "time between particle files", .unit = "s", .default_text = "end/50", .min = 0, .open_min = true}},
                {&OutputInput::fields, {.name = "fields", .what = "particle fields to write", .choices = names}},
                {&OutputInput::particles, {.name = "particles",
                    .what = "domains: drawn as the method has them; points: their centres only, as one cell", .choices = {"domains", "points"}}},
                {&OutputInput::every, {.name = "every", .what = "write each n-th particle only", .min = 1}},
                {&OutputInput::precision, {.name = "precision",
                    .what = "of real numbers in files of particles", .choices = {"float64", "float32"}}},
                {&OutputInput::compression, {.name = "compression",
                    .what = "of files of particles", .choices = {"none", "zlib"}}},
                {&OutputInput::grid, {.name = "grid", .what = "write the grid too, grid_*.vti"}},
                {&OutputInput::per_body, {.name = "per_body",
                    .what = "write body_0.csv, body_1.csv, .. too, with mass, centre, momentum, angular momentum and energies of each body"}},
                {&OutputInput::history_interval, {.name = "history_interval",
                    .what = "steps between rows of history.csv and of probes", .min = 1}}}};
    });
}

const Section<CheckpointInput>& checkpoint_section()
{
    static const Section<CheckpointInput> s{
        .name = "checkpoint",
        .what = "When the state of the run is written to DIR/checkpoint_*.h5, for `ordo run --restart`. SIGINT, SIGTERM and "
                "SIGHUP write one too.",
        .keys = {
            {&CheckpointInput::steps, {.name = "steps", .what = "steps between checkpoints", .default_text = "none", .min = 1}},
            {&CheckpointInput::wall_minutes, {.name = "wall_minutes",
                .what = "wall-clock time between checkpoints", .unit = "min", .default_text = "none", .min = 0,
                .open_min = true}},
            {&CheckpointInput::keep, {.name = "keep", .what = "how many checkpoints are kept, the latest", .min = 1}}}};
    return s;
}

const Section<WatchInput>& watch_section()
{
    static const Section<WatchInput> s{
        .name = "watch",
        .what = "What ends a run. Particles that turn inside out, leave the grid or are not finite, and mass matrices that are "
                "not solved, always do. Of the following, what is not fatal is a warning.",
        .keys = {
            {&WatchInput::fatal, {.name = "fatal",
                .what = "energy: it grows by more than energy_growth allows; time-step: a fixed dt that is too long for the "
                        "current particle speeds; dropped-pivots: fits with too few particles (no warning: they are in "
                        "history.csv); gaps: points that stretch has moved more than a cell apart, so that the body tears",
                .choices = {WatchSpec::names.begin(), WatchSpec::names.end()}}},
            {&WatchInput::energy_growth, {.name = "energy_growth",
                .what = "how much energy the method may add, as a fraction of all that was there or was exchanged: kinetic and strain "
                        "energy at the start and the largest changes since by gravity, boundaries, tractions, body forces and damping",
                .min = 0}}}};
    return s;
}

const Section<ProbeInput>& probe_section()
{
    static const Section<ProbeInput> s{
        .name = "probe", .what = "A particle to follow, or a fixed point in space to watch: probe_NAME.csv.", .repeated = true,
        .keys = {
            {&ProbeInput::name, {.name = "name", .what = "part of the file's name", .required = true}},
            {&ProbeInput::particle, {.name = "particle",
                .what = "position; the particle that starts nearest to it is followed", .unit = "m", .per_axis = true}},
            {&ProbeInput::point, {.name = "point",
                .what = "fixed position; velocity and density are those of the grid, from the first step on", .unit = "m",
                .per_axis = true}}}};
    return s;
}

const Section<StageInput>& stage_section()
{
    static const Section<StageInput> s{
        .name = "stage",
        .what = "A part of the run; one follows another (docs/stages.md). Bodies change their materials at the start of a stage by "
                "`materials = {BODY = \"MATERIAL\", ..}`.",
        .repeated = true,
        .keys = {
            {&StageInput::name, {.name = "name", .what = "name, to which boundaries and tractions refer", .required = true}},
            {&StageInput::duration, {.name = "duration", .what = "length, at most if there is a residual", .unit = "s", .required = true,
                .min = 0, .open_min = true}},
            {&StageInput::residual, {.name = "residual",
                .what = "the stage ends when the bodies are at rest: when accelerations are at most this part of gravity and body forces (roots of "
                        "mean squares), and kinetic energy at most its square of the stored energy. Then the clock goes to the planned end. If they "
                        "are not within the duration, the run fails", .default_text = "none", .min = 0, .max = 1, .open_min = true, .open_max = true}},
            {&StageInput::damping, {.name = "damping",
                .what = "type of damping in this stage", .default_text = "that of [damping]",
                .choices = {kDampingNames.begin(), kDampingNames.end()}}},
            {&StageInput::factor, {.name = "factor",
                .what = "of local damping", .default_text = "that of [damping]", .min = 0, .max = 1, .open_min = true}},
            {&StageInput::rate, {.name = "rate",
                .what = "of viscous damping", .unit = "1/s", .default_text = "that of [damping]", .min = 0, .open_min = true}},
            {&StageInput::remove, {.name = "remove", .what = "names of bodies that are taken out at its start", .default_text = "none"}}}};
    return s;
}
// clang-format on

// ---- reading ---------------------------------------------------------------------------------------------------------

/// The largest number of parts of a dotted key; keys of the schema have at most four, such as body.0.velocity.1 of --set.
constexpr std::size_t kMostParts = 16;

/// The place after the TOML string that starts with a quote at `k`.
std::size_t end_of_string(std::string_view text, std::size_t k)
{
    const std::string quote(text.substr(k, 3) == std::string(3, text[k]) ? 3 : 1, text[k]);
    for (k += quote.size(); k < text.size(); ++k) {
        if (quote[0] == '"' && text[k] == '\\')
            ++k;
        else if (quote.size() == 1 && text[k] == '\n')
            return k;
        else if (text.substr(k, quote.size()) == quote)
            return text.find_first_not_of(quote[0], k + quote.size());  // a multi-line string may end with up to two more quotes
    }
    return text.size();
}

/// Throws if a key has too many parts: toml++ 3.3 deletes the tables of a.a.a.. by recursion, which can overflow the stack.
void require_short_keys(const std::filesystem::path& file, std::string_view text)
{
    std::size_t parts = 1;
    for (std::size_t k = 0; k < text.size(); ++k) {
        if (text[k] == '"' || text[k] == '\'') k = end_of_string(text, k);
        if (k < text.size() && text[k] == '#') k = text.find('\n', k);
        if (k >= text.size()) return;
        if (text[k] == '.') ++parts;
        if (std::string_view(",=[]{}\n").find(text[k]) != std::string_view::npos) parts = 1;
        if (parts > kMostParts) {
            const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(k), '\n') + 1;
            fail({file.string(), static_cast<int>(line), 1}, "key",
                 fmt::format("has more than {} parts; no key has that many", kMostParts));
        }
    }
}

toml::table parse_text(const std::string& text, const std::filesystem::path& file)
{
    require_short_keys(file, text);
    try {
        return toml::parse(text, file.string());
    } catch (const toml::parse_error& e) {
        const auto& at = e.source().begin;
        throw InputError(
            one_line(fmt::format("{}:{}:{}: not valid TOML: {}", file.string(), at.line, at.column, e.description())));
    }
}

toml::table parse_file(const std::filesystem::path& file)
{
    std::error_code none;
    if (std::filesystem::is_directory(file, none))
        throw InputError(file.string() + ": is a directory; give the case file, such as " + (file / "case.toml").string());
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw InputError(file.string() + ": cannot be opened; give the path of a case file, such as cases/two-disks/case.toml");
    constexpr std::size_t most = std::size_t{1} << 24;  // bytes; devices may never end
    std::string text;
    for (std::array<char, 1 << 16> piece; text.size() <= most && in;
         text.append(piece.data(), static_cast<std::size_t>(in.gcount())))
        in.read(piece.data(), piece.size());
    if (text.size() > most) throw InputError(file.string() + ": is larger than 16 MB; that is no case file");
    return parse_text(text, file);
}

[[noreturn]] void fail_override(const std::string& text, std::string_view message)
{
    constexpr std::size_t enough = 200;
    throw InputError(one_line(
        fmt::format("--set {}{}: {}", std::string_view(text).substr(0, enough), text.size() > enough ? ".." : "", message)));
}

/// The value of `--set key=value`: TOML, or a bare word taken as a string.
toml::table parse_value(const std::string& text, const std::string& value)
{
    try {
        return toml::parse("value = " + value);
    } catch (const toml::parse_error&) {}
    try {
        return toml::parse("value = " + to_toml(value));
    } catch (const toml::parse_error& e) {
        fail_override(text, fmt::format("is neither TOML nor text: {}", e.description()));
    }
}

void apply_override(toml::table& root, const std::string& text)
{
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) fail_override(text, "must be key=value, such as --set grid.spacing=0.05");
    const std::string key = text.substr(0, equals);
    // toml::node copies lose their source, which marks values from the command line.
    const toml::table parsed = parse_value(text, text.substr(equals + 1));
    // The two exclude each other: setting one removes the other, so a sweep over one needs no change of the file.
    if (key == "time.cfl" || key == "time.dt")
        if (toml::node* time = root.get("time"); time && time->is_table())
            time->as_table()->erase(key == "time.cfl" ? "dt" : "cfl");
    toml::node* node = &root;
    std::stringstream parts(key);
    std::vector<std::string> path;
    for (std::string part; std::getline(parts, part, '.');) path.push_back(part);
    if (path.size() > kMostParts) fail_override(text, fmt::format("has a key of {} parts; no key has that many", path.size()));
    for (std::size_t k = 0; k < path.size(); ++k) {
        const bool last = k + 1 == path.size();
        if (toml::table* table = node->as_table()) {
            if (last) {
                table->insert_or_assign(path[k], *parsed.get("value"));
                return;
            }
            if (!table->contains(path[k])) table->insert(path[k], toml::table{});
            node = table->get(path[k]);
        } else if (toml::array* list = node->as_array()) {
            const bool digits =
                !path[k].empty() && path[k].size() < 9 && path[k].find_first_not_of("0123456789") == std::string::npos;
            const std::size_t index = digits ? std::stoul(path[k]) : list->size();
            if (list->empty()) fail_override(text, fmt::format("the list is empty and has no element \"{}\"", path[k]));
            if (index >= list->size())
                fail_override(text, fmt::format("\"{}\" must be a number from 0 to {}", path[k], list->size() - 1));
            if (last) {
                list->replace(list->cbegin() + static_cast<std::ptrdiff_t>(index), *parsed.get("value"));
                return;
            }
            node = list->get(index);
        } else {
            fail_override(text, fmt::format("there is no table to hold \"{}\"", path[k]));
        }
    }
}

const toml::table& table_of(const toml::node& node, const std::string& name)
{
    if (const toml::table* table = node.as_table()) return *table;
    fail(place_of(node), name, "must be a table, [" + name + "]");
}

/// The region of boundary k, a table in its table.
void read_inner(const toml::table& boundary, const std::string& path, int dim, BoundaryInput& out)
{
    const toml::node* node = boundary.get("region");
    if (!node) return;
    out.at["region"] = place_of(*node);
    read_table(region_section(), table_of(*node, path + ".region"), path + ".region", dim, out.region.emplace());
}
/// The table `key` of a table, whose own keys are names that a user chose.
template <class Entries>
void read_entries(const toml::table& table, const std::string& path, const std::string& key, const char* what, Located& owner,
                  Entries& out)
{
    const toml::node* node = table.get(key);
    if (!node) return;
    out.path      = path + "." + key;
    owner.at[key] = place_of(*node);
    for (const auto& [entry, value] : table_of(*node, out.path)) {
        const std::string name(entry.str());
        const KeyInfo info{.name = name, .what = what};
        ValueReader{info, out.path + "." + name, out.at[name] = place_of(value), 0}.read(value, out.all);
    }
}
/// The materials of a stage, by body.
void read_inner(const toml::table& stage, const std::string& path, int, StageInput& out)
{
    read_entries(stage, path, "materials", "its new material", out, out.materials);
}
/// The parameters of a law from outside.
void read_inner(const toml::table& material, const std::string& path, int, MaterialInput& out)
{
    read_entries(material, path, "parameters", "parameter of the law", out, out.own);
}
template <class T>
void read_inner(const toml::table&, const std::string&, int, T&)
{}

template <class T>
void read_repeated(const toml::table& root, const Section<T>& section, int dim, std::vector<T>& out,
                   const std::vector<std::string>& others = {})
{
    const toml::node* node = root.get(section.name);
    if (!node) return;
    const toml::array* list = node->as_array();
    if (!list) fail(place_of(*node), section.name, "must be written [[" + section.name + "]], because there may be several");
    for (std::size_t k = 0; k < list->size(); ++k) {
        const std::string path   = fmt::format("{}[{}]", section.name, k);
        const toml::table& table = table_of(*list->get(k), path);
        read_table(section, table, path, dim, out.emplace_back(), others);
        read_inner(table, path, dim, out.back());
    }
}

template <class T>
void read_single(const toml::table& root, const Section<T>& section, int dim, T& out, const Place& file)
{
    const toml::node* node = root.get(section.name);
    if (node) {
        read_table(section, table_of(*node, section.name), section.name, dim, out);
        return;
    }
    out.path  = section.name;
    out.place = file;
    for (const auto& k : section.keys)
        if (k.info.required)
            fail(file, section.name,
                 fmt::format("is missing; the case needs a table [{}] with the key {}", section.name, k.info.name));
}

/// The number of axes, which determines the length of other keys.
int read_dim(const toml::table& root)
{
    GridInput grid;
    if (const toml::node* node = root.at_path("grid.dim").node()) {
        const auto& key = grid_section().keys.front();
        ValueReader{key.info, "grid.dim", place_of(*node), 0}.read(*node, grid.dim);
    } else if (const toml::array* size = root.at_path("grid.size").as_array(); size && !size->empty() && size->size() <= 3) {
        grid.dim = static_cast<int>(size->size());
    }
    return grid.dim;
}

// ---- validation and defaults -----------------------------------------------------------------------------------------

MethodSpec resolve_method(MethodInput& in, bool moves_nodes)
{
    MethodSpec spec = find_preset(in.preset)->spec;
    for_each_axis([&](auto axis) {
        using E           = std::decay_t<decltype(spec.*axis)>;
        std::string& name = in.axes[std::string(Axis<E>::key)];
        if (!name.empty()) spec.*axis = parse_choice<E>(name);
        name = name_of(spec.*axis);
    });
    if (updates_stress_last(spec)) spec.strain_velocity = strain_velocity_of(spec);
    spec.lump_below = setup::default_lump_below(spec, moves_nodes);
    if (is_implicit(spec) && spec.ghost_penalty < 0) spec.ghost_penalty = ghost_penalty_of(spec);
    if (spec.scheme == TimeScheme::newmark) {
        if (in.has("newmark_gamma")) spec.newmark_gamma = in.numbers.at("newmark_gamma");
        spec.newmark_beta = newmark_beta_of(spec);
    }
    for (const Setting& s : settings()) {
        if (!in.has(std::string(s.name)) && spec.*s.value < s.min) continue;  // the method has none
        double& number = in.numbers.try_emplace(std::string(s.name), spec.*s.value).first->second;
        spec.*s.value  = number;
        if (s.is_integer && number != std::floor(number))
            in.fail(std::string(s.name), fmt::format("must be an integer (got {})", number));
    }
    if (const Rule* rule = broken_rule(spec)) {
        // Blame the last key of the rule that the input has.
        std::istringstream words{std::string(rule->what)};
        std::string key = "preset";
        for (std::string word; words >> word;) {
            if (word.ends_with(',')) word.pop_back();
            if (in.has(word)) key = word;
        }
        const std::string rest =
            in.has("preset") ? "" : fmt::format("; choices not given are those of the default, preset {}", in.preset);
        in.fail(key, fmt::format("{} is not allowed: {}{}", rule->what, rule->why, rest));
    }
    return spec;
}

/// The Lame constants of a material from the given pair of constants.
void resolve_elasticity(const MaterialInput& in, const LawRow& law, Material& m)
{
    const std::pair<const char*, bool> given[] = {{"young", in.young.has_value()},   {"poisson", in.poisson.has_value()},
                                                  {"lambda", in.lambda.has_value()}, {"mu", in.mu.has_value()},
                                                  {"bulk", in.bulk.has_value()},     {"shear", in.shear.has_value()}};
    std::string names;
    int count = 0;
    for (const auto& [name, is] : given)
        if (is) names += (count++ ? ", " : "") + std::string(name);
    if (count == 0) names = "none";

    if (const char* only = elastic_constant(law.elasticity)) {
        if (names != (*only ? only : "none"))
            in.fail("model", fmt::format("{} takes {} (got {})", law.name,
                                         *only ? fmt::format("{} alone", only) : "no elastic constants but its own", names));
        if (law.elasticity == Elasticity::young) m.mu = *in.young / 2;
        if (law.elasticity == Elasticity::bulk) m.lambda = *in.bulk;
        if (law.elasticity == Elasticity::shear) m.mu = *in.shear;
        return;
    }
    if (count == 2 && in.young && in.poisson) {
        if (*in.poisson > 0.5 - 1e-6)
            in.fail("poisson",
                    fmt::format("must be at most 0.499999 (got {:.9g}): the bulk modulus grows without limit towards 0.5, and "
                                "the time step shrinks to nothing; 0.49 is nearly incompressible",
                                *in.poisson));
        m = elastic_material(m.law, in.density, *in.young, *in.poisson);
    } else if (count == 2 && in.lambda && in.mu) {
        m.lambda = *in.lambda;
        m.mu     = *in.mu;
    } else if (count == 2 && in.bulk && in.shear) {
        m.lambda = *in.bulk - 2.0 / 3.0 * *in.shear;
        m.mu     = *in.shear;
    } else {
        in.fail("model",
                "needs exactly one pair of elastic constants: young and poisson, lambda and mu, or bulk and shear (got " + names +
                    ")");
    }
    if (!(3 * m.lambda + 2 * m.mu > 0))
        in.fail("lambda", "makes the bulk modulus lambda + 2 mu/3 zero or negative; the material would collapse");
}

/// Throws if an output field is a history column that no material of the case carries.
void require_carried(const CaseInput& c)
{
    auto carries = [](const LawRow& law, const std::string& name, int dim = 3) {
        return std::any_of(law.history.begin(), law.history.end(),
                           [&](const HistoryColumn& column) { return column.name == name && column.min_dim <= dim; });
    };
    for (const std::string& f : c.output.fields) {
        const std::vector<const LawRow*> laws = all_laws();
        const bool is_column = std::any_of(laws.begin(), laws.end(), [&](const LawRow* law) { return carries(*law, f); });
        const bool is_there  = std::any_of(c.resolved_materials.begin(), c.resolved_materials.end(),
                                           [&](const Material& m) { return carries(*m.law, f, c.grid.dim); });
        if (is_column && !is_there) c.output.fail("fields", "no material of the case carries \"" + f + "\"");
    }
}

/// Throws if a number is outside the range of a parameter: keys that laws share allow what any of them does.
void require_in_range(const MaterialInput& in, const LawRow& law, const LawParameter& p, double value)
{
    const bool is_low = p.open_min ? !(value > p.min) : !(value >= p.min);
    if (!is_low && value <= p.max) return;
    std::string range =
        is_low ? fmt::format("{} {}", p.open_min ? "above" : "at least", p.min) : fmt::format("at most {}", p.max);
    if (is_low && p.min == 0) range = p.open_min ? "positive" : "zero or positive";
    in.fail(std::string(p.name), fmt::format("must be {} for {} (got {})", range, law.name, value));
}

/// The numbers of a list; places that are not used hold `none`.
void resolve_list(const MaterialInput& in, const LawRow& law, const LawParameter& p, double* places)
{
    std::fill_n(places, p.places(), LawParameter::none);
    const auto found = in.lists.find(std::string(p.name));
    if (found == in.lists.end()) return;
    const std::vector<double>& values = found->second;
    if (values.empty() || static_cast<int>(values.size()) > p.most)
        in.fail(std::string(p.name), fmt::format("must have 1 to {} numbers (got {})", p.most, values.size()));
    for (const double v : values) require_in_range(in, law, p, v);
    std::copy(values.begin(), values.end(), places);
}

/// Whether the input gives a parameter; fills in the default of one that it does not give.
bool has_parameter(MaterialInput& in, const LawParameter& p, const Material& m)
{
    const std::string name(p.name);
    if (in.has(name)) return true;
    if (!p.fallback_of.empty()) {
        int place = 0;
        for (const LawParameter& other : m.law->parameters) {
            if (other.name == p.fallback_of) in.parameters[name] = m.parameters[static_cast<std::size_t>(place)];
            place += other.places();
        }
        return true;
    }
    if (p.fallback == LawParameter::none || p.fallback == LawParameter::required) return false;
    if (p.kind == ParameterKind::number) in.parameters[name] = p.fallback;
    if (p.kind == ParameterKind::flag) in.flags[name] = p.fallback > 0;
    if (p.kind == ParameterKind::word) in.words[name] = p.choices[static_cast<std::size_t>(p.fallback)];
    return true;
}

/// The number of a parameter that is given.
double number_of(const MaterialInput& in, const LawParameter& p, const LawRow& law)
{
    const std::string name(p.name);
    switch (p.kind) {
    case ParameterKind::flag: return in.flags.at(name) ? 1.0 : 0.0;
    case ParameterKind::word:
        return static_cast<double>(std::find(p.choices.begin(), p.choices.end(), in.words.at(name)) - p.choices.begin());
    case ParameterKind::number:
    case ParameterKind::numbers: break;
    }
    const double value = in.parameters.at(name);
    if (in.has(name)) require_in_range(in, law, p, value);
    return value;
}

/// Throws if the input has a parameter that the law does not have.
void require_own_parameters(const MaterialInput& in, const LawRow& law)
{
    auto require_own = [&](const auto& given) {
        for (const auto& one : given)
            if (std::none_of(law.parameters.begin(), law.parameters.end(),
                             [&](const LawParameter& p) { return p.name == one.first; }))
                in.fail(one.first, fmt::format("is not a parameter of {}; remove it", law.name));
    };
    require_own(in.parameters);
    require_own(in.words);
    require_own(in.flags);
    require_own(in.lists);
}

void resolve_parameters(MaterialInput& in, Material& m)
{
    require_own_parameters(in, *m.law);
    std::size_t place = 0;
    for (const LawParameter& p : m.law->parameters) {
        const bool is_there = has_parameter(in, p, m);
        if (!is_there && p.is_required())
            in.fail("model", fmt::format("{} needs {} ({}{})", m.law->name, p.name, p.what,
                                         p.unit.empty() ? "" : fmt::format(", {}", p.unit)));
        if (p.kind == ParameterKind::numbers)
            resolve_list(in, *m.law, p, &m.parameters[place]);
        else
            m.parameters[place] = is_there ? number_of(in, p, *m.law) : LawParameter::none;
        place += static_cast<std::size_t>(p.places());
    }
    const BadParameter bad = m.law->check ? m.law->check(m) : BadParameter{};
    if (!bad.name.empty()) {
        const auto number = in.parameters.find(std::string(bad.name));
        in.fail(std::string(bad.name),
                number == in.parameters.end() ? std::string(bad.why) : fmt::format("{} (got {})", bad.why, number->second));
    }
    if (m.law->complete) m.law->complete(m);
}

void resolve_branches(const MaterialInput& in, Material& m)
{
    if (!in.has("branch_shear") && !in.has("branch_time")) return;
    for (const char* key : {"branch_shear", "branch_time"})
        if (!in.has(key)) in.fail("model", fmt::format("needs {} too: each Maxwell branch has a modulus and a time", key));
    if (m.law->carries_stress)
        in.fail("branch_shear",
                fmt::format("{} carries its stress, to which branches cannot be added; use neo-hookean", m.law->name));
    if (in.branch_shear.size() != in.branch_time.size())
        in.fail("branch_time", fmt::format("must have as many numbers as branch_shear, {} (got {})", in.branch_shear.size(),
                                           in.branch_time.size()));
    if (in.branch_shear.empty() || in.branch_shear.size() > Branches::most)
        in.fail("branch_shear", fmt::format("must have 1 to {} numbers (got {})", Branches::most, in.branch_shear.size()));
    m.branches.count = static_cast<int>(in.branch_shear.size());
    std::copy(in.branch_shear.begin(), in.branch_shear.end(), m.branches.shear.begin());
    std::copy(in.branch_time.begin(), in.branch_time.end(), m.branches.time.begin());
}

/// The parameters of a law from outside, and the stiffness that follows from its wave speed.
void resolve_own_parameters(const MaterialInput& in, Material& m)
{
    if (!m.law->outside) {
        if (in.has("parameters"))
            in.fail("parameters",
                    fmt::format("are for laws that are added from outside, as in Python; write those of {} as keys of "
                                "the table",
                                m.law->name));
        return;
    }
    if (in.own.all.contains("rho")) in.own.fail("rho", "is the density; give it as density");
    NamedNumbers numbers = in.own.all;
    numbers["rho"]       = in.density;
    const double c       = m.law->outside->wave_speed(numbers);
    if (!(c > 0) || !std::isfinite(c))
        in.fail("model", fmt::format("{} has a wave speed of {} m/s; it must be positive", m.law->name, c));
    m.mu    = in.density * c * c / 2;
    m.named = keep_numbers(std::move(numbers));
}

/// Fills the defaults of the input.
Material resolve_material(MaterialInput& in, int dim)
{
    if (in.name.empty()) in.fail("name", "must not be empty; bodies refer to their material by name");
    const LawRow& law = *find_law(in.model);
    if (dim > law.max_dim)
        in.fail("model", fmt::format("{} exists in {}D only (dim = {}); use jaumann-elastic", law.name, law.max_dim, dim));
    Material m{&law, in.density};
    resolve_elasticity(in, law, m);
    resolve_parameters(in, m);
    resolve_own_parameters(in, m);
    resolve_branches(in, m);
    return m;
}

/// Throws if a list of a table names what does not exist.
void require_known(const Located& in, const std::string& key, const std::vector<std::string>& names,
                   const std::vector<std::string>& known, const char* what)
{
    for (const std::string& name : names)
        if (std::find(known.begin(), known.end(), name) == known.end())
            in.fail(key, fmt::format("there is no {} called \"{}\". {}", what, name,
                                     known.empty() ? "The case has none" : suggestion(name, known)));
}

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items)
{
    std::vector<std::string> r;
    for (const T& item : items) r.push_back(item.name);
    return r;
}

/// Checks that the shape exists in `dim` dimensions and that the table has its keys, and of others only `allowed`.
void require_keys_of_shape(const ShapeInput& in, int dim, std::vector<std::string> allowed,
                           const std::vector<ShapeInfo>& known = shapes())
{
    const ShapeInfo& shape = *std::find_if(known.begin(), known.end(), [&](const ShapeInfo& s) { return s.name == in.shape; });
    if (dim < shape.min_dim || dim > shape.max_dim) {
        std::string there;
        for (const ShapeInfo& s : known)
            if (dim >= s.min_dim && dim <= s.max_dim) there += (there.empty() ? "" : ", ") + s.name;
        in.fail("shape", fmt::format("\"{}\" does not exist in {}D; there is {}", in.shape, dim, there));
    }
    for (const std::string& key : shape.required)
        if (!in.has(key))
            in.fail(key, fmt::format("is missing; the shape \"{}\" needs {}", in.shape, fmt::join(shape.required, ", ")));
    allowed.insert(allowed.end(), shape.required.begin(), shape.required.end());
    allowed.insert(allowed.end(), shape.optional.begin(), shape.optional.end());
    for (const auto& [key, place] : in.at)
        if (std::find(allowed.begin(), allowed.end(), key) == allowed.end())
            in.fail(key, fmt::format("has no meaning for the shape \"{}\"; remove it", in.shape));
}

/// Checks angles. setup checks lengths.
void validate_angles(const ShapeInput& in)
{
    if (in.has("angle") && in.angle.size() != 2) in.fail("angle", "must be two angles in degrees, [first, last]");
    if (in.has("angle") && !(in.angle[0] < in.angle[1] && in.angle[1] - in.angle[0] <= 360))
        in.fail("angle", fmt::format("must grow by at most 360 degrees (got {} to {})", in.angle[0], in.angle[1]));
}

void validate_polar_cells(const BodyInput& in)
{
    const bool polar = in.cells == "polar";
    for (const char* key : {"radial", "angular", "layers"})
        if (in.has(key) && !polar) in.fail(key, "needs cells = \"polar\"");
    for (const char* key : {"seeding", "volumes"})
        if (polar && in.has(key)) in.fail(key, "needs cells = \"cartesian\"");
}

/// Turns particles_per_cell into one number per axis, 2 by default.
void resolve_particles_per_cell(BodyInput& in, int dim)
{
    std::vector<int>& n = in.particles_per_cell;
    if (n.empty()) n.assign(static_cast<std::size_t>(dim), 2);
    if (n.size() == 1 && dim > 1) {
        const int per_axis = static_cast<int>(std::lround(std::pow(n[0], 1.0 / dim)));
        const int whole    = static_cast<int>(std::lround(std::pow(per_axis, dim)));
        if (whole != n[0])
            in.fail("particles_per_cell", fmt::format("counts the whole cell and must be a power {} of a whole number (got "
                                                      "{}, nearest {}); or give one number per axis",
                                                      dim, n[0], whole));
        n.assign(static_cast<std::size_t>(dim), per_axis);
    }
}

void validate_initial_stress(const BodyInput& in, int dim)
{
    if (in.k0 && in.has("initial_stress")) in.fail("initial_stress", "excludes k0; give one of them");
    for (const char* key : {"surface", "overburden"})
        if (in.has(key) && !in.k0) in.fail(key, "needs k0");
    const std::size_t with_shear = 3 + dim * (dim - 1) / 2;
    if (const std::size_t n = in.initial_stress.size(); in.has("initial_stress") && n != 3 && n != with_shear)
        in.fail("initial_stress", fmt::format("must be three numbers, xx, yy, zz{} (got {})",
                                              std::array{"", ", or four, with xy", ", or six, with xy, yz, zx"}[dim - 1], n));
}

/// Checks a body and fills its defaults; without a name it is named by its number.
void validate_body(BodyInput& in, int index, int dim, const CaseInput& c)
{
    if (in.name.empty()) in.name = fmt::format("body {}", index);
    require_known(in, "material", {in.material}, names_of(c.materials), "[[material]]");
    require_keys_of_shape(
        in, dim, {"name", "material", "shape", "velocity", "body_force", "k0", "surface", "overburden", "initial_stress"});
    validate_initial_stress(in, dim);
    validate_angles(in);
    validate_polar_cells(in);
    if (in.shape != "particles" && in.shape != "mesh") resolve_particles_per_cell(in, dim);
    auto zeros = [&](std::vector<Expression>& v) {
        if (v.empty()) v.assign(static_cast<std::size_t>(dim), Expression{});
    };
    zeros(in.velocity);
    zeros(in.body_force);
    for (const auto* list : {&in.velocity, &in.body_force})
        for (const Expression& e : *list) make_field(e);
}

/// The body that a table names.
template <class T>
const BodyInput& require_known_body(const T& in, const std::vector<BodyInput>& bodies)
{
    std::vector<std::string> names;
    for (const BodyInput& b : bodies) {
        if (b.name == in.body) return b;
        names.push_back(b.name);
    }
    in.fail("body", fmt::format("there is no body called \"{}\". {}", in.body, suggestion(in.body, names)));
}

/// Letters, digits and _: part of the name of a column or, with -, of a file.
bool is_plain_name(const std::string& name, std::string_view others)
{
    constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
    return !name.empty() && name.find_first_not_of(std::string(letters) + std::string(others)) == std::string::npos;
}

/// The default name of the k-th of its kind, and a check of a given one.
template <class T>
void settle_name(T& in, const char* kind, std::size_t k)
{
    if (!in.has("name")) in.name = fmt::format("{}_{}", kind, k);
    if (!is_plain_name(in.name, "")) in.fail("name", "must consist of letters, digits and _, because it is part of columns");
    for (const char* taken : {"boundary", "traction", "body_force"})  // their sums are columns too
        if (in.name == taken)
            in.fail("name", fmt::format("\"{0}\" is taken: history.csv has a column {0}_work; choose another", taken));
}

/// Exactly one key says where a boundary acts.
void validate_place(const BoundaryInput& in)
{
    const std::pair<const char*, bool> given[] = {{"face", !in.face.empty()},
                                                  {"normal", !in.normal.empty()},
                                                  {"region", in.region.has_value()},
                                                  {"body", !in.body.empty()}};
    const char* first                          = nullptr;
    for (const auto& [key, is] : given) {
        if (is && first) in.fail(key, fmt::format("cannot be with {}; a boundary has one place", first));
        if (is) first = key;
    }
    if (!first)
        in.fail("face", in.type == "wall" ? "is missing; a wall needs a face, or a normal and a point"
                                          : "is missing; a boundary needs a face, a region or a body");
    if (in.at_coordinate && in.face.empty()) in.fail("at", fmt::format("cannot be with {}; it moves a face", first));
}

bool moves_nodes(const BoundaryInput& in) { return in.type == "velocity" || in.type == "displacement"; }

void validate_boundary(BoundaryInput& in, std::size_t k, const CaseInput& c)
{
    const int dim = c.grid.dim;
    settle_name(in, "boundary", k);
    for (const std::string& face : in.face) {
        const int axis = face[0] - 'x';
        if (axis >= dim) in.fail("face", fmt::format("\"{}\" does not exist in {}D", face, dim));
    }
    const bool is_wall = in.type == "wall", has_motion = moves_nodes(in);
    if (!in.normal.empty() != !in.point.empty())
        in.fail(in.normal.empty() ? "point" : "normal",
                "needs the other of normal and point; together they give the plane of a wall");
    if (!in.normal.empty() && !is_wall)
        in.fail("normal", fmt::format("is for type \"wall\" only, not \"{}\"; use face", in.type));
    validate_place(in);
    if (in.friction && !is_wall) in.fail("friction", fmt::format("has no meaning for the type \"{}\"; remove it", in.type));
    if (in.region) {
        require_keys_of_shape(*in.region, dim, {"shape"});
        validate_angles(*in.region);
    }
    if (!in.body.empty()) require_known_body(in, c.bodies);
    if (has_motion && in.value.empty()) in.fail("value", fmt::format("is missing; type \"{}\" needs it per axis", in.type));
    if (!has_motion && !is_wall && !in.value.empty())
        in.fail("value", fmt::format("has no meaning for the type \"{}\"; remove it", in.type));
    bool holds_any = in.value.empty();
    for (const Expression& e : in.value) {
        const bool is_free = e.value == decltype(e.value){"free"};
        if (is_free && is_wall) fail(e.place, e.key, "\"free\" has no meaning for a wall; give its velocity, 0 if it rests");
        if (is_free) continue;
        holds_any         = true;
        const Field value = make_field(e);
        if ((is_wall || in.type == "displacement") && !depends_on_time_alone(e))
            fail(e.place, e.key,
                 is_wall ? "must be a function of t alone: a wall is rigid"
                         : "must be a function of t alone: all nodes move alike; for motions that depend on the place use type "
                           "\"velocity\", such as [\"-w*y\", \"w*x\"] for a rotation");
        if (const double start = value({{}, {}, 0.0}); in.type == "displacement" && std::fabs(start) > 1e-12)
            fail(e.place, e.key, fmt::format("is {} at t = 0, and must be 0 there: it counts from the start", start));
    }
    if (!holds_any) in.fail("value", "leaves all axes free, so it holds nothing; remove the boundary");
}

void validate_traction(TractionInput& in, std::size_t k, int dim, const std::vector<BodyInput>& bodies)
{
    settle_name(in, "traction", k);
    const BodyInput* body = &require_known_body(in, bodies);
    if (in.face.empty()) in.fail("face", "must name at least one face");
    if (body->shape == "particles")
        in.fail("body", fmt::format("the particles of body \"{}\" come from a file and share no corners, so its outer faces are "
                                    "not known; use shape = \"mesh\" or a built-in shape",
                                    in.body));
    for (const std::string& face : in.face) {
        if (face[1] == '-' && face[0] - 'x' >= dim) in.fail("face", fmt::format("\"{}\" does not exist in {}D", face, dim));
        if ((face == "inner" || face == "outer") && body->center.empty())
            in.fail(
                "face",
                fmt::format(
                    "\"{}\" needs a body with a center; body \"{}\" has none: use x-min, .. or all, or give the center of a mesh",
                    face, in.body));
    }
    const std::size_t wanted = in.type == "pressure" ? 1 : static_cast<std::size_t>(dim);
    if (in.value.size() != wanted)
        in.fail("value", fmt::format("type \"{}\" takes {} value{} (got {})", in.type, wanted,
                                     wanted > 1 ? "s, one per axis" : "", in.value.size()));
    for (const Expression& e : in.value) make_field(e);
}

template <class T>
void require_unique_names(const std::vector<T>& items, const char* what)
{
    std::set<std::string> seen;
    for (const T& item : items)
        if (!seen.insert(item.name).second)
            item.fail("name", fmt::format("there is another {} called \"{}\"; names must differ", what, item.name));
}

/// The path of a file, which the input gives relative to that of the case.
std::string resolve_path(const std::string& name, const std::filesystem::path& case_file)
{
    const std::filesystem::path given(name);
    return (given.is_absolute() ? given : std::filesystem::absolute(case_file).parent_path() / given).lexically_normal().string();
}

void validate_contact(ContactInput& in, std::size_t k, const CaseInput& c)
{
    settle_name(in, "contact", k);
    if (is_of_all(in.bodies)) return;
    require_known(in, "bodies", in.bodies, names_of(c.bodies), "[[body]]");
}

void validate_obstacle(ObstacleInput& in, std::size_t k, const CaseInput& c, const std::filesystem::path& file)
{
    const int dim = c.grid.dim;
    settle_name(in, "obstacle", k);
    require_keys_of_shape(
        in, dim,
        {"name", "shape", "velocity", "rotation", "mass", "held", "bodies", "type", "friction", "adhesion", "sweeps", "points"},
        obstacle_shapes());
    if (in.bodies.empty()) in.fail("bodies", "must name at least one; for all bodies remove it");
    if (!is_of_all(in.bodies)) require_known(in, "bodies", in.bodies, names_of(c.bodies), "[[body]]");
    if (in.has("normal") && std::all_of(in.normal.begin(), in.normal.end(), [](double x) { return x == 0; }))
        in.fail("normal", "must not be zero; it points out of the half-space, towards the bodies");
    const std::size_t turns = dim == 3 ? 3 : 1;
    if (in.has("rotation") && in.rotation.size() != turns)
        in.fail("rotation",
                dim == 3 ? fmt::format("must be three numbers, the angular velocities about x, y, z (got {})", in.rotation.size())
                         : fmt::format("must be one number, counterclockwise (got {})", in.rotation.size()));
    for (const auto* list : {&in.velocity, &in.rotation})
        for (const Expression& e : *list) {
            make_field(e);
            if (!depends_on_time_alone(e)) fail(e.place, e.key, "must be a function of t alone: an obstacle is rigid");
        }
    for (const std::string& one : in.held)
        if (one.size() == 1 && one[0] - 'x' >= dim) in.fail("held", fmt::format("\"{}\" does not exist in {}D", one, dim));
    if (!in.file.empty()) in.file = resolve_path(in.file, file);
}

/// Names of boundaries and tractions begin the names of columns of one file.
void require_unique_columns(const CaseInput& c)
{
    std::set<std::string> seen;
    for (const Exchanging& one : exchanging(c))
        if (!seen.insert(one.name).second)
            one.table->fail("name", fmt::format("\"{}\" names two boundaries or tractions; names must differ", one.name));
    for (const ContactInput& contact : c.contacts)
        if (!seen.insert(contact.name).second)
            contact.fail("name",
                         fmt::format("\"{}\" names two contacts, boundaries or tractions; names must differ", contact.name));
    for (const ObstacleInput& obstacle : c.obstacles)
        if (!seen.insert(obstacle.name).second)
            obstacle.fail("name",
                          fmt::format("\"{}\" names an obstacle and another, a contact, boundary or traction; names must differ",
                                      obstacle.name));
}

void validate_grid(const GridInput& grid)
{
    try {
        setup::require_grid(grid.size.data(), grid.spacing.data(), grid.dim);
    } catch (const setup::SetupError& e) {
        grid.fail(e.key, e.why);
    }
}

void validate_materials_and_bodies(CaseInput& c, const std::filesystem::path& file)
{
    const int dim = c.grid.dim;
    const Place top{file.string(), 0, 0};
    if (c.materials.empty()) fail(top, "material", "is missing; the case needs at least one [[material]]");
    if (c.bodies.empty()) fail(top, "body", "is missing; the case needs at least one [[body]]");
    require_unique_names(c.materials, "material");
    for (MaterialInput& m : c.materials) c.resolved_materials.push_back(resolve_material(m, dim));
    for (std::size_t k = 0; k < c.bodies.size(); ++k) {
        BodyInput& b = c.bodies[k];
        validate_body(b, static_cast<int>(k), dim, c);
        if (!b.file.empty()) b.file = resolve_path(b.file, file);
    }
    require_unique_names(c.bodies, "body");
}

/// Fills the defaults of the output, and checks its fields.
void validate_output(CaseInput& c, const std::filesystem::path& file)
{
    if (!c.output.interval) c.output.interval = std::max(c.time.end / 50, std::numeric_limits<double>::min());
    const std::filesystem::path absolute = std::filesystem::absolute(file).lexically_normal();
    c.name                               = absolute.stem().string();
    if (c.name == "case") c.name = absolute.parent_path().filename().string();
    if (c.output.directory.empty()) c.output.directory = "results/" + c.name;
    for (const std::string& f : c.output.fields)
        if (std::count(c.output.fields.begin(), c.output.fields.end(), f) > 1)
            c.output.fail("fields", "names \"" + f + "\" twice");
    require_carried(c);
}

void validate_probe(const ProbeInput& p, const CaseInput& c)
{
    if (p.particle.empty() == p.point.empty()) p.fail("point", "give either particle or point");
    if (!p.point.empty() && c.spec.enrichment == Enrichment::all)
        p.fail("point", "watches the grid, which finite elements do not use; follow a particle");
    if (!is_plain_name(p.name, "-"))
        p.fail("name", "must consist of letters, digits, - and _, because it is part of a file name");
    const std::string key         = p.point.empty() ? "particle" : "point";
    const std::vector<double>& at = p.point.empty() ? p.particle : p.point;
    for (int a = 0; a < c.grid.dim; ++a)
        if (!(at[a] >= c.grid.origin[a] && at[a] <= c.grid.origin[a] + c.grid.size[a])) p.fail(key, "lies outside the grid");
}

/// The damping of a table, whose type is at `key`.
Damping resolve_damping(const Located& in, const std::string& key, const std::string& type, const std::optional<double>& factor,
                        const std::optional<double>& rate)
{
    const auto number = std::find(kDampingNames.begin(), kDampingNames.end(), type) - kDampingNames.begin();
    Damping r{.type = static_cast<DampingType>(number)};
    auto settle = [&](const char* name, DampingType owner, const std::optional<double>& given, double& value) {
        if (given && r.type != owner)
            in.fail(name, fmt::format("is of damping \"{}\", not \"{}\"; remove it",
                                      kDampingNames[static_cast<std::size_t>(owner)], type));
        if (!given && r.type == owner) in.fail(key, fmt::format("\"{}\" needs {}", type, name));
        if (given) value = *given;
    };
    settle("factor", DampingType::local, factor, r.factor);
    settle("rate", DampingType::viscous, rate, r.rate);
    return r;
}

/// Checks a stage and fills its damping.
void validate_stage(StageInput& in, CaseInput& c)
{
    if (in.name.empty()) in.fail("name", "must not be empty; boundaries refer to stages by name");
    const std::string key = in.has("damping") ? "damping" : "name";
    if (in.damping.empty()) in.damping = c.damping.type;
    if (in.damping == c.damping.type) {
        if (!in.factor) in.factor = c.damping.factor;
        if (!in.rate) in.rate = c.damping.rate;
    }
    c.damping_of_stages.push_back(resolve_damping(in, key, in.damping, in.factor, in.rate));
    require_known(in, "remove", in.remove, names_of(c.bodies), "[[body]]");
    for (const auto& [body, material] : in.materials.all) {
        require_known(in.materials, body, {body}, names_of(c.bodies), "[[body]]");
        require_known(in.materials, body, {material}, names_of(c.materials), "[[material]]");
    }
}

/// Checks the stages and the end of the run, which they determine.
void validate_stages(CaseInput& c)
{
    require_unique_names(c.stages, "stage");
    double end = 0.0;
    for (StageInput& s : c.stages) {
        validate_stage(s, c);
        end += s.duration;
    }
    auto require_stages = [&](const auto& in) {
        if (in.has("stages") && in.stages.empty()) in.fail("stages", "must name at least one; to act in all, remove it");
        require_known(in, "stages", in.stages, names_of(c.stages), "[[stage]]");
    };
    std::for_each(c.boundaries.begin(), c.boundaries.end(), require_stages);
    std::for_each(c.tractions.begin(), c.tractions.end(), require_stages);
    if (c.stages.empty()) {
        if (c.time.place.line == 0) fail(c.time.place, "time", "is missing; the case needs a table [time] with the key end");
        if (!c.time.has("end")) c.time.fail("end", "is missing (time at which the run ends, s)");
        return;
    }
    if (c.time.has("end") && std::fabs(c.time.end - end) > 1e-9 * end)
        c.time.fail("end",
                    fmt::format("must be the sum of the durations of the stages, {} (got {}); or remove it", end, c.time.end));
    c.time.end = end;
}

WatchSpec resolve_watch(const WatchInput& in)
{
    WatchSpec spec;
    for (int k = 0; k < WatchSpec::count; ++k)
        spec.is_fatal[k] = std::count(in.fatal.begin(), in.fatal.end(), WatchSpec::names[k]) > 0;
    spec.energy_growth = in.energy_growth;
    return spec;
}

/// Checks the whole case and fills defaults.
void validate(CaseInput& c, const std::filesystem::path& file)
{
    const auto dim = static_cast<std::size_t>(c.grid.dim);
    if (c.grid.origin.empty()) c.grid.origin.assign(dim, 0.0);
    if (c.gravity.empty()) c.gravity.assign(dim, 0.0);
    validate_grid(c.grid);
    c.spec = resolve_method(c.method, std::any_of(c.boundaries.begin(), c.boundaries.end(), moves_nodes));
    if (c.time.dt && c.time.cfl) c.time.fail("cfl", "excludes dt; give one of them");
    if (!c.time.dt && !c.time.cfl) c.time.cfl = 0.4;
    c.resolved_damping = resolve_damping(c.damping, "type", c.damping.type, c.damping.factor, c.damping.rate);
    validate_materials_and_bodies(c, file);
    for (std::size_t k = 0; k < c.boundaries.size(); ++k) validate_boundary(c.boundaries[k], k, c);
    for (std::size_t k = 0; k < c.tractions.size(); ++k) validate_traction(c.tractions[k], k, c.grid.dim, c.bodies);
    for (std::size_t k = 0; k < c.contacts.size(); ++k) validate_contact(c.contacts[k], k, c);
    for (std::size_t k = 0; k < c.obstacles.size(); ++k) validate_obstacle(c.obstacles[k], k, c, file);
    require_unique_columns(c);
    validate_stages(c);
    validate_output(c, file);
    for (const ProbeInput& p : c.probes) validate_probe(p, c);
    require_unique_names(c.probes, "probe");
    c.watch_spec = resolve_watch(c.watch);
    for (const char* key : {"steps", "wall_minutes"})
        if (c.checkpoint.has(key) && !has_hdf5()) c.checkpoint.fail(key, kNoHdf5);
    if (c.output.grid && c.spec.enrichment == Enrichment::all)
        c.output.fail("grid", "finite elements do not use the grid; write particles only");
}

}  // namespace

bool is_of_all(const std::vector<std::string>& bodies) { return bodies == std::vector<std::string>{"all"}; }

// clang-format off
const std::vector<ShapeInfo>& shapes()
{
    static const std::vector<ShapeInfo> rows = {
        {"ball", "a ball; a disk in 2D, an interval in 1D", {"center", "radius"},
         {"cells", "radial", "angular", "particles_per_cell", "seeding", "volumes"}, 1, 3},
        {"box", "a box, in equal sub-cells that fit it exactly, close in size to those of the grid", {"lower", "upper"},
         {"particles_per_cell", "seeding"}, 1, 3},
        {"ring", "an annulus or a part of it", {"center", "inner_radius", "radius"},
         {"angle", "cells", "radial", "angular", "particles_per_cell", "seeding", "volumes"}, 2, 2},
        {"cylinder", "a cylinder or tube along an axis, or a part of it", {"center", "radius", "height"},
         {"inner_radius", "axis", "angle", "cells", "radial", "angular", "layers", "particles_per_cell", "seeding", "volumes"}, 3, 3},
        {"particles", "material points from a CSV file", {"file"}, {}, 1, 3},
        {"mesh", "the elements of a Gmsh mesh, one particle each; faces inner and outer need its center, in 3D also its axis",
         {"file"}, {"group", "center", "axis"}, 1, 3},
    };
    return rows;
}

const std::vector<ShapeInfo>& obstacle_shapes()
{
    static const std::vector<ShapeInfo> rows = {
        {"half-space", "all beyond a plane, without end", {"point", "normal"}, {"center"}, 2, 3},
        {"box", "a box", {"lower", "upper"}, {"center"}, 2, 3},
        {"ball", "a ball; a disk in 2D", {"center", "radius"}, {}, 2, 3},
        {"cylinder", "a cylinder along an axis", {"center", "radius", "height"}, {"axis"}, 3, 3},
        {"stl", "the surface of triangles in an STL file, closed or open", {"file"}, {"scale", "center"}, 3, 3},
    };
    return rows;
}
// clang-format on

std::vector<Exchanging> exchanging(const CaseInput& c)
{
    std::vector<Exchanging> r;
    int boundary = 0;
    for (const BoundaryInput& b : c.boundaries)
        for (std::size_t k = 0; k < b.count(); ++k, ++boundary) {
            if (b.type == "periodic" || b.type == "free") continue;
            std::string name = b.name;
            if (b.count() > 1) name += fmt::format("_{}_{}", b.face[k].substr(0, 1), b.face[k].substr(2));
            r.push_back({name, &b, boundary, false});
        }
    for (std::size_t k = 0; k < c.tractions.size(); ++k)
        r.push_back({c.tractions[k].name, &c.tractions[k], static_cast<int>(k), true});
    return r;
}

/// Reads a case from its tables; `file` is where it comes from.
CaseInput read_tables(toml::table root, const std::filesystem::path& file, const std::vector<std::string>& overrides)
{
    for (const std::string& o : overrides) apply_override(root, o);

    CaseInput c;
    const Place top{file.string(), 0, 0};
    const int dim = read_dim(root);
    read_table(case_section(), root, "", dim, c,
               {"grid", "method", "time", "damping", "material", "body", "boundary", "traction", "contact", "obstacle", "stage",
                "output", "checkpoint", "watch", "probe"});
    c.place = top;
    read_single(root, grid_section(), dim, c.grid, top);
    c.grid.dim = dim;
    read_single(root, method_section(), dim, c.method, top);
    read_single(root, time_section(), dim, c.time, top);
    read_single(root, damping_section(), dim, c.damping, top);
    read_repeated(root, material_section(), dim, c.materials, {"parameters"});
    read_repeated(root, body_section(), dim, c.bodies);
    read_repeated(root, boundary_section(), dim, c.boundaries, {"region"});
    read_repeated(root, traction_section(), dim, c.tractions);
    read_repeated(root, contact_section(), dim, c.contacts);
    read_repeated(root, obstacle_section(), dim, c.obstacles);
    read_repeated(root, stage_section(), dim, c.stages, {"materials"});
    read_single(root, output_section(), dim, c.output, top);
    read_single(root, checkpoint_section(), dim, c.checkpoint, top);
    read_single(root, watch_section(), dim, c.watch, top);
    read_repeated(root, probe_section(), dim, c.probes);
    validate(c, file);
    return c;
}

CaseInput read_case(const std::filesystem::path& file, const std::vector<std::string>& overrides)
{
    return read_tables(parse_file(file), file, overrides);
}

CaseInput read_case_text(const std::string& text, const std::filesystem::path& file, const std::vector<std::string>& overrides)
{
    return read_tables(parse_text(text, file), file, overrides);
}

/// The region of a boundary as a table in a line.
std::string echo_region(const BoundaryInput& b)
{
    if (!b.region) return "";
    Section<ShapeInput> keys = region_section();
    keys.name.clear();
    std::string text = echo(keys, *b.region), line;
    for (const char c : text.substr(0, text.size() - 1)) line += c == '\n' ? std::string(", ") : std::string(1, c);
    return "region = {" + line + "}\n";
}

/// Such a table in a line.
template <class T>
std::string echo_entries(const std::string& key, const std::map<std::string, T>& entries)
{
    std::string line;
    for (const auto& [name, value] : entries)
        line += fmt::format("{}{} = {}", line.empty() ? "" : ", ", to_toml(name), to_toml(value));
    return line.empty() ? "" : key + " = {" + line + "}\n";
}

std::pair<MaterialInput, Material> read_material(const std::string& model, const std::vector<std::string>& overrides, int dim)
{
    toml::table table;
    for (const std::string& o : overrides) apply_override(table, o);
    for (const char* key : {"name", "model"})
        if (table.contains(key)) throw InputError(fmt::format("--set {}: is not a parameter of the law; remove it", key));
    table.insert("name", "driven");
    table.insert("model", model);
    if (!table.contains("density")) table.insert("density", 1000.0);
    MaterialInput in;
    read_table(material_section(), table, "", dim, in);
    in.place         = {"--set", 0, 0};
    const Material m = resolve_material(in, dim);
    return {std::move(in), m};
}

std::string echo_material(const MaterialInput& input) { return echo(material_section(), input); }

std::string echo_case(const CaseInput& c)
{
    std::string text = echo(case_section(), c) + echo(grid_section(), c.grid) + echo(method_section(), c.method) +
                       echo(time_section(), c.time) + echo(damping_section(), c.damping);
    for (const auto& m : c.materials) text += echo(material_section(), m) + echo_entries("parameters", m.own.all);
    for (const auto& b : c.bodies) text += echo(body_section(), b);
    for (const auto& b : c.boundaries) text += echo(boundary_section(), b) + echo_region(b);
    for (const auto& t : c.tractions) text += echo(traction_section(), t);
    for (const auto& one : c.contacts) text += echo(contact_section(), one);
    for (const auto& one : c.obstacles) text += echo(obstacle_section(), one);
    for (const auto& s : c.stages) text += echo(stage_section(), s) + echo_entries("materials", s.materials.all);
    text += echo(output_section(), c.output) + echo(checkpoint_section(), c.checkpoint) + echo(watch_section(), c.watch);
    for (const auto& p : c.probes) text += echo(probe_section(), p);
    return text;
}

std::vector<SectionText> input_schema()
{
    SectionText material = described(material_section());
    material.keys.push_back(
        {{.name = "parameters", .what = "numbers by name, of a law that was added from outside ([python.md](python.md))"},
         "table of numbers",
         ""});
    return {described(case_section()),     described(grid_section()),     described(method_section()),
            described(time_section()),     described(damping_section()),  std::move(material),
            described(body_section()),     described(boundary_section()), described(region_section()),
            described(traction_section()), described(contact_section()),  described(obstacle_section()),
            described(stage_section()),    described(output_section()),   described(checkpoint_section()),
            described(watch_section()),    described(probe_section())};
}

std::string reference_page()
{
    std::string text =
        "# Input reference\n\nWritten by `ordo list input` from the schema in `src/io/input.cpp`. SI units. A number or an "
        "expression of x, y, z, t\n"
        "(muParser) is allowed where the type says so; of values one per axis a single one counts for all axes, except of "
        "gravity; unknown keys are errors.\n\n";
    for (const SectionText& section : input_schema()) text += reference(section);
    return text;
}

}  // namespace ordo::io
