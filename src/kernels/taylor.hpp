// Taylor least squares (Wobbes et al. 2020, sec. 2): a polynomial per cell from the samples inside, with a prescribed integral.
#pragma once

#include "kernels/moments.hpp"

namespace ordo {

/// The mean over a cell of a product of powers of the distance from its centre, in cells.
template <int D>
ORDO_HD constexpr double cell_mean(const Index<D>& power)
{
    double r = 1.0;
    for (int a = 0; a < D; ++a)
        for (int e = 1; e <= power[a]; ++e) r *= 0.5;
    for (int a = 0; a < D; ++a) r *= power[a] % 2 ? 0.0 : 1.0 / (power[a] + 1);
    return r;
}

/// Fits to the samples of one cell, from their moments about its centre (weights 1). The Taylor functions are the monomials
/// minus their means over the cell, so all but the first integrate to zero.
template <int D, int degree, int fields>
class TaylorLeastSquares {
  public:
    using M                       = Moments<D, degree, fields>;
    static constexpr int unknowns = M::unknowns;
    static constexpr int others   = unknowns > 1 ? unknowns - 1 : 1;
    using Coefficients            = double[unknowns];  ///< of the monomials of (x - centre)/h

    ORDO_HD explicit TaylorLeastSquares(const Lanes* record)
        : record_(record), plain_(moment_matrix(record)), kept_(reduced(record))
    {}

    /// The least-squares fit of a field without a constraint on its integral (eq. 7).
    ORDO_HD void fit(int field, Coefficients& c) const
    {
        M::right_side(record_, field, c);
        plain_.solve(c);
    }

    /// The fit whose mean over the cell is `mean` (eq. 5): the other functions are fitted to the values minus that mean.
    ORDO_HD void fit_with_mean(int field, double mean, Coefficients& c) const
    {
        double b[unknowns], a[others]{};
        M::right_side(record_, field, b);
        for (int j = 1; j < unknowns; ++j) {
            const double m = mean_of(j);
            a[j - 1]       = b[j] - m * b[0] - mean * (M::get(record_, j) - m * M::get(record_, 0));
        }
        kept_.solve(a);
        c[0] = mean;
        for (int j = 1; j < unknowns; ++j) {
            c[j] = a[j - 1];
            c[0] -= a[j - 1] * mean_of(j);
        }
    }

    /// The number of functions that the samples do not determine; their coefficients are zero.
    ORDO_HD int dropped() const { return plain_.dropped; }
    ORDO_HD int dropped_with_mean() const { return unknowns > 1 ? kept_.dropped : 0; }

    /// A fit at a distance from the centre of the cell, in cells.
    ORDO_HD static double evaluate(const Coefficients& c, const Vec<D>& distance)
    {
        double p[unknowns], sum = 0.0;
        Monomials<D, degree>::evaluate(distance, p);
        for (int k = 0; k < unknowns; ++k) sum += c[k] * p[k];
        return sum;
    }

  private:
    ORDO_HD static double mean_of(int j)
    {
        constexpr Monomials<D, degree> all;
        return cell_mean(all.exponent[j]);
    }

    ORDO_HD static Ldl<unknowns> moment_matrix(const Lanes* record)
    {
        double m[unknowns][unknowns];
        M::matrix(record, m);
        return Ldl<unknowns>(m);
    }
    ORDO_HD static Ldl<others> reduced(const Lanes* record)
    {
        double m[unknowns][unknowns], r[others][others]{};
        M::matrix(record, m);
        for (int i = 1; i < unknowns; ++i)
            for (int j = 1; j <= i; ++j)
                r[i - 1][j - 1] = m[i][j] - mean_of(i) * m[j][0] - mean_of(j) * m[i][0] + mean_of(i) * mean_of(j) * m[0][0];
        return Ldl<others>(r);
    }

    const Lanes* record_;
    Ldl<unknowns> plain_;
    Ldl<others> kept_;
};

/// The distance from the centre of a cell, in cells, of Gauss point k of 2^D. All have the weight |cell|/2^D; exact for cubics.
template <int D>
ORDO_HD inline Vec<D> gauss_point(int k)
{
    constexpr double g = 0.28867513459481288;  // sqrt(3)/6
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = k >> a & 1 ? g : -g;
    return r;
}

}  // namespace ordo
