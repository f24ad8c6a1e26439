// The lattice operator against symbols by hand, against the nonlinear step, and the limits that the time step is taken from.
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/planting.hpp"
#include "method/tables.hpp"
#include "setup/schemes.hpp"
#include "support/particles.hpp"
#include "verification/energy_balance.hpp"
#include "verification/lattice_operator.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <string>

namespace ordo::verification {
namespace {

using Complex = std::complex<double>;

constexpr double kPi = std::numbers::pi;

MethodSpec preset(std::string_view name) { return find_preset(name)->spec; }

/// All but those with enriched corners, which a periodic lattice does not have, with fits to corners that have velocities of their own, and
/// with a limiter.
std::vector<Preset> presets_of_lattices()
{
    std::vector<Preset> all = presets();
    std::erase_if(all, [](const Preset& p) {
        return has_enrichment(p.spec) || (has_cells(p.spec) && p.spec.samples == Samples::corners) ||
               p.spec.limiter != Limiter::none;
    });
    return all;
}

/// The largest |eigenvalue| at a Courant number, of 1 to 4 particles a cell wherever they lie.
double growth_anywhere(const MethodSpec& method, double courant)
{
    double growth = 0.0;
    for (int n = 1; n <= 4; ++n)
        for (const double shift : {0.0, 0.25, 0.4, 0.5}) {
            if (method.mass == MassMatrix::consistent && n == 1) continue;  // singular for some shifts
            LatticeOperator<1> op({method, n, shift, 64, 0.0});
            op.assemble(courant);
            growth = std::max(growth, op.growth(64));
        }
    return growth;
}

/// Hats, one particle in the middle of each cell, lumped mass, stress last: with s, c = sin, cos(theta/2) the nodes have
/// c v and the acceleration 2 i s sigma, and the particles get v + C c (2 i s sigma) and sigma + C 2 i s (c v + C 2 i s sigma).
TEST(LatticeOperator, IsTheSymbolByHand)
{
    LatticeOperator<1> op({preset("mpm"), 1, 0.0, 32, 0.0});
    for (const double C : {0.2, 0.7}) {
        op.assemble(C);
        for (const double theta : {0.1, 1.0, 2.5, kPi}) {
            const double s = std::sin(theta / 2), c = std::cos(theta / 2);
            const Complex i(0, 1), cross            = 2.0 * i * C * s * c;
            const Complex hand[2][2] = {{1.0, cross}, {cross, 1 - 4 * C * C * s * s}};
            const auto found         = op.symbol({theta});
            ASSERT_EQ(found.size(), 4u);
            for (int k = 0; k < 4; ++k) EXPECT_LT(std::abs(found[k] - hand[k / 2][k % 2]), 1e-14) << theta << ' ' << k;
        }
    }
}

/// With a part p of the advanced velocity, the strain takes C 2 i s (c v + (p + (1 - p) c^2) C 2 i s sigma).
TEST(LatticeOperator, HasThePartOfTheAdvancedVelocity)
{
    for (const double part : {0.0, 0.3, 1.0}) {
        MethodSpec method      = preset("mpm");
        method.strain_velocity = part;
        LatticeOperator<1> op({method, 1, 0.0, 32, 0.0});
        constexpr double C = 0.6;
        op.assemble(C);
        for (const double theta : {0.1, 1.0, 2.5, kPi}) {
            const double s = std::sin(theta / 2), c = std::cos(theta / 2);
            EXPECT_LT(std::abs(op.symbol({theta})[3] - (1 - 4 * C * C * s * s * (part + (1 - part) * c * c))), 1e-14) << theta;
        }
    }
}

/// Particles on the nodes leave no projection: the step is the leapfrog of Gong (2015), eqs. 7.13 and 7.14, for which
/// sin(omega dt/2) = C sin(theta/2) (errata 38), sharp up to C = 1.
TEST(LatticeOperator, IsGongsSchemeWhereParticlesAreNodes)
{
    LatticeOperator<1> op({preset("mpm"), 1, 0.5, 32, 0.0});
    for (const double C : {0.3, 0.99}) {
        op.assemble(C);
        for (const double theta : {0.2, 1.5, 3.0})
            for (const Complex& value : op.eigenvalues({theta})) {
                EXPECT_NEAR(std::abs(value), 1.0, 1e-13);
                EXPECT_NEAR(std::fabs(std::sin(std::arg(value) / 2)), C * std::sin(theta / 2), 1e-13);
            }
    }
    EXPECT_NEAR(find_stable(op, 4.0).to, 1.0, 1e-5);
}

/// A wave on the lattice after a nonlinear step, by central differences of amplitude `size`, less what the symbol says.
template <int D>
double distance_from_step(const MethodSpec& method, int per_axis, double size)
{
    const ParticleLattice lattice{method, per_axis, 0.2, 12, 0.2};
    const double C = 0.3;
    LatticeOperator<D> op(lattice);
    op.assemble(C);
    Vec<D> theta{};
    for (int a = 0; a < D; ++a) theta[a] = 2 * kPi * (a + 2) / lattice.cells;

    const std::unique_ptr<const Scheme<D>> exact = make_scheme(model_of<D>(lattice, "neo-hookean"));
    const Material& material                     = exact->model().materials[0];
    const int in_box                             = static_cast<int>(std::lround(std::pow(lattice.cells, D)));
    const int in_cell = op.particle_count() / in_box, fields = op.size() / in_cell, stresses = D * (D + 1) / 2;
    std::vector<Complex> start(op.size());
    for (int k = 0; k < op.size(); ++k)
        if (k % fields < D + stresses) start[k] = Complex(std::cos(3.0 * k), std::sin(5.0 * k));
    std::vector<Complex> end(op.size());
    const auto G = op.symbol(theta);
    for (int r = 0; r < op.size(); ++r)
        for (int k = 0; k < op.size(); ++k) end[r] += G[r * op.size() + k] * start[k];

    // Values of the wave at the particle with this number.
    auto at = [&](const std::vector<Complex>& wave, int id, int field) {
        int cell     = id / in_cell;
        double phase = 0.0;
        for (int a = 0; a < D; ++a, cell /= lattice.cells) phase += theta[a] * (cell % lattice.cells);
        return (wave[id % in_cell * fields + field] * std::polar(1.0, phase)).real();
    };
    auto step = [&](double amplitude) {
        State<D> s      = exact->start(plant_all(exact->model(), seeds_of<D>(lattice)));
        Particles<D>& p = s.particles;
        for (int i = 0; i < p.count; ++i) {
            Mat<D> stress{};
            for (int a = 0, f = D; a < D; ++a) {
                p.v[i][a] = amplitude * at(start, p.id[i], a);
                for (int b = a; b < D; ++b, ++f) stress(a, b) = stress(b, a) = amplitude * at(start, p.id[i], f);
            }
            // The strain of that stress, small.
            const double mean = trace(stress) * material.lambda / (D * material.lambda + 2 * material.mu);
            p.F[i]            = Mat<D>::identity() + stress * (0.5 / material.mu);
            for (int a = 0; a < D; ++a) p.F[i](a, a) -= mean * 0.5 / material.mu;
            p.sigma[i] = material.law->in<D>().initial_stress(material, p.F[i]);
        }
        s.n       = 1;
        s.dt_prev = C;
        exact->step(s, C);
        std::vector<double> r(static_cast<std::size_t>(p.count) * (D + stresses));
        for (int i = 0; i < p.count; ++i) {
            double* of = &r[p.id[i] * (D + stresses)];
            for (int a = 0; a < D; ++a) *of++ = p.v[i][a];
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) *of++ = p.sigma[i](a, b);
        }
        return r;
    };
    const auto up = step(size), down = step(-size);
    double largest = 0.0;
    for (int id = 0; id < op.particle_count(); ++id)
        for (int f = 0; f < D + stresses; ++f) {
            const std::size_t k = id * (D + stresses) + f;
            largest             = std::max(largest, std::fabs((up[k] - down[k]) / (2 * size) - at(end, id, f)));
        }
    return largest;
}

/// The operator is the derivative of the nonlinear step: what is left falls with the square of the amplitude.
TEST(LatticeOperator, IsTheDerivativeOfTheStep)
{
    for (const Preset& p : presets_of_lattices()) {
        SCOPED_TRACE(p.name);
        const bool is_fitted = p.spec.projection == Projection::tls;
        const int n          = is_fitted ? 3 : 2;
        const double coarse = distance_from_step<1>(p.spec, n, 1e-3), fine = distance_from_step<1>(p.spec, n, 1e-4);
        EXPECT_LT(fine, 2e-6);
        EXPECT_GT(coarse / fine, 30) << fine;
        if (p.spec.domain == Domain::simplex || is_fitted) continue;
        EXPECT_LT(distance_from_step<2>(p.spec, n, 1e-4), 1e-5);
    }
    for (const char* scheme : {"usf", "musl"}) {
        MethodSpec method = preset("cpdi1");
        method.scheme     = parse_choice<TimeScheme>(scheme);
        EXPECT_LT(distance_from_step<1>(method, 2, 1e-4), 1e-6) << scheme;
        EXPECT_LT(distance_from_step<2>(method, 2, 1e-4), 1e-5) << scheme;
    }
}

/// method/courant.hpp is what the spectra say. Every preset is stable at its limit, unless it is among the unstable ones.
TEST(StableCourantNumber, IsThatOfTheSpectrum)
{
    for (const Preset& p : presets_of_lattices()) {
        SCOPED_TRACE(p.name);
        const double growth = growth_anywhere(p.spec, (1 - 1e-4) * stable_courant_number(p.spec, 1));
        if (instability_of(p.spec)) {
            EXPECT_GT(growth, 1 + 1e-4);
        } else {
            EXPECT_LE(growth, 1 + kGrowthTolerance);
        }
    }
}

/// The largest energy in the last tenth of 2000 steps over that in the first tenth, of a lattice of particles whose velocities are random
/// and much below the speed of sound.
template <int D>
double growth_of_noise(const MethodSpec& method, int per_axis, double shift)
{
    const ParticleLattice lattice{method, per_axis, shift, D == 1 ? 24 : 6, 0.0};
    const std::unique_ptr<const Scheme<D>> scheme = make_scheme(model_of<D>(lattice, "neo-hookean"));
    State<D> s                                    = scheme->start(plant_all(scheme->model(), seeds_of<D>(lattice)));
    test::Random random(7);
    for (Vec<D>& v : s.particles.v)
        for (int a = 0; a < D; ++a) v[a] = test::uniform(random, -5e-5, 5e-5);
    const double dt = 0.999 * stable_courant_number(method, D);
    double tenths[10]{};
    for (int n = 0; n < 2000; ++n) {
        scheme->step(s, dt);
        tenths[n / 200] = std::max(tenths[n / 200], totals(scheme->model(), s).total_energy());
    }
    return tenths[9] / tenths[0];
}

/// Limited fits have no matrix, so noise shows that they are stable. Without a limiter the same grow where the strain is that of
/// velocities projected again.
TEST(StableCourantNumber, HoldsForLimitedFits)
{
    MethodSpec method = preset("cpls-limited");
    for (const double strain_velocity : {0.0, 0.3, 1.0}) {
        method.strain_velocity = strain_velocity;
        std::vector<MethodSpec> others(6, method);
        for (int k : {0, 1, 2}) others[k].samples = Samples::particles;
        others[1].projection = Projection::mls;
        others[2].domain     = Domain::point;
        others[3].basis      = Basis::bspline2;
        others[4].basis      = Basis::bspline3;
        others[5].weight     = Weight::quadratic;
        for (const MethodSpec& other : others)
            EXPECT_LT(growth_of_noise<2>(other, 1, 0.25), 1.001) << test::describe(other) << ' ' << strain_velocity;
        for (int n = 1; n <= 2; ++n)
            for (const double shift : {0.0, 0.25, 0.5})
                EXPECT_LT(growth_of_noise<1>(method, n, shift), 1.001) << strain_velocity << ' ' << n << ' ' << shift;
        EXPECT_LT(growth_of_noise<2>(method, 1, 0.25), 1.001) << strain_velocity;
    }
    method.strain_velocity = 0.0;
    method.limiter         = Limiter::none;
    EXPECT_GT(growth_of_noise<2>(method, 1, 0.25), 100.0);
}

/// Its rows that are below courant_scale are sharp, and what it leaves at courant_scale is stable there.
TEST(StableCourantNumber, IsSharp)
{
    const MethodSpec mpm;
    auto with = [&](Basis basis, MassMatrix mass, TimeScheme scheme, Domain domain) {
        MethodSpec s = mpm;
        s.basis = basis, s.mass = mass, s.scheme = scheme, s.domain = domain;
        return s;
    };
    for (const TimeScheme scheme : {TimeScheme::usl, TimeScheme::musl, TimeScheme::usf})
        for (const auto& basis : Axis<Basis>::choices)
            for (const MassMatrix mass : {MassMatrix::lumped, MassMatrix::consistent})
                for (const Domain domain : {Domain::point, Domain::parallelepiped}) {
                    const MethodSpec s = with(basis.value, mass, scheme, domain);
                    if (broken_rule(s)) continue;
                    const double limit = stable_courant_number(s, 1);
                    SCOPED_TRACE(std::string(basis.name) + " " + std::string(name_of(mass)) + " " + std::string(name_of(scheme)) +
                                 " " + std::string(name_of(domain)));
                    EXPECT_LE(growth_anywhere(s, (1 - 1e-4) * limit), 1 + kGrowthTolerance);
                    if (limit < courant_scale(s, 1)) {
                        EXPECT_GT(growth_anywhere(s, (1 + 2e-3) * limit), 1 + 1e-4);
                    }
                }
}

/// The same with parts of the advanced velocity between those of musl and usl, which stabilize least squares: 0.2, or 0.1 with two
/// particles a cell.
TEST(StableCourantNumber, IsThatOfTheSpectrumBetweenMuslAndUsl)
{
    for (const char* name : {"mpm", "cpdi1", "bscpdi2", "cpls", "imls-mpm", "mls-bsmpm", "bsmpm", "apic"})
        for (const double part : {0.2, 0.3, 0.7}) {
            MethodSpec s      = preset(name);
            s.strain_velocity = part;
            SCOPED_TRACE(std::string(name) + " " + std::to_string(part));
            ASSERT_EQ(instability_of(s), nullptr);
            const double limit = stable_courant_number(s, 1);
            EXPECT_LE(growth_anywhere(s, (1 - 1e-4) * limit), 1 + kGrowthTolerance);
            if (name == std::string("mpm") && part > 0.5) {
                EXPECT_GT(growth_anywhere(s, (1 + 2e-3) * limit), 1 + 1e-4);
            }
        }
    for (const auto& [part, is_stable] : {std::pair(0.0, false), std::pair(0.1, true)}) {
        MethodSpec s      = preset("cpls");
        s.strain_velocity = part;
        EXPECT_EQ(instability_of(s) == nullptr, is_stable);
        LatticeOperator<1> op({s, 2, 0.25, 64, 0.0});
        op.assemble(0.4);
        EXPECT_EQ(op.growth(64) <= 1 + kGrowthTolerance, is_stable) << part;
    }
}

/// Domains side by side on a periodic line of hats, wherever they lie: 2/sqrt of the largest eigenvalue of M^-1 K with functions that are
/// means over corners.
TEST(StableCourantNumber, OfDomainsIsThatOfMatrices)
{
    constexpr int cells = 40;
    auto hat            = [](double x) { return std::max(0.0, 1 - std::fabs(x)); };
    for (const int count : {120, 80, 72, 64, 56, 50}) {
        const double w = static_cast<double>(cells) / count;
        double least   = 1.0;
        for (int shift = 0; shift < 8; ++shift) {
            Eigen::MatrixXd phi = Eigen::MatrixXd::Zero(count, cells), slope = phi;
            for (int p = 0; p < count; ++p)
                for (int i = 0; i < cells; ++i) {
                    auto at     = [&](double corner) { return hat(std::remainder((p + shift / 8.0 + corner) * w - i, cells)); };
                    phi(p, i)   = 0.5 * (at(-0.5) + at(0.5));
                    slope(p, i) = (at(0.5) - at(-0.5)) / w;
                }
            const Eigen::MatrixXd M = phi.transpose() * phi, K = slope.transpose() * slope;
            const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(K, M, Eigen::EigenvaluesOnly);
            least = std::min(least, 2 / std::sqrt(solver.eigenvalues().maxCoeff()));
        }
        EXPECT_NEAR(least, stable_number_of_domains(w), 0.07 * least) << w;
    }
    EXPECT_NEAR(stable_number_of_domains(0.5), 0.5, 1e-15);
    EXPECT_NEAR(stable_number_of_domains(1e-9), 1 / std::sqrt(3.0), 1e-8);
    EXPECT_GT(stable_number_of_domains(1.2), 0.0);
}

/// The same with filters: FMPM shortens the step of usl, by the root of its order, XPIC does not. Least squares grow from order 3 on.
TEST(StableCourantNumber, IsThatOfTheSpectrumWithFilters)
{
    for (const char* name : {"mpm", "ugimp", "bscpdi2", "mls-bsmpm", "cpls", "imls-mpm"})
        for (const Filter filter : {Filter::xpic, Filter::fmpm})
            for (const double part : {0.0, 0.3, 1.0})
                for (const double order : {1.0, 2.0, 4.0, 9.0}) {
                    MethodSpec s      = preset(name);
                    s.filter          = filter;
                    s.filter_order    = order;
                    s.strain_velocity = part;
                    SCOPED_TRACE(std::string(name) + " " + std::string(name_of(filter)) + " " + std::to_string(order) + " " +
                                 std::to_string(part));
                    const double limit = stable_courant_number(s, 1);
                    if (fits_velocity(s) && (order > 2 || part == 0)) {
                        EXPECT_NE(instability_of(s), nullptr);
                        continue;
                    }
                    EXPECT_LE(growth_anywhere(s, (1 - 1e-4) * limit), 1 + kGrowthTolerance);
                    if (name == std::string("mpm") && filter == Filter::fmpm && 2 * part * order > 1) {
                        EXPECT_NEAR(limit, 1 / std::sqrt(2 * part * order), 1e-15);
                        EXPECT_GT(growth_anywhere(s, (1 + 2e-3) * limit), 1 + 1e-4);
                    }
                }
    MethodSpec s   = preset("cpls");
    s.filter       = Filter::fmpm;
    s.filter_order = 4;
    EXPECT_GT(growth_anywhere(s, 0.35), 1 + 1e-4);
}

/// The parts of the change of energy are all of it, and the power balance of the nodes closes, for every preset.
TEST(EnergyBalance, Closes)
{
    for (const Preset& p : presets_of_lattices()) {
        SCOPED_TRACE(p.name);
        const ParticleLattice lattice{p.spec, p.spec.projection == Projection::tls ? 3 : 2, 0.0, 16, 0.0};
        const Model<1> model   = model_of<1>(lattice, "linear-rate-1d");
        Particles<1> particles = plant_all(model, seeds_of<1>(lattice));
        set_velocities<1>(
            particles, 0, particles.count, [](const Vec<1>& x) { return Vec<1>{1e-6 * std::sin(kPi * x[0] / 8)}; }, model.h);
        Simulation<1> sim(model, [&](const Scheme<1>& scheme) { return scheme.start(std::move(particles)); },
                          {.end = 100.0, .dt = 0.3});
        const double first = totals(model, sim.state()).total_energy();
        double last        = first;
        for (int k = 0; k < 20; ++k) {
            const EnergyBalance e = step_with_balance(sim);
            const double now      = totals(model, sim.state()).total_energy();
            EXPECT_LT(std::fabs(e.motion - e.work), 1e-12 * first) << k;
            EXPECT_LT(std::fabs(e.projection + e.motion + e.update + e.stress - e.work - (now - last)), 1e-12 * first) << k;
            last = now;
        }
    }
}

}  // namespace
}  // namespace ordo::verification
