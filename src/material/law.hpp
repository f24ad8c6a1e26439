// A constitutive law is a struct in a file of its own, listed in laws.hpp. Everything else follows from its row there: input
// keys, `ordo list materials`, the stress pass, history columns in particles, checkpoints and VTU.
#pragma once

#include "material/material.hpp"

#include <concepts>

namespace ordo {

using NoParameters = std::array<LawParameter, 0>;
using NoHistory    = std::array<HistoryColumn, 0>;

/// The deformation in a step, for laws.
template <int D, class T = double>
struct Step {
    Mat<D, T> F;  ///< deformation gradient after the step
    Mat<D, T> G;  ///< displacement gradient of the step with respect to its start: F = (I + G) F_old
    double dt;    ///< s
};

/// What every law has: a name, a description, its elastic constants, parameters and history columns, the largest dimension
/// in which it exists, and `of`, which makes the law from a material.
template <class L>
concept DescribedLaw = requires(const L law, const Material& m)
{
    {
        L::name
        } -> std::convertible_to<std::string_view>;
    {
        L::what
        } -> std::convertible_to<std::string_view>;
    {
        L::elasticity
        } -> std::convertible_to<Elasticity>;
    {
        L::max_dim
        } -> std::convertible_to<int>;
    {
        L::parameters.size()
        } -> std::convertible_to<std::size_t>;
    {
        L::history.size()
        } -> std::convertible_to<std::size_t>;
    {
        L::of(m)
        } -> std::same_as<L>;
};

/// Stress is a function of F. `cauchy` is the stress, Pa, and `energy` the stored energy per initial volume, J/m^D. Both are
/// templates on the scalar, so automatic differentiation gives P = dW/dF and body forces.
template <class L>
concept Hyperelastic = DescribedLaw<L> && requires(const L law, const Mat<1>& F)
{
    {
        law.cauchy(F)
        } -> std::same_as<Stress<1>>;
    {
        law.energy(F)
        } -> std::same_as<double>;
};

/// Particles carry stress and history. `update` returns the stress after a step, given that before it, and changes the history;
/// `energy` is the stored energy per current volume, J/m^D.
template <class L>
concept Incremental = DescribedLaw<L> && requires(const L law, const Step<1>& step, const Stress<1>& sigma, double* history)
{
    {
        law.update(step, sigma, history)
        } -> std::same_as<Stress<1>>;
    {
        law.energy(sigma, history)
        } -> std::same_as<double>;
};

/// An incremental law without history that is a differential equation, sigma' = rate(sigma, L) with the velocity gradient L,
/// 1/s. Runge-Kutta stages can integrate it.
template <class L>
concept RateLaw = Incremental<L> && requires(const L law, const Stress<1>& sigma, const Mat<1>& gradient)
{
    {
        law.rate(sigma, gradient)
        } -> std::same_as<Stress<1>>;
};

template <class L>
concept Law = Hyperelastic<L> || Incremental<L>;

}  // namespace ordo
