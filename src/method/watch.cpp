#include "method/watch.hpp"

#include "base/agree.hpp"
#include "base/parallel.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/place.hpp"
#include "method/sums.hpp"
#include "method/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

constexpr long interval = 4;  // steps between looks at each particle, which cost some percent of a step

}  // namespace

template <int D>
void Watch<D>::start(const State<D>& s)
{
    const Totals e = totals(model_, s);
    energies_      = {e.total_energy(), e.potential};
    find_least(s);
}

template <int D>
void Watch<D>::resume(const std::vector<double>& energies, const State<D>& s)
{
    if (energies.size() != energies_.size()) throw InputError("the checkpoint lacks the energies of the watch");
    std::copy(energies.begin(), energies.end(), energies_.begin());
    find_least(s);
}

/// The energy of a strain of 1e-6 in all bodies.
template <int D>
void Watch<D>::find_least(const State<D>& s)
{
    const Particles<D>& p = s.particles;
    auto energy           = [&](int i) { return Numbers<1>{{p.V0[i] * model_.materials[p.material[i]].p_wave_modulus()}}; };
    least_                = 1e-12 * sum_over_particles<1>(s, energy)[0];
}

template <int D>
void Watch<D>::before_step(const State<D>& s, double dt)
{
    // For most steps the largest motion of the last step shows that the limit is far, without looking at each particle.
    const auto [h_min, h_max] = std::minmax_element(model_.h.c, model_.h.c + D);
    double c                  = 0.0;
    bool is_known =
        s.particles.enriched.empty() && !has_artificial_viscosity(model_.method) && !has_limit_of_strain(model_.method);
    for (const Material& m : model_.materials) {
        c        = std::max(c, m.wave_speed());
        is_known = is_known && !changes_stiffness<D>(m);
    }
    const double moved   = s.dt_prev > 0 ? s.move * dt / s.dt_prev : 1.0;
    const double courant = c * dt / *h_min + std::sqrt(D) * moved * *h_max / *h_min;
    if (is_known && courant < 0.9 * stable_courant_number(model_)) return;

    const double limit = stable_time_step(model_, s.particles, *s.ranks);
    if (dt <= limit * (1 + 1e-9)) return;
    find(WatchSpec::time_step,
         fmt::format("step {}, t = {:.6g} s: the time step {:.4g} s is above the limit {:.4g} s = {:.3g} {}; {}; use a "
                     "smaller time.dt, or time.cfl",
                     s.n + 1, s.t, dt, limit, stable_courant_number(model_), unit_of_limit(model_.method), fastest_particle(s)));
}

template <int D>
void Watch<D>::after_step(const State<D>& s)
{
    const ProjectionReport& p = s.projection;
    if (spec_.is_fatal[WatchSpec::dropped_pivots] && p.fit.dropped > 0)
        find(WatchSpec::dropped_pivots,
             fmt::format("step {}, t = {:.6g} s: {} pivots of fits were dropped, first near {}: too few samples for the degree; "
                         "use more particles per cell, a wider method.weight or a lower method.degree",
                         s.n, s.t, p.fit.dropped, place_text(p.dropped_at.c, D)));
    look_for_growth(s);
    look_for_gaps(s);
}

template <int D>
void Watch<D>::look_for_growth(const State<D>& s)
{
    if (s.n % interval != 0) return;
    const Totals e = totals(model_, s);
    // Artificial viscosity that has given energy is a gain, not an exchange.
    const std::array exchanged{e.potential - energies_[1], e.dissipated + std::max(0.0, e.artificial),
                               s.account.boundary_work(),  s.account.traction_work(),
                               s.account.body_force_work,  s.account.damped,
                               s.account.staged,           s.contacts.work() + s.account.nodes_work};
    double growth = e.total_energy() - energies_[0], all = energies_[0];
    for (std::size_t k = 0; k < exchanged.size(); ++k) {
        growth += exchanged[k];
        energies_[k + 2] = std::max(energies_[k + 2], std::fabs(exchanged[k]));
        all += energies_[k + 2];
    }
    if (!(all > 0) || !(growth > spec_.energy_growth * all + least_)) return;
    find(WatchSpec::energy,
         fmt::format(
             "step {}, t = {:.6g} s: the method has added {:.4g} J, more than {:.3g} (watch.energy_growth) of the {:.4g} J "
             "that were there or came from gravity, boundaries, tractions, body forces, contacts and new stages; {}; {}",
             s.n, s.t, growth, spec_.energy_growth, all, fastest_particle(s), remedy_for_growth()));
}

/// What to choose instead, other than what is chosen.
template <int D>
std::string Watch<D>::remedy_for_growth() const
{
    const MethodSpec& m = model_.method;
    const bool gains    = (fits_velocity(m) && m.limiter == Limiter::none) || m.projection == Projection::tls;
    if (gains || m.quadrature != Quadrature::particle)
        return "least squares and fits in cells gain energy in impacts and at free surfaces: use cpls-limited or cpdi1 there "
               "(docs/which-method.md), or a smaller time step";
    if (m.limiter == Limiter::slope)
        return "fits gain energy where bodies meet, little with a limiter: use cpdi1, or [[contact]], which gives bodies fields "
               "of their own";
    std::string more;
    if (!domains_deform(m)) more += fmt::format(" or a {}", kDeformingMethods);
    if (!strains_by_advanced(m)) more += updates_stress_last(m) ? " or strain_velocity = 1" : " or scheme = \"usl\"";
    return "a smaller time step" + more + " may help; a jump in the motion of a boundary or in a force does it too";
}

/// Points whose distance along the largest stretch has grown to a cell no longer share nodes: the body tears there.
template <int D>
void Watch<D>::look_for_gaps(const State<D>& s)
{
    if (model_.method.domain != Domain::point || s.n % interval != 0) return;
    const Particles<D>& p = s.particles;
    const double h        = *std::min_element(model_.h.c, model_.h.c + D);
    auto distance         = [&](std::ptrdiff_t i) {
        double stretch = 0.0;
        for (int a = 0; a < D; ++a) {
            double square = 0.0;
            for (int b = 0; b < D; ++b) square += p.F[i](b, a) * p.F[i](b, a);
            stretch = std::max(stretch, square);
        }
        return std::sqrt(stretch) * std::pow(p.V0[i], 1.0 / D);
    };
    const double largest = ordo::largest(
        *s.ranks, parallel_reduce(p.count, 0.0, distance, [](double& total, double one) { total = std::max(total, one); }));
    if (largest <= h) return;
    int i = 0;
    while (i < p.count && distance(i) < largest) ++i;
    find(WatchSpec::gaps, text_of_first(*s.ranks, tile_of_particle(s, i), [&] {
             return fmt::format(
                 "step {}, t = {:.6g} s: stretch has moved the points of body {} near {} {:.3g} cells apart: those "
                 "that share no nodes lose contact, and the body tears there or leaves its boundary (numerical "
                 "fracture); use a method with particle domains that deform, such as cpdi1, or more particles_per_cell",
                 s.n, s.t, p.body[i], place_text(p.x[i]), largest / h);
         }));
}

template <int D>
void Watch<D>::find(WatchSpec::Kind kind, const std::string& message)
{
    if (spec_.is_fatal[kind]) throw NumericalError(message);
    if (found_[kind]++ == 0) warn_(message);
}

template <int D>
std::string Watch<D>::fastest_particle(const State<D>& s) const
{
    const Particles<D>& p = s.particles;
    int fastest           = 0;
    double speed          = -1.0;
    for (int i = 0; i < p.count; ++i) {
        const double v = norm(p.v[i]);
        if (!(v > speed || (v == speed && p.id[i] < p.id[fastest]))) continue;
        fastest = i;
        speed   = v;
    }
    const bool is_here = p.count > 0 && speed == largest(*s.ranks, speed);
    return text_of_first(*s.ranks, is_here ? p.id[fastest] : kNowhere, [&] {
        return fmt::format("the fastest particle is {} of body {} at {}, {:.4g} m/s", p.id[fastest], p.body[fastest],
                           place_text(p.x[fastest]), speed);
    });
}

template class Watch<1>;
template class Watch<2>;
template class Watch<3>;

}  // namespace ordo
