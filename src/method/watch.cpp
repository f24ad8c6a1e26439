#include "method/watch.hpp"

#include "base/parallel.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

template <int D>
void Watch<D>::start(const State<D>& s)
{
    const Totals e = totals(model_, s.particles);
    energies_      = {e.total_energy(), e.potential, 0.0};
    require_energy();
}

template <int D>
void Watch<D>::resume(const std::vector<double>& energies)
{
    if (energies.size() != energies_.size()) throw InputError("the checkpoint lacks the energies of the watch");
    std::copy(energies.begin(), energies.end(), energies_.begin());
    require_energy();
}

template <int D>
void Watch<D>::require_energy() const
{
    bool is_heavy = false;
    for (int a = 0; a < D; ++a) is_heavy = is_heavy || model_.gravity[a] != 0.0;
    if (spec_.energy_growth && !(energies_[0] > 0) && !is_heavy)
        throw InputError(
            "watch.energy_growth: the bodies were at rest at the start, so there is no energy to compare with; remove it");
}

template <int D>
void Watch<D>::before_step(const State<D>& s, double dt)
{
    // For most steps the largest motion of the last step shows that the limit is far, without looking at each particle.
    const auto [h_min, h_max] = std::minmax_element(model_.h.c, model_.h.c + D);
    double c                  = 0.0;
    bool is_known             = s.particles.enriched.empty();
    for (const Material& m : model_.materials) {
        c        = std::max(c, m.wave_speed());
        is_known = is_known && !m.law->in<D>().stiffness;
    }
    const double moved   = s.dt_prev > 0 ? s.move * dt / s.dt_prev : 1.0;
    const double courant = c * dt / *h_min + std::sqrt(D) * moved * *h_max / *h_min;
    if (is_known && courant < 0.9 * stable_courant_number(model_)) return;

    const double limit = stable_time_step(model_, s.particles);
    if (dt <= limit * (1 + 1e-9)) return;
    find(WatchSpec::time_step,
         fmt::format(
             "step {}, t = {:.6g} s: the time step {:.4g} s is above the limit {:.4g} s = {:.3g} h/(c + |v|) of the method; {}; "
             "use a smaller time.dt, or time.cfl",
             s.n + 1, s.t, dt, limit, stable_courant_number(model_), fastest_particle(s)));
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
    look_for_gaps(s);
    if (!spec_.energy_growth) return;
    const Totals e                          = totals(model_, s.particles);
    auto& [at_start, potential, of_gravity] = energies_;
    of_gravity                              = std::max(of_gravity, std::fabs(e.potential - potential));
    const double growth                     = e.total_energy() - at_start + e.potential - potential;
    if (growth <= *spec_.energy_growth * (at_start + of_gravity)) return;
    find(WatchSpec::energy,
         fmt::format(
             "step {}, t = {:.6g} s: energy has grown by {:.4g} J, more than {:.3g} (watch.energy_growth) of the initial {:.4g} "
             "J; {}; a smaller time step, scheme = \"musl\" or a method with particle domains (cpdi1) may help, or a larger "
             "limit if boundaries, tractions or body forces do work",
             s.n, s.t, growth, *spec_.energy_growth, at_start + of_gravity, fastest_particle(s)));
}

/// Points whose distance along the largest stretch has grown to a cell no longer share nodes: the body tears there.
template <int D>
void Watch<D>::look_for_gaps(const State<D>& s)
{
    constexpr long interval = 4;  // steps; looking at each particle costs some percent of a step
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
    const double largest =
        parallel_reduce(p.count, 0.0, distance, [](double& total, double one) { total = std::max(total, one); });
    if (largest <= h) return;
    int i = 0;
    while (distance(i) < largest) ++i;
    find(WatchSpec::gaps,
         fmt::format(
             "step {}, t = {:.6g} s: stretch has moved the particles of body {} near {} {:.3g} cells apart: points that share "
             "no nodes lose contact, and the body tears there or leaves its boundary (numerical fracture); use a method with "
             "particle domains, such as cpdi1, or more particles_per_cell",
             s.n, s.t, p.body[i], place_text(p.x[i]), largest / h));
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
    for (int i = 1; i < p.count; ++i) {
        const double v = norm(p.v[i]), w = norm(p.v[fastest]);
        if (v > w || (v == w && p.id[i] < p.id[fastest])) fastest = i;
    }
    return fmt::format("the fastest particle is {} of body {} at {}, {:.4g} m/s", p.id[fastest], p.body[fastest],
                       place_text(p.x[fastest]), norm(p.v[fastest]));
}

template class Watch<1>;
template class Watch<2>;
template class Watch<3>;

}  // namespace ordo
