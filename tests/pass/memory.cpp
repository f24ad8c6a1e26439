// What a model costs: memory for its material, not for its grid.
#include "method/layout.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <new>
#include <string>

namespace ordo {
namespace {

/// Memory of this process that is there, bytes; 0 where the system does not say.
std::size_t resident()
{
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmRSS:")) return std::stoul(line.substr(6)) << 10;
    return 0;
}

constexpr std::size_t kMegabyte = 1 << 20;

TEST(Memory, ArraysCostWhatIsTouched)
{
    const std::size_t before = resident();
    if (before == 0) GTEST_SKIP() << "the system does not say how much memory a process has";
    constexpr std::size_t n = std::size_t{1} << 31;  // 128 GiB
    Array<Lanes> nodes(n);
    for (std::size_t k = 0; k < n; k += n / 8) nodes[k][0] = 1.0;
    Array<Lanes> moved(std::move(nodes));
    EXPECT_EQ(moved.size(), n);
    EXPECT_EQ(moved[n / 2][0], 1.0);
    EXPECT_EQ(moved[n - 1][7], 0.0);
    EXPECT_LT(resident(), before + kMegabyte);
}

TEST(Memory, ArraysTooLargeForAnyMachineAreRefused)
{
    for (const int bits : {50, 60}) EXPECT_THROW(Array<Lanes>(std::size_t{1} << bits), std::bad_alloc);
}

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kMost = 256 * kMegabyte;  // the sanitizer keeps what was freed
#else
constexpr std::size_t kMost = 64 * kMegabyte;
#endif

/// 16 cells a side in a corner of 1024, with the images of that corner on all sides.
TEST(Memory, AHugeGridCostsItsMaterial)
{
    const std::size_t before = resident();
    if (before == 0) GTEST_SKIP() << "the system does not say how much memory a process has";
    for (const bool is_periodic : {false, true}) {
        Model<3> model      = test::unit_box<3>(1024, Domain::point);
        model.periodic      = Vec<3, bool>::filled(is_periodic);
        model.method.scheme = TimeScheme::musl;  // two arrays of nodes
        for (int a = 0; a < 3 && !is_periodic; ++a) model.conditions.push_back(Condition<3>{.axis = a, .at = 0.0, .value = {}});
        const Explicit<3> method(model);
        Particles<3> p = plant_all(model, test::block(model, 0.0, 16.0 / 1024, 2));
        for (int i = 0; i < p.count; ++i) p.v[i] = {0.1, -0.2, 0.3};
        State<3> s      = method.start(std::move(p));
        const double dt = 0.3 * courant_time_step(model, s.particles);
        for (int k = 0; k < 5; ++k) method.step(s, dt);
        sort_particles(model, s);
        EXPECT_GT(s.field.nodes.size(), std::size_t{1} << 30);
        EXPECT_LT(resident(), before + kMost);
    }
}

}  // namespace
}  // namespace ordo
