#include "implicit/step_equations.hpp"

#include "kernels/nodes.hpp"
#include "kernels/sample.hpp"
#include "solve/krylov.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ordo {

namespace {

constexpr double kContactStiffness = 10.0;  // an overlap of a hundredth of a cell for a pressure of a tenth of the modulus
constexpr double kEnergyRounding =
    1e-10;  // of the modulus: that of the stress which mean_stress adds, a difference of energies over a strain
constexpr double kLeastMass   = 1e-18;  // of the largest: less is round-off of functions that vanish with their slopes
constexpr double kLeastFilled = 0.1;    // a layer of 0.45 cells beyond a node leaves this part of its function

/// The stiffness that the ghost penalty is relative to, Pa: the least of a material, so that it does not make hardly compressible ones stiffer.
double shear_of(const Material& m) { return m.mu > 0 ? m.mu : m.p_wave_modulus(); }

}  // namespace

template <int D>
StepEquations<D>::StepEquations(const Model<D>& model, const Passes<D>& passes, const MassSolver<D>& mass_solver, State<D>& s,
                                double dt, SetBodyForces set_body_forces)
    : model_(model),
      passes_(passes),
      mass_solver_(mass_solver),
      s_(s),
      dt_(dt),
      is_middle_(model.method.scheme == TimeScheme::midpoint),
      set_body_forces_(std::move(set_body_forces)),
      forces_(model, s, dt, is_middle_)
{
    const auto n = static_cast<std::size_t>(s.particles.x.size());
    u_ = Array<Vec<D>>(n), d_force_ = Array<Vec<D>>(n), moved_ = Array<Vec<D>>(n);
    f_ = Array<Mat<D>>(n), d_moment_ = Array<Mat<D>>(n);
    make_room(nodes_, s.field.nodes.size());
    s.field.mass.is_formed = false;
    project_velocities();
    find_held();
    fit_guess();
    start_.assign(size(), 0.0);
    if (!is_static(method()))
        for (std::size_t k = 0; k < size(); ++k)
            start_[k] = held_[k] ? known_[k] - 0.5 * dt * (known_velocity_[k] - velocity_[k]) : dt * velocity_[k];
    if (is_middle_) inertia_ = 2 / (dt * dt);
    if (is_newmark()) {
        const double beta = newmark_beta_of(method());
        end_part_         = method().newmark_gamma;
        inertia_          = 1 / (beta * dt * dt);
        start_factor_     = (0.5 - beta) / beta;
    }
    contact_factor_ = is_newmark() ? 0.5 / newmark_beta_of(method()) : 1.0;
    obstacles_.emplace(model, s, rows_, dt, kContactStiffness);
    if (is_newmark()) find_start_forces();
    largest_modulus_ = parallel_reduce(
        s.particles.count, 0.0, [&](std::ptrdiff_t i) { return model_.materials[s_.particles.material[i]].p_wave_modulus(); },
        [](double& largest, double one) { largest = std::max(largest, one); });
    find_penalty();
}

template <int D>
Sweep<D> StepEquations<D>::sweep(Lanes* nodes) const
{
    return {.lattice       = s_.lattice,
            .p             = s_.particles.view(),
            .nodes         = nodes,
            .materials     = model_.materials.data(),
            .dt            = dt_,
            .pic           = method().pic_fraction,
            .stretch_limit = 0.0};
}

template <int D>
void StepEquations<D>::scatter(typename Passes<D>::Scatter pass, const Sweep<D>& view)
{
    clear(view.nodes, s_.field.tiles);
    s_.field.tiles.for_each_by_colour([&](const Tile& tile) { pass(view, tile.begin, tile.end); });
    s_.field.halo.add(view.nodes, 0, NodeLane::end);
}

/// Sets velocity_ to the projection of those of the particles. Numbers the rows and finds their masses and the guess.
template <int D>
void StepEquations<D>::project_velocities()
{
    Lanes* nodes        = s_.field.nodes.data();
    const Sweep<D> view = sweep(nodes);
    scatter(passes_.project, view);
    number_rows(nodes);
    if (method().mass == MassMatrix::consistent)
        mass_solver_.solve(s_, view, nodes, s_.field.known.data(), MassSolver<D>::kVelocity);
    else
        momenta_to_velocities(nodes, s_.field.tiles);
    velocity_.resize(mass_.size() * D);
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) { velocity_[k] = nodes[node][NodeLane::velocity + a]; });
}

template <int D>
void StepEquations<D>::number_rows(const Lanes* nodes)
{
    s_.field.tiles.for_each_node(
        [&](const Index<D>&, std::ptrdiff_t i) { largest_mass_ = std::max(largest_mass_, nodes[i][NodeLane::mass]); });
    rows_.assign(s_.lattice, s_.field.tiles, 1,
                 [&](std::ptrdiff_t i) { return nodes[i][NodeLane::mass] > kLeastMass * largest_mass_; });
    mass_.resize(static_cast<std::size_t>(rows_.count()));
    for (std::size_t k = 0; k < mass_.size(); ++k) mass_[k] = nodes[rows_.node(static_cast<int>(k) + 1)][NodeLane::mass];
    guess_.resize(mass_.size() * D);
    for_each_unknown(
        [&](std::size_t k, std::ptrdiff_t node, int a) { guess_[k] = dt_ / mass_[k / D] * nodes[node][NodeLane::velocity + a]; });
}

/// Where conditions give none of it, a step in motion begins without. A load step begins like the last one, if that fits what conditions give now,
/// and moves the body little enough that it still has the same nodes.
template <int D>
void StepEquations<D>::fit_guess()
{
    if (!is_static(method())) {
        for (std::size_t k = 0; k < size(); ++k)
            if (held_[k]) guess_[k] = 0.0;
        return;
    }
    constexpr double largest_factor = 4.0, least_fit = 0.1, most_cells = 0.5;
    std::fill(guess_.begin(), guess_.end(), 0.0);
    for (const NodeMotion<D>& one : s_.load_step)
        if (const int row = row_at(one.node); row > 0)
            for (int a = 0; a < D; ++a) guess_[unknown(row, a)] = dt_ * one.velocity[a];
    double known = 0.0, fit = 0.0, at_held = 0.0, misfit = 0.0;
    for (std::size_t k = 0; k < size(); ++k)
        if (held_[k]) {
            known += known_[k] * known_[k];
            fit += known_[k] * guess_[k];
            at_held += guess_[k] * guess_[k];
        }
    const double factor = known == 0.0 ? 1.0 : at_held > 0.0 ? std::clamp(fit / at_held, 0.0, largest_factor) : 0.0;
    double cells        = 0.0;
    for (std::size_t k = 0; k < size(); ++k) {
        guess_[k] *= factor;
        cells = std::max(cells, std::fabs(guess_[k]) / model_.h[static_cast<int>(k % D)]);
        if (held_[k]) misfit += (guess_[k] - known_[k]) * (guess_[k] - known_[k]);
    }
    const bool fits = cells <= most_cells && misfit <= least_fit * std::max(known, factor * factor * at_held);
    for (std::size_t k = 0; k < size(); ++k) guess_[k] = !fits ? 0.0 : held_[k] ? known_[k] : guess_[k];
}

/// The row of a node without the margin, which may have none or lie beyond the lattice.
template <int D>
int StepEquations<D>::row_at(Index<D> node) const
{
    for (int a = 0; a < D; ++a) {
        node[a] += s_.lattice.margin;
        if (node[a] < 0 || node[a] >= s_.lattice.nodes[a]) return 0;
    }
    return rows_.row(s_.lattice.offset(node));
}

template <int D>
void StepEquations<D>::keep_load_step(std::span<const double> u) const
{
    s_.load_step.resize(mass_.size());
    for (int row = 1; row < rows_.end(); ++row) {
        NodeMotion<D>& one = s_.load_step[static_cast<std::size_t>(row) - 1];
        one.node           = s_.lattice.index(rows_.node(row)) - Index<D>::filled(s_.lattice.margin);
        for (int a = 0; a < D; ++a) one.velocity[a] = u[unknown(row, a)] / dt_;
    }
}

template <int D>
void StepEquations<D>::find_start_forces()
{
    if (!s_.particles.b.empty()) set_body_forces_(s_, s_.t);
    forces_.find_at_start();
    for (Vector* one : {&start_nodal_force_, &start_load_}) {
        one->resize(size());
        set_forces(nodes_.data(), one == &start_load_);
        for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) { (*one)[k] = nodes_[node][NodeLane::increment + a]; });
    }
    start_force_ = start_nodal_force_;
    for_each_unknown([&](std::size_t k, std::ptrdiff_t, int a) { start_force_[k] += mass_[k / D] * model_.gravity[a]; });
}

/// Fixed components have no velocity before the step either.
template <int D>
void StepEquations<D>::find_held()
{
    held_.assign(velocity_.size(), 0);
    known_.assign(velocity_.size(), 0.0);
    known_velocity_ = stopped_ = known_;
    auto for_each              = [&](const Moment& when, const auto& f) {
        s_.field.constraints.for_each_velocity(model_.conditions, when,
                                                            [&](std::ptrdiff_t node, int a, bool is_prescribed, double v) {
                                                   const int row = rows_.row(node);
                                                   if (row > 0 && rows_.node(row) == node) f(unknown(row, a), is_prescribed, v);
                                               });
    };
    for_each({s_.t + 0.5 * dt_, dt_}, [&](std::size_t k, bool is_prescribed, double v) {
        held_[k]  = 1;
        known_[k] = dt_ * v;
        if (!is_prescribed) stopped_[k] = std::exchange(velocity_[k], 0.0);
    });
    for_each({s_.t + dt_, dt_}, [&](std::size_t k, bool, double v) { known_velocity_[k] = v; });
}

template <int D>
void StepEquations<D>::find_penalty()
{
    const double factor = ghost_penalty_of(method());
    if (factor == 0.0) return;
    const auto n            = static_cast<std::size_t>(rows_.end());
    const Lanes* nodes      = s_.field.nodes.data();
    const ParticleView<D> p = s_.particles.view();
    Vector filled(n), modulus(n), volume(n);
    for (int row = 1; row < rows_.end(); ++row) filled[row] = filled_part(s_.lattice, nodes, s_.lattice.index(rows_.node(row)));
    const Sweep<D> view = sweep(nullptr);
    std::vector<NodeWeight<D>> weights;
    for (int i = 0; i < p.count; ++i) {
        passes_.list_weights(view, i, weights);
        for (const NodeWeight<D>& w : weights) {
            const auto row = static_cast<std::size_t>(rows_.row(w.node));
            modulus[row] += w.value * p.V[i] * shear_of(model_.materials[p.material[i]]);
            volume[row] += w.value * p.V[i];
        }
    }
    for (std::size_t row = 1; row < n; ++row) modulus[row] = volume[row] > 0 ? modulus[row] / volume[row] : 0.0;
    penalty_ = JumpPenalty<D>(s_.lattice, rows_, factor, kLeastFilled, filled, modulus,
                              [&](int row, int a) { return held_[unknown(row, a)] != 0; });
}

template <int D>
void StepEquations<D>::put(std::span<const double> x, Lanes* nodes, int lane) const
{
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) { nodes[node][lane + a] = x[k]; });
}

template <int D>
void StepEquations<D>::sample(std::span<const double> x, Array<Vec<D>>& value, Array<Mat<D>>& gradient)
{
    clear(nodes_.data(), s_.field.tiles);
    put(x, nodes_.data(), NodeLane::velocity);
    s_.field.halo.copy(nodes_.data());
    const Sweep<D> view = sweep(nodes_.data());
    s_.field.tiles.for_each(
        [&](std::ptrdiff_t, const Tile& tile) { passes_.sample(view, value.data(), gradient.data(), tile.begin, tile.end); });
}

/// r -= factor M x
template <int D>
void StepEquations<D>::subtract_inertia(std::span<const double> x, std::span<double> r, double factor)
{
    if (factor == 0.0) return;
    if (method().mass == MassMatrix::lumped)
        return for_each_unknown([&](std::size_t k, std::ptrdiff_t, int) { r[k] -= factor * mass_[k / D] * x[k]; });
    Lanes* nodes = nodes_.data();
    copy(nodes, s_.field.nodes.data(), s_.field.tiles);  // lumped rows need masses
    put(x, nodes, NodeLane::velocity);
    mass_solver_.multiply_solution(s_, sweep(nodes), nodes);
    const MassSystem<D>& m = s_.field.mass;
    for_each_unknown(
        [&](std::size_t k, std::ptrdiff_t node, int a) { r[k] -= factor * m.q[m.rows.row(node)][NodeLane::velocity + a]; });
}

template <int D>
bool StepEquations<D>::find_residual(std::span<const double> u, std::span<double> r, bool with_derivatives)
{
    sample(u, u_, f_);
    parallel_for_each(s_.particles.count, [&](std::ptrdiff_t i) { f_[i] += Mat<D>::identity(); });
    if (!s_.particles.b.empty()) {
        const double part = is_middle_ ? 0.5 : 1.0;
        parallel_for_each(s_.particles.count, [&](std::ptrdiff_t i) { moved_[i] = s_.particles.x[i] + part * u_[i]; });
        std::swap(moved_, s_.particles.x);
        set_body_forces_(s_, s_.t + part * dt_);
        std::swap(moved_, s_.particles.x);
    }
    report_ = forces_.find(u_.data(), f_.data(), with_derivatives);
    if (report_.fault != Fault::none) return false;
    force_ = 0.0;
    set_forces(nodes_.data(), false);
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) {
        r[k] = nodes_[node][NodeLane::increment + a] + mass_[k / D] * model_.gravity[a];
    });
    if (!obstacles_->is_empty()) {
        contact_force_.assign(size(), 0.0);
        obstacles_->add_forces(u, contact_force_);
        force_ = std::max(force_, length_of(contact_force_));
        add_multiple(r, contact_factor_, contact_force_);
    }
    force_               = std::max(force_, length_of(r));
    const bool has_loads = !s_.particles.b.empty() || !model_.tractions.empty();
    if (has_loads) set_forces(nodes_.data(), true);
    Vector rest(size());
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) {
        rest[k] = (has_loads ? nodes_[node][NodeLane::increment + a] : 0.0) + mass_[k / D] * model_.gravity[a];
    });
    force_   = std::max(force_, length_of(rest));
    largest_ = 0.0;
    for (const double one : u) largest_ = std::max(largest_, std::fabs(one));
    rounding_ = std::sqrt(static_cast<double>(size())) * rounding_of(largest_modulus_, largest_mass_);
    penalty_.subtract_product(u.data(), r.data());
    end_force_.assign(r.begin(), r.end());
    if (is_newmark()) add_multiple(r, start_factor_, start_force_);
    for (std::size_t k = 0; k < size(); ++k) rest[k] = u[k] - start_[k];
    subtract_inertia(rest, r, inertia_);
    return true;
}

template <int D>
void StepEquations<D>::add_penalty_forces(std::span<const double> u, Lanes* nodes) const
{
    Vector force(size(), 0.0);
    penalty_.subtract_product(u.data(), force.data());
    for_each_unknown(
        [&](std::size_t k, std::ptrdiff_t node, int a) { nodes[node][NodeLane::increment + a] += end_part_ * force[k]; });
}

/// What displacements leave of a residual by rounding, N: in deformation gradients, which stiffness multiplies, and in inertia. Displacements by many
/// cells in a step excuse nothing: they run away.
template <int D>
double StepEquations<D>::rounding_of(double modulus, double mass) const
{
    constexpr double most_cells = 100.0;
    double volume               = 1.0;
    for (int a = 0; a < D; ++a) volume *= model_.h[a];
    const double h = *std::min_element(model_.h.c, model_.h.c + D), moved = std::min(largest_, most_cells * h);
    const double r =
        16 * std::numeric_limits<double>::epsilon() * ((h + moved) * modulus * volume / (h * h) + moved * inertia_ * mass);
    return is_middle_ ? r + kEnergyRounding * modulus * volume / h : r;
}

template <int D>
auto StepEquations<D>::largest_change_of_volume(std::span<const double> u) -> ChangeOfVolume
{
    sample(u, u_, f_);
    const auto size_of = [](const ChangeOfVolume& one) { return std::max(one.factor, 1 / one.factor); };
    return parallel_reduce(
        s_.particles.count, ChangeOfVolume{},
        [&](std::ptrdiff_t i) {
            return ChangeOfVolume{static_cast<int>(i), det(f_[i] + Mat<D>::identity())};
        },
        [&](ChangeOfVolume& largest, const ChangeOfVolume& one) {
            if (size_of(one) > size_of(largest)) largest = one;
        });
}

template <int D>
bool StepEquations<D>::may_be_rounding(std::span<const double> residual)
{
    constexpr double deviations = 4.0;  // of single nodes from the mean
    if (modulus_.empty()) {
        modulus_.assign(mass_.size(), 0.0);
        const Sweep<D> view = sweep(nullptr);
        std::vector<NodeWeight<D>> weights;
        for (int i = 0; i < s_.particles.count; ++i) {
            const double own = model_.materials[s_.particles.material[i]].p_wave_modulus();
            passes_.list_weights(view, i, weights);
            for (const NodeWeight<D>& w : weights)
                if (const int row = rows_.row(w.node); row > 0) modulus_[row - 1] = std::max(modulus_[row - 1], own);
        }
        std::vector<unsigned char> is_in_contact(mass_.size(), 0);
        obstacles_->for_each_row([&](int row, const Mat<D>&) { is_in_contact[row - 1] = 1; });
        for (std::size_t k = 0; k < modulus_.size(); ++k)
            if (is_in_contact[k]) modulus_[k] *= kContactStiffness * contact_factor_;
    }
    bool r = true;
    for (std::size_t k = 0; k < size(); ++k)
        r = r && (held_[k] || std::fabs(residual[k]) <= deviations * rounding_of(modulus_[k / D], mass_[k / D]));
    return r;
}

template <int D>
void StepEquations<D>::set_forces(Lanes* nodes, bool loads_alone)
{
    Sweep<D> view          = sweep(nodes);
    view.p.traction        = const_cast<Vec<D>*>(forces_.force().data());
    view.p.traction_moment = const_cast<Mat<D>*>(loads_alone ? forces_.load_moment().data() : forces_.moment().data());
    scatter(passes_.surface_force, view);
}

template <int D>
void StepEquations<D>::set_mean_forces(Lanes* nodes, bool loads_alone)
{
    set_forces(nodes, loads_alone);
    if (!is_newmark()) return;
    const Vector& start = loads_alone ? start_load_ : start_nodal_force_;
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) {
        double& force = nodes[node][NodeLane::increment + a];
        force         = end_part_ * force + (1 - end_part_) * start[k];
    });
}

template <int D>
double StepEquations<D>::impulse_of_condition(std::size_t k, double residual, double momentum) const
{
    if (is_static(method())) return -dt_ * residual;
    const double start   = is_newmark() ? (1 - end_part_) * start_force_[k] : 0.0;
    const double carried = -method().pic_fraction * mass_[k / D] * stopped_[k];
    return momentum + carried - dt_ * (end_part_ * end_force_[k] + start + late_contact(k));
}

/// What the contact force gives velocities beyond its part in the displacements, N; nothing with beta = gamma/2.
template <int D>
double StepEquations<D>::late_contact(std::size_t k) const
{
    if (!is_newmark() || contact_force_.empty()) return 0.0;
    return (1 - 0.5 * method().newmark_gamma / newmark_beta_of(method())) * contact_force_[k];
}

template <int D>
std::vector<Vec<D, bool>> StepEquations<D>::held_axes() const
{
    std::vector<Vec<D, bool>> r(mass_.size() + 1, Vec<D, bool>{});
    for (std::size_t k = 0; k < size(); ++k)
        if (held_[k]) r[k / D + 1][static_cast<int>(k % D)] = true;
    obstacles_->for_each_row([&](int row, const Mat<D>& stiffness) {
        for (int a = 0; a < D; ++a) r[row][a] = r[row][a] || stiffness(a, a) != 0.0;
    });
    return r;
}

template <int D>
void StepEquations<D>::multiply(std::span<const double> x, std::span<double> y)
{
    sample(x, moved_, f_);
    forces_.differentiate(f_.data(), d_force_.data(), d_moment_.data());
    Sweep<D> view          = sweep(nodes_.data());
    view.p.traction        = d_force_.data();
    view.p.traction_moment = d_moment_.data();
    scatter(passes_.surface_force, view);
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) { y[k] = nodes_[node][NodeLane::increment + a]; });
    subtract_inertia(x, y, inertia_);
    penalty_.subtract_product(x.data(), y.data());
    obstacles_->add_product(contact_factor_, x, y);
    for (double& one : y) one = -one;
}

template <int D>
bool StepEquations<D>::is_symmetric() const
{
    return !is_middle_ && model_.tractions.empty() && model_.obstacles.empty() && forces_.has_symmetric_tangents();
}

template <int D>
void StepEquations<D>::add_mass()
{
    if (inertia_ == 0.0) return;
    const bool is_consistent = method().mass == MassMatrix::consistent;
    const MassSystem<D>& m   = s_.field.mass;
    std::vector<unsigned char> is_coupled(mass_.size(), 0);
    for (int row = 0; row < rows_.count(); ++row) {
        double own = mass_[row];
        if (is_consistent) {
            const int there = m.rows.row(rows_.node(row + 1));
            is_coupled[row] = m.parts().is_coupled(there);
            if (is_coupled[row]) own = m.diagonal[there];
        }
        block_rows_.at(row, row) += inertia_ * own * Mat<D>::identity();
    }
    if (is_consistent) tangent_matrix_->add_mass(inertia_, is_coupled, block_rows_);
}

template <int D>
SparseRows<Mat<D>> StepEquations<D>::matrix()
{
    block_rows_.clear(mass_.size());
    if (!tangent_matrix_) tangent_matrix_.emplace(sweep(nullptr), passes_, rows_, method().averaging != Averaging::none);
    tangent_matrix_->add_stiffness(forces_, block_rows_);
    add_mass();
    penalty_.for_each_entry([&](int row, int column, const Vec<D>& value) {
        for (int a = 0; a < D; ++a) block_rows_.at(row - 1, column - 1)(a, a) += value[a];
    });
    obstacles_->for_each_entry(
        [&](int row, int column, const Mat<D>& block) { block_rows_.at(row - 1, column - 1) += contact_factor_ * block; });
    return block_rows_.matrix();
}

template <int D>
std::vector<Index<D>> StepEquations<D>::places() const
{
    std::vector<Index<D>> r;
    for (int row = 1; row < rows_.end(); ++row) {
        Index<D> at = s_.lattice.index(rows_.node(row));
        for (int a = 0; a < D; ++a)
            if (s_.lattice.periodic[a]) at[a] -= s_.lattice.margin;
        r.push_back(at);
    }
    return r;
}

template <int D>
void StepEquations<D>::set_velocities(std::span<const double> u, Lanes* nodes) const
{
    const double gamma = method().newmark_gamma, beta = newmark_beta_of(method());
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) {
        double after = 0.0;  // of a load step
        if (!is_static(method()) && held_[k])
            after = known_velocity_[k];
        else if (is_middle_)
            after = 2 * u[k] / dt_ - velocity_[k];
        else if (is_newmark())
            after = velocity_[k] + gamma / (beta * dt_) * (u[k] - start_[k]) +
                    dt_ / mass_[k / D] * ((1 - gamma / (2 * beta)) * start_force_[k] + late_contact(k));
        nodes[node][NodeLane::velocity + a]  = after;
        nodes[node][NodeLane::increment + a] = after - velocity_[k];
    });
    s_.field.halo.copy(nodes);
}

template <int D>
void StepEquations<D>::set_mean_velocities(std::span<const double> u, Lanes* nodes) const
{
    for_each_unknown([&](std::size_t k, std::ptrdiff_t node, int a) {
        nodes[node][NodeLane::velocity + a]  = u[k] / dt_;
        nodes[node][NodeLane::increment + a] = 0.0;
    });
    s_.field.halo.copy(nodes);
}

template class StepEquations<1>;
template class StepEquations<2>;
template class StepEquations<3>;

}  // namespace ordo
