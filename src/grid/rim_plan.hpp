// Which records of nodes ranks hand on in a scatter, and what waits for them.
//
// The value of a node is a sum that begins at 0 and takes tiles by colour. Where the next tile that may write to the node belongs to
// another rank, the record goes there: before the colour of that tile, so the sum is the one that a single process finds, bit by bit.
// After the last colour the sum goes to the ranks that need it. A rank needs a block if one of its tiles may write to it, or reads nodes near it;
// it holds blocks that it needs and those with periodic images of their nodes. Where nodes have images, or are read from beyond the reach of
// tiles, it needs all nodes of a block that it holds; else those that its tiles may write to, and others have no mass there. The rank where
// sums over nodes count a block has all of it. Whatever is done to records after the scatter is done by each rank that has them.
#pragma once

#include "grid/tiles.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace ordo {

/// The tiles of all ranks that hold particles, and whose they are.
class TileOwners {
  public:
    TileOwners() = default;
    /// @param owners pairs of a tile's number and its rank, in any order
    explicit TileOwners(std::vector<std::pair<std::uint64_t, int>> owners) : owners_(std::move(owners))
    {
        std::sort(owners_.begin(), owners_.end());
    }

    /// The rank of a tile; -1 if it holds no particles.
    int rank_of(std::uint64_t tile) const
    {
        const auto at = std::lower_bound(owners_.begin(), owners_.end(), std::pair(tile, 0));
        return at != owners_.end() && at->first == tile ? at->second : -1;
    }

  private:
    std::vector<std::pair<std::uint64_t, int>> owners_;  ///< ascending
};

/// A tile that may write to a block.
template <int D>
struct TileWriter {
    std::uint64_t tile;
    int rank, colour;
    IndexBox<D> nodes;
};

/// Which ranks need a block, and which hold it so that all records that a rank needs are right on it.
template <int D>
class BlockHolders {
  public:
    /// @param ring cells beyond those that a tile may write to, in which its rank needs all nodes
    BlockHolders(const Tiles<D>& tiles, const TileOwners& owners, int ring) : tiles_(tiles), owners_(owners), ring_(ring) {}

    /// The tiles that may write to nodes of a block, by colour.
    std::vector<TileWriter<D>> writers(const Block<D>& block) const
    {
        std::vector<TileWriter<D>> r;
        tiles_.tiles_around(tiles_.nodes_of(block)).for_each([&](const Index<D>& at) {
            const std::uint64_t tile = tiles_.number_of_tile(at, tiles_.field_of(block));
            if (const int rank = owners_.rank_of(tile); rank >= 0)
                r.push_back({tile, rank, Tiles<D>::colour(at), tiles_.reached_by(at)});
        });
        std::stable_sort(r.begin(), r.end(), [](const auto& a, const auto& b) { return a.colour < b.colour; });
        return r;
    }
    /// The ranks, ascending, with a tile that writes to the block or within the ring. If no tile does, but to a block of periodic images
    /// of its nodes, the first of those ranks.
    std::vector<int> needing(const Block<D>& block) const
    {
        std::vector<int> r = near(block);
        if (!r.empty()) return r;
        for (const Block<D>& image : images(block)) add(r, near(image));
        if (!r.empty()) r.erase(r.begin() + 1, r.end());
        return r;
    }
    /// The rank where sums over nodes count the block, which therefore needs all of it: the one whose tiles reach most of its nodes.
    int counting(const Block<D>& block, const std::vector<TileWriter<D>>& writers) const
    {
        if (writers.empty()) return needing(block).front();
        const IndexBox<D> nodes = tiles_.nodes_of(block);
        std::map<int, std::ptrdiff_t> reached;
        for (const TileWriter<D>& one : writers) {
            std::ptrdiff_t count = 1;
            for (int a = 0; a < D; ++a)
                count *= std::max(std::min(nodes.hi[a], one.nodes.hi[a]) - std::max(nodes.lo[a], one.nodes.lo[a]), 0);
            reached[one.rank] += count;
        }
        return std::max_element(reached.begin(), reached.end(), [](const auto& a, const auto& b) { return a.second < b.second; })
            ->first;
    }
    /// Whether ranks that hold the block need all of its nodes, not only those that their tiles may write to.
    bool is_needed_whole(const Block<D>& block) const { return ring_ > 0 || !images(block).empty(); }
    /// The ranks that need the block or one with periodic images of its nodes: sums over images then find all of them.
    std::vector<int> holding(const Block<D>& block) const
    {
        std::vector<int> r = needing(block);
        for (const Block<D>& image : images(block)) add(r, needing(image));
        return r;
    }

  private:
    static void sort_once(std::vector<int>& r)
    {
        std::sort(r.begin(), r.end());
        r.erase(std::unique(r.begin(), r.end()), r.end());
    }
    static void add(std::vector<int>& all, const std::vector<int>& more)
    {
        all.insert(all.end(), more.begin(), more.end());
        sort_once(all);
    }
    std::vector<int> near(const Block<D>& block) const
    {
        IndexBox<D> nodes = tiles_.nodes_of(block);
        for (int a = 0; a < D; ++a) {
            nodes.lo[a] -= ring_;
            nodes.hi[a] += ring_;
        }
        std::vector<int> r;
        tiles_.tiles_around(nodes).for_each([&](const Index<D>& at) {
            if (const int rank = owners_.rank_of(tiles_.number_of_tile(at, tiles_.field_of(block))); rank >= 0) r.push_back(rank);
        });
        sort_once(r);
        return r;
    }
    /// The other blocks with nodes that repeat nodes of this one.
    std::vector<Block<D>> images(const Block<D>& block) const
    {
        std::vector<std::uint64_t> all{tiles_.number_of_block(block)};
        tiles_.add_periodic_images(all);
        std::vector<Block<D>> r;
        for (const std::uint64_t number : all)
            if (const Block<D> one = tiles_.block_of(number); !(one == block)) r.push_back(one);
        return r;
    }

    const Tiles<D>& tiles_;
    const TileOwners& owners_;
    int ring_;
};

/// The numbers of the blocks that each rank should hold because the particles of this one, `index`, touch them: blocks that nobody needs
/// stay here.
template <int D>
std::vector<std::vector<std::uint64_t>> blocks_to_tell(const Tiles<D>& tiles, const BlockHolders<D>& holders, int count,
                                                       int index)
{
    std::vector<std::vector<std::uint64_t>> r(static_cast<std::size_t>(count));
    for (const std::uint64_t number : tiles.block_numbers()) {
        std::vector<int> ranks = holders.holding(tiles.block_of(number));
        if (ranks.empty()) ranks = {index};
        for (const int rank : ranks) r[static_cast<std::size_t>(rank)].push_back(number);
    }
    return r;
}

/// What a rank does with the blocks that others hold too. The tag of a message is the colour of the tiles that add to its records next, or
/// the number of colours if they are sums.
struct RimPlan {
    std::vector<RankMessage> out, in;
    std::vector<std::vector<int>> out_tiles;  ///< [message]: tiles of this rank that write to its records before it goes
    std::vector<std::vector<int>> in_tiles;   ///< [message]: those that add to them when it has come
    std::vector<bool> counts_elsewhere;       ///< by block: sums over nodes count it on another rank
};

/// The plan of rank `index`, whose tiles these are with all blocks that it holds.
template <int D>
RimPlan plan_rims(const Tiles<D>& tiles, const Lattice<D>& lattice, const BlockHolders<D>& holders, int index)
{
    constexpr int last  = Tiles<D>::colour_count;
    const auto& numbers = tiles.tile_numbers();
    auto local          = [&](const TileWriter<D>& one) {
        return static_cast<int>(std::lower_bound(numbers.begin(), numbers.end(), one.tile) - numbers.begin());
    };
    struct Message {
        std::vector<std::ptrdiff_t> nodes;
        std::vector<int> tiles;
    };
    std::map<std::pair<int, int>, Message> out, in;  // by rank and tag
    auto add = [&](Message& to, std::ptrdiff_t node, const TileWriter<D>* writer) {
        to.nodes.push_back(node);
        if (!writer) return;
        if (const int tile = local(*writer); to.tiles.empty() || to.tiles.back() != tile) to.tiles.push_back(tile);
    };
    RimPlan plan;
    plan.counts_elsewhere.assign(tiles.blocks().size(), false);
    for (std::size_t k = 0; k < tiles.blocks().size(); ++k) {
        const Block<D>& block        = tiles.blocks()[k];
        const std::vector<int> ranks = holders.holding(block);
        if (ranks.size() < 2) continue;
        const std::vector<TileWriter<D>> writers = holders.writers(block);
        const int counting                       = holders.counting(block, writers);
        const bool is_whole                      = holders.is_needed_whole(block);
        plan.counts_elsewhere[k]                 = counting != index;
        tiles.nodes_of(block).for_each([&](const Index<D>& at) {
            const std::ptrdiff_t node   = block.first_node + lattice.offset(at);
            const TileWriter<D>* before = nullptr;
            for (const auto& one : writers) {
                if (!one.nodes.contains(at)) continue;
                if (before && before->rank != one.rank) {
                    if (before->rank == index) add(out[{one.rank, one.colour}], node, before);
                    if (one.rank == index) add(in[{before->rank, one.colour}], node, &one);
                }
                before = &one;
            }
            if (!before) return;  // zero on all ranks
            auto needs = [&](int rank) {
                return is_whole || rank == counting || std::any_of(writers.begin(), writers.end(), [&](const TileWriter<D>& one) {
                           return one.rank == rank && one.nodes.contains(at);
                       });
            };
            for (const int rank : ranks) {
                if (rank == before->rank || !needs(rank)) continue;
                if (before->rank == index) add(out[{rank, last}], node, before);
                if (rank == index) add(in[{before->rank, last}], node, nullptr);
            }
        });
    }
    auto list = [](std::map<std::pair<int, int>, Message>& from, std::vector<RankMessage>& messages,
                   std::vector<std::vector<int>>& its_tiles) {
        for (auto& [key, message] : from) {
            std::sort(message.tiles.begin(), message.tiles.end());
            message.tiles.erase(std::unique(message.tiles.begin(), message.tiles.end()), message.tiles.end());
            messages.push_back({key.first, key.second, std::move(message.nodes)});
            its_tiles.push_back(std::move(message.tiles));
        }
    };
    list(out, plan.out, plan.out_tiles);
    list(in, plan.in, plan.in_tiles);
    return plan;
}

}  // namespace ordo
