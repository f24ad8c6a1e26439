// Sums over all particles: mass, momentum, energies. The same for any number of threads.
#pragma once

#include "method/state.hpp"
#include "shape/bspline.hpp"
#include "shape/hat.hpp"
#include "shape/stencil.hpp"

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

/// The fields of the grid at a place, of the last step. Nodes without mass do not count.
template <int D>
struct GridSample {
    Vec<D> velocity;  ///< m/s
    double mass;      ///< sum N_i m_i, kg
    double density;   ///< sum N_i m_i over the integral of N_i, kg/m^D
};

template <int D, class Basis>
GridSample<D> sample_grid_of(const State<D>& s, const Vec<D>& x)
{
    Stencil<D, Basis::width> row;
    row.first = 0;
    for (int a = 0; a < D; ++a)
        row.first += s.lattice.stride[a] * Basis::row(s.lattice, a, s.lattice.cell_coordinate(a, x[a]), row.w[a], row.dw[a]);
    GridSample<D> r{};
    double weights = 0.0;
    for_each_node(row, s.lattice, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
        const Index<D> at = s.lattice.index(node);
        const Lanes& n    = s.nodes[node];
        if (!s.tiles.is_active(at) || !(n[NodeLane::mass] > 0)) return;
        double whole = 1.0;
        for (int a = 0; a < D; ++a) whole *= s.lattice.node_length(a, at[a]);
        weights += w;
        r.mass += w * n[NodeLane::mass];
        r.density += w * n[NodeLane::mass] / whole;
        for (int a = 0; a < D; ++a) r.velocity[a] += w * n[NodeLane::velocity + a];
    });
    if (weights > 0) r.velocity *= 1 / weights;
    return r;
}

template <int D>
GridSample<D> sample_grid(const State<D>& s, const Vec<D>& x)
{
    switch (s.lattice.basis.degree) {
    case 2: return sample_grid_of<D, BSpline<2>>(s, x);
    case 3: return sample_grid_of<D, BSpline<3>>(s, x);
    default: return sample_grid_of<D, Hat>(s, x);
    }
}

}  // namespace ordo
