// Nodes that repeat others: on periodic axes today, between ranks later. The step calls `add` after each scatter
// and `copy` after each change of node values; both do nothing on a grid without images.
#pragma once

#include "base/parallel.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace ordo {

/// The pairs (margin node, node that it repeats) in the blocks that the material touches.
template <int D>
class Halo {
  public:
    Halo() = default;
    Halo(const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        for (int a = 0; a < D; ++a) {
            if (!lattice.periodic[a]) continue;
            for (const Block<D>& block : tiles.blocks()) {
                IndexBox<D> below = tiles.nodes_of(block), above = below;
                below.hi[a] = std::min(below.hi[a], lattice.margin);
                above.lo[a] = std::max(above.lo[a], lattice.margin + lattice.cells[a]);
                for (const IndexBox<D>& ghosts : {below, above})
                    ghosts.for_each([&](const Index<D>& k) {
                        Index<D> image = k;
                        image[a]       = lattice.periodic_image(a, k[a]);
                        pairs_[a].push_back({block.first_node + lattice.offset(k), block.first_node + lattice.offset(image)});
                    });
            }
            // On longer periods a node has one ghost at most.
            if (lattice.nodes[a] > 2 * lattice.cells[a])
                std::stable_sort(pairs_[a].begin(), pairs_[a].end(),
                                 [](const Pair& p, const Pair& q) { return p.image < q.image; });
        }
    }

    /// Another pair along axis a, for nodes that are not in the grid.
    void add_pair(int a, std::ptrdiff_t ghost, std::ptrdiff_t image) { pairs_[a].push_back({ghost, image}); }

    /// Adds lanes [first, last) of the margin to the nodes that it repeats.
    void add(Lanes* nodes, int first, int last) const
    {
        for (const auto& axis : pairs_)
            for_each(axis, [=](const Pair& p) {
                for (int k = first; k < last; ++k) nodes[p.image][k] += nodes[p.ghost][k];
            });
    }

    /// Sets lanes [first, last) of the margin to zero, before what is added there once more.
    void clear(Lanes* nodes, int first, int last) const
    {
        for (const auto& axis : pairs_)
            for_each(axis, [=](const Pair& p) {
                for (int k = first; k < last; ++k) nodes[p.ghost][k] = 0.0;
            });
    }

    /// Copies nodes to the margin that repeats them. It takes the axes in the reverse order of `add`, so that corners are right.
    void copy(Lanes* nodes) const
    {
        for (int a = D - 1; a >= 0; --a) for_each(pairs_[a], [=](const Pair& p) { nodes[p.ghost] = nodes[p.image]; });
    }

    /// The same for records of `size` Lanes, of nodes or of cells.
    void add_records(Lanes* records, int size) const
    {
        for (const auto& axis : pairs_)
            for_each(axis, [=](const Pair& p) {
                for (int q = 0; q < size; ++q) records[p.image * size + q] += records[p.ghost * size + q];
            });
    }
    void copy_records(Lanes* records, int size) const
    {
        for (int a = D - 1; a >= 0; --a)
            for_each(pairs_[a], [=](const Pair& p) {
                for (int q = 0; q < size; ++q) records[p.ghost * size + q] = records[p.image * size + q];
            });
    }

    /// Sets the margin to zero.
    void clear(Lanes* nodes) const { clear(nodes, 0, NodeLane::end); }

  private:
    struct Pair {
        std::ptrdiff_t ghost, image;
    };

    /// f(pair) for the pairs of an axis in parallel. Pairs of one image are neighbours in the list; one thread takes them in
    /// order, so sums are the same for any number of threads.
    template <class F>
    static void for_each(const std::vector<Pair>& pairs, F&& f)
    {
        const auto n          = static_cast<std::ptrdiff_t>(pairs.size());
        auto has_image_before = [&](std::ptrdiff_t k) { return k > 0 && k < n && pairs[k - 1].image == pairs[k].image; };
        parallel_pieces(n, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            while (begin < end && has_image_before(begin)) ++begin;
            if (begin == end) return;
            while (has_image_before(end)) ++end;
            for (std::ptrdiff_t k = begin; k < end; ++k) f(pairs[k]);
        });
    }

    std::array<std::vector<Pair>, D> pairs_;
};

}  // namespace ordo
