#include "method/energy_account.hpp"

#include "method/diagnostics.hpp"

namespace ordo {

template <int D>
EnergyParts energy_parts(const Model<D>& model, const Particles<D>& p)
{
    const Totals e = totals(model, p);
    return {e.kinetic_energy, e.strain_energy + e.dissipated + e.artificial, e.potential};
}

template <int D>
void start_account(const Model<D>& model, State<D>& s)
{
    s.account.is_wanted = true;
    s.account.start     = energy_parts(model, s.particles);
}

template <int D>
SchemeEnergy scheme_energy(const Model<D>& model, const State<D>& s)
{
    const Account& a       = s.account;
    const EnergyParts gain = energy_parts(model, s.particles) - a.start;
    const NodalWork& w     = a.nodes;
    SchemeEnergy r;
    r.stress_update = -w.stresses - gain.stored;
    r.projection    = w.all() - a.filtered - a.damped - gain.kinetic;
    r.filter        = a.filtered;
    r.half_step     = -gain.potential - w.gravity - (a.traction_work() + a.body_force_work) - w.loads -
                  (a.boundary_work() + s.contacts.work()) - w.constraints;
    return r;
}

#define ORDO_ENERGY_ACCOUNT(D)                                               \
    template EnergyParts energy_parts(const Model<D>&, const Particles<D>&); \
    template void start_account(const Model<D>&, State<D>&);                 \
    template SchemeEnergy scheme_energy(const Model<D>&, const State<D>&);
ORDO_ENERGY_ACCOUNT(1)
ORDO_ENERGY_ACCOUNT(2)
ORDO_ENERGY_ACCOUNT(3)
#undef ORDO_ENERGY_ACCOUNT

}  // namespace ordo
