// The subject of `ordo verify`: cases with parameters, studies of a method over meshes, and the bars they must meet.
#pragma once

#include "method/tables.hpp"

#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace ordo::verification {

/// Numbers by name, in the order in which they are reported.
using Named = std::vector<std::pair<std::string, double>>;

/// The entry called `name`; NaN if there is none.
double find(const Named& named, std::string_view name);

/// Columns of numbers, row by row.
struct Table {
    std::vector<std::string> columns;
    std::vector<double> values;
};

/// One run of a study. Quantities that a case or a failed run does not have are left out.
struct Row {
    int cells                 = 0;  ///< per unit length
    double h                  = 0;  ///< m
    int particles             = 0;
    long steps                = 0;
    double dt                 = 0;  ///< s
    double seconds            = 0;  ///< wall time of steps
    double seconds_body_force = 0;  ///< of these in the body force by automatic differentiation
    double seconds_cpu        = 0;  ///< CPU time of all threads in steps
    Named error;                    ///< RMS over particles: displacement (m), velocity (m/s), stress (Pa), density
    Named error_l2;                 ///< square root of sum V |e|^2, V = J V0; velocity_grid over nodes, V their share of the grid
    Named error_relative;           ///< L2 error over the norm of the reference solution, if a case has no exact one
    Named quantities;               ///< energies, momenta and other observed numbers
    std::vector<std::pair<std::string, std::vector<double>>> curves;  ///< functions of wave number, if a case has them
    std::string failed;                                               ///< why the run ended early; empty if it did not
    Table history;                                                    ///< sums over time, see record.hpp; empty if not recorded
    Table final_particles;                                            ///< particles at the end, the same
    std::vector<std::pair<std::string, std::string>> files;           ///< where these were written
};

using Value = std::variant<double, std::string>;

/// A parameter of a case: a number, or a choice of words.
struct Parameter {
    std::string name;
    Value value;  ///< the default
    std::string what;
    double above                     = -std::numeric_limits<double>::infinity();  ///< numbers must be larger
    double below                     = std::numeric_limits<double>::infinity();   ///< and smaller
    std::vector<std::string> choices = {};
};

/// Values of parameters by name.
struct Values {
    std::vector<std::pair<std::string, Value>> entries;

    double number(std::string_view name) const { return std::get<double>(at(name)); }
    const std::string& word(std::string_view name) const { return std::get<std::string>(at(name)); }
    const Value& at(std::string_view name) const;
    void set(std::string_view name, const Value& value);
};

/// The input of one run.
struct Request {
    MethodSpec method;
    int per_axis = 2;  ///< particles per cell along each axis
    int cells    = 0;  ///< per unit length
    Values values;
    bool is_recorded = false;  ///< whether the row gets its tables
};

/// A limit on one number of a study.
struct Bar {
    /// displacement, velocity, stress or density (of `error`), "l2 NAME", "relative NAME", a quantity of the case, or
    /// "failed", which is 1 for a run that ended early and else 0.
    std::string name;
    int from    = 0;
    int to      = 0;  ///< the order between the meshes `from` and `to`; 0: the value itself on the mesh `from`
    double low  = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();

    std::string what() const;
    std::string limit() const;
};

/// A bar with the measured number: nothing if its meshes were not run, failed if a run gave no number.
struct Verdict {
    Bar bar;
    bool was_run = false;
    double value = std::numeric_limits<double>::quiet_NaN();

    bool pass() const { return value >= bar.low && value <= bar.high; }
};

/// The orders of `name` between successive meshes of a list, all at least `low`; or all at most `high`.
std::vector<Bar> orders_at_least(std::string_view name, const std::vector<int>& meshes, double low);
std::vector<Bar> orders_at_most(std::string_view name, const std::vector<int>& meshes, double high);
std::vector<Bar> orders_between(std::string_view name, const std::vector<int>& meshes, double low, double high);
/// The same of displacement, velocity and stress.
std::vector<Bar> all_orders_at_least(const std::vector<int>& meshes, double low);
/// The value of `name` on one mesh.
Bar value_at_most(std::string_view name, int cells, double high);
Bar value_between(std::string_view name, int cells, double low, double high);
/// The run on this mesh ends early.
Bar fails_at(int cells);
std::vector<Bar> operator+(std::vector<Bar> a, const std::vector<Bar>& b);

/// A method on a case over meshes, and its bars. `set` changes parameters of the case and axes, as --set does.
struct Study {
    std::string method;  ///< preset
    int ppc = 0;         ///< particles per cell; 0 is the default of the case
    std::vector<std::pair<std::string, Value>> set;
    std::vector<int> cells;
    std::vector<Bar> bars;
    enum Length { quick, night } length = quick;  ///< quick ones run in CI
};

/// Volume averages lose no order: cpdi1 and cpdi2 with `averaging` cell and node.
std::vector<Study> averaged(const std::vector<int>& meshes);

/// Implicit steps lose no order: bscpdi2 with `midpoint`, displacement and stress. `cfl` 0.4 is the step of explicit schemes.
Study by_midpoint(double cfl, const std::vector<int>& meshes, Study::Length length);

std::vector<Study> operator+(std::vector<Study> a, const std::vector<Study>& b);

/// A problem with a known answer.
struct Case {
    std::string name;
    std::string what;
    int dim;
    int per_axis;  ///< particles per cell and axis by default
    std::vector<int> cells;
    std::vector<Parameter> parameters;
    Row (*run)(const Request&);
    std::vector<Study> studies;

    /// The dimension for these values: the parameter `dim` if the case has one.
    int dim_of(const Values& values) const;
};

/// All cases, in the order of the contract.
const std::vector<Case>& cases();

/// A resolved study: parameters are complete, and axes set by name are in `method`.
struct Resolved {
    const Case* of;
    std::string preset;
    Request request;  ///< without cells
    int ppc = 0;
    std::vector<int> cells;
    std::vector<Bar> bars;

    Verdict judge(const Bar& bar, const std::vector<Row>& rows) const;
};

/// Fills in defaults. Throws InputError for an unknown preset, parameter, axis or choice, or a value out of range, with
/// the nearest right spelling. A study without bars gets those of the studies of the case that run the same.
Resolved resolve(const Case& of, const Study& study);

/// The order of convergence between successive rows: log(e1/e2)/log(h1/h2); NaN without two positive numbers.
double order_between(const Row& coarse, const Row& fine, std::string_view name);

/// The number to which a bar of this name refers.
double value_of(const Row& row, std::string_view name);

}  // namespace ordo::verification
