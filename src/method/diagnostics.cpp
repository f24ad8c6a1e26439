#include "method/diagnostics.hpp"

#include "kernels/scatter.hpp"
#include "method/sums.hpp"

namespace ordo {

template <int D>
MassAndMomentum mass_and_momentum(const State<D>& s)
{
    const Particles<D>& p = s.particles;
    return sum_over_particles<4>(s, [&](int i) { return mass_and_momentum_of(mass_momentum(p.m[i], p.v[i], 0.0)); });
}

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

#define ORDO_DIAGNOSTICS(D)                                         \
    template MassAndMomentum mass_and_momentum(const State<D>&);    \
    template double kinetic_energy(const State<D>&, const Vec<D>*); \
    template Totals totals(const Model<D>&, const State<D>&);       \
    template BodyTotals totals_of_body(const Model<D>&, const State<D>&, int);
ORDO_DIAGNOSTICS(1)
ORDO_DIAGNOSTICS(2)
ORDO_DIAGNOSTICS(3)
#undef ORDO_DIAGNOSTICS

}  // namespace ordo
