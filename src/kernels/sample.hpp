// Nodal fields at particles, and the weights themselves: for systems of equations over the nodes, which take them apart from the motion.
#pragma once

#include "kernels/gather.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

/// sum_i phi_ip u_i and sum_i u_i (x) grad phi_ip of the vectors u_i in the velocity lanes, at particles [begin, end).
template <Shape S>
void sample(const Sweep<S::dim>& sweep, Vec<S::dim>* value, Mat<S::dim>* gradient, int begin, int end)
{
    constexpr int D  = S::dim;
    const Sweep<D> s = sweep;
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b = Batch::of(first, end);
        FromNodes<D> nodes;
        if (!b.is_full()) nodes = {};
        collect<S, true>(s, b, nodes);
        store(gradient, b, nodes.velocity_gradients());
        Vec<D, Lanes> v, rest;
        nodes.velocities(v, rest);
        store(value, b, v);
    }
}

/// A node of a particle: phi_ip and grad phi_ip, 1/m.
template <int D>
struct NodeWeight {
    std::ptrdiff_t node;
    double value;
    Vec<D> slope;
};

/// Sets `out` to the nodes of particle i, each once, in the order in which its domain meets them.
template <Shape S>
void list_weights(const Sweep<S::dim>& s, int i, std::vector<NodeWeight<S::dim>>& out)
{
    out.clear();
    S::for_each_node(s.lattice, s.p, i, s.nodes, [&](std::ptrdiff_t node, double w, const Vec<S::dim>& dw) {
        for (NodeWeight<S::dim>& one : out)
            if (one.node == node) {
                one.value += w;
                one.slope += dw;
                return;
            }
        out.push_back({node, w, dw});
    });
}

}  // namespace ordo
