// The interface of a particle's domain for kernels: weights phi_ip and gradients that are visited, never stored.
#pragma once

#include "base/lanes.hpp"
#include "grid/lattice.hpp"
#include "particles/batch.hpp"
#include "particles/particles.hpp"

#include <concepts>
#include <cstddef>

namespace ordo {

template <int D>
struct AnyVisitor {
    ORDO_HD void operator()(std::ptrdiff_t, double, const Vec<D>&) const {}
};

/// A domain on a basis. `for_each_node` is its definition (it may visit a node several times; only ddmpm reads the nodes);
/// `spread` and `collect` are the fast forms, tested against it. `reach` is the distance in cells from the particle to the
/// edge of its domain, at most `max_reach`.
template <class S>
concept Shape = requires(const Lattice<S::dim>& g, const ParticleView<S::dim>& p, int i, const Batch& batch, Lanes* nodes,
                         const Lanes* read, const Lanes& value, const Lanes (&flux)[S::dim], Lanes& sum, Quad (&gradient)[S::dim])
{
    {
        S::reach(g, p, batch)
        } -> std::same_as<Lanes>;
    {
        S::max_reach
        } -> std::convertible_to<double>;
    S::for_each_node(g, p, i, read, AnyVisitor<S::dim>{});
    S::spread(g, p, i, nodes, value, flux);
    S::spread_value(g, p, i, nodes, value);
    S::collect(g, p, i, read, sum, gradient);
    S::collect_value(g, p, i, read, sum);
};

/// Particle i of a shape, used like a stencil by shapes that have none.
template <class S>
struct OneParticle {
    const ParticleView<S::dim>& p;
    int i;
};
template <class S, class Value, class Flux>
ORDO_FLAT inline void spread(const OneParticle<S>& one, const Lattice<S::dim>& g, Lanes* nodes, const Value& value,
                             const Flux (&flux)[S::dim])
{
    S::spread(g, one.p, one.i, nodes, value, flux);
}
template <class S, class Value>
ORDO_FLAT inline void spread_value(const OneParticle<S>& one, const Lattice<S::dim>& g, Lanes* nodes, const Value& value)
{
    S::spread_value(g, one.p, one.i, nodes, value);
}
template <class S>
ORDO_FLAT inline void collect(const OneParticle<S>& one, const Lattice<S::dim>& g, const Lanes* nodes, Lanes& value,
                              Quad (&gradient)[S::dim])
{
    S::collect(g, one.p, one.i, nodes, value, gradient);
}
template <class S>
ORDO_FLAT inline void collect_value(const OneParticle<S>& one, const Lattice<S::dim>& g, const Lanes* nodes, Lanes& value)
{
    S::collect_value(g, one.p, one.i, nodes, value);
}

/// f(k, stencil) for the particles of a batch, for `spread` and `collect`. Shapes that can find the weights of eight particles
/// at a time do so.
template <Shape S, class F>
ORDO_FLAT inline void for_each_stencil(const Lattice<S::dim>& g, const ParticleView<S::dim>& p, const Batch& b, F&& f)
{
    if constexpr (requires { S::for_each_stencil(g, p, b, f); })
        S::for_each_stencil(g, p, b, f);
    else
        for (int k = 0; k < b.count; ++k) f(k, OneParticle<S>{p, b.first + k});
}

}  // namespace ordo
