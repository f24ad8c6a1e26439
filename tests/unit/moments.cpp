#include "kernels/moment_windows.hpp"
#include "kernels/taylor.hpp"

#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace ordo::test {
namespace {

/// The lattice of a unit box with room around it.
template <int D>
Lattice<D> lattice_of(int cells, int degree, bool periodic = false)
{
    return {{}, Vec<D>::filled(1.0 / cells), Index<D>::filled(cells), Vec<D, bool>::filled(periodic), 3, {.degree = degree}};
}

/// Adds a sample at y to the records of all targets, one by one.
template <class M, class Places, int W, int D>
void add_to_all(const Lattice<D>& g, std::vector<Lanes>& records, const Vec<D>& y, const double (&u)[M::values])
{
    IndexBox<D>{{}, g.nodes}.for_each([&](const Index<D>& at) {
        Vec<D> distance{};
        double weight = 1.0;
        for (int a = 0; a < D; ++a) {
            const double target =
                std::is_same_v<Places, CellCenters> ? at[a] + 0.5 : g.cell_coordinate(a, g.node_position(a, at[a]));
            distance[a] = y[a] - target;
            weight *= spline_weight<W>(distance[a]);
        }
        if (weight > 0) M::add(&records[g.offset(at) * M::size], distance, weight, u);
    });
}

/// Every record that `spread` fills, or that windows fill, is the one that `add` fills sample by sample with the weight of each
/// target. Half of the samples share a cell, so that windows of many and of few are among them.
template <int D, int degree, class Places, int W, int totals = 0, int fields = D + 1>
void compare_spread_with_add(const Lattice<D>& g, Random& random)
{
    using M = Moments<D, degree, fields, totals>;
    std::vector<Lanes> fast(g.node_count() * M::size, Lanes{}), plain = fast, windowed = fast;
    MomentWindows<larger(D, 2), degree, fields, std::conditional_t<Places::is_even, Places, HatNodes>, W, totals> windows;
    Vec<D, Lanes> places{};
    Lanes values[M::values]{};
    int lane = 0, lanes = 1;
    for (int s = 0; s < 72; ++s) {
        Vec<D> y{};
        double u[M::values];
        for (int a = 0; a < D; ++a) y[a] = g.margin + uniform(random, 0, s % 2 ? 1 : g.cells[a]);
        for (double& value : u) value = uniform(random, -1, 1);
        M::template spread<Places, W>(g, fast.data(), y, u);
        for (int a = 0; a < D; ++a) places[a][lane] = y[a];
        for (int f = 0; f < M::values; ++f) values[f][lane] = u[f];
        if (++lane == lanes) {
            for (int k = lanes; k < 8; ++k) {  // spare lanes repeat some sample
                for (int a = 0; a < D; ++a) places[a][k] = places[a][0];
                for (int f = 0; f < M::values; ++f) values[f][k] = values[f][0];
            }
            if constexpr (has_windows<D, Places>) windows.add(places, values, lanes);
            lane  = 0;
            lanes = lanes % 8 + 1;  // twice 1 + 2 + ... + 8 samples
        }
        add_to_all<M, Places, W>(g, plain, y, u);
    }
    if constexpr (has_windows<D, Places>)
        windows.spread(g, windowed.data());
    else
        windowed = fast;
    double difference = 0.0, largest = 0.0;
    // Nodes of splines outside the grid stand on its faces and are nobody's business.
    IndexBox<D> inside{Index<D>::filled(g.margin), g.nodes};
    for (int a = 0; a < D; ++a)
        inside.hi[a] = g.margin + g.cells[a] + g.basis.degree - (std::is_same_v<Places, CellCenters> ? g.basis.degree : 0);
    inside.for_each([&](const Index<D>& at) {
        for (int k = 0; k < M::numbers; ++k) {
            const double b = M::get(&plain[g.offset(at) * M::size], k);
            for (const auto& records : {&fast, &windowed})
                difference = std::max(difference, std::fabs(M::get(&(*records)[g.offset(at) * M::size], k) - b));
            largest = std::max(largest, std::fabs(b));
        }
    });
    EXPECT_GT(largest, 0.1);
    EXPECT_LT(difference, 1e-13 * largest) << "D " << D << " degree " << degree << " width " << W;
}

template <int D, int degree>
void compare_all(Random& random)
{
    compare_spread_with_add<D, degree, HatNodes, 2>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, HatNodes, 3>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, HatNodes, 4>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, SplineNodes, 2>(lattice_of<D>(5, 2), random);
    compare_spread_with_add<D, degree, SplineNodes, 4>(lattice_of<D>(5, 2), random);
    compare_spread_with_add<D, degree, SplineNodes, 4>(lattice_of<D>(5, 3), random);
    compare_spread_with_add<D, degree, SplineNodes, 4, 1>(lattice_of<D>(5, 2), random);
    compare_spread_with_add<D, degree, HatNodes, 3, 2>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, HatNodes, 4, 1, D>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, CellCenters, 1>(lattice_of<D>(5, 1), random);
    compare_spread_with_add<D, degree, CellCenters, 3>(lattice_of<D>(5, 2), random);
}

TEST(Moments, SpreadEqualsAdd)
{
    Random random(11);
    compare_all<1, 0>(random);
    compare_all<1, 1>(random);
    compare_all<1, 3>(random);
    compare_all<2, 0>(random);
    compare_all<2, 1>(random);
    compare_all<2, 2>(random);
    compare_all<3, 1>(random);
    compare_all<3, 2>(random);
}

/// Where a sample is 1/1024 of a cell within the support of a target its weight in 3D is 2e-28; windows have it, and the numbers that
/// belong to it, to the last digits beside weights near 1.
TEST(Moments, SmallWeightsKeepTheirDigits)
{
    using M    = Moments<3, 1, 1>;
    auto g     = lattice_of<3>(5, 1);
    auto plain = std::vector<Lanes>(g.node_count() * M::size, Lanes{}), windowed = plain;
    MomentWindows<3, 1, 1, HatNodes, 4> windows;
    for (const double fraction : {1.0 / 1024, 1 - 1.0 / 1024}) {
        const auto y      = Vec<3>::filled(g.margin + 2 + fraction);
        const double u[1] = {0.75};
        Vec<3, Lanes> place;
        for (int a = 0; a < 3; ++a) place[a] = Lanes(y[a]);
        windows.add(place, {Lanes(u[0])}, 1);
        windows.spread(g, windowed.data());
        add_to_all<M, HatNodes, 4>(g, plain, y, u);
        double largest = 0.0, smallest = 1.0;
        IndexBox<3>{{}, g.nodes}.for_each([&](const Index<3>& at) {
            for (int k = 0; k < M::numbers; ++k) {
                const double expected = M::get(&plain[g.offset(at) * M::size], k);
                EXPECT_NEAR(M::get(&windowed[g.offset(at) * M::size], k), expected, 1e-14 * std::fabs(expected));
                largest = std::max(largest, std::fabs(expected));
                if (expected != 0.0) smallest = std::min(smallest, std::fabs(expected));
            }
        });
        EXPECT_GT(largest, 0.2);
        EXPECT_LT(smallest, 1e-27);
        std::fill(plain.begin(), plain.end(), Lanes{});
        std::fill(windowed.begin(), windowed.end(), Lanes{});
    }
}

}  // namespace
}  // namespace ordo::test
