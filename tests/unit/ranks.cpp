// Ranks: who gets which tiles, which records they hand on, and how particles travel. Against plain loops over everything.
#include "base/agree.hpp"
#include "base/joined_rows.hpp"
#include "grid/halo.hpp"
#include "grid/hilbert.hpp"
#include "grid/rim_plan.hpp"
#include "method/sharing.hpp"
#include "particles/sort.hpp"
#include "particles/travel.hpp"
#include "support/thread_ranks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <set>

namespace ordo {
namespace {

using Random = std::mt19937_64;

template <int D>
void check_curve(int bits)
{
    const Index<D> counts = Index<D>::filled(1 << bits);
    std::vector<Index<D>> at(static_cast<std::size_t>(1) << (D * bits), Index<D>::filled(-1));
    IndexBox<D>{{}, counts}.for_each([&](const Index<D>& k) { at.at(hilbert_number(k, bits)) = k; });
    for (std::size_t k = 1; k < at.size(); ++k) {
        int steps = 0;
        for (int a = 0; a < D; ++a) steps += std::abs(at[k][a] - at[k - 1][a]);
        ASSERT_EQ(steps, 1) << "at " << k;  // so no place was left out, and none has two numbers
    }
}
TEST(Hilbert, StepsToANeighbourAndVisitsEachPlaceOnce)
{
    for (int bits = 1; bits <= 5; ++bits) {
        check_curve<1>(bits);
        check_curve<2>(bits);
        check_curve<3>(bits);
    }
    EXPECT_EQ(bits_of<2>({1, 1}), 1);
    EXPECT_EQ(bits_of<2>({4, 5}), 3);
    EXPECT_EQ(bits_of<3>({8, 2, 1}), 3);
}

TEST(Ranks, DivideIntoEqualParts)
{
    Random random(1);
    for (int trial = 0; trial < 100; ++trial) {
        const int count = 1 + trial % 9;
        std::vector<std::int64_t> weights(random() % 200);
        for (auto& w : weights) w = 1 + static_cast<std::int64_t>(random() % 500);
        test::Crew crew(count, test::Division::parts);
        const std::vector<int> to = test::ThreadRanks(crew, 0).divide(weights, {});
        ASSERT_EQ(to.size(), weights.size());
        EXPECT_TRUE(std::is_sorted(to.begin(), to.end()));
        std::vector<std::int64_t> part(static_cast<std::size_t>(count), 0);
        for (std::size_t k = 0; k < to.size(); ++k) part.at(static_cast<std::size_t>(to[k])) += weights[k];
        const double mean = std::accumulate(weights.begin(), weights.end(), 0.0) / count;
        for (const auto w : part) EXPECT_LE(std::fabs(static_cast<double>(w) - mean), 500);  // within the largest piece
    }
}

TEST(Ranks, KeepCutsThatDivideWell)
{
    test::Crew crew(4, test::Division::parts);
    const test::ThreadRanks ranks(crew, 0);
    std::vector<std::int64_t> weights(400, 100);
    std::vector<int> before(400);
    for (std::size_t k = 0; k < before.size(); ++k) before[k] = k < 104 ? 0 : k < 200 ? 1 : k < 300 ? 2 : 3;
    EXPECT_EQ(ranks.divide(weights, before), before);  // the heaviest has 1.04 of what it could have
    weights[0]                  = 600;
    const std::vector<int> anew = ranks.divide(weights, before);
    EXPECT_EQ(anew, ranks.divide(weights, {}));
    EXPECT_EQ(anew[97], 1);
    EXPECT_EQ(anew[95], 0);
    // Few heavy pieces, which cannot be divided well.
    const std::vector<std::int64_t> heavy = {90, 100, 110, 100, 95};
    EXPECT_EQ(ranks.divide(heavy, std::vector{0, 1, 2, 3, 3}), (std::vector{0, 1, 2, 3, 3}));
}

TEST(Ranks, AgreeOnTheFirst)
{
    test::on_ranks(5, test::Division::parts, [](Ranks& ranks) {
        const auto r = static_cast<double>(ranks.index());
        auto name    = [&] { return std::to_string(ranks.index()); };
        EXPECT_EQ(text_of_first(ranks, std::fabs(r - 3), name), "3");
        EXPECT_EQ(text_of_first(ranks, r < 2 ? kNowhere : 7, name), "2");
        EXPECT_EQ(text_of_first(ranks, kNowhere, name), "");
        std::int64_t sum[] = {ranks.index(), -1};
        ranks.add(sum);
        EXPECT_EQ(sum[0], 10);
        EXPECT_EQ(sum[1], -5);
        EXPECT_EQ(largest(ranks, -r), 0);
        const auto all = gather_all(ranks, std::vector<int>(static_cast<std::size_t>(ranks.index()), ranks.index()));
        for (int k = 0; k < 5; ++k)
            EXPECT_EQ(all.at(static_cast<std::size_t>(k)), std::vector<int>(static_cast<std::size_t>(k), k));
    });
}

TEST(Ranks, NoneWaitsForOneThatHasEnded)
{
    EXPECT_THROW(test::on_ranks(3, test::Division::parts,
                                [](Ranks& ranks) {
                                    if (ranks.index() != 1) largest(ranks, 0);
                                }),
                 std::runtime_error);
}

TEST(Ranks, AFailureOfOneEndsAll)
{
    EXPECT_THROW(test::on_ranks(3, test::Division::parts,
                                [](Ranks& ranks) {
                                    if (ranks.index() == 1) throw InputError("mine");
                                    largest(ranks, 0);
                                }),
                 InputError);
}

/// A grid with particles in random cells, and a scatter that notes who wrote to a node, and in which order.
template <int D>
struct Writing {
    static constexpr double kModulus = 2147483647.0;

    Lattice<D> lattice;
    Tiles<D> tiles;
    std::vector<std::uint64_t> keys;  ///< sorted
    Random random;

    Writing(int seed, int halo, int degree, const Vec<D, bool>& periodic) : random(static_cast<std::uint64_t>(seed))
    {
        Index<D> cells{};
        for (int a = 0; a < D; ++a) cells[a] = 8 + static_cast<int>(random() % (D == 3 ? 14 : 40));
        lattice = Lattice<D>({}, Vec<D>::filled(1.0), cells, periodic, halo + 1, {degree, 0.5});
        tiles =
            Tiles<D>(lattice, halo, seed % 3 == 0 ? 1 << 30 : 0, 1 + seed % 2);  // wide or narrow, of one velocity field or two
        const bool is_sparse = seed % 2 == 0;
        IndexBox<D>{Index<D>::filled(halo + 1), Index<D>::filled(halo + 1) + cells}.for_each([&](const Index<D>& cell) {
            for (int field = 0; field < tiles.fields(); ++field)
                if (!is_sparse || random() % 20 == 0) keys.push_back(tiles.key(cell, field));
        });
        if (keys.empty()) keys.push_back(tiles.key(Index<D>::filled(halo + 2)));
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
    }

    IndexBox<D> reached_by(std::uint64_t tile) const
    {
        const Index<D> place = tiles.place_of_tile(tile);
        IndexBox<D> r{};
        for (int a = 0; a < D; ++a) {
            r.lo[a] = std::max(place[a] * tiles.width() - tiles.halo(), 0);
            r.hi[a] = std::min((place[a] + 1) * tiles.width() + tiles.halo() + lattice.basis.degree + 1, lattice.nodes[a]);
        }
        return r;
    }

    /// What tile number `tile` does to the nodes that it reaches: lane 0 of each remembers an order, the others that it came.
    void write(std::uint64_t tile, int pass, Lanes* records, int size) const
    {
        const int field           = tiles.field_of_tile(tile);
        const std::ptrdiff_t base = tiles.first_node(field);
        reached_by(tile).for_each([&](const Index<D>& at) {
            const auto node = static_cast<std::uint64_t>(lattice.offset(at));
            if (!tiles.is_active(at, field) || (node * 2654435761u + tile * 40503u + static_cast<std::uint64_t>(pass)) % 3 == 0)
                return;
            for (int q = 0; q < size; ++q) {
                Lanes& record = records[(base + lattice.offset(at)) * size + q];
                record[0] =
                    std::fmod(record[0] * 1009 + static_cast<double>(tile + 17 * static_cast<std::uint64_t>(q) + 1), kModulus);
                record[pass % 7 + 1] += 1;
            }
        });
    }
};

template <int D>
void check_relay(int seed, int count, test::Division division)
{
    Random random(static_cast<std::uint64_t>(seed));
    const int halo = 1 + static_cast<int>(random() % (D == 3 ? 3 : 8)), degree = 1 + static_cast<int>(random() % 3),
              size = 1 + seed % 3;
    Vec<D, bool> periodic{};
    for (int a = 0; a < D; ++a) periodic[a] = seed % 4 == 0 || (seed % 4 == 1 && a == 0);
    MethodSpec method;  // some read far
    if (seed % 5 == 0) method.basis = Basis::ddmpm;
    if (seed % 5 == 1) method.gradient = Gradient::adjoint;
    const Writing<D> all(seed, halo, degree, periodic);
    const auto nodes = all.lattice.node_count() * static_cast<std::size_t>(all.tiles.fields());
    std::vector<Lanes> expected(nodes * static_cast<std::size_t>(size), Lanes(0.0));
    auto number_of = [](const Tiles<D>& tiles, const Tile& tile) {
        return tiles.tile_numbers()[static_cast<std::size_t>(&tile - tiles.tiles().data())];
    };
    for (int pass = 0; pass < 2; ++pass)  // the second begins with what the first has left, as forces do after masses
        all.tiles.for_each_by_colour(
            [&](const Tile& tile) { all.write(number_of(all.tiles, tile), pass, expected.data(), size); });
    std::vector<Lanes> with_images = expected;
    auto sum_images                = [&](const Tiles<D>& tiles, std::vector<Lanes>& records) {
        const Halo<D> images(all.lattice, tiles);
        images.add_records(records.data(), size);
        images.copy_records(records.data(), size);
    };
    sum_images(all.tiles, with_images);

    std::vector<int> counted(all.tiles.blocks().size(), 0);
    std::mutex mutex;
    test::on_ranks(count, division, [&](Ranks& ranks) {
        set_thread_count(1 + seed % 3);
        std::vector<std::int64_t> weights(all.tiles.tile_numbers().size(), 1);
        const std::vector<int> to = ranks.divide(weights, {});
        std::vector<std::pair<std::uint64_t, int>> pairs;
        for (std::size_t k = 0; k < to.size(); ++k) pairs.emplace_back(all.tiles.tile_numbers()[k], to[k]);
        const TileOwners owners(pairs);
        std::vector<std::uint64_t> keys;
        for (const std::uint64_t key : all.keys)
            if (owners.rank_of(all.tiles.tile_of(key)) == ranks.index()) keys.push_back(key);
        Tiles<D> tiles = all.tiles;
        tiles.assign(keys);
        join_rims(ranks, method, all.lattice, owners, tiles);

        std::vector<Lanes> records(expected.size(), Lanes(-1.0));  // what old steps have left
        auto for_each_of = [&](std::ptrdiff_t first, const Index<D>& at, auto&& f) {
            for (int q = 0; q < size; ++q) f(static_cast<std::size_t>((first + all.lattice.offset(at)) * size + q));
        };
        auto for_each_held = [&](auto&& f) {
            for (const Block<D>& block : tiles.blocks())
                tiles.nodes_of(block).for_each([&](const Index<D>& at) { for_each_of(block.first_node, at, f); });
        };
        long wrong      = 0;
        auto compare_to = [&](const std::vector<Lanes>& right) {
            return [&](std::size_t k) {
                for (int lane = 0; lane < 8; ++lane) wrong += records[k][lane] != right[k][lane];
            };
        };
        for_each_held([&](std::size_t k) { records[k] = Lanes(0.0); });
        for (int pass = 0; pass < 2; ++pass)
            tiles.for_each_by_colour({{records.data(), size}},
                                     [&](const Tile& tile) { all.write(number_of(tiles, tile), pass, records.data(), size); });
        // What a rank needs: blocks that it counts, and what its particles reach or read near there.
        const int ring     = seed % 5 == 0 ? 2 : seed % 5 == 1 ? 8 : 0;
        auto compare_needs = [&](const std::vector<Lanes>& right, const std::string& which) {
            const auto compare = compare_to(right);
            for (std::size_t k = 0; k < tiles.blocks().size(); ++k)
                if (tiles.counts_here(k))
                    tiles.nodes_of(tiles.blocks()[k]).for_each([&](const Index<D>& at) {
                        for_each_of(tiles.blocks()[k].first_node, at, compare);
                    });
            for (const std::uint64_t tile : tiles.tile_numbers()) {
                const int field = tiles.field_of_tile(tile);
                IndexBox<D> box = all.reached_by(tile);
                for (int a = 0; a < D; ++a) {
                    box.lo[a] = std::max(box.lo[a] - ring, 0);
                    box.hi[a] = std::min(box.hi[a] + ring, all.lattice.nodes[a]);
                }
                box.for_each([&](const Index<D>& at) {
                    if (all.tiles.is_active(at, field)) for_each_of(tiles.first_node(field), at, compare);
                });
            }
            EXPECT_EQ(wrong, 0) << which << ", seed " << seed << ", rank " << ranks.index() << " of " << ranks.count();
        };
        compare_needs(expected, "before sums over images");
        for_each_held([&](std::size_t k) {  // other nodes look as if nothing was there
            for (int lane = 0; lane < 8; ++lane) wrong += records[k][lane] != expected[k][lane] && records[k][lane] != 0;
        });
        EXPECT_EQ(wrong, 0) << "what nobody needs, seed " << seed << ", rank " << ranks.index() << " of " << ranks.count();
        sum_images(tiles, records);
        compare_needs(with_images, "with images");

        const std::lock_guard lock(mutex);
        for (std::size_t k = 0; k < tiles.blocks().size(); ++k) {
            const auto& known = all.tiles.block_numbers();
            const auto at     = std::lower_bound(known.begin(), known.end(), tiles.block_numbers()[k]);
            ASSERT_TRUE(at != known.end() && *at == tiles.block_numbers()[k]);
            if (tiles.counts_here(k)) ++counted[static_cast<std::size_t>(at - known.begin())];
        }
    });
    for (std::size_t k = 0; k < counted.size(); ++k) {
        bool is_written = false;
        all.tiles.nodes_of(all.tiles.blocks()[k]).for_each([&](const Index<D>& at) {
            is_written =
                is_written ||
                with_images[static_cast<std::size_t>((all.tiles.blocks()[k].first_node + all.lattice.offset(at)) * size)][0] != 0;
        });
        if (is_written)
            EXPECT_EQ(counted[k], 1) << "seed " << seed << ", block " << k;
        else
            EXPECT_GE(counted[k], 1) << "seed " << seed << ", block " << k;  // zeros may count twice
    }
}
TEST(Relay, SumsAreThoseOfOneProcess)
{
    for (int seed = 1; seed <= 60; ++seed)
        for (const auto division : {test::Division::parts, test::Division::random, test::Division::one}) {
            const int count = 1 + seed % 9;
            check_relay<1>(seed, count, division);
            check_relay<2>(seed, count, division);
            if (seed % 3 == 0) check_relay<3>(seed, count, division);
        }
}

/// Particles on a random walk over ranks. They must lie in the order that one process, which sorts them stably, has them in.
TEST(Travel, KeepsTheOrderOfOneProcess)
{
    constexpr int count = 500, tile_count = 40, steps = 12;
    FieldGroups groups;
    groups.cells = groups.corner_velocity = true;
    groups.history                        = {"plastic_strain"};
    auto plant                            = [&] {
        Particles<2> p(count, groups);
        p.corner          = Array<Vec<2>>(count + 3);
        p.corner_velocity = Array<Vec<2>>(count + 3);
        for (int i = 0; i < count; ++i) {
            p.id[i]         = i;
            p.x[i]          = {1.0 * i, 0.5};
            p.F[i]          = {{{0.1 * i, 1}, {2, 3}}};
            p.history[0][i] = 0.25 * i;
            p.cell[i]       = i % 5 == 0 ? CornerIds<2>{{i, i + 1, i + 2, -1}} : CornerIds<2>{{i, i + 1, i + 2, i + 3}};
        }
        return p;
    };
    auto tile_at = [](int id, int step) {  // of a walk
        Random random(static_cast<std::uint64_t>(id * 1000 + step));
        return static_cast<std::uint64_t>(random() % tile_count);
    };
    auto corner_at = [](int corner, int step) { return Vec<2>{1.0 * corner, 0.125 * step}; };
    for (const int ranks_count : {1, 2, 3, 5, 9, 64})
        for (const auto division : {test::Division::parts, test::Division::random, test::Division::one}) {
            std::vector<std::vector<int>> expected;  // ids after each step
            std::vector<int> ids(count);
            std::iota(ids.begin(), ids.end(), 0);
            for (int step = 0; step < steps; ++step) {
                std::stable_sort(ids.begin(), ids.end(), [&](int a, int b) { return tile_at(a, step) < tile_at(b, step); });
                expected.push_back(ids);
            }
            test::on_ranks(ranks_count, division, [&](Ranks& ranks) {
                Particles<2> p = plant();
                std::vector<OldPlace> places;
                for (int i = 0; i < count; ++i) places.push_back({0, static_cast<std::uint64_t>(i)});
                take(p, groups, merge(p, groups, places, [&](int i) { return i % ranks.count() != ranks.index(); }, {}));
                std::erase_if(places,
                              [&](const OldPlace& at) { return static_cast<int>(at.place) % ranks.count() != ranks.index(); });
                for (int step = 0; step < steps; ++step) {
                    for (int i = 0; i < p.count; ++i)
                        for (int c = 0; c < p.cell[i].count(); ++c) {
                            p.corner[p.cell[i][c]]          = corner_at(p.cell[i][c], step);
                            p.corner_velocity[p.cell[i][c]] = -corner_at(p.cell[i][c], step);
                        }
                    const std::vector<int> to = ranks.divide(std::vector<std::int64_t>(tile_count, 1), {});
                    std::vector<Bytes> out(static_cast<std::size_t>(ranks.count()));
                    auto rank_of = [&](int i) { return to[tile_at(p.id[i], step)]; };
                    for (int i = 0; i < p.count; ++i)
                        if (rank_of(i) != ranks.index())
                            pack(p, groups, i, places[static_cast<std::size_t>(i)], out[static_cast<std::size_t>(rank_of(i))]);
                    auto in = ranks.exchange(std::move(out));
                    std::vector<bool> goes;
                    for (int i = 0; i < p.count; ++i) goes.push_back(rank_of(i) != ranks.index());
                    const Merged merged = merge(
                        p, groups, places, [&](int i) { return goes[static_cast<std::size_t>(i)]; }, std::move(in));
                    const std::size_t id_at = offset_of(p, groups, p.id);
                    Array<std::uint64_t> keys(static_cast<std::size_t>(merged.count()));
                    for (int k = 0; k < merged.count(); ++k) keys[k] = tile_at(merged.value(p.id, id_at, k), step);
                    take(p, groups, merged, sort_keys(keys, tile_count));
                    places.clear();
                    for (int i = 0; i < p.count; ++i)
                        places.push_back({keys[i], i > 0 && keys[i] == keys[i - 1] ? places.back().place + 1 : 0});

                    std::vector<int> mine;
                    for (const int id : expected[static_cast<std::size_t>(step)])
                        if (to[tile_at(id, step)] == ranks.index()) mine.push_back(id);
                    ASSERT_EQ(std::vector<int>(p.id.begin(), p.id.end()), mine);
                    ASSERT_EQ(p.x.size(), mine.size());
                    for (int i = 0; i < p.count; ++i) {
                        ASSERT_EQ(p.x[i][0], p.id[i]);
                        ASSERT_EQ(p.F[i](0, 0), 0.1 * p.id[i]);
                        ASSERT_EQ(p.history[0][i], 0.25 * p.id[i]);
                        for (int c = 0; c < p.cell[i].count(); ++c) {
                            ASSERT_EQ(p.corner[p.cell[i][c]], corner_at(p.cell[i][c], step));
                            ASSERT_EQ(p.corner_velocity[p.cell[i][c]], -corner_at(p.cell[i][c], step));
                        }
                    }
                }
            });
        }
}

/// Rows of 0 to 4 numbers, each on a rank at random, some on two: more than a block of each rank.
TEST(JoinedRows, AreThoseOfOneProcess)
{
    constexpr std::size_t count = 120000;
    auto length                 = [](std::size_t row) { return row * 7 % 5; };
    auto number = [](std::size_t row, std::size_t k) { return 0.5 * static_cast<double>(row) + static_cast<double>(k); };
    std::vector<double> expected;
    for (std::size_t row = 0; row < count; ++row)
        for (std::size_t k = 0; k < length(row); ++k) expected.push_back(number(row, k));
    for (const int size : {1, 2, 5}) {
        SCOPED_TRACE(size);
        test::on_ranks(size, test::Division::parts, [&](Ranks& ranks) {
            std::vector<std::int64_t> places;
            for (std::size_t row = 0; row < count; ++row) {
                const int owner = static_cast<int>(row * 0x9e3779b97f4a7c15ull >> 40) % size;
                if (owner == ranks.index() || (row % 11 == 0 && (owner + 1) % size == ranks.index()))
                    places.push_back(static_cast<std::int64_t>(row));
            }
            const JoinedRows rows(ranks, places, count);
            auto row_of = [&](std::size_t k) { return static_cast<std::size_t>(rows.place(k)); };
            std::vector<double> numbers;
            std::size_t blocks = 0;
            rows.for_each_block<double>([&](std::size_t k) { return length(row_of(k)); },
                                        [&](std::size_t k, double* out) {
                                            for (std::size_t n = 0; n < length(row_of(k)); ++n) out[n] = number(row_of(k), n);
                                        },
                                        [&](std::span<const double> block) {
                                            ++blocks;
                                            numbers.insert(numbers.end(), block.begin(), block.end());
                                        });
            EXPECT_TRUE(ranks.index() == 0 ? blocks > 1 && numbers == expected : blocks == 0);
        });
    }
}

}  // namespace
}  // namespace ordo
