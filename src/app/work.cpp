#include "app/work.hpp"

#include "kernels/cell_fields.hpp"
#include "kernels/cell_gradient.hpp"
#include "kernels/monomials.hpp"
#include "method/passes.hpp"
#include "shape/box.hpp"
#include "shape/bspline.hpp"
#include "shape/hat.hpp"
#include "spline/scheme.hpp"

#include <algorithm>

namespace ordo {

namespace {

constexpr double kLanes = 8, kRecord = sizeof(Lanes);

// ---- small tensors, flops ---------------------------------------------------------------------------------------------

template <int D>
constexpr double kProduct = D* D*(2 * D - 1);  ///< product of two matrices
template <int D>
constexpr double kDet = D == 3   ? 14
                        : D == 2 ? 3
                                 : 0;
template <int D>
constexpr double kInverse = (D == 3 ? 27 : 0) + kDet<D> + 1 + D* D;  ///< cofactors, 1/det, product

/// F + dtL F, J, V, sigma = [lambda ln J I + mu (F F^T - I)]/J, see `deform` and NeoHookean.
template <int D>
constexpr double kDeformFlops = kProduct<D> + D* D + kDet<D> + 1 + kProduct<D> + D + D* D + 2 + D + 1 + D* D;

/// An LDL^T factorization of n unknowns, see kernels/ldl.hpp.
double ldl_flops(int n)
{
    double flops = 0;
    for (int j = 0; j < n; ++j) flops += 3 * j + (n - 1 - j) * (3 * j + 1);
    return flops;
}
double ldl_solve_flops(int n) { return n + 2.0 * n * (n - 1); }

// ---- cost of a particle's stencil ---------------------------------------------------------------------------------------

/// Operations on eight lanes in the sums of a shape, and the node records visited. Forces, fluxes and gradients have four lanes, which
/// count half. `spread_force` is `spread` of forces alone.
struct Sums {
    double spread = 0, spread_value = 0, spread_force = 0, collect = 0, collect_value = 0, visits = 0;

    Sums& operator+=(const Sums& o)
    {
        spread += o.spread;
        spread_value += o.spread_value;
        spread_force += o.spread_force;
        collect += o.collect;
        collect_value += o.collect_value;
        visits += o.visits;
        return *this;
    }
    friend Sums operator*(Sums s, double n)
    {
        return {s.spread * n, s.spread_value * n, s.spread_force * n, s.collect * n, s.collect_value * n, s.visits * n};
    }
};

/// Tensor products of n_a functions along each axis, loop by loop as in shape/stencil.hpp. A multiply-add is two operations.
template <int D>
Sums sums_of_tensor(const Index<D>& n)
{
    Sums r{};
    r.visits = 1;
    for (int a = D - 1; a >= 0; --a) {
        r.visits *= n[a];
        r.spread += r.visits * (a > 0 ? 2 + 0.5 * a : 3);  // value w + flux dw; flux w of the other axes, or the node
        r.spread_value += r.visits * (a > 0 ? 1 : 2);      // value w; the node
        r.spread_force += r.visits * (a > 0 ? 1.5 + 0.5 * a : 2);
        r.collect += r.visits * (3 + a);  // value, gradient along a and along the axes before a
        r.collect_value += r.visits * 2;
    }
    return r;
}

/// The charges of corners, w_c A + g_c . X, are spread with values only (shape/corners.hpp). `on_grid` corners spread to the
/// grid, `own` corners are nodes themselves.
template <int D>
Sums sums_of_corners(int on_grid, int own, int width)
{
    const Sums one       = sums_of_tensor<D>(Index<D>::filled(width));
    const double corners = on_grid + own;
    Sums r{};
    r.spread_value  = corners + on_grid * one.spread_value + own;
    r.spread        = r.spread_value + corners * D;
    r.spread_force  = 0.5 * r.spread_value + corners * D;
    r.collect_value = corners * 2 + on_grid * one.collect_value;
    r.collect       = r.collect_value + corners * D;
    r.visits        = on_grid * one.visits + own;
    return r;
}

/// The corners of a parallelepiped share one weight and one set of dual vectors, so their charges are made of one another by sums and
/// differences.
template <int D>
Sums sums_of_parallelepiped(int width)
{
    constexpr double corners = 1 << D, duals = D * D;
    const Sums one = sums_of_tensor<D>(Index<D>::filled(width));
    Sums r{};
    r.spread_value  = 1 + corners * one.spread_value;
    r.spread        = r.spread_value + duals + (corners - 1);
    r.spread_force  = r.spread - 0.5 * r.spread_value;
    r.collect_value = 2 + corners * one.collect_value;
    r.collect       = r.collect_value + duals + corners + 1.5 * (corners - 1) - 0.5 * D;
    r.visits        = corners * one.visits;
    return r;
}

/// Hats with the smoothed part of the gradient, which adds two nodes for each node and axis (shape/dual_domain.hpp).
template <int D>
Sums sums_of_dual_domain()
{
    Sums r = sums_of_tensor<D>(Index<D>::filled(2));
    r.spread += 2.0 * D * (1 << D);
    r.spread_force += 2.0 * D * (1 << D);
    r.collect += 1.5 * D * (1 << D);
    return r;
}

/// A point or a quadrature point.
template <int D>
Sums sums_of_point(const MethodSpec& spec)
{
    if (spec.basis == Basis::ddmpm) return sums_of_dual_domain<D>();
    return sums_of_tensor<D>(Index<D>::filled(grid_basis(spec).degree + 1));
}

/// The number of functions depends on the position of the box.
template <int D, class Basis>
Sums sums_of_box(const Lattice<D>& g, const ParticleView<D>& p, int i)
{
    Index<D> n{};
    Box<D, Basis>::with_stencil(g, p, i, [&](const auto& stencil) {
        for (int a = 0; a < D; ++a) n[a] = stencil.size(a);
    });
    return sums_of_tensor<D>(n);
}
template <int D>
Sums sums_of_box(const MethodSpec& spec, const Lattice<D>& g, const ParticleView<D>& p, int i)
{
    switch (spec.basis) {
    case Basis::bspline2: return sums_of_box<D, BSpline<2>>(g, p, i);
    case Basis::bspline3: return sums_of_box<D, BSpline<3>>(g, p, i);
    case Basis::hat:
    case Basis::bspline4:
    case Basis::bspline5:
    case Basis::ddmpm: break;  // ddmpm has no boxes
    }
    return sums_of_box<D, Hat>(g, p, i);
}

template <int D>
Sums sums_of_cell(const ParticleView<D>& p, int i, int width)
{
    int own = 0;
    for (int c = 0; c < p.cell[i].count() && p.corner_node; ++c) own += p.corner_node[p.cell[i][c]] >= 0;
    return sums_of_corners<D>(p.cell[i].count() - own, own, width);
}

/// All particles.
template <int D>
Sums sums_of_particles(const MethodSpec& spec, const Lattice<D>& g, const ParticleView<D>& p)
{
    const int width = grid_basis(spec).degree + 1;
    Sums total{};
    switch (spec.domain) {
    case Domain::point: return sums_of_point<D>(spec) * p.count;
    case Domain::parallelepiped: return sums_of_parallelepiped<D>(width) * p.count;
    case Domain::box:
    case Domain::stretched_box:
        for (int i = 0; i < p.count; ++i) total += sums_of_box(spec, g, p, i);
        break;
    case Domain::cell:
    case Domain::simplex:
        for (int i = 0; i < p.count; ++i) total += sums_of_cell(p, i, width);
        break;
    }
    return total;
}

// ---- the step -----------------------------------------------------------------------------------------------------------

template <class T>
double size_of(const T* field)
{
    return field ? sizeof(T) : 0;
}

/// One function per pass, in the order of Explicit<D>::take_step.
template <int D>
class Counter {
  public:
    Counter(const Model<D>& model, State<D>& s)
        : method_(model.method),
          s_(s),
          passes_(choose_passes<D>(model.method)),
          p_(s.particles.view()),
          n_(p_.count),
          corners_(static_cast<double>(s.particles.corner.size())),
          sums_(sums_of_particles(method_, s.lattice, p_)),
          // x_p and its domain, and the shared corners of cells, once per pass
          place_(n_ * (size_of(p_.x) + size_of(p_.half) + size_of(p_.edges) + size_of(p_.cell)) +
                 corners_ * (size_of(p_.corner) + size_of(p_.corner_node)))
    {
        total_.visits = sums_.visits;
        count_records();
    }

    StepWork count(double mass_solves, double mass_iterations)
    {
        clear();
        bool has_velocities = true;
        if (method_.scheme == TimeScheme::usf) {
            find_momenta();
            find_velocities();
            copy();
            find_gradients();
            gather(kStress | kPast);
            add_forces(false);
        } else {
            has_velocities = find_momenta_and_forces();
        }
        if (!has_velocities && (method_.mass == MassMatrix::lumped || s_.field.constraints.has_prescribed())) find_velocities();
        kick();
        filter();
        if (method_.scheme == TimeScheme::usf) {
            keep();
            gather(kVelocity);
            if (passes_.move) gather(kMove);
        } else if (strains_by_advanced(method_)) {
            if (!stores_gradient(method_)) keep();
            find_gradients();
            const double apart = method_.filter == Filter::xpic ? 1 / method_.filter_every : 0.0;
            share_             = 1 - apart;
            gather(kVelocity | kStress | kMove);
            share_ = apart;
            gather(kVelocity);
            gather(kStress);
            if (passes_.move) gather(kMove);
            share_ = 1.0;
        } else if (projects_again(method_)) {  // Runge-Kutta schemes: see count_spline_work
            gather(kVelocity);
            keep();
            clear();
            find_momenta();
            find_velocities();
            if (strain_velocity_of(method_) > 0) blend();
            find_gradients();
            gather(kStress);
            if (passes_.move) gather(kMove);
        }
        move_corners();
        solve_mass(mass_solves, mass_iterations);
        return total_;
    }

  private:
    using Stage = StageTimes::Stage;
    enum Part : unsigned { kVelocity = 1, kStress = 2, kMove = 4, kPast = 8 };

    void add(Stage stage, double flops, double bytes) { total_.stages[stage] += {share_ * flops, share_ * bytes}; }

    /// Counts the nodes and cells that the passes touch.
    void count_records()
    {
        auto count_where = [&](const Array<Lanes>& records, int size, int part, int lane, double& there) {
            if (records.empty()) return;
            s_.field.tiles.for_each_node(
                [&](const Index<D>&, std::ptrdiff_t node) { there += records[node * size + part][lane] > 0; });
        };
        s_.field.tiles.for_each_node([&](const Index<D>&, std::ptrdiff_t) { ++active_; });
        count_where(s_.field.nodes, 1, 0, NodeLane::mass, massive_);
        count_where(s_.cell_contents, 1, 0, NodeLane::volume, cells_);
        if (passes_.velocity_fit.size > 0) count_where(s_.velocity_records, passes_.velocity_fit.size, 0, 0, targets_);
        if (passes_.cell_fit.size > 0) count_where(s_.cell_records, passes_.cell_fit.size, 0, 0, cell_targets_);
        constexpr int size = CellGradient<D>::size;
        count_where(s_.gradients, size, size - 1, 7, gradients_);
        active_ += static_cast<double>(p_.enriched_count);
        massive_ += static_cast<double>(p_.enriched_count);
    }

    int unknowns() const { return binomial(static_cast<int>(method_.degree) + D, D); }

    // Passes over nodes: active nodes are read, those with mass are changed.
    void clear() { add(Stage::nodes, 0, kRecord * active_); }
    void copy() { add(Stage::nodes, 0, 2 * kRecord * active_); }
    /// Two products and a sum.
    void blend() { add(Stage::nodes, 3 * kLanes * active_, 3 * kRecord * active_); }
    /// 1/m, and its product with the lanes.
    void lumped_velocities() { add(Stage::nodes, (1 + kLanes) * massive_, kRecord * (active_ + massive_)); }
    /// dt/m, dt a = (dt/m) f + dt g, its difference from f, and the sum with the lanes.
    void kick() { add(Stage::nodes, (1 + 2 * 3 + 3 + kLanes) * massive_, kRecord * (active_ + massive_)); }

    /// The terms of a filter after the first, in the mean over steps.
    void filter()
    {
        if (method_.filter == Filter::none) return;
        share_ = 1 / method_.filter_every;
        for (int order = 1; order < static_cast<int>(method_.filter_order); ++order) {
            gather(kVelocity);
            keep();
            clear();
            find_momenta();
            find_velocities();
            blend();  // two sums
        }
        share_ = 1.0;
    }

    // Scatters.
    void scatter(double flops, double fields) { add(Stage::scatter, flops, place_ + n_ * fields + 2 * kRecord * massive_); }
    double body_force_flops() const { return p_.b ? D : 0; }
    /// A scatter of quadrature points, with V sigma for forces, and m and m v for mass.
    void scatter_points(bool has_mass, bool has_force)
    {
        const ParticleView<D> q = s_.points.view();
        const double points     = q.count;
        const Sums one          = sums_of_point<D>(method_);
        const double sums       = !has_force ? one.spread_value : has_mass ? one.spread : one.spread_force;
        const double fields =
            size_of(q.x) + size_of(q.V) + (has_mass ? size_of(q.m) + size_of(q.v) : 0) + (has_force ? size_of(q.sigma) : 0);
        add(Stage::scatter, points * (kLanes * sums + (has_mass ? D : 0) + (has_force ? D * D : 0)),
            points * fields + 2 * kRecord * massive_);
    }

    /// m_i and (m v)_i from particles: m v, or at each node m (v + L (x_i - x_p)) or polynomials.
    void project_particles()
    {
        const double fields = size_of(p_.m) + size_of(p_.v) + size_of(p_.V);
        if (p_.modes) {
            const double modes = power_of(static_cast<int>(method_.degree) + 1, D);
            scatter(kLanes * (multiply_adds_of_modes() + sums_.visits) + n_ * modes * D, fields + modes * sizeof(Vec<D>));
        } else if (spreads_gradient(method_) && method_.domain == Domain::point) {
            scatter(kLanes * sums_.spread + n_ * (D + D * D), fields + size_of(p_.L));
        } else if (spreads_gradient(method_)) {
            scatter(sums_.visits * (2 * kLanes + D + D * (2 * D - 1) + 2 * D), fields + size_of(p_.L));
        } else {
            scatter(kLanes * sums_.spread_value + n_ * D, fields);
        }
    }
    void find_momenta()
    {
        if (!has_tls_velocity(method_)) {
            project_particles();
            return;
        }
        fit_cells();
        scatter_points(true, false);
        if (method_.domain == Domain::point) return;
        clear();
        project_particles();
        settle_masses();
    }
    /// Returns whether nodes then have velocities.
    bool find_momenta_and_forces()
    {
        const bool finds_velocities = passes_.velocity_fit.solve || method_.quadrature == Quadrature::cell;
        const bool is_fused         = passes_.project_and_force && !passes_.cell_fit.spread;
        if (is_fused)
            scatter(kLanes * sums_.spread + n_ * (D + D * D + body_force_flops()),
                    size_of(p_.m) + size_of(p_.v) + size_of(p_.V) + size_of(p_.sigma) + size_of(p_.b));
        else
            find_momenta();
        if (finds_velocities) find_velocities();
        if (!is_fused) add_forces(has_tls_velocity(method_));
        return finds_velocities;
    }
    /// f_i: V sigma, and its scatter.
    void add_forces(bool has_points)
    {
        const bool is_cell = method_.quadrature == Quadrature::cell;
        if (!is_cell && !has_gauss_forces(method_)) {
            scatter(kLanes * sums_.spread_force + n_ * (D * D + body_force_flops()),
                    size_of(p_.V) + size_of(p_.sigma) + (p_.b ? size_of(p_.b) + size_of(p_.m) : 0));
            return;
        }
        if (!has_points) fit_cells();
        if (!is_cell) {
            scatter_points(false, true);
            return;
        }
        copy();
        add(Stage::nodes, kLanes * active_, 2 * kRecord * active_);  // clear_masses
        if (passes_.project_and_force_points) {
            scatter_points(true, true);
        } else {
            scatter_points(true, false);
            scatter_points(false, true);
        }
        settle_masses();
    }
    void settle_masses() { add(Stage::nodes, 0, kRecord * (2 * active_ + massive_)); }

    // Fits.
    void find_velocities()
    {
        if (passes_.velocity_fit.solve) {
            spread_velocity();
            solve_velocity();
        } else if (method_.mass == MassMatrix::lumped) {
            lumped_velocities();
        }  // else see solve_mass
    }
    /// The multiply-adds of each sample; samples at corners need L r.
    void spread_velocity()
    {
        const double size = passes_.velocity_fit.size;
        double samples = n_, flops = 0, bytes = n_ * (size_of(p_.x) + size_of(p_.v));
        if (method_.samples == Samples::corners && p_.cell) {
            for (int i = 0; i < p_.count; ++i)
                for (int c = 0; c < (1 << D); ++c) samples += p_.samples[i] >> c & 1;
            bytes += n_ * (size_of(p_.samples) + size_of(p_.cell)) + corners_ * 2 * sizeof(Vec<D>);
        } else if (method_.samples == Samples::corners) {
            samples += n_ * (1 << D);
            flops = n_ * (kProduct<D> + (1 << D) * 4 * D * D);
            bytes += n_ * (size_of(p_.L) + size_of(p_.edges) + size_of(p_.half));
        }
        flops += samples * passes_.velocity_fit.work * 2 * kLanes;
        add(Stage::fit, flops, bytes + kRecord * size * (active_ + 2 * targets_));
    }
    /// L D L^T, the first row of the inverse, and its product with the right-hand sides; with a limiter also what slopes explain.
    void solve_velocity()
    {
        const int n           = unknowns();
        const double limiting = method_.limiter == Limiter::none ? 0.0 : D * (n * (n - 1) + 3 * n);
        add(Stage::fit, massive_ * (ldl_flops(n) + ldl_solve_flops(n) + D * 2 * n + limiting),
            kRecord * (active_ + massive_ * (1 + passes_.velocity_fit.size)));
    }
    /// Contents of the cells; the multiply-adds of each particle; then the points.
    void fit_cells()
    {
        const double size = passes_.cell_fit.size, points = s_.points.count;
        const bool is_cell  = method_.quadrature == Quadrature::cell;
        const int n         = unknowns();
        const int count     = is_cell ? CellFields<D, false>::used(p_) : CellFields<D, true>::count;
        const double fields = sizeof(Vec<D>) * 2 + sizeof(double) * 2 + sizeof(Mat<D>);
        add(Stage::fit, n_ * (2 * D + kLanes + 1 + D + passes_.cell_fit.work(count) * 2 * kLanes),
            n_ * (fields + size_of(p_.b)) + kRecord * ((1 + size) * active_ + 2 * cells_ + 2 * size * cell_targets_));
        const double solves = ldl_flops(n) + (is_cell ? ldl_solve_flops(n) : ldl_flops(n - 1) + count * ldl_solve_flops(n));
        add(Stage::fit, cells_ * solves + points * count * 2 * n, kRecord * (1 + size) * cells_ + points * fields);
    }
    /// L_c = sum_i v_i (x) grad N_i in cells whose nodes all have mass.
    void find_gradients()
    {
        if (!passes_.gradient_at_center) return;
        constexpr int size = CellGradient<D>::size;
        add(Stage::fit, gradients_ * power_of(grid_basis(method_).degree + 1, D) * 2 * D * D,
            kRecord * (size * (active_ + gradients_) + massive_));
    }

    /// Flops per lane of products with polynomials, axis by axis.
    double multiply_adds_of_modes() const
    {
        const int count = static_cast<int>(method_.degree) + 1;
        double visits = n_, flops = 0;
        for (int a = D - 1; a >= 0; --a) {
            visits *= grid_basis(method_).degree + 1;
            flops += 2 * visits * power_of(count, a + 1);
        }
        return flops;
    }

    // Gathers.
    void gather(unsigned parts)
    {
        double flops = 0, fields = 0, records = massive_;
        if (parts & kStress) {
            if (passes_.gradient_at_center) {  // from 3^D cells; values from nodes if needed
                flops += kLanes * n_ * power_of(3, D) * CellGradient<D>::size * 2;
                flops += parts & (kVelocity | kMove) ? kLanes * sums_.collect_value : 0;
                records = gradients_ * CellGradient<D>::size + (parts & (kVelocity | kMove) ? massive_ : 0);
            } else {
                flops += kLanes * sums_.collect;
            }
            flops += n_ * (D * D + kDeformFlops<D> + (parts & kPast ? D * D + kInverse<D> + kProduct<D> : 0));
            fields += 2 * size_of(p_.F) + size_of(p_.sigma) + size_of(p_.V0) + size_of(p_.material);
            fields += (p_.cell ? 0 : size_of(p_.V)) + (stores_gradient(method_) ? size_of(p_.L) : 0);
        } else {
            flops += kLanes * sums_.collect_value;
        }
        if (parts & kVelocity) {
            flops += n_ * 4 * D;  // (1 - pic) (v + dv) + pic v_i
            fields += 2 * size_of(p_.v);
        }
        if (parts & kMove && passes_.move) {
            flops += n_ * (2 * D + (p_.edges ? kProduct<D> : 0));
            fields += size_of(p_.x) + size_of(p_.edges0) + size_of(p_.edges);
            if (method_.domain == Domain::stretched_box) {
                flops += n_ * D;
                fields += size_of(p_.half0) + size_of(p_.half);
            }
            if (!(parts & kStress) && (p_.edges || method_.domain == Domain::stretched_box)) fields += size_of(p_.F);
        }
        add(Stage::gather, flops, place_ + n_ * fields + kRecord * records);
    }
    /// What particles carry to the next projection.
    void keep()
    {
        if (!passes_.keep) return;
        double flops = 0, fields = size_of(p_.L);
        if (p_.modes) {
            const double modes = power_of(static_cast<int>(method_.degree) + 1, D);
            flops              = kLanes / 2 * multiply_adds_of_modes() + n_ * modes * (D + D - 1);
            fields             = modes * sizeof(Vec<D>);
        } else if (method_.projection == Projection::affine && method_.domain != Domain::point) {  // B_p and D_p, B_p D_p^-1
            flops = sums_.visits * (D + 6 * D * D) + n_ * (ldl_flops(D) + D * ldl_solve_flops(D));
        } else {
            flops = kLanes * sums_.collect;
        }
        add(Stage::gather, flops, place_ + n_ * fields + kRecord * massive_);
    }
    /// x_c += dt sum N_i(x_c) v_i; x_p = sum w_c x_c and V_p.
    void move_corners()
    {
        if (!passes_.move_corners) return;
        const Sums one  = sums_of_tensor<D>(Index<D>::filled(grid_basis(method_).degree + 1));
        double on_grid  = corners_;
        const auto size = static_cast<std::ptrdiff_t>(s_.particles.corner.size());
        for (std::ptrdiff_t c = 0; c < size && p_.corner_node; ++c) on_grid -= p_.corner_node[c] >= 0;
        add(Stage::gather, on_grid * kLanes * one.collect_value + corners_ * (2 + (p_.corner_velocity ? 4 : 0)) * D,
            corners_ * (2 * size_of(p_.corner) + 2 * size_of(p_.corner_velocity) + size_of(p_.corner_node)) + kRecord * massive_);
        const double of_cell = method_.domain == Domain::simplex ? D + 1 : 1 << D;
        add(Stage::gather, n_ * of_cell * 3 * D, place_ + n_ * (size_of(p_.x) + size_of(p_.V)));
    }

    /// Conjugate gradients (method/mass_matrix.cpp): products with the mass matrix, one per iteration and one more per solve,
    /// the row sums and factors once per step, the preconditioner, and passes over the solver's records.
    void solve_mass(double solves, double iterations)
    {
        if (method_.mass != MassMatrix::consistent || solves == 0) return;
        const MassSystem<D>& m = s_.field.mass;
        const auto rows_solved = static_cast<double>(m.rows.count());
        const bool has_lumped =
            std::any_of(m.lanes.data() + 1, m.lanes.data() + m.rows.end(), [](unsigned char lanes) { return lanes == 0; });
        const bool of_points        = has_tls_velocity(method_);
        const MassRowPasses<D> rows = of_points ? passes_.mass_rows_of_points : passes_.mass_rows;
        const double count          = of_points ? s_.points.count : n_;
        const double fields         = (of_points ? count * sizeof(Vec<D>) : place_) + count * sizeof(double);
        const double products       = iterations + solves + has_lumped;
        if (rows.form) {
            form_rows(rows, count, fields, rows_solved);
            const double entries = power_of(2 * rows.reach + 1, D), bytes = static_cast<double>(rows.size * sizeof(double));
            add(Stage::nodes, products * rows_solved * kLanes * 2 * entries, products * rows_solved * (bytes + 2 * kRecord));
            // sums along each axis; then forward and back substitution along lines
            const auto factors = static_cast<double>(rows.factor_size * sizeof(float));
            add(Stage::nodes, rows_solved * D * entries, rows_solved * (bytes + factors));
            add(Stage::nodes, iterations * rows_solved * kLanes * D * 2 * (1 + 2 * rows.reach),
                iterations * rows_solved * 2 * (factors + (2 * D - 1) * kRecord));
        } else {
            add(Stage::nodes, products * kLanes * (sums_.collect_value + sums_.spread_value + count),
                products * (fields + kRecord * (2 * active_ + 7 * rows_solved)));  // also copies from rows to nodes and back
        }
        // z = z mask scale, r.z; p = z + p beta; q = mask (q + p diagonal), p.q; u += p alpha, r -= q alpha, z = r scale, z.z
        constexpr double operations = 4 + 2 + 5 + 7, records = 3 + 3 + 3 + 7;
        // the first u; b.b, r = mask (b - q - u diagonal), z; z.z; without what reads only lanes and scales
        constexpr double first_operations = 2 + 8 + 2, first_records = 2 + 6 + 1;
        add(Stage::nodes, kLanes * rows_solved * (operations * iterations + first_operations * solves),
            kRecord * rows_solved * (records * iterations + first_records * solves));
    }
    /// Once per step: the products of the functions at each particle; half of each row, cleared and added to.
    void form_rows(const MassRowPasses<D>& rows, double count, double fields, double rows_solved)
    {
        const double nodes = power_of(rows.reach + 1, D);
        add(Stage::nodes, count * (D * nodes + nodes * (nodes + 1)), fields + 3 * sizeof(double) * rows.size * rows_solved);
    }

    const MethodSpec& method_;
    State<D>& s_;
    const Passes<D> passes_;
    const ParticleView<D> p_;
    const double n_, corners_;
    const Sums sums_;
    const double place_;
    double active_ = 0, massive_ = 0;        ///< nodes of the blocks touched by particles; nodes with mass
    double cells_   = 0;                     ///< cells with particles
    double targets_ = 0, cell_targets_ = 0;  ///< records of velocity fits and of cell fits
    double gradients_ = 0;                   ///< cells with a gradient
    double share_     = 1.0;                 ///< of the steps in which a pass is done
    StepWork total_;
};

}  // namespace

Work StepWork::total() const
{
    Work sum{};
    for (const Work& w : stages) sum += w;
    return sum;
}

template <int D>
StepWork count_spline_work(const Model<D>& model, const State<D>& s, const SplineIterations& iterations)
{
    const MethodSpec& method = model.method;
    const double n           = s.particles.count;
    StepWork total;
    auto add = [&](StageTimes::Stage stage, double flops, double bytes) { total.stages[stage] += {flops, bytes}; };

    const double stages = stages_of(method.scheme), vector_operations = 16;
    const int degrees[] = {degree_of(method.basis), static_cast<int>(method.stress_degree)};
    const double points = std::max(degrees[0], degrees[1]) + 1;
    double cells = 1, functions[] = {1, 1};
    for (int a = 0; a < D; ++a) {
        cells *= s.lattice.cells[a];
        for (const int k : {0, 1}) functions[k] *= s.lattice.cells[a] + degrees[k];
    }
    auto sum_of = [](double width) { return kLanes * 2 * (D == 1 ? width : width * (1 - std::pow(width, D)) / (1 - width)); };
    // Products with a matrix of `weights`, see SplineMatrix, and the vectors and factors of conjugate gradients.
    auto solve = [&](StageTimes::Stage stage, int space, double weights, double products) {
        const double width = degrees[space] + 1, entries = std::pow(2 * degrees[space] + 1, D), band = 4 * D * degrees[space];
        add(stage, products * functions[space] * kLanes * (2 * entries + band + vector_operations),
            products * functions[space] * (std::pow(width, D) * weights * sizeof(double) + kRecord * (2 * D + 14)));
    };
    auto pairs = [](double degree, int power) { return std::pow((degree + 1) * (degree + 2) / 2, power); };
    for (const int k : {0, 1}) {
        const double width = degrees[k] + 1, one = sum_of(width), rows = n * D * width * sizeof(double), weights = 2 - k;
        solve(StageTimes::fit, k, weights, static_cast<double>(iterations[k]) + 2 * stages);  // and once for the row sums
        add(StageTimes::fit, stages * (n * 2 + cells) * weights * pairs(degrees[k], D),
            stages * cells * weights * pairs(degrees[k], D) * 2 * sizeof(double));
        add(StageTimes::fit, stages * n * one, stages * (2 * rows + n * sizeof(Mat<D>)));  // right-hand sides
        const double records = 1 + k * (D - 1);  // one record per column of the gradient
        add(StageTimes::gather, stages * n * records * one, stages * (rows + records * kRecord * functions[k]));
    }
    double density = 0, mass = 0;  // from a cell's functions to its Gauss points, from there to its part of the matrix
    for (int a = 0; a < D; ++a) {
        density += kLanes * 2 * std::pow(points, a + 1) * std::pow(degrees[0] + 1, D - a);
        mass += 2 * std::pow(points, D - a) * pairs(degrees[0], a + 1);
    }
    add(StageTimes::nodes, stages * cells * (density + mass + pairs(degrees[0], D)),
        stages * cells * (2 * std::pow(points, D) + 2 * pairs(degrees[0], D)) * sizeof(double));
    solve(StageTimes::nodes, 0, 1, static_cast<double>(iterations[SplineSolve::mass]) + 2 * stages);
    add(StageTimes::gather, stages * n * (kProduct<D> + kDeformFlops<D> + 16 * D + 4 * D * D),
        stages * n * (6 * sizeof(Vec<D>) + 6 * sizeof(Mat<D>)));
    return total;
}

template <int D>
StepWork count_work(const Scheme<D>& scheme, State<D>& s, double mass_solves, double mass_iterations)
{
    if (const auto* splines = dynamic_cast<const SplineScheme<D>*>(&scheme))
        return count_spline_work(scheme.model(), s, splines->scratch().iterations);
    return Counter<D>(scheme.model(), s).count(mass_solves, mass_iterations);
}

#define ORDO_WORK(D)                                                           \
    template StepWork count_work(const Scheme<D>&, State<D>&, double, double); \
    template StepWork count_spline_work(const Model<D>&, const State<D>&, const SplineIterations&);
ORDO_WORK(1)
ORDO_WORK(2)
ORDO_WORK(3)
#undef ORDO_WORK

}  // namespace ordo
