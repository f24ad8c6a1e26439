// What laws that carry the elastic left Cauchy-Green tensor b_e share: its history columns, Hencky's elasticity, and the return
// map of yield surfaces that are circles in the deviatoric plane.
#pragma once

#include "material/hencky.hpp"
#include "material/law.hpp"

namespace ordo {

/// The columns of b_e, which follow those of the law itself.
inline constexpr std::array kElasticColumns{HistoryColumn{"elastic_b_xx", "xx of the elastic left Cauchy-Green tensor", 1.0, 1},
                                            HistoryColumn{"elastic_b_yy", "yy of the elastic left Cauchy-Green tensor", 1.0, 1},
                                            HistoryColumn{"elastic_b_zz", "zz of the elastic left Cauchy-Green tensor", 1.0, 1},
                                            HistoryColumn{"elastic_b_xy", "xy of the elastic left Cauchy-Green tensor", 0.0, 2},
                                            HistoryColumn{"elastic_b_yz", "yz of the elastic left Cauchy-Green tensor", 0.0, 3},
                                            HistoryColumn{"elastic_b_zx", "zx of the elastic left Cauchy-Green tensor", 0.0, 3}};

inline constexpr HistoryColumn kPlasticStrain{"plastic_strain", "equivalent plastic strain"};
inline constexpr HistoryColumn kDissipated{"dissipated", "energy lost to heat per initial volume, J/m^3"};

/// Columns of a law, then those of b_e.
template <std::size_t N>
constexpr std::array<HistoryColumn, N + 6> with_elastic_columns(const std::array<HistoryColumn, N>& own)
{
    std::array<HistoryColumn, N + 6> r{};
    for (std::size_t k = 0; k < N + 6; ++k) r[k] = k < N ? own[k] : kElasticColumns[k - N];
    return r;
}

/// Hencky's elasticity: psi = K theta^2/2 + G |dev eps|^2 per initial volume, so that the Kirchhoff stress is
/// tau = K theta I + 2 G dev eps with the logarithmic elastic strain eps (Simo 1992, CMAME 99:61).
struct HenckyElasticity {
    double bulk, shear;  ///< Pa

    template <int D, class T>
    ORDO_FLAT Symmetric<D, T> kirchhoff(const HenckyStrain<D, T>& e) const
    {
        return T(2 * shear) * e.dev + isotropic<D>(T(bulk) * e.theta);
    }
    /// The elastic strain of a Kirchhoff stress.
    template <int D>
    HenckyStrain<D> strain(const Symmetric<D>& tau) const
    {
        return {trace(tau) / (3 * bulk), deviator(tau) * (1 / (2 * shear))};
    }
    template <int D, class T>
    ORDO_FLAT T energy(const HenckyStrain<D, T>& e) const
    {
        return T(bulk / 2) * e.theta * e.theta + T(shear) * square(e.dev);
    }
};

/// sigma = tau/J.
template <int D, class T>
ORDO_FLAT inline Stress<D, T> cauchy_of(const Symmetric<D, T>& tau, const Mat<D, T>& F)
{
    return tau * (T(1.0) / det(F));
}

/// How a return map changes a trial strain: dev eps = ratio dev eps_tr, theta = theta_tr + closing - d_theta.
template <class T>
struct RadialReturn {
    T plastic;         ///< positive where the strain changes
    T ratio, d_theta;  ///< plastic flow
    T closing{};       ///< of gaps, without stress
};

/// The step of a law with `elastic` and a return map `map(trial strain) -> RadialReturn`. b_e is at `b`, the sum of what is
/// dissipated at `dissipated`. Backward Euler with the exponential map: b_e = exp(-lambda N) b_tr exp(-lambda N), so the
/// logarithmic strains obey the return map of small strains (Simo 1992; de Souza Neto, Peric & Owen 2008, ch. 14). What is
/// dissipated is tau : (eps_tr - eps), at the end of the step.
template <int D, class T, class Elastic, class Map>
ORDO_FLAT inline Stress<D, T> step_radially(const Step<D, T>& step, const Elastic& elastic, T* b, T& dissipated, Map&& map)
{
    const Symmetric<D, T> trial    = pushed(step.G, read_symmetric<D>(b));
    const HenckyStrain<D, T> start = hencky_strain(trial);
    const RadialReturn<T> r        = map(start);
    HenckyStrain<D, T> end         = start;
    if (any_positive(r.plastic)) {
        end = {start.theta + r.closing - r.d_theta, r.ratio * start.dev};
        write_symmetric(choose(r.plastic, stretched(end), trial), b);
        const Symmetric<D, T> tau = elastic.kirchhoff(end);
        const T work              = (T(1.0) - r.ratio) * ddot(tau, start.dev) + trace(tau) * T(1.0 / 3) * r.d_theta;
        dissipated += choose(r.plastic, work, T(0.0));
        return cauchy_of(tau, step.F);
    }
    write_symmetric(trial, b);
    return cauchy_of(elastic.kirchhoff(end), step.F);
}

/// The same for a return map in principal axes, `map(trial tau[3], tau[3])`, which sets tau where the state yields and returns a
/// number that is positive there. Values D, .. are those across the problem.
template <int D, class T, class Map>
ORDO_FLAT inline Stress<D, T> step_principally(const Step<D, T>& step, const HenckyElasticity& elastic, T* b, T& dissipated,
                                               Map&& map)
{
    const Symmetric<D, T> trial = pushed(step.G, read_symmetric<D>(b));
    const Spectrum<D, T> s      = positive_spectrum(trial);
    T e[3];
    for (int a = 0; a < 3; ++a) e[a] = T(0.5) * log(s.value[a]);
    const T theta = e[0] + e[1] + e[2];
    T start[3], tau[3];
    for (int a = 0; a < 3; ++a)
        tau[a] = start[a] = T(2 * elastic.shear) * e[a] + T(elastic.bulk - 2.0 / 3 * elastic.shear) * theta;
    const T plastic = map(start, tau);
    if (!any_positive(plastic)) {
        write_symmetric(trial, b);
        return cauchy_of(compose(tau, s.axes), step.F);
    }
    T work(0.0), value[3];
    const T mean = (start[0] + start[1] + start[2] - tau[0] - tau[1] - tau[2]) * T(1.0 / 3);
    for (int a = 0; a < 3; ++a) {  // plastic strains: C^-1 : (tau_tr - tau)
        const T strain = T(1 / (2 * elastic.shear)) * (start[a] - tau[a] - mean) + T(1 / (3 * elastic.bulk)) * mean;
        work += tau[a] * strain;
        value[a] = exp(T(2.0) * (e[a] - strain));
    }
    dissipated += choose(plastic, work, T(0.0));
    write_symmetric(choose(plastic, compose(value, s.axes), trial), b);
    return cauchy_of(compose(tau, s.axes), step.F);
}

/// Particles of a scalar, and the number of one of them, double or Dual<double>: for maps with branches, which take one particle
/// after another.
ORDO_FLAT inline int lanes_of(double) { return 1; }
ORDO_FLAT inline int lanes_of(const Lanes&) { return 8; }
ORDO_FLAT inline double lane(double a, int) { return a; }
ORDO_FLAT inline double lane(const Lanes& a, int k) { return a[k]; }
ORDO_FLAT inline void set_lane(double& a, int, double value) { a = value; }
ORDO_FLAT inline void set_lane(Lanes& a, int k, double value) { a[k] = value; }
template <class T>
ORDO_FLAT inline int lanes_of(const Dual<T>& a)
{
    return lanes_of(a.value);
}
template <class T>
ORDO_FLAT inline Dual<> lane(const Dual<T>& a, int k)
{
    return {lane(a.value, k), lane(a.slope, k)};
}
template <class T>
ORDO_FLAT inline void set_lane(Dual<T>& a, int k, const Dual<>& value)
{
    set_lane(a.value, k, value.value);
    set_lane(a.slope, k, value.slope);
}
template <class T>
using Lane = decltype(lane(T(0.0), 0));

}  // namespace ordo
