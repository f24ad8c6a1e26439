// Von Mises plasticity with isotropic hardening.
#pragma once

#include "material/elastic_state.hpp"

namespace ordo {

/// f = q - Y(alpha) in the Kirchhoff stress, q = sqrt(3/2) |dev tau|, associated flow, Hencky's elasticity.
/// Y = Y0 + H alpha + (Yinf - Y0)(1 - exp(-delta alpha)), Voce (1948); linear if delta = 0. Y stays zero or positive.
/// Return map: Simo (1992), CMAME 99:61; de Souza Neto, Peric & Owen (2008), box 7.4 in logarithmic strain (ch. 14).
struct J2 {
    static constexpr std::string_view name = "j2",
                                      what = "von Mises plasticity with linear and Voce hardening, finite strain (Simo 1992)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr bool keeps_volume     = true;
    static constexpr std::array parameters{
        LawParameter{.name = "yield", .unit = "Pa", .what = "yield stress in tension", .open_min = true},
        LawParameter{.name     = "hardening",
                     .unit     = "Pa",
                     .what     = "slope of the yield stress over plastic strain, negative for softening",
                     .min      = -1e300,
                     .fallback = 0.0},
        LawParameter{
            .name = "saturation", .unit = "Pa", .what = "yield stress to which Voce hardening tends", .fallback_of = "yield"},
        LawParameter{.name = "saturation_rate", .unit = "", .what = "exponent of Voce hardening", .fallback = 0.0}};
    static constexpr std::array history = with_elastic_columns(std::array{kPlasticStrain, kDissipated});
    enum Column { kAlpha, kWork, kB };

    HenckyElasticity elastic;
    double yield, hardening, saturation, rate;

    ORDO_FLAT static J2 of(const Material& m)
    {
        return {{m.bulk_modulus(), m.mu}, m.parameters[0], m.parameters[1], m.parameters[2], m.parameters[3]};
    }
    static BadParameter check(const Material& m)
    {
        const J2 law = of(m);
        if (!(3 * law.elastic.shear + law.hardening > 0))
            return {"hardening", "must be above -3 times the shear modulus: else no stress solves a step"};
        if (law.rate == 0 && law.saturation != law.yield)
            return {"saturation", "has no effect without saturation_rate: give that too, or remove it"};
        if (law.rate > 0 && law.saturation == law.yield)
            return {"saturation_rate", "has no effect without saturation: give one other than yield, or remove it"};
        if (!(3 * law.elastic.shear + law.hardening + law.rate * (law.saturation - law.yield) > 0))
            return {"saturation_rate",
                    "makes the yield stress fall faster than 3 times the shear modulus: take a smaller one, or "
                    "a larger saturation"};
        return {};
    }

    template <int D, class T>
    ORDO_FLAT void start(const Mat<D, T>& F, T* h) const
    {
        write_symmetric(left_cauchy_green(F), h + kB);
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> stress(const Mat<D, T>& F, const T* h) const
    {
        return cauchy_of(elastic.kirchhoff(hencky_strain(read_symmetric<D>(h + kB))), F);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>&, const T* h) const
    {
        return elastic.energy(hencky_strain(read_symmetric<D>(h + kB)));
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, T* h, T& fault) const
    {
        return step_radially(step, elastic, h + kB, h[kWork], [&](const HenckyStrain<D, T>& e) {
            const T q      = T(std::sqrt(6.0) * elastic.shear) * sqrt(square(e.dev));
            const T f      = q - larger(yield_stress(h[kAlpha]), T(0.0));
            const T lambda = any_positive(f) ? choose(f, multiplier(q, h[kAlpha], fault), T(0.0)) : T(0.0);
            h[kAlpha] += lambda;
            return RadialReturn<T>{f, choose(f, T(1.0) - T(3 * elastic.shear) * lambda / q, T(1.0)), T(0.0)};
        });
    }

  private:
    template <class T>
    ORDO_FLAT T yield_stress(const T& alpha) const
    {
        const T linear = T(yield) + T(hardening) * alpha;
        return rate > 0 ? linear + T(saturation - yield) * (T(1.0) - exp(T(-rate) * alpha)) : linear;
    }
    /// lambda of q - 3 G lambda = Y(alpha + lambda), at most what makes q zero: there Y has fallen to zero.
    template <class T>
    ORDO_FLAT T multiplier(const T& q, const T& alpha, T& fault) const
    {
        const double three_g = 3 * elastic.shear;
        T lambda             = (q - yield_stress(alpha)) * T(1 / (three_g + hardening));
        if (rate > 0) lambda = solve_voce(q, alpha, fault);
        return smaller(lambda, q * T(1 / three_g));
    }
    /// The residual at lambda, and how fast it falls.
    template <class T>
    struct Voce {
        T residual, slope;
    };
    template <class T>
    ORDO_FLAT Voce<T> voce(const T& q, const T& alpha, const T& lambda) const
    {
        const T rest = T(saturation - yield) * exp(T(-rate) * (alpha + lambda));
        return {q - T(3 * elastic.shear) * lambda - (T(saturation) + T(hardening) * (alpha + lambda) - rest),
                T(3 * elastic.shear + hardening) + T(rate) * rest};
    }
    template <class T>
    ORDO_FLAT Dual<T> solve_voce(const Dual<T>& q, const Dual<T>& alpha, Dual<T>& fault) const
    {
        const T lambda         = solve_voce(q.value, alpha.value, fault.value);
        const Voce<Dual<T>> at = voce(q, alpha, Dual<T>(lambda, T(0.0)));
        return as_root(lambda, at.residual, -1.0 * at.slope.value);
    }
    /// Newton's method. The residual is convex or concave in lambda, so after the first step all are on one side of the root.
    template <class T>
    ORDO_FLAT T solve_voce(const T& q, const T& alpha, T& fault) const
    {
        constexpr int most = 50;
        const T tolerance  = T(1e-9) * (q + T(yield));  // one more step then leaves the rounding error
        T lambda(0.0), open(1.0);                       // `open` is positive where the residual was above it
        for (int k = 0; k < most && any_positive(open); ++k) {
            const Voce<T> at = voce(q, alpha, lambda);
            lambda           = choose(open, lambda + at.residual / at.slope, lambda);
            open             = choose(open, fabs(at.residual) - tolerance, open);
        }
        fault = choose(q - yield_stress(alpha), larger(fault, open), fault);
        return lambda;
    }
};
static_assert(Inelastic<J2>);

}  // namespace ordo
