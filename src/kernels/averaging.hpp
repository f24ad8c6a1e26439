// Volume averages of particle scalars over the cells or the vertices of the grid, body by body.
#pragma once

#include "kernels/sweep.hpp"

namespace ordo {

/// Bodies that share a record of the grid: body k has lane 2 (k mod 4) for sum V u and the next for sum V.
constexpr int kBodiesOfRecord = NodeLane::end / 2;

/// f(record, weight) for the cell that a place is in, or with `at_vertices` for its vertices with the weights of hats. A cell has
/// the index of its lower vertex.
template <bool at_vertices, int D, class F>
ORDO_FLAT inline void for_each_share(const Lattice<D>& g, const Vec<D>& x, F&& f)
{
    std::ptrdiff_t cell = 0;
    Vec<D> part{};
    for (int a = 0; a < D; ++a) {
        const double at = g.cell_coordinate(a, x[a]);
        const int k     = static_cast<int>(at);
        part[a]         = at - k;
        cell += k * g.stride[a];
    }
    if constexpr (!at_vertices) {
        f(cell, 1.0);
    } else {
        for (int corner = 0; corner < 1 << D; ++corner) {
            std::ptrdiff_t record = cell;
            double weight         = 1.0;
            for (int a = 0; a < D; ++a) {
                const bool is_above = corner >> a & 1;
                weight *= is_above ? part[a] : 1.0 - part[a];
                record += is_above ? g.stride[a] : 0;
            }
            f(record, weight);
        }
    }
}

/// The bodies [first, first + kBodiesOfRecord) of particles [begin, end) add their a V u and a V to the records.
template <int D, bool at_vertices>
void spread_averages(const Lattice<D>& lattice, const ParticleView<D>& p, const double* V, const double* u, Lanes* records,
                     int first, int begin, int end)
{
    const Lattice<D> g = lattice;  // a copy that no store can alias
    for (int i = begin; i < end; ++i) {
        const int k = p.body[i] - first;
        if (k < 0 || k >= kBodiesOfRecord) continue;
        for_each_share<at_vertices>(g, p.x[i], [&](std::ptrdiff_t record, double weight) {
            records[record][2 * k] += weight * V[i] * u[i];
            records[record][2 * k + 1] += weight * V[i];
        });
    }
}

/// u_p = sum_k a_pk (sum_q V_q a_qk u_q)/(sum_q V_q a_qk) of the same particles, from the records.
template <int D, bool at_vertices>
void collect_averages(const Lattice<D>& lattice, const ParticleView<D>& p, double* u, const Lanes* records, int first, int begin,
                      int end)
{
    const Lattice<D> g = lattice;
    for (int i = begin; i < end; ++i) {
        const int k = p.body[i] - first;
        if (k < 0 || k >= kBodiesOfRecord) continue;
        double mean = 0.0;
        for_each_share<at_vertices>(g, p.x[i], [&](std::ptrdiff_t record, double weight) {
            if (weight > 0) mean += weight * records[record][2 * k] / records[record][2 * k + 1];
        });
        u[i] = mean;
    }
}

/// det(I + G) - 1 without cancellation.
template <int D, class T>
ORDO_FLAT inline T dilation(const Mat<D, T>& G)
{
    T r = G(0, 0);
    for (int a = 1; a < D; ++a) r += G(a, a);
    if constexpr (D > 1) r += det(G);
    if constexpr (D == 3)
        for (int a = 0; a < D; ++a)
            for (int b = a + 1; b < D; ++b) r += G(a, a) * G(b, b) - G(a, b) * G(b, a);
    return r;
}

}  // namespace ordo
