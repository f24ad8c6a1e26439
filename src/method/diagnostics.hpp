// Sums over all particles: mass, momentum, energies. The same for any number of threads.
#pragma once

#include "method/state.hpp"

namespace ordo {

/// Kinetic energy is that of the particle velocities (at t - dt/2), strain energy that of the stresses at t.
struct Totals {
    double mass           = 0.0;  ///< kg
    Vec<3> momentum       = {};   ///< kg m/s
    double kinetic_energy = 0.0;  ///< J
    double strain_energy  = 0.0;  ///< J
    double potential      = 0.0;  ///< of gravity, -m g . x, J

    double total_energy() const { return kinetic_energy + strain_energy; }
};

template <int D>
Totals totals(const Model<D>& model, const Particles<D>& p)
{
    return parallel_reduce(
        p.count, Totals{},
        [&](std::ptrdiff_t i) {
            return Totals{.mass           = p.m[i],
                          .momentum       = padded(p.m[i] * p.v[i]),
                          .kinetic_energy = 0.5 * p.m[i] * dot(p.v[i], p.v[i]),
                          .strain_energy  = strain_energy(model.materials[p.material[i]], p.F[i], p.sigma[i], p.V0[i], p.V[i]),
                          .potential      = -p.m[i] * dot(model.gravity, p.x[i])};
        },
        [](Totals& total, const Totals& one) {
            total.mass += one.mass;
            total.momentum += one.momentum;
            total.kinetic_energy += one.kinetic_energy;
            total.strain_energy += one.strain_energy;
            total.potential += one.potential;
        });
}

}  // namespace ordo
