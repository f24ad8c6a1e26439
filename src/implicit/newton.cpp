#include "implicit/newton.hpp"

#include "implicit/step_equations.hpp"
#include "solve/krylov.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

/// Up to so many unknowns matrices are factored; 0: as multigrid chooses. At rest more, for stiffness that flow or averages make uneven costs
/// iterations there; inertia makes it even.
template <int D>
int direct_unknowns(const MethodSpec& method)
{
    return !is_static(method) ? 0 : D == 1 ? 100000 : D == 2 ? 50000 : 6000;
}

/// The linear systems of a step. While Newton's method converges tangents change little, and a preconditioner serves as long as it costs few
/// iterations.
template <int D>
class NewtonSystem {
  public:
    NewtonSystem(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic, const Index<D>& cells)
        : equations_(equations),
          periodic_(periodic),
          cells_(cells),
          multigrid_(MultigridChoices{.direct_unknowns = direct_unknowns<D>(method)})
    {}

    /// K x = b for the unknowns that are not held, x = 0 at held ones, with the tangent K at the last residual. False if it is singular.
    /// @param is_near the tangent to that of the last system
    bool solve(const Vector& b, Vector& x, double tolerance, bool is_near, KrylovReport& report)
    {
        constexpr int most = 500, patience = 4;
        std::fill(x.begin(), x.end(), 0.0);
        int before = 0;
        if (serves_ && is_near) {
            report  = solve_with_last(b, x, tolerance, fresh_iterations_ + patience);
            serves_ = report.converged;
            if (serves_) return true;
            before = report.iterations;
        }
        if (!multigrid_.set_up(equations_.matrix(), equations_.places(), periodic_, cells_, equations_.held())) return false;
        report            = solve_with_last(b, x, tolerance, most);
        fresh_iterations_ = report.iterations;
        serves_           = report.converged;
        report.iterations += before;
        return true;
    }

  private:
    KrylovReport solve_with_last(const Vector& b, Vector& x, double tolerance, int iterations)
    {
        const auto& held = equations_.held();
        auto product     = [&](std::span<const double> from, std::span<double> to) {
            equations_.multiply(from, to);
            for (std::size_t k = 0; k < held.size(); ++k)
                if (held[k]) to[k] = 0.0;
        };
        auto precondition = [&](std::span<const double> from, std::span<double> to) { multigrid_.apply(from, to); };
        const KrylovLimits limits{.tolerance = tolerance, .iterations = iterations, .restart = 60};
        if (!equations_.is_symmetric()) return gmres(product, precondition, b, x, limits);
        KrylovReport r = conjugate_gradients(product, precondition, b, x, limits);
        if (r.converged || !r.negative_curvature) return r;
        KrylovReport next = gmres(product, precondition, b, x, limits);
        next.iterations += r.iterations;
        return next;
    }

    StepEquations<D>& equations_;
    const Vec<D, bool>& periodic_;
    const Index<D>& cells_;
    GridMultigrid<D> multigrid_;
    bool serves_          = false;
    int fresh_iterations_ = 0;
};

/// Where Newton's method is.
struct Iterate {
    Vector u, missing;        ///< displacements, m, and the residual there, N
    double norm     = 0;      ///< of the residual over free unknowns
    bool has_motion = false;  ///< u has what conditions give
};

/// The part of a step of Newton's method that is taken next in the search for a root of the residual's component along it, from the parts that were
/// tried: bisection and the secant (Matthies & Strang 1979, IJNME 14:1613).
class LineSearch {
  public:
    explicit LineSearch(double slope) : low_{0.0, slope} {}

    bool accepts(double slope) const { return std::fabs(slope) <= 0.5 * std::fabs(first_); }
    double next(double part, double slope)
    {
        const bool is_beyond       = (slope > 0) != (low_.slope > 0);
        (is_beyond ? high_ : low_) = {part, slope};
        if (high_.part == 0.0) high_ = {2 * part, 0.0};
        const double width = high_.part - low_.part, to = low_.part + width * low_.slope / (low_.slope - high_.slope);
        return std::clamp(to, low_.part + 0.1 * width, high_.part - 0.1 * width);
    }
    /// Where a trial fails.
    double back(double part) { return 0.5 * (low_.part + part); }

  private:
    struct Trial {
        double part, slope;
    };
    Trial low_, high_{0.0, 0.0};
    double first_ = low_.slope;
};

}  // namespace

/// The tolerance of linear solves follows the last drop of the residual (Eisenstat & Walker 1996, SIAM J. Sci. Comput. 17:16, choice 2 with
/// gamma = 0.9). The displacements of conditions enter as part of the first iteration, so that the first trial is not one that moves the held nodes
/// alone. Whole steps first: those of slender bodies raise the residual before it falls, because a rotation of some size stretches at first. Where
/// they lead nowhere, a line search from where the residual was least.
template <int D>
NewtonResult solve_step(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic,
                        const Index<D>& cells)
{
    constexpr double loosest = 1e-2, near = 0.05, descent = 1e-4;
    constexpr int most_trials = 10, most_rising = 4;
    const std::size_t n = equations.size();
    const auto& held    = equations.held();
    const auto length   = [&](const Vector& r) { return std::sqrt(free_product(r, r, held)); };
    NewtonResult out;
    const auto end = [&](const Iterate& at, std::string why) {
        if (out.report.iterations.empty()) out.report.iterations.push_back({at.norm});
        out.u       = at.u;
        out.missing = at.missing;
        out.why     = std::move(why);
        return out;
    };
    NewtonSystem<D> system(equations, method, periodic, cells);
    Vector step(n), given(n, 0.0), rhs(n);
    Iterate now{equations.guess(), Vector(n)};
    if (!equations.find_residual(now.u, now.missing, true)) {
        std::fill(now.u.begin(), now.u.end(), 0.0);
        if (!equations.find_residual(now.u, now.missing, true)) return end(now, "the first trial fails");
    }
    now.norm       = length(now.missing);
    now.has_motion = true;
    for (std::size_t k = 0; k < n; ++k)
        if (held[k] && now.u[k] != equations.known()[k]) now.has_motion = false;
    Iterate best = now, trial = now;
    double last = now.norm, forcing = loosest;
    bool searches = false;
    int rising    = 0;
    for (int iteration = 0;; ++iteration) {
        NewtonIteration& report = out.report.iterations.emplace_back(NewtonIteration{now.norm});
        const double tolerance  = method.newton_tolerance * equations.largest_force();
        const bool is_stuck     = iteration > 0 && now.norm <= equations.rounding() && now.norm > 0.1 * last;
        if (now.has_motion && (now.norm <= tolerance || is_stuck)) {
            out.report.converged = true;
            return end(now, "");
        }
        if (iteration == static_cast<int>(method.newton_iterations))
            return end(
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
        if (!system.solve(rhs, step, now.has_motion ? std::max(forcing, 1e-12) : 1e-6, now.norm < near * last, solved))
            return end(now, "the tangent is singular: a body is free to move, or a material has lost its stiffness");
        report.linear_iterations = solved.iterations;
        if (!std::isfinite(solved.residual)) return end(now, "the tangent is not finite");
        if (!now.has_motion)
            for (std::size_t k = 0; k < n; ++k) step[k] += given[k];

        const double slope = free_product(now.missing, step, held);
        LineSearch search(slope);
        bool is_taken = false, is_sound = false;
        double part = 1.0;
        for (int tried = 0; tried < most_trials && !is_taken; ++tried) {
            for (std::size_t k = 0; k < n; ++k) trial.u[k] = now.u[k] + part * step[k];
            is_sound = equations.find_residual(trial.u, trial.missing, true);
            if (is_sound) trial.norm = length(trial.missing);
            is_sound = is_sound && std::isfinite(trial.norm);
            if (!searches || !now.has_motion) {  // what conditions give is part of the step
                is_taken = is_sound;
                break;
            }
            if (!is_sound) {
                part = search.back(part);
                continue;
            }
            const double there = free_product(trial.missing, step, held);
            is_taken           = trial.norm <= std::max({(1 - descent * part) * now.norm, tolerance, equations.rounding()}) ||
                       search.accepts(there);
            if (!is_taken) part = search.next(part, there);
        }
        trial.has_motion = true;
        if (is_taken) {
            report.part = part;
            last        = now.norm;
            std::swap(now, trial);
            rising = now.norm < best.norm || !best.has_motion ? 0 : rising + 1;
            if (rising == 0) best = now;
        }
        if (is_taken && (searches || rising < most_rising)) continue;
        if (searches || !best.has_motion)
            return end(now, is_sound ? "no part of a step of Newton's method reduces the residual"
                                     : "a trial turns a particle over, or its law fails");
        searches = true;
        now      = best;
        last     = now.norm;
        forcing  = loosest;
        equations.find_residual(now.u, now.missing, true);
    }
}

template NewtonResult solve_step(StepEquations<1>&, const MethodSpec&, const Vec<1, bool>&, const Index<1>&);
template NewtonResult solve_step(StepEquations<2>&, const MethodSpec&, const Vec<2, bool>&, const Index<2>&);
template NewtonResult solve_step(StepEquations<3>&, const MethodSpec&, const Vec<3, bool>&, const Index<3>&);

}  // namespace ordo
