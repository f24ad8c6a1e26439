#include "method/step_damping.hpp"

#include "base/parallel.hpp"
#include "method/diagnostics.hpp"
#include "method/sums.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ordo {

namespace {

/// f(numbers, count) for each field of velocities.
template <int D, class F>
void for_each_velocity(Particles<D>& p, F&& f)
{
    auto visit = [&](auto& field) {
        if (!field.empty())
            f(reinterpret_cast<double*>(field.data()),
              static_cast<std::ptrdiff_t>(field.size() * sizeof(field[0]) / sizeof(double)));
    };
    visit(p.v);
    visit(p.L);
    visit(p.modes);
    visit(p.corner_velocity);
}

/// change(v) for each component of each velocity.
template <int D, class Change>
void change_velocities(Particles<D>& p, const Change& change)
{
    for_each_velocity(p,
                      [&](double* v, std::ptrdiff_t n) { parallel_for_each(n, [&](std::ptrdiff_t k) { v[k] = change(v[k]); }); });
}

/// v <- sgn(v) max(|v| - factor |dv|, 0) with the change dv in the step: a force of size factor m |a| against each component of
/// the velocity (Cundall 1987, in Analytical and computational methods in engineering rock mechanics).
template <int D>
void damp_locally(Particles<D>& p, const std::vector<Array<double>>& before, double factor)
{
    std::size_t field = 0;
    for_each_velocity(p, [&](double* v, std::ptrdiff_t n) {
        const double* was = before[field++].data();
        parallel_for_each(n, [&](std::ptrdiff_t k) {
            v[k] = std::copysign(std::max(std::fabs(v[k]) - factor * std::fabs(v[k] - was[k]), 0.0), v[k]);
        });
    });
}

/// The accelerations of a step over those of gravity and body forces, by roots of mean squares over the mass.
template <int D>
double unbalanced(const Model<D>& model, const State<D>& s, const double* before, double dt)
{
    const Particles<D>& p  = s.particles;
    const Numbers<2> total = sum_over_particles<2>(s, [&](int i) {
        Vec<D> a{}, given = model.gravity;
        for (int c = 0; c < D; ++c) a[c] = (p.v[i][c] - before[i * D + c]) / dt;
        if (!p.b.empty()) given += p.b[i];
        return Numbers<2>{{p.m[i] * dot(a, a), p.m[i] * dot(given, given)}};
    });
    return std::sqrt(total[0] / total[1]);
}

/// The time over which velocities changed in a step: they live at half steps, but for Runge-Kutta stages.
template <int D>
double kick_of(const Model<D>& model, const State<D>& s, double dt)
{
    return has_stages_of_runge_kutta(model.method) || is_implicit(model.method) ? dt : 0.5 * (s.dt_prev + dt);
}

/// The root of kinetic over stored energy.
template <int D>
double moving(const Model<D>& model, const State<D>& s)
{
    const Totals e = totals(model, s);
    return e.kinetic_energy > 0 ? std::sqrt(e.kinetic_energy / std::max(e.strain_energy, 0.0)) : 0.0;
}

}  // namespace

template <int D>
StepDamping<D>::StepDamping(const Model<D>& model, State<D>& s) : model_(model)
{
    if (model.damping.type != DampingType::local && !(model.residual > 0)) return;
    for_each_velocity(s.particles, [&](const double* v, std::ptrdiff_t n) {
        Array<double>& copy = before_.emplace_back(static_cast<std::size_t>(n), Pages::own);
        parallel_for_each(n, [&](std::ptrdiff_t k) { copy[k] = v[k]; });
    });
}

template <int D>
void StepDamping<D>::apply(State<D>& s, double dt) const
{
    if (model_.residual > 0) s.residual = unbalanced(model_, s, before_.front().data(), kick_of(model_, s, dt));
    damp(s, dt);
    if (model_.residual > 0 && s.residual <= model_.residual) s.residual = std::max(s.residual, moving(model_, s));
}

template <int D>
void StepDamping<D>::damp(State<D>& s, double dt) const
{
    const Damping& damping = model_.damping;
    if (damping.type == DampingType::none) return;
    Particles<D>& p   = s.particles;
    const double now  = kinetic_energy(s, p.v.data());
    const double peak = std::exchange(s.kinetic_energy, now);
    switch (damping.type) {
    case DampingType::none: return;
    case DampingType::local: damp_locally(p, before_, damping.factor); break;
    case DampingType::viscous: change_velocities(p, [kept = std::exp(-damping.rate * dt)](double v) { return kept * v; }); break;
    case DampingType::kinetic:
        if (!(now < peak)) return;
        change_velocities(p, [](double) { return 0.0; });
        break;
    }
    s.kinetic_energy = kinetic_energy(s, p.v.data());
    s.account.damped += now - s.kinetic_energy;
}

template class StepDamping<1>;
template class StepDamping<2>;
template class StepDamping<3>;

}  // namespace ordo
