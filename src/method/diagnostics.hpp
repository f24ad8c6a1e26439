// Sums over all particles: mass, momentum, energies. They do not depend on the number of threads.
#pragma once

#include "kernels/scatter.hpp"
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

/// Mass and momentum of all particles, in the lanes of a node.
template <int D>
Lanes mass_and_momentum(const ParticleView<D>& p)
{
    return parallel_reduce(
        p.count, Lanes(0.0), [&](std::ptrdiff_t i) { return mass_momentum(p.m[i], p.v[i], 0.0); },
        [](Lanes& total, const Lanes& one) { total += one; });
}

/// Of particles with the velocities v, J.
template <int D>
double kinetic_energy(const Particles<D>& p, const Vec<D>* v)
{
    return parallel_reduce(
        p.count, 0.0, [&](std::ptrdiff_t i) { return 0.5 * p.m[i] * dot(v[i], v[i]); },
        [](double& total, double one) { total += one; });
}

template <int D>
Totals totals(const Model<D>& model, const Particles<D>& p)
{
    struct Sums {  // lane k: sums over every eighth particle
        Lanes mass{}, kinetic_energy{}, strain_energy{}, potential{}, dissipated{}, artificial{};
        Vec<D, Lanes> momentum{};

        void operator+=(const Sums& o)
        {
            mass += o.mass;
            kinetic_energy += o.kinetic_energy;
            strain_energy += o.strain_energy;
            potential += o.potential;
            dissipated += o.dissipated;
            artificial += o.artificial;
            momentum += o.momentum;
        }
    };
    const int column         = p.history_column("dissipated");
    const double* dissipated = column < 0 ? nullptr : p.history[column].data();
    const StoredEnergy<D> energy(model.materials, p);
    auto way = [&](const Batch& b) {
        Vec<D, Lanes> x = load(p.x.data(), b);
        for (int a = 0; a < D; ++a)
            if (model.periodic[a] && model.gravity[a] != 0.0)
                x[a] += model.cells[a] * model.h[a] * each_particle(b, [&](int i) { return p.turns[i][a]; });
        return x;
    };
    Vec<D, Lanes> gravity;
    for (int a = 0; a < D; ++a) gravity[a] = Lanes(model.gravity[a]);
    const Sums sums = parallel_reduce((p.count + Batch::size - 1) / Batch::size, Sums{},
                                      [&](std::ptrdiff_t k) {
                                          const Batch b         = Batch::of(static_cast<int>(k) * Batch::size, p.count);
                                          const Vec<D, Lanes> v = load(p.v.data(), b);
                                          Sums r;
                                          r.mass = load(p.m.data(), b);
                                          for (int lane = b.count; lane < Batch::size; ++lane) r.mass[lane] = 0.0;
                                          r.momentum       = r.mass * v;
                                          r.kinetic_energy = 0.5 * r.mass * dot(v, v);
                                          r.potential      = -r.mass * dot(gravity, way(b));
                                          r.strain_energy  = energy(b);
                                          if (dissipated) r.dissipated = load(p.V0.data(), b) * load(dissipated, b);
                                          if (!p.q_work.empty()) r.artificial = load(p.V0.data(), b) * load(p.q_work.data(), b);
                                          for (int lane = b.count; lane < Batch::size; ++lane)
                                              r.strain_energy[lane] = r.dissipated[lane] = r.artificial[lane] = 0.0;
                                          return r;
                                      },
                                      [](Sums& total, const Sums& one) { total += one; });
    Totals r{.mass           = sum(sums.mass),
             .kinetic_energy = sum(sums.kinetic_energy),
             .strain_energy  = sum(sums.strain_energy),
             .potential      = sum(sums.potential),
             .dissipated     = sum(sums.dissipated),
             .artificial     = sum(sums.artificial)};
    for (int a = 0; a < D; ++a) r.momentum[a] = sum(sums.momentum[a]);
    return r;
}

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
BodyTotals totals_of_body(const Model<D>& model, const Particles<D>& p, int body)
{
    const StoredEnergy<D> energy(model.materials, p);
    BodyTotals r = parallel_reduce(
        p.count, BodyTotals{},
        [&](std::ptrdiff_t k) {
            const int i = static_cast<int>(k);
            BodyTotals one;
            if (p.body[i] != body) return one;
            Vec<D> x = p.x[i];
            for (int a = 0; a < D; ++a)
                if (model.periodic[a]) x[a] += p.turns[i][a] * model.cells[a] * model.h[a];
            const Vec<3> at = padded(x), mv = p.m[i] * padded(p.v[i]);
            one.mass           = p.m[i];
            one.center         = p.m[i] * at;
            one.momentum       = mv;
            one.spin           = {at[1] * mv[2] - at[2] * mv[1], at[2] * mv[0] - at[0] * mv[2], at[0] * mv[1] - at[1] * mv[0]};
            one.kinetic_energy = 0.5 * p.m[i] * dot(p.v[i], p.v[i]);
            one.strain_energy  = energy(i);
            one.potential      = -p.m[i] * dot(model.gravity, x);
            return one;
        },
        [](BodyTotals& total, const BodyTotals& one) {
            total.mass += one.mass;
            total.center += one.center;
            total.momentum += one.momentum;
            total.spin += one.spin;
            total.kinetic_energy += one.kinetic_energy;
            total.strain_energy += one.strain_energy;
            total.potential += one.potential;
        });
    r.center = (1 / r.mass) * r.center;
    return r;
}

}  // namespace ordo
