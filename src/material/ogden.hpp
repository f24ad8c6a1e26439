// Rubber: Ogden's law.
#pragma once

#include "material/hencky.hpp"
#include "material/law.hpp"

#include <type_traits>

namespace ordo {

/// (a^e - b^e)/(a - b) of positive numbers, also where they are close: then e m^(e-1) with their mean m and its next term.
template <class P>
ORDO_FLAT inline P divided_power(const P& a, const P& b, double e)
{
    const P mean = P(0.5) * (a + b), gap = a - b, part = gap / mean, close = P(1e-3) - fabs(part);
    const P series = P(e) * exp(P(e - 1) * log(mean)) * (P(1.0) + P((e - 1) * (e - 2) / 24) * part * part);
    const P direct = (exp(P(e) * log(a)) - exp(P(e) * log(b))) / choose(close, P(1.0), gap);
    return choose(close, series, direct);
}

/// b^e of a symmetric tensor with positive values. Axes are those of the numbers without derivatives; in these axes derivatives
/// of off-diagonal components count by divided differences (Daleckii & Krein 1965), also where values are equal. So first
/// derivatives are right, higher ones are not.
template <int D, class T>
ORDO_FLAT inline Symmetric<D, T> power(const Symmetric<D, T>& b, double e)
{
    using P = decltype(primal(b.c[0]));
    Symmetric<D, P> numbers{};
    for (int k = 0; k < b.size; ++k) numbers.c[k] = primal(b.c[k]);
    const Spectrum<D, P> s = positive_spectrum(numbers);
    if constexpr (std::is_same_v<P, T>) {
        T value[3];
        for (int a = 0; a < 3; ++a) value[a] = exp(T(e) * log(s.value[a]));
        return compose(value, s.axes);
    } else {
        Mat<D, T> axes{};
        for (int a = 0; a < D; ++a)
            for (int i = 0; i < D; ++i) axes(i, a) = without_slope<T>(s.axes(i, a));
        Mat<D, T> m = transpose(axes) * in_plane(b) * axes;
        for (int a = 0; a < D; ++a)
            for (int c = 0; c < D; ++c)
                if (a != c) m(a, c) = m(a, c) * without_slope<T>(divided_power(s.value[a], s.value[c], e));
        for (int a = 0; a < D; ++a) m(a, a) = exp(T(e) * log(m(a, a)));
        Symmetric<D, T> r = make_stress(axes * m * transpose(axes), T(1.0));
        for (int a = D; a < 3; ++a) r(a, a) = exp(T(e) * log(b(a, a)));
        return r;
    }
}

/// psi = sum mu_k/a_k (l_1^a_k + l_2^a_k + l_3^a_k - 3) + K (ln J)^2/2 with the isochoric stretches l = J^(-1/3) stretch; so
/// tau = sum mu_k dev(l^a_k) + K ln J I. Ogden (1972), with the volumetric part of Simo & Miehe (1992).
struct Ogden {
    static constexpr std::string_view name = "ogden",
                                      what = "sum mu_k/a_k (l1^a_k + l2^a_k + l3^a_k - 3) + K (ln J)^2/2 (Ogden 1972)";
    static constexpr Elasticity elasticity = Elasticity::bulk;
    static constexpr int max_dim           = 3;
    static constexpr int most              = 4;
    static constexpr std::array parameters{
        LawParameter{
            .name = "moduli", .unit = "Pa", .what = "mu_k, up to 4", .min = -1e300, .kind = ParameterKind::numbers, .most = most},
        LawParameter{.name = "exponents",
                     .unit = "",
                     .what = "a_k, as many",
                     .min  = -20.0,
                     .max  = 20.0,
                     .kind = ParameterKind::numbers,
                     .most = most}};
    static constexpr NoHistory history{};

    double bulk;
    double modulus[most], exponent[most];
    int count;

    ORDO_FLAT static Ogden of(const Material& m)
    {
        Ogden law{m.bulk_modulus(), {}, {}, 0};
        for (; law.count < most && m.parameters[law.count] < LawParameter::none; ++law.count) {
            law.modulus[law.count]  = m.parameters[law.count];
            law.exponent[law.count] = m.parameters[most + law.count];
        }
        return law;
    }
    static BadParameter check(const Material& m)
    {
        const Ogden law = of(m);
        int exponents   = 0;
        while (exponents < most && m.parameters[most + exponents] < LawParameter::none) ++exponents;
        if (exponents != law.count) return {"exponents", "must be as many as moduli"};
        for (int k = 0; k < law.count; ++k)
            if (law.exponent[k] == 0) return {"exponents", "must not be zero"};
        if (!(law.shear() > 0)) return {"moduli", "times exponents must have a positive sum, twice the shear modulus at rest"};
        return {};
    }
    /// The bulk modulus was in the place of lambda.
    static void complete(Material& m)
    {
        const double K = m.lambda;
        m.mu           = of(m).shear();
        m.lambda       = K - 2.0 / 3 * m.mu;
    }

    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F) const
    {
        const Symmetric<D, T> b = left_cauchy_green(F);
        const T J = det(F), volume = log(J);
        Stress<D, T> tau = isotropic<D>(T(bulk) * volume);
        for (int k = 0; k < count; ++k)
            tau += T(modulus[k]) * exp(T(-exponent[k] / 3) * volume) * deviator(power(b, exponent[k] / 2));
        return tau * (T(1.0) / J);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const Symmetric<D, T> b = left_cauchy_green(F);
        const T volume          = log(det(F));
        T psi                   = T(bulk / 2) * volume * volume;
        for (int k = 0; k < count; ++k)
            psi += T(modulus[k] / exponent[k]) * (exp(T(-exponent[k] / 3) * volume) * trace(power(b, exponent[k] / 2)) - T(3.0));
        return psi;
    }
    /// At large stretch rubber stiffens: K + 4/3 of the shear modulus of the stiffest axis.
    template <int D>
    Stiffness stiffness(const Mat<D>& F, const double*) const
    {
        const Spectrum<D> s = positive_spectrum(left_cauchy_green(F));
        const double volume = std::log(det(F));
        double stiffest     = 0;
        for (const double value : s.value) {
            double along = 0;
            for (int k = 0; k < count; ++k)
                along += modulus[k] * exponent[k] / 2 * std::exp(exponent[k] * (0.5 * std::log(value) - volume / 3));
            stiffest = std::fmax(stiffest, along);
        }
        return {bulk + 4.0 / 3 * std::fmax(stiffest, shear()), 0.0};
    }

  private:
    /// G = sum mu_k a_k/2.
    double shear() const
    {
        double r = 0;
        for (int k = 0; k < count; ++k) r += modulus[k] * exponent[k] / 2;
        return r;
    }
};
static_assert(Hyperelastic<Ogden> && ChangesStiffness<Ogden>);

}  // namespace ordo
