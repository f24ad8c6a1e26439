#include "io/history.hpp"

#include "base/error.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace ordo::io {

template <int D>
History<D>::History(const CaseInput& input, const Model<D>& model)
    : model_(model), exchanging_(exchanging(input)), has_stages_(!input.stages.empty())
{
    auto add_vector = [&](const std::string& stem) {
        for (const char axis : {'x', 'y', 'z'}) columns_.push_back(fmt::format("{}_{}", stem, axis));
    };
    auto add_contact = [&](const std::string& name) {
        add_vector(name + "_force");
        add_vector(name + "_moment");
        columns_.insert(columns_.end(), {name + "_friction_work", name + "_dissipation"});
    };
    columns_ = {"time", "dt", "mass"};
    add_vector("momentum");
    columns_.insert(columns_.end(), {"kinetic_energy", "strain_energy", "total_energy", "potential_energy", "dissipated_energy",
                                     "projection_mass_before", "projection_mass_after"});
    for (const char* when : {"before", "after"})
        for (const char axis : {'x', 'y', 'z'}) columns_.push_back(fmt::format("projection_momentum_{}_{}", axis, when));
    columns_.insert(columns_.end(),
                    {"dropped_pivots", "fallback_nodes", "boundary_work", "traction_work", "body_force_work",
                     "artificial_viscosity_work", "damped_energy", "nodal_kinetic_energy", "unresolved_kinetic_energy",
                     "stress_update_energy", "projection_energy", "filter_energy", "half_step_energy"});
    if (has_stages_) columns_.insert(columns_.end(), {"stage", "stage_energy"});
    if (is_implicit(model.method))
        columns_.insert(columns_.end(), {"newton_iterations", "linear_iterations", "step_halvings", "newton_residual"});
    for (const Exchanging& one : exchanging_) {
        add_vector(one.name + "_force");
        columns_.push_back(one.name + "_work");
    }
    for (const ContactPair<D>& c : model.contacts)
        if (c.obstacle < 0) add_contact(c.name);
    for (const Obstacle<D>& o : model.obstacles) {
        add_contact(o.name);
        columns_.push_back(o.name + "_work");
        add_vector(o.name);
        add_vector(o.name + "_velocity");
        add_vector(o.name + "_rotation");
    }
    std::vector<std::string> sorted = columns_;
    std::sort(sorted.begin(), sorted.end());
    if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
        throw InputError(
            fmt::format("history.csv would have two columns {}; rename the boundary, traction, contact, obstacle or body "
                        "that one of them is called after",
                        *twice));
}

template <int D>
std::vector<double> History<D>::row(const State<D>& s) const
{
    const Totals e            = totals(model_, s);
    const ProjectionReport& p = s.projection;
    const Account& a          = s.account;
    const SchemeEnergy scheme = scheme_energy(e, s);
    std::vector<double> r;
    auto add        = [&](std::initializer_list<double> numbers) { r.insert(r.end(), numbers); };
    auto add_vector = [&](const auto& v) { add({v[0], v[1], v[2]}); };
    add({s.t, s.dt_prev, e.mass});
    add_vector(e.momentum);
    add({e.kinetic_energy, e.strain_energy, e.total_energy(), e.potential, e.dissipated, p.mass_before, p.mass_after});
    add_vector(p.momentum_before);
    add_vector(p.momentum_after);
    add({static_cast<double>(p.fit.dropped), static_cast<double>(p.fit.fallback), a.boundary_work(), a.traction_work(),
         a.body_force_work, e.artificial, a.damped, a.nodal_kinetic, e.kinetic_energy - a.nodal_kinetic, scheme.stress_update,
         scheme.projection, scheme.filter, scheme.half_step});
    if (has_stages_) add({static_cast<double>(s.stage), a.staged});
    if (s.newton.is_wanted) add({s.newton.iterations, s.newton.linear_iterations, s.newton.halvings, s.newton.residual});
    for (const Exchanging& one : exchanging_) {
        const Exchange& x = (one.is_traction ? a.tractions : a.boundaries)[static_cast<std::size_t>(one.number)];
        add_vector(x.force);
        add({x.work});
    }
    auto add_contact = [&](const ContactExchange& x) {
        add_vector(x.force);
        add_vector(x.moment);
        add({x.friction, x.dissipated});
    };
    for (const ContactExchange& x : s.contacts.pairs) add_contact(x);
    for (const ObstacleMotion<D>& o : s.contacts.obstacles) {
        add_contact(o.exchange);
        add({o.work});
        add_vector(padded(o.center));
        add_vector(padded(o.velocity));
        add_vector(o.spin);
    }
    return r;
}

template class History<1>;
template class History<2>;
template class History<3>;

}  // namespace ordo::io
