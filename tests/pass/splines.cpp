// Projection spline-fit: what its fits give back, what it conserves, and what it refuses.
#include "base/error.hpp"
#include "method/diagnostics.hpp"
#include "spline/scheme.hpp"
#include "support/particles.hpp"
#include "verification/lattice_operator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace ordo {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<std::string> spline_presets() { return {"spline3", "spline4", "spline5"}; }

template <int D>
Model<D> periodic_box(int cells, const MethodSpec& method)
{
    Model<D> model = test::unit_box<D>(cells, method);
    model.periodic = Vec<D, bool>::filled(true);
    return model;
}

/// Particles all over the box, moved by up to `jitter` of their distance, with random velocities and stresses.
template <int D>
State<D> random_particles(const SplineScheme<D>& method, int per_axis, double jitter, test::Random& random)
{
    const Model<D>& model = method.model();
    State<D> s            = method.start(plant_all(model, test::block(model, 0.0, 1.0, per_axis)));
    Particles<D>& p       = s.particles;
    for (int i = 0; i < p.count; ++i) {
        for (int a = 0; a < D; ++a) {
            p.x[i][a] += test::uniform(random, -jitter, jitter) * model.h[a] / per_axis;
            p.v[i][a] = test::uniform(random, -1, 1);
            for (int b = 0; b <= a; ++b) p.sigma[i](a, b) = p.sigma[i](b, a) = test::uniform(random, -1, 1);
        }
        p.V[i] *= test::uniform(random, 0.7, 1.3);
        p.m[i] = 1000.0 * test::uniform(random, 0.95, 1.05) * p.V[i];
    }
    return s;
}

template <int D>
double largest_difference(const Array<Vec<D>>& a, const Array<Vec<D>>& b, int n)
{
    double r = 0;
    for (int i = 0; i < n; ++i) r = std::max(r, norm(a[i] - b[i]));
    return r;
}

/// What was a spline is given back.
template <int D>
void check_identity(const Model<D>& model)
{
    SCOPED_TRACE(std::string(name_of(model.method.basis)) + (model.periodic[0] ? " periodic" : ""));
    const SplineScheme<D> method(model);
    test::Random random(2);
    State<D> s = random_particles(method, 3, 0.3, random);
    method.evaluate(s);
    const int n = s.particles.count;
    std::vector<Vec<D>> first(method.scratch().v_at.begin(), method.scratch().v_at.begin() + n);
    EXPECT_GT(largest_difference(s.particles.v, method.scratch().v_at, n), 0.1);
    for (int i = 0; i < n; ++i) s.particles.v[i] = first[i];
    method.evaluate(s);
    double r = 0;
    for (int i = 0; i < n; ++i) r = std::max(r, norm(first[i] - method.scratch().v_at[i]));
    EXPECT_LT(r, 1e-12);
}
TEST(SplineFit, GivesBackASpline)
{
    for (const std::string& preset : spline_presets()) {
        const MethodSpec method = find_preset(preset)->spec;
        check_identity(test::walled_box<1>(16, method));
        check_identity(test::walled_box<2>(8, method));
        check_identity(test::walled_box<3>(5, method));
        check_identity(periodic_box<1>(16, method));
        check_identity(periodic_box<2>(8, method));
        check_identity(test::walled_box<2>(8, method, ConditionType::fixed));
    }
}

/// Where equal particles lie on lines along the axes, the preconditioner is the matrix. In 1D it is for all particles.
template <int D>
void check_iterations(const Model<D>& model)
{
    const SplineScheme<D> method(model);
    test::Random random(2);
    State<D> s      = random_particles(method, 3, D == 1 ? 0.3 : 0.0, random);
    Particles<D>& p = s.particles;
    for (int i = 0; D > 1 && i < p.count; ++i) {
        p.V[i] = p.V0[i];
        p.m[i] = 1000.0 * p.V[i];
    }
    method.evaluate(s);
    for (const long iterations : method.scratch().iterations) EXPECT_LE(iterations, 2);
}
TEST(SplineFit, TakesAnIterationWhereParticlesAreInLines)
{
    for (const std::string& preset : spline_presets()) {
        const MethodSpec method = find_preset(preset)->spec;
        check_iterations(test::walled_box<1>(16, method));
        check_iterations(periodic_box<1>(16, method));
        check_iterations(test::walled_box<2>(8, method));
        check_iterations(periodic_box<2>(8, method));
        check_iterations(test::walled_box<3>(5, method));
    }
}

/// A field of the spaces' own degree is exact, with its gradient; so is the acceleration of a stress of that degree.
template <int D>
void check_polynomials(const MethodSpec& spec)
{
    const Model<D> model = test::walled_box<D>(D == 3 ? 5 : 8, spec);
    const SplineScheme<D> method(model);
    test::Random random(7);
    State<D> s      = random_particles(method, 3, 0.3, random);
    Particles<D>& p = s.particles;
    auto velocity   = [](const Vec<D>& x, int a) {  // zero at the walls of its axis
        double r = x[a] * (1 - x[a]) * (x[a] - 0.3);
        for (int b = 0; b < D; ++b)
            if (b != a) r *= 1 + 0.5 * x[b] * x[b];
        return r;
    };
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) p.v[i][a] = velocity(p.x[i], a);
    method.evaluate(s);
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(method.scratch().v_at[i][a], p.v[i][a], 1e-11);
            for (int b = 0; b < D; ++b) {
                Vec<D> d{};
                d[b] = 1e-5;
                EXPECT_NEAR(method.scratch().L_at[i](a, b), (velocity(p.x[i] + d, a) - velocity(p.x[i] - d, a)) / 2e-5, 1e-8);
            }
        }
}
TEST(SplineFit, FindsPolynomialsAndTheirGradients)
{
    for (const std::string& preset : spline_presets()) {
        check_polynomials<1>(find_preset(preset)->spec);
        check_polynomials<2>(find_preset(preset)->spec);
        check_polynomials<3>(find_preset(preset)->spec);
    }
}

/// The largest real part of the spectrum of v' = a_h, sigma' = E L_h on a frozen lattice, in c/h.
double largest_real_part(const Model<1>& given, int per_axis, double jitter, double shift, double length = 1.0)
{
    Model<1> model  = given;
    model.materials = {{find_law("linear-rate-1d"), 1.0, 0.0, 0.5}};
    const SplineScheme<1> method(model);
    test::Random random(4);
    State<1> s      = method.start(plant_all(model, test::block(model, 0.0, length, per_axis)));
    Particles<1>& p = s.particles;
    for (int i = 0; i < p.count; ++i) {
        p.x[i][0] += (shift + test::uniform(random, -jitter, jitter)) * model.h[0] / per_axis;
        p.X[i] = p.x[i];  // a free surface is where X says
    }
    double real = 0.0, imaginary = 0.0;
    for (const auto& value : verification::frozen_spectrum(method, s)) {
        real      = std::max(real, value.real());
        imaginary = std::max(imaginary, value.imag());
    }
    EXPECT_GT(imaginary * model.h[0], 1.0);
    return real * model.h[0];
}
TEST(SplineFit, FrozenLatticesAreNeutral)
{
    for (const std::string& preset : spline_presets()) {
        SCOPED_TRACE(preset);
        const MethodSpec method = find_preset(preset)->spec;
        for (const int per_axis : {2, 3})
            for (const double shift : {0.0, 0.25, 0.5}) {
                EXPECT_LT(largest_real_part(periodic_box<1>(16, method), per_axis, 0, shift), 1e-12);
                if (per_axis == 3 || shift == 0) {
                    EXPECT_LT(largest_real_part(periodic_box<1>(16, method), per_axis, 0.25, shift), 1e-12);
                }
            }
        EXPECT_LT(largest_real_part(test::walled_box<1>(16, method), 2, 0.0, 0), 1e-12);
        EXPECT_LT(largest_real_part(test::walled_box<1>(16, method), 2, 0.25, 0), 1e-12);
    }
}

template <class F>
std::string message_of(F&& f)
{
    try {
        f();
    } catch (const NumericalError& e) {
        return e.what();
    } catch (const InputError& e) {
        return std::string("input: ") + e.what();
    }
    return "nothing";
}

/// A ball in a grid without walls, in 1D a bar.
template <int D>
Model<D> free_ball(int cells, const MethodSpec& method, double radius = 0.37)
{
    Model<D> model = test::unit_box<D>(cells, method);
    model.surface  = {[radius](const Vec<D>& X) {
        const Vec<D> from_center = X - Vec<D>::filled(0.5);
        return dot(from_center, from_center) - radius * radius;
    }};
    return model;
}
template <int D>
State<D> start_ball(const SplineScheme<D>& method, double radius = 0.37)
{
    const Ball<D> ball{Vec<D>::filled(0.5), radius};
    const Model<D>& model = method.model();
    return method.start(plant_all(model, fill(ball, SubCells<D>{model.origin, model.h, Index<D>::filled(2)})));
}

/// Polynomials of the degree of the splines, of bodies that end within cells.
template <int D>
void check_free_polynomials(const MethodSpec& spec)
{
    const SplineScheme<D> method(free_ball<D>(D == 1 ? 16 : D == 2 ? 12 : 8, spec));
    State<D> s      = start_ball<D>(method);
    Particles<D>& p = s.particles;
    auto velocity   = [](const Vec<D>& x, int a) { return (x[a] - 0.2) * (x[D - 1] - 0.7) * (1 + x[0]); };
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) p.v[i][a] = velocity(p.x[i], a);
    method.evaluate(s);
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(method.scratch().v_at[i][a], p.v[i][a], 1e-10);
            for (int b = 0; b < D; ++b) {
                Vec<D> d{};
                d[b] = 1e-5;
                EXPECT_NEAR(method.scratch().L_at[i](a, b), (velocity(p.x[i] + d, a) - velocity(p.x[i] - d, a)) / 2e-5, 1e-7);
            }
        }
    // Where the body is, by its quadrature.
    const CutPoints& cut = method.scratch().body.points;
    double volume = 0.0, cell = 1.0;
    for (int a = 0; a < D; ++a) cell *= method.model().h[a];
    for (const Cover cover : method.scratch().body.cover) volume += cover == Cover::all ? cell : 0.0;
    for (const double weight : cut.weights) volume += weight;
    const double exact = D == 1 ? 0.74 : D == 2 ? kPi * 0.37 * 0.37 : 4 * kPi / 3 * 0.37 * 0.37 * 0.37;
    EXPECT_NEAR(volume, exact, 1e-6 * exact);
    EXPECT_GT(cut.count(), 0);
}
TEST(FreeSurface, FindsPolynomialsAndTheirGradients)
{
    for (const char* preset : {"spline3", "spline4"}) {
        SCOPED_TRACE(preset);
        check_free_polynomials<1>(find_preset(preset)->spec);
        check_free_polynomials<2>(find_preset(preset)->spec);
    }
    check_free_polynomials<3>(find_preset("spline3")->spec);
}

/// In the smallest bodies, polynomials of the degree of the splines nearly vanish at all particles, and matrices are singular but for
/// the last digits. Smaller ones, where gradients could be anything, are refused.
TEST(FreeSurface, SmallBallsAreFittedOrRefused)
{
    const double spin = 3.0;
    auto start        = [&](const SplineScheme<2>& method, double radius) {
        State<2> s = start_ball<2>(method, radius);
        for (int i = 0; i < s.particles.count; ++i) {
            const Vec<2> x   = s.particles.x[i];
            s.particles.v[i] = {-spin * x[1], spin * x[0]};
        }
        return s;
    };
    for (const auto& [preset, radius] :
         {std::pair{"spline3", 0.07}, {"spline4", 0.1}, {"spline5", 0.12}}) {  // 2.2 to 3.8 cells across
        SCOPED_TRACE(preset);
        const SplineScheme<2> method(free_ball<2>(16, find_preset(preset)->spec, radius));
        State<2> s = start(method, radius);
        method.evaluate(s);
        for (int i = 0; i < s.particles.count; ++i) {
            EXPECT_LT(norm(method.scratch().v_at[i] - s.particles.v[i]), 1e-11 * spin);
            const Mat<2>& L = method.scratch().L_at[i];
            EXPECT_LT(std::fabs(L(0, 1) + spin) + std::fabs(L(1, 0) - spin) + std::fabs(L(0, 0)) + std::fabs(L(1, 1)),
                      1e-9 * spin);
        }
        for (int k = 0; k < 10; ++k) method.step(s, 2e-4);
    }
    for (const auto& [preset, radius] : {std::pair{"spline3", 0.06}, {"spline4", 0.08}, {"spline5", 0.1}}) {
        const SplineScheme<2> method(free_ball<2>(16, find_preset(preset)->spec, radius));
        State<2> s                = start(method, radius);
        const std::string message = message_of([&] { method.evaluate(s); });
        EXPECT_NE(message.find("particles are too few for splines of degree"), std::string::npos) << message;
    }
}

/// Without stress nothing accelerates but what is left of a velocity's jumps at the surface.
TEST(FreeSurface, JumpsOfVelocityDecay)
{
    const SplineScheme<2> method(free_ball<2>(12, find_preset("spline4")->spec));
    State<2> s       = start_ball<2>(method);
    Particles<2>& p  = s.particles;
    const auto power = [&](auto&& velocity) {  // and the largest acceleration
        for (int i = 0; i < p.count; ++i) p.v[i] = velocity(p.x[i]);
        method.evaluate(s);
        std::pair<double, double> r{};
        for (int i = 0; i < p.count; ++i) {
            r.first += p.m[i] * dot(method.scratch().v_at[i], method.scratch().a_at[i]);
            r.second = std::max(r.second, norm(method.scratch().a_at[i]));
        }
        return r;
    };
    const double rate = method.model().materials[0].wave_speed() / method.model().h[0];
    EXPECT_LT(power([](const Vec<2>& x) {
                  return Vec<2>{x[0] * x[0] * x[1] - x[1], (x[0] - 0.3) * x[1] * x[1]};
              }).second,
              1e-9 * rate);
    test::Random random(3);
    const auto [decay, largest] = power([&](const Vec<2>&) {
        return Vec<2>{test::uniform(random, -1, 1), test::uniform(random, -1, 1)};
    });
    EXPECT_LT(decay, 0);
    EXPECT_GT(largest, 1e-3 * rate);
    EXPECT_LT(largest, 30 * rate);
}

TEST(FreeSurface, FrozenLatticesAreNeutral)
{
    for (const std::string& preset : spline_presets()) {
        SCOPED_TRACE(preset);
        for (const double length : {0.63, 0.65, 0.69}) {
            Model<1> model = test::unit_box<1>(16, find_preset(preset)->spec);
            model.conditions.push_back({.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
            model.surface = {[length](const Vec<1>& X) { return X[0] - length; }};
            EXPECT_LT(largest_real_part(model, 2, 0.0, 0.0, length), 1e-12);
            EXPECT_LT(largest_real_part(model, 3, 0.25, 0.0, length), 1e-12);
        }
    }
}

TEST(SplineFit, TooFewParticlesAreNamedWithTheirPlace)
{
    const MethodSpec spec = find_preset("spline4")->spec;
    {
        const SplineScheme<1> method(test::walled_box<1>(16, spec));
        State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 1)));
        EXPECT_NE(message_of([&] { method.step(s, 1e-3); }).find("has too few particles"), std::string::npos);
    }
    const SplineScheme<2> method(test::walled_box<2>(8, spec));
    std::vector<Seed<2>> seeds = test::block(method.model(), 0.0, 1.0, 2);
    std::erase_if(seeds, [](const Seed<2>& seed) { return norm(seed.x - Vec<2>{0.75, 0.25}) < 0.26; });
    State<2> s                = method.start(plant_all(method.model(), seeds));
    const std::string message = message_of([&] { method.step(s, 1e-3); });
    EXPECT_NE(message.find("has too few particles"), std::string::npos) << message;
    EXPECT_NE(message.find("near (0.75, 0."), std::string::npos) << message;
}

TEST(SplineFit, NegativeDensityIsNamedWithItsPlace)
{
    const SplineScheme<1> method(test::walled_box<1>(16, find_preset("spline3")->spec));
    State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 2)));
    for (int i = 0; i < s.particles.count; ++i)
        if (std::fabs(s.particles.x[i][0] - 0.4) < 0.02) s.particles.m[i] *= 60;
    const std::string message = message_of([&] { method.step(s, 1e-4); });
    EXPECT_NE(message.find("density that fits the particles is not positive"), std::string::npos) << message;
}

TEST(SplineFit, ModelsThatItCannotHoldAreRefused)
{
    const MethodSpec spec = find_preset("spline4")->spec;
    auto refusal          = [](const Model<2>& model) { return message_of([&] { const SplineScheme<2> method(model); }); };
    EXPECT_NE(refusal(test::unit_box<2>(8, spec)).find("input: projection spline-fit needs a wall on every face"),
              std::string::npos);
    Model<2> model = test::walled_box<2>(8, spec);
    EXPECT_EQ(refusal(model), "nothing");
    model.conditions[1].type = ConditionType::velocity;
    EXPECT_NE(refusal(model).find("walls at rest"), std::string::npos);
    model                  = test::walled_box<2>(8, spec);
    model.conditions[1].at = 0.5;
    EXPECT_NE(refusal(model).find("on faces of the grid"), std::string::npos);
    model = test::walled_box<2>(8, spec);
    model.materials.push_back(model.materials[0]);
    EXPECT_EQ(refusal(model), "nothing");
    model.materials[1].density *= 2;
    EXPECT_NE(refusal(model).find("one material"), std::string::npos);
    EXPECT_NE(refusal(test::walled_box<2>(2, spec)).find("too few for splines"), std::string::npos);
}

/// What splines do not hold of the velocities, v - v_h(x), loses `null_damping` of itself in a step.
TEST(SplineFit, VelocitiesThatNoSplineHoldsDecay)
{
    for (const std::string& preset : spline_presets()) {
        const SplineScheme<1> method(test::walled_box<1>(32, find_preset(preset)->spec));
        State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 2)));
        for (int i = 0; i < s.particles.count; ++i) s.particles.v[i][0] = i % 2 ? 1e-6 : -1e-6;
        auto rest = [&] {
            method.evaluate(s);
            double squares = 0;
            for (int i = 0; i < s.particles.count; ++i)
                squares += dot(s.particles.v[i] - method.scratch().v_at[i], s.particles.v[i] - method.scratch().v_at[i]);
            return std::sqrt(squares);
        };
        const double before = rest(), dt = 0.3 / 32 / method.model().materials[0].wave_speed();
        for (int k = 0; k < 50; ++k) method.step(s, dt);
        EXPECT_NEAR(rest() / before, std::pow(1 - method.model().method.null_damping, 50), 1e-3) << preset;
    }
}

/// F' = L F, in a step so short that nothing else happens.
TEST(SplineFit, DeformationFollowsTheGradient)
{
    for (const std::string& preset : spline_presets()) {
        const SplineScheme<2> method(test::walled_box<2>(8, find_preset(preset)->spec));
        test::Random random(5);
        State<2> s      = random_particles(method, 3, 0.3, random);
        Particles<2>& p = s.particles;
        for (int i = 0; i < p.count; ++i)
            for (auto& row : p.F[i].c)
                for (double& of : row) of += test::uniform(random, -0.2, 0.2);
        method.evaluate(s);
        const std::vector<Mat<2>> F(p.F.begin(), p.F.begin() + p.count),
            L(method.scratch().L_at.begin(), method.scratch().L_at.begin() + p.count);
        constexpr double dt = 1e-9;
        method.step(s, dt);
        for (int i = 0; i < p.count; ++i)
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b) EXPECT_NEAR((p.F[i](a, b) - F[i](a, b)) / dt, (L[i] * F[i])(a, b), 1e-5) << preset;
    }
}

/// Mass and momentum of the grid differ from those of the particles by the error of the particles' masses as a quadrature.
TEST(SplineFit, EnergyIsKept)
{
    for (const std::string& preset : spline_presets()) {
        const SplineScheme<1> method(test::walled_box<1>(32, find_preset(preset)->spec));
        State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 2)));
        set_velocities(
            s.particles, 0, s.particles.count, [](const Vec<1>& x) { return Vec<1>{0.1 * std::sin(kPi * x[0])}; },
            method.model().h);
        const double first = totals(method.model(), s).total_energy();
        const double c = method.model().materials[0].wave_speed(), dt = 0.3 / 32 / c;
        const long steps = std::lround(4 / c / dt);  // two periods
        for (long k = 0; k < steps; ++k) method.step(s, dt);
        EXPECT_NEAR(totals(method.model(), s).total_energy() / first, 1, 1e-4) << preset;
    }
}

}  // namespace
}  // namespace ordo
