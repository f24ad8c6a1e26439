// Fits at a point as published, sample by sample, with which the moments of `kernels` are compared in value and cost. They share
// only the order of monomials.
#pragma once

#include "kernels/monomials.hpp"

#include <cmath>
#include <limits>
#include <vector>

namespace ordo::verification {

template <int D>
struct Sample {
    Vec<D> x;  ///< in cells, from any origin
    double weight, value;
};

/// Improved moving least squares by Gram-Schmidt, Tran et al. (2019, sec. 2.4), with two corrections: eq. 19 subtracts the
/// projections on all k < j (as printed, only the last one), and <p_j, p_j> = 0 leaves out j, not those after it.
template <int D, int degree>
class GramSchmidtFit {
  public:
    double operator()(const std::vector<Sample<D>>& samples, const Vec<D>& at, double tolerance = 1e-12)
    {
        constexpr int n     = Monomials<D, degree>::count;
        const std::size_t N = samples.size();
        double q_at[n], p_at[n], norm[n];
        Monomials<D, degree>::evaluate(at, q_at);
        q_.resize(N * n);
        p_.resize(N * n);
        phi_.assign(N, 0.0);
        for (std::size_t s = 0; s < N; ++s) {
            double row[n];
            Monomials<D, degree>::evaluate(samples[s].x, row);
            for (int j = 0; j < n; ++j) q_[j * N + s] = row[j];
        }
        for (int j = 0; j < n; ++j) {
            const double* q = &q_[j * N];
            double* p       = &p_[j * N];
            for (std::size_t s = 0; s < N; ++s) p[s] = q[s];
            p_at[j] = q_at[j];
            for (int k = 0; k < j; ++k) {
                if (norm[k] == 0.0) continue;
                const double* pk = &p_[k * N];
                const double c   = inner(samples, q, pk) / norm[k];
                for (std::size_t s = 0; s < N; ++s) p[s] -= c * pk[s];
                p_at[j] -= c * p_at[k];
            }
            norm[j] = inner(samples, p, p);
            if (norm[j] <= tolerance * inner(samples, q, q)) norm[j] = 0.0;
            if (norm[j] == 0.0) continue;
            for (std::size_t s = 0; s < N; ++s) phi_[s] += samples[s].weight * p_at[j] * p[s] / norm[j];  // eq. 17
        }
        double sum = 0.0;
        for (std::size_t s = 0; s < N; ++s) sum += phi_[s] * samples[s].value;
        return sum;
    }

  private:
    /// <f, g>, eq. 9.
    static double inner(const std::vector<Sample<D>>& samples, const double* f, const double* g)
    {
        double sum = 0.0;
        for (std::size_t s = 0; s < samples.size(); ++s) sum += samples[s].weight * f[s] * g[s];
        return sum;
    }

    std::vector<double> q_, p_, phi_;  ///< of all samples; members, so that a second fit does not allocate
};

/// Moving least squares, Gong (2015, eqs. 3.12 to 3.16) with B U = sum_p w P(x_p) u_p, by Cholesky as Tran et al. (2019,
/// sec. 2.5) solve it. NaN if M is singular.
template <int D, int degree>
double fit_by_cholesky(const std::vector<Sample<D>>& samples, const Vec<D>& at)
{
    constexpr int n = Monomials<D, degree>::count;
    double M[n][n]{}, a[n]{}, P[n];
    for (const Sample<D>& s : samples) {
        Monomials<D, degree>::evaluate(s.x, P);
        for (int i = 0; i < n; ++i) {
            a[i] += s.weight * P[i] * s.value;
            for (int j = 0; j <= i; ++j) M[i][j] += s.weight * P[i] * P[j];
        }
    }
    for (int j = 0; j < n; ++j)
        for (int i = j; i < n; ++i) {
            double m = M[i][j];
            for (int k = 0; k < j; ++k) m -= M[i][k] * M[j][k];
            if (i == j && !(m > 0.0)) return std::numeric_limits<double>::quiet_NaN();
            M[i][j] = i == j ? std::sqrt(m) : m / M[j][j];
        }
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < i; ++k) a[i] -= M[i][k] * a[k];
        a[i] /= M[i][i];
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) a[i] -= M[k][i] * a[k];
        a[i] /= M[i][i];
    }
    double sum = 0.0;
    Monomials<D, degree>::evaluate(at, P);
    for (int i = 0; i < n; ++i) sum += P[i] * a[i];
    return sum;
}

}  // namespace ordo::verification
