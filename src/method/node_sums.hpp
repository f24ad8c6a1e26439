// Sums over nodes, each counted once. They do not depend on the number of threads.
#pragma once

#include "base/parallel.hpp"
#include "method/state.hpp"

#include <vector>

namespace ordo {

/// The sum of term(place in a node array) over the nodes of all fields and enriched corners; periodic images are not counted. Sums
/// add up with +=.
template <int D, class Sum, class Term>
Sum sum_over_nodes(const State<D>& s, const Sum& zero, const Term& term)
{
    const auto& blocks = s.field.tiles.blocks();
    std::vector<Sum> partial(blocks.size(), zero);
    s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
        s.field.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& at) {
            if (!s.lattice.is_image(at)) partial[k] += term(blocks[k].first_node + s.lattice.offset(at));
        });
    });
    const std::ptrdiff_t first = s.field.tiles.first_node(s.field.tiles.fields());
    Sum sum                    = parallel_reduce(
                           static_cast<std::ptrdiff_t>(s.particles.enriched.size()), zero, [&](std::ptrdiff_t e) { return term(first + e); },
                           [](Sum& total, const Sum& one) { total += one; });
    for (const Sum& one : partial) sum += one;
    return sum;
}

}  // namespace ordo
