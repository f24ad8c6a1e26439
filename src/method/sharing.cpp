#include "method/sharing.hpp"

#include "base/error.hpp"
#include "grid/hilbert.hpp"
#include "method/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
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
        {is_implicit(m), "implicit steps solve for all nodes at once; use scheme = \"usl\" or \"musl\""},
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

constexpr double kPicosecond = 1e-12;

/// A tile by its number, how many particles it holds, and how long these have taken since the last sort, ps.
struct Filled {
    std::uint64_t tile;
    std::int64_t particles, time;
};

template <int D>
std::vector<Filled> filled_tiles(const Tiles<D>& tiles)
{
    std::vector<Filled> r;
    for (std::size_t k = 0; k < tiles.tiles().size(); ++k)
        r.push_back({tiles.tile_numbers()[k], tiles.tiles()[k].end - tiles.tiles()[k].begin, 0});
    return r;
}

/// Divides tiles along Hilbert's curve: by their times if they are known of all, else by their particles. Times differ from run to run,
/// but results do not depend on whose a tile is. Cuts that still divide well stay.
template <int D>
TileOwners divide(const Ranks& ranks, const Tiles<D>& tiles, const std::vector<Filled>& filled, bool has_times, CurveCuts& cuts)
{
    struct OnCurve {
        std::uint64_t place, tile;
        std::int64_t weight;
    };
    const int bits = bits_of(tiles.count());
    std::vector<OnCurve> curve;
    for (const Filled& one : filled)
        curve.push_back(
            {hilbert_number(tiles.place_of_tile(one.tile), bits), one.tile, has_times ? one.time + 1 : one.particles});
    std::sort(curve.begin(), curve.end(),
              [](const OnCurve& a, const OnCurve& b) { return std::pair(a.place, a.tile) < std::pair(b.place, b.tile); });
    const bool has_cuts = cuts.width == tiles.width() && cuts.bits == bits;
    std::vector<std::int64_t> along;
    std::vector<int> before;
    for (const OnCurve& one : curve) {
        along.push_back(one.weight);
        if (has_cuts) before.push_back(cuts.rank_of(one.place));
    }
    const std::vector<int> to = ranks.divide(along, before);
    std::vector<std::pair<std::uint64_t, int>> owners;
    for (std::size_t k = 0; k < curve.size(); ++k) owners.emplace_back(curve[k].tile, to[k]);
    if (to != before) {
        constexpr auto nowhere = std::numeric_limits<std::uint64_t>::max();
        cuts = {tiles.width(), bits, std::vector<std::uint64_t>(static_cast<std::size_t>(ranks.count()), nowhere)};
        for (std::size_t k = curve.size(); k-- > 0;) cuts.first[static_cast<std::size_t>(to[k])] = curve[k].place;
        for (std::size_t r = cuts.first.size() - 1; r-- > 0;) cuts.first[r] = std::min(cuts.first[r], cuts.first[r + 1]);
    }
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
    tiles.share(ranks.relay(std::move(plan.out), std::move(plan.in)), plan.out_tiles, std::move(plan.in_tiles),
                std::move(plan.counts_elsewhere));
}

/// Sends particles to the ranks to[particle], where they are merged by their places.
template <int D>
Merged send(Ranks& ranks, const FieldGroups& groups, const std::vector<OldPlace>& places, const std::vector<int>& to,
            Particles<D>& p)
{
    std::vector<std::size_t> counts(static_cast<std::size_t>(ranks.count()), 0);
    for (const int rank : to) ++counts[static_cast<std::size_t>(rank)];
    std::vector<Bytes> out(counts.size());
    for (std::size_t r = 0; r < out.size(); ++r)
        if (static_cast<int>(r) != ranks.index()) out[r].reserve(counts[r] * packed_size(p, groups));
    for (int i = 0; i < p.count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (to[k] != ranks.index()) pack(p, groups, i, places[k], out[static_cast<std::size_t>(to[k])]);
    }
    return merge(
        p, groups, places, [&](int i) { return to[static_cast<std::size_t>(i)] != ranks.index(); },
        ranks.exchange(std::move(out)));
}

}  // namespace

template <int D>
void distribute(const Model<D>& model, const Lattice<D>& lattice, std::int64_t first, Tiles<D>& tiles, State<D>& s)
{
    Ranks& ranks            = *s.ranks;
    const TileOwners owners = divide(ranks, tiles, filled_tiles(tiles), false, s.cuts);
    const BlockHolders<D> holders(tiles, owners, ring_of(model.method));
    std::vector<std::uint64_t> own =
        std::move(blocks_to_tell(tiles, holders, ranks.count(), 0)[static_cast<std::size_t>(ranks.index())]);

    const std::int64_t last = first + s.particles.count;
    std::vector<OldPlace> places;
    std::vector<int> to;
    for (std::size_t k = 0; k < tiles.tiles().size(); ++k) {
        const Tile& tile           = tiles.tiles()[k];
        const std::uint64_t number = tiles.tile_numbers()[k];
        for (std::int64_t i = std::max<std::int64_t>(tile.begin, first); i < std::min<std::int64_t>(tile.end, last); ++i) {
            places.push_back({number, static_cast<std::uint64_t>(i - tile.begin)});
            to.push_back(owners.rank_of(number));
        }
    }
    const FieldGroups groups = field_groups(model);
    take(s.particles, groups, send(ranks, groups, places, to, s.particles));
    tiles.keep([&](std::uint64_t tile) { return owners.rank_of(tile) == ranks.index(); }, std::move(own));
    share(ranks, lattice, holders, tiles);
}

namespace {

/// What the passes have taken since the last sort for each particle, ps: its part of its tile. Whole numbers have one sum on all ranks. Empty
/// if times have not been measured.
template <int D>
std::vector<std::int64_t> times_of_particles(const State<D>& s)
{
    const Tiles<D>& tiles = s.field.tiles;
    std::vector<std::int64_t> r;
    for (std::size_t k = 0; k < tiles.tiles().size() && tiles.is_shared(); ++k) {
        const Tile& tile = tiles.tiles()[k];
        if (tile.begin == tile.end) continue;
        if (tiles.seconds(k) == 0) return {};
        const double seconds = tiles.seconds(k) / (tile.end - tile.begin);
        r.insert(r.end(), static_cast<std::size_t>(tile.end - tile.begin), std::llround(seconds / kPicosecond));
    }
    return r;
}

}  // namespace

template <int D>
Division migrate(const Model<D>& model, State<D>& s, const Tiles<D>& tiles, const std::function<std::uint64_t(int)>& tile_of)
{
    Ranks& ranks                          = *s.ranks;
    Particles<D>& p                       = s.particles;
    const std::vector<std::int64_t> times = times_of_particles(s);
    std::vector<std::uint64_t> tile(static_cast<std::size_t>(p.count));
    std::map<std::uint64_t, Filled> all;
    auto last = all.end();  // most particles are still in the tile of the one before
    for (int i = 0; i < p.count; ++i) {
        const auto k               = static_cast<std::size_t>(i);
        const std::uint64_t number = tile[k] = tile_of(i);
        if (last == all.end() || last->first != number) last = all.try_emplace(number, Filled{number, 0, 0}).first;
        ++last->second.particles;
        if (!times.empty()) last->second.time += times[k];
    }
    auto list = [&] {
        std::vector<Filled> r;
        for (const auto& [number, one] : all) r.push_back(one);
        return r;
    };
    const std::vector<Filled> mine = list();
    all.clear();
    for (const std::vector<Filled>& of_rank : gather_all(ranks, mine))
        for (const Filled& one : of_rank) {
            Filled& sum = all.try_emplace(one.tile, Filled{one.tile, 0, 0}).first->second;
            sum.particles += one.particles;
            sum.time += one.time;
        }
    const bool has_times = largest(ranks, p.count > 0 && times.empty() ? 1 : 0) == 0;
    Division r{divide(ranks, tiles, list(), has_times, s.cuts), {}, {}};
    constexpr double kept = 0.8;  // of a time at the next sort
    for (const auto& [number, one] : all)
        if (has_times && r.owners.rank_of(number) == ranks.index())
            r.seconds[number] = kept * kPicosecond * static_cast<double>(one.time);

    std::vector<int> to(tile.size());
    for (std::size_t k = 0; k < to.size(); ++k) to[k] = k > 0 && tile[k] == tile[k - 1] ? to[k - 1] : r.owners.rank_of(tile[k]);
    r.particles = send(ranks, field_groups(model), places_of(p, s.field.tiles), to, p);
    return r;
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
    if (!tiles.restore(std::move(record), end)) throw std::logic_error("the tiles of the ranks do not fit together");
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
    std::vector<bool> is_own(p.corner.size(), s.ranks->index() == 0);  // the first also has those of no cell
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

#define ORDO_SHARING(D)                                                                                               \
    template std::string alone_because(const Model<D>&);                                                              \
    template void require_shareable(const Model<D>&);                                                                 \
    template void distribute(const Model<D>&, const Lattice<D>&, std::int64_t, Tiles<D>&, State<D>&);                 \
    template Division migrate(const Model<D>&, State<D>&, const Tiles<D>&, const std::function<std::uint64_t(int)>&); \
    template void join_rims(Ranks&, const MethodSpec&, const Lattice<D>&, const TileOwners&, Tiles<D>&);              \
    template JoinedRows joined_particles(const State<D>&);                                                            \
    template JoinedRows joined_corners(const State<D>&);                                                              \
    template class Gathered<D>;
ORDO_SHARING(1)
ORDO_SHARING(2)
ORDO_SHARING(3)
#undef ORDO_SHARING

}  // namespace ordo
