// The nodes of the grid as lists, for those who look at them from outside a step or change their forces in it.
#pragma once

#include "method/state.hpp"

#include <functional>
#include <vector>

namespace ordo {

/// The nodes with mass of all velocity fields, without images of periodic axes and without enriched corners.
template <int D>
struct NodeList {
    std::vector<std::ptrdiff_t> record;  ///< their numbers among those of NodeField::nodes
    std::vector<Vec<D>> place;           ///< m
    std::vector<double> mass;            ///< kg
    std::vector<int> field;              ///< the velocity field, see Model::field_of_body
};

template <int D>
NodeList<D> nodes_with_mass(const State<D>& s)
{
    NodeList<D> r;
    const Tiles<D>& tiles = s.field.tiles;
    tiles.for_each_node([&](const Index<D>& at, std::ptrdiff_t node) {
        const double mass = s.field.nodes[static_cast<std::size_t>(node)][NodeLane::mass];
        if (!(mass > 0) || s.lattice.is_image(at) || !tiles.counts_record(node)) return;
        r.record.push_back(node);
        r.place.push_back(Constraints<D>::place_of(s.lattice, at));
        r.mass.push_back(mass);
        r.field.push_back(static_cast<int>(node / static_cast<std::ptrdiff_t>(s.lattice.node_count())));
    });
    return r;
}

/// What nodes have before the kick of a step: momenta, kg m/s, and forces with gravity, N. Both may be changed.
template <int D>
struct NodeForces {
    NodeList<D> nodes;
    std::vector<Vec<D>> momentum, force;
    double t = 0.0, dt = 0.0;  ///< the time of the forces and the length of the kick, s
};

template <int D>
using OnNodes = std::function<void(NodeForces<D>&)>;

}  // namespace ordo
