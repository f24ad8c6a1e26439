// Passes over the nodes that the material touches.
#pragma once

#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <cstring>

namespace ordo {

/// Sets nodes, or records of `size` Lanes a node, to zero.
template <int D>
void clear(Lanes* nodes, const Tiles<D>& tiles, int size = 1)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        std::memset(static_cast<void*>(nodes + first * size), 0, sizeof(Lanes) * (end - first) * size);
    });
}

/// Keeps the lanes where `kept` is 1, and sets those where it is 0 to zero.
template <int D>
void keep_lanes(Lanes* nodes, const Tiles<D>& tiles, const Lanes& kept)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i) nodes[i] = nodes[i] * kept;
    });
}

/// Sets all but the velocities to zero.
template <int D>
void clear_masses(Lanes* nodes, const Tiles<D>& tiles)
{
    keep_lanes(nodes, tiles, make_lanes(1, 1, 1, 0, 0, 0, 0, 0));
}

template <int D>
void clear_increments(Lanes* nodes, const Tiles<D>& tiles)
{
    keep_lanes(nodes, tiles, make_lanes(1, 1, 1, 1, 0, 0, 0, 1));
}

template <int D>
void copy(Lanes* to, const Lanes* from, const Tiles<D>& tiles)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        std::memcpy(static_cast<void*>(to + first), from + first, sizeof(Lanes) * (end - first));
    });
}

/// v_i += factor * of_i, the velocities of `of`.
template <int D>
void add_velocities(Lanes* nodes, const Lanes* of, const Tiles<D>& tiles, double factor)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i)
            nodes[i] = nodes[i] + of[i] * make_lanes(factor, factor, factor, 0, 0, 0, 0, 0);
    });
}

/// v_i -= dv_i, the velocities before the kick.
template <int D>
void take_increments(Lanes* nodes, const Tiles<D>& tiles)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i) {
            const Lanes n = nodes[i];
            nodes[i]      = n - make_lanes(n[4], n[5], n[6], 0, 0, 0, 0, 0);
        }
    });
}

/// v_i = (1 - part) v_i + part * of_i, the velocities of `of`.
template <int D>
void blend_velocities(Lanes* nodes, const Lanes* of, const Tiles<D>& tiles, double part)
{
    if (part == 0.0) return;
    const double rest = 1 - part;
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i)
            nodes[i] =
                nodes[i] * make_lanes(rest, rest, rest, 1, 1, 1, 1, 1) + of[i] * make_lanes(part, part, part, 0, 0, 0, 0, 0);
    });
}

/// v_i = (m v)_i / m_i at nodes with mass.
template <int D>
void momenta_to_velocities(Lanes* nodes, const Tiles<D>& tiles)
{
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i) {
            const double m = nodes[i][NodeLane::mass];
            if (!(m > 0)) continue;
            const double s = 1 / m;
            nodes[i]       = nodes[i] * make_lanes(s, s, s, 1, 1, 1, 1, 1);
        }
    });
}

/// What nodes hold before `kick`: velocity and force, momentum and force, or velocity and acceleration.
enum class NodeState { velocity, momentum, solved };

/// a_i = f_i/m_i + g. The increment dt a_i replaces the force or acceleration, and v_i += dt a_i. If nodes hold momenta,
/// v_i = (m v)_i/m_i first.
template <int D>
void kick(Lanes* nodes, const Tiles<D>& tiles, const Vec<D>& gravity, double dt, NodeState state)
{
    const Vec<3> g = padded(dt * gravity);
    tiles.for_each_node_run([=](std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i) {
            Lanes& n       = nodes[i];
            const double m = n[NodeLane::mass];
            if (!(m > 0)) continue;
            const double s = state == NodeState::momentum ? 1 / m : 1.0, f = state == NodeState::solved ? dt : dt / m;
            const double x = f * n[4] + g[0], y = f * n[5] + g[1], z = f * n[6] + g[2];
            n = n * make_lanes(s, s, s, 1, 0, 0, 0, 1) + make_lanes(x, y, z, 0, x, y, z, 0);
        }
    });
}

}  // namespace ordo
