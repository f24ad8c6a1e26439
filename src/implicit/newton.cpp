#include "implicit/newton.hpp"

#include "implicit/step_equations.hpp"
#include "solve/krylov.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ordo {

namespace {

using Vector = std::vector<double>;

/// Over unknowns that no condition holds.
double free_product(const Vector& a, const Vector& b, const std::vector<unsigned char>& held)
{
    return parallel_reduce(
        std::ssize(a), 0.0, [&](std::ptrdiff_t k) { return held[k] ? 0.0 : a[k] * b[k]; },
        [](double& total, double one) { total += one; });
}

/// The linear systems of a step. While Newton's method converges tangents change little, and a preconditioner serves as long as it costs few
/// iterations.
template <int D>
class NewtonSystem {
  public:
    NewtonSystem(StepEquations<D>& equations, const Vec<D, bool>& periodic, const Index<D>& cells, GridMultigrid<D>& multigrid)
        : equations_(equations), places_(equations.places()), periodic_(periodic), cells_(cells), multigrid_(multigrid)
    {}

    /// K x = b for the unknowns that are not held, x = 0 at held ones, with the tangent K at the last residual. False if it is singular.
    /// @param is_near whether the tangent has hardly changed since the last system
    bool solve(const Vector& b, Vector& x, double tolerance, bool is_near, KrylovReport& report)
    {
        constexpr int most = 500, patience = 4;
        const bool is_symmetric = equations_.is_symmetric();
        std::fill(x.begin(), x.end(), 0.0);
        report = {};
        if (serves_ && is_near) {
            report  = solve_with_last(b, x, tolerance, fresh_iterations_ + patience, is_symmetric);
            serves_ = report.converged;
            if (serves_) return true;
            if (!std::isfinite(report.residual)) std::fill(x.begin(), x.end(), 0.0);
        }
        if (!multigrid_.set_up(equations_.matrix(), places_, periodic_, cells_, equations_.held(), is_symmetric)) return false;
        const int before  = report.iterations;
        report            = solve_with_last(b, x, tolerance, most, is_symmetric);
        fresh_iterations_ = report.iterations;
        serves_           = report.converged;
        report.iterations += before;
        return true;
    }

  private:
    KrylovReport solve_with_last(const Vector& b, Vector& x, double tolerance, int iterations, bool is_symmetric)
    {
        const auto& held = equations_.held();
        auto product     = [&](std::span<const double> from, std::span<double> to) {
            equations_.multiply(from, to);
            for (std::size_t k = 0; k < held.size(); ++k)
                if (held[k]) to[k] = 0.0;
        };
        auto precondition = [&](std::span<const double> from, std::span<double> to) { multigrid_.apply(from, to); };
        const KrylovLimits limits{.tolerance = tolerance, .iterations = iterations, .restart = 60};
        if (!is_symmetric) return gmres(product, precondition, b, x, limits);
        KrylovReport r = conjugate_gradients(product, precondition, b, x, limits);
        if (r.converged || !r.negative_curvature) return r;
        KrylovReport next = gmres(product, precondition, b, x, limits);
        next.iterations += r.iterations;
        return next;
    }

    StepEquations<D>& equations_;
    std::vector<Index<D>> places_;
    const Vec<D, bool>& periodic_;
    const Index<D>& cells_;
    GridMultigrid<D>& multigrid_;
    bool serves_          = false;
    int fresh_iterations_ = 0;
};

/// Where Newton's method is.
struct Iterate {
    Vector u, missing;           ///< displacements, m, and the residual there, N
    double norm = 0, force = 0;  ///< of the residual over free unknowns; of the forces there, N
    bool has_motion = false;     ///< u has what conditions give
};

/// The part of a step of Newton's method that is taken next in the search for a root of the residual's component along it, from the parts that were
/// tried: doubling, then bisection and the secant (Matthies & Strang 1979, IJNME 14:1613).
class LineSearch {
  public:
    explicit LineSearch(double slope) : first_(slope), low_{0.0, slope} {}

    bool accepts(double slope) const { return std::fabs(slope) <= 0.5 * std::fabs(first_); }
    /// After a trial with this component.
    double next(double part, double slope)
    {
        constexpr double longest = 8.0;
        if ((slope > 0) != (low_.slope > 0))
            high_ = {part, slope};
        else
            low_ = {part, slope};
        if (failed_ > 0 && high_.part == 0) return 0.5 * (low_.part + failed_);
        if (high_.part == 0) return std::min(2 * part, longest);
        const double width = high_.part - low_.part, to = low_.part + width * low_.slope / (low_.slope - high_.slope);
        return std::clamp(to, low_.part + 0.1 * width, high_.part - 0.1 * width);
    }
    /// After one that fails.
    double back(double part)
    {
        failed_ = part;
        high_   = {};
        return 0.5 * (low_.part + part);
    }

  private:
    struct Trial {
        double part = 0.0, slope = 0.0;
    };
    double first_, failed_ = 0.0;
    Trial low_, high_;
};

/// The tolerance of linear solves follows the last drop of the residual (Eisenstat & Walker 1996, SIAM J. Sci. Comput. 17:16, choice 2 with
/// gamma = 0.9). The displacements of conditions enter as part of the first iteration, so that the first trial is not one that moves the held nodes
/// alone. Whole steps first: those of slender bodies raise the residual before it falls, because a rotation of some size stretches at first. Where
/// they lead nowhere, a line search from where the residual was least.
template <int D>
NewtonResult solve_from(Vector start, StepEquations<D>& equations, const MethodSpec& method, NewtonSystem<D> system)
{
    constexpr double loosest = 1e-2, descent = 1e-4, hardly_changed = 0.05;
    constexpr int most_trials = 10, most_rising = 4;
    const std::size_t n = equations.size();
    const auto& held    = equations.held();
    NewtonResult out;
    const auto leave = [&](const Iterate& at, std::string why) {
        out.u       = at.u;
        out.missing = at.missing;
        out.why     = std::move(why);
        return out;
    };
    const auto evaluate = [&](Iterate& at) {
        if (!equations.find_residual(at.u, at.missing, true)) return false;
        at.norm  = std::sqrt(free_product(at.missing, at.missing, held));
        at.force = equations.force();
        return std::isfinite(at.norm);
    };
    Vector step(n), given(n, 0.0), rhs(n);
    Iterate now{.u = std::move(start), .missing = Vector(n)};
    if (!evaluate(now)) return leave(now, "the first trial fails");
    now.has_motion = true;
    for (std::size_t k = 0; k < n; ++k)
        if (held[k] && now.u[k] != equations.known()[k]) now.has_motion = false;
    const double first_force = now.force;
    Iterate best = now, trial = now;
    double last = now.norm, forcing = loosest;
    bool searches = false;
    int rising    = 0;
    for (int iteration = 0;; ++iteration) {
        NewtonIteration& report = out.report.iterations.emplace_back(NewtonIteration{now.norm});
        const double tolerance  = method.newton_tolerance * std::max(now.force, first_force);
        const bool is_stuck =
            iteration > 0 && now.norm <= equations.rounding() && now.norm > 0.1 * last && equations.may_be_rounding(now.missing);
        if (now.has_motion && (now.norm <= tolerance || is_stuck)) {
            out.report.converged = true;
            return leave(now, "");
        }
        if (iteration == static_cast<int>(method.newton_iterations))
            return leave(
                now, fmt::format("{} iterations of Newton's method left a residual of {:.3g} N, above {:.3g} (newton_tolerance)",
                                 iteration, now.norm, tolerance));
        rhs = now.missing;
        if (!now.has_motion) {
            for (std::size_t k = 0; k < n; ++k)
                if (held[k]) given[k] = equations.known()[k] - now.u[k];
            equations.multiply(given, step);
            for (std::size_t k = 0; k < n; ++k) rhs[k] -= step[k];
        }
        for (std::size_t k = 0; k < n; ++k)
            if (held[k]) rhs[k] = 0.0;
        const double size = length_of(rhs);
        if (iteration > 0) {
            const double drop = now.norm / last, safe = 0.9 * forcing * forcing;
            forcing = std::min(std::max(0.9 * drop * drop, safe > 0.1 ? safe : 0.0), loosest);
            if (size > 0) forcing = std::max(forcing, std::min(0.3 * tolerance / size, loosest));
        }
        KrylovReport solved;
        out.is_singular =
            !system.solve(rhs, step, now.has_motion ? std::max(forcing, 1e-12) : 1e-6, now.norm < hardly_changed * last, solved);
        report.linear_iterations = solved.iterations;
        if (out.is_singular)
            return leave(now, "the tangent is singular: a body is free to move, or a material has lost its stiffness");
        if (!std::isfinite(solved.residual)) return leave(now, "the tangent is not finite");
        if (!now.has_motion)
            for (std::size_t k = 0; k < n; ++k) step[k] += given[k];

        double part   = 1.0;
        auto is_sound = [&] {
            for (std::size_t k = 0; k < n; ++k) trial.u[k] = now.u[k] + part * step[k];
            return evaluate(trial);
        };
        bool is_taken = false, has_failed = false;
        if (!searches) {
            is_taken = is_sound();
        } else {
            LineSearch search(free_product(now.missing, step, held));
            for (int tried = 0; tried < most_trials && !is_taken; ++tried) {
                has_failed = !is_sound();
                if (has_failed) {
                    part = search.back(part);
                    continue;
                }
                const double there = free_product(trial.missing, step, held);
                is_taken           = trial.norm <= std::max({(1 - descent * part) * now.norm, tolerance, equations.rounding()}) ||
                           search.accepts(there);
                if (!is_taken) part = search.next(part, there);
            }
        }
        if (is_taken) {
            trial.has_motion = true;
            report.part      = part;
            last             = now.norm;
            std::swap(now, trial);
            rising = now.norm < best.norm || !best.has_motion ? 0 : rising + 1;
            if (rising == 0) best = now;
            if (searches || rising < most_rising) continue;
        }
        if (searches || !best.has_motion)
            return leave(now, has_failed || !searches ? "a trial turns a particle over, or its law fails"
                                                      : "no part of a step of Newton's method reduces the residual");
        searches = true;
        now      = best;
        last     = now.norm;
        forcing  = loosest;
        evaluate(now);
    }
}

/// Whether a load step should begin at rest: where no boundary moves and the load points away from the guess, or the guess goes far beyond it. The last
/// step of a load that turns or stops leads to other solutions than the nearest, or to none.
template <int D>
bool leads_away(StepEquations<D>& equations, const Vector& guess, const Vector& rest)
{
    constexpr double beyond = 10.0;
    if (equations.known() != rest) return false;
    Vector at_rest(rest.size()), at_guess(rest.size());
    if (!equations.find_residual(guess, at_guess, false)) return true;
    if (!equations.find_residual(rest, at_rest, false)) return false;
    const auto& held = equations.held();
    return !(free_product(at_rest, guess, held) > 0) ||
           free_product(at_guess, at_guess, held) > beyond * beyond * free_product(at_rest, at_rest, held);
}

}  // namespace

/// At rest larger matrices are factored, for stiffness that flow or averages make uneven costs iterations there; inertia makes it even.
template <int D>
MultigridChoices multigrid_choices(const MethodSpec& method)
{
    return {.direct_unknowns = !is_static(method) ? 0 : D == 1 ? 100000 : D == 2 ? 50000 : 6000};
}

/// A load step that leads nowhere from where the last one points is tried from rest. One in which a particle swells or shrinks too far has no solution
/// near by.
template <int D>
NewtonResult solve_step(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic,
                        const Index<D>& cells, GridMultigrid<D>& multigrid)
{
    constexpr double most_change = 2.0;
    const auto solve             = [&](const Vector& from) {
        NewtonResult r = solve_from(from, equations, method, NewtonSystem<D>(equations, periodic, cells, multigrid));
        if (!r.report.converged || !is_static(method)) return r;
        const auto [particle, factor] = equations.largest_change_of_volume(r.u);
        if (std::max(factor, 1 / factor) <= most_change) return r;
        r.report.converged = false;
        r.particle         = particle;
        r.change           = factor;
        return r;
    };
    const Vector& guess = equations.guess();
    const Vector rest(equations.size(), 0.0);
    if (!is_static(method) || guess == rest) return solve(guess);
    if (leads_away(equations, guess, rest)) return solve(rest);
    NewtonResult r = solve(guess);
    if (r.report.converged) return r;
    NewtonResult again = solve(rest);
    again.report.iterations.insert(again.report.iterations.begin(), r.report.iterations.begin(), r.report.iterations.end());
    return again;
}

#define ORDO_NEWTON(D)                                                                                           \
    template MultigridChoices multigrid_choices<D>(const MethodSpec&);                                           \
    template NewtonResult solve_step(StepEquations<D>&, const MethodSpec&, const Vec<D, bool>&, const Index<D>&, \
                                     GridMultigrid<D>&);
ORDO_NEWTON(1)
ORDO_NEWTON(2)
ORDO_NEWTON(3)
#undef ORDO_NEWTON

}  // namespace ordo
