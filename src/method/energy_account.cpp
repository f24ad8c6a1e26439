#include "method/energy_account.hpp"

namespace ordo {

template <int D>
void start_account(const Model<D>& model, State<D>& s)
{
    s.account.is_wanted = true;
    s.account.start     = energy_parts(totals(model, s));
}

template <int D>
SchemeEnergy scheme_energy(const Totals& now, const State<D>& s)
{
    const Account& a       = s.account;
    const EnergyParts gain = energy_parts(now) - a.start;
    const NodalWork& w     = a.nodes;
    SchemeEnergy r;
    r.stress_update = -w.stresses - gain.stored;
    r.projection    = w.all() - a.filtered - a.damped - gain.kinetic;
    r.filter        = a.filtered;
    r.half_step     = -gain.potential - a.work() - s.contacts.work() - w.gravity - w.loads - w.constraints;
    return r;
}

#define ORDO_ENERGY_ACCOUNT(D)                               \
    template void start_account(const Model<D>&, State<D>&); \
    template SchemeEnergy scheme_energy(const Totals&, const State<D>&);
ORDO_ENERGY_ACCOUNT(1)
ORDO_ENERGY_ACCOUNT(2)
ORDO_ENERGY_ACCOUNT(3)
#undef ORDO_ENERGY_ACCOUNT

}  // namespace ordo
