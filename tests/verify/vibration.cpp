// The vibrating bar of Gong (2015) sec. 4.5 and Tran et al. (2019): order of convergence in displacement.
// The body force is derived from motion and material by automatic differentiation, never typed.
#include "base/dual.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

namespace ordo {
namespace {

constexpr double kYoung = 1e7, kPoisson = 0.3, kDensity = 1000, kEnd = 0.02;

/// x(X, t) = X + A sin(pi X) sin(c pi t), c = sqrt(E/rho0).
struct Vibration {
    double amplitude;
    double c = std::sqrt(kYoung / kDensity);
    NeoHookean law{kYoung * kPoisson / ((1 + kPoisson) * (1 - 2 * kPoisson)), kYoung / (2 * (1 + kPoisson))};

    template <class T>
    T position(const T& X, const T& t) const
    {
        const double pi = std::numbers::pi;
        return X + T(amplitude) * sin(T(pi) * X) * sin(T(c * pi) * t);
    }
    double velocity(double X, double t) const { return position(Dual<>(X), Dual<>(t, 1.0)).slope; }
    /// b = x'' - (1/rho0) dP/dX; P = sigma in one dimension.
    double body_force(double X, double t) const
    {
        using Second                     = Dual<Dual<double>>;
        const double a                   = position(Second(X), Second{{t, 1.0}, {1.0, 0.0}}).slope.slope;
        const Second x                   = position(Second{{X, 1.0}, {1.0, 0.0}}, Second(t));
        const Dual<double> F             = x.slope;  // dx/dX and its slope along X
        const Mat<1, Dual<double>> sigma = law.cauchy(Mat<1, Dual<double>>{{{F}}});
        return a - sigma(0, 0).slope / kDensity;
    }
};

/// RMS error of displacement at the end, one period by default; infinite when the run fails.
struct Setting {
    Scheme scheme = Scheme::usl;
    double end    = kEnd;
};
double displacement_error(std::string_view preset, double amplitude, int cells, const Setting& setting = {})
{
    const Vibration exact{.amplitude = amplitude};
    Model<1> model{};
    for (const Preset& p : presets())
        if (p.name == preset) model.method = p.spec;
    model.method.scheme = setting.scheme;
    model.h             = {1.0 / cells};
    model.cells         = {cells};
    model.materials     = {{MaterialModel::neo_hookean, kDensity, exact.law.lambda, exact.law.mu}};
    model.body_forces.push_back({Field(
        std::function<double(const FieldPoint&)>([exact](const FieldPoint& at) { return exact.body_force(at.X[0], at.t); }))});
    model.boundaries = {Boundary<1>{.at = 0.0, .value = {}}, Boundary<1>{.outer_is_above = true, .at = 1.0, .value = {}}};
    const Explicit<1> method(model);
    State<1> s = method.start(test::make_particles(model, test::block(model, 0.0, 1.0, 2)));
    for (int i = 0; i < s.particles.count; ++i) s.particles.v[i][0] = exact.velocity(s.particles.X[i][0], 0.0);
    const double dt = 0.4 * model.h[0] / exact.c;
    try {
        while (s.t < setting.end * (1 - 1e-12)) method.step(s, std::min(dt, setting.end - s.t));
    } catch (const NumericalError&) {
        return std::numeric_limits<double>::infinity();
    }
    double sum = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        const double e = s.particles.x[i][0] - exact.position(s.particles.X[i][0], s.t);
        sum += e * e;
    }
    return std::sqrt(sum / s.particles.count);
}

/// Errors and orders on successive meshes, printed.
std::vector<double> orders(std::string_view preset, double amplitude, const std::vector<int>& meshes, const Setting& setting = {})
{
    std::vector<double> r;
    double previous = 0;
    for (int cells : meshes) {
        const double e = displacement_error(preset, amplitude, cells, setting);
        if (previous > 0) r.push_back(std::log2(previous / e));
        std::printf("%-7s A = %-6g %4d cells: displacement error %.4e%s\n", std::string(preset).c_str(), amplitude, cells, e,
                    previous > 0 ? (", order " + std::to_string(r.back())).c_str() : "");
        previous = e;
    }
    return r;
}

/// The derived body force equals the printed one, b = u [k^2/rho (mu + (lambda (1 - ln F) + mu)/F^2) - w^2]
/// (Tran eq. 51 with its errata: pi^2, k = pi).
TEST(Vibration, BodyForceIsThePapers)
{
    const Vibration exact{.amplitude = 0.1};
    const double pi = std::numbers::pi, w = exact.c * pi;
    for (double X : {0.1, 0.35, 0.8})
        for (double t : {0.001, 0.0042, 0.013}) {
            const double u = 0.1 * std::sin(pi * X) * std::sin(w * t);
            const double F = 1 + 0.1 * pi * std::cos(pi * X) * std::sin(w * t);
            const double b =
                u *
                (pi * pi / kDensity * (exact.law.mu + (exact.law.lambda * (1 - std::log(F)) + exact.law.mu) / (F * F)) - w * w);
            EXPECT_NEAR(exact.body_force(X, t), b, 1e-9 * std::fabs(b));
        }
}

TEST(Vibration, SmallAmplitudeIsSecondOrder)
{
    for (const Preset& p : presets())
        for (double order : orders(p.name, 1e-4, {8, 16, 32, 64})) EXPECT_GE(order, 1.9) << p.name;
}

/// Off a full period, where a wrong time level of the velocities shows as first order: every scheme.
TEST(Vibration, EverySchemeIsSecondOrderOffThePeriod)
{
    for (const auto& scheme : Axis<Scheme>::choices) {
        const auto o = orders("cpdi1", 1e-4, {16, 32, 64, 128}, {.scheme = scheme.value, .end = 0.013});
        for (double order : o) EXPECT_GE(order, 1.85) << scheme.name;
    }
}

TEST(Vibration, LargeAmplitudeIsSecondOrderWithStretchedDomains)
{
    for (const char* preset : {"cpgimp", "cpdi1"})
        for (double order : orders(preset, 0.1, {16, 32, 64, 128})) EXPECT_GE(order, 1.9) << preset;
}

/// Negative control: particles that cross cells cost MPM its convergence.
TEST(Vibration, LargeAmplitudeMpmDoesNotConverge)
{
    const std::vector<double> o = orders("mpm", 0.1, {16, 32, 64, 128});
    EXPECT_LT((o[0] + o[1] + o[2]) / 3, 1.0);
    EXPECT_GT(displacement_error("mpm", 0.1, 128), 20 * displacement_error("cpdi1", 0.1, 128));
}

}  // namespace
}  // namespace ordo
