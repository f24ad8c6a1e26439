// Paths of deformation for one material point, for `ordo drive`: from a CSV file or by name, and the steps of a law along them.
// Knows no command line and no output.
#pragma once

#include "io/schema.hpp"
#include "material/material.hpp"

#include <string>
#include <vector>

namespace ordo::app {

/// What a path prescribes at a time: each component of F, or instead of it that of the Cauchy stress.
struct Target {
    double time = 0.0;
    Mat<3> F    = Mat<3>::identity();  ///< with respect to the base
    Mat<3> stress{};                   ///< Pa
    Mat<3, bool> is_stress{};          ///< the stress is prescribed
    bool is_base = false;              ///< later F are with respect to the end of this row
    io::Place place{};                 ///< in the file
};

/// The named paths. `strain` is the logarithmic strain along x at the end, or the shear; `confine` the pressure, Pa, that acts
/// first (triaxial and undrained).
struct NamedPath {
    std::string name;
    std::optional<double> strain, confine;
    int steps   = 100;
    double rate = 1.0;  ///< of the strain, 1/s
};
const std::vector<std::string>& path_names();
/// For a material, whose stress at the start is where the pressure starts from. Throws InputError, also if the path does not
/// exist in `dim` dimensions.
std::vector<Target> named_path(const NamedPath& path, const Material& material, int dim);

/// Columns time and F11, F12, .., F33; S11 instead of F11 prescribes the Cauchy stress, and so on. Throws InputError.
std::vector<Target> read_path(const std::string& file, int dim);

/// A material point at a row of the path.
struct PointRow {
    double time = 0.0;
    Mat<3> F{}, cauchy{};
    std::vector<double> history;  ///< the columns of the law in this dimension
    double stored     = 0.0;      ///< energy per initial volume, J/m^3
    double dissipated = 0.0;      ///< per initial volume, J/m^3
    int parts         = 1;        ///< into which the step was divided, because it was not solved at once
};

/// Follows a path: one step of the law a row. Throws NumericalError if a step is not solved.
std::vector<PointRow> follow_path(const Material& material, const std::vector<Target>& path, int dim);

}  // namespace ordo::app
