// Velocities of nodes as least-squares fits to the particles, or to particles and corners (CPLS): projections mls and imls.
#pragma once

#include "kernels/moment_windows.hpp"
#include "kernels/sweep.hpp"
#include "particles/batch.hpp"
#include "shape/corners.hpp"

#include <limits>

namespace ordo {

/// The samples of a particle beside itself, lane by lane: the corners of its domain with v_p + L_p (x_c - x_p), or of a cell
/// those that it stands for with velocities of their own. Each counts 1, as the particle does.
template <int D>
struct CornerSamples {
    int count = 0;
    Vec<D, Lanes> x{}, v{};

    ORDO_FLAT CornerSamples(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        if (p.cell) {
            add_shared(g, p, i);
            return;
        }
        count = 1 << D;
        Mat<D> r{};
        for (int a = 0; a < D; ++a) r(a, a) = p.edges ? 0.0 : p.half[i][a];
        if (p.edges) r = p.edges[i];
        const Mat<D> Lr = p.L[i] * r;
        for (int a = 0; a < D; ++a) {
            x[a] = Lanes(p.x[i][a]);
            v[a] = Lanes(p.v[i][a]);
            for (int d = 0; d < D; ++d) {
                x[a] += corner_side(d) * r(a, d);
                v[a] += corner_side(d) * Lr(a, d);
            }
        }
    }

  private:
    ORDO_FLAT void add_shared(const Lattice<D>& g, const ParticleView<D>& p, int i)
    {
        for (int c = 0; c < 1 << D; ++c) {
            if (!(p.samples[i] >> c & 1)) continue;
            for (int a = 0; a < D; ++a) {
                x[a][count] = p.corner[p.cell[i][c]][a];
                v[a][count] = p.corner_velocity[p.cell[i][c]][a];
                if (g.periodic[a]) x[a][count] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
            }
            ++count;
        }
        for (int k = count; k < 8 && count > 0; ++k)  // spare lanes repeat one
            for (int a = 0; a < D; ++a) {
                x[a][k] = x[a][0];
                v[a][k] = v[a][0];
            }
    }
};

/// add(x, v, count) with the samples of particles [begin, end) in the first `count` lanes.
template <int D, class Add>
ORDO_FLAT inline void for_each_samples(const Sweep<D>& s, bool with_corners, int begin, int end, Add&& add)
{
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        add(load(s.p.x, b), load(s.p.v, b), b.count);
        for (int i = first; i < first + b.count && with_corners; ++i) {
            const CornerSamples<D> corners(s.lattice, s.p, i);
            if (corners.count > 0) add(corners.x, corners.v, corners.count);
        }
    }
}

/// Adds the samples of particles [begin, end) to the records of the nodes.
template <int D, int degree, class Places, int W>
void spread_velocity(const Sweep<D>& sweep, Lanes* records, bool with_corners, int begin, int end)
{
    const Sweep<D> s = sweep;
    auto coordinates = [&](Vec<D, Lanes> x) {
        for (int a = 0; a < D; ++a) x[a] = s.lattice.cell_coordinate(a, x[a]);
        return x;
    };
    if constexpr (Places::is_even && D > 1) {
        thread_local MomentWindows<D, degree, D, Places, W> windows;  // for its memory
        for_each_samples(s, with_corners, begin, end, [&](const Vec<D, Lanes>& x, const Vec<D, Lanes>& v, int count) {
            windows.add(coordinates(x), v.c, count);
        });
        windows.spread(s.lattice, records);
    } else {
        for_each_samples(s, with_corners, begin, end, [&](const Vec<D, Lanes>& x, const Vec<D, Lanes>& v, int count) {
            const Vec<D, Lanes> y = coordinates(x);
            for (int k = 0; k < count; ++k) {
                Vec<D> at, value;
                for (int a = 0; a < D; ++a) {
                    at[a]    = y[a][k];
                    value[a] = v[a][k];
                }
                Moments<D, degree, D>::template spread<Places, W>(s.lattice, records, at, value.c);
            }
        });
    }
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
