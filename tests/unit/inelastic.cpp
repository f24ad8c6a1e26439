// What every law with a state of its own must do, for each law of the list: the same for a turned observer, for eight particles
// at a time, in 1D and 2D as in 3D, and work = stored + dissipated.
#include "material/laws.hpp"
#include "support/driven.hpp"

#include <gtest/gtest.h>

namespace ordo::test {
namespace {

/// f(row, material) for each law that carries a state.
template <class F>
void for_each_inelastic(F&& f)
{
    int count = 0;
    for (const LawRow& row : laws()) {
        if (row.is_hyperelastic || row.in_1d.stress_rate) continue;
        SCOPED_TRACE(std::string(row.name));
        f(row, sample_material(row.name));
        ++count;
    }
    EXPECT_GT(count, 0);
}

/// The observer of `turning` turns by any angle in each step.
TEST(Inelastic, IsObjectiveAndDissipates)
{
    constexpr int steps = 20;
    for_each_inelastic([](const LawRow& row, const Material& m) {
        Random random(21);
        for (int n = 0; n < 20; ++n) {
            const SmoothPath path = random_path(random, 0.3, 0.3, 0.05);
            Driven<3> still(m), turning(m);
            double largest = 0;
            Mat<3> Q       = Mat<3>::identity();
            for (int k = 1; k <= steps; ++k) {
                Q                   = random_rotation(random);
                const double t      = static_cast<double>(k) / steps;
                const double before = still.column("dissipated");
                still.step(to_mat(path.F(t)), 1.0 / steps);
                EXPECT_GE(still.column("dissipated"), before);
                turning.step(Q * to_mat(path.F(t)), 1.0 / steps);
                largest = std::max(largest, std::sqrt(square(still.sigma)));
            }
            const Mat<3> expected = Q * full(still.sigma) * transpose(Q);
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j)
                    EXPECT_NEAR(turning.sigma(i, j), expected(i, j), 1e-12 * (m.p_wave_modulus() + largest));
            for (std::size_t k = 0; k < row.history.size(); ++k)
                if (!row.history[k].name.starts_with("elastic")) {
                    EXPECT_NEAR(turning.history[k], still.history[k], 1e-12 * (1 + std::fabs(still.history[k])))
                        << row.history[k].name;
                }
            EXPECT_GT(largest, 0);
        }
    });
}

/// Eight particles with different paths at once are each as if it were alone.
template <int D, class Law>
void check_lanes(const Material& m)
{
    constexpr int columns = column_count(Law::history, D);
    const Law law         = Law::of(m);
    Random random(22);
    for (int n = 0; n < 20; ++n) {
        double alone[8][columns + 1];
        Mat<D> F[8];
        Lanes together[columns + 1];
        Mat<D, Lanes> F8;
        for (int k = 0; k < 8; ++k) {
            F[k] = Mat<D>::identity();
            m.law->in<D>().start(m, F[k], alone[k]);
            for (int c = 0; c < columns; ++c) together[c][k] = alone[k][c];
        }
        for (int step = 0; step < 4; ++step) {
            Mat<D> G[8];
            Mat<D, Lanes> G8;
            for (int k = 0; k < 8; ++k) {
                const double size = std::pow(10.0, -k % 4) / 2;  // elastic, plastic and far beyond
                G[k]              = random_deformation<D>(random, size) - Mat<D>::identity();
                if (k == 7) G[k] = Mat<D>{};
                F[k] = F[k] + G[k] * F[k];
                for (int c = 0; c < D * D; ++c) {
                    G8(c / D, c % D)[k] = G[k](c / D, c % D);
                    F8(c / D, c % D)[k] = F[k](c / D, c % D);
                }
            }
            Lanes fault8(0.0);
            const Stress<D, Lanes> s8 = law.update(Step<D, Lanes>{F8, G8, 0.1}, together, fault8);
            for (int k = 0; k < 8; ++k) {
                double fault      = 0;
                const Stress<D> s = law.update(Step<D>{F[k], G[k], 0.1}, alone[k], fault);
                EXPECT_EQ(fault > 0, fault8[k] > 0);
                if (fault > 0) continue;
                const double size = 1e-13 * m.p_wave_modulus() + 1e-12 * std::sqrt(square(s));
                for (int c = 0; c < s.size; ++c) EXPECT_NEAR(s8.c[c][k], s.c[c], size);
                for (int c = 0; c < columns; ++c)
                    EXPECT_NEAR(together[c][k], alone[k][c], 1e-12 * (1 + std::fabs(alone[k][c]))) << Law::history[c].name;
            }
        }
    }
}
template <class... L>
void check_all_lanes(LawList<L...>)
{
    auto check = [&]<class Law>(Law*) {
        if constexpr (Inelastic<Law>) {
            SCOPED_TRACE(std::string(Law::name));
            check_lanes<1, Law>(sample_material(Law::name));
            check_lanes<2, Law>(sample_material(Law::name));
            check_lanes<3, Law>(sample_material(Law::name));
        }
    };
    (check(static_cast<L*>(nullptr)), ...);
}
TEST(Inelastic, EightParticlesAreEachAsAlone) { check_all_lanes(Laws{}); }

/// A path of D dimensions gives the stress of the same path in 3D.
template <int D>
void check_lower_dimension()
{
    for_each_inelastic([](const LawRow&, const Material& m) {
        Random random(23);
        for (int n = 0; n < 20; ++n) {
            SmoothPath path = random_path(random, 0.3, 0.3, 0.05);
            for (Tensor* t : {&path.A, &path.B})
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        if (i >= D || j >= D) (*t)(i, j) = 0;
            Driven<D> low(m);
            Driven<3> whole(m);
            double size = m.p_wave_modulus();
            for (int k = 1; k <= 10; ++k) {
                const Mat<3> F = to_mat(path.F(0.1 * k));
                Mat<D> plane{};
                for (int i = 0; i < D; ++i)
                    for (int j = 0; j < D; ++j) plane(i, j) = F(i, j);
                if (!(det(plane) > 0.3)) break;
                low.step(plane, 0.1);
                whole.step(F, 0.1);
                size = std::max(size, std::sqrt(square(whole.sigma)));
                for (int c = 0; c < low.sigma.size; ++c) EXPECT_NEAR(low.sigma.c[c], whole.sigma.c[c], 1e-12 * size);
                EXPECT_NEAR(low.stored(), whole.stored(), 1e-12 * size);
                EXPECT_NEAR(low.column("dissipated"), whole.column("dissipated"), 1e-12 * size);
            }
        }
    });
}
TEST(Inelastic, LowerDimensionsAreThoseOf3D)
{
    check_lower_dimension<1>();
    check_lower_dimension<2>();
}

/// Steps of any size are solved, also those whose plastic flow is near rounding: the step of Driven expects no fault.
TEST(Inelastic, TinyStepsAreSolved)
{
    for_each_inelastic([](const LawRow&, const Material& m) {
        Random random(25);
        for (int n = 0; n < 20; ++n) {
            Driven<3> point(m);
            point.step(random_deformation<3>(random, 0.1), 0.1);
            for (int k = 0; k < 100; ++k) {
                const double size = std::pow(10.0, -uniform(random, 2, 15));
                Mat<3> f          = Mat<3>::identity();
                for (int c = 0; c < 9; ++c) f(c / 3, c % 3) += uniform(random, -size, size);
                point.step(f * point.F, size);
                EXPECT_TRUE(std::isfinite(square(point.sigma)));
            }
        }
    });
}

/// int tau : d dt = stored + dissipated, to first order in the step.
TEST(Inelastic, WorkIsStoredOrDissipated)
{
    for_each_inelastic([](const LawRow&, const Material& m) {
        Random random(24);
        for (int n = 0; n < 10; ++n) {
            const SmoothPath path = random_path(random, 0.3, 0.3, 0.05);
            auto balance          = [&](int steps) {
                Driven<3> point(m);
                double work = point.stored(), size = 0;
                for (int k = 1; k <= steps; ++k) {
                    const Mat<3> before = full(point.kirchhoff());
                    const double h = 1.0 / steps, t = h * k;
                    point.step(to_mat(path.F(t)), h);
                    const Mat<3> after  = full(point.kirchhoff());
                    const Tensor middle = path.F(t - h / 2);
                    const Mat<3> l      = to_mat((path.F(t) - path.F(t - h)) * middle.inverse());
                    work += ddot(0.5 * (before + after), l);
                    size += std::fabs(ddot(0.5 * (before + after), l));
                }
                return std::pair{work - point.stored() - point.column("dissipated"), size};
            };
            const auto [coarse, size] = balance(1000);
            const auto [fine, again]  = balance(2000);
            EXPECT_LT(std::fabs(fine), 0.02 * size);
            EXPECT_LT(std::fabs(2 * fine - coarse), 5e-4 * size) << "first order";
        }
    });
}

/// The elastic state is found again from F and the stress, after any path; stresses beyond the elasticity are refused.
TEST(Inelastic, FindsTheStateOfAStress)
{
    int laws_with_it = 0;
    for_each_inelastic([&](const LawRow& row, const Material& m) {
        const LawFunctions<3>& law = row.in<3>();
        if (!law.set_stress) return;
        ++laws_with_it;
        Random random(25);
        for (int n = 0; n < 20; ++n) {
            const SmoothPath path = random_path(random, 0.3, 0.3, 0.05);
            Driven<3> point(m);
            for (int k = 1; k <= 10; ++k) point.step(to_mat(path.F(0.1 * k)), 0.1);
            const double size = std::sqrt(square(point.sigma));
            if (size < 1e-3 * m.mu) continue;  // grains that are apart: many states have no stress
            auto found = point.history;
            for (std::size_t k = 0; k < row.history.size(); ++k)
                if (row.history[k].name.starts_with("elastic")) found[k] = 0.5;
            ASSERT_TRUE(law.set_stress(m, point.F, point.sigma, found.data()));
            if (row.name == "johnson-cook") continue;  // with Mie-Gruneisen's pressure the volume of b_e has no stress
            for (std::size_t k = 0; k < row.history.size(); ++k)
                EXPECT_NEAR(found[k], point.history[k], 1e-11 * (1 + std::fabs(point.history[k]))) << row.history[k].name;
        }
    });
    EXPECT_EQ(laws_with_it, 6);
    for (const char* name : {"cam-clay", "mu-i"}) {
        Driven<3> point(sample_material(name));
        const Stress<3> tension = isotropic<3>(0.01 * point.material.mu);
        EXPECT_FALSE(point.functions().set_stress(point.material, point.F, tension, point.history.data())) << name;
    }
}

}  // namespace
}  // namespace ordo::test
