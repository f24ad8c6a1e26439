#include "method/spline_scheme.hpp"

#include "base/gauss_rule.hpp"
#include "method/diagnostics.hpp"
#include "method/place.hpp"
#include "particles/sort.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

namespace ordo {

namespace {

/// Penalties of fits and of what is integrated, in parts of the mean of their weights, and the largest rate at which jumps of the
/// velocity decay by them, c/h; from trials (docs/high_order.md).
constexpr double kGhostOfFits = 1e-5, kGhostOfMasses = 1e-3, kGhostRate = 5;

/// A scheme of Runge and Kutta in which each stage starts from the slope of the one before.
struct RungeKutta {
    int stages;
    std::array<double, 4> at;      ///< times of the stages, in steps, and how far the slope before them goes
    std::array<double, 4> weight;  ///< of their slopes in the step
};

/// Heun's scheme of third order and the classical one of fourth (Hairer, Norsett & Wanner 1993, sec. II.1).
RungeKutta runge_kutta(Scheme scheme)
{
    if (scheme == Scheme::rk3) return {3, {0, 1.0 / 3, 2.0 / 3}, {0.25, 0, 0.75}};
    return {4, {0, 0.5, 0.5, 1}, {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}};
}

/// f(cell, where in it, weight, first function, values, slopes per cell) at the Gauss points of an axis; all in cells.
template <class F>
void for_each_gauss_point(const SplineAxis& axis, int points, F&& f)
{
    const auto rule = gauss_rule(points);
    with_degree(axis.degree, [&]<int P>() {
        double w[P + 1], dw[P + 1];
        for (int cell = 0; cell < axis.cells; ++cell)
            for (const auto& [at, weight] : rule) {
                const int span = axis.span_of(cell);
                axis.row<P>(span, cell + at, w, dw);
                f(cell, at, weight, span, w, dw);
            }
    });
}

/// Values of an axis' functions at Gauss points, or their slopes where cells have a length.
GaussRows gauss_rows(const SplineAxis& axis, int points, double h = 0.0)
{
    GaussRows rows{.points = points, .width = axis.degree + 1, .at = {}};
    for_each_gauss_point(axis, points, [&](int, double, double, int, const double* w, const double* dw) {
        for (int j = 0; j <= axis.degree; ++j) rows.at.push_back(h > 0 ? dw[j] / h : w[j]);
    });
    return rows;
}

/// The masks of walls at the ends of an axis: lanes of its first and its last function that stay free are 1.
using Ends = std::array<Lanes, 2>;
const Ends kFree{Lanes(1.0), Lanes(1.0)};

/// sum w N_i N_j over points of an axis, with rows of the one matrix in the lanes that its ends hold.
class AxisMass {
  public:
    AxisMass(const SplineAxis& axis, const Ends& free) : axis_(axis), free_(free), sum_(axis.count(), axis.degree, axis.periodic)
    {}

    /// A point of this weight, at which the functions from `span` on have the values w.
    void add(int span, const double* w, const Lanes& weight)
    {
        for (int i = 0; i <= axis_.degree; ++i)
            for (int j = 0; j <= axis_.degree; ++j) {
                const int row = axis_.wrapped(span + i), column = axis_.wrapped(span + j);
                sum_.add(row, column, weight * free(row) * free(column) * (w[i] * w[j]));
            }
    }
    /// The factors, and the first row that is none to within `tolerance`, or -1.
    std::pair<Banded<Lanes>, int> factored(double tolerance)
    {
        for (int i = 0; i < axis_.count(); ++i) sum_.add(i, i, 1.0 - free(i));
        const int singular = sum_.factor(tolerance);
        return {std::move(sum_), singular};
    }

  private:
    Lanes free(int i) const
    {
        if (axis_.periodic || (i > 0 && i < axis_.count() - 1)) return Lanes(1.0);
        return free_[i > 0];
    }

    const SplineAxis& axis_;
    Ends free_;
    Banded<Lanes> sum_;
};

/// Factors of int N_i N_j, in cells.
Banded<Lanes> unit_mass(const SplineAxis& axis, const Ends& free)
{
    AxisMass mass(axis, free);
    for_each_gauss_point(axis, axis.degree + 1, [&](int, double, double weight, int span, const double* w, const double*) {
        mass.add(span, w, Lanes(weight));
    });
    return mass.factored(0.0).first;
}

/// to = A from along the axes one after another.
template <int D>
void along_axes(const std::array<const AxisMatrix*, D>& matrices, std::array<Array<Lanes>, 2>& between, const Lanes* from,
                Lanes* to)
{
    Index<D> counts{};
    for (int a = 0; a < D; ++a) counts[a] = matrices[a]->columns();
    for (int a = 0; a < D; ++a) {
        const Index<D> before = counts;
        counts[a]             = matrices[a]->rows();
        std::size_t size      = 1;
        for (int b = 0; b < D; ++b) size *= counts[b];
        keep_room(between[a % 2], size);
        Lanes* const next       = a == D - 1 ? to : between[a % 2].data();
        const std::ptrdiff_t in = before[a], out = counts[a];
        for_each_line<D>(before, a, [&](std::ptrdiff_t first, std::ptrdiff_t stride) {
            const std::ptrdiff_t outer = first / (stride * in), inner = first % stride;
            matrices[a]->multiply(from + first, next + outer * stride * out + inner, stride);
        });
        from = next;
    }
}

Lanes square_root(const Lanes& a)
{
    Lanes r(0.0);
    for (int k = 0; k < 8; ++k) r[k] = std::sqrt(a[k]);
    return r;
}

/// a/b in the lanes where b is positive, else 0.
Lanes quotient(const Lanes& a, const Lanes& b)
{
    Lanes r(0.0);
    for (int k = 0; k < 8; ++k)
        if (b[k] > 0) r[k] = a[k] / b[k];
    return r;
}

void add(Lanes& total, const Lanes& one) { total += one; }

/// A place in cells, in m.
template <int D>
Vec<D> place_of(const Model<D>& model, Vec<D> y)
{
    for (int a = 0; a < D; ++a) y[a] = model.origin[a] + y[a] * model.h[a];
    return y;
}

/// Cells beyond a face of the grid at which a particle has left it.
constexpr double kOutside = 1e-6;

/// The splines of a degree along an axis of the grid.
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

template <int D>
Lanes stress_lanes(const Mat<D>& sigma)
{
    Lanes r(0.0);
    for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) r[stress_lane<D>(a, b)] = sigma(a, b);
    return r;
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
        if (m.density != model.materials[0].density || m.model != model.materials[0].model ||
            m.lambda != model.materials[0].lambda || m.mu != model.materials[0].mu)
            throw InputError(only + "takes bodies of one material: splines do not follow a jump of density or stress; use cpdi2");
    if (!model.tractions.empty()) throw InputError(only + "takes no [[traction]]: use cpdi2");
    if (!model.surface.empty() && model.method.basis == Basis::hat)
        throw InputError(only + "takes bodies with free surfaces with basis bspline2 to bspline5: with hats waves grow there");
    std::array<std::array<bool, 2>, D> is_walled{};
    for (const Boundary<D>& b : model.boundaries) {
        if (b.type == BoundaryType::velocity)
            throw InputError(only + "takes walls at rest: [[boundary]] type \"fixed\" or \"symmetry\", not \"velocity\"");
        if (is_inner_plane(model, b))
            throw InputError(only + "takes walls on faces of the grid only: move the [[boundary]] or the grid's face");
        is_walled[b.axis][b.outer_is_above] = true;
    }
    for (int a = 0; a < D; ++a)
        for (const int side : {0, 1})
            if (!model.periodic[a] && !is_walled[a][side] && model.surface.empty())
                throw InputError(
                    fmt::format("{}wants a wall on every face of the grid, for the body fills it: put a [[boundary]] "
                                "of type \"symmetry\" or \"fixed\" on {}-{}",
                                only, "xyz"[a], side ? "max" : "min"));
}

template <int D>
struct SplineScheme<D>::System {
    typename SplineWork<D>::Solve solve;
    const char* what;  ///< for messages
    const SplineSpace<D>& space;
    const Factors& factors;
    bool is_exact;                                               ///< the factors are those of the matrix itself: one axis
    const Lanes Held::*free;                                     ///< null without walls
    const GhostPenalty<D>* ghost;                                ///< of bodies with free surfaces, else null
    Lanes ghost_weight;                                          ///< of the penalty
    const CutFactor<D>* factor;                                  ///< of bodies with free surfaces
    std::function<void(const Lanes* from, Lanes* to)> multiply;  ///< added to `to`, without regard to walls
};

template <int D>
SplineScheme<D>::SplineScheme(const Model<D>& model) : cells_(model.cells), is_cut_(!model.surface.empty())
{
    require_spline_model(model);
    const MethodSpec& method = model.method;
    const int degree = degree_of(method.basis), stress_degree = static_cast<int>(method.stress_degree);
    points_      = std::max(degree, stress_degree) + 1;
    per_cell_    = power_of(points_, D);
    cell_count_  = number_of(cells_ - Index<D>::filled(1), cells_) + 1;
    gauss_count_ = cell_count_ * per_cell_;
    cell_volume_ = 1.0;
    for (int a = 0; a < D; ++a) {
        cell_volume_ *= model.h[a];
        v_space_.axis[a] = axis_of(model, a, degree, method.removed_knots);
        s_space_.axis[a] = axis_of(model, a, stress_degree, method.removed_stress_knots);
    }
    hold_walls(model);

    for (int a = 0; a < D; ++a) {
        const SplineAxis &v = v_space_.axis[a], &s = s_space_.axis[a];
        gauss_[a]        = gauss_rows(v, points_);
        gauss_slopes_[a] = gauss_rows(v, points_, model.h[a]);
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
                        slopes_[a].add(s.wrapped(s_span + i), v.wrapped(span + j), weight * ws[i] * dw[j] / model.h[a]);
                    }
            });
        });
        values_back_[a] = values_[a].transposed();
        slopes_back_[a] = slopes_[a].transposed();
        at_vertices_[a] = AxisMatrix(model.cells[a] + 1, v.count());
        with_degree(degree, [&]<int P>() {
            double w[P + 1], dw[P + 1];
            for (int k = 0; k <= model.cells[a]; ++k) {
                const int span = v.span_of(std::min(k, model.cells[a] - 1));
                v.row<P>(span, k, w, dw);
                for (int j = 0; j <= P; ++j) at_vertices_[a].add(k, v.wrapped(span + j), w[j]);
            }
        });
        s_factors_[a] = unit_mass(s, kFree);
    }

    const auto rule = gauss_rule(points_);
    IndexBox<D>{{}, Index<D>::filled(points_)}.for_each([&](const Index<D>& k) {
        double weight = cell_volume_;
        for (int a = 0; a < D; ++a) weight *= rule[k[a]].weight;
        gauss_weights_.push_back(weight);
    });

    // Cells a degree and a removed knot apart share no function.
    const int apart = std::max(degree + v_space_.axis[0].removed, stress_degree + s_space_.axis[0].removed) + 1;
    std::array<std::vector<int>, D> bounds;
    Index<D> parts{};
    for (int a = 0; a < D; ++a) {
        parts[a] = std::max(1, cells_[a] / apart);
        if (model.periodic[a] && parts[a] > 1) parts[a] -= parts[a] % 2;  // the last is next to the first
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

/// The functions that walls hold, and what else follows from them.
template <int D>
void SplineScheme<D>::hold_walls(const Model<D>& model)
{
    for (auto& ends : velocity_free_) ends = kFree;
    for (auto& ends : acceleration_free_) ends = kFree;
    for (const Boundary<D>& b : model.boundaries)
        for (int c = 0; c < D; ++c)
            if (b.constrains(c)) {
                velocity_free_[b.axis][b.outer_is_above][SplineLane::velocity + c]         = 0.0;
                acceleration_free_[b.axis][b.outer_is_above][SplineLane::acceleration + c] = 0.0;
            }
    const Index<D> counts = v_space_.counts();
    for (int a = 0; a < D; ++a) {
        v_factors_[a] = unit_mass(v_space_.axis[a], velocity_free_[a]);
        a_factors_[a] = unit_mass(v_space_.axis[a], acceleration_free_[a]);
        if (model.periodic[a]) continue;
        // A function on an edge is that of both walls: masks do no more when they come again.
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

template <int D>
Cover SplineScheme<D>::cover_of(const State<D>& s, int cell) const
{
    return is_cut_ ? s.spline.body.cover[cell] : Cover::all;
}

/// Rows of a cell's functions at its Gauss points.
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

/// f(cell, its number) for all of them; those that share a function one after another, in one order for any number of threads.
template <int D>
template <class F>
void SplineScheme<D>::for_each_cell(F&& f) const
{
    auto visits = static_cast<double>(v_space_.count());
    for (int a = 0; a < D; ++a) visits *= v_space_.axis[a].degree + 1;
    for (const auto& colour : blocks_)
        parallel_for(
            static_cast<std::ptrdiff_t>(colour.size()),
            [&](std::ptrdiff_t k) { colour[k].for_each([&](const Index<D>& cell) { f(cell, number_of(cell, cells_)); }); },
            visits > 10000);
}

/// f(cell, its number, what of it the body covers) for those of which it covers some.
template <int D>
template <class F>
void SplineScheme<D>::for_each_covered_cell(const State<D>& s, F&& f) const
{
    for_each_cell([&](const Index<D>& cell, int number) {
        const Cover cover = cover_of(s, number);
        if (cover != Cover::none) f(cell, number, cover);
    });
}

/// Lists of the particles of each cell, and their weights.
template <int D>
void SplineScheme<D>::sort(const Model<D>& model, State<D>& s) const
{
    SplineWork<D>& work     = s.spline;
    const ParticleView<D> p = s.particles.view();
    auto place              = [&](int i, int a) { return v_space_.axis[a].inside((p.x[i][a] - model.origin[a]) / model.h[a]); };
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

namespace {

/// to += sum over particles of weights times value(i), in a cell.
template <int D, int P, class Value>
ORDO_FLAT inline void spread_cell(const SplineSpace<D>& space, const SplineWork<D>& work, const SampleRows& rows,
                                  const Index<D>& at, int number, const Value& value, Lanes* to)
{
    if (work.first[number] == work.first[number + 1]) return;
    SplineCell<D, P> cell(space, at);
    cell.clear();
    for (int k = work.first[number]; k < work.first[number + 1]; ++k)
        cell.spread(rows.weights.data() + static_cast<std::ptrdiff_t>(k) * rows.width, value(work.order[k]));
    cell.add_to(to);
}

/// What the points of a cell add to a matrix: sum of weights times N_i N_j.
template <int D, int P>
class CellBlock {
  public:
    /// `rows` has the values of an axis' functions.
    void add(const Vec<D, const double*>& rows, double weight)
    {
        double values[count];
        for (int i = 0; i < count; ++i) {
            values[i] = 1.0;
            for (int a = 0, rest = i; a < D; ++a, rest /= P + 1) values[i] *= rows[a][rest % (P + 1)];
        }
        for (int i = 0; i < count; ++i) {
            const double of = weight * values[i];
            for (int j = 0; j < count; ++j) block_[i * count + j] += of * values[j];
        }
    }
    void add_to(const SplineSpace<D>& space, const Index<D>& cell, CutFactor<D>& factor) const
    {
        Index<D> first{};
        for (int a = 0; a < D; ++a) first[a] = space.axis[a].span_of(cell[a]);
        factor.add(first, Index<D>::filled(P + 1), block_.data());
    }

  private:
    static constexpr int count = power_of(P + 1, D);
    std::vector<double> block_ = std::vector<double>(count * count, 0.0);
};

/// Adds a penalty and factors.
template <int D>
void finish(const GhostPenalty<D>& ghost, double weight, CutFactor<D>& factor)
{
    ghost.for_each_block([&](const Index<D>& first, const Index<D>& size, std::vector<double>& block) {
        for (double& of : block) of *= weight;
        factor.add(first, size, block.data());
    });
    factor.factor();
}

/// use(i, sum of weights times `from`) for the particles of a cell.
template <int D, int P, class Use>
ORDO_FLAT inline void collect_cell(const SplineSpace<D>& space, const SplineWork<D>& work, const SampleRows& rows,
                                   const Index<D>& at, int number, const Lanes* from, const Use& use)
{
    if (work.first[number] == work.first[number + 1]) return;
    SplineCell<D, P> cell(space, at);
    cell.load(from);
    for (int k = work.first[number]; k < work.first[number + 1]; ++k)
        use(work.order[k], cell.collect(rows.weights.data() + static_cast<std::ptrdiff_t>(k) * rows.width));
}

/// The two in one: to += W^T diag(weight) W from.
template <int D, int P, class Weight>
ORDO_FLAT inline void multiply_cell(const SplineSpace<D>& space, const SplineWork<D>& work, const SampleRows& rows,
                                    const Index<D>& at, int number, const Weight& weight, const Lanes* from, Lanes* to)
{
    if (work.first[number] == work.first[number + 1]) return;
    SplineCell<D, P> in(space, at), out(space, at);
    in.load(from);
    out.clear();
    for (int k = work.first[number]; k < work.first[number + 1]; ++k) {
        const double* w = rows.weights.data() + static_cast<std::ptrdiff_t>(k) * rows.width;
        out.spread(w, in.collect(w) * weight(work.order[k]));
    }
    out.add_to(to);
}

void clear(Array<Lanes>& array, std::size_t n)
{
    keep_room(array, n);
    parallel_for_each(static_cast<std::ptrdiff_t>(n), [&](std::ptrdiff_t i) { array[i] = Lanes(0.0); });
}

}  // namespace

/// Components that walls hold are no unknowns.
template <int D>
void SplineScheme<D>::hold(const System& system, Lanes* records) const
{
    if (system.free)
        for (const Held& h : held_) records[h.function] *= h.*system.free;
}

/// z = P^-1 r. The matrix is nearly S^1/2 M S^1/2, M that of unit density, which is a product of axes, and S what rows sum to
/// over what they sum to there.
template <int D>
void SplineScheme<D>::precondition(State<D>& s, const System& system) const
{
    SplineWork<D>& work   = s.spline;
    const Index<D> counts = system.space.counts();
    const auto n          = static_cast<std::ptrdiff_t>(system.space.count());
    if (system.ghost) {
        system.factor->solve(work.r.data(), work.z.data());
        hold(system, work.z.data());
        return;
    }
    parallel_for_each(n, [&](std::ptrdiff_t i) { work.z[i] = system.is_exact ? work.r[i] : work.r[i] * work.scale[i]; });
    for (int a = 0; a < D; ++a)
        for_each_line<D>(counts, a, [&](std::ptrdiff_t first, std::ptrdiff_t stride) {
            system.factors[a].solve(work.z.data() + first, stride);
        });
    if (!system.is_exact) parallel_for_each(n, [&](std::ptrdiff_t i) { work.z[i] *= work.scale[i]; });
}

/// A x = b by conjugate gradients from the x that is given, lane by lane; b is lost. `work.sums` has the sums of rows.
template <int D>
void SplineScheme<D>::solve(const Model<D>& model, State<D>& s, const System& system, Lanes* x, Lanes* b) const
{
    constexpr double tolerance  = 1e-13;
    const int most              = system.ghost ? 3000 : 200;
    SplineWork<D>& work         = s.spline;
    const std::size_t functions = system.space.count();
    const auto n                = static_cast<std::ptrdiff_t>(functions);
    for (Array<Lanes>* array : {&work.r, &work.z, &work.p, &work.q, &work.scale}) keep_room(*array, functions);
    auto product = [&](const Lanes* from) {
        clear(work.q, functions);
        system.multiply(from, work.q.data());
        if (system.ghost) system.ghost->multiply(system.ghost_weight, from, work.q.data());
        hold(system, work.q.data());
    };
    auto dot = [&](const Lanes* one, const Lanes* other) {
        return parallel_reduce(
            n, Lanes(0.0), [&](std::ptrdiff_t i) { return one[i] * other[i]; }, add);
    };
    auto size = [&](const Lanes* of) {
        return parallel_reduce(
            n, Lanes(0.0), [&](std::ptrdiff_t i) { return quotient(of[i] * of[i], work.sums[i]); }, add);
    };
    if (system.ghost)  // where no particle is, residuals count by the penalty
        parallel_for_each(n, [&](std::ptrdiff_t i) { work.sums[i] = larger(work.sums[i], system.ghost_weight); });
    else if (!system.is_exact)
        parallel_for_each(n, [&](std::ptrdiff_t i) {
            const double whole = cell_volume_ * system.space.integral(i);
            work.scale[i]      = square_root(quotient(Lanes(1.0), work.sums[i] * (1 / whole))) * (1 / std::sqrt(cell_volume_));
        });

    hold(system, b);
    hold(system, x);
    product(x);
    parallel_for_each(n, [&](std::ptrdiff_t i) { work.r[i] = b[i] - work.q[i]; });
    const Lanes whole = larger(size(b), size(work.r.data()));  // where b is zero, x need not be
    auto is_done      = [&] {
        const Lanes left = size(work.r.data());
        for (int k = 0; k < 8; ++k)
            if (!(left[k] <= tolerance * tolerance * whole[k])) return false;
        return true;
    };
    Lanes before(0.0);
    for (int k = 0; !is_done(); ++k) {
        if (k == most) {
            std::size_t worst = 0;
            for (std::size_t i = 0; i < functions; ++i)
                if (largest(quotient(fabs(work.r[i]), work.sums[i])) > largest(quotient(fabs(work.r[worst]), work.sums[worst])))
                    worst = i;
            throw NumericalError(fmt::format("step {}, t = {:.6g} s: {} near {} does not converge in {} iterations: particles "
                                             "hardly determine the splines there; more particles a cell may help",
                                             s.n, s.t, system.what, place_text(place_of(model, system.space.center(worst))),
                                             most));
        }
        precondition(s, system);
        const Lanes now = dot(work.r.data(), work.z.data()), beta = quotient(now, before);
        parallel_for_each(n, [&](std::ptrdiff_t i) { work.p[i] = k == 0 ? work.z[i] : work.z[i] + work.p[i] * beta; });
        product(work.p.data());
        const Lanes alpha = quotient(now, dot(work.p.data(), work.q.data()));
        parallel_for_each(n, [&](std::ptrdiff_t i) {
            x[i] += work.p[i] * alpha;
            work.r[i] -= work.q[i] * alpha;
        });
        before = now;
        ++work.iterations[system.solve];
    }
}

/// Functions whose particles fill their integral to less than a part, or that others determine already, are none that a fit could
/// find.
template <int D>
void SplineScheme<D>::require_enough(const Model<D>& model, State<D>& s, const System& system, const Lanes& unit,
                                     int singular) const
{
    constexpr double least = 0.02;
    auto refuse            = [&](std::size_t function) {
        throw NumericalError(fmt::format("step {}, t = {:.6g} s: {} near {} has too few particles: splines of degree {} want two "
                                                               "or more a cell along each axis, everywhere in a grid that the body fills",
                                                    s.n, s.t, system.what, place_text(place_of(model, system.space.center(function))),
                                                    system.space.axis[0].degree));
    };
    if (singular >= 0) refuse(singular);
    if (system.ghost) {
        clear(s.spline.q, system.space.count());
        fill_points(s, [&](std::ptrdiff_t k) { return point_weight(s.spline.body.points, k); });
        integrate_at_points(
            s, system.space, -1, [](const Lanes& weight) { return weight; }, s.spline.q.data());
    }
    for (std::size_t i = 0; i < system.space.count(); ++i) {
        const double whole = cell_volume_ * system.space.integral(i);
        if (system.ghost && s.spline.q[i][0] < 0.5 * whole) continue;
        if (!(largest(s.spline.sums[i] * unit) >= least * whole)) refuse(i);
    }
    if (!system.ghost && static_cast<std::size_t>(s.particles.count) < system.space.count()) refuse(system.space.count() / 2);
}

/// The sum of weights over the sum of volumes.
template <int D>
template <class Weight>
Lanes SplineScheme<D>::mean_weight(const State<D>& s, const Weight& weight)
{
    Lanes sum(0.0);
    double volume = 0.0;
    for (int i = 0; i < s.particles.count; ++i) {
        sum += weight(i);
        volume += s.particles.V[i];
    }
    return sum * (1 / volume);
}

/// Fits x to values of particles, value(i) and weight(i) lane by lane; `volume` says in which lanes the weight is the volume.
template <int D>
template <class Value, class Weight>
void SplineScheme<D>::fit(const Model<D>& model, State<D>& s, const FitTask& task, const Value& value, const Weight& weight,
                          Array<Lanes>& x) const
{
    SplineWork<D>& work         = s.spline;
    const std::size_t functions = task.space.count();
    if (!work.is_near) clear(x, functions);
    clear(work.b, functions);
    clear(work.sums, functions);
    with_degree(task.space.axis[0].degree, [&]<int P>() {
        for_each_cell([&](const Index<D>& cell, int number) {
            spread_cell<D, P>(
                task.space, work, task.rows, cell, number, [&](int i) { return value(i) * weight(i); }, work.b.data());
            spread_cell<D, P>(task.space, work, task.rows, cell, number, weight, work.sums.data());
        });
        const Lanes ghost_weight = task.ghost ? mean_weight(s, weight) * (kGhostOfFits * cell_volume_) : Lanes(0.0);
        std::optional<CutFactor<D>> factor;
        if (task.ghost) {
            factor.emplace(task.space);
            for_each_cell([&](const Index<D>& cell, int number) {
                CellBlock<D, P> block;
                for (int k = work.first[number]; k < work.first[number + 1]; ++k) {
                    Vec<D, const double*> rows{};
                    for (int a = 0; a < D; ++a)
                        rows[a] = task.rows.weights.data() + static_cast<std::ptrdiff_t>(k) * task.rows.width + a * (P + 1);
                    block.add(rows, s.particles.V[work.order[k]]);
                }
                block.add_to(task.space, cell, *factor);
            });
            finish(*task.ghost, kGhostOfFits * cell_volume_, *factor);
        }
        Factors exact;
        int singular        = -1;
        const bool is_exact = D == 1 && !task.ghost;
        if (is_exact) {
            const SplineAxis& axis = task.space.axis[0];
            AxisMass mass(axis, task.free ? velocity_free_[0] : kFree);
            for (int cell = 0; cell < axis.cells; ++cell)
                for (int k = work.first[cell]; k < work.first[cell + 1]; ++k)
                    mass.add(axis.span_of(cell), task.rows.weights.data() + static_cast<std::ptrdiff_t>(k) * task.rows.width,
                             weight(work.order[k]));
            std::tie(exact[0], singular) = mass.factored(1e-10);
        }
        const System system{task.solve,
                            task.what,
                            task.space,
                            is_exact ? exact : task.factors,
                            is_exact,
                            task.free,
                            task.ghost,
                            ghost_weight,
                            factor ? &*factor : nullptr,
                            [&](const Lanes* from, Lanes* to) {
                                for_each_cell([&](const Index<D>& cell, int number) {
                                    multiply_cell<D, P>(task.space, work, task.rows, cell, number, weight, from, to);
                                });
                            }};
        if (!task.ghost || task.is_known) require_enough(model, s, system, task.volume, singular);
        solve(model, s, system, x.data(), work.b.data());
    });
}

/// Where the body is: splines that are fitted to what the functions of its surface are at the particles' initial positions.
template <int D>
void SplineScheme<D>::find_body(const Model<D>& model, State<D>& s) const
{
    SplineWork<D>& work            = s.spline;
    const ParticleView<D> p        = s.particles.view();
    const std::vector<Cover> rough = cover_by_particles(model, s.particles, work.order, work.first);
    work.body.v                    = GhostPenalty<D>(v_space_, cells_, rough);
    const FitTask task{SplineWork<D>::kVelocity,
                       "the fit of the surface",
                       v_space_,
                       work.v_rows,
                       v_factors_,
                       nullptr,
                       Lanes(1.0),
                       &work.body.v,
                       false};
    auto value = [&](int i) {
        Lanes r(0.0);
        for (std::size_t k = 0; k < model.surface.size(); ++k) r[static_cast<int>(k)] = model.surface[k](p.X[i]);
        return r;
    };
    fit(
        model, s, task, value, [&](int i) { return Lanes(p.V[i]); }, work.surface);
    ordo::find_body(model, v_space_, s_space_, work.surface.data(), rough, points_, work.body);
}

template <int D>
void SplineScheme<D>::fit_velocity(const Model<D>& model, State<D>& s) const
{
    const ParticleView<D> p = s.particles.view();
    const Lanes of_mass = make_lanes(1, 1, 1, 0, 0, 0, 0, 0), of_volume = 1.0 - of_mass;
    const FitTask task{SplineWork<D>::kVelocity,
                       "the fit of velocities",
                       v_space_,
                       s.spline.v_rows,
                       v_factors_,
                       &Held::velocity,
                       of_volume,
                       is_cut_ ? &s.spline.body.v : nullptr,
                       true};
    auto value = [&](int i) {
        Lanes r(0.0);
        for (int a = 0; a < D; ++a) {
            r[SplineLane::velocity + a]     = p.v[i][a];
            r[SplineLane::acceleration + a] = model.gravity[a] + (p.b ? p.b[i][a] : 0.0);
        }
        r[SplineLane::density] = p.m[i] / p.V[i];
        return r;
    };
    fit(
        model, s, task, value, [&](int i) { return of_mass * p.m[i] + of_volume * p.V[i]; }, s.spline.v);
}

template <int D>
void SplineScheme<D>::fit_stress(const Model<D>& model, State<D>& s) const
{
    const ParticleView<D> p = s.particles.view();
    const FitTask task{SplineWork<D>::kStress,
                       "the fit of stresses",
                       s_space_,
                       s.spline.s_rows,
                       s_factors_,
                       nullptr,
                       Lanes(1.0),
                       is_cut_ ? &s.spline.body.s : nullptr,
                       true};
    fit(
        model, s, task, [&](int i) { return stress_lanes(p.sigma[i]); }, [&](int i) { return Lanes(p.V[i]); }, s.spline.s);
}

/// rho_h at Gauss points, times their weights.
template <int D>
void SplineScheme<D>::find_density(const Model<D>& model, State<D>& s) const
{
    SplineWork<D>& work = s.spline;
    keep_room(work.density, gauss_count_ + work.body.points.count());
    std::vector<unsigned char> is_negative(cell_count_, 0);
    with_degree(v_space_.axis[0].degree, [&]<int P>() {
        for_each_covered_cell(s, [&](const Index<D>& at, int number, Cover cover) {
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
                    s.n, s.t, place_text(place_of(model, y))));
}

/// to += M from, M_ij = sum_g w_g rho_h N_i N_j over Gauss points.
template <int D>
void SplineScheme<D>::multiply_mass(const State<D>& s, const Lanes* from, Lanes* to) const
{
    with_degree(v_space_.axis[0].degree, [&]<int P>() {
        for_each_covered_cell(s, [&](const Index<D>& at, int number, Cover cover) {
            SplineCell<D, P> cell(v_space_, at);
            cell.load(from);
            if (cover == Cover::part) {
                const CutPoints& points = s.spline.body.points;
                SplineCell<D, P> out(v_space_, at);
                out.clear();
                for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k) {
                    const double* w = points.v_values.data() + k * points.v_width;
                    out.spread(w, cell.collect(w) * s.spline.density[gauss_count_ + k]);
                }
                out.add_to(to);
                return;
            }
            CellQuadrature<D, P> q(tables(v_space_, -1, at), points_);
            q.evaluate(cell);
            const double* density = s.spline.density.data() + number * per_cell_;
            for (std::ptrdiff_t g = 0; g < per_cell_; ++g) q.values[g] = q.values[g] * density[g];
            q.integrate(cell);
            cell.add_to(to);
        });
    });
}

/// Row of a cut point for a space, with slopes along one axis where it is not -1.
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
template <class Value>
void SplineScheme<D>::fill_points(State<D>& s, const Value& value) const
{
    const std::ptrdiff_t count = gauss_count_ + s.spline.body.points.count();
    keep_room(s.spline.at_points, count);
    parallel_for_each(count, [&](std::ptrdiff_t k) { s.spline.at_points[k] = Lanes(value(k)); });
}

template <int D>
double SplineScheme<D>::point_weight(const CutPoints& points, std::ptrdiff_t k) const
{
    return k < gauss_count_ ? gauss_weights_[k % per_cell_] : points.weights[k - gauss_count_];
}

template <int D>
void SplineScheme<D>::evaluate_at_points(State<D>& s, const SplineSpace<D>& space, int slope_axis, const Lanes* from) const
{
    const CutPoints& points = s.spline.body.points;
    Array<Lanes>& to        = s.spline.at_points;
    keep_room(to, gauss_count_ + points.count());
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell(s, [&](const Index<D>& at, int number, Cover cover) {
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

/// Of the matrix with work.at_points for weights, and a penalty.
template <int D>
CutFactor<D> SplineScheme<D>::factor_at_points(const State<D>& s, const SplineSpace<D>& space, const GhostPenalty<D>& ghost,
                                               double ghost_weight) const
{
    CutFactor<D> factor(space);
    const CutPoints& points = s.spline.body.points;
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell(s, [&](const Index<D>& at, int number, Cover cover) {
            CellBlock<D, P> block;
            if (cover == Cover::all) {
                const Vec<D, const double*> table = tables(space, -1, at);
                std::ptrdiff_t g                  = number * per_cell_;
                IndexBox<D>{{}, Index<D>::filled(points_)}.for_each([&](const Index<D>& k) {
                    Vec<D, const double*> rows{};
                    for (int a = 0; a < D; ++a) rows[a] = table[a] + k[a] * (P + 1);
                    block.add(rows, s.spline.at_points[g++][0]);
                });
            }
            for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k) {
                const auto row = cut_row<P>(points, k, space, -1);
                Vec<D, const double*> rows{};
                for (int a = 0; a < D; ++a) rows[a] = row.data() + a * (P + 1);
                block.add(rows, s.spline.at_points[gauss_count_ + k][0]);
            }
            block.add_to(space, at, factor);
        });
    });
    finish(ghost, ghost_weight, factor);
    return factor;
}

template <int D>
template <class Value>
void SplineScheme<D>::integrate_at_points(State<D>& s, const SplineSpace<D>& space, int slope_axis, const Value& value,
                                          Lanes* to) const
{
    const CutPoints& points = s.spline.body.points;
    with_degree(space.axis[0].degree, [&]<int P>() {
        for_each_covered_cell(s, [&](const Index<D>& at, int number, Cover cover) {
            SplineCell<D, P> cell(space, at);
            cell.clear();
            if (cover == Cover::all) {
                CellQuadrature<D, P> q(tables(space, slope_axis, at), points_);
                const Lanes* from = s.spline.at_points.data() + number * per_cell_;
                for (std::ptrdiff_t g = 0; g < per_cell_; ++g) q.values[g] = value(from[g]);
                q.integrate(cell);
            }
            for (std::ptrdiff_t k = points.first[number]; k < points.first[number + 1]; ++k)
                cell.spread(cut_row<P>(points, k, space, slope_axis).data(), value(s.spline.at_points[gauss_count_ + k]));
            cell.add_to(to);
        });
    });
}

template <int D>
void SplineScheme<D>::subtract_force(State<D>& s) const
{
    evaluate_at_points(s, s_space_, -1, s.spline.s.data());
    for (int b = 0; b < D; ++b)
        integrate_at_points(
            s, v_space_, b,
            [b](const Lanes& sigma) {
                Lanes r(0.0);
                for (int a = 0; a < D; ++a) r[SplineLane::acceleration + a] = -sigma[stress_lane<D>(a, b)];
                return r;
            },
            s.spline.b.data());
}

template <int D>
void SplineScheme<D>::project_gradient_of_body(const Model<D>& model, State<D>& s) const
{
    SplineWork<D>& work         = s.spline;
    const std::size_t functions = s_space_.count();
    auto same                   = [](const Lanes& value) { return value; };
    fill_points(s, [&](std::ptrdiff_t k) { return point_weight(s.spline.body.points, k); });
    const CutFactor<D> factor = factor_at_points(s, s_space_, work.body.s, kGhostOfMasses * cell_volume_);
    clear(work.sums, functions);
    integrate_at_points(s, s_space_, -1, same, work.sums.data());
    const System system{SplineWork<D>::kGradient,
                        "the projection of the velocity gradient",
                        s_space_,
                        s_factors_,
                        false,
                        nullptr,
                        &work.body.s,
                        Lanes(kGhostOfMasses * cell_volume_),
                        &factor,
                        [&](const Lanes* from, Lanes* to) {
                            evaluate_at_points(s, s_space_, -1, from);
                            integrate_at_points(s, s_space_, -1, same, to);
                        }};
    for (int b = 0; b < D; ++b) {
        if (!work.is_near) clear(work.L[b], functions);
        clear(work.b, functions);
        evaluate_at_points(s, v_space_, b, work.v.data());
        integrate_at_points(s, s_space_, -1, same, work.b.data());
        solve(model, s, system, work.L[b].data(), work.b.data());
    }
}

/// The same where bodies fill the grid: axis by axis.
template <int D>
void SplineScheme<D>::subtract_force_of_full_grid(State<D>& s) const
{
    SplineWork<D>& work         = s.spline;
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

/// b -= kGhostRate c/h G v, G the penalty of M: jumps of the velocity across faces of cut cells decay. Without that, displacements of
/// the highest wave numbers grow at surfaces with stress along them (docs/high_order.md).
template <int D>
void SplineScheme<D>::damp_surface(const Model<D>& model, State<D>& s, const Lanes& ghost_weight) const
{
    SplineWork<D>& work = s.spline;
    const double rate   = kGhostRate * model.materials[0].wave_speed() / *std::min_element(model.h.c, model.h.c + D);
    keep_room(work.q, v_space_.count());
    parallel_for_each(static_cast<std::ptrdiff_t>(v_space_.count()), [&](std::ptrdiff_t i) {
        work.q[i] = Lanes(0.0);
        for (int a = 0; a < D; ++a) work.q[i][SplineLane::acceleration + a] = work.v[i][SplineLane::velocity + a];
    });
    work.body.v.multiply(ghost_weight * -rate, work.q.data(), work.b.data());
}

/// M a = M b - int s_h grad N_i.
template <int D>
void SplineScheme<D>::solve_acceleration(const Model<D>& model, State<D>& s) const
{
    SplineWork<D>& work         = s.spline;
    const std::size_t functions = v_space_.count();
    const Lanes only            = make_lanes(0, 0, 0, 0, 1, 1, 1, 0);
    keep_room(work.part, functions);
    keep_room(work.a, functions);
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.part[i]                      = work.v[i] * only;
        work.part[i][SplineLane::density] = 1.0;
    });
    clear(work.sums, functions);
    multiply_mass(s, work.part.data(), work.sums.data());  // M b, and the sums of rows
    Lanes ghost_weight(0.0);
    if (is_cut_) {
        ghost_weight = mean_weight(s, [&](int i) { return Lanes(s.particles.m[i]); }) * (kGhostOfMasses * cell_volume_);
        work.body.v.multiply(ghost_weight, work.part.data(), work.sums.data());
    }
    clear(work.b, functions);
    if (is_cut_) {
        subtract_force(s);
        if (D > 1) damp_surface(model, s, ghost_weight);
    } else {
        subtract_force_of_full_grid(s);
    }
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.b[i] += work.sums[i] * only;
        work.sums[i] = Lanes(work.sums[i][SplineLane::density]);
        if (!work.is_near) work.a[i] = work.part[i] * only;
    });

    Factors exact;
    const bool is_exact = D == 1 && !is_cut_;
    std::optional<CutFactor<D>> factor;
    if (is_cut_) {
        fill_points(s, [&](std::ptrdiff_t k) { return work.density[k]; });
        factor.emplace(factor_at_points(s, v_space_, work.body.v, ghost_weight[0]));
    }
    if (is_exact) {
        const SplineAxis& axis = v_space_.axis[0];
        AxisMass mass(axis, acceleration_free_[0]);
        for (int cell = 0; cell < axis.cells; ++cell)
            for (int g = 0; g < points_; ++g)
                mass.add(axis.span_of(cell), gauss_[0].of_cell(cell) + g * gauss_[0].width,
                         Lanes(work.density[cell * points_ + g]));
        exact[0] = mass.factored(0.0).first;
    }
    const System system{SplineWork<D>::kMass,
                        "the mass matrix of splines",
                        v_space_,
                        is_exact ? exact : a_factors_,
                        is_exact,
                        &Held::acceleration,
                        is_cut_ ? &work.body.v : nullptr,
                        ghost_weight,
                        factor ? &*factor : nullptr,
                        [&](const Lanes* from, Lanes* to) { multiply_mass(s, from, to); }};
    solve(model, s, system, work.a.data(), work.b.data());
}

/// L_h, column by column, int N^S (L_h - grad v_h) = 0.
template <int D>
void SplineScheme<D>::project_gradient(const Model<D>& model, State<D>& s) const
{
    if (is_cut_) return project_gradient_of_body(model, s);
    SplineWork<D>& work   = s.spline;
    const Index<D> counts = s_space_.counts();
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

template <int D>
void SplineScheme<D>::evaluate(const Model<D>& model, State<D>& s, StageTimes* times) const
{
    SplineWork<D>& work = s.spline;
    {
        Stopwatch watch(times, StageTimes::sort);
        sort(model, s);
    }
    if (is_cut_) {
        Stopwatch watch(times, StageTimes::fit);
        find_body(model, s);
    }
    {
        Stopwatch watch(times, StageTimes::fit);
        fit_velocity(model, s);
        fit_stress(model, s);
    }
    {
        Stopwatch watch(times, StageTimes::nodes);
        find_density(model, s);
        solve_acceleration(model, s);
        project_gradient(model, s);
    }
    Stopwatch watch(times, StageTimes::gather);
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

template <int D>
void SplineScheme<D>::step(const Model<D>& model, State<D>& s, double dt, const Forces& forces, StageTimes* times) const
{
    const RungeKutta scheme = runge_kutta(model.method.scheme);
    const ParticleView<D> p = s.particles.view();
    SplineWork<D>& work     = s.spline;
    const std::size_t n     = p.count;
    const double t          = s.t;
    for (Array<Vec<D>>* array : {&work.x0, &work.v0, &work.dx, &work.dv}) keep_room(*array, n);
    for (Array<Mat<D>>* array : {&work.F0, &work.dF, &work.sigma0, &work.dsigma}) keep_room(*array, n);
    work.iterations = {};
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        work.x0[i]     = p.x[i];
        work.v0[i]     = p.v[i];
        work.F0[i]     = p.F[i];
        work.sigma0[i] = p.sigma[i];
        work.dx[i] = work.dv[i] = Vec<D>{};
        work.dF[i] = work.dsigma[i] = Mat<D>{};
    });
    auto restore = [&] {
        parallel_for_each(p.count, [&](std::ptrdiff_t i) {
            p.x[i]     = work.x0[i];
            p.v[i]     = work.v0[i];
            p.F[i]     = work.F0[i];
            p.sigma[i] = work.sigma0[i];
            p.V[i]     = det(p.F[i]) * p.V0[i];
        });
    };
    for (int k = 0; k < scheme.stages; ++k) {
        forces(t + scheme.at[k] * dt);
        work.is_near = k > 0;
        try {
            evaluate(model, s, times);
        } catch (const NumericalError&) {
            restore();
            throw;
        }
        Stopwatch watch(times, StageTimes::gather);
        if (k == 0) {
            show(s);
            if (s.projection.is_wanted) report(s);
            // What no spline holds nothing else damps. The fit stays the same: that of v_h(x_p) is v_h.
            parallel_for_each(p.count,
                              [&](std::ptrdiff_t i) { work.v0[i] -= model.method.null_damping * (work.v0[i] - work.v_at[i]); });
        }
        const bool is_last   = k + 1 == scheme.stages;
        const double further = is_last ? 0.0 : dt * scheme.at[k + 1], part = dt * scheme.weight[k];
        using Faults       = TileReport;
        const Faults found = parallel_reduce(
            p.count, Faults{},
            [&](std::ptrdiff_t i) {
                const Mat<D>& L          = work.L_at[i];
                const Mat<D> slope       = L * p.F[i];
                const Material& material = model.materials[p.material[i]];
                const Mat<D> rate        = stress_rate(material, p.sigma[i], L);
                work.dx[i] += part * work.v_at[i];
                work.dv[i] += part * work.a_at[i];
                work.dF[i] += part * slope;
                work.dsigma[i] += part * rate;
                p.x[i]         = work.x0[i] + (is_last ? work.dx[i] : further * work.v_at[i]);
                p.v[i]         = work.v0[i] + (is_last ? work.dv[i] : further * work.a_at[i]);
                p.F[i]         = work.F0[i] + (is_last ? work.dF[i] : further * slope);
                p.sigma[i]     = material.is_rate_law() ? work.sigma0[i] + (is_last ? work.dsigma[i] : further * rate)
                                                        : initial_stress(material, p.F[i]);
                const double J = det(p.F[i]);
                p.V[i]         = J * p.V0[i];
                Faults r;
                if (!std::isfinite(norm(p.x[i]) + norm(p.v[i]) + J)) r.flag(Fault::not_finite, static_cast<int>(i));
                if (!(J > 0)) r.flag(Fault::inverted, static_cast<int>(i));
                for (int a = 0; a < D; ++a) {
                    r.move         = larger(r.move, std::fabs(p.x[i][a] - work.x0[i][a]) / model.h[a]);
                    const double y = (p.x[i][a] - model.origin[a]) / model.h[a];
                    if (!model.periodic[a] && !(y >= -kOutside && y <= model.cells[a] + kOutside))
                        r.flag(Fault::left_grid, static_cast<int>(i));
                }
                return r;
            },
            [](Faults& total, const Faults& one) {
                total.move = larger(total.move, one.move);
                if (one.fault != Fault::none) total.flag(one.fault, one.particle);
            });
        if (found.fault != Fault::none) {
            s.fault = found;
            return;
        }
        s.move = found.move;
    }
    s.drift += s.move;
}

/// Whether a cell beside a vertex has a part of the body.
template <int D>
bool SplineScheme<D>::is_seen(const State<D>& s, const Index<D>& vertex) const
{
    bool r = !is_cut_;
    IndexBox<D>{vertex - Index<D>::filled(1), vertex + Index<D>::filled(1)}.for_each([&](const Index<D>& cell) {
        for (int a = 0; a < D; ++a)
            if (cell[a] < 0 || cell[a] >= cells_[a]) return;
        r = r || cover_of(s, number_of(cell, cells_)) != Cover::none;
    });
    return r;
}

template <int D>
void SplineScheme<D>::show(State<D>& s) const
{
    SplineWork<D>& work  = s.spline;
    Index<D> counts      = cells_ + Index<D>::filled(1);
    std::size_t vertices = 1;
    std::array<const AxisMatrix*, D> matrices{};
    for (int a = 0; a < D; ++a) {
        vertices *= counts[a];
        matrices[a] = &at_vertices_[a];
    }
    keep_room(work.column, vertices);
    along_axes<D>(matrices, work.between, work.v.data(), work.column.data());
    std::ptrdiff_t number = 0;
    IndexBox<D>{{}, counts}.for_each([&](const Index<D>& k) {
        const Lanes from = is_seen(s, k) ? work.column[number] : Lanes(0.0);
        ++number;
        const Index<D> at = k + Index<D>::filled(s.lattice.margin);
        double volume     = 1.0;
        for (int a = 0; a < D; ++a) volume *= s.lattice.node_length(a, at[a]);
        Lanes& to = s.nodes[s.lattice.offset(at)];
        to        = Lanes(0.0);
        for (int a = 0; a < D; ++a) to[NodeLane::velocity + a] = from[SplineLane::velocity + a];
        to[NodeLane::mass]   = from[SplineLane::density] * volume;
        to[NodeLane::volume] = volume;
    });
}

/// Mass and momentum of particles and of the grid.
template <int D>
void SplineScheme<D>::report(State<D>& s) const
{
    SplineWork<D>& work         = s.spline;
    const std::size_t functions = v_space_.count();
    parallel_for_each(static_cast<std::ptrdiff_t>(functions), [&](std::ptrdiff_t i) {
        work.p[i]                      = work.v[i];
        work.p[i][SplineLane::density] = 1.0;
    });
    clear(work.q, functions);
    multiply_mass(s, work.p.data(), work.q.data());
    const Lanes after = parallel_reduce(
        static_cast<std::ptrdiff_t>(functions), Lanes(0.0), [&](std::ptrdiff_t i) { return work.q[i]; }, add);
    static_assert(SplineLane::velocity == NodeLane::velocity && SplineLane::density == NodeLane::mass);
    s.projection.set(mass_and_momentum(s.particles.view()), after);
}

template <int D>
void SplineScheme<D>::project(const Model<D>& model, State<D>& s) const
{
    s.spline.is_near = false;
    sort(model, s);
    if (is_cut_) find_body(model, s);
    fit_velocity(model, s);
    find_density(model, s);
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
