#include "setup/time_step.hpp"

#include "method/courant.hpp"

#include <fmt/format.h>

namespace ordo::setup {

template <int D>
double time_step(const TimeSpec& time, const Model<D>& model, const Particles<D>& particles, Ranks& ranks)
{
    return time.dt ? *time.dt : automatic_time_step(model, particles, time.cfl, ranks);
}

template <int D>
void require_stable(const TimeSpec& time, const Model<D>& model, const Particles<D>& particles, Ranks& ranks)
{
    auto fail = [](const char* key, const std::string& why) { throw SetupError(Part::time, 0, key, why); };
    if (!(time.end > 0)) fail("end", fmt::format("must be positive (got {})", time.end));
    if (time.dt && !(*time.dt > 0)) fail("dt", fmt::format("must be positive (got {})", *time.dt));
    if (!time.dt && is_static(model.method))
        fail("dt", "is missing: with scheme static time is only the load, so nothing else tells the size of its steps");
    if (!time.dt && !(time.cfl > 0 && (time.cfl <= 1 || is_implicit(model.method))))
        fail("cfl", fmt::format("must be positive{} (got {})", is_implicit(model.method) ? "" : " and at most 1", time.cfl));
    const double limit = stable_time_step(model, particles, ranks);
    if (time.dt && *time.dt > limit)
        fail("dt", fmt::format(
                       "{} s is above the limit {:.4g} s = {:.3g} {} (c is the P-wave speed, v that of particles); use a smaller "
                       "step, or cfl = 0.4",
                       *time.dt, limit, stable_courant_number(model), unit_of_limit(model.method)));
    const double steps = time.end / time_step(time, model, particles, ranks);
    if (!(steps <= 1e12)) fail("end", fmt::format("takes about {:.1g} time steps; use a larger step or a shorter time", steps));
}

template double time_step(const TimeSpec&, const Model<1>&, const Particles<1>&, Ranks&);
template double time_step(const TimeSpec&, const Model<2>&, const Particles<2>&, Ranks&);
template double time_step(const TimeSpec&, const Model<3>&, const Particles<3>&, Ranks&);
template void require_stable(const TimeSpec&, const Model<1>&, const Particles<1>&, Ranks&);
template void require_stable(const TimeSpec&, const Model<2>&, const Particles<2>&, Ranks&);
template void require_stable(const TimeSpec&, const Model<3>&, const Particles<3>&, Ranks&);

}  // namespace ordo::setup
