// The axis `averaging`: its operator against its definition, what it keeps, and that forces do the work of averaged strains.
// Artificial viscosity: its pressure and its work.
#include "method/averaging.hpp"

#include "kernels/averaging.hpp"
#include "method/diagnostics.hpp"
#include "method/layout.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace ordo {
namespace {

constexpr std::array kAverages{Averaging::cell, Averaging::node};

MethodSpec averaged(MethodSpec spec, Averaging averaging)
{
    spec.averaging = averaging;
    return spec;
}

/// A law whose stress is a function of F, whose J is averaged, and one with memory, whose dilation of a step is.
const Material& material_with(bool has_memory)
{
    static const Material elastic = elastic_material(find_law("neo-hookean"), 1000.0, 1000.0, 0.3),
                          plastic = test::material_of("j2", {"young=1000", "poisson=0.3", "density=1000", "yield=1e3"}, 2);
    return has_memory ? plastic : elastic;
}

/// Random particles of six bodies: more than share a record.
template <int D>
struct Crowd {
    test::Random random{11};
    Explicit<D> method;
    State<D> s;

    Crowd(const MethodSpec& spec, bool is_periodic, bool has_memory = false)
        : method(model_of(spec, is_periodic, has_memory)), s(test::random_state(method, 300, random))
    {
        const ParticleView<D> p = s.particles.view();
        for (int i = 0; i < p.count; ++i) {
            p.body[i] = i % 6;
            if (!has_memory) p.J[i] *= test::uniform(random, 0.8, 1.2);
            if (!has_cells(spec)) p.V[i] = p.J[i] * p.V0[i];
        }
        sort_particles(method.model(), s);
        prepare_averages(method.model(), s);
    }
    static Model<D> model_of(const MethodSpec& spec, bool is_periodic, bool has_memory)
    {
        Model<D> model  = test::unit_box<D>(8, spec);
        model.materials = {material_with(has_memory)};
        model.body_forces.resize(6);
        if (is_periodic) {  // the crowd lies across the seam
            model.periodic = Vec<D, bool>::filled(true);
            model.origin   = Vec<D>::filled(0.5);
        }
        return model;
    }
    std::vector<double> numbers()
    {
        std::vector<double> r(s.particles.x.size());
        for (double& one : r) one = test::uniform(random, -1, 1);
        return r;
    }
    std::vector<double> average_of(std::vector<double> u)
    {
        average(method.model().method, s, u.data());
        return u;
    }
    double weight(int i) const { return method.model().materials[0].law->is_hyperelastic ? s.particles.V0[i] : s.particles.V[i]; }
    /// f(cell or vertex, weight) from the definition; places in the first period.
    template <class F>
    void for_each_share(int i, F&& f) const
    {
        const Model<D>& model = method.model();
        const bool at_nodes   = model.method.averaging == Averaging::node;
        Vec<D> at{};
        for (int a = 0; a < D; ++a) at[a] = (s.particles.x[i][a] - model.origin[a]) / model.h[a];
        IndexBox<D>{{}, Index<D>::filled(at_nodes ? 2 : 1)}.for_each([&](const Index<D>& corner) {
            std::array<int, D> k{};
            double weight = 1.0;
            for (int a = 0; a < D; ++a) {
                const int place = static_cast<int>(std::floor(at[a])) + corner[a];
                if (at_nodes) weight *= 1 - std::fabs(at[a] - place);
                k[a] = model.periodic[a] ? (place % 8 + 8) % 8 : place;
            }
            f(k, weight);
        });
    }
    std::vector<double> defined_average(const std::vector<double>& u) const
    {
        std::map<std::pair<int, std::array<int, D>>, std::pair<double, double>> sums;
        for (int i = 0; i < s.particles.count; ++i)
            for_each_share(i, [&](const auto& k, double w) {
                auto& [vu, v] = sums[{s.particles.body[i], k}];
                vu += w * weight(i) * u[i];
                v += w * weight(i);
            });
        std::vector<double> r(u.size());
        for (int i = 0; i < s.particles.count; ++i)
            for_each_share(i, [&](const auto& k, double w) {
                const auto& [vu, v] = sums[{s.particles.body[i], k}];
                if (w > 0) r[i] += w * vu / v;
            });
        return r;
    }
};

template <int D>
void check_operator(Averaging averaging, bool is_periodic, bool has_memory)
{
    Crowd<D> crowd(averaged(test::shape_spec(Basis::bspline2, Domain::point), averaging), is_periodic, has_memory);
    const std::vector<double> u = crowd.numbers(), w = crowd.numbers(), mean = crowd.average_of(u);
    const std::vector<double> expected = crowd.defined_average(u), other = crowd.average_of(w);
    const std::vector<double> one = crowd.average_of(std::vector<double>(u.size(), 1.0));
    double left = 0, right = 0, size = 0, change = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        EXPECT_NEAR(mean[i], expected[i], 1e-14);
        EXPECT_NEAR(one[i], 1.0, 1e-14);
        const double weight = crowd.weight(static_cast<int>(i));
        left += weight * w[i] * mean[i];
        right += weight * u[i] * other[i];
        size += weight;
        change += std::fabs(mean[i] - u[i]) / static_cast<double>(u.size());
    }
    EXPECT_NEAR(left, right, 1e-14 * size);
    EXPECT_GT(change, D < 3 ? 0.1 : 0.01);
}
TEST(Averaging, IsItsDefinitionAndSelfAdjoint)
{
    for (const Averaging averaging : kAverages)
        for (const bool is_periodic : {false, true})
            for (const bool has_memory : {false, true}) {
                SCOPED_TRACE(std::string(name_of(averaging)) + (is_periodic ? ", periodic" : "") +
                             (has_memory ? ", memory" : ""));
                check_operator<1>(averaging, is_periodic, has_memory);
                check_operator<2>(averaging, is_periodic, has_memory);
                check_operator<3>(averaging, is_periodic, has_memory);
            }
}

/// At vertices linear fields are kept inside a regular body, in cells they are not.
TEST(Averaging, KeepsLinearFieldsAtVertices)
{
    for (const Averaging averaging : kAverages) {
        const Explicit<2> method(test::unit_box<2>(8, averaged({}, averaging)));
        State<2> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 2)));
        std::vector<double> u(s.particles.x.size());
        for (int i = 0; i < s.particles.count; ++i) u[i] = 3 * s.particles.x[i][0] - 2 * s.particles.x[i][1];
        const std::vector<double> before = u;
        prepare_averages(method.model(), s);
        average(method.model().method, s, u.data());
        double most = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            const Vec<2>& x = s.particles.x[i];
            if (std::min({x[0], x[1], 1 - x[0], 1 - x[1]}) > 1.0 / 8) most = std::max(most, std::fabs(u[i] - before[i]));
        }
        if (averaging == Averaging::node)
            EXPECT_LT(most, 1e-14);
        else
            EXPECT_GT(most, 0.03);
    }
}

TEST(Averaging, DilationIsExact)
{
    test::Random random(3);
    for (int k = 0; k < 20; ++k) {
        const Mat<3> f = test::random_deformation<3>(random, 0.3);
        const Mat<3> G = f + (-1.0) * Mat<3>::identity();
        EXPECT_NEAR(dilation(G), det(f) - 1, 1e-15);
        EXPECT_NEAR(dilation(1e-9 * G), 1e-9 * (G(0, 0) + G(1, 1) + G(2, 2)), 1e-17);
    }
}

/// sum f_i v_i = -sum (V_p (det F_p/J_p) (sigma_p - s_p I) : L_p + w_p s_p A((V/w) tr L)_p) with weights w, for any velocity of the
/// nodes.
template <int D>
void check_work(const MethodSpec& spec, bool has_memory)
{
    Crowd<D> crowd(spec, false, has_memory);
    State<D>& s             = crowd.s;
    const Passes<D> passes  = choose_passes<D>(spec);
    const ParticleView<D> p = s.particles.view();
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) p.v[i][a] = 0;
    std::vector<Stress<D>> stress(p.sigma, p.sigma + p.count);
    find_force_stress(crowd.method.model(), s);
    for (Lanes& n : s.field.nodes) n = Lanes{};
    Sweep<D> view{s.lattice, p, s.field.nodes.data(), crowd.method.model().materials.data(), 1.0, 0, 0};
    view.p.sigma = s.force_stress.data();
    passes.force(view, 0, p.count);
    double power = 0;
    for (Lanes& n : s.field.nodes)
        for (int a = 0; a < D; ++a) {
            const double v = test::uniform(crowd.random, -0.001, 0.001);
            power += v * n[NodeLane::increment + a];
            n[NodeLane::velocity + a] = v;
        }
    std::vector<Mat<D>> L(s.particles.x.size());
    view.increments = L.data();
    const std::vector<double> V(p.V, p.V + p.count);
    std::vector<double> F_over_J(p.count);
    for (int i = 0; i < p.count; ++i) F_over_J[i] = det(p.F[i]) / p.J[i];
    TileReport report;
    passes.deform(view, 0, p.count, report);
    std::copy(V.begin(), V.end(), p.V);
    std::vector<double> rate(L.size()), own(L.size());
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) {
            own[i] += L[i](a, a);
            rate[i] += V[i] / crowd.weight(i) * L[i](a, a);
        }
    const std::vector<double> mean = crowd.average_of(rate);
    double expected = 0, plain = 0;
    for (int i = 0; i < p.count; ++i) {
        double work = 0, normal = 0;
        for (int a = 0; a < D; ++a) {
            normal += stress[i](a, a) / D;
            for (int b = 0; b < D; ++b) work += stress[i](a, b) * L[i](a, b);
        }
        expected -= V[i] * F_over_J[i] * (work - normal * own[i]) + crowd.weight(i) * normal * mean[i];
        plain -= V[i] * work;
    }
    EXPECT_NEAR(power, expected, 1e-11 * std::fabs(expected));
    EXPECT_GT(std::fabs(plain - expected), 1e-4 * std::fabs(expected));
}
TEST(Averaging, ForcesDoTheWorkOfAveragedStrains)
{
    for (const Averaging averaging : kAverages)
        test::for_each_spec(test::all_shapes(), [&](const MethodSpec& spec) {
            for (const bool has_memory : {false, true}) {
                check_work<2>(averaged(spec, averaging), has_memory);
                check_work<3>(averaged(spec, averaging), has_memory);
            }
        });
}

/// A wobbling block after some steps.
template <int D>
State<D> wobbled(const Explicit<D>& method, int steps)
{
    State<D> s = method.start(test::plant_halves(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
    set_velocities(
        s.particles, 0, s.particles.count,
        [](const Vec<D>& x) {
            Vec<D> v{};
            for (int a = 0; a < D; ++a) v[a] = std::sin(6 * x[a] + a) * std::cos(4 * x[(a + 1) % D]);
            return v;
        },
        method.model().h);
    for (int k = 0; k < steps; ++k) method.step(s, 0.2 * courant_time_step(method.model(), s.particles));
    return s;
}

double volume(const State<2>& s)
{
    double r = 0;
    for (int i = 0; i < s.particles.count; ++i) r += det(s.particles.F[i]) * s.particles.V0[i];
    return r;
}

void check_total_volume(MethodSpec spec, Averaging averaging, bool has_memory)
{
    Model<2> model  = test::unit_box<2>(8, spec);
    model.materials = {material_with(has_memory)};
    const Explicit<2> plain(model);
    model.method.averaging = averaging;
    const Explicit<2> other(model);
    const int steps  = spec.scheme == TimeScheme::usf ? 2 : 1;  // USF deforms by the velocity of the step before
    const State<2> s = wobbled(plain, steps), t = wobbled(other, steps);
    double change = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        const double own = has_memory ? det(t.particles.F[i]) : det(s.particles.F[i]);
        change += std::fabs(det(s.particles.F[i]) - det(t.particles.F[i]));
        EXPECT_NEAR(t.particles.J[i], own, 1e-15);
        if (!has_cells(spec)) {
            EXPECT_NEAR(t.particles.V[i], own * t.particles.V0[i], 1e-17);
        }
    }
    if (spec.scheme != TimeScheme::usf || !has_cells(spec) || !has_memory) {  // else volumes between corners are the weights
        EXPECT_NEAR(volume(s), volume(t), 1e-15);
    }
    EXPECT_GT(change, 1e-4);
}
/// The first step, from the same velocities: dilations differ between particles, their sum does not. V = J V0, and J is the
/// particle's own or, of a law with memory, that of averages.
TEST(Averaging, KeepsTheTotalVolume)
{
    for (const TimeScheme scheme : {TimeScheme::usl, TimeScheme::usf, TimeScheme::musl})
        for (const Domain domain : {Domain::point, Domain::box, Domain::parallelepiped, Domain::cell})
            for (const Averaging averaging : kAverages)
                for (const bool has_memory : {false, true}) {
                    MethodSpec spec = test::shape_spec(Basis::hat, domain);
                    spec.scheme     = scheme;
                    check_total_volume(spec, averaging, has_memory);
                }
}

/// Where stress is a function of F, det F is the average of J in the last step, whatever cells the particles were in before.
TEST(Averaging, RemembersVolumes)
{
    for (const Averaging averaging : kAverages) {
        const Explicit<2> method(test::unit_box<2>(8, averaged(test::shape_spec(Basis::hat, Domain::parallelepiped), averaging)));
        State<2> s = wobbled(method, 60);
        method.step(s, 1e-9);  // averages are those of the places before, to 1e-9
        std::vector<double> J(s.particles.J.begin(), s.particles.J.end()), own = J;
        prepare_averages(method.model(), s);
        average(method.model().method, s, J.data());
        double difference = 0, moved = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            EXPECT_NEAR(det(s.particles.F[i]), J[i], 1e-7);
            difference = std::max(difference, std::fabs(J[i] - own[i]));
            moved      = std::max(moved, std::fabs(s.particles.x[i][0] - s.particles.X[i][0]));
        }
        EXPECT_GT(difference, 1e-3);
        EXPECT_GT(moved, 0.5 / 8);
    }
}

/// Twenty steps with and without a sort before each: averages do not depend on the order of the sort.
TEST(Averaging, DoesNotDependOnTheSort)
{
    for (const Averaging averaging : kAverages) {
        const Explicit<2> method(test::unit_box<2>(8, averaged(test::shape_spec(Basis::hat, Domain::box), averaging)));
        State<2> s = wobbled(method, 10), t = wobbled(method, 10);
        for (int k = 0; k < 20; ++k) {
            sort_particles(method.model(), t);
            method.step(s, 1e-3);
            method.step(t, 1e-3);
        }
        std::vector<double> J(s.particles.x.size());
        for (int i = 0; i < s.particles.count; ++i) J[s.particles.id[i]] = det(s.particles.F[i]);
        for (int i = 0; i < t.particles.count; ++i) EXPECT_NEAR(J[t.particles.id[i]], det(t.particles.F[i]), 1e-12);
    }
}

/// A nearly incompressible block of free faces: with averages on both sides energy never grows. With those of strains alone, as
/// published, it did (2.5 times at vertices, 1.4 with quadratic splines).
TEST(Averaging, DoesNotAddEnergy)
{
    for (const Averaging averaging : kAverages)
        for (const MethodSpec& spec :
             {test::shape_spec(Basis::hat, Domain::box), test::shape_spec(Basis::bspline2, Domain::point)}) {
            SCOPED_TRACE(test::describe(averaged(spec, averaging)));
            Model<2> model  = test::unit_box<2>(16, averaged(spec, averaging));
            model.materials = {elastic_material(find_law("neo-hookean"), 1.0, 1.0, 0.499)};
            const Explicit<2> method(std::move(model));
            State<2> s = method.start(plant_all(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
            set_velocities(
                s.particles, 0, s.particles.count,
                [](const Vec<2>& x) {
                    return Vec<2>{0.05 * std::sin(6 * x[0]) * std::cos(6 * x[1]),
                                  -0.05 * std::cos(6 * x[0]) * std::sin(6 * x[1])};
                },
                method.model().h);
            const double before = totals(method.model(), s).total_energy();
            double most = 0, t = 0;
            while (t < 3) {
                const double dt = 0.4 * courant_time_step(method.model(), s.particles);
                method.step(s, dt);
                t += dt;
                most = std::max(most, totals(method.model(), s).total_energy());
            }
            EXPECT_LT(most, 1.02 * before);
            EXPECT_GT(totals(method.model(), s).total_energy(), 0.4 * before);
        }
}

/// q of a uniform compression, and its work: what a step of the law itself does not have.
void check_artificial_pressure(TimeScheme scheme)
{
    MethodSpec spec          = test::shape_spec(Basis::hat, Domain::box);
    spec.scheme              = scheme;
    spec.linear_viscosity    = 0.1;
    spec.quadratic_viscosity = 1.2;
    const Explicit<2> method(test::walled_box<2>(8, spec, ConditionType::fixed));
    const Model<2>& model = method.model();
    State<2> s            = method.start(plant_all(model, test::block(model, 0.25, 0.75, 2)));
    set_velocities(
        s.particles, 0, s.particles.count,
        [](const Vec<2>& x) {
            return Vec<2>{-0.3 * (x[0] - 0.5), (x[0] < 0.5 ? 0.1 : 0.8) * (x[1] - 0.5)};
        },
        model.h);
    const double dt = 1e-3;
    for (int k = 0; k < 2; ++k) {
        std::vector<double> q(s.particles.q.begin(), s.particles.q.end()), J(q.size()), work(q.size());
        std::vector<int> id(s.particles.id.begin(), s.particles.id.end());
        for (int i = 0; i < s.particles.count; ++i) {
            J[id[i]]    = det(s.particles.F[i]);
            work[id[i]] = s.particles.q_work[i];
        }
        std::vector<double> q_of(q.size());
        for (std::size_t i = 0; i < q.size(); ++i) q_of[id[i]] = q[i];
        method.step(s, dt);
        int compressed = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            const int n         = s.particles.id[i];
            const double change = det(s.particles.F[i]) - J[n], rate = -change / J[n] / dt;
            const double rho = s.particles.m[i] / s.particles.V[i], c = std::sqrt((577.0 + 2 * 385) / 1000), h = 0.125;
            const double expected = rate > 0 ? rho * h * (1.44 * h * rate * rate + 0.1 * c * rate) : 0.0;
            EXPECT_NEAR(s.particles.q[i], expected, 1e-9 * (1 + expected));
            EXPECT_NEAR(s.particles.q_work[i] - work[n], -q_of[n] * change, 1e-15);
            compressed += rate > 0;
        }
        if (k > 0 || scheme != TimeScheme::usf) {  // whose first step deforms nothing
            EXPECT_GT(compressed, s.particles.count / 4);
            EXPECT_LT(compressed, s.particles.count * 3 / 4);
        }
    }
}
TEST(ArtificialViscosity, IsItsFormula)
{
    for (const TimeScheme scheme : {TimeScheme::usl, TimeScheme::usf, TimeScheme::musl}) check_artificial_pressure(scheme);
}

/// The same of copper with Mie-Gruneisen's pressure, whose energy the heat of q raises: it must not count as stored.
TEST(ArtificialViscosity, HeatsWithoutBeingStored)
{
    MethodSpec spec          = test::shape_spec(Basis::hat, Domain::parallelepiped);
    spec.scheme              = TimeScheme::musl;
    spec.linear_viscosity    = 0.3;
    spec.quadratic_viscosity = 1.5;
    Model<1> model           = test::unit_box<1>(200, spec);
    model.materials          = {
                 test::material_of("johnson-cook",
                                   {"young=117e9", "poisson=0.35", "density=8930", "A=90e4", "B=292e4", "n=0.31", "C=0.025", "m=1.09",
                                    "reference_rate=1", "reference_temperature=298", "melting_temperature=1356", "specific_heat=383",
                                    "taylor_quinney=0.9", "sound_speed=3940", "shock_slope=1.489", "gruneisen=2.02"},
                                   1)};
    model.conditions.push_back({.axis = 0, .outer_is_above = false, .at = 0.0, .type = ConditionType::fixed, .value = {}});
    const Explicit<1> method(std::move(model));
    State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 0.8, 2)));
    for (Vec<1>& v : s.particles.v) v[0] = -500;
    const double before = totals(method.model(), s).total_energy();
    while (s.t < 1e-4) method.step(s, automatic_time_step(method.model(), s.particles, 0.3));
    const Totals e = totals(method.model(), s);
    EXPECT_GT(e.artificial, 0.02 * before);
    EXPECT_NEAR(e.total_energy() + e.dissipated + e.artificial, before, 0.1 * e.artificial);
}

/// A block that runs into a wall: energy and what is taken add up, and the stress behind the front hardly rings.
TEST(ArtificialViscosity, AccountsForItsEnergy)
{
    struct Result {
        double error, taken, ringing;
    };
    auto run = [](double linear, double quadratic) {
        MethodSpec spec          = test::shape_spec(Basis::hat, Domain::parallelepiped);
        spec.scheme              = TimeScheme::musl;
        spec.linear_viscosity    = linear;
        spec.quadratic_viscosity = quadratic;
        Model<1> model           = test::unit_box<1>(200, spec);
        model.conditions.push_back({.axis = 0, .outer_is_above = false, .at = 0.0, .type = ConditionType::fixed, .value = {}});
        const Explicit<1> method(std::move(model));
        State<1> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 0.8, 2)));
        for (Vec<1>& v : s.particles.v) v[0] = -0.3;
        const double before = totals(method.model(), s).total_energy();
        while (s.t < 0.3) method.step(s, automatic_time_step(method.model(), s.particles, 0.3));
        const Totals e = totals(method.model(), s);
        double low = 1e300, high = -1e300;  // of stresses well behind the front
        for (int i = 0; i < s.particles.count; ++i)
            if (s.particles.x[i][0] > 0.05 && s.particles.x[i][0] < 0.2) {
                low  = std::min(low, s.particles.sigma[i](0, 0));
                high = std::max(high, s.particles.sigma[i](0, 0));
            }
        return Result{std::fabs(e.total_energy() + e.artificial - before) / before, e.artificial / before,
                      (high - low) / -(high + low)};
    };
    const Result plain = run(0, 0), damped = run(0.06, 1.5);
    EXPECT_EQ(plain.taken, 0);
    EXPECT_GT(damped.taken, 0.01);
    EXPECT_LT(damped.error, 0.005);
    EXPECT_LT(damped.ringing, 0.5 * plain.ringing);
    RecordProperty("ringing", std::to_string(damped.ringing));
    RecordProperty("plain", std::to_string(plain.ringing));
}

}  // namespace
}  // namespace ordo
