// Dry grains that flow: the mu(I) rheology.
#pragma once

#include "material/elastic_state.hpp"

namespace ordo {

/// Hencky's elasticity of grains that touch; those that are apart (theta > 0) carry no stress and store no energy.
struct GrainElasticity {
    double bulk, shear;  ///< Pa

    template <int D, class T>
    ORDO_FLAT Symmetric<D, T> kirchhoff(const HenckyStrain<D, T>& e) const
    {
        return choose(e.theta, T(0.0), T(2 * shear)) * e.dev + isotropic<D>(T(bulk) * smaller(e.theta, T(0.0)));
    }
    template <int D>
    HenckyStrain<D> strain(const Symmetric<D>& tau) const
    {
        return HenckyElasticity{bulk, shear}.strain(tau);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const HenckyStrain<D, T>& e) const
    {
        const T theta = smaller(e.theta, T(0.0));
        return T(bulk / 2) * theta * theta + choose(e.theta, T(0.0), T(shear)) * square(e.dev);
    }
};

/// t = sqrt(J2) <= mu(I) p, mu = mu_s + (mu_2 - mu_s)/(I0/I + 1), I = rate d sqrt(rho_s/p) (Jop, Forterre & Pouliquen 2006),
/// without dilation, in the Kirchhoff stress. The implicit step is a quadratic equation for t (Dunatunga & Kamrin 2015, JFM
/// 779:483): with rate = (t_tr - t)/(G dt), (t - mu_s p)(a + t_tr - t) = (mu_2 - mu_s) p (t_tr - t), a = I0 G dt sqrt(p/rho_s)/d.
/// Grains that are apart lose the deviator of b_e and keep its volume, so they touch again where they parted.
struct MuI {
    static constexpr std::string_view name = "mu-i",
                                      what = "dry grains, mu(I) rheology (Jop et al. 2006; Dunatunga & Kamrin 2015)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr bool keeps_volume     = true;
    static constexpr std::array parameters{
        LawParameter{.name = "friction_static", .unit = "", .what = "mu_s, friction at rest", .open_min = true},
        LawParameter{.name = "friction_dynamic", .unit = "", .what = "mu_2, friction of fast flow", .open_min = true},
        LawParameter{.name = "inertial_number", .unit = "", .what = "I0, at which friction is half way", .open_min = true},
        LawParameter{.name = "grain_diameter", .unit = "m", .what = "diameter of the grains", .open_min = true},
        LawParameter{.name = "grain_density", .unit = "kg/m^3", .what = "density of the grains themselves", .open_min = true}};
    static constexpr std::array history = with_elastic_columns(std::array{kPlasticStrain, kDissipated});
    enum Column { kAlpha, kWork, kB };

    GrainElasticity elastic;
    double slow, fast, time;  ///< mu_s, mu_2, d sqrt(rho_s)/I0 in s sqrt(Pa)

    ORDO_FLAT static MuI of(const Material& m)
    {
        const auto& p = m.parameters;
        return {{m.bulk_modulus(), m.mu}, p[0], p[1], p[3] * std::sqrt(p[4]) / p[2]};
    }
    static BadParameter check(const Material& m)
    {
        if (m.parameters[1] < m.parameters[0]) return {"friction_dynamic", "must be at least friction_static"};
        return {};
    }

    /// Grains that are apart at the start keep the volume of F alone, as those that part.
    template <int D, class T>
    ORDO_FLAT void start(const Mat<D, T>& F, T* h) const
    {
        const Symmetric<D, T> b = left_cauchy_green(F);
        const T theta           = hencky_strain(b).theta;
        write_symmetric(choose(theta, isotropic<D>(exp(theta * T(2.0 / 3))), b), h + kB);
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
            const T norm = sqrt(square(e.dev)), trial = T(std::sqrt(2.0) * elastic.shear) * norm;
            const T p    = T(-elastic.bulk) * smaller(e.theta, T(0.0));
            const T f    = trial - T(slow) * p;
            const T ends = T(slow) * p, most = T(fast) * p, a = T(elastic.shear * step.dt / time) * sqrt(p);
            const T B = trial + most + a, H = trial * most + a * ends;
            const T t     = T(2.0) * H / (B + sqrt(larger(B * B - T(4.0) * H, T(0.0))));
            const T ratio = choose(f, t / trial, T(1.0));
            h[kAlpha] += choose(f, T(std::sqrt(2.0 / 3)) * (T(1.0) - ratio) * norm, T(0.0));
            return RadialReturn<T>{f, ratio, T(0.0)};
        });
    }
};
static_assert(Inelastic<MuI>);

}  // namespace ordo
