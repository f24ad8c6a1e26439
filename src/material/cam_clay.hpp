// Modified Cam-Clay.
#pragma once

#include "base/dual.hpp"
#include "material/elastic_state.hpp"

namespace ordo {

/// p = pr exp(-theta/kappa), s = 2 G dev eps: psi = pr kappa exp(-theta/kappa) + G |dev eps|^2 (Borja & Tamagnini 1998, CMAME
/// 155:73, with a constant shear modulus). p = -tr(tau)/3 is positive in compression and pr where b_e = I.
struct CamClayElasticity {
    double reference, kappa, shear;  ///< Pa, 1, Pa

    template <class T>
    ORDO_FLAT T pressure(const T& theta) const
    {
        return T(reference) * exp(theta * T(-1 / kappa));
    }
    template <int D, class T>
    ORDO_FLAT Symmetric<D, T> kirchhoff(const HenckyStrain<D, T>& e) const
    {
        return T(2 * shear) * e.dev + isotropic<D>(-1.0 * pressure(e.theta));
    }
    /// The elastic strain of a Kirchhoff stress in compression.
    template <int D>
    HenckyStrain<D> strain(const Symmetric<D>& tau) const
    {
        return {-kappa * std::log(-trace(tau) / (3 * reference)), deviator(tau) * (1 / (2 * shear))};
    }
    template <int D, class T>
    ORDO_FLAT T energy(const HenckyStrain<D, T>& e) const
    {
        return T(kappa) * pressure(e.theta) + T(shear) * square(e.dev);
    }
};

/// f = q^2/M^2 + p (p - pc) in the Kirchhoff stress, associated, d ln pc = -d eps_v^p/(lambda - kappa) (Roscoe & Burland 1968;
/// kappa and lambda are slopes of ln J over ln p, Butterfield 1979). Elasticity conserves energy.
struct CamClay {
    static constexpr std::string_view name = "cam-clay", what = "modified Cam-Clay, finite strain (Borja & Tamagnini 1998)";
    static constexpr Elasticity elasticity = Elasticity::shear;
    static constexpr int max_dim           = 3;
    static constexpr bool keeps_volume     = true;
    static constexpr std::array parameters{
        LawParameter{
            .name = "swelling_index", .unit = "", .what = "kappa, slope of ln J over ln p in unloading", .open_min = true},
        LawParameter{.name     = "compression_index",
                     .unit     = "",
                     .what     = "lambda, slope of ln J over ln p of normal compression",
                     .open_min = true},
        LawParameter{.name = "critical_slope", .unit = "", .what = "M, q/p of critical states", .open_min = true},
        LawParameter{
            .name = "reference_pressure", .unit = "Pa", .what = "pressure at the start, without deformation", .open_min = true},
        LawParameter{.name     = "preconsolidation",
                     .unit     = "Pa",
                     .what     = "largest pressure so far, the size of the yield surface",
                     .open_min = true}};
    static constexpr HistoryColumn kSize{"preconsolidation", "pressure at the end of the yield surface, Pa"};
    static constexpr std::array history = with_elastic_columns(std::array{kPlasticStrain, kDissipated, kSize});
    enum Column { kAlpha, kWork, kPc, kB };

    CamClayElasticity elastic;
    double hardening, slope, start_pc;  ///< lambda - kappa, M, Pa

    ORDO_FLAT static CamClay of(const Material& m)
    {
        const auto& p = m.parameters;
        return {{p[3], p[0], m.mu}, p[1] - p[0], p[2], p[4]};
    }
    static BadParameter check(const Material& m)
    {
        const auto& p = m.parameters;
        if (!(p[1] > p[0])) return {"compression_index", "must be above swelling_index"};
        if (!(p[4] >= p[3]))
            return {"preconsolidation", "must be at least reference_pressure: else the start is outside the yield surface"};
        return {};
    }
    static void complete(Material& m) { m.lambda = m.parameters[3] / m.parameters[0] - 2.0 / 3 * m.mu; }

    template <int D, class T>
    void start(const Mat<D, T>& F, T* h) const
    {
        h[kPc] = T(start_pc);
        write_symmetric(left_cauchy_green(F), h + kB);
    }
    template <int D, class T>
    Stress<D, T> stress(const Mat<D, T>& F, const T* h) const
    {
        return cauchy_of(elastic.kirchhoff(hencky_strain(read_symmetric<D>(h + kB))), F);
    }
    template <int D, class T>
    T energy(const Mat<D, T>&, const T* h) const
    {
        return elastic.energy(hencky_strain(read_symmetric<D>(h + kB)));
    }
    template <int D, class T>
    Stress<D, T> update(const Step<D, T>& step, T* h, T& fault) const
    {
        return step_radially(step, elastic, h + kB, h[kWork], [&](const HenckyStrain<D, T>& e) {
            const T norm = sqrt(square(e.dev)), q = T(std::sqrt(6.0) * elastic.shear) * norm, p = elastic.pressure(e.theta);
            RadialReturn<T> r{q * q * T(1 / (slope * slope)) + p * (p - h[kPc]), T(1.0), T(0.0)};
            for (int k = 0; k < lanes_of(q) && any_positive(r.plastic); ++k) {
                if (!(primal(lane(r.plastic, k)) > 0)) continue;
                const Return<Lane<T>> one = returned(lane(q, k), lane(e.theta, k), lane(h[kPc], k));
                if (!one.is_solved) set_lane(fault, k, 1.0);
                set_lane(r.ratio, k, one.ratio);
                set_lane(r.d_theta, k, one.volume);
                set_lane(h[kPc], k, one.pc);
                set_lane(h[kAlpha], k, lane(h[kAlpha], k) + std::sqrt(2.0 / 3) * (1 - one.ratio) * lane(norm, k));
            }
            return r;
        });
    }
    /// K_t = p/kappa, not below that of the start: in the next step the pressure may rise.
    template <int D>
    Stiffness stiffness(const Mat<D>&, const double* h) const
    {
        const double p = elastic.pressure(hencky_strain(read_symmetric<D>(h + kB)).theta);
        return {std::fmax(p, elastic.reference) / elastic.kappa + 4.0 / 3 * elastic.shear, 0.0};
    }

  private:
    template <class S>
    struct Return {
        S ratio, volume, pc;  ///< of dev eps; plastic volume strain; Pa
        bool is_solved;
        S multiplier{};
    };
    /// The yield function of a step, as a function of its plastic multiplier. S is double or Dual<double>.
    template <class S>
    struct Residual {
        const CamClay& law;
        S q, theta, pc;  ///< trial q and theta, pc before the step

        template <class T>
        T size(const T& x) const
        {
            return T(pc) * exp(x * T(-1 / law.hardening));
        }
        /// x - Lambda (pc - 2 p) of a plastic volume strain x; grows with x.
        template <class T>
        T volume_residual(const T& x, const T& multiplier) const
        {
            return x - multiplier * (size(x) - T(2.0) * law.elastic.pressure(T(theta) - x));
        }
        template <class T>
        T ratio(const T& multiplier) const
        {
            return T(1.0) / (T(1.0) + T(6 * law.elastic.shear / (law.slope * law.slope)) * multiplier);
        }
        /// The plastic volume strain of a multiplier, by Newton's method with a bracket: between 0 and its sign's bound.
        double volume(double multiplier) const
        {
            double x = 0, low = -LawParameter::none, high = LawParameter::none;
            for (int k = 0; k < kMost; ++k) {
                const Dual<> r             = volume_residual(Dual<>(x, 1.0), Dual<>(multiplier));
                (r.value > 0 ? high : low) = x;
                const double step          = -r.value / r.slope;
                if (std::fabs(step) <= 1e-16 + 1e-15 * (std::fabs(x) + multiplier * pc)) return x;
                x = inside(x + step, x, low, high);
            }
            return x;
        }
        /// Of f/pc^2, from the size of its terms: small steps from the yield surface leave little more.
        double rounding(double x) const
        {
            const double p = law.elastic.pressure(theta - x) / pc;
            return 4e-16 * (p * p + p);
        }
        /// f/pc^2.
        template <class T>
        T yield(const T& x, const T& multiplier) const
        {
            const T p = law.elastic.pressure(T(theta) - x), now = T(q / law.slope) * ratio(multiplier);
            return (now * now + p * (p - size(x))) / T(pc * pc);
        }
        /// f/pc^2 with its derivative: one more step of Newton's method, in dual numbers, gives that of the volume strain.
        Dual<> operator()(double multiplier, double& x) const
        {
            x = volume(multiplier);
            const Dual<> m(multiplier, 1.0);
            const double slope_x = volume_residual(Dual<>(x, 1.0), Dual<>(multiplier)).slope;
            return yield(Dual<>(x) - volume_residual(Dual<>(x), m) / Dual<>(slope_x), m);
        }
    };
    static constexpr int kMost = 200;

    /// The next iterate, or, if it is outside of the bracket, the middle of that; twice as far where the bracket has no end.
    static double inside(double next, double now, double low, double high)
    {
        if (next > low && next < high) return next;
        const bool has_both = std::isfinite(low) && std::isfinite(high);
        return has_both ? (low + high) / 2 : std::isfinite(low) ? 2 * now + 1e-12 : 2 * now - 1e-12;
    }
    /// The first root in Lambda from zero, where f is positive; f is negative for a large Lambda.
    ORDO_CALL Return<double> returned(double q, double theta, double pc) const
    {
        const Residual<double> residual{*this, q, theta, pc};
        double multiplier = 0, low = 0, high = LawParameter::none, x = 0;
        for (int k = 0; k < kMost; ++k) {
            const Dual<> f       = residual(multiplier, x);
            const double step    = -f.value / f.slope;
            const bool is_closed = high < LawParameter::none && !(high - low > 1e-15 * high);
            if (std::fabs(f.value) <= residual.rounding(x) || is_closed || (k > 0 && std::fabs(step) <= 1e-15 * multiplier))
                return {residual.ratio(multiplier), x, residual.size(x), std::isfinite(f.value), multiplier};
            (f.value > 0 ? low : high) = multiplier;
            multiplier                 = inside(multiplier + step, multiplier, low, high);
        }
        return {residual.ratio(multiplier), x, residual.size(x), false};
    }
    /// The same with slopes: those of the plastic volume strain, first at a constant Lambda, and of Lambda keep both residuals.
    ORDO_CALL Return<Dual<>> returned(const Dual<>& q, const Dual<>& theta, const Dual<>& pc) const
    {
        const Return<double> at = returned(q.value, theta.value, pc.value);
        const Residual<double> plain{*this, q.value, theta.value, pc.value};
        const Residual<Dual<>> moving{*this, q, theta, pc};
        double x            = 0;
        const double by_m   = plain(at.multiplier, x).slope;
        const double by_x   = plain.volume_residual(Dual<>(x, 1.0), Dual<>(at.multiplier)).slope;
        auto strain         = [&](const Dual<>& m) { return as_root(x, moving.volume_residual(Dual<>(x), m), by_x); };
        const Dual<> fixed  = at.multiplier;
        const Dual<> m      = as_root(at.multiplier, moving.yield(strain(fixed), fixed), by_m);
        const Dual<> volume = strain(m);
        return {moving.ratio(m), volume, moving.size(volume), at.is_solved, m};
    }
};
static_assert(Inelastic<CamClay> && ChangesStiffness<CamClay>);

}  // namespace ordo
