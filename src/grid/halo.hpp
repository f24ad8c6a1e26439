// Where nodes repeat each other: on a periodic axis today, between ranks later. The step calls `add` after each scatter
// and `copy` after each change of node values; both do nothing on a grid without images.
#pragma once

#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <array>
#include <vector>

namespace ordo {

/// The pairs (node of the margin, node it repeats) of the blocks that the material touches.
template <int D>
class Halo {
  public:
    Halo() = default;
    Halo(const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        for (int a = 0; a < D; ++a) {
            if (!lattice.periodic[a]) continue;
            for (const Index<D>& block : tiles.blocks())
                tiles.nodes_of(block).for_each([&](const Index<D>& k) {
                    Index<D> image = k;
                    image[a]       = lattice.periodic_image(a, k[a]);
                    if (image[a] != k[a]) pairs_[a].push_back({lattice.offset(k), lattice.offset(image)});
                });
        }
    }

    /// Another pair along axis a, of nodes that are not of the grid.
    void add_pair(int a, std::ptrdiff_t ghost, std::ptrdiff_t image) { pairs_[a].push_back({ghost, image}); }

    /// Adds lanes [first, last) of the margin to the nodes they repeat.
    void add(Lanes* nodes, int first, int last) const
    {
        for (const auto& axis : pairs_)
            for (const Pair& p : axis)
                for (int k = first; k < last; ++k) nodes[p.image][k] += nodes[p.ghost][k];
    }

    /// Copies nodes to the margin that repeats them. Axes in the reverse order of `add`, so that corners come right.
    void copy(Lanes* nodes) const
    {
        for (int a = D - 1; a >= 0; --a)
            for (const Pair& p : pairs_[a]) nodes[p.ghost] = nodes[p.image];
    }

    /// The same for records of `size` Lanes, of nodes or of cells.
    void add_records(Lanes* records, int size) const
    {
        for (const auto& axis : pairs_)
            for (const Pair& p : axis)
                for (int q = 0; q < size; ++q) records[p.image * size + q] += records[p.ghost * size + q];
    }
    void copy_records(Lanes* records, int size) const
    {
        for (int a = D - 1; a >= 0; --a)
            for (const Pair& p : pairs_[a])
                for (int q = 0; q < size; ++q) records[p.ghost * size + q] = records[p.image * size + q];
    }

    /// Sets the margin to zero.
    void clear(Lanes* nodes) const
    {
        for (const auto& axis : pairs_)
            for (const Pair& p : axis) nodes[p.ghost] = Lanes{};
    }

  private:
    struct Pair {
        std::ptrdiff_t ghost, image;
    };
    std::array<std::vector<Pair>, D> pairs_;
};

}  // namespace ordo
