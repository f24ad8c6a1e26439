// Integrals of SplineScheme over the body: mass, forces, and the projection of the velocity gradient.
#include "method/place.hpp"
#include "spline/parts.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace ordo {

namespace {

/// The ghost penalty of integrated matrices as a fraction of their mean weight, and the largest rate, c/h, at which damping by
/// it reduces jumps of the velocity; found by trial (docs/high_order.md).
constexpr double kGhostOfMasses = 1e-3, kGhostRate = 5;

}  // namespace

/// Values of a cell's functions at its Gauss points, with slopes along `slope_axis` unless that is -1.
template <int D>
Vec<D, const double*> SplineScheme<D>::tables(const SplineSpace<D>& space, int slope_axis, const Index<D>& cell) const
{
    Vec<D, const double*> r{};
    for (int a = 0; a < D; ++a) {
        const GaussRows& rows = &space == &s_space_ ? s_gauss_[a] : a == slope_axis ? gauss_slopes_[a] : gauss_[a];
        r[a]                  = rows.of_cell(cell[a]);
    }
    return r;
}

/// rho_h at the quadrature points, times their weights.
template <int D>
void SplineScheme<D>::find_density(State<D>& s) const
{
    SplineScratch<D>& work = *scratch_;
    keep_room(work.density, gauss_count_ + work.body.points.count());
    std::vector<unsigned char> is_negative(cell_count_, 0);
    with_degree(v_space_.axis[0].degree, [&]<int P>() {
        for_each_covered_cell([&](const Index<D>& at, int number, Cover cover) {
            SplineCell<D, P> cell(v_space_, at);
            cell.load(work.v.data());
            auto note = [&](double density) {
                if (!(density > 0)) is_negative[number] = 1;
                return density;
            };
            if (cover == Cover::part) {
                const CutPoints& points = work.body.points;
                for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k)
                    work.density[gauss_count_ + k] =
                        points.weights[k] * note(cell.collect(points.v_values.data() + k * points.v_width)[SplineLane::density]);
                return;
            }
            CellQuadrature<D, P> q(tables(v_space_, -1, at), points_);
            q.evaluate(cell);
            for (std::ptrdiff_t g = 0; g < per_cell_; ++g)
                work.density[number * per_cell_ + g] = gauss_weights_[g] * note(q.values[g][SplineLane::density]);
        });
    });
    const auto bad = std::find(is_negative.begin(), is_negative.end(), 1);
    if (bad == is_negative.end()) return;
    auto rest = static_cast<int>(bad - is_negative.begin());
    Vec<D> y{};
    for (int a = 0; a < D; ++a) {
        y[a] = rest % cells_[a] + 0.5;
        rest /= cells_[a];
    }
    throw NumericalError(
        fmt::format("step {}, t = {:.6g} s: the density that fits the particles is not positive in the cell at {}: "
                    "more particles a cell, a finer grid or a smaller deformation may help",
                    s.n, s.t, place_text(place_of(model(), y))));
}

/// M_ij = sum_g w_g rho_h N_i N_j over the quadrature points g.
template <int D>
void SplineScheme<D>::find_mass(State<D>& s) const
{
    SplineScratch<D>& work = *scratch_;
    work.ghost_weight      = is_cut_ ? mean_weight({s.particles.view(), true})[0] * kGhostOfMasses * cell_volume_ : 0.0;
    find_matrix(v_space_, work.body.v, work.ghost_weight, work.mass, [&](std::ptrdiff_t k) { return scratch_->density[k]; });
}

/// The matrix with weight(k) at the quadrature points k, plus the penalty.
template <int D>
template <class Value>
void SplineScheme<D>::find_matrix(const SplineSpace<D>& space, const GhostPenalty<D>& ghost, double ghost_weight,
                                  SplineMatrix<D>& matrix, const Value& weight) const
{
    const CutPoints& points = scratch_->body.points;
    matrix.clear(space, 1, space.axis[0].degree + (is_cut_ ? 1 : 0));
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell([&](const Index<D>& at, int number, Cover cover) {
            CellPairs<D, P, 1> pairs;
            if (cover == Cover::all) {
                double weights[power_of(kMaxGauss, D)];
                for (std::ptrdiff_t g = 0; g < per_cell_; ++g) weights[g] = weight(number * per_cell_ + g);
                pairs.set_grid(points_, tables(space, -1, at), weights);
            } else {
                pairs.set_points(
                    points.first[number], points.first[number + 1],
                    [&](std::ptrdiff_t k) {
                        const double* const row =
                            (&space == &s_space_ ? points.s_values : points.v_values).data() + k * D * (P + 1);
                        Vec<D, const double*> rows{};
                        for (int a = 0; a < D; ++a) rows[a] = row + a * (P + 1);
                        return rows;
                    },
                    [&](std::ptrdiff_t k) { return std::array{weight(gauss_count_ + k)}; });
            }
            matrix.add(at, pairs);
        });
    });
    if (is_cut_) ghost.add_to(matrix, &ghost_weight);
    matrix.finish();
}

/// The row of a cut point for a space, with slopes along `slope_axis` unless that is -1.
template <int D>
template <int P>
std::array<double, D*(P + 1)> SplineScheme<D>::cut_row(const CutPoints& points, std::ptrdiff_t k, const SplineSpace<D>& space,
                                                       int slope_axis) const
{
    std::array<double, D*(P + 1)> w;
    std::copy_n((&space == &s_space_ ? points.s_values : points.v_values).data() + k * std::ssize(w), w.size(), w.data());
    if (slope_axis >= 0) {
        const std::ptrdiff_t at = slope_axis * (P + 1);
        std::copy_n(points.v_slopes.data() + k * std::ssize(w) + at, P + 1, w.data() + at);
    }
    return w;
}

template <int D>
double SplineScheme<D>::point_weight(const CutPoints& points, std::ptrdiff_t k) const
{
    return k < gauss_count_ ? gauss_weights_[k % per_cell_] : points.weights[k - gauss_count_];
}

template <int D>
void SplineScheme<D>::evaluate_at_points(const SplineSpace<D>& space, int slope_axis, const Lanes* from) const
{
    SplineScratch<D>& work  = *scratch_;
    const CutPoints& points = work.body.points;
    Array<Lanes>& to        = work.at_points;
    keep_room(to, gauss_count_ + points.count());
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell([&](const Index<D>& at, int number, Cover cover) {
            SplineCell<D, P> cell(space, at);
            cell.load(from);
            if (cover == Cover::all) {
                CellQuadrature<D, P> q(tables(space, slope_axis, at), points_);
                q.evaluate(cell);
                for (std::ptrdiff_t g = 0; g < per_cell_; ++g) to[number * per_cell_ + g] = q.values[g] * gauss_weights_[g];
                return;
            }
            for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k)
                to[gauss_count_ + k] = cell.collect(cut_row<P>(points, k, space, slope_axis).data()) * points.weights[k];
        });
    });
}

template <int D>
template <class Value>
void SplineScheme<D>::integrate_at_points(const SplineSpace<D>& space, int slope_axis, const Value& value, Lanes* to) const
{
    SplineScratch<D>& work  = *scratch_;
    const CutPoints& points = work.body.points;
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell([&](const Index<D>& at, int number, Cover cover) {
            SplineCell<D, P> cell(space, at);
            cell.clear();
            if (cover == Cover::all) {
                CellQuadrature<D, P> q(tables(space, slope_axis, at), points_);
                const Lanes* from = work.at_points.data() + number * per_cell_;
                for (std::ptrdiff_t g = 0; g < per_cell_; ++g) q.values[g] = value(from[g]);
                q.integrate(cell);
            }
            for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k)
                cell.spread(cut_row<P>(points, k, space, slope_axis).data(), value(work.at_points[gauss_count_ + k]));
            cell.add_to(to);
        });
    });
}

/// to += the integrals of the functions over the body.
template <int D>
void SplineScheme<D>::integrate_functions(const SplineSpace<D>& space, Lanes* to) const
{
    SplineScratch<D>& work     = *scratch_;
    const std::ptrdiff_t count = gauss_count_ + work.body.points.count();
    keep_room(work.at_points, count);
    parallel_for_each(count, [&](std::ptrdiff_t k) { work.at_points[k] = Lanes(point_weight(work.body.points, k)); });
    integrate_at_points(
        space, -1, [](const Lanes& weight) { return weight; }, to);
}

template <int D>
void SplineScheme<D>::subtract_force() const
{
    SplineScratch<D>& work = *scratch_;
    evaluate_at_points(s_space_, -1, work.s.data());
    for (int b = 0; b < D; ++b)
        integrate_at_points(
            v_space_, b,
            [b](const Lanes& sigma) {
                Lanes r(0.0);
                for (int a = 0; a < D; ++a) r[SplineLane::acceleration + a] = -sigma[stress_lane<D>(a, b)];
                return r;
            },
            work.b.data());
}

template <int D>
void SplineScheme<D>::project_gradient_of_body(State<D>& s) const
{
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = s_space_.count();
    auto same                   = [](const Lanes& value) { return value; };
    const double ghost_weight   = kGhostOfMasses * cell_volume_;
    find_matrix(s_space_, work.body.s, ghost_weight, work.gradient,
                [&](std::ptrdiff_t k) { return point_weight(work.body.points, k); });
    find_row_sums(work.gradient, functions);
    const System system{.solve        = SplineSolve::gradient,
                        .what         = "the projection of the velocity gradient",
                        .space        = s_space_,
                        .free         = nullptr,
                        .ghost_weight = Lanes(ghost_weight),
                        .factor       = &factor_of(SplineSolve::gradient, work.gradient),
                        .factors      = nullptr,
                        .matrix       = work.gradient};
    for (int b = 0; b < D; ++b) {
        if (!work.is_near) clear(work.L[b], functions);
        clear(work.b, functions);
        evaluate_at_points(v_space_, b, work.v.data());
        integrate_at_points(s_space_, -1, same, work.b.data());
        solve(s, system, work.L[b].data(), work.b.data());
    }
}

/// b -= int s_h grad N_i for bodies that fill the grid, axis by axis.
template <int D>
void SplineScheme<D>::subtract_force_of_full_grid() const
{
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = v_space_.count();
    const auto stresses         = static_cast<std::ptrdiff_t>(s_space_.count());
    keep_room(work.column, static_cast<std::size_t>(stresses));
    keep_room(work.force, functions);
    for (int b = 0; b < D; ++b) {
        parallel_for_each(stresses, [&](std::ptrdiff_t i) {
            Lanes r(0.0);
            for (int a = 0; a < D; ++a) r[SplineLane::acceleration + a] = work.s[i][stress_lane<D>(a, b)];
            work.column[i] = r;
        });
        std::array<const AxisMatrix*, D> matrices{};
        for (int a = 0; a < D; ++a) matrices[a] = a == b ? &slopes_back_[a] : &values_back_[a];
        along_axes<D>(matrices, work.between, work.column.data(), work.force.data());
        parallel_for_each(static_cast<std::ptrdiff_t>(functions),
                          [&](std::ptrdiff_t i) { work.b[i] -= work.force[i] * cell_volume_; });
    }
}

/// b -= kGhostRate c/h G v, where G is the penalty in M: jumps of the velocity across faces of cut cells decay. Without this,
/// displacements of the highest wave numbers grow at surfaces with stress along them (docs/high_order.md).
template <int D>
void SplineScheme<D>::damp_surface() const
{
    SplineScratch<D>& work = *scratch_;
    const double rate      = kGhostRate * model().materials[0].wave_speed() / *std::min_element(model().h.c, model().h.c + D);
    keep_room(work.q, v_space_.count());
    parallel_for_each(static_cast<std::ptrdiff_t>(v_space_.count()), [&](std::ptrdiff_t i) {
        work.q[i] = Lanes(0.0);
        for (int a = 0; a < D; ++a) work.q[i][SplineLane::acceleration + a] = work.v[i][SplineLane::velocity + a];
    });
    work.body.v.multiply(work.ghost_weight * -rate, work.q.data(), work.b.data());
}

/// Solves M a = M b - int s_h grad N_i.
template <int D>
void SplineScheme<D>::solve_acceleration(State<D>& s) const
{
    SplineScratch<D>& work      = *scratch_;
    const std::size_t functions = v_space_.count();
    const Lanes only            = make_lanes(0, 0, 0, 0, 1, 1, 1, 0);
    keep_room(work.part, functions);
    keep_room(work.a, functions);
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.part[i]                      = work.v[i] * only;
        work.part[i][SplineLane::density] = 1.0;
    });
    keep_room(work.sums, functions);
    work.mass.multiply(work.part.data(), work.sums.data());  // M b, and the row sums
    clear(work.b, functions);
    if (is_cut_) {
        subtract_force();
        if (D > 1) damp_surface();
    } else {
        subtract_force_of_full_grid();
    }
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.b[i] += work.sums[i] * only;
        work.sums[i] = Lanes(work.sums[i][SplineLane::density]);
        if (!work.is_near) work.a[i] = work.part[i] * only;
    });

    work.forces = of_holders(work.b.data());

    Factors factors;
    if (!is_cut_) factors = factor_axes(work.mass, v_space_, &acceleration_free_);
    const System system{.solve        = SplineSolve::mass,
                        .what         = "the mass matrix of splines",
                        .space        = v_space_,
                        .free         = &Held::acceleration,
                        .ghost_weight = Lanes(work.ghost_weight),
                        .factor       = is_cut_ ? &factor_of(SplineSolve::mass, work.mass) : nullptr,
                        .factors      = is_cut_ ? nullptr : &factors,
                        .matrix       = work.mass};
    solve(s, system, work.a.data(), work.b.data());
}

/// L_h, column by column: int N^S (L_h - grad v_h) = 0.
template <int D>
void SplineScheme<D>::project_gradient(State<D>& s) const
{
    if (is_cut_) return project_gradient_of_body(s);
    SplineScratch<D>& work = *scratch_;
    const Index<D> counts  = s_space_.counts();
    for (int b = 0; b < D; ++b) {
        std::array<const AxisMatrix*, D> matrices{};
        for (int a = 0; a < D; ++a) matrices[a] = a == b ? &slopes_[a] : &values_[a];
        keep_room(work.L[b], s_space_.count());
        along_axes<D>(matrices, work.between, work.v.data(), work.L[b].data());
        for (int a = 0; a < D; ++a)
            for_each_line<D>(counts, a, [&](std::ptrdiff_t first, std::ptrdiff_t stride) {
                s_factors_[a].solve(work.L[b].data() + first, stride);
            });
    }
}

#define ORDO_SPLINE_INTEGRALS(D)                                                             \
    template void SplineScheme<D>::find_density(State<D>&) const;                            \
    template void SplineScheme<D>::find_mass(State<D>&) const;                               \
    template void SplineScheme<D>::integrate_functions(const SplineSpace<D>&, Lanes*) const; \
    template void SplineScheme<D>::solve_acceleration(State<D>&) const;                      \
    template void SplineScheme<D>::project_gradient(State<D>&) const;
ORDO_SPLINE_INTEGRALS(1)
ORDO_SPLINE_INTEGRALS(2)
ORDO_SPLINE_INTEGRALS(3)
#undef ORDO_SPLINE_INTEGRALS

}  // namespace ordo
