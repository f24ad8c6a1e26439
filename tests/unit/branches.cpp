// Maxwell branches beside a law: relaxation, order, objectivity and energy of one particle.
#include "material/branches.hpp"

#include "support/driven.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace ordo::test {
namespace {

constexpr double kShear = 300, kTime = 0.4;

Material with_branches(const std::string& law, std::vector<std::string> branches = {"branch_shear=[300]", "branch_time=[0.4]"},
                       int dim = 3)
{
    std::vector<std::string> settings = sample_settings(law);
    settings.insert(settings.end(), branches.begin(), branches.end());
    return material_of(law, settings, dim);
}

/// At rest the stress of a branch falls by exp(-t/T), whatever the steps, and goes to heat.
TEST(Branches, RelaxExactlyAtRest)
{
    Mat<2> F = Mat<2>::identity();
    F(0, 1)  = 0.3;
    for (const int steps : {1, 7}) {
        Driven<2> point(with_branches("neo-hookean")), law(sample_material("neo-hookean"));
        point.step(F, 0.0);
        law.step(F, 0.0);
        const Stress<2> glassy = point.sigma + -1.0 * law.sigma;
        const double stored    = point.stored() - law.stored();
        EXPECT_NEAR(glassy(0, 1), 4 * kShear * std::asinh(0.15) / std::sqrt(4.09), 1e-10);  // Hencky's simple shear
        for (int k = 0; k < steps; ++k) point.step(F, 0.5 / steps);
        law.step(F, 0.5);
        const double left = std::exp(-0.5 / kTime);
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(point.sigma.c[c] - law.sigma.c[c], left * glassy.c[c], 1e-10);
        EXPECT_NEAR(point.stored() - law.stored(), left * left * stored, 1e-10);
        EXPECT_NEAR(point.column("dissipated"), (1 - left * left) * stored, 1e-10);
    }
}

/// b' = l b + b l^T - (1/T) dev(ln b) b, by Runge-Kutta steps: the Kirchhoff stress at t = 1.
Tensor branch_by_its_rates(const SmoothPath& path, int steps)
{
    auto rate = [&](const Tensor& b, double t) -> Tensor {
        const Tensor l = path.rate(t) * path.F(t).inverse();
        return l * b + b * l.transpose() - dev_of(log_of(b)) * b / kTime;
    };
    Tensor b       = Tensor::Identity();
    const double h = 1.0 / steps;
    for (int k = 0; k < steps; ++k) {
        const double t  = k * h;
        const Tensor k1 = rate(b, t), k2 = rate(b + h / 2 * k1, t + h / 2), k3 = rate(b + h / 2 * k2, t + h / 2),
                     k4 = rate(b + h * k3, t + h);
        b += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        b = (b + b.transpose().eval()) / 2;
    }
    return kShear * dev_of(log_of(b));
}

TEST(Branches, AreSecondOrderAgainstTheirRateEquation)
{
    Random random(41);
    double order = 0, worst = 0;
    constexpr int paths = 200;
    for (int n = 0; n < paths; ++n) {
        const SmoothPath path       = random_path(random, 0.3);
        const Symmetric<3> true_tau = [&] {
            const Mat<3> m = to_mat(branch_by_its_rates(path, 200));
            return make_stress(m, 0.0);
        }();
        auto drive_law = [&](int steps) {
            Driven<3> with(with_branches("ogden")), without(sample_material("ogden"));
            for (int k = 1; k <= steps; ++k) {
                with.step(to_mat(path.F(static_cast<double>(k) / steps)), 1.0 / steps);
                without.step(to_mat(path.F(static_cast<double>(k) / steps)), 1.0 / steps);
            }
            return with.kirchhoff() + -1.0 * without.kirchhoff();
        };
        const Symmetric<3> coarse = drive_law(40), fine = drive_law(80);
        const double size = std::sqrt(square(true_tau)), e1 = distance(coarse, true_tau), e2 = distance(fine, true_tau);
        order += std::log2(e1 / e2) / paths;
        worst = std::max(worst, distance(4.0 / 3 * fine + -1.0 / 3 * coarse, true_tau) / size);
    }
    EXPECT_NEAR(order, 2.0, 0.05);
    EXPECT_LT(worst, 1e-6);
    RecordProperty("worst", std::to_string(worst * 1e6) + "e-6");
    RecordProperty("order", std::to_string(order));
}

TEST(Branches, TurnWithTheBody)
{
    const Material m = with_branches("j2", {"branch_shear=[300, 80]", "branch_time=[0.4, 0.05]"});
    Random random(5);
    Driven<3> still(m), turning(m);
    for (int k = 0; k < 6; ++k) {
        const Mat<3> F = random_deformation<3>(random, 0.2), Q = random_rotation(random);
        still.step(F, 0.1);
        turning.step(Q * F, 0.1);
        const Mat<3> expected = Q * full(still.sigma) * transpose(Q);
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j) EXPECT_NEAR(turning.sigma(i, j), expected(i, j), 1e-12 * m.p_wave_modulus());
        EXPECT_NEAR(turning.column("dissipated"), still.column("dissipated"), 1e-12 * m.p_wave_modulus());
    }
}

/// Work is stored or lost, what is lost never comes back, and several branches add up.
TEST(Branches, KeepEnergyAndAddUp)
{
    for (const char* law : {"neo-hookean", "j2"}) {
        double error[2] = {};
        for (int fine = 0; fine < 2; ++fine) {
            Random random(9);
            const SmoothPath path = random_path(random, 0.3);
            const int steps       = fine ? 400 : 200;
            Driven<3> both(with_branches(law, {"branch_shear=[300, 80]", "branch_time=[0.4, 0.05]"})), one(with_branches(law)),
                other(with_branches(law, {"branch_shear=[80]", "branch_time=[0.05]"})), none(sample_material(law));
            double work = 0, lost = 0;
            for (int k = 1; k <= steps; ++k) {
                const Mat<3> F = to_mat(path.F(static_cast<double>(k) / steps)), before = both.F;
                const Mat<3> P0 = full(both.kirchhoff()) * transpose(inverse(both.F));
                for (Driven<3>* point : {&both, &one, &other, &none}) point->step(F, 1.0 / steps);
                const Mat<3> P1 = full(both.kirchhoff()) * transpose(inverse(F));
                for (int c = 0; c < 9; ++c)
                    work += 0.5 * (P0(c / 3, c % 3) + P1(c / 3, c % 3)) * (F(c / 3, c % 3) - before(c / 3, c % 3));
                EXPECT_GE(both.column("dissipated"), lost);
                lost = both.column("dissipated");
            }
            error[fine] = std::fabs(work - both.stored() - lost) / work;
            EXPECT_LT(distance(both.sigma + none.sigma, one.sigma + other.sigma), 1e-10);
            EXPECT_GT(lost, 0.01 * work);
        }
        EXPECT_LT(error[1], 2e-3);
        EXPECT_LT(error[1], 0.6 * error[0]);
    }
}

/// Planes and uniaxial strain as the same path in 3D; eight particles as each alone.
TEST(Branches, AreTheSameInEveryDimensionAndLane)
{
    const Material in_3d = with_branches("neo-hookean");
    Driven<1> line(with_branches("neo-hookean", {"branch_shear=[300]", "branch_time=[0.4]"}, 1));
    Driven<3> space(in_3d);
    Mat<1> F1 = Mat<1>::identity();
    Mat<3> F3 = Mat<3>::identity();
    for (int k = 1; k <= 5; ++k) {
        F1(0, 0) = F3(0, 0) = 1 - 0.05 * k;
        line.step(F1, 0.1);
        space.step(F3, 0.1);
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(line.sigma(a, a), space.sigma(a, a), 1e-11);
    }
    Random random(2);
    Step<3, Lanes> step{};
    step.dt = 0.2;
    Step<3> alone[8];
    for (int k = 0; k < 8; ++k) {
        alone[k] = {random_deformation<3>(random, std::pow(0.3, k)),
                    random_deformation<3>(random, std::pow(0.3, k)) - Mat<3>::identity(), 0.2};
        for (int c = 0; c < 9; ++c) step.G(c / 3, c % 3)[k] = alone[k].G(c / 3, c % 3);
    }
    Lanes state[6], lost(0.0);
    write_symmetric(isotropic<3>(Lanes(1.0)), state);
    const Symmetric<3, Lanes> tau = relax(kShear, kTime, step, state, lost);
    for (int k = 0; k < 8; ++k) {
        double own[6], own_lost = 0;
        write_symmetric(isotropic<3>(1.0), own);
        const Symmetric<3> expected = relax(kShear, kTime, alone[k], own, own_lost);
        for (int c = 0; c < 6; ++c) {
            EXPECT_NEAR(tau.c[c][k], expected.c[c], 1e-12 * kShear);
            EXPECT_NEAR(state[c][k], own[c], 1e-13);
        }
        EXPECT_NEAR(lost[k], own_lost, 1e-12 * kShear);
    }
}

TEST(Branches, StiffenFastMotions)
{
    const Material m = with_branches("neo-hookean");
    EXPECT_NEAR(m.p_wave_modulus(), sample_material("neo-hookean").p_wave_modulus() + 4.0 / 3 * kShear, 1e-9);
    const Material grains = with_branches("cam-clay");
    Driven<3> point(grains);
    EXPECT_NEAR(stiffness(grains, point.F, point.history.data()).modulus,
                grains.law->in<3>().stiffness(grains, point.F, point.history.data()).modulus + 4.0 / 3 * kShear, 1e-9);
}

}  // namespace
}  // namespace ordo::test
