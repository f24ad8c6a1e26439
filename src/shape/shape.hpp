// What a particle's domain must offer to the kernels: weights phi_ip and gradients that are visited, never stored.
#pragma once

#include "base/lanes.hpp"
#include "grid/lattice.hpp"
#include "particles/particles.hpp"

#include <concepts>
#include <cstddef>

namespace ordo {

template <int D>
struct AnyVisitor {
    ORDO_HD void operator()(std::ptrdiff_t, double, const Vec<D>&) const {}
};

/// A domain on a basis. `for_each_node` is its definition (a node may come several times; only ddmpm looks at the nodes);
/// `spread` and `collect` are the fast forms, tested against it. `reach` is the distance in cells from the particle to the edge of its domain, at most `max_reach`.
template <class S>
concept Shape = requires(const Lattice<S::dim>& g, const ParticleView<S::dim>& p, int i, Lanes* nodes, const Lanes* read,
                         const Lanes& value, const Lanes (&flux)[S::dim], Lanes& sum, Lanes (&gradient)[S::dim])
{
    {
        S::reach(g, p, i)
        } -> std::convertible_to<double>;
    {
        S::max_reach
        } -> std::convertible_to<double>;
    S::for_each_node(g, p, i, read, AnyVisitor<S::dim>{});
    S::spread(g, p, i, nodes, value, flux);
    S::spread_value(g, p, i, nodes, value);
    S::collect(g, p, i, read, sum, gradient);
    S::collect_value(g, p, i, read, sum);
};

}  // namespace ordo
