// The input of a run: plain structs, filled from TOML by the schema, resolved with every default.
#pragma once

#include "io/schema.hpp"
#include "material/material.hpp"
#include "method/tables.hpp"
#include "method/watch.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

struct GridInput : Located {
    int dim = 2;
    std::vector<double> origin, size, spacing;
};

struct MethodInput : Located {
    std::string preset = "cpls-limited";
    Words axes;       ///< choices by axis keys
    Numbers numbers;  ///< by the names of settings()
};

struct TimeInput : Located {
    double end = 0.0;
    std::optional<double> dt, cfl;
};

/// A table of numbers by names.
struct NumbersInput : Located {
    Numbers all;
};

struct MaterialInput : Located {
    std::string name;
    std::string model = "neo-hookean";
    double density    = 0.0;
    std::optional<double> young, poisson, lambda, mu, bulk, shear;
    Numbers parameters;  ///< of the model, by key
    Words words;
    Flags flags;
    Lists lists;
    std::vector<double> branch_shear, branch_time;
    NumbersInput own;  ///< parameters of a law from outside
};

struct ShapeInput : Located {
    std::string shape;
    std::vector<double> center, lower, upper;
    std::optional<double> radius, inner_radius, height;
    std::string axis;
    std::vector<double> angle;
};

struct BodyInput : ShapeInput {
    std::string name, material, file, group;
    std::string cells;
    std::optional<int> radial, angular, layers;
    std::vector<int> particles_per_cell;
    std::string seeding, volumes;
    std::vector<Expression> velocity, body_force;
    std::optional<double> k0, surface, overburden;
    std::vector<double> initial_stress;
};

struct TractionInput : Located {
    std::string name;  ///< of its columns
    std::string body;
    std::vector<std::string> face;
    std::string type = "pressure";
    std::vector<Expression> value;
    std::vector<std::string> stages;
};

struct BoundaryInput : Located {
    std::string name;  ///< of its columns
    std::vector<std::string> face;
    std::optional<ShapeInput> region;
    std::string body;
    std::string type;
    std::optional<double> at_coordinate;
    std::vector<double> normal, point;
    std::optional<double> friction;
    std::vector<Expression> value;
    std::vector<std::string> stages;

    /// Each face is a condition of its own.
    std::size_t count() const { return std::max<std::size_t>(face.size(), 1); }
};

/// How surfaces act on each other.
struct ContactLawInput {
    std::string type = "frictional";
    std::optional<double> friction, adhesion;
    int sweeps         = 1;
    std::string points = "vertices";
};

struct ContactInput : Located, ContactLawInput {
    std::string name;  ///< of its columns
    std::vector<std::string> bodies;
};

/// Whether a list of bodies says all of them.
bool is_of_all(const std::vector<std::string>& bodies);

/// A rigid solid that bodies meet.
struct ObstacleInput : ShapeInput, ContactLawInput {
    std::string name;  ///< of its columns
    std::vector<double> point, normal;
    std::string file;
    std::optional<double> scale;  ///< of the file; 1 by default
    std::vector<Expression> velocity, rotation;
    std::optional<double> mass;
    std::vector<std::string> held;
    std::vector<std::string> bodies = {"all"};
};

struct OutputInput : Located {
    std::string directory;
    std::optional<double> interval;
    std::vector<std::string> fields = {"displacement", "velocity", "stress", "density"};
    std::string particles = "domains", precision = "float64", compression = "none";
    int every = 1;
    bool grid = false, per_body = false;
    int history_interval = 1;
};

struct CheckpointInput : Located {
    std::optional<int> steps;
    std::optional<double> wall_minutes;
    int keep = 2;
};

struct WatchInput : Located {
    std::vector<std::string> fatal = {"energy"};
    double energy_growth           = 1.0;
};

/// The keys of how velocities are damped.
struct DampingInput : Located {
    std::string type = "none";
    std::optional<double> factor, rate;
};

/// A table of names by names.
struct NamesInput : Located {
    Words all;
};

struct StageInput : Located {
    std::string name;
    double duration = 0.0;
    std::optional<double> residual;
    std::string damping;
    std::optional<double> factor, rate;
    NamesInput materials;  ///< by body
    std::vector<std::string> remove;
};

struct ProbeInput : Located {
    std::string name;
    std::vector<double> particle, point;
};

struct CaseInput : Located {
    std::string title;
    std::vector<double> gravity;
    GridInput grid;
    MethodInput method;
    TimeInput time;
    DampingInput damping;
    std::vector<MaterialInput> materials;
    std::vector<BodyInput> bodies;
    std::vector<BoundaryInput> boundaries;
    std::vector<TractionInput> tractions;
    std::vector<ContactInput> contacts;
    std::vector<ObstacleInput> obstacles;
    OutputInput output;
    CheckpointInput checkpoint;
    WatchInput watch;
    std::vector<ProbeInput> probes;
    std::vector<StageInput> stages;

    MethodSpec spec;                           ///< resolved from method
    std::string name;                          ///< of the file, or of its directory if it is case.toml
    WatchSpec watch_spec;                      ///< resolved from watch
    Damping resolved_damping;                  ///< resolved from damping
    std::vector<Damping> damping_of_stages;    ///< resolved from stages
    std::vector<Material> resolved_materials;  ///< resolved from materials
};

/// A boundary with a force, or a traction.
struct Exchanging {
    std::string name;  ///< begins its columns
    const Located* table;
    int number;  ///< of the boundary, each face of a table counted, or of the traction
    bool is_traction;
};
/// All of them, in the order of the input: boundaries, then tractions.
std::vector<Exchanging> exchanging(const CaseInput& input);

/// A shape of the input: what it is, which keys describe it, in which dimensions it exists.
struct ShapeInfo {
    std::string name, what;
    std::vector<std::string> required, optional;
    int min_dim, max_dim;
};
const std::vector<ShapeInfo>& shapes();
/// Those of obstacles.
const std::vector<ShapeInfo>& obstacle_shapes();

/// Reads and resolves one material from `key=value` of --set, keys of [[material]], for a problem of `dim` dimensions. Density is
/// 1000 kg/m^3 by default. Throws InputError.
std::pair<MaterialInput, Material> read_material(const std::string& model, const std::vector<std::string>& overrides, int dim);

/// The material as TOML with every default.
std::string echo_material(const MaterialInput& input);

/// Reads a case, applies overrides (`key=value`) and validates it. Throws InputError.
CaseInput read_case(const std::filesystem::path& file, const std::vector<std::string>& overrides);

/// The same from text; errors name `file`, to whose folder the names of other files are relative.
CaseInput read_case_text(const std::string& text, const std::filesystem::path& file, const std::vector<std::string>& overrides);

/// The resolved case as TOML with every default; reading it again gives the same case.
std::string echo_case(const CaseInput& input);

/// All sections of the input.
std::vector<SectionText> input_schema();

/// The same as a reference page, Markdown.
std::string reference_page();

}  // namespace ordo::io
