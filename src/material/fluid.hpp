// A weakly compressible fluid, Newtonian or Bingham.
#pragma once

#include "material/elastic_state.hpp"

namespace ordo {

/// sigma = -p I + 2 eta dev d with Tait's pressure p = (K/gamma)(J^-gamma - 1), K = rho0 c0^2 (Cole 1948; Monaghan 1994, J.
/// Comput. Phys. 110:399, eq. 4.1). Bingham: eta grows by yield/max(rate, critical_rate) with the shear rate sqrt(2 dev d : dev
/// d). d is the logarithmic strain ln(f f^T)/2 of the step over dt: exactly objective, and its trace is that of ln J; first order
/// in the step. With `tension` false the pressure is never negative.
struct Fluid {
    static constexpr std::string_view name = "fluid",
                                      what = "weakly compressible fluid: Tait's pressure, Newtonian or Bingham (Monaghan 1994)";
    static constexpr Elasticity elasticity = Elasticity::none;
    static constexpr int max_dim           = 3;
    static constexpr bool keeps_volume     = true;
    static constexpr double not_given      = LawParameter::none;
    static constexpr std::array parameters{
        LawParameter{.name     = "sound_speed",
                     .unit     = "m/s",
                     .what     = "speed of sound at rest, at least 10 times the largest velocity",
                     .open_min = true},
        LawParameter{.name     = "gamma",
                     .unit     = "",
                     .what     = "exponent of Tait's pressure",
                     .min      = 1.0,
                     .max      = 100.0,
                     .fallback = 7.0,
                     .open_min = true},
        LawParameter{.name = "viscosity", .unit = "Pa s", .what = "dynamic viscosity", .fallback = 0.0},
        LawParameter{.name = "yield", .unit = "Pa", .what = "yield stress in shear (Bingham)", .fallback = 0.0},
        LawParameter{.name     = "critical_rate",
                     .unit     = "1/s",
                     .what     = "shear rate below which a Bingham fluid is Newtonian, 0.01 if not given; a "
                                 "smaller one needs smaller time steps",
                     .fallback = not_given,
                     .open_min = true},
        LawParameter{
            .name = "tension", .unit = "", .what = "the pressure may be negative", .fallback = 1.0, .kind = ParameterKind::flag}};
    static constexpr std::array history{kDissipated};
    enum Parameter { kSoundSpeed, kGamma, kViscosity, kYield, kCriticalRate, kTension };

    double bulk, gamma, viscosity, yield, critical_rate;
    bool has_tension;

    ORDO_FLAT static Fluid of(const Material& m)
    {
        const auto& p = m.parameters;
        return {m.lambda, p[kGamma], p[kViscosity], p[kYield], p[kCriticalRate], p[kTension] > 0};
    }
    static void complete(Material& m)
    {
        auto& p  = m.parameters;
        m.lambda = m.density * p[kSoundSpeed] * p[kSoundSpeed];
        if (p[kCriticalRate] == not_given) p[kCriticalRate] = 0.01;
    }
    static BadParameter check(const Material& m)
    {
        if (m.parameters[kCriticalRate] != not_given && m.parameters[kYield] == 0)
            return {"critical_rate", "has no effect without yield: give the yield stress, or remove it"};
        return {};
    }

    template <int D, class T>
    ORDO_FLAT void start(const Mat<D, T>&, T*) const
    {}
    template <int D, class T>
    ORDO_FLAT Stress<D, T> stress(const Mat<D, T>& F, const T*) const
    {
        return isotropic<D>(-1.0 * pressure(det(F)));
    }
    /// psi = (K/gamma)(J^(1-gamma)/(gamma-1) + J - gamma/(gamma-1)), so that dpsi/dJ = -p.
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F, const T*) const
    {
        const T J   = det(F);
        const T psi = T(bulk / gamma) * (exp(T(1 - gamma) * log(J)) * T(1 / (gamma - 1)) + J - T(gamma / (gamma - 1)));
        return has_tension ? psi : choose(J - T(1.0), T(0.0), psi);
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, T* h, T&) const
    {
        const Stress<D, T> elastic = stress(step.F, h);
        if (!(viscosity + yield > 0) || !(step.dt > 0)) return elastic;
        const Mat<D, T> f          = Mat<D, T>::identity() + step.G;
        const Symmetric<D, T> d    = T(1 / step.dt) * hencky_strain(left_cauchy_green(f)).dev;
        const Stress<D, T> viscous = viscous_stress(d);
        h[0] += det(step.F) * ddot(viscous, d) * T(step.dt);
        return elastic + viscous;
    }
    /// 2 eta d for a deviatoric rate of deformation d, 1/s.
    template <int D, class T>
    ORDO_FLAT Stress<D, T> viscous_stress(const Symmetric<D, T>& d) const
    {
        T eta(viscosity);
        if (yield > 0) eta += T(yield) / larger(sqrt(T(2.0) * square(d)), T(critical_rate));
        return T(2.0) * eta * d;
    }
    /// K_t = K (rho/rho0)^(gamma-1); the viscosity is the largest that the rate may give.
    template <int D>
    Stiffness stiffness(const Mat<D>& F, const double*) const
    {
        return {bulk * std::pow(det(F), 1 - gamma), viscosity + yield / critical_rate};
    }

  private:
    template <class T>
    ORDO_FLAT T pressure(const T& J) const
    {
        const T p = T(bulk / gamma) * (exp(T(-gamma) * log(J)) - T(1.0));
        return has_tension ? p : larger(p, T(0.0));
    }
};
static_assert(Inelastic<Fluid> && ChangesStiffness<Fluid>);

}  // namespace ordo
