// Sums over particles and nodes. What a tile or a block of nodes holds is summed in its order, and these parts exactly: sums do not
// depend on the number of threads or ranks.
#pragma once

#include "base/exact_sum.hpp"
#include "base/parallel.hpp"
#include "method/state.hpp"

#include <vector>

namespace ordo {

/// The sum of term(tile) over all tiles, which must hold all particles.
template <int n, int D, class Term>
Numbers<n> sum_over_tiles(const State<D>& s, const Term& term)
{
    const Tiles<D>& tiles = s.field.tiles;
    ORDO_EXPECT((tiles.tiles().empty() ? 0 : tiles.tiles().back().end) == s.particles.count);
    std::vector<Numbers<n>> parts(tiles.tiles().size());
    tiles.for_each([&](std::ptrdiff_t k, const Tile& tile) { parts[k] = term(tile); });
    return exact_total<n>(*s.ranks, parts);
}

/// The sum of term(i) over all particles.
template <int n, int D, class Term>
Numbers<n> sum_over_particles(const State<D>& s, const Term& term)
{
    return sum_over_tiles<n>(s, [&](const Tile& tile) {
        Numbers<n> part;
        for (int i = tile.begin; i < tile.end; ++i) part += term(i);
        return part;
    });
}

/// The sum of term(place in a node array) over the nodes of all fields and enriched corners; periodic images are not counted.
template <int n, int D, class Term>
Numbers<n> sum_over_nodes(const State<D>& s, const Term& term)
{
    const auto& blocks = s.field.tiles.blocks();
    std::vector<Numbers<n>> parts(blocks.size() + s.particles.enriched.size());
    s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
        if (!s.field.tiles.counts_here(static_cast<std::size_t>(k))) return;
        s.field.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& at) {
            if (!s.lattice.is_image(at)) parts[k] += term(blocks[k].first_node + s.lattice.offset(at));
        });
    });
    const std::ptrdiff_t first = s.field.tiles.first_node(s.field.tiles.fields());
    parallel_for_each(static_cast<std::ptrdiff_t>(s.particles.enriched.size()),
                      [&](std::ptrdiff_t e) { parts[blocks.size() + e] = term(first + e); });
    return exact_total<n>(*s.ranks, parts);
}

}  // namespace ordo
