// Drucker-Prager plasticity.
#pragma once

#include "material/elastic_state.hpp"

namespace ordo {

/// f = sqrt(J2) + eta P - xi c in the Kirchhoff stress, P = tr(tau)/3 (tension positive), flow with eta_flow instead of eta,
/// Hencky's elasticity, c = cohesion + hardening alpha, not below zero. alpha' = xi lambda'.
/// Return to the cone or to the apex: de Souza Neto, Peric & Owen (2008), boxes 8.8 to 8.10. At the apex alpha grows by
/// (xi/eta_flow) d eps_v^p; without dilation by xi sqrt(2) |dev eps^p|, which is what the cone gives where it ends: with any other
/// growth cohesion would jump there, and with softening energy would be created.
/// Volume correction, for material without cohesion: what ln J gained at the apex is taken back before pressure builds up (after
/// Tampubolon et al. 2017, ACM TOG 36:105); else loose sand regains volume for free.
struct DruckerPrager {
    static constexpr std::string_view name = "drucker-prager",
                                      what = "Drucker-Prager plasticity with apex, finite strain (de Souza Neto et al. 2008)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr double not_given      = LawParameter::none;
    static constexpr std::array parameters{
        LawParameter{.name     = "eta",
                     .unit     = "",
                     .what     = "slope of the cone, instead of friction_angle",
                     .fallback = not_given,
                     .open_min = true},
        LawParameter{.name     = "eta_flow",
                     .unit     = "",
                     .what     = "slope of the flow potential, instead of dilation_angle",
                     .fallback = not_given},
        LawParameter{
            .name = "xi", .unit = "", .what = "factor of the cohesion, with eta", .fallback = not_given, .open_min = true},
        LawParameter{.name     = "friction_angle",
                     .unit     = "degree",
                     .what     = "angle of friction",
                     .max      = 89.0,
                     .fallback = not_given,
                     .open_min = true},
        LawParameter{.name = "dilation_angle", .unit = "degree", .what = "angle of dilation", .max = 89.0, .fallback = not_given},
        LawParameter{.name     = "fit",
                     .unit     = "",
                     .what     = "which Mohr-Coulomb states of these angles the cone meets: outer edges "
                                 "(triaxial compression; if not given), inner edges (extension) or plane strain",
                     .fallback = not_given,
                     .kind     = ParameterKind::word,
                     .choices  = {"outer", "inner", "plane-strain"}},
        LawParameter{.name = "cohesion", .unit = "Pa", .what = "cohesion"},
        LawParameter{.name     = "hardening",
                     .unit     = "Pa",
                     .what     = "slope of the cohesion over plastic strain, negative for softening",
                     .min      = -1e300,
                     .fallback = 0.0},
        LawParameter{.name     = "volume_correction",
                     .unit     = "",
                     .what     = "gaps that open in tension must close before pressure builds "
                                 "up; for cohesion 0",
                     .fallback = 0.0,
                     .kind     = ParameterKind::flag}};
    static constexpr std::array history = with_elastic_columns(
        std::array{kPlasticStrain, kDissipated, HistoryColumn{"gap", "ln of the volume ratio of open gaps"}});
    enum Parameter { kEta, kEtaFlow, kXi, kFriction, kDilation, kFit, kCohesion, kHardening, kCorrection };
    enum Column { kAlpha, kWork, kGap, kB };

    HenckyElasticity elastic;
    double eta, eta_flow, xi, cohesion, hardening;
    bool has_correction;

    ORDO_FLAT static DruckerPrager of(const Material& m)
    {
        const auto& p = m.parameters;
        return {{m.bulk_modulus(), m.mu}, p[kEta], p[kEtaFlow], p[kXi], p[kCohesion], p[kHardening], p[kCorrection] > 0};
    }
    /// Cones through Mohr-Coulomb states: de Souza Neto et al. (2008), eqs. 8.123 to 8.127.
    static void complete(Material& m)
    {
        auto& p = m.parameters;
        if (p[kEta] != not_given) return;
        auto slope = [&](double angle) {
            const double s = std::sin(angle * std::acos(-1.0) / 180), t = std::tan(angle * std::acos(-1.0) / 180);
            const double triaxial = std::sqrt(3.0) * (p[kFit] == 1 ? 3 + s : 3 - s), plane = std::sqrt(9 + 12 * t * t);
            return p[kFit] == 2 ? std::array{3 * t / plane, 3 / plane}
                                : std::array{6 * s / triaxial, 6 * std::sqrt(1 - s * s) / triaxial};
        };
        p[kEta]     = slope(p[kFriction])[0];
        p[kXi]      = slope(p[kFriction])[1];
        p[kEtaFlow] = slope(p[kDilation])[0];
    }
    static BadParameter check(const Material& m)
    {
        auto has              = [&](Parameter k) { return m.parameters[k] != not_given; };
        const bool has_slopes = has(kEta) || has(kEtaFlow) || has(kXi), has_angles = has(kFriction) || has(kDilation);
        const bool has_all = has_slopes ? has(kEta) && has(kEtaFlow) && has(kXi) : has(kFriction) && has(kDilation);
        if (has_slopes == has_angles || !has_all)
            return {"model", "drucker-prager needs either friction_angle and dilation_angle, or eta, eta_flow and xi"};
        if (has_slopes && has(kFit)) return {"fit", "is for angles: remove it, or give friction_angle and dilation_angle"};
        Material whole = m;
        complete(whole);
        const DruckerPrager law = of(whole);
        if (law.eta_flow > law.eta)
            return {has_slopes ? "eta_flow" : "dilation_angle", "must not be above that of friction: flow would create energy"};
        if (law.has_correction && (law.cohesion > 0 || law.hardening != 0))
            return {"volume_correction", "is for material without cohesion: set cohesion and hardening to 0"};
        const double of_volume = law.elastic.bulk * law.eta * law.eta_flow;
        if (!(law.xi * law.xi * law.hardening + (of_volume > 0 ? of_volume : law.elastic.shear) > 0))
            return {"hardening", "falls too fast: xi^2 hardening must be above -K eta eta_flow, or above -G without dilation"};
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
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, T* h, T&) const
    {
        return step_radially(step, elastic, h + kB, h[kWork], [&](const HenckyStrain<D, T>& e) {
            const T norm = sqrt(square(e.dev)), theta = e.theta + h[kGap];
            RadialReturn<T> r = returned(norm, theta, h[kAlpha]);
            if (!has_correction) return r;
            // At the apex, where ratio is zero, the gap is what is left of theta there.
            r.closing = h[kGap];
            r.plastic = larger(r.plastic, h[kGap]);
            h[kGap]   = choose(r.ratio, T(0.0), r.d_theta);
            return r;
        });
    }

  private:
    /// The return of a trial state; changes alpha.
    template <class T>
    ORDO_FLAT RadialReturn<T> returned(const T& norm, const T& theta, T& alpha) const
    {
        const double G = elastic.shear, K = elastic.bulk;
        const T root_J2 = T(std::sqrt(2.0) * G) * norm, P = T(K) * theta;
        const T c = larger(T(cohesion) + T(hardening) * alpha, T(0.0));
        const T f = root_J2 + T(eta) * P - T(xi) * c;
        RadialReturn<T> r{f, T(1.0), T(0.0)};
        if (!any_positive(f)) return r;
        const T lambda = on_cone(f, c), left = root_J2 - T(G) * lambda;
        const T ratio = choose(left, left / root_J2, T(0.0));
        T d_theta = T(K > 0 ? eta_flow : 0.0) * lambda, d_alpha = T(xi) * lambda;
        const T beyond = choose(f, choose(left, T(0.0), T(1.0)), T(0.0));
        if (any_positive(beyond)) {
            const auto [volume, strain] = at_apex(norm, theta, alpha);
            d_theta                     = choose(beyond, volume, d_theta);
            d_alpha                     = choose(beyond, strain, d_alpha);
        }
        r.ratio   = choose(f, ratio, r.ratio);
        r.d_theta = choose(f, d_theta, r.d_theta);
        alpha += choose(f, d_alpha, T(0.0));
        return r;
    }
    /// lambda on the cone, for f of a trial state with cohesion c; where c would fall below zero, with zero.
    template <class T>
    ORDO_FLAT T on_cone(const T& f, const T& c) const
    {
        const double stiffness = elastic.shear + elastic.bulk * eta * eta_flow;
        const T lambda         = f * T(1 / (stiffness + xi * xi * hardening));
        const T left           = c + T(hardening * xi) * lambda;
        return choose(-1.0 * left, (f + T(xi) * c) * T(1 / stiffness), lambda);
    }
    /// Plastic volume strain and growth of alpha of a return to the apex, P = xi c/eta.
    template <class T>
    ORDO_FLAT std::pair<T, T> at_apex(const T& norm, const T& theta, const T& alpha) const
    {
        const double K = elastic.bulk, per_volume = eta_flow > 0 ? xi / eta_flow : 0.0, height = xi / eta;
        const T linear = T(cohesion) + T(hardening) * alpha, c = larger(linear, T(0.0));
        const T strain = eta_flow > 0 ? T(0.0) : T(xi * std::sqrt(2.0)) * norm;  // of the deviator, without dilation
        const T now    = larger(c + T(hardening) * strain, T(0.0));
        const T volume = (T(K) * theta - T(height) * now) * T(1 / (K + height * hardening * per_volume));
        const T gone   = c + T(hardening * per_volume) * volume;  // negative: no cohesion is left
        const T d      = choose(-1.0 * gone, theta, volume);
        return {d, T(per_volume) * d + strain};
    }
};
static_assert(Inelastic<DruckerPrager>);

}  // namespace ordo
