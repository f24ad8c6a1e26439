// Johnson-Cook plasticity, with Mie-Gruneisen's pressure for shocks.
#pragma once

#include "base/dual.hpp"
#include "material/elastic_state.hpp"

namespace ordo {

/// Pressure of a shocked solid (Mie-Gruneisen with a linear Hugoniot, U = c0 + s u):
/// p = rho0 c0^2 x (1 - G0 x/2)/(1 - s x)^2 + G0 E with x = 1 - J, linear in x for J > 1; E per initial volume.
struct MieGruneisen {
    double stiffness, slope, gruneisen;  ///< stiffness = rho0 c0^2, Pa

    /// The pressure without E. A template on the scalar for its derivative.
    template <class T>
    T cold(const T& J) const
    {
        const T x = T(1.0) - J;
        if (!(primal(x) > 0)) return T(stiffness) * x;
        const T left = T(1.0) - T(slope) * x;
        return T(stiffness) * x * (T(1.0) - T(gruneisen / 2) * x) / (left * left);
    }
    /// J^2 times the isentropic -dp/dJ = -cold' + G0 p: rho0 dp/drho.
    double tangent(double J, double p) const { return J * J * (gruneisen * p - cold(Dual<>(J, 1.0)).slope); }
};

/// f = q - Y in the Kirchhoff stress, Y = (A + B alpha^n)(1 + C ln max(1, alpha'/r0))(1 - T*^m), T* = (T - Tr)/(Tm - Tr) from 0
/// to 1; Johnson & Cook (1983). Heat: rho0 c dT = chi q dalpha. All at the end of the step, alpha' = lambda/dt. Elasticity is
/// Hencky's; with sound_speed, shock_slope and gruneisen the pressure is that of Mie and Gruneisen, and its internal energy grows
/// by the work of pressure (mean of the step) and of the deviator.
struct JohnsonCook {
    static constexpr std::string_view name = "johnson-cook",
                                      what = "Johnson-Cook plasticity with adiabatic heating (1983), Mie-Gruneisen pressure";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr bool keeps_volume     = true;
    static constexpr double not_given      = LawParameter::none;
    static constexpr std::array parameters{
        LawParameter{.name = "A", .unit = "Pa", .what = "yield stress at rest", .open_min = true},
        LawParameter{.name = "B", .unit = "Pa", .what = "factor of hardening"},
        LawParameter{.name = "n", .unit = "", .what = "exponent of hardening", .open_min = true},
        LawParameter{.name = "C", .unit = "", .what = "factor of the strain rate"},
        LawParameter{.name = "m", .unit = "", .what = "exponent of the temperature", .open_min = true},
        LawParameter{
            .name = "reference_rate", .unit = "1/s", .what = "strain rate below which the rate does not count", .open_min = true},
        LawParameter{.name = "reference_temperature", .unit = "K", .what = "temperature below which it does not soften"},
        LawParameter{
            .name = "temperature", .unit = "K", .what = "temperature at the start", .fallback_of = "reference_temperature"},
        LawParameter{.name = "melting_temperature", .unit = "K", .what = "temperature without strength"},
        LawParameter{.name = "specific_heat", .unit = "J/(kg K)", .what = "specific heat", .open_min = true},
        LawParameter{.name = "taylor_quinney", .unit = "", .what = "part of the plastic work that heats", .max = 1.0},
        LawParameter{.name     = "sound_speed",
                     .unit     = "m/s",
                     .what     = "c0 of the Hugoniot, for Mie-Gruneisen",
                     .fallback = not_given,
                     .open_min = true},
        LawParameter{.name = "shock_slope", .unit = "", .what = "slope s of the Hugoniot", .fallback = not_given},
        LawParameter{.name = "gruneisen", .unit = "", .what = "Gruneisen's number", .fallback = not_given}};
    static constexpr std::array history = with_elastic_columns(std::array{
        kPlasticStrain, kDissipated, HistoryColumn{"temperature", "temperature, K"},
        HistoryColumn{"internal_energy", "Mie-Gruneisen's energy without that of elastic shear, per initial volume, J/m^3"},
        HistoryColumn{"shock_pressure", "Mie-Gruneisen's pressure, Pa"},
        HistoryColumn{"viscous_heat", "heat of artificial viscosity in internal_energy, per initial volume, J/m^3"}});
    enum Parameter { kA, kB0, kN, kC, kM, kRate, kReference, kStart, kMelting, kHeat, kQuinney, kSound, kSlope, kGruneisen };
    enum Column { kAlpha, kWork, kTemperature, kEnergy, kPressure, kViscousHeat, kB };

    HenckyElasticity elastic;
    double A, B, n, C, m, rate, reference, at_start, melting, heating;  ///< heating = chi/(rho0 c), K m^3/J
    MieGruneisen shock;
    bool is_shocked;

    ORDO_FLAT static JohnsonCook of(const Material& given)
    {
        const auto& p = given.parameters;
        return {{given.bulk_modulus(), given.mu},
                p[kA],
                p[kB0],
                p[kN],
                p[kC],
                p[kM],
                p[kRate],
                p[kReference],
                p[kStart],
                p[kMelting],
                p[kQuinney] / (given.density * p[kHeat]),
                {given.density * p[kSound] * p[kSound], p[kSlope], p[kGruneisen]},
                p[kSound] != not_given};
    }
    static BadParameter check(const Material& given)
    {
        const auto& p = given.parameters;
        if (!(p[kMelting] > p[kReference])) return {"melting_temperature", "must be above reference_temperature"};
        if (!(p[kStart] < p[kMelting])) return {"temperature", "must be below melting_temperature"};
        const int count = (p[kSound] != not_given) + (p[kSlope] != not_given) + (p[kGruneisen] != not_given);
        if (count != 0 && count != 3)
            return {"model",
                    "johnson-cook needs all of sound_speed, shock_slope and gruneisen for Mie-Gruneisen's pressure, or none"};
        return {};
    }
    /// The bulk modulus at rest is that of the Hugoniot.
    static void complete(Material& given)
    {
        const double c0 = given.parameters[kSound];
        if (c0 != not_given) given.lambda = given.density * c0 * c0 - 2.0 / 3 * given.mu;
    }

    template <int D, class T>
    void start(const Mat<D, T>& F, T* h) const
    {
        h[kTemperature] = T(at_start);
        write_symmetric(left_cauchy_green(F), h + kB);
        if (is_shocked) compress(T(1.0), det(F), T(shear_energy(read_symmetric<D>(h + kB))), T(0.0), h);
    }
    template <int D, class T>
    Stress<D, T> stress(const Mat<D, T>& F, const T* h) const
    {
        HenckyStrain<D, T> e = hencky_strain(read_symmetric<D>(h + kB));
        if (is_shocked) return cauchy_of(T(2 * elastic.shear) * e.dev, F) + isotropic<D>(-1.0 * h[kPressure]);
        return cauchy_of(elastic.kirchhoff(e), F);
    }
    template <int D, class T>
    T energy(const Mat<D, T>&, const T* h) const
    {
        const Symmetric<D, T> b = read_symmetric<D>(h + kB);
        return is_shocked ? h[kEnergy] + shear_energy(b) - h[kWork] - h[kViscousHeat] : elastic.energy(hencky_strain(b));
    }
    template <int D, class T>
    Stress<D, T> update(const Step<D, T>& step, T* h, T& fault) const
    {
        const T dissipated = h[kWork];
        // Its own elasticity has no part in the pressure if that is Mie-Gruneisen's, and shear alone dissipates.
        const HenckyElasticity own{is_shocked ? 0.0 : elastic.bulk, elastic.shear};
        const Stress<D, T> sigma = step_radially(step, own, h + kB, h[kWork], [&](const HenckyStrain<D, T>& e) {
            const T q = T(std::sqrt(6.0) * elastic.shear) * sqrt(square(e.dev));
            RadialReturn<T> r{T(0.0), T(1.0), T(0.0)};
            for (int k = 0; k < lanes_of(q); ++k) return_one(step.dt, lane(q, k), k, h, r, fault);
            return r;
        });
        if (!is_shocked) return sigma;
        const T J      = det(step.F);
        const T before = J / det(Mat<D, T>::identity() + step.G);  // the volume ratio at the start of the step
        const T sound  = T(1.0) - T(shock.slope) * (T(1.0) - J);
        fault          = choose(sound, fault, T(1.0));
        const T heat   = step.q * (before - J);
        h[kViscousHeat] += heat;
        compress(before, J, shear_energy(read_symmetric<D>(h + kB)), h[kWork] - dissipated + heat, h);
        return sigma + isotropic<D>(-1.0 * h[kPressure]);
    }
    template <int D>
    Stiffness stiffness(const Mat<D>& F, const double* h) const
    {
        const double bulk = is_shocked ? shock.tangent(det(F), h[kPressure]) : elastic.bulk;
        return {std::fmax(bulk, 0.0) + 4.0 / 3 * elastic.shear, 0.0};
    }

  private:
    template <int D, class T>
    T shear_energy(const Symmetric<D, T>& b) const
    {
        return T(elastic.shear) * square(hencky_strain(b).dev);
    }
    /// Energy and pressure from J to `next`: E_next = E - (p + p_next)(next - J)/2 + plastic work, p_next = cold + G0 (E_next +
    /// energy of shear), which is linear in E_next.
    template <class T>
    void compress(const T& J, const T& next, const T& shear, const T& work, T* h) const
    {
        for (int k = 0; k < lanes_of(J); ++k) {
            const Lane<T> half = (lane(next, k) - lane(J, k)) / 2;
            const Lane<T> cold = shock.cold(lane(next, k)) + shock.gruneisen * lane(shear, k);
            const Lane<T> E =
                (lane(h[kEnergy], k) + lane(work, k) - (lane(h[kPressure], k) + cold) * half) / (1 + shock.gruneisen * half);
            set_lane(h[kEnergy], k, E);
            set_lane(h[kPressure], k, cold + shock.gruneisen * E);
        }
    }
    /// The return of lane k from a trial stress q.
    template <class T>
    void return_one(double dt, Lane<T> q, int k, T* h, RadialReturn<T>& r, T& fault) const
    {
        const Lane<T> alpha = lane(h[kAlpha], k), before = lane(h[kTemperature], k);
        const double f = primal(q) - (A + B * power(primal(alpha), n)) * softening(primal(before));
        if (!(f > 0)) return;
        bool is_solved       = true;
        const Lane<T> lambda = multiplier(q, alpha, before, dt, is_solved), rest = q - 3 * elastic.shear * lambda;
        if (!is_solved) set_lane(fault, k, 1.0);
        set_lane(r.plastic, k, 1.0);
        set_lane(r.ratio, k, rest / q);
        set_lane(h[kAlpha], k, alpha + lambda);
        set_lane(h[kTemperature], k, before + heating * rest * lambda);
    }
    template <class T>
    static T power(const T& a, double exponent)
    {
        return exp(T(exponent) * log(a));  // 0 for a = 0
    }
    /// 1 - T*^m.
    template <class T>
    T softening(const T& temperature) const
    {
        const T hot = (temperature - T(reference)) / T(melting - reference);
        if (!(primal(hot) > 0)) return T(1.0);
        return primal(hot) < 1 ? T(1.0) - power(hot, m) : T(0.0);
    }

    /// q - Y at the end of a step with multiplier lambda.
    template <class T, class S>
    T residual(const T& lambda, const S& q, const S& alpha, const S& before, double dt) const
    {
        const T rest = T(q) - T(3 * elastic.shear) * lambda;
        T factor(1.0);
        if (dt > 0 && primal(lambda) > rate * dt) factor += T(C) * log(lambda / T(rate * dt));
        return rest - (T(A) + T(B) * power(T(alpha) + lambda, n)) * factor * softening(T(before) + T(heating) * rest * lambda);
    }
    /// Its root: Newton's method where it stays in the bracket (0, q/3G), else bisection. The slope is infinite at alpha = 0.
    double multiplier(double q, double alpha, double before, double dt, bool& is_solved) const
    {
        constexpr int most = 200;
        double low = 0, high = q / (3 * elastic.shear), lambda = high / 2;
        for (int k = 0; k < most; ++k) {
            const Dual<> r    = residual(Dual<>(lambda, 1.0), q, alpha, before, dt);
            const double step = -r.value / r.slope;
            if (std::fabs(step) <= 1e-15 * lambda || std::fabs(r.value) <= 4e-16 * q) return lambda;
            (r.value > 0 ? low : high) = lambda;
            if (!(high - low > 1e-15 * high)) return lambda;
            const double next = lambda + step;
            lambda            = next > low && next < high ? next : (low + high) / 2;
        }
        is_solved = false;
        return lambda;
    }
    Dual<> multiplier(const Dual<>& q, const Dual<>& alpha, const Dual<>& before, double dt, bool& is_solved) const
    {
        const double lambda = multiplier(q.value, alpha.value, before.value, dt, is_solved);
        return as_root(lambda, residual(Dual<>(lambda), q, alpha, before, dt),
                       residual(Dual<>(lambda, 1.0), q.value, alpha.value, before.value, dt).slope);
    }
};
static_assert(Inelastic<JohnsonCook> && ChangesStiffness<JohnsonCook>);

}  // namespace ordo
