// The constitutive models, one small struct each, and the trivially copyable Material that names one of them.
// Hyperelastic laws are templates on the scalar: automatic differentiation gives P = dW/dF and body forces.
#pragma once

#include "base/dual.hpp"
#include "base/lane_math.hpp"
#include "base/vec.hpp"

#include <cmath>
#include <stdexcept>

namespace ordo {

/// Compressible neo-Hookean of the seed texts: sigma = [lambda ln J I + mu (F F^T - I)]/J.
/// Gong (2015) eq. 4.5; energy: Tran et al. (2019), corrected (errata cpls, eq. 55). Plane strain in 2D, uniaxial in 1D.
struct NeoHookean {
    double lambda, mu;

    template <int D, class T>
    ORDO_FLAT Mat<D, T> cauchy(const Mat<D, T>& F) const
    {
        const T J   = det(F);
        Mat<D, T> s = T(mu) * (F * transpose(F) - Mat<D, T>::identity());
        const T p   = T(lambda) * log(J);
        for (int a = 0; a < D; ++a) s(a, a) += p;
        return s * (T(1) / J);
    }
    /// Stored energy per initial volume, J/m^D.
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const T l = log(det(F));
        return T(lambda / 2) * l * l + T(mu / 2) * (ddot(F, F) - T(D) - T(2) * l);
    }
    /// The normal stress across the plane of a 1D or 2D problem (zero strain there).
    template <int D>
    ORDO_FLAT double lateral(const Mat<D>& F) const
    {
        const double J = det(F);
        return lambda * std::log(J) / J;
    }
};

/// St. Venant-Kirchhoff: S = lambda tr(E) I + 2 mu E with the Green strain E = (F^T F - I)/2; sigma = F S F^T/J.
/// Softens to nothing under strong compression (J -> 0): Bonet & Wood (2008), sec. 6.4.
struct StVenantKirchhoff {
    double lambda, mu;

    template <int D, class T>
    ORDO_FLAT static Mat<D, T> green(const Mat<D, T>& F)
    {
        return T(0.5) * (transpose(F) * F - Mat<D, T>::identity());
    }
    template <int D, class T>
    ORDO_FLAT Mat<D, T> cauchy(const Mat<D, T>& F) const
    {
        const Mat<D, T> E = green(F);
        Mat<D, T> S       = T(2 * mu) * E;
        const T p         = T(lambda) * trace(E);
        for (int a = 0; a < D; ++a) S(a, a) += p;
        return F * S * transpose(F) * (T(1) / det(F));
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const Mat<D, T> E = green(F);
        const T tr        = trace(E);
        return T(lambda / 2) * tr * tr + T(mu) * ddot(E, E);
    }
    template <int D>
    ORDO_FLAT double lateral(const Mat<D>& F) const
    {
        return lambda * trace(green(F)) / det(F);
    }
};

/// Linear elastic rate law with the Jaumann rate: sigma' = W sigma - sigma W + lambda tr(d) I + 2 mu d.
/// Integrated at the midpoint with the rotation of Hughes & Winget (1980), which also turns the increment by its half:
/// exact for rigid rotations of any size, second order in dt.
struct JaumannElastic {
    double lambda, mu;

    /// The stress after a step; G is the displacement gradient of the step with respect to its start, dt L.
    template <int D, class T>
    ORDO_FLAT Mat<D, T> update(const Mat<D, T>& sigma, const Mat<D, T>& G) const
    {
        const T half(0.5), quarter(0.25);
        const Mat<D, T> I = Mat<D, T>::identity();
        const Mat<D, T> M = G * inverse(I + half * G);  // gradient with respect to the middle of the step
        const Mat<D, T> e = half * (M + transpose(M));
        const Mat<D, T> w = half * (M - transpose(M));
        const Mat<D, T> Q = inverse(I - half * w) * (I + half * w);        // rotation of the step
        const Mat<D, T> q = inverse(I - quarter * w) * (I + quarter * w);  // and of its second half, which turns the increment
        Mat<D, T> s       = T(2 * mu) * e;
        for (int a = 0; a < D; ++a) s(a, a) += T(lambda) * trace(e);
        return Q * sigma * transpose(Q) + q * s * transpose(q);
    }
    /// sigma' at a velocity gradient L.
    template <int D, class T>
    ORDO_FLAT Mat<D, T> rate(const Mat<D, T>& sigma, const Mat<D, T>& L) const
    {
        const T half(0.5);
        const Mat<D, T> d = half * (L + transpose(L)), w = half * (L - transpose(L));
        Mat<D, T> s = w * sigma - sigma * w + T(2 * mu) * d;
        for (int a = 0; a < D; ++a) s(a, a) += T(lambda) * trace(d);
        return s;
    }
    /// Stored energy per current volume, sigma : C^-1 : sigma / 2, J/m^D. The strain across a 1D or 2D problem is zero.
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& sigma) const
    {
        const T tr = trace(sigma);
        return (ddot(sigma, sigma) - T(lambda / (D * lambda + 2 * mu)) * tr * tr) * T(1 / (4 * mu));
    }
    template <int D>
    ORDO_FLAT double lateral(const Mat<D>& sigma) const
    {
        return lambda / (D * lambda + 2 * mu) * trace(sigma);
    }
};

/// The one-dimensional rate law sigma' = E dv/dx, Wobbes et al. (2020) sec. 5. 1D only.
struct LinearRate1D {
    double young;

    template <class T>
    ORDO_FLAT Mat<1, T> update(const Mat<1, T>& sigma, const Mat<1, T>& G) const
    {
        return sigma + T(young) * G;
    }
    template <class T>
    ORDO_FLAT Mat<1, T> rate(const Mat<1, T>&, const Mat<1, T>& L) const
    {
        return T(young) * L;
    }
    template <class T>
    ORDO_FLAT T energy(const Mat<1, T>& sigma) const
    {
        return sigma(0, 0) * sigma(0, 0) * T(1 / (2 * young));
    }
    ORDO_FLAT double lateral(const Mat<1>&) const { return 0.0; }
};

/// Stress is a function of F.
template <class M>
concept Hyperelastic = requires(const M m, const Mat<1>& F)
{
    {m.cauchy(F)};
    {m.energy(F)};
};
/// Stress is carried along and updated by the displacement gradient of each step.
template <class M>
concept RateLaw = requires(const M m, const Mat<1>& sigma, const Mat<1>& G)
{
    {m.update(sigma, G)};
    {m.rate(sigma, G)};
    {m.energy(sigma)};
};
static_assert(Hyperelastic<NeoHookean> && Hyperelastic<StVenantKirchhoff>);
static_assert(RateLaw<JaumannElastic> && RateLaw<LinearRate1D>);

enum class MaterialModel { neo_hookean, st_venant_kirchhoff, jaumann_elastic, linear_rate_1d };

/// A model and its parameters. SI units.
struct Material {
    MaterialModel model = MaterialModel::neo_hookean;
    double density      = 0.0;  ///< initial density, kg/m^3 (kg/m^2 in 2D, kg/m in 1D, per unit depth)
    double lambda       = 0.0;  ///< first Lame constant, Pa; zero for linear_rate_1d
    double mu           = 0.0;  ///< shear modulus, Pa; half of Young's modulus for linear_rate_1d

    /// Whether stress is carried along, not a function of F.
    ORDO_FLAT bool is_rate_law() const
    {
        return model == MaterialModel::jaumann_elastic || model == MaterialModel::linear_rate_1d;
    }
    /// P-wave modulus lambda + 2 mu, Pa: E for linear_rate_1d.
    ORDO_FLAT double p_wave_modulus() const { return lambda + 2 * mu; }
    /// sqrt((lambda + 2 mu)/rho0), m/s.
    ORDO_FLAT double wave_speed() const { return std::sqrt(p_wave_modulus() / density); }
};

/// The material of Young's modulus E, Pa, and Poisson's ratio nu.
inline Material elastic_material(MaterialModel model, double density, double E, double nu)
{
    return {model, density, E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))};
}

/// f(law) with the struct of the material's model. linear_rate_1d in 2D or 3D is refused at set-up.
template <int D, class F>
ORDO_FLAT inline auto with_material(const Material& m, F&& f)
{
    switch (m.model) {
    case MaterialModel::neo_hookean: return f(NeoHookean{m.lambda, m.mu});
    case MaterialModel::st_venant_kirchhoff: return f(StVenantKirchhoff{m.lambda, m.mu});
    case MaterialModel::linear_rate_1d:
        if constexpr (D == 1) return f(LinearRate1D{m.p_wave_modulus()});
        [[fallthrough]];
    case MaterialModel::jaumann_elastic: break;
    }
    return f(JaumannElastic{m.lambda, m.mu});
}

/// The stress at a deformation F that no step has led to: zero for rate laws, Pa.
template <int D>
ORDO_FLAT inline Mat<D> initial_stress(const Material& m, const Mat<D>& F)
{
    return with_material<D>(m, [&](const auto& law) {
        if constexpr (Hyperelastic<std::decay_t<decltype(law)>>)
            return law.cauchy(F);
        else
            return Mat<D>{};
    });
}

/// sigma' of a rate law at a velocity gradient L, Pa/s; zero where stress is a function of F.
template <int D>
ORDO_FLAT inline Mat<D> stress_rate(const Material& m, const Mat<D>& sigma, const Mat<D>& L)
{
    return with_material<D>(m, [&](const auto& law) {
        if constexpr (RateLaw<std::decay_t<decltype(law)>>)
            return law.rate(sigma, L);
        else
            return Mat<D>{};
    });
}

/// Stored energy of a particle, or of eight, of volume V (initial V0), J.
template <int D, class T>
ORDO_FLAT inline T strain_energy(const Material& m, const Mat<D, T>& F, const Mat<D, T>& sigma, const T& V0, const T& V)
{
    return with_material<D>(m, [&](const auto& law) {
        if constexpr (Hyperelastic<std::decay_t<decltype(law)>>)
            return V0 * law.energy(F);
        else
            return V * law.energy(sigma);
    });
}

/// The stress across the plane of a 1D or 2D problem, Pa.
template <int D>
ORDO_FLAT inline double lateral_stress(const Material& m, const Mat<D>& F, const Mat<D>& sigma)
{
    return with_material<D>(m, [&](const auto& law) {
        if constexpr (Hyperelastic<std::decay_t<decltype(law)>>)
            return law.lateral(F);
        else
            return law.lateral(sigma);
    });
}

}  // namespace ordo
