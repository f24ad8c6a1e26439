// Walls: what they do to the velocities of nodes.
#include "grid/wall.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace ordo {
namespace {

constexpr double kRounding = 1e-14;

template <int D>
double largest(Vec<D> v)
{
    double r = 0.0;
    for (int a = 0; a < D; ++a) r = std::max(r, std::abs(v[a]));
    return r;
}

template <int D>
Wall<D> wall(Vec<D> normal, double friction = 0.0, Vec<D> velocity = {})
{
    Wall<D> r{.point = {}, .normal = (1 / norm(normal)) * normal, .friction = friction};
    for (int a = 0; a < D; ++a) r.velocity[a] = Field(velocity[a]);
    return r;
}

/// v after walls that the node is in have pushed it.
template <int D>
Vec<D> pushed(const std::vector<Wall<D>>& walls, Vec<D> v, Vec<D, bool> is_free = Vec<D, bool>::filled(true))
{
    std::vector<int> touched(walls.size());
    std::iota(touched.begin(), touched.end(), 0);
    WallImpulses<D> impulses{};
    return push(walls, velocities(walls, 0.0), touched, is_free, v, impulses);
}

template <int D>
Vec<D> random_vector(test::Random& random)
{
    Vec<D> v{};
    for (int a = 0; a < D; ++a) v[a] = std::uniform_real_distribution<double>(-1, 1)(random);
    return v;
}

TEST(Wall, LetsGoWhatLeavesAndHoldsWhatEnters)
{
    test::Random random(1);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec<3> u = random_vector<3>(random), v = random_vector<3>(random);
        const Wall<3> w   = wall<3>(random_vector<3>(random), 0.0, u);
        const double away = dot(v - u, w.normal);
        EXPECT_LT(largest<3>(pushed<3>({w}, v) - (v - std::min(away, 0.0) * w.normal)), kRounding);
    }
}

/// The impulse of friction is `friction` times the normal one, or what stops the node.
TEST(Wall, RubsAfterCoulomb)
{
    test::Random random(2);
    int sticking = 0, slipping = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Vec<3> u = random_vector<3>(random), v = random_vector<3>(random);
        const Wall<3> w   = wall<3>(random_vector<3>(random), 0.5, u);
        const double into = -dot(v - u, w.normal);
        if (into <= 0) continue;
        const Vec<3> after = pushed<3>({w}, v), slip = v - u + into * w.normal;
        EXPECT_NEAR(dot(after - u, w.normal), 0.0, kRounding);
        if (norm(slip) <= w.friction * into) {
            EXPECT_LT(largest<3>(after - u), kRounding);
            ++sticking;
        } else {
            EXPECT_LT(largest<3>(after - u - (1 - w.friction * into / norm(slip)) * slip), kRounding);
            ++slipping;
        }
    }
    EXPECT_GT(std::min(sticking, slipping), 10);
}

/// Components that other conditions hold stay, and the wall is obeyed by the others.
TEST(Wall, LeavesHeldComponents)
{
    const Vec<2, bool> only_y{{false, true}};
    const Vec<2> v = pushed<2>({wall<2>({{1, 2}}, 0.3)}, {{-3, 1}}, only_y);
    EXPECT_EQ(v[0], -3.0);
    EXPECT_NEAR(v[1], 1.5, kRounding);
    const Vec<2> across = pushed<2>({wall<2>({{1, 0}})}, {{-3, 1}}, only_y);  // the wall cannot act
    EXPECT_EQ(across[0], -3.0);
    EXPECT_EQ(across[1], 1.0);
}

/// Without friction the velocity is the closest among those that enter no wall: v' with (v - v') (w - v') <= 0 for all such w.
TEST(Wall, GroovesTakeTheClosestVelocity)
{
    test::Random random(3);
    for (const double angle : {0.5, 1.2, 2.0, 2.6}) {  // between the normals
        const std::vector<Wall<2>> groove{wall<2>({{0, 1}}), wall<2>({{std::sin(angle), std::cos(angle)}})};
        for (int trial = 0; trial < 50; ++trial) {
            const Vec<2> v = random_vector<2>(random), after = pushed(groove, v);
            for (const Wall<2>& w : groove) EXPECT_GT(dot(after, w.normal), -1e-3);
            for (int other = 0; other < 50; ++other) {
                const Vec<2> to = random_vector<2>(random);
                const bool is_ok =
                    std::all_of(groove.begin(), groove.end(), [&](const auto& w) { return dot(to, w.normal) >= 0; });
                if (!is_ok) continue;
                EXPECT_LT(dot(v - after, to - after), 5e-3) << angle;
            }
        }
    }
}

/// Nodes above, on and below a floor at y = 0.5.
struct Floor : testing::Test {
    const Lattice<2> lattice{Vec<2>{}, Vec<2>::filled(0.25), {4, 4}, {}, 1};
    Tiles<2> tiles{lattice, 0};
    std::vector<Wall<2>> walls{wall<2>({{0, 1}}, 0.5)};
    std::vector<Vec<2>> shifts{Vec<2>{}};
    std::vector<Condition<2>> conditions;
    Array<Lanes> nodes = Array<Lanes>(lattice.node_count());

    Floor()
    {
        walls[0].point = {{0.3, 0.5}};
        std::vector<std::uint64_t> keys;
        IndexBox<2>{{1, 1}, {5, 5}}.for_each([&](const Index<2>& c) { keys.push_back(tiles.key(c)); });
        std::sort(keys.begin(), keys.end());
        tiles.assign(keys);
    }
    void fill(Vec<2> v, double mass = 2.0)
    {
        for (Lanes& n : nodes) n = make_lanes(v[0], v[1], 0, mass, 0.125, 0.25, 0, 0);
    }
    WallNodes<2> of_walls() const
    {
        WallNodes<2> r(walls, shifts, lattice, tiles);
        r.leave({conditions, lattice, tiles});
        return r;
    }
    std::array<double, 4> at(double x, double y) const
    {
        const Lanes& n = nodes[lattice.offset({static_cast<int>(x / 0.25) + 1, static_cast<int>(y / 0.25) + 1})];
        return {n[0], n[1], n[4], n[5]};
    }
};
TEST_F(Floor, ActsOnNodesInItAndOnItsSurface)
{
    fill({{4, -1}});
    of_walls().advance(walls, shifts, nodes.data(), {0.0}, {nullptr, 1.0});
    for (const double y : {0.0, 0.25, 0.5}) EXPECT_EQ(at(0.5, y), (std::array{3.5, 0.0, -0.375, 1.25})) << y;
    for (const double y : {0.75, 1.0}) EXPECT_EQ(at(0.5, y), (std::array{4.0, -1.0, 0.125, 0.25})) << y;
}
TEST_F(Floor, LeavesNodesWithoutMass)
{
    fill({{4, -1}}, 0.0);
    of_walls().advance(walls, shifts, nodes.data(), {0.0}, {nullptr, 1.0});
    EXPECT_EQ(at(0.5, 0.5), (std::array{4.0, -1.0, 0.125, 0.25}));
}
TEST_F(Floor, MovesWithItsVelocity)
{
    walls[0].velocity[1] = Field(std::function<double(const FieldPoint&)>([](const FieldPoint& p) { return 3 * p.t; }));
    shifts[0]            = {{0, 0.26}};
    fill({{0, -1}});
    of_walls().advance(walls, shifts, nodes.data(), {2.0}, {nullptr, 1.0});
    EXPECT_EQ(at(0.5, 0.75), (std::array{0.0, 6.0, 0.125, 7.25}));
    EXPECT_EQ(at(0.5, 1.0), (std::array{0.0, -1.0, 0.125, 0.25}));
}
/// Velocities that are projected again after the kick: what the wall held is held, what it let go stays free.
TEST_F(Floor, HoldsTheSameNodesAgain)
{
    WallNodes<2> in_walls = of_walls();
    fill({{4, -1}});                                               // slips
    nodes[lattice.offset({1, 1})][NodeLane::velocity + 1] = 1.0;   // leaves
    nodes[lattice.offset({2, 1})][NodeLane::velocity]     = 0.25;  // sticks
    in_walls.advance(walls, shifts, nodes.data(), {0.0}, {nullptr, 1.0});
    fill({{4, -1}});
    std::vector<ExchangeParts> exchange(1);
    in_walls.repeat(walls, shifts, nodes.data(), velocities(walls, 0.0), {0.0, 1.0}, {&exchange, 1.0});
    EXPECT_EQ(at(0.0, 0.0), (std::array{4.0, -1.0, 0.125, 0.25}));
    EXPECT_EQ(at(0.25, 0.0), (std::array{0.0, 0.0, 0.125, 0.25}));
    EXPECT_EQ(at(0.5, 0.0), (std::array{4.0, 0.0, 0.125, 0.25}));
    double mass = 0.0, stuck = 0.0;
    for (const auto& touch : in_walls.touches(walls, shifts, nodes.data())) {
        const double m = nodes[touch.node.node][NodeLane::mass];
        if (in_walls.grip(touch.number, 0) != Grip::none) mass += m;
        if (in_walls.grip(touch.number, 0) == Grip::sticks) stuck += m;
    }
    EXPECT_EQ(exchange[0].force[1].value(), mass);
    EXPECT_EQ(exchange[0].force[0].value(), -4 * stuck);
}
TEST_F(Floor, LeavesWhatConditionsHold)
{
    Condition<2>& held = conditions.emplace_back();
    held.axis          = 1;
    held.type          = ConditionType::symmetry;
    fill({{4, -1}});
    of_walls().advance(walls, shifts, nodes.data(), {0.0}, {nullptr, 1.0});
    EXPECT_EQ(at(0.5, 0.0), (std::array{4.0, -1.0, 0.125, 0.25}));  // on y-min
    EXPECT_EQ(at(0.5, 0.25), (std::array{3.5, 0.0, -0.375, 1.25}));
}

}  // namespace
}  // namespace ordo
