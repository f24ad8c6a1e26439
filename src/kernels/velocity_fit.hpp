// Velocities of nodes as least-squares fits to the particles, or to particles and corners (CPLS): projections mls and imls.
// With limiter slope the records also have the sum of |v|^2.
#pragma once

#include "kernels/moment_windows.hpp"
#include "kernels/sweep.hpp"
#include "particles/batch.hpp"
#include "shape/corners.hpp"

#include <limits>

namespace ordo {

// Corners of domains are samples in addition to the particles. Each counts 1, like a particle.

/// add(x, v, count) with the corners of boxes or parallelepipeds and v_p + L_p (x_c - x_p), for each corner of a batch.
template <int D, class Add>
ORDO_FLAT inline void for_each_corner_sample(const ParticleView<D>& p, const Batch& b, Add&& add)
{
    const Vec<D, Lanes> x = load(p.x, b), v = load(p.v, b);
    Mat<D, Lanes> r{};
    if (p.edges) {
        r = load(p.edges, b);
    } else {
        const Vec<D, Lanes> half = load(p.half, b);
        for (int a = 0; a < D; ++a) r(a, a) = half[a];
    }
    const Mat<D, Lanes> Lr = load(p.L, b) * r;
    for (int c = 0; c < 1 << D; ++c) {
        Vec<D, Lanes> x_c = x, v_c = v;
        for (int d = 0; d < D; ++d) {
            const double side = c >> d & 1 ? 1.0 : -1.0;
            for (int a = 0; a < D; ++a) {
                x_c[a] += r(a, d) * side;
                v_c[a] += Lr(a, d) * side;
            }
        }
        add(x_c, v_c, b.count);
    }
}

/// The same for the corners that count for the cell of particle i, one per lane. They have velocities of their own.
template <int D, class Add>
ORDO_FLAT inline void for_each_shared_corner(const Lattice<D>& g, const ParticleView<D>& p, int i, Add&& add)
{
    int count = 0;
    Vec<D, Lanes> x{}, v{};
    for (int c = 0; c < 1 << D; ++c) {
        if (!(p.samples[i] >> c & 1)) continue;
        for (int a = 0; a < D; ++a) {
            x[a][count] = p.corner[p.cell[i][c]][a];
            v[a][count] = p.corner_velocity[p.cell[i][c]][a];
            if (g.periodic[a]) x[a][count] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
        }
        ++count;
    }
    if (count == 0) return;
    for (int k = count; k < 8; ++k)  // spare lanes repeat one
        for (int a = 0; a < D; ++a) {
            x[a][k] = x[a][0];
            v[a][k] = v[a][0];
        }
    add(x, v, count);
}

/// add(x, v, count) with the samples of particles [begin, end) in the first `count` lanes.
template <int D, class Add>
ORDO_FLAT inline void for_each_sample(const Sweep<D>& s, bool with_corners, int begin, int end, Add&& add)
{
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        add(load(s.p.x, b), load(s.p.v, b), b.count);
        if (!with_corners) continue;
        if (s.p.cell)
            for (int i = first; i < first + b.count; ++i) for_each_shared_corner(s.lattice, s.p, i, add);
        else
            for_each_corner_sample(s.p, b, add);
    }
}

/// The record of a node.
template <int D, int degree, bool is_limited>
using VelocityMoments = Moments<D, degree, D, is_limited>;

/// The values of a sample in the record.
template <int D, bool is_limited, class T>
ORDO_FLAT inline void set_values(const Vec<D, T>& v, T (&value)[D + is_limited])
{
    for (int a = 0; a < D; ++a) value[a] = v[a];
    if constexpr (is_limited) value[D] = dot(v, v);
}

/// Adds the samples of particles [begin, end) to the records of the nodes.
template <int D, int degree, class Places, int W, bool is_limited>
void spread_velocity(const Sweep<D>& sweep, Lanes* records, bool with_corners, int begin, int end)
{
    const Sweep<D> s = sweep;
    auto coordinates = [&](Vec<D, Lanes> x) {
        for (int a = 0; a < D; ++a) x[a] = s.lattice.cell_coordinate(a, x[a]);
        return x;
    };
    if constexpr (has_windows<D, Places>) {
        thread_local MomentWindows<D, degree, D, Places, W, is_limited> of_thread;  // keeps its memory
        auto& windows = of_thread;  // found once: in the Python module that is a call
        for_each_sample(s, with_corners, begin, end, [&](const Vec<D, Lanes>& x, const Vec<D, Lanes>& v, int count) {
            Lanes value[D + is_limited];
            set_values<D, is_limited>(v, value);
            windows.add(coordinates(x), value, count);
        });
        windows.spread(s.lattice, records);
    } else {
        for_each_sample(s, with_corners, begin, end, [&](const Vec<D, Lanes>& x, const Vec<D, Lanes>& v, int count) {
            const Vec<D, Lanes> y = coordinates(x);
            for (int k = 0; k < count; ++k) {
                Vec<D> at, v_k;
                for (int a = 0; a < D; ++a) {
                    at[a]  = y[a][k];
                    v_k[a] = v[a][k];
                }
                double value[D + is_limited];
                set_values<D, is_limited>(v_k, value);
                VelocityMoments<D, degree, is_limited>::template spread<Places, W>(s.lattice, records, at, value);
            }
        });
    }
}

/// The mass that marks a node with a velocity but without mass.
inline constexpr double kHasVelocity = std::numeric_limits<double>::min();

/// The part of a fit that a node takes with limiter slope; the rest is the projection by mass. Of the variance of the samples' velocities
/// slopes explain one part and leave another. Where they explain 64 times what they leave the node takes all of the fit, below 16 times,
/// as at a jump between bodies up to a cell apart, none of it (docs/energy.md).
template <int D, class M>
double part_of_fit(const Lanes* record, const Ldl<M::unknowns>& fit)
{
    constexpr double none = 16.0, all = 64.0, round_off = 1e-13;
    const double squares = M::total(record, 0);
    double explained = 0.0, left = squares;
    for (int a = 0; a < D; ++a) {
        double b[M::unknowns], mean, slopes;
        M::right_side(record, a, b);
        fit.explain(b, mean, slopes);
        explained += slopes;
        left -= mean + slopes;
    }
    if (left <= round_off * squares || explained >= all * left) return 1.0;
    return explained <= none * left ? 0.0 : (explained / left - none) / (all - none);
}

/// Velocities of nodes [first, end) from their records; (m v)_i/m_i if a node has no sample.
template <int D, int degree, bool is_limited>
void solve_velocity(Lanes* nodes, const Lanes* records, const FitChoices& choices, std::ptrdiff_t first, std::ptrdiff_t end,
                    FitReport& report)
{
    using M = VelocityMoments<D, degree, is_limited>;
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
        double part = 1.0;
        if constexpr (is_limited) part = m > 0 ? part_of_fit<D, M>(record, fit) : 1.0;
        for (int a = 0; a < D; ++a) {
            M::right_side(record, a, b);
            double v = 0.0;
            for (int k = 0; k < M::unknowns; ++k) v += row[k] * b[k];
            double& velocity = nodes[i][NodeLane::velocity + a];
            velocity         = part == 1.0 ? v : part * v + (1.0 - part) * velocity / m;
        }
    }
}

}  // namespace ordo
