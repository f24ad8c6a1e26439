// Walls with a consistent mass matrix: the conditions of contact and friction hold at each node, with the matrix from its definition.
#include "method/wall_contact.hpp"
#include "kernels/nodes.hpp"
#include "method/explicit.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

/// A block that reaches into walls, with random velocities and forces at its nodes, one step before the walls are felt.
struct Block {
    static constexpr double dt = 0.1;
    Explicit<2> method;
    Passes<2> passes;
    State<2> s;
    std::vector<Vec<2>> v, f;

    explicit Block(const Model<2>& model)
        : method(model),
          passes(choose_passes<2>(model.method)),
          s(method.start(plant_all(method.model(), test::block(method.model(), 0.125, 0.875, 3))))
    {
        clear(nodes(), s.field.tiles);
        s.field.tiles.for_each_by_colour([&](const Tile& t) { passes.project(sweep(), t.begin, t.end); });
        test::Random random(7);
        for (Lanes& n : s.field.nodes) {
            v.push_back({test::uniform(random, -1, 1), test::uniform(random, -1, 1)});
            f.push_back(n[NodeLane::mass] / dt * Vec<2>{test::uniform(random, -1, 1), test::uniform(random, -1, 1)});
            for (int a = 0; a < 2; ++a) {
                n[NodeLane::velocity + a]  = v.back()[a];
                n[NodeLane::increment + a] = f.back()[a];
            }
        }
    }
    Lanes* nodes() { return s.field.nodes.data(); }
    Sweep<2> sweep() { return {s.lattice, s.particles.view(), nodes(), nullptr, 0, 0, 0}; }

    /// The impulses over the step: forces and accelerations in place of the nodes' records.
    void solve(const ExchangeSums<2>& sums)
    {
        const MassSolver<2> solver(passes, 0.0, false);
        s.field.constraints.for_each_velocity(method.model().conditions, {}, [&](std::ptrdiff_t node, int a, bool, double) {
            s.field.known[node][NodeLane::increment + a] = 0;
        });
        WallContact<2> walls(method.model(), s, nodes(), s.field.known.data(), {}, dt);
        ASSERT_FALSE(walls.is_empty());
        walls.solve(
            [&](const std::vector<HeldNode<2>>& held) {
                solver.solve(s, sweep(), nodes(), s.field.known.data(), MassSolver<2>::kAcceleration, held);
            },
            [&] { solver.multiply_solution(s, sweep(), nodes()); }, sums);
    }
    Vec<2> acceleration(std::size_t i) { return {nodes()[i][NodeLane::increment], nodes()[i][NodeLane::increment + 1]}; }
    /// M a - f, from the definition of M.
    std::vector<Vec<2>> reactions()
    {
        std::vector<Vec<2>> r(s.field.nodes.size());
        for (int p = 0; p < s.particles.count; ++p)
            test::with_shape<2>(method.model().method, [&](auto shape) {
                std::vector<std::pair<std::ptrdiff_t, double>> phi;
                decltype(shape)::type::for_each_node(
                    s.lattice, s.particles.view(), p, nodes(),
                    [&](std::ptrdiff_t node, double w, const Vec<2>&) { phi.emplace_back(node, w); });
                for (const auto& [i, wi] : phi)
                    for (const auto& [j, wj] : phi)
                        r[i] += s.particles.m[p] * wi * wj * acceleration(static_cast<std::size_t>(j));
            });
        for (std::size_t i = 0; i < r.size(); ++i) r[i] -= f[i];
        return r;
    }
};

Model<2> walled(Basis basis, const std::vector<Wall<2>>& walls)
{
    Model<2> model = test::unit_box<2>(8, {.basis = basis, .mass = MassMatrix::consistent});
    model.walls    = walls;
    model.conditions.push_back({.axis = 0, .at = 0.2, .type = ConditionType::symmetry});
    return model;
}

Wall<2> wall(Vec<2> normal, Vec<2> point, double friction, Vec<2> velocity)
{
    return {.point    = point,
            .normal   = (1 / norm(normal)) * normal,
            .velocity = {Field(velocity[0]), Field(velocity[1])},
            .friction = friction};
}

class OneWall : public testing::TestWithParam<std::tuple<Basis, double>> {};

TEST_P(OneWall, PushesAndRubs)
{
    const auto [basis, friction] = GetParam();
    const Vec<2> u{0.1, 0.2};
    const Wall<2> w = wall({0.3, 1.0}, {0.5, 0.3}, friction, u);
    Block block(walled(basis, {w}));
    std::vector<ExchangeParts> sum(1);
    block.solve({&sum, Block::dt});
    const std::vector<Vec<2>> R = block.reactions();
    int pushed = 0, left = 0, stuck = 0, slid = 0;
    Vec<2> total{};
    for (std::size_t i = 0; i < R.size(); ++i) {
        const double m = block.nodes()[i][NodeLane::mass], tolerance = 1e-7;
        if (!(m > 0)) continue;
        const Index<2> at = block.s.lattice.index(static_cast<std::ptrdiff_t>(i));
        const Vec<2> x{block.s.lattice.node_position(0, at[0]), block.s.lattice.node_position(1, at[1])};
        const bool is_held = x[0] <= 0.2;  // across the plane of symmetry, at rest
        const Vec<2> after = block.v[i] + Block::dt * block.acceleration(i), impulse = (Block::dt / m) * R[i];
        if (w.distance(x, {}) > 1e-9) {
            EXPECT_LT(std::fabs(impulse[1]) + (is_held ? 0.0 : std::fabs(impulse[0])), tolerance);
            continue;
        }
        total += R[i];
        if (is_held) {  // only the free component can follow the wall
            EXPECT_LT(std::fabs(block.acceleration(i)[0]), tolerance);
            EXPECT_GT(dot(after - u, w.normal), -tolerance);
            continue;
        }
        const double push = dot(impulse, w.normal), gap = dot(after - u, w.normal);
        const Vec<2> rub = impulse - push * w.normal, slip = after - u - gap * w.normal;
        EXPECT_GT(push, -tolerance);
        EXPECT_GT(gap, -tolerance);
        EXPECT_LT(std::fabs(push * gap), tolerance);
        EXPECT_LT(norm(rub), friction * push + tolerance);
        if (push > tolerance && norm(slip) > tolerance) {
            EXPECT_LT(norm(rub + (friction * push / norm(slip)) * slip), 10 * tolerance);
        }
        ++(push > tolerance ? pushed : left);
        if (push > tolerance) ++(norm(slip) > tolerance ? slid : stuck);
    }
    EXPECT_NEAR(sum[0].force[1].value(), total[1], 1e-6 * norm(total));  // along y no condition has a part in it
    if (friction == 0.0) {
        EXPECT_NEAR(sum[0].work.value(), -Block::dt * (u[0] * sum[0].force[0].value() + u[1] * sum[0].force[1].value()),
                    1e-6 * norm(total));
    }
    EXPECT_GT(pushed, 2);
    EXPECT_GT(left, 0);
    EXPECT_GT(friction < 1 ? slid : stuck, 0);
}

INSTANTIATE_TEST_SUITE_P(Bases, OneWall,
                         testing::Combine(testing::Values(Basis::hat, Basis::bspline2, Basis::ddmpm),
                                          testing::Values(0.0, 0.4, 5.0)));

/// Two walls at an acute angle: reactions lie in the cone of both normals.
TEST(TwoWalls, HoldTogether)
{
    const std::vector<Wall<2>> two{wall({0.3, 1.0}, {0.5, 0.3}, 0.0, {}), wall({-1.0, 0.6}, {0.7, 0.5}, 0.0, {})};
    Block block(walled(Basis::hat, two));
    block.solve({nullptr, Block::dt});
    const std::vector<Vec<2>> R = block.reactions();
    int both                    = 0;
    for (std::size_t i = 0; i < R.size(); ++i) {
        const double m = block.nodes()[i][NodeLane::mass], tolerance = 1e-7;
        if (!(m > 0)) continue;
        const Index<2> at = block.s.lattice.index(static_cast<std::ptrdiff_t>(i));
        const Vec<2> x{block.s.lattice.node_position(0, at[0]), block.s.lattice.node_position(1, at[1])};
        if (x[0] <= 0.2 || two[0].distance(x, {}) > 1e-9 || two[1].distance(x, {}) > 1e-9) continue;
        ++both;
        const Vec<2> after = block.v[i] + Block::dt * block.acceleration(i), impulse = (Block::dt / m) * R[i];
        // impulse = p0 n0 + p1 n1
        const double d  = two[0].normal[0] * two[1].normal[1] - two[0].normal[1] * two[1].normal[0];
        const double p0 = (impulse[0] * two[1].normal[1] - impulse[1] * two[1].normal[0]) / d;
        const double p1 = (two[0].normal[0] * impulse[1] - two[0].normal[1] * impulse[0]) / d;
        for (const auto& [p, w] : {std::pair(p0, two[0]), std::pair(p1, two[1])}) {
            EXPECT_GT(p, -tolerance);
            EXPECT_GT(dot(after, w.normal), -tolerance);
            EXPECT_LT(std::fabs(p * dot(after, w.normal)), tolerance);
        }
    }
    EXPECT_GT(both, 1);
}

}  // namespace
}  // namespace ordo
