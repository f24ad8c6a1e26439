// The references of the bi-material cases: what swings must have the static solution in the mean over time.
#include "verification/layered.hpp"
#include "io/gmsh.hpp"
#include "io/mesh_file.hpp"
#include "shape/cell_planting.hpp"
#include "verification/sphere_mesh.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace ordo::verification {
namespace {

constexpr double kPoisson = 0.3, kDensity = 1000.0;

Material elastic(double E) { return elastic_material(find_law("neo-hookean"), kDensity, E, kPoisson); }

/// The mean of two values over `end` s in steps of `dt`, weighted by sin^2 so that swings about it count little.
template <class F>
std::array<double, 2> mean_over_time(LayeredBody& body, double dt, double end, F&& values)
{
    std::array<double, 2> sum{};
    double weights = 0;
    for (double t = dt; t < end; t += dt) {
        body.advance(t);
        const double w                 = std::pow(std::sin(std::numbers::pi * t / end), 2);
        const std::array<double, 2> at = values();
        for (int k : {0, 1}) sum[k] += w * at[k];
        weights += w;
    }
    return {sum[0] / weights, sum[1] / weights};
}

/// Two layers of unlike length and modulus under small gravity: the stress is the weight below, strains follow from it.
TEST(LayeredBody, ColumnSwingsAboutItsStaticStretch)
{
    constexpr double g = 1e-4, middle = 2.0, top = 5.0, dt = 2e-4, end = 20.0;  // some 30 periods
    const std::array materials{elastic(1e6), elastic(4e6)};
    LayeredBody column({.geometry   = LayeredBody::Geometry::column,
                        .ends       = {0.0, middle, top},
                        .materials  = materials,
                        .elements   = {40, 60},
                        .dt         = dt,
                        .fixed_end  = LayeredBody::FixedEnd::high,
                        .body_force = [](double) { return -g; }});
    const auto [stress, tip] = mean_over_time(column, dt, end, [&] {
        return std::array{column.stress(middle), column.displacement(0.0)};
    });
    const double lower = middle * middle / 2, upper = (top * top - middle * middle) / 2;
    const double stretch = kDensity * g * (lower / materials[0].p_wave_modulus() + upper / materials[1].p_wave_modulus());
    EXPECT_NEAR(stress, kDensity * g * middle, 2e-3 * stress);
    EXPECT_NEAR(tip, -stretch, 2e-3 * stretch);
}

/// A turning ring in plane strain: sigma_r = (3 - 2 nu)/(8 (1 - nu)) rho w^2 (a^2 + b^2 - a^2 b^2/r^2 - r^2), and sigma_t with
/// + a^2 b^2/r^2 - (1 + 2 nu)/(3 - 2 nu) r^2 (Timoshenko & Goodier, Theory of Elasticity, sec. 32, in plane strain).
TEST(LayeredBody, RingSwingsAboutItsStaticStresses)
{
    constexpr double a = 1.0, b = 2.0, r = 1.5, frequency = 1.0, dt = 1e-5, end = 0.2;  // some 20 periods
    LayeredBody ring({.geometry   = LayeredBody::Geometry::ring,
                      .ends       = {a, r, b},
                      .materials  = {elastic(1e9), elastic(1e9)},
                      .elements   = {20, 20},
                      .dt         = dt,
                      .fixed_end  = LayeredBody::FixedEnd::none,
                      .body_force = [](double x) { return frequency * frequency * x; }});
    const auto [radial, hoop] = mean_over_time(ring, dt, end, [&] { return std::array{ring.stress(r), ring.hoop_stress(r)}; });
    const double factor       = (3 - 2 * kPoisson) / (8 * (1 - kPoisson)) * kDensity * frequency * frequency;
    const double inner = a * a * b * b / (r * r), own = (1 + 2 * kPoisson) / (3 - 2 * kPoisson) * r * r;
    EXPECT_NEAR(radial, factor * (a * a + b * b - inner - r * r), 1e-2 * radial);
    EXPECT_NEAR(hoop, factor * (a * a + b * b + inner - own), 1e-2 * hoop);
}

/// The mesh of cases/bimaterial-sphere is that of the case `bimaterial-sphere`.
TEST(SphereMesh, IsTheOneThatIsShipped)
{
    if (!io::has_gmsh()) GTEST_SKIP() << "built without Gmsh";
    const std::vector<Seed<3>> own = seeds_of(SphereMesh{}.cells());
    std::vector<Seed<3>> shipped;
    for (const char* group : {"sphere", "cube"}) {
        const CellMesh<3> mesh = io::read_mesh<3>(ORDO_CASES "/bimaterial-sphere/sphere_in_cube.msh", group);
        for (const CornerIds<3>& cell : mesh.cells) shipped.push_back(seed_of(mesh, cell));
    }
    ASSERT_EQ(own.size(), shipped.size());
    for (const Seed<3>& seed : own) {
        const auto nearest = std::min_element(shipped.begin(), shipped.end(), [&](const Seed<3>& one, const Seed<3>& other) {
            return norm(one.x - seed.x) < norm(other.x - seed.x);
        });
        EXPECT_LT(norm(nearest->x - seed.x), 1e-12);
        EXPECT_NEAR(nearest->volume, seed.volume, 1e-13);
    }
}

}  // namespace
}  // namespace ordo::verification
