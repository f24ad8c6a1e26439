// Whole steps: time levels, schemes against a literal step written here, boundaries, periodic axes, errors.
#include "kernels/nodes.hpp"
#include "material/jaumann_elastic.hpp"
#include "material/neo_hookean.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/layout.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace ordo {
namespace {

/// A literal 1D MPM step with hats: the paper's loops, nothing shared with the kernels.
struct LiteralBar {
    double h, mu, lambda, rho;
    int cells;
    std::vector<double> x, v, F, sigma, V0;
    Filter filter = Filter::none;
    int order     = 1;  ///< of the filter

    /// `part`: of the advanced velocity in the strain's, for usl and musl.
    void step(double dt, double dt_prev, TimeScheme scheme, double part, bool filters = false)
    {
        const std::size_t n = static_cast<std::size_t>(cells) + 1;
        std::vector<double> m(n), p(n), f(n), a(n), vi(n), vs(n);
        auto N  = [&](std::size_t i, double at) { return std::max(0.0, 1 - std::fabs(at / h - static_cast<double>(i))); };
        auto dN = [&](std::size_t i, double at) {
            const double s = at / h - static_cast<double>(i);
            return std::fabs(s) >= 1 ? 0.0 : s < 0 ? 1 / h : -1 / h;
        };
        auto project = [&](std::vector<double>& out) {
            for (std::size_t i = 0; i < n; ++i) {
                double mass = 0, momentum = 0;
                for (std::size_t q = 0; q < x.size(); ++q) {
                    mass += N(i, x[q]) * rho * V0[q];
                    momentum += N(i, x[q]) * rho * V0[q] * v[q];
                }
                m[i]   = mass;
                out[i] = mass > 0 ? momentum / mass : 0;
            }
            out.front() = out.back() = 0;  // fixed ends
        };
        const double dt_kick = 0.5 * (dt_prev + dt);
        auto stress          = [&](const std::vector<double>& w, double dt_stress) {
            for (std::size_t q = 0; q < x.size(); ++q) {
                double L = 0;
                for (std::size_t i = 0; i < n; ++i) L += w[i] * dN(i, x[q]);
                F[q] *= scheme == TimeScheme::usf ? 1 / (1 - dt_stress * L) : 1 + dt_stress * L;  // USF: x is the end of the step
                sigma[q] = (lambda * std::log(F[q]) + mu * (F[q] * F[q] - 1)) / F[q];
            }
        };
        project(vi);
        if (scheme == TimeScheme::usf) stress(vi, dt_prev);  // the velocities of the step that led here
        for (std::size_t i = 0; i < n; ++i) {
            f[i] = 0;
            for (std::size_t q = 0; q < x.size(); ++q) f[i] -= F[q] * V0[q] * sigma[q] * dN(i, x[q]);
            a[i] = m[i] > 0 ? f[i] / m[i] : 0;
            vi[i] += dt_kick * a[i];
        }
        a.front() = a.back() = vi.front() = vi.back() = 0;
        auto at_particles                             = [&](const std::vector<double>& of_nodes) {
            std::vector<double> r(x.size());
            for (std::size_t q = 0; q < x.size(); ++q)
                for (std::size_t i = 0; i < n; ++i) r[q] += N(i, x[q]) * of_nodes[i];
            return r;
        };
        if (filters && filter == Filter::xpic) {  // v <- v - (1 - S R)^m v
            const std::vector<double> whole = v;
            for (int k = 0; k < order; ++k) {
                std::vector<double> seen(n);
                project(seen);
                const std::vector<double> back = at_particles(seen);
                for (std::size_t q = 0; q < x.size(); ++q) v[q] -= back[q];
            }
            for (std::size_t q = 0; q < x.size(); ++q) v[q] = whole[q] - v[q];
        }
        if (filters && filter == Filter::fmpm) {  // v_i <- v_i + (1 - R S) v_i + ..., of which v takes all
            std::vector<double> term = vi, again(n);
            for (int k = 1; k < order; ++k) {
                v = at_particles(term);
                project(again);
                for (std::size_t i = 0; i < n; ++i) vi[i] += term[i] -= again[i];
            }
            v = at_particles(vi);
        } else {
            const std::vector<double> back = at_particles(a);
            for (std::size_t q = 0; q < x.size(); ++q) v[q] += dt_kick * back[q];
        }
        if (scheme != TimeScheme::usf) {
            project(vs);
            for (std::size_t i = 0; i < n; ++i) vs[i] = part * vi[i] + (1 - part) * vs[i];
            stress(vs, dt);
        }
        std::vector<double> dx(x.size());
        for (std::size_t q = 0; q < x.size(); ++q)
            for (std::size_t i = 0; i < n; ++i) dx[q] += dt * N(i, x[q]) * vi[i];
        for (std::size_t q = 0; q < x.size(); ++q) x[q] += dx[q];
    }
};

/// `part`: negative: of the scheme.
void check_against_literal(TimeScheme scheme, Start start, double part = -1, Filter filter = Filter::none, int order = 2,
                           int every = 1)
{
    Model<1> model               = test::unit_box<1>(16, Domain::point);
    model.method.scheme          = scheme;
    model.method.start           = start;
    model.method.strain_velocity = part;
    model.method.filter          = filter;
    model.method.filter_order    = order;
    model.method.filter_every    = every;
    model.conditions = {Condition<1>{.at = 0.0, .value = {}}, Condition<1>{.outer_is_above = true, .at = 1.0, .value = {}}};
    const Explicit<1> method(model);
    State<1> s = method.start(plant_all(model, test::block(model, 0.0, 1.0, 2)));
    LiteralBar bar{model.h[0], model.materials[0].mu, model.materials[0].lambda, model.materials[0].density, 16, {}, {}, {}, {},
                   {}};
    bar.filter = filter;
    bar.order  = order;
    for (int i = 0; i < s.particles.count; ++i) {
        s.particles.v[i][0] = 0.2 * std::sin(std::numbers::pi * s.particles.x[i][0]);
        bar.x.push_back(s.particles.x[i][0]);
        bar.v.push_back(s.particles.v[i][0]);
        bar.F.push_back(1);
        bar.sigma.push_back(0);
        bar.V0.push_back(s.particles.V0[i]);
    }
    // Steps of changing size: each kick is the mean of two of them.
    double dt_prev = 0, t = 0;
    for (int k = 0; k < 100; ++k) {
        const double dt = (k % 3 ? 0.3 : 0.2) * courant_time_step(model, s.particles);
        method.step(s, dt);
        bar.step(dt, k == 0 ? (start == Start::leapfrog ? 0 : dt) : dt_prev, scheme,
                 part < 0 ? (scheme == TimeScheme::usl ? 1.0 : 0.0) : part, filter != Filter::none && (k + 1) % every == 0);
        dt_prev = dt;
        t += dt;
    }
    for (int i = 0; i < s.particles.count; ++i) {
        const std::size_t q = static_cast<std::size_t>(s.particles.id[i]);
        EXPECT_NEAR(s.particles.x[i][0], bar.x[q], 1e-12);
        EXPECT_NEAR(s.particles.v[i][0], bar.v[q], 1e-11);
        EXPECT_NEAR(s.particles.sigma[i](0, 0), bar.sigma[q], 1e-7);
    }
    EXPECT_NEAR(s.t, t, 1e-12);
    EXPECT_NEAR(s.t_v, t - dt_prev / 2, 1e-12);
}

TEST(Step, SchemesEqualTheLiteralBar)
{
    for (TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl})
        for (Start start : {Start::leapfrog, Start::plain}) check_against_literal(scheme, start);
}

/// strain_velocity goes from musl to usl, whichever of them it is given beside.
TEST(Step, StrainVelocityEqualsTheLiteralBar)
{
    for (TimeScheme scheme : {TimeScheme::usl, TimeScheme::musl})
        for (const double part : {0.0, 0.3, 1.0}) check_against_literal(scheme, Start::leapfrog, part);
}

/// XPIC as the particles' (1 - S R)^m, FMPM as a sum over nodes, in each step or each third.
TEST(Step, FiltersEqualTheLiteralBar)
{
    for (const TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl})
        for (const Filter filter : {Filter::xpic, Filter::fmpm})
            for (const int order : {1, 2, 5})
                for (const int every : {1, 3}) {
                    SCOPED_TRACE(std::string(name_of(scheme)) + " " + std::string(name_of(filter)) + " " + std::to_string(order) +
                                 " " + std::to_string(every));
                    check_against_literal(scheme, Start::leapfrog, -1, filter, order, every);
                }
}

/// Of high order XPIC takes from the velocities of particles, orthogonally in their mass, just what nodes do not see (Hammerquist & Nairn 2017).
TEST(Step, XpicOfHighOrderRemovesTheNullSpace)
{
    for (const Domain domain : {Domain::point, Domain::box, Domain::parallelepiped}) {
        SCOPED_TRACE(name_of(domain));
        Model<1> model            = test::unit_box<1>(16, domain);
        model.method.filter       = Filter::xpic;
        model.method.filter_order = 100;
        const Explicit<1> method(model);
        State<1> s      = method.start(plant_all(model, test::block(model, 0.25, 0.75, 2)));
        Particles<1>& p = s.particles;
        test::Random random(3);
        for (int i = 0; i < p.count; ++i) p.v[i][0] = test::uniform(random, -1, 1);
        auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {
            double sum = 0.0;
            for (int i = 0; i < p.count; ++i) sum += p.m[i] * a[p.id[i]] * b[p.id[i]];
            return sum;
        };
        auto velocities = [&] {
            std::vector<double> r(p.count);
            for (int i = 0; i < p.count; ++i) r[p.id[i]] = p.v[i][0];
            return r;
        };
        auto filtered = [&] {
            method.step(s, 1e-9 * courant_time_step(model, p));  // so short that nothing moves
            return velocities();
        };
        const std::vector<double> v = velocities(), seen = filtered(), again = filtered();
        std::vector<double> rest(p.count);
        for (int i = 0; i < p.count; ++i) {
            rest[i] = v[i] - seen[i];
            EXPECT_NEAR(again[i], seen[i], 1e-8);
        }
        EXPECT_NEAR(product(rest, seen), 0.0, 1e-8 * product(v, v));
        EXPECT_GT(product(rest, rest), 0.2 * product(v, v));
        EXPECT_GT(product(seen, seen), 0.2 * product(v, v));
        // Nodes see nothing of the rest.
        for (int i = 0; i < p.count; ++i) p.v[i][0] = rest[p.id[i]];
        for (const double one : filtered()) EXPECT_NEAR(one, 0.0, 1e-8);
    }
}

/// Of the first order both are PIC: all velocities come from the nodes. Of high order XPIC leaves a field that nodes see as it is, and
/// every projection and domain takes both, also with corners that have velocities.
TEST(Step, FiltersGoFromPicToFlip)
{
    std::vector<MethodSpec> specs;
    for (const Preset& p : presets())
        if (MethodSpec s = p.spec; updates_stress_last(s)) {
            s.filter       = Filter::xpic;
            s.filter_order = 1;
            if (!broken_rule(s)) specs.push_back(s);
        }
    ASSERT_GT(specs.size(), 15u);
    test::for_each_spec(specs, [](const MethodSpec& spec) {
        SCOPED_TRACE(test::describe(spec));
        auto end_of = [&](Filter filter, double order, double pic) {
            Model<2> model            = test::unit_box<2>(8, spec);
            model.method.filter       = filter;
            model.method.filter_order = order;
            model.method.pic_fraction = pic;
            if (filter == Filter::none) model.method.filter_order = MethodSpec{}.filter_order;
            const Explicit<2> method(model);
            State<2> s = method.start(plant_all(model, test::block(model, 0.25, 0.75, 3)));
            for (int i = 0; i < s.particles.count; ++i)
                s.particles.v[i] = {0.1 * std::sin(5 * s.particles.x[i][1]), 0.1 * std::sin(7 * s.particles.x[i][0])};
            for (std::size_t c = 0; c < s.particles.corner_velocity.size(); ++c)
                s.particles.corner_velocity[c] = {0.1 * std::sin(5 * s.particles.corner[c][1]),
                                                  0.1 * std::sin(7 * s.particles.corner[c][0])};
            for (int k = 0; k < 3; ++k) method.step(s, 0.2 * courant_time_step(model, s.particles));
            std::vector<double> r;
            for (int i = 0; i < s.particles.count; ++i)
                for (int a = 0; a < 2; ++a) r.push_back(s.particles.v[i][a]);
            for (std::size_t c = 0; c < s.particles.corner_velocity.size(); ++c) r.push_back(s.particles.corner_velocity[c][0]);
            return r;
        };
        auto distance = [](const std::vector<double>& a, const std::vector<double>& b) {
            double r = 0.0;
            for (std::size_t k = 0; k < a.size(); ++k) r = std::max(r, std::fabs(a[k] - b[k]));
            return r;
        };
        const std::vector<double> pic = end_of(Filter::none, 2, 1.0), flip = end_of(Filter::none, 2, 0.0);
        EXPECT_LT(distance(end_of(Filter::xpic, 1, 0), pic), 1e-14);
        EXPECT_EQ(end_of(Filter::fmpm, 1, 0), pic);
        if (spec.mass == MassMatrix::consistent) return;
        for (const Filter filter : {Filter::xpic, Filter::fmpm}) {
            const std::vector<double> second = end_of(filter, 2, 0);
            EXPECT_GT(distance(second, pic), 1e-5);
            if (!fits_velocity(spec)) {
                EXPECT_LT(distance(second, flip), distance(pic, flip));
            }
        }
    });
}

/// Every projection and mass matrix takes it: 0 and 1 are musl and usl, with their bits, and 0.4 differs from both.
TEST(Step, StrainVelocityGoesFromMuslToUsl)
{
    std::vector<MethodSpec> specs;
    for (const Preset& p : presets())
        if (updates_stress_last(p.spec)) specs.push_back(p.spec);
    test::for_each_spec(specs, [](const MethodSpec& spec) {
        auto end_of = [&](TimeScheme scheme, double part) {
            Model<2> model               = test::unit_box<2>(8, spec);
            model.method.scheme          = scheme;
            model.method.strain_velocity = part;
            const Explicit<2> method(model);
            State<2> s = method.start(plant_all(model, test::block(model, 0.25, 0.75, 3)));
            for (int i = 0; i < s.particles.count; ++i)
                s.particles.v[i] = {0.1 * std::sin(5 * s.particles.x[i][1]), 0.1 * std::sin(7 * s.particles.x[i][0])};
            for (std::size_t c = 0; c < s.particles.corner_velocity.size(); ++c)
                s.particles.corner_velocity[c] = {0.1 * std::sin(5 * s.particles.corner[c][1]),
                                                  0.1 * std::sin(7 * s.particles.corner[c][0])};
            for (int k = 0; k < 4; ++k) method.step(s, 0.2 * courant_time_step(model, s.particles));
            std::vector<double> r;
            for (int i = 0; i < s.particles.count; ++i) r.push_back(s.particles.sigma[i](0, 1));
            return r;
        };
        const auto usl = end_of(TimeScheme::usl, -1), musl = end_of(TimeScheme::musl, -1);
        EXPECT_EQ(end_of(TimeScheme::musl, 1), usl);
        EXPECT_EQ(end_of(TimeScheme::usl, 0), musl);
        const auto between = end_of(TimeScheme::usl, 0.4);
        EXPECT_EQ(end_of(TimeScheme::musl, 0.4), between);
        if (usl == musl) return;
        EXPECT_NE(between, usl);
        EXPECT_NE(between, musl);
    });
}

/// Free fall: v = g (t - dt/2), x = g t^2/2 exactly, for leapfrog is exact for constant acceleration.
TEST(Step, FreeFallIsExact)
{
    std::vector<MethodSpec> specs = test::all_shapes();
    for (const char* name : {"bscpls", "cpls", "ugimp"})  // corners with velocities, with gradients, and none
        for (const double part : {0.0, 0.3, 1.0})
            for (const Filter filter : {Filter::none, Filter::xpic, Filter::fmpm}) {
                specs.push_back(find_preset(name)->spec);
                specs.back().strain_velocity = part;
                specs.back().filter          = filter;
            }
    test::for_each_spec(specs, [](const MethodSpec& spec) {
        SCOPED_TRACE(test::describe(spec));
        Model<2> model = test::unit_box<2>(20, spec);
        model.gravity  = {0.1, -2.0};
        const Explicit<2> method(model);
        State<2> s      = method.start(test::plant_halves(model, test::block(model, 0.5, 0.7, 2)));
        const double dt = 0.01;
        for (int k = 0; k < 30; ++k) method.step(s, dt);
        for (int i = 0; i < s.particles.count; ++i) {
            EXPECT_NEAR(s.particles.v[i][1], -2.0 * 29.5 * dt, 1e-12);
            EXPECT_NEAR(s.particles.x[i][1] - s.particles.X[i][1], -0.5 * 2.0 * 0.3 * 0.3, 1e-12);
            EXPECT_NEAR(s.particles.F[i](0, 1), 0, 1e-12);
        }
    });
}

/// A body force given by a field acts as gravity does, and may vary in time.
TEST(Step, BodyForceField)
{
    Model<2> model       = test::unit_box<2>(20, Domain::parallelepiped);
    model.body_forces[0] = {Field(0.0),
                            Field(std::function<double(const FieldPoint&)>([](const FieldPoint& at) { return 6 * at.t; }))};
    const Explicit<2> method(model);
    State<2> s      = method.start(plant_all(model, test::block(model, 0.3, 0.5, 2)));
    const double dt = 0.01;
    double v = 0, x = 0;
    for (int k = 0; k < 20; ++k) {
        v += (k == 0 ? dt / 2 : dt) * 6 * (k * dt);
        x += dt * v;
        method.step(s, dt);
    }
    for (int i = 0; i < s.particles.count; ++i) {
        EXPECT_NEAR(s.particles.v[i][1], v, 1e-12);
        EXPECT_NEAR(s.particles.x[i][1] - s.particles.X[i][1], x, 1e-12);
        EXPECT_NEAR(s.particles.v[i][0], 0, 1e-12);
    }
}

/// A body that leaves through one side of a periodic box comes back at the other: the same as one that never crosses.
template <int D>
void check_periodic(const MethodSpec& spec)
{
    auto run = [&](double shift) {
        Model<D> model = test::unit_box<D>(12, spec);
        model.periodic = Vec<D, bool>::filled(true);
        const Explicit<D> method(model);
        auto seeds = test::block(model, 0.25, 0.5, 2);
        for (auto& seed : seeds)
            for (int a = 0; a < D; ++a) seed.x[a] += shift - (seed.x[a] + shift >= 1 ? 1 : 0);
        State<D> s = method.start(test::plant_halves(model, seeds));
        for (int i = 0; i < s.particles.count; ++i) {
            Vec<D> X{};
            for (int a = 0; a < D; ++a) X[a] = s.particles.x[i][a] - shift;
            for (int a = 0; a < D; ++a)
                s.particles.v[i][a] = 0.7 + 0.2 * std::sin(2 * std::numbers::pi * (X[a] + X[(a + 1) % D]));
        }
        const double dt = 0.2 * courant_time_step(model, s.particles);
        for (int k = 0; k < 40; ++k) method.step(s, dt);
        return s;
    };
    // A whole number of cells. Cells of a mesh are cut by the seam: only enriched corners feel that, and start beside it.
    const State<D> inside = run(0.0), across = run((has_enrichment(spec) ? 6.0 : 7.0) / 12);
    std::vector<int> where(inside.particles.x.size());
    for (int i = 0; i < across.particles.count; ++i) where[across.particles.id[i]] = i;
    double crossed = 0;
    for (int i = 0; i < inside.particles.count; ++i) {
        const int j = where[inside.particles.id[i]];
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(inside.particles.v[i][a], across.particles.v[j][a], 1e-10);
            EXPECT_NEAR(inside.particles.F[i](a, a), across.particles.F[j](a, a), 1e-10);
            crossed = std::max(crossed, across.particles.X[j][a] - across.particles.x[j][a]);
        }
    }
    EXPECT_GT(crossed, 0.3);  // some did cross
}
TEST(Step, PeriodicAxesHaveNoSeam)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_periodic<1>(spec);
        check_periodic<2>(spec);
    });
    check_periodic<3>(test::shape_spec(Basis::hat, Domain::parallelepiped));
}

/// A domain that reaches over the seam while no particle is there, on grids whose blocks end at other places.
template <int D>
void check_reaching_over_the_seam(const MethodSpec& spec)
{
    for (int cells = 8; cells < 16; ++cells)
        for (double direction : {-1.0, 1.0}) {
            Model<D> model = test::unit_box<D>(cells, spec);
            model.periodic = Vec<D, bool>::filled(true);
            const double h = model.h[0], low = direction < 0 ? 0.25 * h : 1 - 2.25 * h;
            const Explicit<D> method(model);
            State<D> s = method.start(test::plant_halves(model, test::block(model, low, low + 2 * h, 1)));
            std::vector<Vec<D>> corners(s.particles.corner.begin(), s.particles.corner.end());
            for (int i = 0; i < s.particles.count; ++i) s.particles.v[i] = Vec<D>::filled(direction);
            for (int k = 0; k < 10; ++k) method.step(s, 0.05 * h);
            for (int i = 0; i < s.particles.count; ++i)
                for (int a = 0; a < D; ++a) {
                    EXPECT_NEAR(displacement(model, s.particles, i)[a], direction * 0.5 * h, 1e-13);
                    EXPECT_NEAR(s.particles.F[i](a, a), 1, 1e-12);
                }
            for (std::size_t c = 0; c < corners.size(); ++c)
                for (int a = 0; a < D; ++a) EXPECT_NEAR(s.particles.corner[c][a], corners[c][a] + direction * 0.5 * h, 1e-13);
        }
}
TEST(Step, DomainsReachOverTheSeam)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_reaching_over_the_seam<1>(spec);
        check_reaching_over_the_seam<2>(spec);
    });
}

/// A wall that moves at constant speed drags the bar's end along: the node there has the wall's velocity.
TEST(Step, PrescribedVelocityPullsABar)
{
    for (TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl}) {
        Model<1> model      = test::unit_box<1>(20, Domain::parallelepiped);
        model.method.scheme = scheme;
        Condition<1> pull{.at = 0.25, .type = ConditionType::velocity, .value = {Field(-0.05)}};
        Condition<1> hold{.outer_is_above = true, .at = 0.75, .value = {}};
        model.conditions = {pull, hold};
        const Explicit<1> method(model);
        State<1> s      = method.start(plant_all(model, test::block(model, 0.25, 0.75, 2)));
        const double dt = 0.2 * courant_time_step(model, s.particles);
        while (s.t < 1.0) method.step(s, dt);
        // After the waves have run to and fro the mean stretch is that of the pulled end.
        double mean = 0, left = 1;
        for (int i = 0; i < s.particles.count; ++i) {
            mean += s.particles.F[i](0, 0) / s.particles.count;
            left = std::min(left, s.particles.x[i][0]);
        }
        EXPECT_NEAR(mean, 1 + 0.05 * s.t / 0.5, 0.02) << name_of(scheme);
        EXPECT_NEAR(left, 0.2625 - 0.05 * s.t, 0.01);
    }
}

/// A domain that grows while its particle rests is measured all the same.
TEST(Step, ReachFollowsDomainsOfRestingParticles)
{
    Model<2> model = test::unit_box<2>(20, Domain::parallelepiped);
    // Everything moves with v = 3 (x - 1/2): the one particle in the middle stays where it is and is stretched.
    const Field stretch(std::function<double(const FieldPoint&)>([](const FieldPoint& at) { return 3 * (at.x[0] - 0.5); }));
    model.conditions = {
        Condition<2>{.outer_is_above = true, .at = 0.0, .type = ConditionType::velocity, .value = {stretch, Field(0.0)}}};
    const Explicit<2> method(model);
    State<2> s = method.start(plant_all(model, std::vector{Seed<2>{{0.5, 0.5}, 1e-4, Mat<2>{{{0.0125, 0}, {0, 0.0125}}}}}));
    for (int k = 0; k < 50; ++k) method.step(s, 0.02);
    EXPECT_EQ(s.particles.x[0][0], 0.5);
    EXPECT_NEAR(s.reach, s.particles.edges[0](0, 0) / model.h[0], 1e-12);
    EXPECT_GT(s.reach, 4);
    EXPECT_LE(s.reach, s.field.tiles.halo() + 1);
}

TEST(Step, DomainsTooWideFromTheStartAreRefused)
{
    for (Domain d : {Domain::box, Domain::parallelepiped}) {
        const Model<2> model = test::unit_box<2>(80, d);
        const Explicit<2> method(model);
        EXPECT_THROW(static_cast<void>(
                         method.start(plant_all(model, std::vector{Seed<2>{{0.5, 0.5}, 1.0, Mat<2>{{{0.49, 0}, {0, 0.49}}}}}))),
                     InputError);
    }
}

TEST(Step, FailuresNameStepTimeAndParticle)
{
    Model<2> model = test::unit_box<2>(10, Domain::point);
    const Explicit<2> method(model);
    State<2> s = method.start(plant_all(model, test::block(model, 0.6, 0.9, 2)));
    for (int i = 0; i < s.particles.count; ++i) s.particles.v[i] = {1.0, 0.0};
    try {
        for (int k = 0; k < 100; ++k) method.step(s, 0.01);
        FAIL() << "the body flew through the wall";
    } catch (const NumericalError& e) {
        const std::string message = e.what();
        for (const char* part : {"step ", "t = ", "particle ", "left the grid", "[[boundary]]"})
            EXPECT_NE(message.find(part), std::string::npos) << message;
    }
}

/// A cell that folds ends the run, and the message says so.
TEST(Step, FoldedCellsAreNamed)
{
    for (Domain domain : {Domain::cell, Domain::simplex}) {
        const Model<2> model = test::unit_box<2>(10, domain);
        const Explicit<2> method(model);
        State<2> s = method.start(plant_all(model, test::block(model, 0.4, 0.6, 2)));
        s.particles.corner[s.particles.cell[3][0]] += Vec<2>{0.06, 0.06};
        try {
            method.step(s, 1e-4);
            FAIL() << "a folded cell went on";
        } catch (const NumericalError& e) {
            for (const char* part : {"step 1", "particle ", "turned over or folded"})
                EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
        }
        auto folded = plant_all(model, test::block(model, 0.4, 0.6, 2));
        folded.corner[folded.cell[3][0]] += Vec<2>{0.06, 0.06};
        EXPECT_THROW(static_cast<void>(method.start(std::move(folded))), InputError);
    }
}

/// Cells that have grown wider than the passes hold end the run; from the start they are refused.
TEST(Step, CellsTooWideAreNamed)
{
    const Model<1> model = test::unit_box<1>(100, Domain::cell);
    const Explicit<1> method(model);
    State<1> s = method.start(plant_all(model, std::vector{Seed<1>{{0.5}, 0.58, Mat<1>{{{0.29}}}}}));
    s.particles.corner[0][0] -= 0.2;
    s.particles.corner[1][0] += 0.2;
    test::follow(model, s);
    try {
        method.step(s, 1e-4);
        FAIL() << "a cell of 98 grid cells went on";
    } catch (const NumericalError& e) {
        EXPECT_NE(std::string(e.what()).find("wider than the grid pass can hold"), std::string::npos) << e.what();
    }
    EXPECT_THROW(static_cast<void>(method.start(plant_all(model, std::vector{Seed<1>{{0.5}, 0.8, Mat<1>{{{0.4}}}}}))),
                 InputError);
}

/// Stretched without end, limited parallelepipeds stay within the limit, where others end the run.
TEST(Step, StretchLimitHolds)
{
    for (double limit : {0.0, 2.0, 30.0}) {
        Model<1> model             = test::unit_box<1>(100, Domain::parallelepiped);
        model.method.stretch_limit = limit;
        const Explicit<1> method(model);
        State<1> s             = method.start(plant_all(model, std::vector{Seed<1>{{0.5}, 0.02, Mat<1>{{{0.01}}}}}));
        s.particles.F[0](0, 0) = 40;
        const auto step        = [&] { method.step(s, 1e-9); };
        if (limit > 0) {
            EXPECT_NO_THROW(step());
            EXPECT_NEAR(s.reach, limit, 1e-12);
        } else {
            EXPECT_THROW(step(), NumericalError);
        }
    }
}

/// Particles of cells start where they are drawn: nothing has moved, also where the mean of the corners is not the centroid.
TEST(Step, CellsStartWithoutDisplacement)
{
    for (CornerWeights weights : {CornerWeights::exact, CornerWeights::mean}) {
        const Model<2> model = test::unit_box<2>(10, test::shape_spec(Basis::hat, Domain::cell, weights));
        Particles<2> p       = plant_all(model, test::block(model, 0.4, 0.6, 1));
        for (Vec<2>& c : p.corner) c[0] += 0.3 * c[0] * c[1];
        for (int i = 0; i < p.count; ++i) {
            Vec<2> x[4];
            get_corners(p.cell[i], p.corner.data(), x);
            p.x[i] = centroid<2>(exact_weights<2>(x, false), x);
        }
        const State<2> s = Explicit<2>(model).start(std::move(p));
        for (int i = 0; i < s.particles.count; ++i) EXPECT_LT(norm(displacement(model, s.particles, i)), 1e-15);
    }
}

/// h over wave speed and |v|, of the particle and the axis for which it is shortest. A `cfl` is a part of it, up to the limit of
/// the method.
TEST(Step, TimeStepIsThatOfTheFastestParticle)
{
    Model<2> model = test::unit_box<2>(10, Domain::point);
    model.h[1]     = 0.05;
    model.cells[1] = 20;
    model.materials.push_back({find_law("neo-hookean"), 1000.0, 1154.0, 770.0});
    Particles<2> p = plant_all(model, test::block(model, 0.25, 0.75, 2));
    double rate    = 0;
    for (int i = 0; i < p.count; ++i) {
        p.material[i]     = i % 2;
        p.v[i]            = {0.3 * (i % 7), -0.4 * (i % 7)};
        const Material& m = model.materials[p.material[i]];
        rate              = std::max(rate, (std::sqrt((m.lambda + 2 * m.mu) / m.density) + 0.5 * (i % 7)) / 0.05);
    }
    const double limit = stable_courant_number(model.method, 2);
    EXPECT_NEAR(courant_time_step(model, p) * rate, 1.0, 1e-14);
    EXPECT_NEAR(stable_time_step(model, p) * rate, limit, 1e-14);
    EXPECT_NEAR(automatic_time_step(model, p, 0.4) * rate, 0.4, 1e-14);
    EXPECT_NEAR(automatic_time_step(model, p, 0.9) * rate, limit, 1e-14);
}

/// With the consistent mass the limit falls where domains that follow F grow; two a cell at rest have that of the method.
TEST(Step, LimitOfConsistentMassFallsWithDomains)
{
    auto limits = [](Domain domain, double stretch) {
        Model<2> model    = test::unit_box<2>(20, domain);
        model.method.mass = MassMatrix::consistent;
        Particles<2> p    = plant_all(model, test::block(model, 0.25, 0.75, 2));
        for (int i = 0; i < p.count; ++i) p.F[i] = Mat<2>::identity();
        p.F[7](1, 1)      = stretch;
        const double rest = courant_time_step(model, p) / courant_scale(model.method, 2);
        return std::array{stable_time_step(model, p) / rest * std::sqrt(2.0),
                          automatic_time_step(model, p, 1.0) / rest * std::sqrt(2.0)};
    };
    for (const Domain domain : {Domain::parallelepiped, Domain::stretched_box}) {
        EXPECT_NEAR(limits(domain, 1.0)[0], 0.5, 1e-14);
        for (const double limit : limits(domain, 1.5)) EXPECT_NEAR(limit, stable_number_of_domains(0.75), 1e-14);
    }
    for (const Domain domain : {Domain::point, Domain::box}) EXPECT_NEAR(limits(domain, 1.5)[0], 0.5, 1e-14);
    // Lengths are those along each axis: three particles a cell along x, two along y of cells half as long.
    for (const Domain domain : {Domain::parallelepiped, Domain::cell, Domain::stretched_box}) {
        Model<2> model    = test::unit_box<2>(20, domain);
        model.method.mass = MassMatrix::consistent;
        model.h[1] *= 0.5;
        model.cells[1] *= 2;
        const Particles<2> p = plant_all(model, fill(Ball<2>{{0.5, 0.5}, 0.25}, SubCells<2>{{}, model.h, {3, 2}}));
        const double rest    = courant_time_step(model, p) / courant_scale(model.method, 2);
        EXPECT_NEAR(stable_time_step(model, p) / rest * std::sqrt(2.0), 0.5, 1e-12);
    }
    MethodSpec lumped;
    lumped.domain = Domain::parallelepiped;
    EXPECT_FALSE(has_limit_of_strain(lumped));
}

/// Mass, momentum and energies against plain sums, of particles that do not fill the last batch and have two laws.
TEST(Step, TotalsAreSumsOverParticles)
{
    Model<2> model = test::unit_box<2>(10, Domain::point);
    model.gravity  = {0.3, -9.8};
    model.materials.push_back({find_law("jaumann-elastic"), 1000.0, 577.0, 385.0});
    test::Random random(8);
    State<2> s      = test::random_state(Explicit<2>(model), 21, random);
    Particles<2>& p = s.particles;
    const NeoHookean neo_hookean{577.0, 385.0};
    const JaumannElastic jaumann{577.0, 385.0};
    const double none[1]{};  // history
    Totals sums;
    for (int i = 0; i < p.count; ++i) {
        p.material[i] = i > 9;
        sums.mass += p.m[i];
        sums.momentum += p.m[i] * padded(p.v[i]);
        sums.kinetic_energy += 0.5 * p.m[i] * dot(p.v[i], p.v[i]);
        sums.potential -= p.m[i] * dot(model.gravity, p.x[i]);
        sums.strain_energy +=
            p.material[i] == 0 ? p.V0[i] * neo_hookean.energy(p.F[i]) : p.V[i] * jaumann.energy(p.sigma[i], none);
    }
    const Totals found = totals(model, s);
    EXPECT_NEAR(found.mass / sums.mass, 1, 1e-14);
    EXPECT_LT(norm(found.momentum - sums.momentum), 1e-14 * sums.mass);
    EXPECT_NEAR(found.kinetic_energy / sums.kinetic_energy, 1, 1e-13);
    EXPECT_NEAR(found.strain_energy / sums.strain_energy, 1, 1e-13);
    EXPECT_NEAR(found.potential / sums.potential, 1, 1e-13);
}

/// Sorting is rare, and does not change the physics: a state sorted each step gives the same to round-off.
TEST(Step, SortingDoesNotChangeTheRun)
{
    auto run = [](bool sort_always) {
        Model<2> model = test::unit_box<2>(16, Domain::parallelepiped);
        const Explicit<2> method(model);
        State<2> s = method.start(plant_all(model, test::block(model, 0.25, 0.5, 2)));
        for (int i = 0; i < s.particles.count; ++i) s.particles.v[i] = {0.4 + 0.1 * std::sin(9 * s.particles.x[i][1]), 0.3};
        for (int k = 0; k < 60; ++k) {
            if (sort_always) sort_particles(model, s);
            method.step(s, 0.01);
        }
        std::vector<Vec<2>> x(s.particles.x.size());
        for (int i = 0; i < s.particles.count; ++i) x[s.particles.id[i]] = s.particles.x[i];
        return x;
    };
    const auto rarely = run(false), always = run(true);
    for (std::size_t i = 0; i < rarely.size(); ++i)
        for (int a = 0; a < 2; ++a) EXPECT_NEAR(rarely[i][a], always[i][a], 1e-12);
}

/// What is kept for nodes that no particle may write to holds nothing of meaning: whatever is there, a run is the same. The body
/// crosses blocks of nodes and sorts, up and down.
template <int D>
std::vector<Vec<D>> run_across_blocks(const MethodSpec& spec, double speed, bool is_poisoned)
{
    Model<D> model = test::unit_box<D>(D == 1 ? 60 : 40, spec);
    const Explicit<D> method(model);
    State<D> s      = method.start(test::plant_halves(model, test::block(model, 0.4, 0.5, 3)));
    const double dt = 0.1 * courant_time_step(model, s.particles);
    for (int i = 0; i < s.particles.count; ++i) s.particles.v[i] = Vec<D>::filled(speed * model.h[0] / dt);
    auto poison = [&](Array<Lanes>& records) {
        const std::size_t size = s.field.nodes.empty() ? 0 : records.size() / s.field.nodes.size();
        for (std::size_t n = 0; n < s.lattice.node_count() && size > 0; ++n)
            if (!s.field.tiles.is_active(s.lattice.index(static_cast<std::ptrdiff_t>(n))))
                std::fill_n(&records[n * size], size, Lanes(std::numeric_limits<double>::quiet_NaN()));
    };
    for (int k = 0; k < 80; ++k) {
        if (is_poisoned)
            for (Array<Lanes>* records : {&s.field.nodes, &s.field.strain_nodes, &s.field.known, &s.velocity_records,
                                          &s.cell_records, &s.cell_contents, &s.gradients, &s.particle_nodes})
                poison(*records);
        method.step(s, dt);
    }
    std::vector<Vec<D>> found;
    for (int i = 0; i < s.particles.count; ++i) {
        found.push_back(s.particles.x[i]);
        found.push_back(s.particles.v[i]);
    }
    return found;
}
template <int D>
void check_inactive_nodes()
{
    for (const Preset& preset : presets())
        for (const double speed : {0.07, -0.07}) {       // cells a step
            if (needs_full_grid(preset.spec)) continue;  // whose bodies fill the grid
            SCOPED_TRACE(preset.name);
            std::vector<Vec<D>> clean, poisoned;
            try {
                clean = run_across_blocks<D>(preset.spec, speed, false);
            } catch (const NumericalError&) {
                continue;  // Taylor least squares break down with particles across the edges of cells
            }
            ASSERT_NO_THROW(poisoned = run_across_blocks<D>(preset.spec, speed, true));
            ASSERT_EQ(std::memcmp(clean.data(), poisoned.data(), clean.size() * sizeof(clean[0])), 0);
        }
}
TEST(Step, InactiveNodesHoldNothingOfMeaning)
{
    check_inactive_nodes<1>();
    check_inactive_nodes<2>();
}

/// Stress and history of every particle after a step, branches included, are those of its material along its own F. Two of three
/// materials have branches, in different numbers, and one law has a column `dissipated` of its own.
template <int D>
void check_materials(Averaging averaging)
{
    MethodSpec spec = test::shape_spec(Basis::hat, Domain::box);
    spec.averaging  = averaging;
    Model<D> model  = test::unit_box<D>(8, spec);
    auto branched   = [](std::string_view law, std::vector<std::string> more) {
        std::vector<std::string> settings = test::sample_settings(law);
        settings.insert(settings.end(), more.begin(), more.end());
        return test::material_of(std::string(law), settings, D);
    };
    model.materials = {branched("neo-hookean", {"branch_shear=[300]", "branch_time=[0.4]"}), branched("j2", {}),
                       branched("j2", {"branch_shear=[100, 50]", "branch_time=[0.1, 0.01]"})};
    const Explicit<D> method(std::move(model));
    Particles<D> planted = plant_all(method.model(), test::block(method.model(), 0.25, 0.75, 2));
    for (int i = 0; i < planted.count; ++i) planted.material[i] = i / 5 % 3;
    State<D> s = method.start(std::move(planted));
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a) s.particles.v[i][a] = 0.3 * std::sin(5 * s.particles.x[i][a] + 3 * s.particles.x[i][0]);
    struct Before {
        Mat<D> F;
        Stress<D> sigma;
        std::vector<double> history;
    };
    double worst = 0;
    for (int k = 0; k < 5; ++k) {
        std::vector<Before> before(s.particles.x.size());
        auto history = [&](int i) {
            std::vector<double> r;
            for (const HistoryColumn& c : history_of(method.model().materials[s.particles.material[i]], D))
                r.push_back(s.particles.history[s.particles.history_column(c.name)][i]);
            return r;
        };
        for (int i = 0; i < s.particles.count; ++i)
            before[s.particles.id[i]] = {s.particles.F[i], s.particles.sigma[i], history(i)};
        const double dt = 0.01;
        method.step(s, dt);
        for (int i = 0; i < s.particles.count; ++i) {
            Before& b           = before[s.particles.id[i]];
            const Mat<D>& F     = s.particles.F[i];
            double fault        = 0;
            const Stress<D> own = update_stress(method.model().materials[s.particles.material[i]],
                                                Step<D>{F, (F - b.F) * inverse(b.F), dt}, b.sigma, b.history.data(), fault);
            for (int c = 0; c < own.size; ++c) worst = std::max(worst, std::fabs(own.c[c] - s.particles.sigma[i].c[c]));
            const std::vector<double> after = history(i);
            for (std::size_t c = 0; c < after.size(); ++c) EXPECT_NEAR(after[c], b.history[c], 1e-11);
        }
    }
    EXPECT_LT(worst, 1e-9);
    const Totals e = totals(method.model(), s);
    EXPECT_GT(e.dissipated, 0);
}
TEST(Step, StressIsThatOfTheMaterial)
{
    for (const Averaging averaging : {Averaging::none, Averaging::cell}) {
        check_materials<2>(averaging);
        check_materials<3>(averaging);
    }
}

}  // namespace
}  // namespace ordo
