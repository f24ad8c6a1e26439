// Material points of the shapes: counts of the papers, exact volumes, centres.
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

template <int D>
double volume(const std::vector<Seed<D>>& seeds)
{
    double v = 0;
    for (const auto& s : seeds) v += s.volume;
    return v;
}

TEST(Seeding, DisksOfTranHaveTheirParticles)
{
    const Vec<2> h = Vec<2>::filled(0.05);
    EXPECT_EQ(fill(Ball<2>{{0.3, 0.3}, 0.2}, SubCells<2>{{}, h, {3, 3}}).size(), 448u);
    EXPECT_EQ(fill(Ball<2>{{0.8, 0.8}, 0.2}, SubCells<2>{{}, h, {3, 3}}).size(), 448u);
    EXPECT_EQ(fill(Ball<2>{{0.4, 0.4}, 0.2}, SubCells<2>{{}, h, {2, 2}}).size(), 208u);
}

TEST(Seeding, BallVolumeConverges)
{
    double previous = 1;
    for (int n : {8, 16, 32}) {
        const double v     = volume(fill(Ball<3>{Vec<3>::filled(0.5), 0.4}, SubCells<3>{{}, Vec<3>::filled(1.0 / n), {2, 2, 2}}));
        const double error = std::fabs(v - 4.0 / 3 * std::numbers::pi * 0.064);
        EXPECT_LT(error, previous);
        previous = error;
    }
    EXPECT_LT(previous, 1e-3);
}

TEST(Seeding, BoxesAreFilledExactlyWhereverTheyLie)
{
    const SubCells<2> cells{{}, Vec<2>::filled(0.1), {2, 2}};
    const auto seeds = fill_box(Bounds<2>{{0.113, 0.2}, {0.487, 0.7}}, cells);
    EXPECT_NEAR(volume(seeds), 0.374 * 0.5, 1e-15);
    EXPECT_EQ(seeds.size(), 7u * 10u);
    const auto aligned = fill_box(Bounds<2>{{0.2, 0.2}, {0.4, 0.4}}, cells);
    EXPECT_EQ(aligned.size(), 16u);
    EXPECT_NEAR(aligned[0].x[0], 0.225, 1e-15);  // a sub-cell centre, not its edge
}

TEST(Seeding, PolarCellsHaveExactVolumes)
{
    const double pi = std::numbers::pi;
    const Tube<2> quarter{.center = {0.1, 0.2}, .inner = 0.4, .outer = 0.6, .from = 0, .to = pi / 2};
    const auto seeds = fill_polar(quarter, 4, 16, 1);
    EXPECT_EQ(seeds.size(), 64u);
    EXPECT_NEAR(volume(seeds), pi / 4 * (0.36 - 0.16), 1e-15);
    for (const auto& s : seeds) EXPECT_NEAR(4 * det(s.edges), s.volume, 1e-16);

    for (int axis = 0; axis < 3; ++axis) {
        const Tube<3> tube{.center = {0.5, 0.5, 0.5}, .inner = 0.1, .outer = 0.3, .axis = axis, .bottom = 0.2, .top = 0.8};
        const auto tubes = fill_polar(tube, 2, 24, 3);
        EXPECT_NEAR(volume(tubes), pi * 0.08 * 0.6, 1e-14);
        for (const auto& s : tubes) EXPECT_NEAR(8 * det(s.edges), s.volume, 1e-16);
    }
}

TEST(Seeding, PartsOfRingsAndCylinders)
{
    const double pi = std::numbers::pi;
    const SubCells<2> fine{{}, Vec<2>::filled(0.01), {2, 2}};
    const Tube<2> part{.center = {0.5, 0.5}, .inner = 0.2, .outer = 0.4, .from = -pi / 6, .to = pi / 2};
    EXPECT_NEAR(volume(fill(part, fine)), pi / 3 * 0.12, 2e-4);
    const Bounds<2> b = part.bounds();
    EXPECT_NEAR(b.lower[0], 0.5, 1e-12);  // the ray at 90 degrees
    EXPECT_NEAR(b.upper[0], 0.9, 1e-12);
    EXPECT_NEAR(b.lower[1], 0.3, 1e-12);  // the outer end of the ray at -30 degrees
    EXPECT_NEAR(b.upper[1], 0.9, 1e-12);
    const Tube<3> solid{.center = {0.5, 0.5, 0.5}, .inner = 0, .outer = 0.3, .axis = 0, .bottom = 0.25, .top = 0.75};
    EXPECT_NEAR(volume(fill(solid, SubCells<3>{{}, Vec<3>::filled(0.05), {2, 2, 2}})), pi * 0.09 * 0.5, 2e-3);
}

}  // namespace
}  // namespace ordo
