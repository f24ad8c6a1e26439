// A constitutive law is a struct in a file of its own, listed in laws.hpp. Everything else follows from its row there: input
// keys, `ordo list materials`, the stress pass, history columns in particles, checkpoints and VTU.
// Its functions are templates on their scalar: double, eight doubles (Lanes), or Dual of one of these, whose slopes are the tangent of
// implicit steps. So it decides by `choose` and `any_positive`, or one lane after another by `primal`, never by `if` on a scalar.
#pragma once

#include "material/material.hpp"

#include <concepts>

namespace ordo {

using NoParameters = std::array<LawParameter, 0>;
using NoHistory    = std::array<HistoryColumn, 0>;

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

/// Stress is a function of F and of a state that particles carry as history, such as the elastic part of the deformation.
/// `start` sets the history at a deformation F. `update` changes it in a step and returns the stress; it sets `fault` to a
/// positive number where its equations were not solved. `stress` is the stress at a state without rates, `energy` the stored
/// energy per initial volume, J/m^D. What is lost to heat is summed in a column `dissipated`, per initial volume.
template <class L>
concept Inelastic = DescribedLaw<L> && requires(const L law, const Step<1>& step, const Mat<1>& F, double* history, double& fault)
{
    law.start(F, history);
    {
        law.update(step, history, fault)
        } -> std::same_as<Stress<1>>;
    {
        law.stress(F, history)
        } -> std::same_as<Stress<1>>;
    {
        law.energy(F, history)
        } -> std::same_as<double>;
};

/// A law whose waves become faster or slower, or that is viscous; others have the stiffness of their elastic constants.
template <class L>
concept ChangesStiffness = requires(const L law, const Mat<1>& F, const double* history)
{
    {
        law.stiffness(F, history)
        } -> std::same_as<Stiffness>;
};

/// A law that deforms at constant volume where it flows.
template <class L>
concept KeepsVolume = requires
{
    L::keeps_volume;
};

/// A law that finds parameters which do not go together.
template <class L>
concept ChecksParameters = requires(const Material& m)
{
    {
        L::check(m)
        } -> std::same_as<BadParameter>;
};

/// A law that makes elastic constants or parameters from others, once, after `check`.
template <class L>
concept CompletesMaterial = requires(Material& m)
{
    L::complete(m);
};

template <class L>
concept Law = Hyperelastic<L> || Incremental<L> || Inelastic<L>;

}  // namespace ordo
