#include "method/sharing.hpp"

#include "base/error.hpp"
#include "grid/hilbert.hpp"
#include "method/layout.hpp"
#include "particles/travel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

namespace ordo {

template <int D>
std::string alone_because(const Model<D>& model)
{
    const MethodSpec& m = model.method;
    const struct {
        bool holds;
        const char* what;
    } reasons[] = {
        {is_spline_fit(m), "spline fits solve for all nodes at once"},
        {m.mass == MassMatrix::consistent, "the consistent mass matrix couples all nodes; use mass = \"lumped\""},
        {has_enrichment(m), "enriched corners are not shared; use enrichment = \"none\""},
    };
    for (const auto& one : reasons)
        if (one.holds) return one.what;
    return {};
}

template <int D>
void require_shareable(const Model<D>& model)
{
    if (const std::string reason = alone_because(model); !reason.empty())
        throw InputError(
            fmt::format("this case runs in one process: {}; or start it without mpiexec or srun, with --threads", reason));
}

namespace {

/// A tile by its number, and how many particles it holds.
struct Filled {
    std::uint64_t tile;
    std::int64_t particles;
};

template <int D>
std::vector<Filled> filled_tiles(const Tiles<D>& tiles)
{
    std::vector<Filled> r;
    for (std::size_t k = 0; k < tiles.tiles().size(); ++k)
        r.push_back({tiles.tile_numbers()[k], tiles.tiles()[k].end - tiles.tiles()[k].begin});
    return r;
}

/// Divides tiles along Hilbert's curve.
template <int D>
TileOwners divide(const Ranks& ranks, const Tiles<D>& tiles, const std::vector<Filled>& filled)
{
    struct OnCurve {
        std::uint64_t place, tile;
        std::int64_t weight;
    };
    const int bits = bits_of(tiles.count());
    std::vector<OnCurve> curve;
    for (const auto& [tile, weight] : filled) curve.push_back({hilbert_number(tiles.place_of_tile(tile), bits), tile, weight});
    std::sort(curve.begin(), curve.end(),
              [](const OnCurve& a, const OnCurve& b) { return std::pair(a.place, a.tile) < std::pair(b.place, b.tile); });
    std::vector<std::int64_t> along;
    for (const OnCurve& one : curve) along.push_back(one.weight);
    const std::vector<int> to = ranks.divide(along);
    std::vector<std::pair<std::uint64_t, int>> owners;
    for (std::size_t k = 0; k < curve.size(); ++k) owners.emplace_back(curve[k].tile, to[k]);
    return TileOwners(std::move(owners));
}

/// Where the particles are among those of all ranks: in their tiles; before the first sort, in the order of their numbers.
template <int D>
std::vector<OldPlace> places_of(const Particles<D>& p, const Tiles<D>& tiles)
{
    std::vector<OldPlace> places(static_cast<std::size_t>(p.count));
    if (tiles.halo() < 0)
        for (int i = 0; i < p.count; ++i) places[static_cast<std::size_t>(i)] = {0, static_cast<std::uint64_t>(p.id[i])};
    for (std::size_t k = 0; k < tiles.tiles().size(); ++k) {
        const Tile& tile = tiles.tiles()[k];
        for (int i = tile.begin; i < tile.end; ++i)
            places[static_cast<std::size_t>(i)] = {tiles.tile_numbers()[k], static_cast<std::uint64_t>(i - tile.begin)};
    }
    return places;
}

/// How far beyond the nodes that particles of a tile write to their rank needs others, cells: fits in cells take sums at a cell and its
/// neighbours, gradients at centres those of their neighbours' nodes, ddmpm those of the cell.
int ring_of(const MethodSpec& m)
{
    const bool fits_cells = m.quadrature != Quadrature::particle || m.gradient == Gradient::adjoint || has_tls_velocity(m);
    return fits_cells ? 8 : m.basis == Basis::ddmpm ? 2 : 0;
}

template <int D>
void share(Ranks& ranks, const Lattice<D>& lattice, const BlockHolders<D>& holders, Tiles<D>& tiles)
{
    RimPlan plan = plan_rims(tiles, lattice, holders, ranks.index());
    tiles.share(ranks.relay(std::move(plan.rounds)), plan.is_rim, std::move(plan.counts_elsewhere));
}

}  // namespace

template <int D>
void distribute(const Model<D>& model, State<D>& s, Ranks& ranks)
{
    if (ranks.is_alone()) return;
    require_shareable(model);
    const Tiles<D>& whole   = s.field.tiles;
    const TileOwners owners = divide(ranks, whole, filled_tiles(whole));
    const BlockHolders<D> holders(whole, owners, ring_of(model.method));
    auto is_mine = [&](std::uint64_t tile) { return owners.rank_of(tile) == ranks.index(); };
    std::vector<std::uint64_t> own =
        std::move(blocks_to_tell(whole, holders, ranks.count(), 0)[static_cast<std::size_t>(ranks.index())]);

    const std::vector<OldPlace> places = places_of(s.particles, whole);
    merge(s.particles, field_groups(model), places, [&](int i) { return !is_mine(places[static_cast<std::size_t>(i)].tile); },
          {});
    Tiles<D> tiles = whole;
    tiles.keep(is_mine, std::move(own));
    share(ranks, s.lattice, holders, tiles);
    s.ranks = &ranks;
    arrange_nodes(model, s, s.lattice, std::move(tiles));
}

template <int D>
TileOwners migrate(const Model<D>& model, State<D>& s, const Tiles<D>& tiles, const std::function<std::uint64_t(int)>& tile_of)
{
    Ranks& ranks    = *s.ranks;
    Particles<D>& p = s.particles;
    std::vector<std::uint64_t> tile(static_cast<std::size_t>(p.count));
    std::map<std::uint64_t, std::int64_t> particles_of;
    auto last = particles_of.end();  // most particles are still in the tile of the one before
    for (int i = 0; i < p.count; ++i) {
        const std::uint64_t number = tile[static_cast<std::size_t>(i)] = tile_of(i);
        if (last == particles_of.end() || last->first != number) last = particles_of.try_emplace(number, 0).first;
        ++last->second;
    }
    auto filled = [&] {
        std::vector<Filled> r;
        for (const auto& [number, particles] : particles_of) r.push_back({number, particles});
        return r;
    };
    const std::vector<Filled> mine = filled();
    particles_of.clear();
    for (const std::vector<Filled>& of_rank : gather_all(ranks, mine))
        for (const auto& [number, particles] : of_rank) particles_of[number] += particles;
    TileOwners owners = divide(ranks, tiles, filled());

    const FieldGroups groups           = field_groups(model);
    const std::vector<OldPlace> places = places_of(p, s.field.tiles);
    std::vector<Bytes> out(static_cast<std::size_t>(ranks.count()));
    std::vector<std::size_t> counts(out.size(), 0);
    std::vector<int> to(static_cast<std::size_t>(p.count));
    for (std::size_t k = 0; k < to.size(); ++k) {
        to[k] = k > 0 && tile[k] == tile[k - 1] ? to[k - 1] : owners.rank_of(tile[k]);
        if (to[k] != ranks.index()) ++counts[static_cast<std::size_t>(to[k])];
    }
    for (std::size_t r = 0; r < out.size(); ++r) out[r].reserve(counts[r] * packed_size(p, groups));
    for (int i = 0; i < p.count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (to[k] != ranks.index()) pack(p, groups, i, places[k], out[static_cast<std::size_t>(to[k])]);
    }
    merge(
        p, groups, places, [&](int i) { return to[static_cast<std::size_t>(i)] != ranks.index(); },
        ranks.exchange(std::move(out)));
    return owners;
}

template <int D>
void join_rims(Ranks& ranks, const MethodSpec& method, const Lattice<D>& lattice, const TileOwners& owners, Tiles<D>& tiles)
{
    const BlockHolders<D> holders(tiles, owners, ring_of(method));
    std::vector<Bytes> out;
    for (const std::vector<std::uint64_t>& blocks : blocks_to_tell(tiles, holders, ranks.count(), ranks.index()))
        put_all(out.emplace_back(), std::span<const std::uint64_t>(blocks));
    std::vector<std::uint64_t> held;
    for (const Bytes& told : ranks.exchange(std::move(out))) {
        const std::vector<std::uint64_t> blocks = values_of<std::uint64_t>(told);
        held.insert(held.end(), blocks.begin(), blocks.end());
    }
    std::sort(held.begin(), held.end());
    held.erase(std::unique(held.begin(), held.end()), held.end());
    tiles.keep([](std::uint64_t) { return true; }, std::move(held));
    share(ranks, lattice, holders, tiles);
}

namespace {

/// Particles of a tile among those of a rank.
struct Piece {
    std::uint64_t tile;
    int rank;
    std::int64_t begin, count;
};

/// The tiles of all ranks, ascending.
template <int D>
std::vector<Piece> all_tiles(const State<D>& s)
{
    std::vector<Piece> r;
    const auto of_ranks = gather_all(*s.ranks, filled_tiles(s.field.tiles));
    for (std::size_t rank = 0; rank < of_ranks.size(); ++rank) {
        std::int64_t begin = 0;
        for (const Filled& one : of_ranks[rank]) {
            r.push_back({one.tile, static_cast<int>(rank), begin, one.particles});
            begin += one.particles;
        }
    }
    std::sort(r.begin(), r.end(), [](const Piece& a, const Piece& b) { return a.tile < b.tile; });
    return r;
}

template <int D>
Tiles<D> gathered_tiles(const State<D>& s, const std::vector<Piece>& pieces)
{
    TileRecord record;
    for (const auto& of_rank : gather_all(*s.ranks, s.field.tiles.block_numbers()))
        record.blocks.insert(record.blocks.end(), of_rank.begin(), of_rank.end());
    std::sort(record.blocks.begin(), record.blocks.end());
    record.blocks.erase(std::unique(record.blocks.begin(), record.blocks.end()), record.blocks.end());
    std::int32_t end = 0;
    for (const Piece& one : pieces) {
        record.tiles.push_back(one.tile);
        record.ends.push_back(end += static_cast<std::int32_t>(one.count));
    }
    Tiles<D> tiles(s.lattice, s.field.tiles.halo(), end, s.field.tiles.fields());
    tiles.restore(std::move(record), end);
    return tiles;
}

/// Puts the nodes of other ranks in their places on the first, where nothing else reads them.
template <int D>
void gather_nodes(State<D>& s, const std::function<bool(const IndexBox<D>&)>& is_wanted)
{
    Ranks& ranks          = *s.ranks;
    const Tiles<D>& tiles = s.field.tiles;
    Lanes* nodes          = s.field.nodes.data();
    std::vector<Bytes> out(static_cast<std::size_t>(ranks.count()));
    for (std::size_t k = 0; k < tiles.blocks().size() && ranks.index() != 0; ++k) {
        const Block<D>& block = tiles.blocks()[k];
        if (!tiles.counts_here(k) || !is_wanted(tiles.nodes_of(block))) continue;
        put(out[0], tiles.block_numbers()[k]);
        tiles.nodes_of(block).for_each([&](const Index<D>& at) { put(out[0], nodes[block.first_node + s.lattice.offset(at)]); });
    }
    for (const Bytes& from : ranks.exchange(std::move(out)))
        for (const unsigned char* at = from.data(); at != from.data() + from.size();) {
            std::uint64_t number = 0;
            std::memcpy(&number, at, sizeof(number));
            at += sizeof(number);
            const Block<D> block = tiles.block_of(number);
            tiles.nodes_of(block).for_each([&](const Index<D>& node) {
                std::memcpy(static_cast<void*>(&nodes[block.first_node + s.lattice.offset(node)]), at, sizeof(Lanes));
                at += sizeof(Lanes);
            });
        }
}

}  // namespace

template <int D>
JoinedRows joined_particles(const State<D>& s)
{
    if (s.ranks->is_alone()) return JoinedRows(s.particles.count);
    std::vector<std::int64_t> places;
    std::int64_t count = 0;
    for (const Piece& one : all_tiles(s)) {
        for (std::int64_t k = 0; one.rank == s.ranks->index() && k < one.count; ++k) places.push_back(count + k);
        count += one.count;
    }
    return {*s.ranks, std::move(places), count};
}

template <int D>
JoinedRows joined_corners(const State<D>& s)
{
    const Particles<D>& p = s.particles;
    const auto count      = static_cast<std::int64_t>(p.corner.size());
    if (s.ranks->is_alone()) return JoinedRows(count);
    std::vector<bool> is_own(p.corner.size(), false);
    for (const CornerIds<D>& cell : p.cell)
        for (int c = 0; c < cell.count(); ++c) is_own[static_cast<std::size_t>(cell[c])] = true;
    std::vector<std::int64_t> places;
    for (std::size_t c = 0; c < is_own.size(); ++c)
        if (is_own[c]) places.push_back(static_cast<std::int64_t>(c));
    return {*s.ranks, std::move(places), count};
}

template <int D>
Gathered<D>::Gathered(State<D>& s, const std::function<bool(const IndexBox<D>&)>& is_wanted) : s_(s)
{
    if (s.ranks->is_alone()) return;
    tiles_ = gathered_tiles(s, all_tiles(s));
    if (is_wanted) gather_nodes(s, is_wanted);
    is_swapped_ = s.ranks->index() == 0;
    if (is_swapped_) std::swap(s_.field.tiles, tiles_);
}

template <int D>
Gathered<D>::~Gathered()
{
    if (is_swapped_) std::swap(s_.field.tiles, tiles_);
}

#define ORDO_SHARING(D)                                                                                                 \
    template std::string alone_because(const Model<D>&);                                                                \
    template void require_shareable(const Model<D>&);                                                                   \
    template void distribute(const Model<D>&, State<D>&, Ranks&);                                                       \
    template TileOwners migrate(const Model<D>&, State<D>&, const Tiles<D>&, const std::function<std::uint64_t(int)>&); \
    template void join_rims(Ranks&, const MethodSpec&, const Lattice<D>&, const TileOwners&, Tiles<D>&);                \
    template JoinedRows joined_particles(const State<D>&);                                                              \
    template JoinedRows joined_corners(const State<D>&);                                                                \
    template class Gathered<D>;
ORDO_SHARING(1)
ORDO_SHARING(2)
ORDO_SHARING(3)
#undef ORDO_SHARING

}  // namespace ordo
