#include "spline/scheme.hpp"

#include "method/diagnostics.hpp"
#include "method/sums.hpp"
#include "particles/sort.hpp"
#include "spline/parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace ordo {

namespace {

/// A Runge-Kutta scheme in which each stage uses only the slope of the stage before it.
struct RungeKutta {
    int stages;
    std::array<double, 4> at;      ///< time of each stage, in steps: how far the slope of the stage before is followed
    std::array<double, 4> weight;  ///< of the slope of each stage
};

/// Heun's third-order scheme and the classical fourth-order scheme (Hairer, Norsett & Wanner 1993, sec. II.1).
RungeKutta runge_kutta(TimeScheme scheme)
{
    if (scheme == TimeScheme::rk3) return {3, {0, 1.0 / 3, 2.0 / 3}, {0.25, 0, 0.75}};
    return {4, {0, 0.5, 0.5, 1}, {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}};
}

/// Values of the functions of an axis at the Gauss points, or with h > 0 their slopes for cells of length h.
GaussRows gauss_rows(const SplineAxis& axis, int points, double h = 0.0)
{
    GaussRows rows{.points = points, .width = axis.degree + 1, .at = {}};
    for_each_gauss_point(axis, points, [&](int, double, double, int, const double* w, const double* dw) {
        for (int j = 0; j <= axis.degree; ++j) rows.at.push_back(h > 0 ? dw[j] / h : w[j]);
    });
    return rows;
}

/// A particle further than this outside a face, in cells, has left the grid.
constexpr double kOutside = 1e-6;

/// The splines of given degree along an axis of the grid.
template <int D>
SplineAxis axis_of(const Model<D>& model, int a, int degree, double removed)
{
    SplineAxis axis;
    axis.degree   = degree;
    axis.cells    = model.cells[a];
    axis.removed  = static_cast<int>(removed);
    axis.periodic = model.periodic[a];
    return axis;
}

/// use(i, the spline with coefficients `from` at particle i) for the particles i of a cell.
template <int D, int P, class Use>
ORDO_FLAT inline void collect_cell(const SplineSpace<D>& space, const SplineScratch<D>& work, const SampleRows& rows,
                                   const Index<D>& at, int number, const Lanes* from, const Use& use)
{
    if (work.first[number] == work.first[number + 1]) return;
    SplineCell<D, P> cell(space, at);
    cell.load(from);
    for (int k = work.first[number]; k < work.first[number + 1]; ++k)
        use(work.order[k], cell.collect(rows.weights.data() + static_cast<std::ptrdiff_t>(k) * rows.width));
}

}  // namespace

int least_spline_cells(const MethodSpec& method)
{
    return 1 + 2 * static_cast<int>(std::max(method.removed_knots, method.removed_stress_knots));
}

template <int D>
void require_spline_model(const Model<D>& model)
{
    const std::string only = "projection spline-fit ";
    const int least        = least_spline_cells(model.method);
    for (int a = 0; a < D; ++a)
        if (!model.periodic[a] && model.cells[a] < least)
            throw InputError(fmt::format(
                "grid: {} cells along {} are too few for splines without {} knots next to each wall; there must be {}",
                model.cells[a], "xyz"[a], least / 2, least));
    for (const Material& m : model.materials)
        if (!m.law->in<D>().stress_rate || m.branches.count > 0)
            throw InputError(only +
                             "takes no material with history: the stages of a step would need it several times; use cpdi2");
    for (const Material& m : model.materials)
        if (m != model.materials[0])
            throw InputError(only + "takes bodies of one material: splines do not follow a jump of density or stress; use cpdi2");
    if (!model.tractions.empty()) throw InputError(only + "takes no [[traction]]: use cpdi2");
    if (!model.surface.empty() && model.method.basis == Basis::hat)
        throw InputError(only +
                         "takes bodies with free surfaces only with basis bspline2 to bspline5: with hats waves grow there");
    if (!model.walls.empty())
        throw InputError(only +
                         "takes no [[boundary]] of type \"wall\": within a Runge-Kutta step nothing could leave it; use bscpdi2");
    std::array<std::array<bool, 2>, D> is_walled{};
    for (const Condition<D>& b : model.conditions) {
        if (b.is_prescribed())
            throw InputError(only + "takes walls at rest: [[boundary]] type \"fixed\" or \"symmetry\", not a given motion");
        if (!b.is_plane() || is_inner_plane(model, b))
            throw InputError(only + "takes walls on faces of the grid only: move the [[boundary]] or the grid's face");
        is_walled[b.axis][b.outer_is_above] = true;
    }
    for (int a = 0; a < D; ++a)
        for (const int side : {0, 1})
            if (!model.periodic[a] && !is_walled[a][side] && model.surface.empty())
                throw InputError(
                    fmt::format("{}needs a wall on every face of the grid, because the body fills it: put a [[boundary]] "
                                "of type \"symmetry\" or \"fixed\" on {}-{}",
                                only, "xyz"[a], side ? "max" : "min"));
}

template <int D>
SplineScheme<D>::SplineScheme(Model<D> of) : Scheme<D>(std::move(of)), cells_(model().cells), is_cut_(!model().surface.empty())
{
    require_spline_model(model());
    const MethodSpec& method = model().method;
    const int degree = degree_of(method.basis), stress_degree = static_cast<int>(method.stress_degree);
    points_      = std::max(degree, stress_degree) + 1;
    per_cell_    = power_of(points_, D);
    cell_count_  = number_of(cells_ - Index<D>::filled(1), cells_) + 1;
    gauss_count_ = cell_count_ * per_cell_;
    cell_volume_ = 1.0;
    for (int a = 0; a < D; ++a) {
        cell_volume_ *= model().h[a];
        v_space_.axis[a] = axis_of(model(), a, degree, method.removed_knots);
        s_space_.axis[a] = axis_of(model(), a, stress_degree, method.removed_stress_knots);
    }
    hold_walls();
    find_holders();

    for (int a = 0; a < D; ++a) set_axis(a);
    const auto rule = gauss_rule(points_);
    IndexBox<D>{{}, Index<D>::filled(points_)}.for_each([&](const Index<D>& k) {
        double weight = cell_volume_;
        for (int a = 0; a < D; ++a) weight *= rule[k[a]].weight;
        gauss_weights_.push_back(weight);
    });
    set_colours();
}

/// Sets the tables of an axis: functions at Gauss points and vertices, and the integrals for projections.
template <int D>
void SplineScheme<D>::set_axis(int a)
{
    const SplineAxis &v = v_space_.axis[a], &s = s_space_.axis[a];
    gauss_[a]        = gauss_rows(v, points_);
    gauss_slopes_[a] = gauss_rows(v, points_, model().h[a]);
    s_gauss_[a]      = gauss_rows(s, points_);
    values_[a] = slopes_[a] = AxisMatrix(s.count(), v.count());
    for_each_gauss_point(v, points_, [&](int cell, double at, double weight, int span, const double* w, const double* dw) {
        with_degree(s.degree, [&]<int P>() {
            double ws[P + 1], dws[P + 1];
            const int s_span = s.span_of(cell);
            s.row<P>(s_span, cell + at, ws, dws);
            for (int i = 0; i <= P; ++i)
                for (int j = 0; j <= v.degree; ++j) {
                    values_[a].add(s.wrapped(s_span + i), v.wrapped(span + j), weight * ws[i] * w[j]);
                    slopes_[a].add(s.wrapped(s_span + i), v.wrapped(span + j), weight * ws[i] * dw[j] / model().h[a]);
                }
        });
    });
    values_back_[a] = values_[a].transposed();
    slopes_back_[a] = slopes_[a].transposed();
    at_vertices_[a] = AxisMatrix(model().cells[a] + 1, v.count());
    with_degree(v.degree, [&]<int P>() {
        double w[P + 1], dw[P + 1];
        for (int k = 0; k <= model().cells[a]; ++k) {
            const int span = v.span_of(std::min(k, model().cells[a] - 1));
            v.row<P>(span, k, w, dw);
            for (int j = 0; j <= P; ++j) at_vertices_[a].add(k, v.wrapped(span + j), w[j]);
        }
    });
    s_factors_[a] = unit_mass(s);
}

/// Divides the cells into blocks and colours; blocks of one colour share no function.
template <int D>
void SplineScheme<D>::set_colours()
{
    // Cells share no function if they are more than the degree plus the removed knots apart.
    const SplineAxis &v = v_space_.axis[0], &s = s_space_.axis[0];
    const int apart = std::max(v.degree + v.removed, s.degree + s.removed) + 1;
    std::array<std::vector<int>, D> bounds;
    Index<D> parts{};
    for (int a = 0; a < D; ++a) {
        parts[a] = std::max(1, cells_[a] / apart);
        if (model().periodic[a] && parts[a] > 1) parts[a] -= parts[a] % 2;  // the last is next to the first
        for (int k = 0; k <= parts[a]; ++k) bounds[a].push_back(static_cast<int>(static_cast<long>(k) * cells_[a] / parts[a]));
    }
    IndexBox<D>{{}, parts}.for_each([&](const Index<D>& k) {
        IndexBox<D> box{};
        int colour = 0;
        for (int a = 0; a < D; ++a) {
            box.lo[a] = bounds[a][k[a]];
            box.hi[a] = bounds[a][k[a] + 1];
            colour |= (k[a] % 2) << a;
        }
        blocks_[colour].push_back(box);
    });
}

/// Finds the functions that walls hold.
template <int D>
void SplineScheme<D>::hold_walls()
{
    for (auto& ends : velocity_free_) ends = kFreeEnds;
    for (auto& ends : acceleration_free_) ends = kFreeEnds;
    for (const Condition<D>& b : model().conditions)
        for (int c = 0; c < D; ++c)
            if (b.constrains(c)) {
                velocity_free_[b.axis][b.outer_is_above][SplineLane::velocity + c]         = 0.0;
                acceleration_free_[b.axis][b.outer_is_above][SplineLane::acceleration + c] = 0.0;
            }
    const Index<D> counts = v_space_.counts();
    for (int a = 0; a < D; ++a) {
        if (model().periodic[a]) continue;
        // A function on an edge is listed for both walls; to mask a lane twice does no harm.
        for (const int side : {0, 1}) {
            IndexBox<D> face{{}, counts};
            face.lo[a] = side ? counts[a] - 1 : 0;
            face.hi[a] = face.lo[a] + 1;
            face.for_each([&](const Index<D>& k) {
                held_.push_back({v_space_.number(k), velocity_free_[a][side], acceleration_free_[a][side]});
            });
        }
    }
}

/// Finds which boundary holds each held component; of several the last.
template <int D>
void SplineScheme<D>::find_holders()
{
    const Index<D> counts = v_space_.counts();
    std::map<std::pair<std::size_t, int>, int> boundary;
    for (const Condition<D>& b : model().conditions) {
        IndexBox<D> face{{}, counts};
        face.lo[b.axis] = b.outer_is_above ? counts[b.axis] - 1 : 0;
        face.hi[b.axis] = face.lo[b.axis] + 1;
        face.for_each([&](const Index<D>& k) {
            for (int c = 0; c < D; ++c)
                if (b.constrains(c)) boundary[{v_space_.number(k), c}] = b.boundary;
        });
    }
    for (const auto& [held, number] : boundary) holders_.push_back({held.first, held.second, number});
}

/// The accelerations of held components in records of functions.
template <int D>
std::vector<double> SplineScheme<D>::of_holders(const Lanes* records) const
{
    std::vector<double> r;
    for (const Holder& h : holders_) r.push_back(records[h.function][SplineLane::acceleration + h.component]);
    return r;
}

/// Adds the forces of walls at a stage with a weight: M a - f at the functions that they hold. Walls are at rest, so there is no work.
template <int D>
void SplineScheme<D>::add_reactions(State<D>& s, double part) const
{
    SplineScratch<D>& work = *scratch_;
    keep_room(work.sums, v_space_.count());
    work.mass.multiply(work.a.data(), work.sums.data());
    const std::vector<double> inertia = of_holders(work.sums.data());
    for (std::size_t k = 0; k < holders_.size(); ++k)
        s.account.boundaries[holders_[k].boundary].force[holders_[k].component] += part * (inertia[k] - work.forces[k]);
}

/// Adds the work of a stage to the account, with its weight times dt: of forces along v_h.
template <int D>
void SplineScheme<D>::add_work(State<D>& s, double part) const
{
    const SplineScratch<D>& work = *scratch_;
    const ParticleView<D> p      = s.particles.view();
    enum { stresses, gravity, loads };
    const Numbers<3> sums = sum_over_particles<3>(s, [&](int i) {
        Numbers<3> r;
        for (int a = 0; a < D; ++a) {
            for (int b = 0; b < D; ++b) r[stresses] -= part * p.V[i] * p.sigma[i](a, b) * work.L_at[i](a, b);
            r[gravity] += part * p.m[i] * model().gravity[a] * work.v_at[i][a];
            if (p.b) r[loads] += part * p.m[i] * p.b[i][a] * work.v_at[i][a];
        }
        return r;
    });
    s.account.nodes += {.stresses = sums[stresses], .loads = sums[loads], .gravity = sums[gravity]};
}

/// Lists the particles of each cell, and evaluates the functions at the particles.
template <int D>
void SplineScheme<D>::sort(State<D>& s) const
{
    SplineScratch<D>& work  = *scratch_;
    const ParticleView<D> p = s.particles.view();
    auto place = [&](int i, int a) { return v_space_.axis[a].inside((p.x[i][a] - model().origin[a]) / model().h[a]); };
    Array<std::uint64_t> keys(p.count);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        Index<D> cell{};
        for (int a = 0; a < D; ++a) cell[a] = v_space_.axis[a].cell_of(place(static_cast<int>(i), a));
        keys[i] = static_cast<std::uint64_t>(number_of(cell, cells_));
    });
    work.order = sort_keys(keys, static_cast<std::uint64_t>(cell_count_));
    if (work.order.empty()) {
        work.order = Array<int>(p.count);
        for (int i = 0; i < p.count; ++i) work.order[i] = i;
    }
    work.first.assign(cell_count_ + 1, 0);
    for (const std::uint64_t key : keys) ++work.first[key + 1];
    for (int c = 0; c < cell_count_; ++c) work.first[c + 1] += work.first[c];

    auto fill = [&](const SplineSpace<D>& space, SampleRows& rows) {
        with_degree(space.axis[0].degree, [&]<int P>() {
            rows.width = D * (P + 1);
            keep_room(rows.weights, static_cast<std::size_t>(p.count) * rows.width);
            parallel_for_each(p.count, [&](std::ptrdiff_t k) {
                double w[P + 1], dw[P + 1];
                for (int a = 0; a < D; ++a) {
                    const SplineAxis& axis = space.axis[a];
                    const double y         = place(work.order[k], a);
                    axis.row<P>(axis.span_of(axis.cell_of(y)), y, w, dw);
                    std::copy(w, w + P + 1, rows.weights.data() + k * rows.width + a * (P + 1));
                }
            });
        });
    };
    fill(v_space_, work.v_rows);
    fill(s_space_, work.s_rows);
}

template <int D>
void SplineScheme<D>::evaluate(State<D>& s) const
{
    scratch_->is_near = false;
    find_slopes(s);
}

/// v_h, a_h and L_h at the particles.
template <int D>
void SplineScheme<D>::find_slopes(State<D>& s) const
{
    SplineScratch<D>& work = *scratch_;
    {
        Stopwatch watch(times(), StageTimes::sort);
        sort(s);
    }
    if (is_cut_) {
        Stopwatch watch(times(), StageTimes::fit);
        find_body(s);
    }
    {
        Stopwatch watch(times(), StageTimes::fit);
        fit_velocity(s);
        fit_stress(s);
    }
    {
        Stopwatch watch(times(), StageTimes::nodes);
        find_density(s);
        find_mass(s);
        solve_acceleration(s);
        project_gradient(s);
    }
    Stopwatch watch(times(), StageTimes::gather);
    const std::size_t n = s.particles.count;
    keep_room(work.v_at, n);
    keep_room(work.a_at, n);
    keep_room(work.L_at, n);
    const Lanes only = make_lanes(0, 0, 0, 0, 1, 1, 1, 0);
    parallel_for_each(static_cast<std::ptrdiff_t>(v_space_.count()),
                      [&](std::ptrdiff_t i) { work.part[i] = work.v[i] * (1.0 - only) + work.a[i] * only; });
    with_degree(v_space_.axis[0].degree, [&]<int P>() {
        for_each_cell([&](const Index<D>& cell, int number) {
            collect_cell<D, P>(v_space_, work, work.v_rows, cell, number, work.part.data(), [&](int i, const Lanes& sum) {
                for (int a = 0; a < D; ++a) {
                    work.v_at[i][a] = sum[SplineLane::velocity + a];
                    work.a_at[i][a] = sum[SplineLane::acceleration + a];
                }
            });
        });
    });
    with_degree(s_space_.axis[0].degree, [&]<int P>() {
        for_each_cell([&](const Index<D>& cell, int number) {
            for (int b = 0; b < D; ++b)
                collect_cell<D, P>(s_space_, work, work.s_rows, cell, number, work.L[b].data(), [&](int i, const Lanes& sum) {
                    for (int a = 0; a < D; ++a) work.L_at[i](a, b) = sum[SplineLane::velocity + a];
                });
        });
    });
}

/// Stores the particles at the start of a step.
template <int D>
void SplineScheme<D>::remember(State<D>& s) const
{
    const ParticleView<D> p = s.particles.view();
    SplineScratch<D>& work  = *scratch_;
    const std::size_t n     = p.count;
    for (Array<Vec<D>>* array : {&work.x0, &work.v0, &work.dx, &work.dv}) keep_room(*array, n);
    for (Array<Mat<D>>* array : {&work.F0, &work.dF}) keep_room(*array, n);
    for (Array<Stress<D>>* array : {&work.sigma0, &work.dsigma}) keep_room(*array, n);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        work.x0[i]     = p.x[i];
        work.v0[i]     = p.v[i];
        work.F0[i]     = p.F[i];
        work.sigma0[i] = p.sigma[i];
        work.dx[i] = work.dv[i] = Vec<D>{};
        work.dF[i]              = Mat<D>{};
        work.dsigma[i]          = Stress<D>{};
    });
}

template <int D>
void SplineScheme<D>::restore(State<D>& s) const
{
    const ParticleView<D> p      = s.particles.view();
    const SplineScratch<D>& work = *scratch_;
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        p.x[i]     = work.x0[i];
        p.v[i]     = work.v0[i];
        p.F[i]     = work.F0[i];
        p.sigma[i] = work.sigma0[i];
        p.V[i]     = det(p.F[i]) * p.V0[i];
    });
}

/// Adds the slope of a stage to the sums of each particle, and moves the particles to the next stage or, after the last, to the
/// end of the step. `part` is the weight of the slope times dt, `further` the time from the start of the step to the next
/// stage, both in s. Returns faults and the largest displacement.
template <int D>
TileReport SplineScheme<D>::add_slope(State<D>& s, double part, double further, bool is_last) const
{
    const ParticleView<D> p = s.particles.view();
    SplineScratch<D>& work  = *scratch_;
    return parallel_reduce(
        p.count, TileReport{},
        [&](std::ptrdiff_t i) {
            const Mat<D>& L            = work.L_at[i];
            const Mat<D> slope         = L * p.F[i];
            const Material& material   = model().materials[p.material[i]];
            const LawFunctions<D>& law = material.law->in<D>();
            const Stress<D> rate       = law.stress_rate(material, p.sigma[i], L);
            work.dx[i] += part * work.v_at[i];
            work.dv[i] += part * work.a_at[i];
            work.dF[i] += part * slope;
            work.dsigma[i] += part * rate;
            p.x[i]         = work.x0[i] + (is_last ? work.dx[i] : further * work.v_at[i]);
            p.v[i]         = work.v0[i] + (is_last ? work.dv[i] : further * work.a_at[i]);
            p.F[i]         = work.F0[i] + (is_last ? work.dF[i] : further * slope);
            p.sigma[i]     = material.law->is_hyperelastic ? law.initial_stress(material, p.F[i])
                                                           : work.sigma0[i] + (is_last ? work.dsigma[i] : further * rate);
            const double J = det(p.F[i]);
            p.V[i]         = J * p.V0[i];
            TileReport r;
            if (!std::isfinite(norm(p.x[i]) + norm(p.v[i]) + J)) r.flag(Fault::not_finite, static_cast<int>(i));
            if (!(J > 0)) r.flag(Fault::inverted, static_cast<int>(i));
            for (int a = 0; a < D; ++a) {
                r.move         = larger(r.move, std::fabs(p.x[i][a] - work.x0[i][a]) / model().h[a]);
                const double y = (p.x[i][a] - model().origin[a]) / model().h[a];
                if (!model().periodic[a] && !(y >= -kOutside && y <= model().cells[a] + kOutside))
                    r.flag(Fault::left_grid, static_cast<int>(i));
            }
            return r;
        },
        [](TileReport& total, const TileReport& one) {
            total.move = larger(total.move, one.move);
            if (one.fault != Fault::none) total.flag(one.fault, one.particle);
        });
}

template <int D>
void SplineScheme<D>::take_step(State<D>& s, double dt) const
{
    const RungeKutta scheme = runge_kutta(model().method.scheme);
    SplineScratch<D>& work  = *scratch_;
    const double t          = s.t;
    double unresolved       = 0.0;  // kinetic energy of the particles that is not in v_h, J
    work.iterations         = {};
    work.solves             = 0;
    remember(s);
    for (int k = 0; k < scheme.stages; ++k) {
        this->evaluate_external_forces(s, t + scheme.at[k] * dt);
        work.is_near = k > 0;
        try {
            find_slopes(s);
        } catch (const NumericalError&) {
            restore(s);
            throw;
        }
        Stopwatch watch(times(), StageTimes::gather);
        if (k == 0) {
            show(s);
            if (s.projection.is_wanted) report(s);
            // Nothing else damps the velocity outside the spline space. The fit stays the same: that of v_h(x_p) is v_h.
            const double before = s.account.is_wanted ? kinetic_energy(s, work.v0.data()) : 0.0;
            parallel_for_each(s.particles.count,
                              [&](std::ptrdiff_t i) { work.v0[i] -= model().method.null_damping * (work.v0[i] - work.v_at[i]); });
            if (s.account.is_wanted) {
                const double after = kinetic_energy(s, work.v0.data());
                unresolved         = after - kinetic_energy(s, work.v_at.data());
                s.account.filtered += before - after;
            }
        }
        if (s.account.is_wanted) {
            add_reactions(s, scheme.weight[k]);
            add_work(s, dt * scheme.weight[k]);
        }
        const bool is_last   = k + 1 == scheme.stages;
        const double further = is_last ? 0.0 : dt * scheme.at[k + 1], part = dt * scheme.weight[k];
        const TileReport found = add_slope(s, part, further, is_last);
        s.report               = found;
        if (found.fault != Fault::none) break;
    }
    if (s.account.is_wanted) s.account.nodal_kinetic = kinetic_energy(s, s.particles.v.data()) - unresolved;
    if (times()) {
        for (const long n : work.iterations) times()->mass_iterations += n;
        times()->mass_solves += work.solves;
    }
    this->advance_time(s, dt);
    s.t_v = s.t_F = s.t;
}

/// Whether a cell at a vertex is not empty.
template <int D>
bool SplineScheme<D>::is_seen(const Index<D>& vertex) const
{
    bool r = !is_cut_;
    for_each_cell_of(model(), {vertex - Index<D>::filled(1), vertex + Index<D>::filled(1)},
                     [&](int cell) { r = r || cover_of(cell) != Cover::none; });
    return r;
}

template <int D>
void SplineScheme<D>::show(State<D>& s) const
{
    SplineScratch<D>& work = *scratch_;
    Index<D> counts        = cells_ + Index<D>::filled(1);
    std::size_t vertices   = 1;
    std::array<const AxisMatrix*, D> matrices{};
    for (int a = 0; a < D; ++a) {
        vertices *= counts[a];
        matrices[a] = &at_vertices_[a];
    }
    keep_room(work.column, vertices);
    along_axes<D>(matrices, work.between, work.v.data(), work.column.data());
    std::ptrdiff_t number = 0;
    IndexBox<D>{{}, counts}.for_each([&](const Index<D>& k) {
        const Lanes from = is_seen(k) ? work.column[number] : Lanes(0.0);
        ++number;
        const Index<D> at = k + Index<D>::filled(s.lattice.margin);
        double volume     = 1.0;
        for (int a = 0; a < D; ++a) volume *= s.lattice.node_length(a, at[a]);
        Lanes& to = s.field.nodes[s.lattice.offset(at)];
        to        = Lanes(0.0);
        for (int a = 0; a < D; ++a) to[NodeLane::velocity + a] = from[SplineLane::velocity + a];
        to[NodeLane::mass]   = from[SplineLane::density] * volume;
        to[NodeLane::volume] = volume;
    });
}

/// Reports mass and momentum of the particles and of the grid.
template <int D>
void SplineScheme<D>::report(State<D>& s) const
{
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = v_space_.count();
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.p[i]                      = work.v[i];
        work.p[i][SplineLane::density] = 1.0;
    });
    keep_room(work.q, functions);
    work.mass.multiply(work.p.data(), work.q.data());
    Lanes after = parallel_reduce(
        static_cast<std::ptrdiff_t>(functions), Lanes(0.0), [&](std::ptrdiff_t i) { return work.q[i]; }, add);
    static_assert(SplineLane::velocity == NodeLane::velocity);
    after[NodeLane::mass] = after[SplineLane::density];
    s.projection.set(mass_and_momentum(s), mass_and_momentum_of(after));
}

template <int D>
void SplineScheme<D>::find_projection(State<D>& s) const
{
    scratch_->is_near = false;
    sort(s);
    if (is_cut_) find_body(s);
    fit_velocity(s);
    find_density(s);
    find_mass(s);
    show(s);
    report(s);
}

template void require_spline_model(const Model<1>&);
template void require_spline_model(const Model<2>&);
template void require_spline_model(const Model<3>&);
template class SplineScheme<1>;
template class SplineScheme<2>;
template class SplineScheme<3>;

}  // namespace ordo
