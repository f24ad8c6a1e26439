// Krylov methods for one right-hand side: conjugate gradients for symmetric matrices, GMRES for others. The caller owns the matrix and
// the preconditioner; all sums are the same for any number of threads.
#pragma once

#include "base/error.hpp"
#include "base/parallel.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace ordo {

struct KrylovLimits {
    double tolerance = 1e-8;  ///< of |b - A x|, relative to |b|
    int iterations   = 1000;
    int restart      = 50;  ///< GMRES: directions that are kept
};

struct KrylovReport {
    int iterations          = 0;
    double residual         = 0.0;    ///< |b - A x| / |b|, of GMRES as its recurrence has it
    bool converged          = false;  ///< the residual is within the tolerance
    bool negative_curvature = false;  ///< conjugate gradients met a p with p A p <= 0, or an r with r P^-1 r <= 0, and stopped
};

inline double inner_product(std::span<const double> a, std::span<const double> b)
{
    return parallel_reduce(
        std::ssize(a), 0.0, [&](std::ptrdiff_t i) { return a[i] * b[i]; }, [](double& total, double term) { total += term; });
}
inline double length_of(std::span<const double> a) { return std::sqrt(inner_product(a, a)); }

/// y += factor x
inline void add_multiple(std::span<double> y, double factor, std::span<const double> x)
{
    parallel_for_each(std::ssize(y), [&](std::ptrdiff_t i) { y[i] += factor * x[i]; });
}

/// r = b - A x; without a product where x is zero, as it is when most solves begin.
template <class Product>
void find_residual(Product&& product, std::span<const double> b, std::span<const double> x, std::span<double> r)
{
    if (std::all_of(x.begin(), x.end(), [](double one) { return one == 0.0; })) {
        std::copy(b.begin(), b.end(), r.begin());
        return;
    }
    product(x, r);
    parallel_for_each(std::ssize(b), [&](std::ptrdiff_t i) { r[i] = b[i] - r[i]; });
}

/// For b = 0.
inline KrylovReport answer_none(std::span<double> x)
{
    std::fill(x.begin(), x.end(), 0.0);
    return {.converged = true};
}

/// Solves A x = b with a symmetric A by preconditioned conjugate gradients (Hestenes & Stiefel 1952).
/// @param product product(x, y): y = A x
/// @param precondition precondition(r, z): z = P^-1 r, symmetric and positive definite
/// @param x the start, then the result. After a direction of negative curvature it is the last x before; the preconditioned residual
///          is added if there is none, as in Newton's method with truncation (Nocedal & Wright 2006, algorithm 7.1).
template <class Product, class Precondition>
KrylovReport conjugate_gradients(Product&& product, Precondition&& precondition, std::span<const double> b, std::span<double> x,
                                 const KrylovLimits& limits)
{
    ORDO_EXPECT(b.size() == x.size());
    const std::size_t n = b.size();
    KrylovReport report;
    const double whole = length_of(b);
    if (whole == 0.0) return answer_none(x);
    std::vector<double> r(n), z(n), p(n), q(n);
    find_residual(product, b, x, r);
    double before = 0.0;
    for (;; ++report.iterations) {
        report.residual  = length_of(r) / whole;
        report.converged = report.residual <= limits.tolerance;
        if (report.converged || report.iterations == limits.iterations || !std::isfinite(report.residual)) return report;
        precondition(std::span<const double>(r), std::span<double>(z));
        const double now = inner_product(r, z), turn = report.iterations == 0 ? 0.0 : now / before;
        parallel_for_each(std::ssize(p), [&](std::ptrdiff_t i) { p[i] = z[i] + turn * p[i]; });
        product(std::span<const double>(p), std::span<double>(q));
        const double curvature = inner_product(p, q);
        if (!(now > 0 && curvature > 0)) {  // also where one is not a number
            report.negative_curvature = now <= 0 || curvature <= 0;
            if (report.negative_curvature && report.iterations == 0) {
                add_multiple(x, 1.0, z);
                find_residual(product, b, x, r);
                report.residual = length_of(r) / whole;
            }
            return report;
        }
        add_multiple(x, now / curvature, p);
        add_multiple(r, -now / curvature, q);
        before = now;
    }
}

/// The least squares of GMRES: columns of the Hessenberg matrix, made triangular by Givens rotations as they come.
class HessenbergFit {
  public:
    explicit HessenbergFit(double residual) : side_{residual} {}

    /// |b - A x| for the best x so far.
    double residual() const { return std::abs(side_.back()); }

    /// Adds a column, which has an entry more than the one before. False if it depends on the others; it is then left out.
    bool add(std::vector<double> column)
    {
        const std::size_t k = columns_.size();
        for (std::size_t j = 0; j < k; ++j) rotate(rotations_[j], column[j], column[j + 1]);
        const double size = std::hypot(column[k], column[k + 1]);
        if (!(size > 0)) return false;
        rotations_.push_back({column[k] / size, column[k + 1] / size});
        rotate(rotations_.back(), column[k], column[k + 1]);
        side_.push_back(0.0);
        rotate(rotations_.back(), side_[k], side_[k + 1]);
        columns_.push_back(std::move(column));
        return true;
    }

    /// The factors of the directions.
    std::vector<double> solution() const
    {
        std::vector<double> y(side_.begin(), side_.end() - 1);
        for (std::size_t k = y.size(); k-- > 0;) {
            y[k] /= columns_[k][k];
            for (std::size_t j = 0; j < k; ++j) y[j] -= columns_[k][j] * y[k];
        }
        return y;
    }

  private:
    struct Rotation {
        double cosine, sine;
    };
    static void rotate(const Rotation& by, double& a, double& b)
    {
        const double turned = by.cosine * a + by.sine * b;
        b                   = by.cosine * b - by.sine * a;
        a                   = turned;
    }

    std::vector<std::vector<double>> columns_;
    std::vector<Rotation> rotations_;
    std::vector<double> side_;
};

/// Makes w orthogonal to the directions and returns its components along them, then what is left of its length (modified Gram-Schmidt;
/// a second time where most of w is lost, which would leave rounding errors: Saad 2003, section 6.3.2, with the 1/sqrt(2) of Daniel et
/// al. 1976).
inline std::vector<double> orthogonalise(const std::vector<std::vector<double>>& directions, std::span<double> w)
{
    std::vector<double> components(directions.size() + 1, 0.0);
    double before = length_of(w);
    for (int pass = 0; pass < 2; ++pass) {
        for (std::size_t j = 0; j < directions.size(); ++j) {
            const double h = inner_product(directions[j], w);
            add_multiple(w, -h, directions[j]);
            components[j] += h;
        }
        const double left = components.back() = length_of(w);
        if (!(left < before / std::sqrt(2.0))) break;
        before = left;
    }
    return components;
}

/// Solves A x = b by GMRES with restarts, preconditioned from the right (Saad & Schultz 1986; Saad 2003, algorithm 9.5), so that the
/// residual is the true one. Arguments as those of conjugate gradients; A and P need not be symmetric.
template <class Product, class Precondition>
KrylovReport gmres(Product&& product, Precondition&& precondition, std::span<const double> b, std::span<double> x,
                   const KrylovLimits& limits)
{
    ORDO_EXPECT(b.size() == x.size() && limits.restart > 0);
    const std::size_t n = b.size();
    KrylovReport report;
    const double whole = length_of(b);
    if (whole == 0.0) return answer_none(x);
    std::vector<double> z(n), w(n);
    std::vector<std::vector<double>> directions;
    for (;;) {
        find_residual(product, b, x, w);
        const double start = length_of(w);
        report.residual    = start / whole;
        report.converged   = report.residual <= limits.tolerance;
        if (report.converged || report.iterations >= limits.iterations || !std::isfinite(report.residual)) return report;
        HessenbergFit fit(start);
        directions.clear();
        double length = start;
        while (length > 0 && std::ssize(directions) < limits.restart && report.iterations < limits.iterations) {
            parallel_for_each(std::ssize(w), [&](std::ptrdiff_t i) { w[i] /= length; });
            directions.push_back(w);
            precondition(std::span<const double>(w), std::span<double>(z));
            product(std::span<const double>(z), std::span<double>(w));
            ++report.iterations;
            std::vector<double> column = orthogonalise(directions, w);
            length                     = column.back();
            if (!fit.add(std::move(column)) || fit.residual() <= limits.tolerance * whole) break;
        }
        const std::vector<double> factors = fit.solution();
        if (factors.empty()) return report;  // A P^-1 takes the residual to zero: A is singular
        if (directions.size() == 1) {        // z is still P^-1 of the only direction
            add_multiple(x, factors[0], z);
        } else {
            std::fill(w.begin(), w.end(), 0.0);
            for (std::size_t k = 0; k < factors.size(); ++k) add_multiple(w, factors[k], directions[k]);
            precondition(std::span<const double>(w), std::span<double>(z));
            add_multiple(x, 1.0, z);
        }
        if (fit.residual() <= limits.tolerance * whole) {
            report.residual  = fit.residual() / whole;
            report.converged = true;
            return report;
        }
    }
}

}  // namespace ordo
