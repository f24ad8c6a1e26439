// A material: its law and its numbers. This is all that kernels and methods know of constitutive laws; the laws themselves are
// in files of their own, see law.hpp.
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
    double lambda     = 0.0;  ///< first Lame constant at rest, Pa; zero if the law has only Young's modulus
    double mu         = 0.0;  ///< shear modulus at rest, Pa; half of Young's modulus if the law has only that
    std::array<double, most_parameters> parameters{};  ///< parameters of the law, in its order

    /// lambda + 2 mu, Pa; E if the law has only Young's modulus.
    double p_wave_modulus() const { return lambda + 2 * mu; }
    /// sqrt((lambda + 2 mu)/rho0), m/s.
    double wave_speed() const { return std::sqrt(p_wave_modulus() / density); }

    bool operator==(const Material&) const = default;
};

/// A parameter of a law in addition to its elastic constants, and a key of [[material]].
struct LawParameter {
    std::string_view name, unit, what;
    double min = 0.0, max = 1e300;
};

/// A number that a law carries with each particle. Laws share columns of the same name.
struct HistoryColumn {
    std::string_view name, what;
    double initial = 0.0;
};

/// Which elastic constants the input gives.
enum class Elasticity { isotropic, young };

/// What methods need of a law in one dimension; null if it does not exist there.
template <int D>
struct LawFunctions {
    /// The initial stress at a deformation F, Pa; zero for incremental laws.
    Stress<D> (*initial_stress)(const Material&, const Mat<D>& F) = nullptr;
    /// sigma' at a velocity gradient L, Pa/s; zero for hyperelastic laws, null for laws that Runge-Kutta stages cannot integrate.
    Stress<D> (*stress_rate)(const Material&, const Stress<D>& sigma, const Mat<D>& L) = nullptr;
    /// Stored energy, J, of one particle or of eight, of volume V (initial V0).
    double (*energy)(const Material&, const Mat<D>& F, const Stress<D>& sigma, double V0, double V,
                     const double* history)                        = nullptr;
    Lanes (*energy_of_eight)(const Material&, const Mat<D, Lanes>& F, const Stress<D, Lanes>& sigma, const Lanes& V0,
                             const Lanes& V, const Lanes* history) = nullptr;
};

/// A law for the rest of ordo: a row of the table in laws.cpp.
struct LawRow {
    std::string_view name, what;
    Elasticity elasticity;
    int max_dim;           ///< it exists in 1D up to this dimension
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

/// The law of this name; null if there is none.
const LawRow* find_law(std::string_view name);

/// Stored energy, J, at deformation F and stress sigma in a volume V (initial V0), for laws without history.
template <int D>
double strain_energy(const Material& m, const Mat<D>& F, const Stress<D>& sigma, double V0, double V)
{
    return m.law->in<D>().energy(m, F, sigma, V0, V, nullptr);
}

/// The material with Young's modulus E, Pa, and Poisson's ratio nu.
inline Material elastic_material(const LawRow* law, double density, double E, double nu)
{
    return {law, density, E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu)), {}};
}

}  // namespace ordo
