// Exact tangents of all laws, by dual numbers: slopes of stress, history and energy after a step against differences of the same
// step in double, along random directions, in states of all kinds; one particle alone and eight at a time.
#include "base/dual.hpp"
#include "material/laws.hpp"
#include "support/driven.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace ordo::test {
namespace {

constexpr double kStep = 0.1, kPressure = 0.3;  // s, Pa

/// A state before a step, the step, and a direction in which it changes.
template <int D>
struct Probe {
    std::string kind;
    Mat<D> F = Mat<D>::identity(), G{}, direction{};
    Stress<D> sigma{};
    std::vector<double> history;
};

/// Numbers after a step: stress, history, energy; and whether the step failed.
template <class T>
struct Outcome {
    std::vector<T> numbers;
    T fault{0.0};
};

template <Law L, int D, class T>
Outcome<T> step_of(const L& law, const Mat<D, T>& before, const Mat<D, T>& G, Stress<D, T> sigma, std::vector<T> history)
{
    Outcome<T> r;
    const Step<D, T> step{(Mat<D, T>::identity() + G) * before, G, kStep, T(kPressure)};
    T energy(0.0);
    if constexpr (Hyperelastic<L>) {
        sigma  = law.cauchy(step.F);
        energy = law.energy(step.F);
    } else if constexpr (Inelastic<L>) {
        sigma  = law.update(step, history.data(), r.fault);
        energy = law.energy(step.F, history.data());
    } else {
        sigma  = law.update(step, sigma, history.data());
        energy = law.energy(sigma, history.data());
    }
    r.numbers.assign(sigma.c, sigma.c + sigma.size);
    r.numbers.insert(r.numbers.end(), history.begin(), history.end());
    r.numbers.push_back(energy);
    return r;
}

/// A branch as if it were a law: stress is that of Kirchhoff, history b_e and what is lost.
struct Branch {
    double shear, time;
};
template <int D, class T>
Outcome<T> step_of(const Branch& branch, const Mat<D, T>& before, const Mat<D, T>& G, const Stress<D, T>&, std::vector<T> history)
{
    const Step<D, T> step{(Mat<D, T>::identity() + G) * before, G, kStep};
    const Symmetric<D, T> tau = relax(branch.shear, branch.time, step, history.data() + 1, history[0]);
    Outcome<T> r;
    r.numbers.assign(tau.c, tau.c + tau.size);
    r.numbers.insert(r.numbers.end(), history.begin(), history.end());
    return r;
}

/// The step of one probe, moved by `shift` along its direction.
template <class L, int D>
std::vector<double> moved(const L& law, const Probe<D>& p, double shift)
{
    return step_of(law, p.F, p.G + shift * p.direction, p.sigma, p.history).numbers;
}

/// Slopes of as many probes as T has lanes, probe by probe.
template <class T, class L, int D>
std::vector<std::vector<Dual<>>> slopes(const L& law, const Probe<D>* probes)
{
    const int lanes = lanes_of(T(0.0));
    auto pack       = [&](auto&& of) {
        T r(0.0);
        for (int k = 0; k < lanes; ++k) set_lane(r, k, of(probes[k]));
        return r;
    };
    Mat<D, T> F, G;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
            F(i, j) = pack([&](const Probe<D>& p) { return p.F(i, j); });
            G(i, j) = pack([&](const Probe<D>& p) { return Dual<>(p.G(i, j), p.direction(i, j)); });
        }
    Stress<D, T> sigma;
    for (int c = 0; c < sigma.size; ++c) sigma.c[c] = pack([&](const Probe<D>& p) { return p.sigma.c[c]; });
    std::vector<T> history(probes->history.size());
    for (std::size_t c = 0; c < history.size(); ++c) history[c] = pack([&](const Probe<D>& p) { return p.history[c]; });
    const Outcome<T> all = step_of(law, F, G, sigma, history);
    std::vector<std::vector<Dual<>>> r(lanes);
    for (int k = 0; k < lanes; ++k)
        for (const T& number : all.numbers) r[k].push_back(lane(number, k));
    return r;
}

/// What was compared with differences, by kinds of states.
struct Count {
    int all = 0, compared = 0, flowing = 0, at_corners = 0;
};
using Counts = std::map<std::string, Count>;

/// Whether the plastic strain or what is dissipated has grown.
template <class L, int D>
bool flows(const Probe<D>& before, const std::vector<double>& after)
{
    if constexpr (requires { L::kAlpha; }) {
        const double* history = after.data() + Stress<D>::size;
        return history[L::kAlpha] > before.history[L::kAlpha] || history[L::kWork] > before.history[L::kWork];
    }
    return false;
}

/// Compares probes, eight or more of them. `scale` holds the size of each number. Left out is what has a kink within the steps of the
/// differences: where some of these flow and others do not, and numbers whose differences with two steps are not the same.
template <class L, int D>
void compare(const L& law, const std::vector<Probe<D>>& probes, const std::vector<double>& scale, Counts& counts)
{
    constexpr double tolerance = 2e-8, h = 1e-4;
    std::vector<std::vector<Dual<>>> alone, together;
    for (const Probe<D>& p : probes) alone.push_back(slopes<Dual<>>(law, &p)[0]);
    for (std::size_t k = 0; k + 8 <= probes.size(); k += 8)
        for (auto& one : slopes<Dual<Lanes>>(law, &probes[k])) together.push_back(one);
    for (std::size_t k = 0; k < together.size(); ++k) {
        const Probe<D>& p = probes[k];
        SCOPED_TRACE(p.kind);
        const std::vector<double> now = moved(law, p, 0);
        const bool is_flowing         = flows<L>(p, now);
        bool is_smooth                = true;
        auto centred                  = [&](double step) {
            std::vector<double> up         = moved(law, p, step);
            const std::vector<double> down = moved(law, p, -step);
            is_smooth                      = is_smooth && flows<L>(p, up) == is_flowing && flows<L>(p, down) == is_flowing;
            for (std::size_t c = 0; c < up.size(); ++c) up[c] = (up[c] - down[c]) / (2 * step);
            return up;
        };
        const std::vector<double> wide = centred(2 * h), middle = centred(h), narrow = centred(h / 2);
        Count& count = counts[p.kind];
        for (std::size_t c = 0; c < now.size(); ++c) {
            EXPECT_TRUE(std::isfinite(alone[k][c].slope) && std::isfinite(together[k][c].slope)) << c;
            EXPECT_NEAR(alone[k][c].value, now[c], 1e-12 * (scale[c] + std::fabs(now[c]))) << c;
            const double exact = (4 * narrow[c] - middle[c]) / 3, other = (4 * middle[c] - wide[c]) / 3;
            const double size = tolerance * (scale[c] + std::fabs(exact));
            ++count.all;
            if (!is_smooth || std::fabs(exact - other) > size / 4) continue;
            ++count.compared;
            EXPECT_NEAR(alone[k][c].slope, exact, size) << "number " << c;
            EXPECT_NEAR(together[k][c].slope, exact, size) << "number " << c << " of eight particles";
        }
        if (!is_smooth || !is_flowing) continue;
        Stress<D> sigma{};
        std::copy_n(now.begin(), sigma.size, sigma.c);
        const Spectrum<D> s = spectrum(sigma);
        const double near   = 1e-9 * (scale[0] + std::fabs(s.value[0]));
        ++count.flowing;
        for (int a = 0; a < 3; ++a) is_smooth = is_smooth && std::fabs(s.value[a] - s.value[(a + 1) % 3]) > near;
        count.at_corners += !is_smooth;
    }
}

template <int D>
Mat<D> diagonal(double a, double b, double c)
{
    const double all[3] = {a, b, c};
    Mat<D> r{};
    for (int i = 0; i < D; ++i) r(i, i) = all[i];
    return r;
}
template <int D>
Mat<D> turned(const Mat<D>& m, Random& random)
{
    Mat<D> Q = Mat<D>::identity();
    if constexpr (D == 3) Q = random_rotation(random);
    if constexpr (D == 2) {
        const double angle = uniform(random, 0, 3);
        Q                  = {{{std::cos(angle), -std::sin(angle)}, {std::sin(angle), std::cos(angle)}}};
    }
    return Q * m * transpose(Q);
}

/// A kind of paths: how many steps lead to the state, and the displacement gradient of each of them.
template <int D>
struct Kind {
    std::string name;
    int steps;
    std::function<Mat<D>(Random&)> G;
};
template <int D>
std::vector<Kind<D>> kinds()
{
    auto any  = [](double size) { return [=](Random& r) { return random_deformation<D>(r, size) - Mat<D>::identity(); }; };
    auto same = [](double low, double high) { return [=](Random& r) { return uniform(r, low, high) * Mat<D>::identity(); }; };
    // Two principal values are equal but for `gap`, along axes that a fixed seed turns the same way in each step of a path.
    auto pair = [](double along, double across, double gap) {
        return [=, axes = std::uint64_t(1), count = 0](Random& r) mutable {
            if (count++ % 6 == 0) axes = r();
            Random fixed(axes);
            return turned(diagonal<D>(along, across, across + gap), fixed);
        };
    };
    return {{"at rest", 0, [](Random&) { return Mat<D>{}; }},
            {"isotropic compression", 0, same(-0.03, -0.01)},
            {"isotropic tension", 0, same(0.0005, 0.004)},
            {"isotropic tension, large", 5, same(0.01, 0.05)},
            {"apex", 5, [=](Random& r) { return any(0.01)(r) + 0.03 * Mat<D>::identity(); }},
            {"small", 2, any(0.003)},
            {"moderate", 5, any(0.04)},
            {"large", 5, any(0.15)},
            {"compressed and sheared", 5, [=](Random& r) { return any(0.04)(r) - 0.015 * Mat<D>::identity(); }},
            {"compression along one axis", 5, pair(-0.04, 0.01, 0)},
            {"extension along one axis", 5, pair(0.03, -0.025, 0)},
            {"nearly equal, 1e-9", 5, pair(-0.04, 0.01, 1e-9 / 6)},
            {"nearly equal, 1e-7", 5, pair(-0.04, 0.01, 1e-7 / 6)},
            {"nearly equal, 1e-5", 5, pair(0.03, -0.025, 1e-5 / 6)},
            {"still", 5, [n = 0, any](Random& r) mutable { return n++ % 6 < 5 ? any(0.04)(r) : Mat<D>{}; }}};
}

/// Probes of all kinds, `each` of each, of neighbours that differ in kind.
template <int D, class Advance>
std::vector<Probe<D>> make_probes(const std::vector<double>& start, int each, Advance&& advance)
{
    Random random(31);
    std::vector<Kind<D>> all = kinds<D>();
    std::vector<Probe<D>> r;
    for (int n = 0; n < each; ++n)
        for (Kind<D>& kind : all) {
            Probe<D> p;
            p.kind    = kind.name;
            p.history = start;
            for (int k = 0; k < kind.steps; ++k) {
                p.G = kind.G(random);
                advance(p);
            }
            p.G         = kind.G(random);
            p.direction = random_deformation<D>(random, 1.0) - Mat<D>::identity();
            r.push_back(p);
        }
    return r;
}

/// All kinds of states of a law, as one history of numbers that `advance` leads through each step.
template <class L, int D, class Advance>
Counts check_states(const L& law, const std::vector<double>& start, const std::vector<double>& scale, Advance&& advance)
{
    Counts counts;
    compare(law, make_probes<D>(start, 16, advance), scale, counts);
    Count sum;
    for (const auto& [kind, one] : counts) {
        sum.all += one.all;
        sum.compared += one.compared;
        sum.flowing += one.flowing;
    }
    EXPECT_GT(sum.compared, 0.7 * sum.all);
    if constexpr (requires { L::kAlpha; }) {
        EXPECT_GT(sum.flowing, 16);
    }
    return counts;
}

template <int D, class L>
void check(const Material& m)
{
    SCOPED_TRACE(std::string(L::name) + " in " + std::to_string(D) + "D");
    std::vector<double> start(column_count(L::history, D)), scale(Stress<D>::size, m.p_wave_modulus());
    m.law->in<D>().start(m, Mat<D>::identity(), start.data());
    for (const HistoryColumn& c : L::history)
        if (c.min_dim <= D) scale.push_back(c.what.ends_with("Pa") || c.what.ends_with("J/m^3") ? m.p_wave_modulus() : 1.0);
    scale.push_back(m.p_wave_modulus());
    Counts counts = check_states<L, D>(L::of(m), start, scale, [&](Probe<D>& p) {
        double fault = 0;
        p.F          = p.F + p.G * p.F;
        p.sigma      = m.law->in<D>().update(m, {p.F, p.G, kStep, kPressure}, p.sigma, p.history.data(), fault);
        EXPECT_FALSE(fault > 0);
    });
    if (L::name == "drucker-prager" || (L::name == "mohr-coulomb" && m.parameters[MohrCoulomb::kFriction] > 0)) {
        EXPECT_GT(counts["apex"].at_corners, 8);
        if (D == 3) {
            EXPECT_GT(counts["compression along one axis"].at_corners, 8) << "edges";
        }
    }
}
template <class L>
void check_dimensions(const Material& m)
{
    check<1, L>(m);
    if constexpr (L::max_dim > 1) {
        check<2, L>(m);
        check<3, L>(m);
    }
}
template <class... L>
void check_all(LawList<L...>)
{
    (check_dimensions<L>(sample_material(L::name, L::max_dim)), ...);
}
TEST(Tangents, AreTheDerivativesOfTheStep) { check_all(Laws{}); }

/// Branches of the laws that their samples do not take.
TEST(Tangents, OfOtherParameters)
{
    auto with = [](const std::string& law, std::initializer_list<std::string> last) {
        std::vector<std::string> settings{"young=1000", "poisson=0.3"};
        settings.insert(settings.end(), last);
        return material_of(law, settings);
    };
    check_dimensions<J2>(with("j2", {"yield=30", "hardening=-300"}));
    check_dimensions<DruckerPrager>(
        with("drucker-prager", {"friction_angle=30", "dilation_angle=0", "cohesion=3", "hardening=-20"}));
    check_dimensions<DruckerPrager>(
        with("drucker-prager", {"friction_angle=30", "dilation_angle=10", "cohesion=0", "volume_correction=true"}));
    check_dimensions<MohrCoulomb>(with("mohr-coulomb", {"friction_angle=30", "dilation_angle=10", "cohesion=10"}));
    check_dimensions<MohrCoulomb>(with("mohr-coulomb", {"friction_angle=0", "dilation_angle=0", "cohesion=15"}));
    check_dimensions<MohrCoulomb>(
        with("mohr-coulomb", {"friction_angle=30", "dilation_angle=0", "cohesion=10", "tension_cutoff=5"}));
    check_dimensions<JohnsonCook>(
        with("johnson-cook", {"A=25", "B=30", "n=0.4", "C=0.05", "m=1.1", "reference_rate=0.01", "reference_temperature=290",
                              "melting_temperature=900", "specific_heat=0.001", "taylor_quinney=0.9"}));
    check_dimensions<Fluid>(material_of("fluid", {"sound_speed=1.2", "tension=false"}));
}

template <int D>
void check_branch()
{
    SCOPED_TRACE(std::to_string(D) + "D");
    const Branch branch{100, 0.3};
    std::vector<double> start(1 + Symmetric<D>::size), scale(2 * start.size(), 1.0);
    for (int a = 0; a < 3; ++a) start[1 + a] = 1;
    std::fill_n(scale.begin(), start.size(), branch.shear);  // stress and what is lost
    check_states<Branch, D>(branch, start, scale, [&](Probe<D>& p) {
        p.F = p.F + p.G * p.F;
        relax(branch.shear, branch.time, Step<D>{p.F, p.G, kStep}, p.history.data() + 1, p.history[0]);
    });
}
TEST(Tangents, OfMaxwellBranches)
{
    check_branch<1>();
    check_branch<2>();
    check_branch<3>();
}

}  // namespace
}  // namespace ordo::test
