// Sums over all particles: mass, momentum, energies.
#pragma once

#include "kernels/scatter.hpp"
#include "method/sums.hpp"
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
MassAndMomentum mass_and_momentum(const State<D>& s)
{
    const Particles<D>& p = s.particles;
    return sum_over_particles<4>(s, [&](int i) { return mass_and_momentum_of(mass_momentum(p.m[i], p.v[i], 0.0)); });
}

/// Of particles with the velocities v, J.
template <int D>
double kinetic_energy(const State<D>& s, const Vec<D>* v)
{
    return sum_over_particles<1>(s, [&](int i) { return Numbers<1>{{0.5 * s.particles.m[i] * dot(v[i], v[i])}}; })[0];
}

template <int D>
Totals totals(const Model<D>& model, const State<D>& s)
{
    enum { mass, momentum, kinetic = momentum + 3, strain, potential, dissipated, artificial, count };
    const Particles<D>& p     = s.particles;
    const int column          = p.history_column("dissipated");
    const double* dissipation = column < 0 ? nullptr : p.history[column].data();
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
    const Numbers<count> sums = sum_over_tiles<count>(s, [&](const Tile& tile) {
        Lanes parts[count] = {};
        for (int first = tile.begin; first < tile.end; first += Batch::size) {
            const Batch b         = Batch::of(first, tile.end);
            const Vec<D, Lanes> v = load(p.v.data(), b);
            auto add              = [&](int k, Lanes one) {
                for (int lane = b.count; lane < Batch::size; ++lane) one[lane] = 0.0;
                parts[k] += one;
            };
            const Lanes m = load(p.m.data(), b);
            add(mass, m);
            for (int a = 0; a < D; ++a) add(momentum + a, m * v[a]);
            add(kinetic, 0.5 * m * dot(v, v));
            add(potential, -m * dot(gravity, way(b)));
            add(strain, energy(b));
            if (dissipation) add(dissipated, load(p.V0.data(), b) * load(dissipation, b));
            if (!p.q_work.empty()) add(artificial, load(p.V0.data(), b) * load(p.q_work.data(), b));
        }
        Numbers<count> r;
        for (int k = 0; k < count; ++k) r[k] = sum(parts[k]);
        return r;
    });
    return {.mass           = sums[mass],
            .momentum       = {sums[momentum], sums[momentum + 1], sums[momentum + 2]},
            .kinetic_energy = sums[kinetic],
            .strain_energy  = sums[strain],
            .potential      = sums[potential],
            .dissipated     = sums[dissipated],
            .artificial     = sums[artificial]};
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
BodyTotals totals_of_body(const Model<D>& model, const State<D>& s, int body)
{
    enum { mass, center, momentum = center + 3, spin = momentum + 3, kinetic = spin + 3, strain, potential, count };
    const Particles<D>& p = s.particles;
    const StoredEnergy<D> energy(model.materials, p);
    const Numbers<count> sums = sum_over_particles<count>(s, [&](int i) {
        Numbers<count> one;
        if (p.body[i] != body) return one;
        Vec<D> x = p.x[i];
        for (int a = 0; a < D; ++a)
            if (model.periodic[a]) x[a] += p.turns[i][a] * model.cells[a] * model.h[a];
        const Vec<3> at = padded(x), mv = p.m[i] * padded(p.v[i]);
        one[mass] = p.m[i];
        for (int a = 0; a < 3; ++a) {
            const int b = (a + 1) % 3, c = (a + 2) % 3;
            one[center + a]   = p.m[i] * at[a];
            one[momentum + a] = mv[a];
            one[spin + a]     = at[b] * mv[c] - at[c] * mv[b];
        }
        one[kinetic]   = 0.5 * p.m[i] * dot(p.v[i], p.v[i]);
        one[strain]    = energy(i);
        one[potential] = -p.m[i] * dot(model.gravity, x);
        return one;
    });
    auto vector               = [&](int first) { return Vec<3>{sums[first], sums[first + 1], sums[first + 2]}; };
    return {.mass           = sums[mass],
            .center         = (1 / sums[mass]) * vector(center),
            .momentum       = vector(momentum),
            .spin           = vector(spin),
            .kinetic_energy = sums[kinetic],
            .strain_energy  = sums[strain],
            .potential      = sums[potential]};
}

}  // namespace ordo
