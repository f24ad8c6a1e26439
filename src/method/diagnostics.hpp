// Sums over all particles: mass, momentum, energies. Compiled in one place, so that their last digits are the same for all callers.
#pragma once

#include "method/state.hpp"
#include "particles/batch.hpp"

namespace ordo {

/// Kinetic energy is from the particle velocities (at t - dt/2), strain energy from the stresses at t.
struct Totals {
    double mass           = 0.0;  ///< kg
    Vec<3> momentum       = {};   ///< kg m/s
    double kinetic_energy = 0.0;  ///< J
    double strain_energy  = 0.0;  ///< J
    double potential      = 0.0;  ///< of gravity, -m g . x, J; on periodic axes x includes full periods
    double dissipated     = 0.0;  ///< by the material laws since the start, J
    double artificial     = 0.0;  ///< the same by artificial viscosity, J

    double total_energy() const { return kinetic_energy + strain_energy; }
};

/// Stored energies of particles, J.
template <int D>
class StoredEnergy {
  public:
    StoredEnergy(const std::vector<Material>& materials, const Particles<D>& p) : materials_(materials), p_(p)
    {
        for (const Material& m : materials) {
            std::vector<const double*>& columns = columns_.emplace_back();
            for (const HistoryColumn& c : history_of(m, D)) columns.push_back(p.history[p.history_column(c.name)].data());
        }
    }

    double operator()(int i) const
    {
        const Material& m = materials_[p_.material[i]];
        double history[most_columns];
        int k = 0;
        for (const double* column : columns_[p_.material[i]]) history[k++] = column[i];
        return stored_energy(m, p_.F[i], p_.sigma[i], p_.V0[i], p_.V[i], history);
    }
    /// The same for a batch; spare lanes repeat the last particle.
    Lanes operator()(const Batch& b) const
    {
        if (!are_alike(p_.material.data(), b)) return each_particle(b, [&](int i) { return (*this)(i); });
        const Material& m = materials_[p_.material[b.first]];
        Lanes history[most_columns];
        int k = 0;
        for (const double* column : columns_[p_.material[b.first]]) history[k++] = load(column, b);
        return stored_energy(m, load(p_.F.data(), b), load(p_.sigma.data(), b), load(p_.V0.data(), b), load(p_.V.data(), b),
                             history);
    }

  private:
    static constexpr int most_columns = Material::most_history;

    const std::vector<Material>& materials_;
    const Particles<D>& p_;
    std::vector<std::vector<const double*>> columns_;  ///< [material]
};

/// Mass and momentum of all particles.
template <int D>
MassAndMomentum mass_and_momentum(const State<D>& s);

/// Of particles with the velocities v, J.
template <int D>
double kinetic_energy(const State<D>& s, const Vec<D>* v);

template <int D>
Totals totals(const Model<D>& model, const State<D>& s);

/// The sums of one body.
struct BodyTotals {
    double mass           = 0.0;  ///< kg
    Vec<3> center         = {};   ///< of mass, m; on periodic axes full periods count
    Vec<3> momentum       = {};   ///< kg m/s
    Vec<3> spin           = {};   ///< angular momentum about the origin, sum m x cross v, kg m^2/s
    double kinetic_energy = 0.0;  ///< J
    double strain_energy  = 0.0;  ///< J
    double potential      = 0.0;  ///< of gravity, J
};

template <int D>
BodyTotals totals_of_body(const Model<D>& model, const State<D>& s, int body);

}  // namespace ordo
