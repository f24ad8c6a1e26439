// Fluids and grains that flow: pressures, viscous stresses, closed forms.
#include "material/fluid.hpp"
#include "material/mu_i.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "support/driven.hpp"

#include <gtest/gtest.h>

namespace ordo::test {
namespace {

/// Tait's pressure, and that it is the derivative of the energy.
TEST(Fluid, Pressure)
{
    const Material m = material_of("fluid", {"density=1000", "sound_speed=20", "gamma=7"});
    const double K = 1000.0 * 20 * 20, h = 1e-5;
    EXPECT_EQ(m.bulk_modulus(), K);
    EXPECT_EQ(m.wave_speed(), 20);
    for (const double l : {0.9, 0.99, 1.0, 1.05}) {
        auto at = [&](double stretch) {
            Driven<2> point(m);
            point.step({{{stretch, 0.3}, {0, 1.1}}});
            return point;
        };
        const double J = 1.1 * l, p = K / 7 * (std::pow(J, -7) - 1);
        const Driven<2> now = at(l);
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(now.sigma(a, a), -p, 1e-11 * K);
        EXPECT_EQ(now.sigma(0, 1), 0);
        EXPECT_NEAR((at(l + h).stored() - at(l - h).stored()) / (2 * h * 1.1), -p, 1e-6 * K);
        const Stiffness s = now.functions().stiffness(m, now.F, now.history.data());
        EXPECT_NEAR(s.modulus, K * std::pow(J, -6), 1e-12 * K) << "J dp/dJ";
        EXPECT_EQ(s.viscosity, 0);
    }
    EXPECT_NEAR(Driven<3>(m).stored(), 0, 1e-10);
}

/// Newton: sigma_12 = eta times the shear rate, and the work of it is dissipated.
TEST(Fluid, NewtonianShear)
{
    const Material m = material_of("fluid", {"sound_speed=10", "viscosity=3"});
    auto shear       = [&](int steps) {
        Driven<2> point(m);
        for (int k = 1; k <= steps; ++k) point.step({{{1, 0.8 * k / steps}, {0, 1}}}, 0.5 / steps);
        return point;
    };
    const double rate    = 0.8 / 0.5;
    const Driven<2> fine = shear(2000);
    EXPECT_NEAR(fine.sigma(0, 1), 3 * rate, 1e-6);
    EXPECT_NEAR(fine.column("dissipated"), 3 * rate * rate * 0.5, 1e-6);
    EXPECT_NEAR(shear(200).sigma(0, 0) / fine.sigma(0, 0), 10, 0.01) << "first order";
    EXPECT_NEAR(fine.sigma(0, 0), 0, 1e-3 * 3 * rate);
}

/// Uniaxial flow: sigma_11 + p = (4/3) eta l'/l, exact in any step with the logarithmic rate.
template <int D>
void check_uniaxial_flow()
{
    const Material m = material_of("fluid", {"sound_speed=10", "viscosity=3"});
    Driven<D> point(m);
    Mat<D> F = Mat<D>::identity();
    F(0, 0)  = std::exp(0.3);
    point.step(F, 0.2);
    const double p = -trace(point.sigma) / 3;
    EXPECT_NEAR(point.sigma(0, 0) + p, 4.0 / 3 * 3 * 0.3 / 0.2, 1e-12);
    EXPECT_NEAR(point.sigma(2, 2) + p, -2.0 / 3 * 3 * 0.3 / 0.2, 1e-12);
    EXPECT_NEAR(point.column("dissipated"), std::exp(0.3) * 4.0 / 3 * 3 * 1.5 * 1.5 * 0.2, 1e-12);
}
TEST(Fluid, UniaxialFlow)
{
    check_uniaxial_flow<1>();
    check_uniaxial_flow<2>();
    check_uniaxial_flow<3>();
}

/// Bingham: |sigma_12| = yield + eta rate above the critical rate, (yield/critical + eta) rate below.
TEST(Fluid, BinghamShear)
{
    const Material m = material_of("fluid", {"sound_speed=10", "viscosity=3", "yield=7", "critical_rate=0.5"});
    for (const double rate : {0.1, 0.4999, 0.5001, 20.0}) {
        Driven<2> point(m);
        const double dt = 1e-5 / rate;
        point.step({{{1, rate * dt}, {0, 1}}}, dt);
        EXPECT_NEAR(point.sigma(0, 1), rate < 0.5 ? (7 / 0.5 + 3) * rate : 7 + 3 * rate, 1e-8) << rate;
    }
    EXPECT_EQ(Driven<2>(m).functions().stiffness(m, Mat<2>::identity(), nullptr).viscosity, 3 + 14);
}

/// Without tension an expanded fluid has neither pressure nor energy; a step without time has no viscous stress.
TEST(Fluid, WithoutTensionOrTime)
{
    Driven<3> point(material_of("fluid", {"sound_speed=10", "viscosity=3", "tension=false"}));
    point.step({{{1.1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 0.0);
    EXPECT_EQ(square(point.sigma), 0);
    EXPECT_EQ(point.stored(), 0);
    point.step({{{0.9, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 0.0);
    EXPECT_LT(point.sigma(0, 0), 0);
    EXPECT_GT(point.stored(), 0);
}

/// The limits of steps for particles of a fluid, stretched by l along x: stable and automatic.
template <int D>
std::pair<double, double> time_steps(int cells, const std::vector<std::string>& settings, double l = 1.0,
                                     const MethodSpec& method = {})
{
    Model<D> model  = unit_box<D>(cells, method);
    model.materials = {material_of("fluid", settings)};
    Particles<D> p  = plant_halves(model, block(model, 0.25, 0.75, 2));
    for (int i = 0; i < p.count; ++i) {
        p.F[i]       = Mat<D>::identity();
        p.F[i](0, 0) = l;
        p.V[i]       = l * p.V0[i];
        p.m[i]       = 1000 * p.V0[i];
    }
    return {stable_time_step(model, p), automatic_time_step(model, p, 0.4)};
}

/// The time step follows the compression.
TEST(Fluid, TimeStep)
{
    const auto [rest, usual]      = time_steps<2>(4, {"sound_speed=10"});
    const auto [pressed, shorter] = time_steps<2>(4, {"sound_speed=10"}, 0.9);
    EXPECT_NEAR(pressed / rest, std::pow(0.9, 3), 1e-12) << "c = c0 J^-3";
    EXPECT_NEAR(shorter / usual, std::pow(0.9, 3), 1e-12);
    EXPECT_EQ(time_steps<2>(4, {"sound_speed=10"}, 0.0).first, rest) << "before the start there is no F";
}

/// How much velocities grow in 1000 explicit steps: a periodic row of cells with the stress of the law and lumped masses, which
/// starts at rest but for its fastest mode and some noise.
double growth(const Material& m, int cells, double dt)
{
    Random random(31);
    std::vector<Driven<1>> cell(static_cast<std::size_t>(cells), Driven<1>(m));
    std::vector<double> v(cell.size());
    const double h = 1.0 / cells, start = 1e-9;
    for (std::size_t k = 0; k < v.size(); ++k) v[k] = start * ((k % 2 ? 0.5 : -0.5) + uniform(random, -0.5, 0.5));
    double largest = 0;
    for (int n = 0; n < 1000 && largest < 1e-3; ++n) {
        for (std::size_t k = 0; k < v.size(); ++k)
            cell[k].step({{{cell[k].F(0, 0) + dt * (v[(k + 1) % v.size()] - v[k]) / h}}}, dt);
        for (std::size_t k = 0; k < v.size(); ++k) {
            v[k] += dt * (cell[k].sigma(0, 0) - cell[(k + v.size() - 1) % v.size()].sigma(0, 0)) / (m.density * h);
            largest = std::max(largest, std::fabs(v[k]));
        }
    }
    return largest / start;
}

/// A row of cells is stable at the limit, and not much beyond it: for viscosity alone, and where waves and viscosity allow the
/// same step each, at which they are unstable together.
TEST(Fluid, ViscousTimeStep)
{
    constexpr int cells = 16;
    const std::vector<std::string> viscous{"sound_speed=0.01", "viscosity=5000"}, elastic{"sound_speed=150"},
        both{"sound_speed=150", "viscosity=5000"};
    const double of_viscosity = time_steps<1>(cells, viscous).first, of_waves = time_steps<1>(cells, elastic).first;
    EXPECT_LT(growth(material_of("fluid", viscous), cells, of_viscosity), 2);
    EXPECT_GT(growth(material_of("fluid", viscous), cells, 1.05 * of_viscosity), 1e3) << "the limit is not far from this";
    EXPECT_NEAR(of_viscosity / of_waves, 1, 0.1);
    const double together = time_steps<1>(cells, both).first;
    EXPECT_LT(growth(material_of("fluid", both), cells, together), 2);
    EXPECT_GT(growth(material_of("fluid", both), cells, std::min(of_viscosity, of_waves)), 1e3);
    EXPECT_GT(together, 0.4 * std::min(of_viscosity, of_waves));
    EXPECT_LT(time_steps<1>(cells, both).second, together) << "automatic, with a smaller share of the wave";
    EXPECT_NEAR(time_steps<2>(cells, viscous).first / of_viscosity, 0.5, 1e-3) << "two axes";
    // The largest eigenvalue of M^-1 K in units of 1/h^2 is 4 with hats and lumped mass, and (2/0.430)^2 with quadratic splines and
    // the consistent mass. Flows at this limit: `ordo verify couette`.
    const MethodSpec splines{.basis = Basis::bspline2, .mass = MassMatrix::consistent};
    EXPECT_NEAR(time_steps<1>(cells, viscous, 1.0, splines).first / of_viscosity, 0.430 * 0.430, 1e-3);
    EXPECT_NEAR(time_steps<2>(cells, viscous, 1.0, splines).first / of_viscosity, 0.430 * 0.430 / 2, 1e-3);
}

// ---- grains ---------------------------------------------------------------------------------------------------------------

Material grains(const std::vector<std::string>& more = {})
{
    std::vector<std::string> settings{"young=1000",          "poisson=0.2",      "friction_static=0.38", "friction_dynamic=0.64",
                                      "inertial_number=0.3", "grain_diameter=8", "grain_density=3"};
    settings.insert(settings.end(), more.begin(), more.end());
    return material_of("mu-i", settings);
}

/// The rate follows from t = mu(I) p, inverted: I = I0 (mu - mu_s)/(mu_2 - mu). The stress starts at a pressure.
RateLawOf rates_of_grains(const Material& m)
{
    const auto p      = m.parameters;
    const auto stress = hencky_stress(m);
    auto t_of         = [](const Tensor& tau) { return dev_of(tau).norm() / std::sqrt(2.0); };
    return {.stress = stress,
            .yield  = [=](const RateState& s) { return t_of(stress(s)) + p[0] * stress(s).trace() / 3; },
            .flow =
                [=](const RateState& s, const Tensor&) {
                    const Tensor tau      = stress(s);
                    const double pressure = -tau.trace() / 3, mu = t_of(tau) / pressure;
                    RateFlow f{.gamma = p[2] * (mu - p[0]) / (p[1] - mu) * std::sqrt(pressure / p[4]) / p[3],
                               .N     = dev_of(tau) / (2 * t_of(tau))};
                    return f;
                },
            .is_viscous = true};
}

TEST(MuI, AgreesWithItsRateEquations)
{
    const Material m = grains();
    RateState start;
    start.b            = std::exp(-0.2) * Tensor::Identity();  // theta = -0.3
    const Comparison c = compare(
        m, rates_of_grains(m), start, [](Random& r) { return random_path(r, 0.25, 0.1, 0.02); }, 1000, 300);
    EXPECT_LT(c.worst, 1e-6);
    EXPECT_LT(c.worst_work, 1e-5);
    EXPECT_NEAR(c.order, 1, 0.1);
    EXPECT_GT(c.with_events, 150);
}

/// After each step t = mu(I) p, with the rate of the step; slow flow mobilises mu_s, fast flow at most mu_2.
TEST(MuI, FrictionOfTheRate)
{
    const Material m = grains();
    for (const double dt : {1e-7, 1e-3, 0.01, 1.0, 1e4}) {
        Driven<2> point(m);
        const double l = std::exp(-0.05);
        point.step({{{l, 0}, {0, l}}}, dt);
        double alpha = 0;
        for (int k = 1; k <= 5; ++k) {
            alpha = point.column("plastic_strain");
            point.step({{{l, 0.1 * k}, {0, l}}}, dt);
        }
        const double rate = std::sqrt(3.0) * (point.column("plastic_strain") - alpha) / dt, p = -trace(point.kirchhoff()) / 3;
        const double inertial = rate * 8 * std::sqrt(3 / p), t = std::sqrt(square(deviator(point.kirchhoff())) / 2);
        EXPECT_NEAR(t / p, 0.38 + (0.64 - 0.38) / (0.3 / inertial + 1), 1e-11) << dt;
        EXPECT_GT(t / p, dt < 1e-6 ? 0.6399 : 0.38);
        EXPECT_LT(t / p, dt > 100 ? 0.3801 : 0.64);
    }
}

/// Grains that start apart carry nothing and store nothing, also when they were sheared before; after they touch, they carry what
/// they were compressed since.
TEST(MuI, StartsApart)
{
    const Material m   = grains();
    const Mat<3> F     = {{{1.1, 0.2, 0}, {0, 1.05, 0}, {0, 0, 1}}};
    const auto& of_law = m.law->in<3>();
    EXPECT_EQ(square(of_law.initial_stress(m, F)), 0);
    Driven<3> point(m);
    of_law.start(m, F, point.history.data());
    point.F = F;
    EXPECT_EQ(point.stored(), 0);
    point.step(F * std::cbrt(0.98 / 1.155), 0.1);
    EXPECT_NEAR(trace(point.kirchhoff()) / 3, m.bulk_modulus() * std::log(0.98), 1e-10);
    EXPECT_NEAR(square(deviator(point.kirchhoff())), 0, 1e-20);
}

/// Grains that are pulled apart carry nothing, and touch again where they parted.
TEST(MuI, Separation)
{
    const Material m = grains();
    Driven<3> point(m);
    auto at = [&](double J, double shear) {
        const double l = std::cbrt(J);
        return point.step({{{l, shear, 0}, {0, l, 0}, {0, 0, l}}}, 0.1);
    };
    at(0.98, 0.1);
    EXPECT_LT(trace(point.sigma), 0);
    at(1.02, 0.1);
    EXPECT_EQ(square(point.sigma), 0);
    at(1.1, 0.6);
    EXPECT_EQ(square(point.sigma), 0);
    EXPECT_EQ(point.stored(), 0);
    at(1.01, 0.6);
    EXPECT_EQ(square(point.sigma), 0);
    at(0.99, 0.6);
    EXPECT_NEAR(trace(point.kirchhoff()) / 3, m.bulk_modulus() * std::log(0.99), 1e-11);
}

}  // namespace
}  // namespace ordo::test
