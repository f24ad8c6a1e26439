#include "implicit/newton.hpp"

#include "implicit/step_equations.hpp"
#include "solve/krylov.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

using Vector = std::vector<double>;

/// The norm over unknowns that no condition holds.
double free_length(const Vector& r, const std::vector<unsigned char>& held)
{
    return std::sqrt(parallel_reduce(
        std::ssize(r), 0.0, [&](std::ptrdiff_t k) { return held[k] ? 0.0 : r[k] * r[k]; },
        [](double& total, double one) { total += one; }));
}

/// Up to so many unknowns matrices are factored; 0: as multigrid chooses. At rest more, for stiffness that flow or averages make uneven costs
/// iterations there; inertia makes it even.
template <int D>
int direct_unknowns(const MethodSpec& method)
{
    return !is_static(method) ? 0 : D == 1 ? 100000 : D == 2 ? 50000 : 6000;
}

/// The linear system of an iteration.
template <int D>
class NewtonSystem {
  public:
    NewtonSystem(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic, const Index<D>& cells)
        : equations_(equations),
          is_symmetric_(equations.is_symmetric()),
          multigrid_(MultigridChoices{.direct_unknowns = direct_unknowns<D>(method)})
    {
        is_regular_ = multigrid_.set_up(equations.matrix(), equations.places(), periodic, cells, equations.held(), is_symmetric_);
    }
    bool is_regular() const { return is_regular_; }

    /// K x = b for the unknowns that are not held, x = 0 at held ones.
    KrylovReport solve(const Vector& b, Vector& x, double tolerance)
    {
        const auto& held = equations_.held();
        auto product     = [&](std::span<const double> from, std::span<double> to) {
            equations_.multiply(from, to);
            for (std::size_t k = 0; k < held.size(); ++k)
                if (held[k]) to[k] = 0.0;
        };
        auto precondition = [&](std::span<const double> from, std::span<double> to) { multigrid_.apply(from, to); };
        const KrylovLimits limits{.tolerance = tolerance, .iterations = 500, .restart = 60};
        if (is_symmetric_) {
            KrylovReport r = conjugate_gradients(product, precondition, b, x, limits);
            if (r.converged || !r.negative_curvature) return r;
            KrylovReport next = gmres(product, precondition, b, x, limits);
            next.iterations += r.iterations;
            return next;
        }
        return gmres(product, precondition, b, x, limits);
    }

  private:
    StepEquations<D>& equations_;
    bool is_symmetric_, is_regular_ = false;
    GridMultigrid<D> multigrid_;
};

/// One attempt, from the guess of the equations. The tolerance of linear solves follows the last drop of the residual (Eisenstat & Walker
/// 1996, SIAM J. Sci. Comput. 17:16, choice 2 with gamma = 0.9). The displacements of conditions enter as part of the first iteration, so that
/// the first trial is not one that moves the held nodes alone. `descends`: steps are halved until the residual falls (Armijo).
template <int D>
NewtonResult attempt(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic, const Index<D>& cells,
                     bool descends)
{
    constexpr double loosest = 1e-2, descent = 1e-4;
    constexpr int most_cuts = 8;
    const std::size_t n     = equations.size();
    const auto& held        = equations.held();
    NewtonResult out;
    Vector &u = out.u, &r = out.missing;
    u = equations.guess();
    for (std::size_t k = 0; k < n; ++k)
        if (held[k]) u[k] = 0.0;
    r.assign(n, 0.0);
    Vector trial(n), next(n), step(n), rhs(n);
    bool is_moved = std::all_of(equations.known().begin(), equations.known().end(), [](double one) { return one == 0.0; });
    auto fail     = [&](std::string why) {
        out.why = std::move(why);
        return out;
    };
    if (!equations.find_residual(u, r, true)) return fail("the first trial fails");
    double norm = free_length(r, held), last = norm, forcing = loosest;
    for (;; ++out.report.iterations) {
        out.report.residuals.push_back(norm);
        const double tolerance = method.newton_tolerance * equations.largest_force();
        const bool is_stuck    = out.report.iterations > 0 && norm <= equations.rounding() && norm > 0.1 * last;
        if (!std::isfinite(norm)) return fail("the residual is not finite");
        if (is_moved && (norm <= tolerance || is_stuck)) {
            out.converged = true;
            return out;
        }
        if (out.report.iterations == static_cast<int>(method.newton_iterations))
            return fail(
                fmt::format("{} iterations of Newton's method left a residual of {:.3g} N, above {:.3g} (newton_tolerance)",
                            out.report.iterations, norm, tolerance));
        NewtonSystem<D> system(equations, method, periodic, cells);
        if (!system.is_regular())
            return fail("the tangent is singular: a body is free to move, or a material has lost its stiffness");
        rhs = r;
        Vector given(n, 0.0);
        if (!is_moved) {
            for (std::size_t k = 0; k < n; ++k)
                if (held[k]) given[k] = equations.known()[k] - u[k];
            equations.multiply(given, step);
            for (std::size_t k = 0; k < n; ++k) rhs[k] -= step[k];
        }
        for (std::size_t k = 0; k < n; ++k)
            if (held[k]) rhs[k] = 0.0;
        const double size = length_of(rhs);
        if (out.report.iterations > 0) {
            const double drop = norm / last, safe = 0.9 * forcing * forcing;
            forcing = std::min(std::max(0.9 * drop * drop, safe > 0.1 ? safe : 0.0), loosest);
            if (size > 0) forcing = std::max(forcing, std::min(0.3 * tolerance / size, loosest));
        }
        std::fill(step.begin(), step.end(), 0.0);
        const KrylovReport solved = system.solve(rhs, step, is_moved ? std::max(forcing, 1e-12) : 1e-6);
        out.report.linear_iterations += solved.iterations;
        if (!std::isfinite(solved.residual)) return fail("the tangent is not finite");
        for (std::size_t k = 0; k < n; ++k) step[k] += given[k];
        double part = 1.0;
        for (int cut = 0;; ++cut, part *= 0.5) {
            for (std::size_t k = 0; k < n; ++k) trial[k] = u[k] + part * step[k];
            const bool is_sound = equations.find_residual(trial, next, true);
            const double now    = is_sound ? free_length(next, held) : 0.0;
            const bool falls =
                !descends || !is_moved || now <= (1 - descent * part) * norm || now <= std::max(tolerance, equations.rounding());
            if (is_sound && std::isfinite(now) && falls) {
                last = norm;
                norm = now;
                break;
            }
            if (!is_moved || cut == most_cuts)  // what conditions give is part of the step
                return fail(is_sound ? "no part of a step of Newton's method reduces the residual"
                                     : "a trial turns a particle over, or its law fails");
        }
        is_moved = true;
        std::swap(u, trial);
        std::swap(r, next);
    }
}

}  // namespace

/// Whole steps first: those of slender bodies raise the residual before it falls, because a rotation of some size stretches at first. Where they
/// lead nowhere, once more with steps that reduce the residual.
template <int D>
NewtonResult solve_step(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic,
                        const Index<D>& cells)
{
    NewtonResult whole = attempt(equations, method, periodic, cells, false);
    if (whole.converged) return whole;
    NewtonResult searched = attempt(equations, method, periodic, cells, true);
    searched.report.iterations += whole.report.iterations;
    searched.report.linear_iterations += whole.report.linear_iterations;
    return searched;
}

template NewtonResult solve_step(StepEquations<1>&, const MethodSpec&, const Vec<1, bool>&, const Index<1>&);
template NewtonResult solve_step(StepEquations<2>&, const MethodSpec&, const Vec<2, bool>&, const Index<2>&);
template NewtonResult solve_step(StepEquations<3>&, const MethodSpec&, const Vec<3, bool>&, const Index<3>&);

}  // namespace ordo
