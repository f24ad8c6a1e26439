// Fits of splines to particles, and the systems of SplineScheme.
#include "method/place.hpp"
#include "solve/conjugate_gradients.hpp"
#include "spline/parts.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <tuple>

namespace ordo {

namespace {

/// The ghost penalty of fits as a fraction of their mean weight; found by trial (docs/high_order.md).
constexpr double kGhostOfFits = 1e-5;

Lanes square_root(const Lanes& a)
{
    Lanes r(0.0);
    for (int k = 0; k < 8; ++k) r[k] = std::sqrt(a[k]);
    return r;
}

template <int D>
Lanes stress_lanes(const Stress<D>& sigma)
{
    Lanes r(0.0);
    for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) r[stress_lane<D>(a, b)] = sigma(a, b);
    return r;
}

/// to += sum over the particles i of a cell, which has some, of N(x_i) value(i).
template <int D, int P, class Value>
ORDO_FLAT inline void spread_cell(const SplineSpace<D>& space, const SplineScratch<D>& work, const SampleRows& rows,
                                  const Index<D>& at, int number, const Value& value, Lanes* to)
{
    SplineCell<D, P> cell(space, at);
    cell.clear();
    for (int k = work.first[number]; k < work.first[number + 1]; ++k)
        cell.spread(rows.weights.data() + static_cast<std::ptrdiff_t>(k) * rows.width, value(work.order[k]));
    cell.add_to(to);
}

}  // namespace

/// Zeroes the components that walls hold: they are not unknowns.
template <int D>
void SplineScheme<D>::hold(const System& system, Lanes* records) const
{
    if (system.free)
        for (const Held& h : held_) records[h.function] *= h.*system.free;
}

/// work.sums = the row sums of a matrix over n functions.
template <int D>
void SplineScheme<D>::find_row_sums(SplineMatrix<D>& matrix, std::size_t n) const
{
    SplineScratch<D>& work = *scratch_;
    keep_room(work.r, n);
    keep_room(work.sums, n);
    std::fill_n(work.r.data(), n, Lanes(1.0));
    matrix.multiply(work.r.data(), work.sums.data());
}

/// The factors of a tensor product over the axes that is close to a matrix with the row sums work.sums. Sets work.scale to the roots
/// of the product's row sums over these.
///
/// The factor of an axis is the sum of the matrix over the functions of the other axes: sum_g w_g N_i N_j of that axis alone, since the
/// functions of the other axes sum to 1. So the product is the matrix itself if the points lie on lines along the axes, and always in 1D.
template <int D>
typename SplineScheme<D>::Factors SplineScheme<D>::factor_axes(const SplineMatrix<D>& matrix, const SplineSpace<D>& space,
                                                               const std::array<AxisEnds, D>* free) const
{
    SplineScratch<D>& work = *scratch_;
    const Index<D> counts  = space.counts();
    const auto sums        = matrix.sums_along_axes();
    Factors factors;
    std::array<std::vector<Lanes>, D> rows;
    Lanes scale(1.0);  // the product would be too large by the sum of all entries for each axis but the first
    for (int a = 0; a < D; ++a) {
        const SplineAxis& axis = space.axis[a];
        AxisMass mass(axis, free ? (*free)[a] : kFreeEnds);
        rows[a].assign(counts[a], Lanes(0.0));
        for (int i = 0; i < counts[a]; ++i)
            for (int distance = 0; distance <= axis.degree; ++distance) {
                if (!axis.periodic && i + distance >= counts[a]) break;
                const Lanes of = sums[a][i * (axis.degree + 1) + distance] * scale;
                mass.add(i, distance, of);
                rows[a][i] += of;
                if (distance > 0) rows[a][axis.wrapped(i + distance)] += of;
            }
        if (a == 0) {
            Lanes whole(0.0);
            for (const Lanes& of : rows[0]) whole += of;
            scale = quotient(Lanes(1.0), whole);
        }
        int singular                      = -1;
        std::tie(factors.of[a], singular) = mass.factored(1e-10);
        if (singular < 0) continue;
        Index<D> at{};
        for (int b = 0; b < D; ++b) at[b] = b == a ? singular : counts[b] / 2;
        factors.poor = space.number(at);
    }
    keep_room(work.scale, space.count());
    parallel_for_each(static_cast<std::ptrdiff_t>(space.count()), [&](std::ptrdiff_t i) {
        const Index<D> at = space.index(i);
        Lanes of_product  = rows[0][at[0]];
        for (int a = 1; a < D; ++a) of_product *= rows[a][at[a]];
        work.scale[i] = square_root(quotient(of_product, work.sums[i]));
    });
    return factors;
}

/// z = P^-1 r. With free surfaces P is the incomplete factor; without them it is S^1/2 M S^1/2, where M is the tensor product of
/// factor_axes, and S is diagonal: the row sums divided by those of M.
template <int D>
void SplineScheme<D>::precondition(const System& system) const
{
    SplineScratch<D>& work = *scratch_;
    const Index<D> counts  = system.space.counts();
    if (system.factor) {
        system.factor->solve(work.r.data(), work.z.data());
        hold(system, work.z.data());
        return;
    }
    const auto n = static_cast<std::ptrdiff_t>(system.space.count());
    parallel_for_each(n, [&](std::ptrdiff_t i) { work.z[i] = work.r[i] * work.scale[i]; });
    for (int a = 0; a < D; ++a)
        for_each_line<D>(counts, a, [&](std::ptrdiff_t first, std::ptrdiff_t stride) {
            system.factors->of[a].solve(work.z.data() + first, stride);
        });
    parallel_for_each(n, [&](std::ptrdiff_t i) { work.z[i] *= work.scale[i]; });
}

/// The system A x = b for conjugate_gradients; `work.sums` has the row sums.
template <int D>
struct SplineScheme<D>::Conjugate {
    /// Residuals, as the iteration updates them, relative to b. With free surfaces, functions with little of the body in their support
    /// make larger errors of them: with 1e-13 `spline5` ends at 5e-12 m on 64 cells of `vibration-free`, instead of 1e-12.
    static constexpr double enough = 1e-13, best = 1e-15;
    /// Where particles hardly determine the splines, a lane does not get from the one to the other: after so many iterations, or when its
    /// residual has grown a hundredfold, it stays as it is. Further iterations would add what vanishes at all particles.
    static constexpr int most_further = 10;

    const SplineScheme& scheme;
    const System& system;
    Lanes* x;
    SplineScratch<D>& work;
    const std::vector<std::vector<typename SplineMatrix<D>::Interval>>& active;  ///< functions
    Lanes whole{0.0};    ///< the size of b, or of the first residual if that is larger
    Lanes least{0.0};    ///< size of the residual since it is small enough
    Lanes further{0.0};  ///< iterations since then
    Lanes goes_on{1.0};  ///< 1, or 0 in lanes that stay as they are

    template <class F>
    void for_each(F&& f) const
    {
        parallel_for(std::ssize(active), [&](std::ptrdiff_t k) {
            for (const auto& interval : active[k])
                for (std::ptrdiff_t i = interval.begin; i < interval.end; ++i) f(i);
        });
    }
    /// The sum of f(i), piece by piece, in an order that does not depend on the number of threads.
    template <class F>
    Lanes sum_of(F&& f) const
    {
        std::vector<Lanes> parts(active.size(), Lanes(0.0));
        parallel_for(std::ssize(active), [&](std::ptrdiff_t k) {
            Lanes part(0.0);
            for (const auto& interval : active[k])
                for (std::ptrdiff_t i = interval.begin; i < interval.end; ++i) part += f(i);
            parts[k] = part;
        });
        Lanes total(0.0);
        for (const Lanes& part : parts) total += part;
        return total;
    }

    Lanes dot(const Lanes* one, const Lanes* other) const
    {
        return sum_of([&](std::ptrdiff_t i) { return one[i] * other[i]; });
    }
    Lanes size(const Lanes* of) const
    {
        return sum_of([&](std::ptrdiff_t i) { return quotient(of[i] * of[i], work.sums[i]); });
    }
    /// q = A times `from`.
    void product(const Lanes* from)
    {
        system.matrix.multiply(from, work.q.data());
        scheme.hold(system, work.q.data());
    }
    /// r = b - A x.
    void start(Lanes* b)
    {
        scheme.hold(system, b);
        scheme.hold(system, x);
        product(x);
        for_each([&](std::ptrdiff_t i) { work.r[i] = b[i] - work.q[i]; });
        whole = larger(size(b), size(work.r.data()));  // b may be zero although x is not
        clear(work.p, system.space.count());
    }

    bool is_done()
    {
        const Lanes left = size(work.r.data());
        bool is_done     = true;
        for (int k = 0; k < 8; ++k) {
            auto is_within       = [&](double tolerance) { return left[k] <= tolerance * tolerance * whole[k]; };
            const bool is_enough = is_within(enough);
            if (is_enough || further[k] > 0) {
                if (is_within(best) || further[k] >= most_further || (further[k] > 0 && left[k] > 1e4 * least[k])) goes_on[k] = 0;
                least[k] = further[k] > 0 ? std::min(least[k], left[k]) : left[k];
                further[k] += 1;
            }
            is_done = is_done && (goes_on[k] == 0 || (is_enough && !system.factor));
        }
        return is_done;
    }
    Lanes precondition()
    {
        scheme.precondition(system);
        return dot(work.r.data(), work.z.data());
    }
    void turn(const Lanes& beta)
    {
        for_each([&](std::ptrdiff_t i) { work.p[i] = work.z[i] + work.p[i] * beta; });
    }
    Lanes multiply()
    {
        product(work.p.data());
        return dot(work.p.data(), work.q.data());
    }
    void add_direction(const Lanes& alpha)
    {
        const Lanes step = alpha * goes_on;
        for_each([&](std::ptrdiff_t i) {
            x[i] += work.p[i] * step;
            work.r[i] -= work.q[i] * step;
        });
    }
    /// The function with the largest residual.
    std::size_t worst() const
    {
        auto part            = [&](std::ptrdiff_t i) { return largest(quotient(fabs(work.r[i]), work.sums[i])); };
        std::ptrdiff_t found = active[0][0].begin;
        for (const auto& piece : active)
            for (const auto& interval : piece)
                for (std::ptrdiff_t i = interval.begin; i < interval.end; ++i)
                    if (part(i) > part(found)) found = i;
        return static_cast<std::size_t>(found);
    }
};

/// Solves A x = b by conjugate gradients, lane by lane, starting from the given x; overwrites b. `work.sums` has the row sums.
template <int D>
void SplineScheme<D>::solve(State<D>& s, const System& system, Lanes* x, Lanes* b) const
{
    const int most              = system.factor ? 3000 : 200;
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = system.space.count();
    const auto n                = static_cast<std::ptrdiff_t>(functions);
    for (Array<Lanes>* array : {&work.r, &work.z, &work.p, &work.q}) keep_room(*array, functions);
    if (system.factor)  // without particles the penalty scales the residual
        parallel_for_each(n, [&](std::ptrdiff_t i) { work.sums[i] = larger(work.sums[i], system.ghost_weight); });

    Conjugate vectors{*this, system, x, work, system.matrix.active()};
    vectors.start(b);
    const int iterations = conjugate_gradients(vectors, most);
    work.iterations[system.solve] += iterations;
    ++work.solves;
    if (iterations < most || vectors.is_done()) return;
    throw NumericalError(fmt::format("step {}, t = {:.6g} s: {} near {} does not converge in {} iterations: the particles "
                                     "hardly determine the splines there; more particles a cell may help",
                                     s.n, s.t, system.what, place_text(place_of(model(), system.space.center(vectors.worst()))),
                                     most));
}

/// The preconditioner of a system of a body with free surfaces. Later stages of a step use that of the first, as long as the same
/// functions are active: their matrices differ little, and to factor takes longer than to solve.
template <int D>
CutFactor<D>& SplineScheme<D>::factor_of(SplineSolve::Kind solve, const SplineMatrix<D>& matrix) const
{
    std::optional<CutFactor<D>>& factor = scratch_->factors[solve];
    if (!scratch_->is_near || !factor || !factor->is_for(matrix)) factor.emplace(matrix);
    return *factor;
}

/// Throws if a function cannot be fitted: it has too few particles in its support, or depends linearly on others.
template <int D>
void SplineScheme<D>::require_enough(State<D>& s, const System& system) const
{
    SplineScratch<D>& work = *scratch_;
    constexpr double least = 0.02;
    auto refuse            = [&](std::size_t function) {
        throw NumericalError(fmt::format("step {}, t = {:.6g} s: {} near {} has too few particles: splines of degree {} need two "
                                                               "or more a cell along each axis, everywhere in a grid that the body fills",
                                                    s.n, s.t, system.what, place_text(place_of(model(), system.space.center(function))),
                                                    system.space.axis[0].degree));
    };
    if (system.factors && system.factors->poor) refuse(*system.factors->poor);
    if (system.factor) {
        // Polynomials of their degree would vanish at all particles, and the gradients of fits could be anything.
        const int degree = system.space.axis[0].degree, needed = power_of(degree + 1, D);
        if (s.particles.count < needed)
            throw NumericalError(
                fmt::format("step {}, t = {:.6g} s: {}: {} particles are too few for splines of degree {}, which need {} "
                            "or more in a body; use a finer grid",
                            s.n, s.t, system.what, s.particles.count, degree, needed));
        clear(work.q, system.space.count());
        integrate_functions(system.space, work.q.data());
    }
    for (std::size_t i = 0; i < system.space.count(); ++i) {
        const double whole = cell_volume_ * system.space.integral(i);
        if (system.factor && work.q[i][0] < 0.5 * whole) continue;
        if (!(work.sums[i][SplineLane::density] >= least * whole)) refuse(i);  // summed with volumes
    }
    if (!system.factor && static_cast<std::size_t>(s.particles.count) < system.space.count()) refuse(system.space.count() / 2);
}

template <int D>
template <class Value>
void SplineScheme<D>::set_values(const State<D>& s, const Value& value) const
{
    keep_room(scratch_->values, s.particles.count);
    parallel_for_each(s.particles.count, [&](std::ptrdiff_t i) { scratch_->values[i] = value(i); });
}

/// Fits x to work.values, each lane with its weight.
template <int D>
void SplineScheme<D>::fit(State<D>& s, const FitTask& task, Array<Lanes>& x) const
{
    const Weight weight{s.particles.view(), task.has_mass};
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = task.space.count();
    if (!work.is_near) clear(x, functions);
    clear(work.b, functions);
    const Lanes ghost_weight = task.ghost ? mean_weight(weight) * (kGhostOfFits * cell_volume_) : Lanes(0.0);
    with_degree(task.space.axis[0].degree, [&]<int P>() {
        if (task.has_mass)
            find_system_of_particles<P, 2>(task, weight, ghost_weight);
        else
            find_system_of_particles<P, 1>(task, weight, ghost_weight);
    });
    find_row_sums(work.fitted, functions);
    Factors factors;
    if (!task.ghost) factors = factor_axes(work.fitted, task.space, task.axes_free);
    const System system{.solve        = task.solve,
                        .what         = task.what,
                        .space        = task.space,
                        .free         = task.free,
                        .ghost_weight = ghost_weight,
                        .factor       = task.ghost ? &factor_of(task.solve, work.fitted) : nullptr,
                        .factors      = task.ghost ? nullptr : &factors,
                        .matrix       = work.fitted};
    if (!task.ghost || task.is_known) require_enough(s, system);
    solve(s, system, x.data(), work.b.data());
}

/// The matrix and right-hand side of a fit, with W weights a particle.
template <int D>
template <int P, int W>
void SplineScheme<D>::find_system_of_particles(const FitTask& task, const Weight& weight, const Lanes& ghost_weight) const
{
    SplineScratch<D>& work = *scratch_;
    work.fitted.clear(task.space, W, task.ghost ? P + 1 : P);
    for_each_cell([&](const Index<D>& cell, int number) {
        if (work.first[number] == work.first[number + 1]) return;
        spread_cell<D, P>(
            task.space, work, task.rows, cell, number, [&](int i) { return work.values[i] * weight(i); }, work.b.data());
        CellPairs<D, P, W> pairs;
        pairs.set_points(
            work.first[number], work.first[number + 1],
            [&](std::ptrdiff_t k) {
                Vec<D, const double*> rows{};
                for (int a = 0; a < D; ++a) rows[a] = task.rows.weights.data() + k * task.rows.width + a * (P + 1);
                return rows;
            },
            [&](std::ptrdiff_t k) {
                const Lanes both = weight(work.order[k]);
                if constexpr (W == 1)
                    return std::array{both[0]};
                else
                    return std::array{both[0], both[4]};
            });
        work.fitted.add(cell, pairs);
    });
    if (task.ghost) {
        const double weights[] = {ghost_weight[0], ghost_weight[4]};
        task.ghost->add_to(work.fitted, weights);
    }
    work.fitted.finish();
}

/// Finds the body: fits splines to the values of its level sets at the initial positions of the particles.
template <int D>
void SplineScheme<D>::find_body(State<D>& s) const
{
    SplineScratch<D>& work         = *scratch_;
    const ParticleView<D> p        = s.particles.view();
    const std::vector<Cover> rough = cover_by_particles(model(), s.particles, work.order, work.first);
    work.body.v                    = GhostPenalty<D>(v_space_, cells_, rough);
    const FitTask task{.solve = SplineSolve::surface,
                       .what  = "the fit of the surface",
                       .space = v_space_,
                       .rows  = work.v_rows,
                       .ghost = &work.body.v};
    set_values(s, [&](std::ptrdiff_t i) {
        Lanes r(0.0);
        for (std::size_t k = 0; k < model().surface.size(); ++k) r[static_cast<int>(k)] = model().surface[k](p.X[i]);
        return r;
    });
    fit(s, task, work.surface);
    ordo::find_body(model(), v_space_, s_space_, work.surface.data(), rough, points_, work.body);
}

template <int D>
void SplineScheme<D>::fit_velocity(State<D>& s) const
{
    SplineScratch<D>& work  = *scratch_;
    const ParticleView<D> p = s.particles.view();
    const FitTask task{.solve     = SplineSolve::velocity,
                       .what      = "the fit of velocities",
                       .space     = v_space_,
                       .rows      = work.v_rows,
                       .ghost     = is_cut_ ? &work.body.v : nullptr,
                       .free      = &Held::velocity,
                       .axes_free = &velocity_free_,
                       .has_mass  = true,
                       .is_known  = true};
    set_values(s, [&](std::ptrdiff_t i) {
        Lanes r(0.0);
        for (int a = 0; a < D; ++a) {
            r[SplineLane::velocity + a]     = p.v[i][a];
            r[SplineLane::acceleration + a] = model().gravity[a] + (p.b ? p.b[i][a] : 0.0);
        }
        r[SplineLane::density] = p.m[i] / p.V[i];
        return r;
    });
    fit(s, task, work.v);
}

template <int D>
void SplineScheme<D>::fit_stress(State<D>& s) const
{
    SplineScratch<D>& work  = *scratch_;
    const ParticleView<D> p = s.particles.view();
    const FitTask task{.solve    = SplineSolve::stress,
                       .what     = "the fit of stresses",
                       .space    = s_space_,
                       .rows     = work.s_rows,
                       .ghost    = is_cut_ ? &work.body.s : nullptr,
                       .is_known = true};
    set_values(s, [&](std::ptrdiff_t i) { return stress_lanes(p.sigma[i]); });
    fit(s, task, work.s);
}

#define ORDO_SPLINE_FIT(D)                                                                                                 \
    template void SplineScheme<D>::find_body(State<D>&) const;                                                             \
    template void SplineScheme<D>::fit_velocity(State<D>&) const;                                                          \
    template void SplineScheme<D>::fit_stress(State<D>&) const;                                                            \
    template void SplineScheme<D>::solve(State<D>&, const System&, Lanes*, Lanes*) const;                                  \
    template void SplineScheme<D>::find_row_sums(SplineMatrix<D>&, std::size_t) const;                                     \
    template typename SplineScheme<D>::Factors SplineScheme<D>::factor_axes(const SplineMatrix<D>&, const SplineSpace<D>&, \
                                                                            const std::array<AxisEnds, D>*) const;         \
    template CutFactor<D>& SplineScheme<D>::factor_of(SplineSolve::Kind, const SplineMatrix<D>&) const;
ORDO_SPLINE_FIT(1)
ORDO_SPLINE_FIT(2)
ORDO_SPLINE_FIT(3)
#undef ORDO_SPLINE_FIT

}  // namespace ordo
