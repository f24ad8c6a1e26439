// Sort, tiles and colours, periodic images, boundary planes.
#include "grid/condition.hpp"
#include "grid/halo.hpp"
#include "particles/sort.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <set>

namespace ordo {
namespace {

TEST(Sort, OrderIsStableAndSorted)
{
    test::Random random(1);
    const int before = thread_count();
    for (std::size_t count : {5000u, 200000u})
        for (std::uint64_t end : {std::uint64_t{50}, std::uint64_t{1} << 40})
            for (int threads : {1, 3}) {
                set_thread_count(threads);
                Array<std::uint64_t> keys(count);
                for (auto& k : keys) k = std::uniform_int_distribution<std::uint64_t>(0, end - 1)(random);
                const std::vector<std::uint64_t> unsorted(keys.begin(), keys.end());
                std::vector<int> expected(count);
                std::iota(expected.begin(), expected.end(), 0);
                std::stable_sort(expected.begin(), expected.end(), [&](int a, int b) { return unsorted[a] < unsorted[b]; });
                const Array<int> order = sort_keys(keys, end);
                EXPECT_TRUE(std::equal(order.begin(), order.end(), expected.begin(), expected.end()));
                for (std::size_t k = 0; k < count; ++k) ASSERT_EQ(keys[k], unsorted[expected[k]]);
                EXPECT_TRUE(sort_keys(keys, end).empty());
            }
    set_thread_count(before);
}

/// Every byte of every field follows its particle.
template <int D>
void check_permutation()
{
    FieldGroups all;
    all.box = all.corners = all.cells = all.traction = all.body_force = all.averaged = all.shock = all.gradient = all.modes =
        true;
    all.corner_samples = all.periodic = true;
    all.history                       = {"first", "second"};
    const int count                   = 5000;
    Particles<D> p(count, all);
    test::Random random(2);
    std::vector<std::vector<unsigned char>> before;
    p.for_each_field([&](auto& field) {
        auto* const bytes      = reinterpret_cast<unsigned char*>(field.data());
        const std::size_t size = sizeof(field[0]) * count;
        for (std::size_t k = 0; k < size; ++k) bytes[k] = static_cast<unsigned char>(random());
        before.emplace_back(bytes, bytes + size);
    });
    Array<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    permute(p, order);
    std::size_t n = 0;
    p.for_each_field([&](auto& field) {
        const std::size_t size = sizeof(field[0]);
        for (int k = 0; k < count; ++k)
            ASSERT_EQ(std::memcmp(&field[k], before[n].data() + order[k] * size, size), 0) << "field " << n;
        ++n;
    });
    EXPECT_EQ(n, before.size());
    EXPECT_GT(n, 25u);
}
TEST(Sort, FieldsFollowTheirParticles)
{
    check_permutation<1>();
    check_permutation<2>();
    check_permutation<3>();
}

TEST(Tiles, WidthKeepsTilesOfOneColourApart)
{
    for (const std::ptrdiff_t particles : {std::ptrdiff_t{0}, std::ptrdiff_t{1} << 40})
        for (int degree : {1, 2, 3})
            for (int halo = 1; halo < 40; ++halo)
                for (const int w : {Tiles<1>::width_for(halo, degree, particles), Tiles<2>::width_for(halo, degree, particles),
                                    Tiles<3>::width_for(halo, degree, particles)}) {
                    EXPECT_LT(w + halo + degree, 2 * w - halo);
                    EXPECT_EQ(w % Tiles<1>::block_width, 0);
                }
}

/// The nodes that tiles of one colour may write to never meet; every such node belongs to an active block.
TEST(Tiles, ColoursShareNoNode)
{
    for (int trial = 0; trial < 6; ++trial) {  // narrow and wide tiles
        const int halo = std::array{1, 2, 5}[trial % 3];
        const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.05), {40, 33}, {}, halo + 1);
        Tiles<2> tiles(lattice, halo, trial < 3 ? 0 : 1 << 30);
        std::vector<std::uint64_t> keys;
        IndexBox<2>{{halo + 1, halo + 1}, {halo + 41, halo + 34}}.for_each(
            [&](const Index<2>& c) { keys.push_back(tiles.key(c)); });
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
        std::size_t particles = 0;
        for (const Tile& t : tiles.tiles()) particles += static_cast<std::size_t>(t.end - t.begin);
        EXPECT_EQ(particles, keys.size());

        std::vector<Index<2>> cell_of_key(tiles.key_end());
        IndexBox<2>{{0, 0}, {lattice.nodes[0], lattice.nodes[1]}}.for_each(
            [&](const Index<2>& c) { cell_of_key[tiles.key(c)] = c; });
        int colour_changes = 0;
        std::set<std::pair<int, int>> written;
        int previous_parity = -1;
        const int threads   = thread_count();
        set_thread_count(1);
        tiles.for_each_by_colour([&](const Tile& t) {
            const Index<2> cell = cell_of_key[keys[static_cast<std::size_t>(t.begin)]];
            const Index<2> tile = {cell[0] / tiles.width(), cell[1] / tiles.width()};
            const int parity    = (tile[0] & 1) | (tile[1] & 1) << 1;
            if (parity != previous_parity) {
                written.clear();
                ++colour_changes;
            }
            previous_parity = parity;
            IndexBox<2> reach{};
            for (int a = 0; a < 2; ++a) {
                reach.lo[a] = std::max(0, tile[a] * tiles.width() - halo);
                reach.hi[a] = std::min(lattice.nodes[a], (tile[a] + 1) * tiles.width() + halo + 1);
            }
            reach.for_each([&](const Index<2>& n) {
                EXPECT_TRUE(written.insert({n[0], n[1]}).second);
                EXPECT_TRUE(tiles.is_active(n));
            });
        });
        set_thread_count(threads);
        EXPECT_EQ(colour_changes, 4);
    }
}

TEST(Tiles, ComeBackFromTheirRecord)
{
    const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.05), {40, 33}, {}, 2);
    const Tiles<2> empty(lattice, 1);
    Tiles<2> tiles = empty, again = empty;
    test::Random random(7);
    std::vector<std::uint64_t> keys;
    for (int k = 0; k < 50; ++k) {
        const auto cell = [&](int end) { return static_cast<int>(test::uniform(random, 2, end)); };
        keys.push_back(tiles.key({cell(42), cell(35)}));
    }
    std::sort(keys.begin(), keys.end());
    tiles.assign(keys);
    const TileRecord record = tiles.record();
    ASSERT_GT(record.tiles.size(), 3u);
    ASSERT_TRUE(again.restore(record, 50));
    EXPECT_EQ(again.blocks(), tiles.blocks());
    auto by_colour = [](const Tiles<2>& t) {
        std::vector<std::pair<int, int>> r;
        const int threads = thread_count();
        set_thread_count(1);
        t.for_each_by_colour([&](const Tile& tile) { r.emplace_back(tile.begin, tile.end); });
        set_thread_count(threads);
        return r;
    };
    EXPECT_EQ(by_colour(again), by_colour(tiles));

    auto is_refused = [&](auto&& change) {
        TileRecord damaged = record;
        change(damaged);
        return !again.restore(damaged, 50);
    };
    EXPECT_FALSE(again.restore(record, 49));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r.tiles.clear(); }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r.tiles.back() = 1'000'000; }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r.blocks.back() = 1'000'000; }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { std::swap(r.tiles[0], r.tiles[1]); }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r.ends[0] = 0; }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r.ends[1] = r.ends[0]; }));
    EXPECT_TRUE(is_refused([](TileRecord& r) { r = {}; }));
}

/// Blocks are those of the nodes from halo + 1 below to halo + 1 and the degree above the cells with particles, and all that
/// hold images of their nodes.
TEST(Tiles, BlocksAreOfNodesInReachAndTheirImages)
{
    test::Random random(3);
    constexpr int width = Tiles<2>::block_width;
    for (int trial = 0; trial < 12; ++trial) {
        const Vec<2, bool> periodic = {trial % 3 > 0, trial % 3 > 1};
        const int halo = std::array{1, 2, 4, 9}[trial / 3], margin = halo + 1;
        const GridBasis basis{.degree = 1 + trial % 2};
        const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.05), {70, 33}, periodic, margin, basis);
        Tiles<2> tiles(lattice, halo);
        std::vector<std::uint64_t> keys;
        std::set<std::pair<int, int>> expected;
        for (int n = 0; n < 4; ++n) {
            const Index<2> cell = {margin + static_cast<int>(test::uniform(random, 0, 70)),
                                   margin + static_cast<int>(test::uniform(random, 0, 33))};
            keys.push_back(tiles.key(cell));
            IndexBox<2> reach{};
            for (int a = 0; a < 2; ++a) {
                reach.lo[a] = std::max(0, cell[a] - halo - 1);
                reach.hi[a] = std::min(lattice.nodes[a], cell[a] + halo + 1 + basis.degree + 1);
            }
            reach.for_each([&](const Index<2>& at) { expected.insert({at[0] / width, at[1] / width}); });
        }
        for (int a = 0; a < 2; ++a) {
            const auto blocks = expected;
            for (const auto& b : blocks)
                tiles.nodes_of({{b.first, b.second}}).for_each([&](Index<2> at) {
                    const int inside = lattice.periodic_image(a, at[a]) - lattice.margin;
                    for (int k = 0; k < lattice.nodes[a] && periodic[a]; ++k)
                        if ((k - lattice.margin - inside) % lattice.cells[a] == 0) {
                            at[a] = k;
                            expected.insert({at[0] / width, at[1] / width});
                        }
                });
        }
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
        std::set<std::pair<int, int>> found;
        for (const Block<2>& b : tiles.blocks()) found.insert({b.at[0], b.at[1]});
        EXPECT_EQ(found, expected);
        EXPECT_EQ(tiles.blocks().size(), expected.size());
    }
}

/// Images add up once and copies reach every repeated node, corners too.
TEST(Halo, PeriodicImages)
{
    const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.25), {4, 4}, {true, true}, 2);
    Tiles<2> tiles(lattice, 1);
    std::vector<std::uint64_t> keys;
    IndexBox<2>{{2, 2}, {6, 6}}.for_each([&](const Index<2>& c) { keys.push_back(tiles.key(c)); });
    std::sort(keys.begin(), keys.end());
    tiles.assign(keys);
    const Halo<2> halo(lattice, tiles);
    Array<Lanes> nodes(lattice.node_count());
    IndexBox<2> all{{0, 0}, lattice.nodes};
    double total = 0;
    all.for_each([&](const Index<2>& n) {
        nodes[lattice.offset(n)][3] = 1 + n[0] + 10 * n[1];
        total += 1 + n[0] + 10 * n[1];
    });
    halo.add(nodes.data(), 0, NodeLane::end);
    double inside = 0;
    IndexBox<2>{{2, 2}, {6, 6}}.for_each([&](const Index<2>& n) { inside += nodes[lattice.offset(n)][3]; });
    EXPECT_DOUBLE_EQ(inside, total);
    halo.copy(nodes.data());
    all.for_each([&](const Index<2>& n) {
        const Index<2> image = {lattice.periodic_image(0, n[0]), lattice.periodic_image(1, n[1])};
        EXPECT_EQ(nodes[lattice.offset(n)][3], nodes[lattice.offset(image)][3]);
    });
}

/// Where the period is shorter than the margins a node has several ghosts: any number of threads adds them in one order,
/// that of the axis.
TEST(Halo, SeveralGhostsAddUpInOneOrder)
{
    const int before = thread_count();
    for (const int thin : {1, 2, 3, 9}) {
        const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.25), {thin, 3000}, {true, true}, 3);
        Tiles<2> tiles(lattice, 2);
        const IndexBox<2> all{{0, 0}, lattice.nodes};
        std::vector<std::uint64_t> keys;
        all.for_each([&](const Index<2>& c) { keys.push_back(tiles.key(c)); });
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
        const Halo<2> halo(lattice, tiles);
        auto values = [&] {
            test::Random random(7);
            Array<Lanes> r(lattice.node_count());
            for (Lanes& lanes : r)
                for (int k = 0; k < 8; ++k) lanes[k] = test::uniform(random, -1, 1);
            return r;
        };
        Array<Lanes> expected = values();
        for (int a = 0; a < 2; ++a)
            all.for_each([&](const Index<2>& ghost) {
                Index<2> image = ghost;
                image[a]       = lattice.periodic_image(a, ghost[a]);
                if (image[a] != ghost[a]) expected[lattice.offset(image)] += expected[lattice.offset(ghost)];
            });
        for (const int threads : {1, 2, 5}) {
            set_thread_count(threads);
            Array<Lanes> nodes = values();
            halo.add(nodes.data(), 0, NodeLane::end);
            EXPECT_EQ(std::memcmp(nodes.data(), expected.data(), sizeof(Lanes) * nodes.size()), 0);
        }
    }
    set_thread_count(before);
}

struct BoundaryCase {
    double at;
    bool outer_is_above;
    int first_constrained, last_constrained;  ///< nodes of a 10-cell axis, without margin; -1 and 11 are in the margin
};
/// The nodes of a region, also beyond the seam of a periodic axis, where nodes repeat others.
TEST(Condition, RegionsCrossSeams)
{
    const Lattice<1> lattice({0.0}, {0.1}, {10}, {true}, 1);
    Tiles<1> tiles(lattice, 1, 10);
    Array<std::uint64_t> keys(10);
    for (int k = 0; k < 10; ++k) keys[k] = tiles.key({k + lattice.margin});
    tiles.assign(keys);
    std::vector<Condition<1>> conditions(1);
    conditions[0].region = [](const Vec<1>& x) { return x[0] > 0.85 && x[0] < 1.15; };
    std::set<int> held;
    Constraints<1>(conditions, lattice, tiles).for_each([&](std::ptrdiff_t node, int, bool) {
        held.insert(lattice.inside_period(lattice.index(node))[0] - lattice.margin);
    });
    EXPECT_EQ(held, (std::set<int>{0, 1, 9}));
}

TEST(Condition, PlanesActFromTheirNodeOutwards)
{
    for (const BoundaryCase& c :
         {BoundaryCase{0.0, false, -2, 0}, BoundaryCase{0.3, false, -2, 3}, BoundaryCase{0.35, false, -2, 3},
          BoundaryCase{1.0, true, 10, 12}, BoundaryCase{0.7, true, 7, 12}, BoundaryCase{0.65, true, 7, 12}}) {
        const Lattice<1> lattice(Vec<1>{}, Vec<1>{0.1}, {10}, {}, 2);
        Tiles<1> tiles(lattice, 1);
        std::vector<std::uint64_t> keys;
        for (int k = 2; k < 12; ++k) keys.push_back(tiles.key({k}));
        tiles.assign(keys);
        std::vector<Condition<1>> conditions(1);
        conditions[0].at             = c.at;
        conditions[0].outer_is_above = c.outer_is_above;
        const Constraints<1> constraints(conditions, lattice, tiles);
        Array<Lanes> nodes(lattice.node_count());
        for (Lanes& n : nodes) n = make_lanes(1, 1, 1, 1, 1, 1, 1, 1);
        constraints.apply(conditions, nodes.data(), {0.0}, {nullptr, 1.0}, 0.0);
        for (int k = 0; k < lattice.nodes[0]; ++k) {
            const bool held = k - 2 >= c.first_constrained && k - 2 <= c.last_constrained;
            EXPECT_EQ(nodes[static_cast<std::size_t>(k)][NodeLane::velocity], held ? 0.0 : 1.0) << c.at << " node " << k - 2;
            EXPECT_EQ(nodes[static_cast<std::size_t>(k)][NodeLane::increment], held ? 0.0 : 1.0);
        }
    }
}

/// Splines: a face holds the end coefficient alone, a plane inside those from the first Greville point beyond it.
TEST(Condition, PlanesActFromTheirGrevillePoint)
{
    struct Case {
        int degree;
        double at;
        bool outer_is_above;
        int first_held, last_held;  ///< functions, without margin
    };
    // Greville points of 10 cells, in cells: 0, 0.5, 1.5, .., 9.5, 10 and 0, 1/3, 1, 2, .., 9, 9 2/3, 10.
    for (const Case& c : {Case{2, 0.0, false, -2, 0}, Case{2, 1.0, true, 11, 13}, Case{2, 0.3, false, -2, 3},
                          Case{2, 0.7, true, 8, 13}, Case{2, 0.65, true, 7, 13}, Case{3, 0.0, false, -2, 0},
                          Case{3, 1.0, true, 12, 14}, Case{3, 0.3, false, -2, 4}, Case{3, 0.65, true, 8, 14}}) {
        const Lattice<1> lattice(Vec<1>{}, Vec<1>{0.1}, {10}, {}, 2, {.degree = c.degree});
        Tiles<1> tiles(lattice, 1);
        std::vector<std::uint64_t> keys;
        for (int k = 2; k < 12; ++k) keys.push_back(tiles.key({k}));
        tiles.assign(keys);
        std::vector<Condition<1>> conditions(1);
        conditions[0].at             = c.at;
        conditions[0].outer_is_above = c.outer_is_above;
        std::set<int> held;
        Constraints<1>(conditions, lattice, tiles).for_each([&](std::ptrdiff_t node, int, bool) {
            held.insert(static_cast<int>(node) - 2);
        });
        std::set<int> expected;
        for (int k = c.first_held; k <= c.last_held; ++k) expected.insert(k);
        EXPECT_EQ(held, expected) << "degree " << c.degree << " at " << c.at;
    }
}

struct ConditionTypes : testing::Test {
    using Value = std::array<std::optional<Field>, 2>;
    struct Kind {
        ConditionType type;
        Value value = Value();
    };
    const Kind fixed{ConditionType::fixed}, symmetry{ConditionType::symmetry};
    const Field twice_t{std::function<double(const FieldPoint&)>([](const FieldPoint& at) { return 2 * at.t; })};
    const Kind along_y{ConditionType::velocity, Value{std::nullopt, twice_t}};  ///< x stays free
    const Kind constant{ConditionType::velocity, Value{Field(7.0), Field(8.0)}};

    /// Velocity and increment of the node at the origin, before (3, 4) and (0.5, 0.25), under conditions on y-min at t = 2.
    static std::array<double, 4> apply(const std::vector<Kind>& kinds)
    {
        const Lattice<2> lattice(Vec<2>{}, Vec<2>::filled(0.5), {2, 2}, {}, 1);
        Tiles<2> tiles(lattice, 0);
        std::vector<std::uint64_t> keys;
        IndexBox<2>{{1, 1}, {3, 3}}.for_each([&](const Index<2>& c) { keys.push_back(tiles.key(c)); });
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
        std::vector<Condition<2>> conditions;
        for (const auto& [type, value] : kinds) {
            Condition<2>& b = conditions.emplace_back();
            b.axis          = 1;
            b.type          = type;
            b.value         = value;
        }
        Array<Lanes> nodes(lattice.node_count());
        for (Lanes& n : nodes) n = make_lanes(3, 4, 0, 1, 0.5, 0.25, 0, 0);
        Constraints<2>(conditions, lattice, tiles).apply(conditions, nodes.data(), {2.0}, {nullptr, 1.0}, 0.0);
        const Lanes& n = nodes[lattice.offset({1, 1})];
        return {n[0], n[1], n[4], n[5]};
    }
};
TEST_F(ConditionTypes, ActOnTheirComponents)
{
    EXPECT_EQ(apply({fixed}), (std::array{0.0, 0.0, 0.0, 0.0}));
    EXPECT_EQ(apply({symmetry}), (std::array{3.0, 0.0, 0.5, 0.0}));
    // Prescribed 4: the increment leads from the projected 4 - 0.25 to it.
    EXPECT_EQ(apply({along_y}), (std::array{3.0, 4.0, 0.5, 0.25}));
}
/// The condition that loses leaves no trace.
TEST_F(ConditionTypes, LaterConditionsWin)
{
    EXPECT_EQ(apply({fixed, along_y}), (std::array{0.0, 4.0, 0.0, 0.25}));
    EXPECT_EQ(apply({symmetry, along_y}), (std::array{3.0, 4.0, 0.5, 0.25}));
    EXPECT_EQ(apply({along_y, fixed}), (std::array{0.0, 0.0, 0.0, 0.0}));
    EXPECT_EQ(apply({constant, along_y}), (std::array{7.0, 4.0, 4.5, 0.25}));
}

}  // namespace
}  // namespace ordo
