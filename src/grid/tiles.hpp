// Tiles of cells in 2^D colours, and the blocks of nodes that the material touches, in each velocity field of the grid.
// Tiles of one colour share no node, so a scatter needs no atomics and sums in one order for any number of threads.
#pragma once

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "base/ranks.hpp"
#include "grid/lattice.hpp"
#include "grid/tile_order.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace ordo {

/// A tile that holds the particles [begin, end).
struct Tile {
    int begin                 = 0;
    int end                   = 0;
    std::ptrdiff_t first_node = 0;  ///< where the records of its velocity field begin
};

/// A block of nodes, by its place among the blocks of the lattice.
template <int D>
struct Block {
    Index<D> at{};
    std::ptrdiff_t first_node = 0;  ///< where the records of its velocity field begin

    bool operator==(const Block&) const = default;
};

/// The tiles and blocks of nodes of the last sort, for checkpoints: particles that have moved since do not determine them.
struct TileRecord {
    std::vector<std::uint64_t> tiles;   ///< numbers of the tiles, ascending
    std::vector<std::int32_t> ends;     ///< of their particles; each begins where the one before ends
    std::vector<std::uint64_t> blocks;  ///< numbers of the blocks, ascending
};

/// The tiles that hold particles, and the blocks of nodes, `block_width` a side, that these may write to. A tile is `width`
/// cells a side, a whole number of blocks; its particles may write up to `halo` cells beyond it. Particles of different velocity
/// fields are in different tiles and write to different nodes: the records of field k are those of the lattice, k times their
/// count further on.
template <int D>
class Tiles {
  public:
    static constexpr int colour_count = 1 << D;
    static constexpr int block_width  = 4;
    /// Tiles that a thread takes at a time: in 1D they are narrow.
    static constexpr std::ptrdiff_t tiles_together = D == 1 ? 64 : 1;
    /// Whether threads pay for so many particles. Below a thousand they gained nothing (2D cpdi1 on 2 cores, 2026-11), and on a busy machine
    /// waiting for a thread can cost more than the step. In 1D a particle costs a fraction of that.
    static constexpr bool are_worth_threads(std::ptrdiff_t particles) { return particles >= (D == 1 ? 8192 : 1024); }

    Tiles() = default;  ///< as before the first sort
    Tiles(const Lattice<D>& lattice, int halo, std::ptrdiff_t particles = 0, int fields = 1)
        : lattice_(lattice), halo_(halo), width_(width_for(halo, lattice.basis.degree, particles)), fields_(fields)
    {
        for (int a = 0; a < D; ++a) {
            count_[a]       = (lattice.nodes[a] + width_ - 1) / width_;
            block_count_[a] = (lattice.nodes[a] + block_width - 1) / block_width;
            cells_per_tile_ *= width_;
        }
    }

    /// The smallest width for which tiles of one colour share no node: width + halo + degree < 2 width - halo, because a cell
    /// has degree + 1 functions, and a stencil of fixed size may write zeros to one node more than its domain reaches. Tiles are
    /// wider, and share fewer nodes, if there are particles for 16 tiles of each colour at 2^D particles a cell.
    static int width_for(int halo, int degree = 1, std::ptrdiff_t particles = 0)
    {
        constexpr int wide        = D == 2 ? 16 : D == 3 ? 8 : block_width;
        constexpr int enough      = 16 * colour_count * power_of(2 * wide, D);
        const int blocks_at_least = (2 * halo + degree + 1 + block_width - 1) / block_width;
        return std::max(blocks_at_least * block_width, particles >= enough ? wide : 0);
    }

    int width() const { return width_; }
    int halo() const { return halo_; }  ///< negative before the first sort
    const std::vector<Tile>& tiles() const { return tiles_; }
    const std::vector<Block<D>>& blocks() const { return blocks_; }
    int fields() const { return fields_; }
    const Index<D>& count() const { return count_; }                               ///< of tiles along each axis, with empty ones
    const std::vector<std::uint64_t>& tile_numbers() const { return tile_keys_; }  ///< ascending
    const std::vector<std::uint64_t>& block_numbers() const { return block_keys_; }  ///< ascending

    /// The number of the tile that a key lies in: that of its place, and so many more for its field.
    std::uint64_t tile_of(std::uint64_t key) const { return key / cells_per_tile_; }
    std::uint64_t number_of_tile(const Index<D>& at, int field) const { return field * total(count_) + flatten(at, count_); }
    Index<D> place_of_tile(std::uint64_t number) const { return unflatten(number, count_); }
    int field_of_tile(std::uint64_t number) const { return static_cast<int>(number / total(count_)); }
    /// The same of blocks.
    Block<D> block_of(std::uint64_t number) const
    {
        return {unflatten(number, block_count_), first_node(static_cast<int>(number / total(block_count_)))};
    }
    std::uint64_t number_of_block(const Block<D>& block) const { return block_key(block.at, field_of(block)); }
    int field_of(const Block<D>& block) const
    {
        return static_cast<int>(block.first_node / static_cast<std::ptrdiff_t>(lattice_.node_count()));
    }
    /// The nodes that particles of a tile may write to until the next sort, with the zeros of stencils of fixed size.
    IndexBox<D> reached_by(const Index<D>& tile) const
    {
        IndexBox<D> r{};
        for (int a = 0; a < D; ++a) {
            r.lo[a] = std::max(tile[a] * width_ - halo_, 0);
            r.hi[a] = std::min((tile[a] + 1) * width_ + halo_ + lattice_.basis.degree + 1, lattice_.nodes[a]);
        }
        return r;
    }
    /// The tiles that may write to nodes of a box.
    IndexBox<D> tiles_around(const IndexBox<D>& nodes) const
    {
        IndexBox<D> r{};
        for (int a = 0; a < D; ++a) {
            r.lo[a] = std::max(nodes.lo[a] - halo_ - lattice_.basis.degree - 1, 0) / width_;
            r.hi[a] = std::min((nodes.hi[a] - 1 + halo_) / width_ + 1, count_[a]);
        }
        return r;
    }

    /// The sort key of a cell: by field, by tile, then by cell within the tile.
    std::uint64_t key(const Index<D>& cell, int field = 0) const
    {
        Index<D> tile{};
        std::uint64_t inner = 0;
        for (int a = D - 1; a >= 0; --a) {
            ORDO_EXPECT(cell[a] >= 0 && cell[a] < lattice_.nodes[a]);
            tile[a] = cell[a] / width_;
            inner   = inner * width_ + cell[a] % width_;
        }
        return (field * total(count_) + flatten(tile, count_)) * cells_per_tile_ + inner;
    }

    /// One more than the largest key.
    std::uint64_t key_end() const { return cells_per_tile_ * total(count_) * fields_; }

    /// Sets up tiles, colours and node blocks for particles in the order of their sorted keys.
    void assign(std::span<const std::uint64_t> sorted_keys)
    {
        clear();
        std::vector<std::uint64_t> touched;
        for (auto begin = sorted_keys.begin(); begin != sorted_keys.end();) {
            const std::uint64_t tile = *begin / cells_per_tile_;
            const auto end           = std::lower_bound(begin, sorted_keys.end(), (tile + 1) * cells_per_tile_);
            add_tile(tile, static_cast<int>(end - sorted_keys.begin()));
            add_blocks(tile, {begin, end}, touched);
            begin = end;
        }
        std::sort(touched.begin(), touched.end());
        touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
        for (int k = 0; k < reach() / block_width; ++k) add_neighbours(touched);
        add_periodic_images(touched);
        set_blocks(std::move(touched));
    }

    TileRecord record() const
    {
        TileRecord r{tile_keys_, {}, block_keys_};
        for (const Tile& tile : tiles_) r.ends.push_back(tile.end);
        return r;
    }
    /// Restores the tiles and blocks of an earlier sort. Returns false and changes nothing if they do not fit this lattice or
    /// the number of particles.
    bool restore(TileRecord record, int particles)
    {
        auto ascends = [](const auto& list) {
            return !list.empty() && std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()) == list.end();
        };
        auto is_within = [&](const std::vector<std::uint64_t>& keys, const Index<D>& count) {
            return ascends(keys) && keys.back() < total(count) * fields_;
        };
        const auto& ends = record.ends;
        if (record.tiles.size() != ends.size() || !is_within(record.tiles, count_) || !is_within(record.blocks, block_count_) ||
            !ascends(ends) || ends.front() < 1 || ends.back() != particles)
            return false;
        clear();
        for (std::size_t k = 0; k < ends.size(); ++k) add_tile(record.tiles[k], ends[k]);
        set_blocks(std::move(record.blocks));
        return true;
    }

    /// Keeps the tiles for which is_kept(number) holds, without the particles of the others, and the blocks of these numbers.
    template <class IsKept>
    void keep(const IsKept& is_kept, std::vector<std::uint64_t> blocks)
    {
        const std::vector<Tile> all                  = std::move(tiles_);
        const std::vector<std::uint64_t> all_numbers = std::move(tile_keys_);
        clear();
        int end = 0;
        for (std::size_t k = 0; k < all.size(); ++k)
            if (is_kept(all_numbers[k])) add_tile(all_numbers[k], end += all[k].end - all[k].begin);
        set_blocks(std::move(blocks));
    }

    /// Leaves each tile the particles for which is_kept(i) holds, which then follow each other. Until the next sort only the order of
    /// particles counts.
    template <class IsKept>
    void keep_particles(const IsKept& is_kept)
    {
        int end = 0;
        for (Tile& tile : tiles_) {
            const int begin = end;
            for (int i = tile.begin; i < tile.end; ++i) end += is_kept(i) ? 1 : 0;
            tile.begin = begin;
            tile.end   = end;
        }
    }

    /// f(tile) for all tiles in parallel, for scatters to these records: tiles that share nodes run one after the other, by colour. Afterwards
    /// the records are sums over all ranks.
    template <class F>
    void for_each_by_colour(std::initializer_list<NodeRecords> to, F&& f) const
    {
        if (!is_shared()) return for_each_by_colour(f);
        order_.run(
            std::span<const NodeRecords>(to.begin(), to.size()), [&](int k) { timed(k, f); }, is_large());
    }
    /// The same for scatters that ranks do not share, one colour after the other.
    template <class F>
    void for_each_by_colour(F&& f) const
    {
        ORDO_EXPECT(!is_shared());
        for (const auto& colour : colours_)
            parallel_for_each(
                std::ssize(colour), [&](std::ptrdiff_t k) { f(tiles_[colour[k]]); }, tiles_together, is_large());
    }

    /// From now on scatters go through `relay`, whose messages are those of grid/rim_plan.hpp: what goes out after which tiles, and what
    /// comes in for which. `counts_elsewhere`: by block, those that count on another rank.
    void share(std::shared_ptr<Relay> relay, const std::vector<std::vector<int>>& out_tiles,
               std::vector<std::vector<int>> in_tiles, std::vector<bool> counts_elsewhere)
    {
        std::vector<int> colours;
        for (const std::uint64_t number : tile_keys_) colours.push_back(colour(unflatten(number, count_)));
        order_            = TileOrder(std::move(relay), colours, neighbours_after(), out_tiles, std::move(in_tiles));
        counts_elsewhere_ = std::move(counts_elsewhere);
        seconds_.assign(tiles_.size(), 0.0);
    }
    bool is_shared() const { return order_.is_set(); }
    /// How long the passes over the particles of tile k have taken since the sort, s, without waits. For ranks only.
    double seconds(std::size_t k) const { return seconds_[k]; }
    /// Adds to that.
    void weigh(std::size_t k, double seconds) const { seconds_[k] += seconds; }

    /// Whether block k is one that sums over nodes count here: several ranks may hold it.
    bool counts_here(std::size_t k) const { return !is_shared() || !counts_elsewhere_[k]; }
    /// The same for the block of a record, which other ranks may hold alone.
    bool counts_record(std::ptrdiff_t record) const
    {
        if (!is_shared()) return true;
        const auto count  = static_cast<std::ptrdiff_t>(lattice_.node_count());
        const auto number = block_key(block_at(lattice_.index(record % count)), record / count);
        const auto at     = std::lower_bound(block_keys_.begin(), block_keys_.end(), number);
        return at != block_keys_.end() && *at == number && counts_here(static_cast<std::size_t>(at - block_keys_.begin()));
    }

    /// f(k, tile) for all tiles in parallel, for gathers.
    template <class F>
    void for_each(F&& f) const
    {
        parallel_for_each(
            std::ssize(tiles_),
            [&](std::ptrdiff_t k) {
                if (is_shared())
                    timed(static_cast<int>(k), [&](const Tile& tile) { f(k, tile); });
                else
                    f(k, tiles_[k]);
            },
            tiles_together, is_large());
    }

    /// The nodes of a block.
    IndexBox<D> nodes_of(const Block<D>& block) const
    {
        IndexBox<D> r{};
        for (int a = 0; a < D; ++a) {
            r.lo[a] = block.at[a] * block_width;
            r.hi[a] = std::min(r.lo[a] + block_width, lattice_.nodes[a]);
        }
        return r;
    }

    /// f(place in the lattice, record) for all nodes of all blocks, one after the other.
    template <class F>
    void for_each_node(F&& f) const
    {
        for (const Block<D>& block : blocks_)
            nodes_of(block).for_each([&](const Index<D>& at) { f(at, block.first_node + lattice_.offset(at)); });
    }

    /// f(k) for the places k of all blocks in blocks(), in parallel.
    template <class F>
    void for_each_block(F&& f) const
    {
        parallel_for_each(std::ssize(blocks_), f, 1024 / power_of(block_width, D), is_large());
    }
    /// f(first node, end) for runs of consecutive nodes that cover all blocks that the material touches, and the extra nodes
    /// behind those of the grid.
    template <class F>
    void for_each_node_run(F&& f) const
    {
        for_each_block_run([&](std::ptrdiff_t, std::ptrdiff_t first, std::ptrdiff_t end) { f(first, end); });
        const std::ptrdiff_t first = first_node(fields_);
        parallel_pieces(extra_nodes_, [&](std::ptrdiff_t begin, std::ptrdiff_t end) { f(first + begin, first + end); });
    }
    /// Sets the number of extra nodes, whose records follow those of the grid.
    void add_nodes(std::size_t count) { extra_nodes_ = static_cast<std::ptrdiff_t>(count); }
    /// f(place in blocks(), first node, end) for the same runs without the extra nodes; the runs of a block one after the other.
    template <class F>
    void for_each_block_run(F&& f) const
    {
        for_each_block([&](std::ptrdiff_t k) {
            IndexBox<D> rows = nodes_of(blocks_[k]);
            const int length = rows.hi[0] - rows.lo[0];
            rows.hi[0]       = rows.lo[0] + 1;
            rows.for_each([&](const Index<D>& at) {
                const std::ptrdiff_t first = blocks_[k].first_node + lattice_.offset(at);
                f(k, first, first + length);
            });
        });
    }

    /// The colour of a tile or block.
    static int colour(const Index<D>& t)
    {
        int c = 0;
        for (int a = 0; a < D; ++a) c |= (t[a] & 1) << a;
        return c;
    }

    /// Whether the node belongs to a block that the material of a field touches; records of other nodes are undefined.
    bool is_active(const Index<D>& node, int field = 0) const
    {
        return std::binary_search(block_keys_.begin(), block_keys_.end(), block_key(block_at(node), field));
    }
    /// Adds to ascending numbers of blocks those of all images of their nodes on periodic axes: those inside the period, which hold the sums, and those in
    /// the margin, which a corner that is put back into the period may read.
    void add_periodic_images(std::vector<std::uint64_t>& blocks) const
    {
        for (int a = 0; a < D; ++a) {
            if (!lattice_.periodic[a]) continue;
            std::vector<std::uint64_t> images;
            for (std::uint64_t key : blocks) {
                Index<D> b                = unflatten(key, block_count_);
                const std::uint64_t field = key / total(block_count_);
                const IndexBox<D> at      = nodes_of({b});
                for (int k = at.lo[a]; k < at.hi[a]; ++k)
                    for (int image = k % lattice_.cells[a]; image < lattice_.nodes[a]; image += lattice_.cells[a]) {
                        b[a] = image / block_width;
                        if (image != k) images.push_back(block_key(b, field));
                    }
            }
            std::sort(images.begin(), images.end());
            images.erase(std::unique(images.begin(), images.end()), images.end());
            add(blocks, images);
        }
    }

    /// Where the records of a field begin.
    std::ptrdiff_t first_node(int field) const { return field * static_cast<std::ptrdiff_t>(lattice_.node_count()); }

  private:
    bool is_large() const { return !tiles_.empty() && are_worth_threads(tiles_.back().end); }

    /// f(tile), and how long it took.
    template <class F>
    void timed(int k, const F& f) const
    {
        const auto begin = std::chrono::steady_clock::now();
        f(tiles_[k]);
        weigh(static_cast<std::size_t>(k), std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    /// [tile]: the tiles of higher colours next to it, which may write to the same nodes.
    std::vector<std::vector<int>> neighbours_after() const
    {
        std::vector<std::vector<int>> r(tiles_.size());
        for (std::size_t k = 0; k < tiles_.size(); ++k) {
            const Index<D> here = unflatten(tile_keys_[k], count_);
            IndexBox<D> around{};
            for (int a = 0; a < D; ++a) {
                around.lo[a] = std::max(here[a] - 1, 0);
                around.hi[a] = std::min(here[a] + 2, count_[a]);
            }
            around.for_each([&](const Index<D>& next) {
                if (colour(next) <= colour(here)) return;
                const std::uint64_t number = number_of_tile(next, field_of_tile(tile_keys_[k]));
                const auto found           = std::lower_bound(tile_keys_.begin(), tile_keys_.end(), number);
                if (found != tile_keys_.end() && *found == number) r[k].push_back(static_cast<int>(found - tile_keys_.begin()));
            });
        }
        return r;
    }

    static Index<D> block_at(Index<D> node)
    {
        for (int a = 0; a < D; ++a) node[a] /= block_width;
        return node;
    }
    static std::uint64_t flatten(const Index<D>& t, const Index<D>& count)
    {
        std::uint64_t k = 0;
        for (int a = D - 1; a >= 0; --a) k = k * count[a] + t[a];
        return k;
    }
    static std::uint64_t total(const Index<D>& count) { return flatten(count - Index<D>::filled(1), count) + 1; }
    /// The key of a block in a field.
    std::uint64_t block_key(const Index<D>& block, std::uint64_t field) const
    {
        return field * total(block_count_) + flatten(block, block_count_);
    }
    /// The place that a number stands for, without the field.
    static Index<D> unflatten(std::uint64_t k, const Index<D>& count)
    {
        Index<D> t{};
        for (int a = 0; a < D; ++a) {
            t[a] = static_cast<int>(k % count[a]);
            k /= count[a];
        }
        return t;
    }
    void clear()
    {
        tiles_.clear();
        tile_keys_.clear();
        for (auto& c : colours_) c.clear();
    }
    /// Adds the next tile; its particles begin where those of the previous tile end.
    void add_tile(std::uint64_t key, int end)
    {
        colours_[colour(unflatten(key, count_))].push_back(static_cast<int>(tiles_.size()));
        tiles_.push_back({tiles_.empty() ? 0 : tiles_.back().end, end, first_node(static_cast<int>(key / total(count_)))});
        tile_keys_.push_back(key);
    }
    void set_blocks(std::vector<std::uint64_t> keys)
    {
        blocks_.clear();
        for (const std::uint64_t b : keys) blocks_.push_back(block_of(b));
        block_keys_ = std::move(keys);
    }
    /// How many nodes below its cell a particle may write to until the next sort, and one more; `degree` more above the cell.
    int reach() const { return halo_ + 1; }

    /// Adds the blocks that particles in the cells of these keys, all of one tile, may write to. Whole blocks within `reach` are
    /// left to add_neighbours, which adds them for all tiles.
    void add_blocks(std::uint64_t tile_key, std::span<const std::uint64_t> keys, std::vector<std::uint64_t>& blocks) const
    {
        const Index<D> tile       = unflatten(tile_key, count_);
        const std::uint64_t field = tile_key / total(count_);
        const int below = reach() % block_width, above = below + lattice_.basis.degree;
        IndexBox<D> around{};
        Index<D> size{};
        for (int a = 0; a < D; ++a) {
            around.lo[a] = std::max(tile[a] * width_ - below, 0) / block_width;
            around.hi[a] = std::min(((tile[a] + 1) * width_ - 1 + above) / block_width + 1, block_count_[a]);
            size[a]      = around.hi[a] - around.lo[a];
        }
        std::vector<char> is_touched(flatten(size - Index<D>::filled(1), size) + 1, 0);
        std::uint64_t last = key_end();
        for (const std::uint64_t key : keys) {
            if (key == last) continue;
            last                = key;
            std::uint64_t inner = key % cells_per_tile_;
            IndexBox<D> box{};
            for (int a = 0; a < D; ++a, inner /= width_) {
                const int cell = tile[a] * width_ + static_cast<int>(inner % width_);
                box.lo[a]      = std::max(cell - below, 0) / block_width;
                box.hi[a]      = std::min((cell + above) / block_width + 1, block_count_[a]);
            }
            box.for_each([&](const Index<D>& b) { is_touched[flatten(b - around.lo, size)] = 1; });
        }
        around.for_each([&](const Index<D>& b) {
            if (is_touched[flatten(b - around.lo, size)]) blocks.push_back(block_key(b, field));
        });
    }
    /// Adds `more` to the sorted keys of blocks, without duplicates.
    static void add(std::vector<std::uint64_t>& blocks, const std::vector<std::uint64_t>& more)
    {
        std::vector<std::uint64_t> all;
        std::set_union(blocks.begin(), blocks.end(), more.begin(), more.end(), std::back_inserter(all));
        blocks = std::move(all);
    }
    /// Adds the neighbours of all blocks, axis by axis, so diagonal ones too. Shifted keys are still sorted.
    void add_neighbours(std::vector<std::uint64_t>& blocks) const
    {
        std::uint64_t stride = 1;
        for (int a = 0; a < D; ++a) {
            std::vector<std::uint64_t> below, above;
            for (std::uint64_t b : blocks) {
                const std::uint64_t at = b / stride % block_count_[a];
                if (at > 0) below.push_back(b - stride);
                if (at + 1 < static_cast<std::uint64_t>(block_count_[a])) above.push_back(b + stride);
            }
            add(blocks, below);
            add(blocks, above);
            stride *= block_count_[a];
        }
    }

    Lattice<D> lattice_{};
    int halo_                     = -1;
    int width_                    = block_width;
    int fields_                   = 1;
    std::uint64_t cells_per_tile_ = 1;
    Index<D> count_{}, block_count_{};  ///< tiles and blocks along each axis
    std::vector<Tile> tiles_;
    std::vector<std::uint64_t> tile_keys_;  ///< their numbers
    std::array<std::vector<int>, colour_count> colours_;
    std::vector<Block<D>> blocks_;
    std::vector<std::uint64_t> block_keys_;  ///< of blocks_, sorted
    std::ptrdiff_t extra_nodes_ = 0;
    // With several ranks:
    TileOrder order_;
    std::vector<bool> counts_elsewhere_;   ///< by block
    mutable std::vector<double> seconds_;  ///< by tile; each is written by the thread that has the tile
};

}  // namespace ordo
