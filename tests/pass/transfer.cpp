// Scatter and gather passes of every domain against naive loops, conservation, threads.
#include "kernels/gather.hpp"
#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "method/layout.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace ordo {
namespace {

using test::Random;

/// f(node, w, dw) for particle i of any domain: the weights' definition.
template <int D, class F>
void visit(Domain domain, const Lattice<D>& g, const ParticleView<D>& p, int i, F&& f)
{
    switch (domain) {
    case Domain::point: Point<D, Hat>::for_each_node(g, p, i, f); break;
    case Domain::box:
    case Domain::stretched_box: Box<D>::for_each_node(g, p, i, f); break;
    case Domain::parallelepiped: Parallelepiped<D, Hat>::for_each_node(g, p, i, f); break;
    }
}

template <int D>
struct Fixture {
    Random random{42};
    Explicit<D> method;
    State<D> s;
    Passes<D> passes;

    explicit Fixture(Domain domain, double deformation = 0.3)
        : method(test::unit_box<D>(D == 3 ? 12 : 20, domain)),
          s(test::random_state(method, 400, random, deformation)),
          passes(choose_passes<D>(method.model().method, false))
    {
        sort_particles(method.model(), s);
    }
    Sweep<D> sweep(double dt = 0)
    {
        return {s.lattice, s.particles.view(), s.nodes.data(), method.model().materials.data(), dt, 0.0};
    }
    void scatter_all(typename Passes<D>::Scatter pass)
    {
        clear(s.nodes.data(), s.tiles);
        const Sweep<D> view = sweep();
        s.tiles.for_each_by_colour([&](const Tile& t) { pass(view, t.begin, t.end); });
    }
};

template <int D>
void check_scatter(Domain domain, double deformation)
{
    Fixture<D> f(domain, deformation);
    f.scatter_all(f.passes.project_and_force);
    const ParticleView<D> p = f.s.particles.view();
    Array<Lanes> naive(f.s.lattice.node_count());
    for (int i = 0; i < p.count; ++i)
        visit<D>(domain, f.s.lattice, p, i, [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
            const Vec<D> force = -p.V[i] * (p.sigma[i] * dw);
            naive[node][NodeLane::mass] += w * p.m[i];
            for (int a = 0; a < D; ++a) {
                naive[node][NodeLane::velocity + a] += w * p.m[i] * p.v[i][a];
                naive[node][NodeLane::increment + a] += force[a];
            }
        });
    double mass = 0, expected_mass = 0;
    for (std::size_t n = 0; n < naive.size(); ++n) {
        for (int k = 0; k < NodeLane::end; ++k) ASSERT_NEAR(f.s.nodes[n][k], naive[n][k], 1e-10) << "lane " << k;
        mass += f.s.nodes[n][NodeLane::mass];
    }
    for (int i = 0; i < p.count; ++i) expected_mass += p.m[i];
    EXPECT_NEAR(mass, expected_mass, 1e-12 * expected_mass);
}

TEST(Scatter, EqualsTheNaiveLoop)
{
    for (Domain d : test::kDomains) {
        check_scatter<1>(d, 0.3);
        check_scatter<2>(d, 0.3);
        check_scatter<3>(d, 0.3);
    }
}

/// Domains several cells wide get wider tiles, and the sums stay right.
TEST(Scatter, WideDomains)
{
    for (Domain d : {Domain::stretched_box, Domain::parallelepiped}) {
        Fixture<2> f(d, 0.3);
        for (int i = 0; i < f.s.particles.count; i += 50) {
            if (d == Domain::parallelepiped)
                f.s.particles.edges[i] *= 9.0;
            else
                f.s.particles.half[i] *= 9.0;
        }
        f.s.reach = 0;
        for (int i = 0; i < f.s.particles.count; ++i)
            f.s.reach = std::max(f.s.reach, reach_of<2>(f.method.model().method, f.s.lattice, f.s.particles.view(), i).cells);
        ASSERT_GT(f.s.reach, 2.0);
        EXPECT_FALSE(is_sorted_enough(f.s));
        sort_particles(f.method.model(), f.s);
        EXPECT_GE(f.s.tiles.halo(), f.s.reach);
        f.scatter_all(f.passes.project);
        const ParticleView<2> p = f.s.particles.view();
        Array<Lanes> naive(f.s.lattice.node_count());
        for (int i = 0; i < p.count; ++i)
            visit<2>(d, f.s.lattice, p, i,
                     [&](std::ptrdiff_t node, double w, const Vec<2>&) { naive[node][NodeLane::mass] += w * p.m[i]; });
        for (std::size_t n = 0; n < naive.size(); ++n) ASSERT_NEAR(f.s.nodes[n][NodeLane::mass], naive[n][NodeLane::mass], 1e-12);
    }
}

TEST(Scatter, SeparatePassesEqualTheFusedOne)
{
    for (Domain d : test::kDomains) {
        Fixture<2> f(d);
        f.scatter_all(f.passes.project_and_force);
        std::vector<Lanes> fused(f.s.nodes.begin(), f.s.nodes.end());
        f.scatter_all(f.passes.project);
        const Sweep<2> view = f.sweep();
        f.s.tiles.for_each_by_colour([&](const Tile& t) { f.passes.force(view, t.begin, t.end); });
        for (std::size_t n = 0; n < fused.size(); ++n)
            for (int k = 0; k < NodeLane::end; ++k) ASSERT_NEAR(f.s.nodes[n][k], fused[n][k], 1e-11);
    }
}

TEST(Scatter, ForcesSumToZero)
{
    for (Domain d : test::kDomains) {
        Fixture<3> f(d);
        f.scatter_all(f.passes.force);
        Vec<3> sum{};
        double size = 0;
        for (const Lanes& n : f.s.nodes)
            for (int a = 0; a < 3; ++a) {
                sum[a] += n[NodeLane::increment + a];
                size += std::fabs(n[NodeLane::increment + a]);
            }
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(sum[a], 0, 1e-13 * size);
    }
}

template <int D>
void check_gather(Domain domain)
{
    Fixture<D> f(domain);
    for (Lanes& n : f.s.nodes)
        for (int k = 0; k < NodeLane::end; ++k) n[k] = test::uniform(f.random, -1, 1);
    const double dt         = 0.003;
    const ParticleView<D> p = f.s.particles.view();
    std::vector<Vec<D>> x, v;
    std::vector<Mat<D>> F;
    for (int i = 0; i < p.count; ++i) {
        Vec<D> xi = p.x[i], vi = p.v[i];
        Mat<D> L{};
        visit<D>(domain, f.s.lattice, p, i, [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
            Vec<D> nv{}, ndv{};
            for (int a = 0; a < D; ++a) {
                nv[a]  = f.s.nodes[node][NodeLane::velocity + a];
                ndv[a] = f.s.nodes[node][NodeLane::increment + a];
            }
            xi += dt * w * nv;
            vi += w * ndv;
            L += outer(nv, dw);
        });
        x.push_back(xi);
        v.push_back(vi);
        F.push_back((Mat<D>::identity() + dt * L) * p.F[i]);
    }
    const Sweep<D> view = f.sweep(dt);
    std::vector<TileReport> reports(f.s.tiles.tiles().size());
    f.s.tiles.for_each([&](std::ptrdiff_t k, const Tile& t) { f.passes.update_all(view, t.begin, t.end, reports[k]); });
    const NeoHookean law{f.method.model().materials[0].lambda, f.method.model().materials[0].mu};
    for (int i = 0; i < p.count; ++i) {
        EXPECT_NEAR(p.V[i], det(F[i]) * p.V0[i], 1e-12);
        const Mat<D> sigma = law.cauchy(F[i]);
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(p.x[i][a], x[i][a], 1e-14);
            EXPECT_NEAR(p.v[i][a], v[i][a], 1e-13);
            for (int b = 0; b < D; ++b) {
                EXPECT_NEAR(p.F[i](a, b), F[i](a, b), 1e-12);
                EXPECT_NEAR(p.sigma[i](a, b), sigma(a, b), 1e-8);
                if (p.edges) {
                    EXPECT_NEAR(p.edges[i](a, b), (F[i] * p.edges0[i])(a, b), 1e-13);
                }
            }
            if (domain == Domain::stretched_box) {
                EXPECT_NEAR(p.half[i][a], F[i](a, a) * p.half0[i][a], 1e-14);
            }
        }
    }
}

TEST(Gather, EqualsTheNaiveLoop)
{
    for (Domain d : test::kDomains) {
        check_gather<1>(d);
        check_gather<2>(d);
        check_gather<3>(d);
    }
}

TEST(Gather, PicFractionBlends)
{
    Fixture<2> f(Domain::point);
    for (Lanes& n : f.s.nodes) n = make_lanes(2, 3, 0, 1, 0.5, -0.5, 0, 0);
    const ParticleView<2> p = f.s.particles.view();
    std::vector<Vec<2>> before(p.v, p.v + p.count);
    Sweep<2> view = f.sweep(0);
    view.pic      = 0.25;
    TileReport report;
    f.passes.update_velocity(view, 0, p.count, report);
    for (int i = 0; i < p.count; ++i) {
        EXPECT_NEAR(p.v[i][0], 0.75 * (before[i][0] + 0.5) + 0.25 * 2, 1e-14);
        EXPECT_NEAR(p.v[i][1], 0.75 * (before[i][1] - 0.5) + 0.25 * 3, 1e-14);
    }
}

/// Each fault is found, at the first particle that has it.
TEST(Gather, FaultsAreReported)
{
    auto report_of = [](auto&& spoil) {
        Fixture<2> f(Domain::parallelepiped, 0.0);
        for (Lanes& n : f.s.nodes) n = Lanes{};
        spoil(f);
        TileReport report;
        f.passes.update_all(f.sweep(1.0), 0, f.s.particles.count, report);
        return std::pair{report.fault, report.particle};
    };
    EXPECT_EQ(report_of([](auto&) {}).first, Fault::none);
    EXPECT_EQ(report_of([](auto& f) { f.s.particles.F[17] = Mat<2>{{{-1, 0}, {0, 1}}}; }), (std::pair{Fault::inverted, 17}));
    EXPECT_EQ(report_of([](auto& f) {
                  f.s.particles.F[5](0, 1) = std::nan("");
                  f.s.particles.F[5](1, 0) = 1;
              }),
              (std::pair{Fault::not_finite, 5}));
    EXPECT_EQ(report_of([](auto& f) {
                  for (Lanes& n : f.s.nodes) n = make_lanes(10, 0, 0, 1, 0, 0, 0, 0);
              }),
              (std::pair{Fault::left_grid, 0}));
    EXPECT_EQ(report_of([](auto& f) { f.s.particles.v[8][1] = std::nan(""); }), (std::pair{Fault::not_finite, 8}));
    EXPECT_EQ(report_of([](auto& f) { f.s.particles.edges0[3] *= 1e4; }), (std::pair{Fault::domain_too_wide, 3}));
}

/// A box stretched by F_aa <= 0 has turned over: no length, no weights that mean anything.
TEST(Gather, TurnedBoxesAreReported)
{
    Fixture<2> f(Domain::stretched_box, 0.0);
    for (Lanes& n : f.s.nodes) n = Lanes{};
    f.s.particles.F[4] = Mat<2>{{{-0.5, 1}, {-1, -0.5}}};  // J > 0
    TileReport report;
    f.passes.update_all(f.sweep(1.0), 0, f.s.particles.count, report);
    EXPECT_EQ(report.fault, Fault::domain_turned);
    EXPECT_EQ(report.particle, 4);
}

/// The same bytes for 1, 2, 3 and 8 threads, after several whole steps.
template <int D>
void check_threads(Domain domain, Scheme scheme)
{
    auto run = [&](int threads) {
        set_thread_count(threads);
        Random random(3);
        Model<D> model      = test::unit_box<D>(D == 3 ? 12 : 40, domain);  // enough particles for threads to start
        model.method.scheme = scheme;
        const Explicit<D> method(std::move(model));
        State<D> s = method.start(test::make_particles(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
        for (int i = 0; i < s.particles.count; ++i)
            for (int a = 0; a < D; ++a) s.particles.v[i][a] = 2 + test::uniform(random, -0.1, 0.1);
        for (int k = 0; k < 10; ++k) method.step(s, 0.3 * courant_time_step(method.model(), s.particles));
        return s;
    };
    const int before       = thread_count();
    const State<D> one     = run(1);
    const Particles<D>& p1 = one.particles;
    for (int threads : {2, 3, 8}) {
        const State<D> many    = run(threads);
        const Particles<D>& pn = many.particles;
        EXPECT_EQ(std::memcmp(p1.x.data(), pn.x.data(), sizeof(Vec<D>) * p1.x.size()), 0);
        EXPECT_EQ(std::memcmp(p1.v.data(), pn.v.data(), sizeof(Vec<D>) * p1.v.size()), 0);
        EXPECT_EQ(std::memcmp(p1.sigma.data(), pn.sigma.data(), sizeof(Mat<D>) * p1.sigma.size()), 0);
    }
    set_thread_count(before);
}
TEST(Threads, StepsAreIdenticalBitForBit)
{
    for (Domain d : test::kDomains) {
        check_threads<2>(d, Scheme::usl);
        check_threads<3>(d, Scheme::usl);
    }
    check_threads<2>(Domain::parallelepiped, Scheme::usf);
    check_threads<2>(Domain::parallelepiped, Scheme::musl);
}

}  // namespace
}  // namespace ordo
