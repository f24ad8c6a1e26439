// Small symmetric systems of least squares: LDL^T that drops pivots which the samples do not determine.
#pragma once

#include "base/vec.hpp"

namespace ordo {

/// L D L^T = M for a positive semi-definite M of N unknowns. Pivot j is dropped, with its column of L, if D_j <= tolerance M_jj,
/// or if D_j <= 1e-14 L_jk^2 M_kk for any k, which round-off may leave of it after a small pivot k. Unknown j is then zero and
/// the others are the least-squares fit without it.
///
/// With M the moments of monomials this is the improved moving least squares of Tran et al. (2019, sec. 2.4): the rows of
/// L^-1 are the orthogonalised monomials, D_j = <p_j, p_j>, and a p_j with <p_j, p_j> = 0 is left out.
template <int N>
struct Ldl {
    static constexpr double usual_tolerance = 1e-12, round_off = 1e-14;

    double L[N][N];
    double D[N];      ///< 0 where dropped
    int dropped = 0;  ///< pivots

    /// Only M(i, j) with j <= i is read.
    ORDO_HD explicit Ldl(const double (&M)[N][N], double tolerance = usual_tolerance)
    {
        for (int j = 0; j < N; ++j) {
            double d = M[j][j], noise = tolerance * d;
            for (int k = 0; k < j; ++k) {
                d -= L[j][k] * L[j][k] * D[k];
                noise = larger(noise, round_off * L[j][k] * L[j][k] * M[k][k]);
            }
            const bool is_dropped = d <= noise;  // false for NaN
            D[j]                  = is_dropped ? 0.0 : d;
            dropped += is_dropped;
            for (int i = j + 1; i < N; ++i) {
                double l = M[i][j];
                for (int k = 0; k < j; ++k) l -= L[i][k] * L[j][k] * D[k];
                L[i][j] = is_dropped ? 0.0 : l / d;
            }
        }
    }

    /// b becomes the solution.
    ORDO_HD void solve(double (&b)[N]) const
    {
        forward(b);
        for (int i = 0; i < N; ++i) b[i] = D[i] == 0.0 ? 0.0 : b[i] / D[i];
        for (int i = N - 1; i >= 0; --i)
            for (int k = i + 1; k < N; ++k) b[i] -= L[k][i] * b[k];
    }

    /// The parts of b^T M^-1 b: of the first unknown alone, and what the others add. With b the right-hand side of a least-squares fit
    /// they are what the mean explains of the squares of the values, and what the other monomials explain besides.
    ORDO_HD void explain(const double (&b)[N], double& mean, double& others) const
    {
        double y[N];
        for (int i = 0; i < N; ++i) y[i] = b[i];
        forward(y);
        mean = others = 0.0;
        for (int i = 0; i < N; ++i)
            if (D[i] != 0.0) (i == 0 ? mean : others) += y[i] * y[i] / D[i];
    }

    /// x with L D L^T x = (1, 0, 0, ...): x . b is the first entry of the solution for any b.
    ORDO_HD void first_row(double (&x)[N]) const
    {
        for (double& e : x) e = 0.0;
        x[0] = 1.0;
        solve(x);
    }

  private:
    /// b becomes L^-1 b.
    ORDO_HD void forward(double (&b)[N]) const
    {
        for (int i = 0; i < N; ++i)
            for (int k = 0; k < i; ++k) b[i] -= L[i][k] * b[k];
    }
};

}  // namespace ordo
