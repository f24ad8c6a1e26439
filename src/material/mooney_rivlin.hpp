// Rubber: the law of Mooney and Rivlin.
#pragma once

#include "material/hencky.hpp"
#include "material/law.hpp"

namespace ordo {

/// psi = c10 (I1 - 3) + c01 (I2 - 3) + K (ln J)^2/2 with the invariants of the isochoric J^(-2/3) b, so
/// tau = dev(2 (c10 + c01 I1) b - 2 c01 b^2) + K ln J I. Mooney (1940), Rivlin (1948).
struct MooneyRivlin {
    static constexpr std::string_view name = "mooney-rivlin", what = "c10 (I1 - 3) + c01 (I2 - 3) + K (ln J)^2/2 (Rivlin 1948)";
    static constexpr Elasticity elasticity = Elasticity::bulk;
    static constexpr int max_dim           = 3;
    static constexpr std::array parameters{
        LawParameter{.name = "c10", .unit = "Pa", .what = "factor of the first invariant", .open_min = true},
        LawParameter{.name = "c01", .unit = "Pa", .what = "factor of the second invariant"}};
    static constexpr NoHistory history{};

    double bulk, c10, c01;

    ORDO_FLAT static MooneyRivlin of(const Material& m) { return {m.bulk_modulus(), m.parameters[0], m.parameters[1]}; }
    /// The bulk modulus was in the place of lambda.
    static void complete(Material& m)
    {
        m.mu = 2 * (m.parameters[0] + m.parameters[1]);
        m.lambda -= 2.0 / 3 * m.mu;
    }

    template <int D, class T>
    ORDO_FLAT Stress<D, T> cauchy(const Mat<D, T>& F) const
    {
        const T J = det(F), volume = log(J);
        const Symmetric<D, T> b = left_cauchy_green(F) * exp(T(-2.0 / 3) * volume);
        const Symmetric<D, T> s = T(2.0) * (T(c10) + T(c01) * trace(b)) * b + T(-2 * c01) * coaxial_product(b, b);
        return (deviator(s) + isotropic<D>(T(bulk) * volume)) * (T(1.0) / J);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>& F) const
    {
        const T volume          = log(det(F));
        const Symmetric<D, T> b = left_cauchy_green(F) * exp(T(-2.0 / 3) * volume);
        const T first = trace(b), second = T(0.5) * (first * first - square(b));
        return T(c10) * (first - T(3.0)) + T(c01) * (second - T(3.0)) + T(bulk / 2) * volume * volume;
    }
    /// At large stretch rubber stiffens: K + 4/3 of the shear modulus of the stiffest axis, as Ogden's law with exponents 2 and
    /// -2.
    template <int D>
    Stiffness stiffness(const Mat<D>& F, const double*) const
    {
        const Spectrum<D> s = positive_spectrum(left_cauchy_green(F));
        const double scale  = std::exp(-2.0 / 3 * std::log(det(F)));
        double stiffest     = c10 + c01;
        for (const double value : s.value) stiffest = std::fmax(stiffest, c10 * value * scale + c01 / (value * scale));
        return {bulk + 8.0 / 3 * stiffest, 0.0};
    }
};
static_assert(Hyperelastic<MooneyRivlin> && ChangesStiffness<MooneyRivlin>);

}  // namespace ordo
