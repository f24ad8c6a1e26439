// Velocities of nodes as least-squares fits to the particles, or to particles and corners (CPLS): projections mls and imls.
#pragma once

#include "kernels/moment_windows.hpp"
#include "kernels/sweep.hpp"

#include <limits>

namespace ordo {

/// The samples of a particle, each of which counts 1: the particle and, with corners, the corners of its domain with
/// v_p + L_p (x_c - x_p), or of a cell those that it stands for with velocities of their own.
template <int D>
struct ParticleSamples {
    static constexpr int corners = 1 << D;

    int count = 1;
    Vec<D> x[1 + corners], v[1 + corners];

    ORDO_FLAT ParticleSamples(const Lattice<D>& g, const ParticleView<D>& p, int i, bool with_corners)
    {
        x[0] = p.x[i];
        v[0] = p.v[i];
        if (!with_corners) return;
        if (p.cell) {
            add_shared(g, p, i);
            return;
        }
        Mat<D> r{};
        for (int a = 0; a < D; ++a) r(a, a) = p.edges ? 0.0 : p.half[i][a];
        if (p.edges) r = p.edges[i];
        const Mat<D> Lr = p.L[i] * r;
        for (int c = 0; c < corners; ++c) {
            x[count] = x[0];
            v[count] = v[0];
            for (int d = 0; d < D; ++d) {
                const double sign = c >> d & 1 ? 1.0 : -1.0;
                x[count] += sign * column(r, d);
                v[count] += sign * column(Lr, d);
            }
            ++count;
        }
    }

  private:
    ORDO_FLAT void add_shared(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        for (int c = 0; c < corners; ++c) {
            if (!(p.samples[i] >> c & 1)) continue;
            x[count] = p.corner[p.cell[i][c]];
            v[count] = p.corner_velocity[p.cell[i][c]];
            for (int a = 0; a < D; ++a)
                if (g.periodic[a]) x[count][a] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
            ++count;
        }
    }
};

/// Adds the samples of particles [begin, end) to the records of the nodes.
template <int D, int degree, class Places, int W>
void spread_velocity(const Sweep<D>& sweep, Lanes* records, bool with_corners, int begin, int end)
{
    const Sweep<D> s = sweep;
    auto for_each    = [&](auto&& add) {
        for (int i = begin; i < end; ++i) {
            const ParticleSamples<D> samples(s.lattice, s.p, i, with_corners);
            for (int k = 0; k < samples.count; ++k) {
                Vec<D> y{};
                for (int a = 0; a < D; ++a) y[a] = s.lattice.cell_coordinate(a, samples.x[k][a]);
                add(y, samples.v[k].c);
            }
        }
    };
    // Windows cost more than they save where few samples share one, or few targets.
    constexpr bool has_windows = Places::is_even && (D == 3 || (D == 2 && W == 4));
    if constexpr (has_windows) {
        if (with_corners) {
            thread_local MomentWindows<D, degree, D, Places, W> windows;  // for its memory
            for_each([&](const Vec<D>& y, const double(&v)[D]) { windows.add(y, v); });
            windows.spread(s.lattice, records);
            return;
        }
    }
    for_each([&](const Vec<D>& y, const double(&v)[D]) {
        Moments<D, degree, D>::template spread<Places, W>(s.lattice, records, y, v);
    });
}

/// The mass of a node that has a velocity but no mass.
inline constexpr double kHasVelocity = std::numeric_limits<double>::min();

/// Velocities of nodes [first, end) from their records; (m v)_i/m_i where there is no sample.
template <int D, int degree>
void solve_velocity(Lanes* nodes, const Lanes* records, const FitChoices& choices, std::ptrdiff_t first, std::ptrdiff_t end,
                    FitReport& report)
{
    using M = Moments<D, degree, D>;
    for (std::ptrdiff_t i = first; i < end; ++i) {
        const double m = nodes[i][NodeLane::mass];
        if (!(m > 0) && !choices.everywhere) continue;
        const Lanes* record = records + i * M::size;
        if (!(M::weight(record) > 0)) {
            if (!(m > 0)) continue;
            ++report.fallback;
            for (int a = 0; a < D; ++a) nodes[i][NodeLane::velocity + a] /= m;
            continue;
        }
        double matrix[M::unknowns][M::unknowns], row[M::unknowns], b[M::unknowns];
        M::matrix(record, matrix);
        const Ldl<M::unknowns> fit(matrix);
        report.dropped += m > 0 ? fit.dropped : 0;
        if (!(m > 0)) nodes[i][NodeLane::mass] = kHasVelocity;
        if (choices.is_whole && fit.dropped > 0) {
            report.fallback += m > 0;
            for (int a = 0; a < D; ++a) nodes[i][NodeLane::velocity + a] = M::mean(record, a);
            continue;
        }
        fit.first_row(row);
        for (int a = 0; a < D; ++a) {
            M::right_side(record, a, b);
            double v = 0.0;
            for (int k = 0; k < M::unknowns; ++k) v += row[k] * b[k];
            nodes[i][NodeLane::velocity + a] = v;
        }
    }
}

}  // namespace ordo
