// A material: its law and its numbers. This is all that kernels and methods know of constitutive laws; the laws themselves are
// in files of their own, see law.hpp.
#pragma once

#include "base/lanes.hpp"
#include "base/stress.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace ordo {

struct LawRow;
class OutsideLaw;

/// Parameters by name, of laws from outside the table; the density is "rho".
using NamedNumbers = std::map<std::string, double>;

/// Maxwell branches beside a law: shear moduli, Pa, and relaxation times, s; see branches.hpp.
struct Branches {
    static constexpr std::size_t most = 8;

    int count = 0;
    std::array<double, most> shear{}, time{};

    /// Pa, added to the shear modulus of fast motions.
    double total_shear() const
    {
        double r = 0.0;
        for (const double one : shear) r += one;
        return r;
    }
    bool operator==(const Branches&) const = default;
};

/// A law and its numbers. SI units.
struct Material {
    static constexpr int most_parameters = 32, most_history = 64;

    const LawRow* law = nullptr;
    double density    = 0.0;  ///< initial density, kg/m^3 (kg/m^2 in 2D, kg/m in 1D, per unit depth)
    double lambda     = 0.0;  ///< first Lame constant at rest, Pa; zero if the law has only Young's modulus
    double mu         = 0.0;  ///< shear modulus at rest, Pa; half of Young's modulus if the law has only that
    std::array<double, most_parameters> parameters{};  ///< parameters of the law, in its order; a list takes `most` places
    Branches branches{};
    const NamedNumbers* named = nullptr;  ///< parameters of a law from outside, see keep_numbers

    /// lambda + 2 mu, Pa; E if the law has only Young's modulus. With that of branches before they relax.
    double p_wave_modulus() const { return lambda + 2 * mu + 4.0 / 3 * branches.total_shear(); }
    /// sqrt((lambda + 2 mu)/rho0) at rest, m/s. Laws that stiffen say more: LawFunctions::stiffness.
    double wave_speed() const { return std::sqrt(p_wave_modulus() / density); }
    /// lambda + 2 mu/3, Pa.
    double bulk_modulus() const { return lambda + 2.0 / 3.0 * mu; }

    bool operator==(const Material&) const = default;
};

/// What the input gives for a parameter: a number, a list of numbers, one of some words (held as its place among them), or true
/// or false (held as 1 or 0).
enum class ParameterKind { number, numbers, word, flag };

/// A parameter of a law in addition to its elastic constants, and a key of [[material]].
struct LawParameter {
    static constexpr double none     = std::numeric_limits<double>::infinity();  ///< stands for a number that is not given
    static constexpr double required = -none;                                    ///< the default of what has none

    std::string_view name, unit, what;
    double min = 0.0, max = 1e300;
    double fallback                         = required;  ///< the default
    std::string_view fallback_of            = {};        ///< or the earlier parameter whose value is the default
    bool open_min                           = false;     ///< min itself is excluded
    ParameterKind kind                      = ParameterKind::number;
    int most                                = 1;   ///< of a list: how many numbers it may have
    std::array<std::string_view, 3> choices = {};  ///< of a word

    constexpr int places() const { return kind == ParameterKind::numbers ? most : 1; }
    constexpr bool is_required() const { return fallback == required && fallback_of.empty(); }
};

/// A number that a law carries with each particle. Laws share columns of the same name. A column of a tensor component that
/// exists only from 2D or 3D on has `min_dim`; columns without it stand first.
struct HistoryColumn {
    std::string_view name, what;
    double initial = 0.0;
    int min_dim    = 1;
};

/// How many of the columns there are in D dimensions.
template <class Columns>
constexpr int column_count(const Columns& columns, int dim)
{
    int n = 0;
    for (const HistoryColumn& c : columns) n += c.min_dim <= dim;
    return n;
}

/// A parameter that does not go with the others: its name, empty if all are good, and why.
struct BadParameter {
    std::string_view name = {}, why = {};
};

/// Which elastic constants the input gives: a pair, Young's modulus, the bulk or the shear modulus alone, or none.
enum class Elasticity { isotropic, young, bulk, shear, none };

/// The deformation in a step, for laws.
template <int D, class T = double>
struct Step {
    Mat<D, T> F;  ///< deformation gradient after the step
    Mat<D, T> G;  ///< displacement gradient of the step with respect to its start: F = (I + G) F_old
    double dt;    ///< s
    T q{};        ///< artificial pressure that did work in the step, Pa; not part of the stress of the law
};

/// What limits the time step: the modulus of P-waves K_t + 4 G/3, Pa, with c^2 = modulus/rho0, and the dynamic viscosity, Pa s.
struct Stiffness {
    double modulus = 0.0, viscosity = 0.0;
};

/// What methods need of a law in one dimension; null if it does not exist there.
template <int D>
struct LawFunctions {
    /// The initial stress at a deformation F, Pa; zero for incremental laws.
    Stress<D> (*initial_stress)(const Material&, const Mat<D>& F) = nullptr;
    /// Sets the history at the start, at a deformation F.
    void (*start)(const Material&, const Mat<D>& F, double* history) = nullptr;
    /// Sets the history at a deformation F to that of a given stress, Pa, without plastic flow. Returns whether the elasticity of
    /// the law can have it. Null where stress is a function of F.
    bool (*set_stress)(const Material&, const Mat<D>& F, const Stress<D>& sigma, double* history) = nullptr;
    /// The stress, Pa, after a step of one particle that had stress sigma, and its history. `fault` becomes positive where the
    /// equations of the law were not solved.
    Stress<D> (*update)(const Material&, const Step<D>& step, const Stress<D>& sigma, double* history, double& fault) = nullptr;
    /// sigma' at a velocity gradient L, Pa/s; zero for hyperelastic laws, null for laws that Runge-Kutta stages cannot integrate.
    Stress<D> (*stress_rate)(const Material&, const Stress<D>& sigma, const Mat<D>& L) = nullptr;
    /// The current stiffness; null where that is the one at rest, without viscosity.
    Stiffness (*stiffness)(const Material&, const Mat<D>& F, const double* history) = nullptr;
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
    bool carries_stress;   ///< from step to step, so that nothing may be added to it
    bool keeps_volume;     ///< where it flows, so that single particles lock (axis averaging)
    std::span<const LawParameter> parameters;
    std::span<const HistoryColumn> history;
    /// Finds parameters that do not go together; null for laws that take all.
    BadParameter (*check)(const Material&);
    /// Then sets the elastic constants and parameters that follow from others; null if there are none.
    void (*complete)(Material&);
    LawFunctions<1> in_1d;
    LawFunctions<2> in_2d;
    LawFunctions<3> in_3d;
    const OutsideLaw* outside = nullptr;  ///< if it is from outside the table, see outside_law.hpp

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

/// All laws of the table, in the order of `ordo list materials`.
std::span<const LawRow> laws();

/// The law of this name, also one from outside; null if there is none.
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
