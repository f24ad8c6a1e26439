// A material: which law, and its numbers. All that kernels and methods know of constitutive laws; the laws themselves are in
// files of their own, see law.hpp.
#pragma once

#include "base/lanes.hpp"
#include "base/stress.hpp"

#include <array>
#include <cmath>
#include <span>
#include <string_view>

namespace ordo {

struct LawRow;

/// A law and its numbers. SI units.
struct Material {
    static constexpr int most_parameters = 16, most_history = 16;

    const LawRow* law = nullptr;
    double density    = 0.0;  ///< initial density, kg/m^3 (kg/m^2 in 2D, kg/m in 1D, per unit depth)
    double lambda     = 0.0;  ///< first Lame constant at rest, Pa; zero where the law has Young's modulus alone
    double mu         = 0.0;  ///< shear modulus at rest, Pa; half of Young's modulus there
    std::array<double, most_parameters> parameters{};  ///< those of the law, in its order

    /// lambda + 2 mu, Pa: E where the law has Young's modulus alone.
    double p_wave_modulus() const { return lambda + 2 * mu; }
    /// sqrt((lambda + 2 mu)/rho0), m/s.
    double wave_speed() const { return std::sqrt(p_wave_modulus() / density); }

    bool operator==(const Material&) const = default;
};

/// A number of a law beside its elastic constants, and a key of [[material]].
struct LawParameter {
    std::string_view name, unit, what;
    double min = 0.0, max = 1e300;
};

/// A number that a law carries with each particle. Columns of one name are one column.
struct HistoryColumn {
    std::string_view name, what;
    double initial = 0.0;
};

/// Which elastic constants the input gives.
enum class Elasticity { isotropic, young };

/// What methods ask of a law in one dimension; null where it does not exist there.
template <int D>
struct LawFunctions {
    /// The stress at a deformation F that no step has led to, Pa: zero where it is carried along.
    Stress<D> (*initial_stress)(const Material&, const Mat<D>& F) = nullptr;
    /// sigma' at a velocity gradient L, Pa/s; zero where stress is a function of F, null for laws that stages cannot integrate.
    Stress<D> (*stress_rate)(const Material&, const Stress<D>& sigma, const Mat<D>& L) = nullptr;
    /// Stored energy, J, of a particle, or of eight, of volume V (initial V0).
    double (*energy)(const Material&, const Mat<D>& F, const Stress<D>& sigma, double V0, double V,
                     const double* history)                        = nullptr;
    Lanes (*energy_of_eight)(const Material&, const Mat<D, Lanes>& F, const Stress<D, Lanes>& sigma, const Lanes& V0,
                             const Lanes& V, const Lanes* history) = nullptr;
};

/// A law as the rest of ordo knows it: a row of the table in laws.cpp.
struct LawRow {
    std::string_view name, what;
    Elasticity elasticity;
    int max_dim;           ///< it exists in 1D to this dimension
    bool is_hyperelastic;  ///< stress is a function of F
    std::span<const LawParameter> parameters;
    std::span<const HistoryColumn> history;
    LawFunctions<1> in_1d;
    LawFunctions<2> in_2d;
    LawFunctions<3> in_3d;

    template <int D>
    const LawFunctions<D>& in() const
    {
        if constexpr (D == 1)
            return in_1d;
        else if constexpr (D == 2)
            return in_2d;
        else
            return in_3d;
    }
};

/// All laws, in the order of `ordo list materials`.
std::span<const LawRow> laws();

/// The law of this name; null where there is none.
const LawRow* find_law(std::string_view name);

/// Stored energy, J, of a deformation F with stress sigma in a volume V (initial V0), for laws without history.
template <int D>
double strain_energy(const Material& m, const Mat<D>& F, const Stress<D>& sigma, double V0, double V)
{
    return m.law->in<D>().energy(m, F, sigma, V0, V, nullptr);
}

/// The material of Young's modulus E, Pa, and Poisson's ratio nu.
inline Material elastic_material(const LawRow* law, double density, double E, double nu)
{
    return {law, density, E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu)), {}};
}

}  // namespace ordo
