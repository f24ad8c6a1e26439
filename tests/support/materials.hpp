// Materials for tests: numbers for each law that needs more than elastic constants.
#pragma once

#include "io/input.hpp"
#include "material/material.hpp"

#include <map>
#include <string>
#include <vector>

namespace ordo::test {

/// A material from settings of [[material]], such as "yield=10".
inline Material material_of(const std::string& law, const std::vector<std::string>& settings, int dim = 3)
{
    return io::read_material(law, settings, dim).second;
}

/// Settings with which a law is inelastic at strains of some percent.
inline const std::vector<std::string>& sample_settings(std::string_view law)
{
    static const std::map<std::string, std::vector<std::string>, std::less<>> all{
        {"j2", {"young=1000", "poisson=0.3", "yield=30", "hardening=20", "saturation=45", "saturation_rate=8"}},
        {"drucker-prager", {"young=1000", "poisson=0.3", "friction_angle=30", "dilation_angle=10", "cohesion=10", "hardening=5"}},
        {"fluid", {"sound_speed=1.2", "viscosity=20", "yield=5"}},
        {"mohr-coulomb",
         {"young=1000", "poisson=0.3", "friction_angle=30", "dilation_angle=10", "cohesion=10", "tension_cutoff=8",
          "residual_cohesion=6", "softening_strain=0.1"}},
        {"johnson-cook",
         {"young=1000", "poisson=0.3", "A=25", "B=30", "n=0.4", "C=0.05", "m=1.1", "reference_rate=0.01",
          "reference_temperature=290", "temperature=300", "melting_temperature=900", "specific_heat=0.001", "taylor_quinney=0.9",
          "sound_speed=0.9", "shock_slope=1.4", "gruneisen=1.9"}},
        {"cam-clay",
         {"shear=60", "swelling_index=0.05", "compression_index=0.2", "critical_slope=1.1", "reference_pressure=10",
          "preconsolidation=14"}},
        {"mu-i",
         {"young=1000", "poisson=0.2", "friction_static=0.38", "friction_dynamic=0.64", "inertial_number=0.3",
          "grain_diameter=0.5", "grain_density=3"}},
        {"mooney-rivlin", {"bulk=833", "c10=130", "c01=60"}},
        {"ogden", {"bulk=833", "moduli=[200, -50]", "exponents=[2.6, -4]"}},
        {"linear-rate-1d", {"young=1000"}},
    };
    static const std::vector<std::string> elastic{"young=1000", "poisson=0.3"};
    const auto found = all.find(law);
    return found == all.end() ? elastic : found->second;
}
inline Material sample_material(std::string_view law, int dim = 3)
{
    return material_of(std::string(law), sample_settings(law), dim);
}

}  // namespace ordo::test
