// Scatter and gather passes of every domain against naive loops, conservation, threads.
#include "kernels/gather.hpp"
#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "material/neo_hookean.hpp"
#include "method/layout.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace ordo {
namespace {

using test::Random;

/// f(node, w, dw) for particle i of any shape: the weights' definition.
template <int D, class F>
void visit(const MethodSpec& spec, const State<D>& s, const ParticleView<D>& p, int i, F&& f)
{
    test::with_shape<D>(spec,
                        [&](auto shape) { decltype(shape)::type::for_each_node(s.lattice, p, i, s.field.nodes.data(), f); });
}

template <int D>
struct Fixture {
    Random random{42};
    Explicit<D> method;
    State<D> s;
    Passes<D> passes;
    StressUpdate<D> update_stress;

    explicit Fixture(const MethodSpec& spec, double deformation = 0.3)
        : method(test::unit_box<D>(D == 3 ? 12 : 20, spec)),
          s(test::random_state(method, 400, random, deformation)),
          passes(choose_passes<D>(spec)),
          update_stress(method.model().materials)
    {
        sort_particles(method.model(), s);
    }
    Sweep<D> sweep(double dt = 0)
    {
        return {s.lattice, s.particles.view(), s.field.nodes.data(), method.model().materials.data(), dt, 0.0, 0.0};
    }
    void scatter_all(typename Passes<D>::Scatter pass)
    {
        clear(s.field.nodes.data(), s.field.tiles);
        scatter_more(pass);
    }
    void scatter_more(typename Passes<D>::Scatter pass)
    {
        const Sweep<D> view = sweep();
        s.field.tiles.for_each_by_colour([&](const Tile& t) { pass(view, t.begin, t.end); });
    }
};

template <int D>
void check_scatter(const MethodSpec& spec, double deformation)
{
    Fixture<D> f(spec, deformation);
    f.scatter_all(f.passes.project);
    f.scatter_more(f.passes.force);
    const ParticleView<D> p = f.s.particles.view();
    Array<Lanes> naive(f.s.field.nodes.size());
    for (int i = 0; i < p.count; ++i)
        visit<D>(spec, f.s, p, i, [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
            const Vec<D> force = -p.V[i] * (in_plane(p.sigma[i]) * dw);
            naive[node][NodeLane::mass] += w * p.m[i];
            naive[node][NodeLane::volume] += w * p.V[i];
            for (int a = 0; a < D; ++a) {
                naive[node][NodeLane::velocity + a] += w * p.m[i] * p.v[i][a];
                naive[node][NodeLane::increment + a] += force[a];
            }
        });
    double mass = 0, expected_mass = 0;
    for (std::size_t n = 0; n < naive.size(); ++n) {
        for (int k = 0; k < NodeLane::end; ++k) ASSERT_NEAR(f.s.field.nodes[n][k], naive[n][k], 1e-10) << "lane " << k;
        mass += f.s.field.nodes[n][NodeLane::mass];
    }
    for (int i = 0; i < p.count; ++i) expected_mass += p.m[i];
    EXPECT_NEAR(mass, expected_mass, 1e-12 * expected_mass);
}

TEST(Scatter, EqualsTheNaiveLoop)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_scatter<1>(spec, 0.3);
        check_scatter<2>(spec, 0.3);
        check_scatter<3>(spec, 0.3);
    });
}

/// Domains several cells wide get wider tiles, and the sums stay right.
TEST(Scatter, WideDomains)
{
    for (Domain d : {Domain::stretched_box, Domain::parallelepiped}) {
        const MethodSpec spec = test::shape_spec(Basis::hat, d);
        Fixture<2> f(spec, 0.3);
        for (int i = 0; i < f.s.particles.count; i += 50) {
            if (d == Domain::parallelepiped)
                f.s.particles.edges[i] *= 9.0;
            else
                f.s.particles.half[i] *= 9.0;
        }
        f.s.reach = 0;
        for (int i = 0; i < f.s.particles.count; ++i)
            f.s.reach = std::max(f.s.reach, f.passes.reach(f.s.lattice, f.s.particles.view(), i));
        ASSERT_GT(f.s.reach, 2.0);
        EXPECT_FALSE(is_sorted_enough(f.s));
        sort_particles(f.method.model(), f.s);
        EXPECT_GE(f.s.field.tiles.halo(), f.s.reach);
        f.scatter_all(f.passes.project);
        const ParticleView<2> p = f.s.particles.view();
        Array<Lanes> naive(f.s.field.nodes.size());
        for (int i = 0; i < p.count; ++i)
            visit<2>(spec, f.s, p, i,
                     [&](std::ptrdiff_t node, double w, const Vec<2>&) { naive[node][NodeLane::mass] += w * p.m[i]; });
        for (std::size_t n = 0; n < naive.size(); ++n)
            ASSERT_NEAR(f.s.field.nodes[n][NodeLane::mass], naive[n][NodeLane::mass], 1e-12);
    }
}

TEST(Scatter, SeparatePassesEqualTheFusedOne)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        Fixture<2> f(spec);
        if (!f.passes.project_and_force) return;
        f.scatter_all(f.passes.project_and_force);
        std::vector<Lanes> fused(f.s.field.nodes.begin(), f.s.field.nodes.end());
        f.scatter_all(f.passes.project);
        f.scatter_more(f.passes.force);
        for (std::size_t n = 0; n < fused.size(); ++n)
            for (int k = 0; k < NodeLane::end; ++k) ASSERT_NEAR(f.s.field.nodes[n][k], fused[n][k], 1e-11);
    });
}

TEST(Scatter, ForcesSumToZero)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        Fixture<3> f(spec);
        f.scatter_all(f.passes.project);
        f.scatter_more(f.passes.force);
        Vec<3> sum{};
        double size = 0;
        for (const Lanes& n : f.s.field.nodes)
            for (int a = 0; a < 3; ++a) {
                sum[a] += n[NodeLane::increment + a];
                size += std::fabs(n[NodeLane::increment + a]);
            }
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(sum[a], 0, 1e-13 * size);
    });
}

template <int D>
void check_gather(const MethodSpec& spec)
{
    Fixture<D> f(spec);
    for (Lanes& n : f.s.field.nodes) {
        for (int k = 0; k < NodeLane::end; ++k) n[k] = test::uniform(f.random, -1, 1);
        n[NodeLane::mass] += 1.5;
    }
    const double dt         = 0.003;
    const ParticleView<D> p = f.s.particles.view();
    std::vector<Vec<D>> x, v, corners;
    std::vector<Mat<D>> F;
    for (int i = 0; i < p.count; ++i) {
        Vec<D> xi = p.x[i], vi = p.v[i];
        Mat<D> L{};
        visit<D>(spec, f.s, p, i, [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
            Vec<D> nv{}, ndv{};
            for (int a = 0; a < D; ++a) {
                nv[a]  = f.s.field.nodes[node][NodeLane::velocity + a];
                ndv[a] = f.s.field.nodes[node][NodeLane::increment + a];
            }
            xi += dt * w * nv;
            vi += w * ndv;
            L += outer(nv, dw);
        });
        x.push_back(xi);
        v.push_back(vi);
        F.push_back((Mat<D>::identity() + dt * L) * p.F[i]);
    }
    // A corner moves as a point does, an enriched one as the node that it is.
    Particles<D> point(1, {});
    for (std::size_t c = 0; c < f.s.particles.corner.size(); ++c) {
        Vec<D> at = point.x[0] = f.s.particles.corner[c];
        if (p.corner_node && p.corner_node[c] >= 0) {
            for (int a = 0; a < D; ++a) at[a] += dt * f.s.field.nodes[p.corner_node[c]][NodeLane::velocity + a];
            corners.push_back(at);
            continue;
        }
        MethodSpec of = spec;
        of.domain     = Domain::point;
        visit<D>(of, f.s, point.view(), 0, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            for (int a = 0; a < D; ++a) at[a] += dt * w * f.s.field.nodes[node][NodeLane::velocity + a];
        });
        corners.push_back(at);
    }
    const Sweep<D> view = f.sweep(dt);
    TileReport report;
    f.update_stress(f.passes.update_all, view, 0, p.count, report);
    if (has_cells(spec)) {
        f.passes.move_corners(view, 0, static_cast<std::ptrdiff_t>(corners.size()));
        f.passes.follow_corners(view, 0, p.count, report);
    }
    EXPECT_EQ(report.fault, Fault::none);
    for (std::size_t c = 0; c < corners.size(); ++c)
        for (int a = 0; a < D; ++a) EXPECT_NEAR(p.corner[c][a], corners[c][a], 1e-14);
    const NeoHookean law{f.method.model().materials[0].lambda, f.method.model().materials[0].mu};
    for (int i = 0; i < p.count; ++i) {
        if (has_cells(spec)) {
            Vec<D> at[1 << D];
            get_corners(p.cell[i], p.corner, at);
            const bool is_exact    = spec.weights == CornerWeights::exact;
            const CellWeights<D> k = (is_exact ? exact_weights<D> : mean_weights<D>)(at, p.cell[i].is_simplex());
            EXPECT_NEAR(p.V[i], k.V, 1e-15);
            x[i] = centroid<D>(k, at);
        } else {
            EXPECT_NEAR(p.V[i], det(F[i]) * p.V0[i], 1e-12);
        }
        const Stress<D> sigma = law.cauchy(F[i]);
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
            if (spec.domain == Domain::stretched_box) {
                EXPECT_NEAR(p.half[i][a], F[i](a, a) * p.half0[i][a], 1e-14);
            }
        }
    }
}

TEST(Gather, EqualsTheNaiveLoop)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        check_gather<1>(spec);
        check_gather<2>(spec);
        check_gather<3>(spec);
    });
}

/// Eight particles at a time, the last ones of a tile fewer, of several materials: each as if it were alone.
template <int D>
void check_batches(const MethodSpec& spec)
{
    const std::array materials{find_law("neo-hookean"), find_law("jaumann-elastic"), find_law("st-venant-kirchhoff")};
    std::array<Material, 3> law;
    auto updated = [&](auto&& next_length) {
        auto f = std::make_unique<Fixture<D>>(spec);
        for (Lanes& n : f->s.field.nodes)
            for (int k = 0; k < NodeLane::end; ++k) n[k] = k == NodeLane::mass ? 1.5 : test::uniform(f->random, -1, 1);
        const ParticleView<D> p = f->s.particles.view();
        for (int m = 0; m < 3; ++m) law[m] = {materials[m], 1e3, 5.8e5 * (m + 1), 3.8e5};
        const StressUpdate<D> update_stress({law.begin(), law.end()});
        for (int i = 0; i < p.count; ++i)  // runs of one material and changes within a batch
            p.material[i] = i / 40 % 2 ? i / 3 % 3 : 0;
        Sweep<D> view  = f->sweep(0.003);
        view.materials = law.data();
        TileReport report;
        for (int i = 0, end = 0; i < p.count; i = end) {
            end = std::min(p.count, i + next_length(i));
            update_stress(f->passes.update_all, view, i, end, report);
        }
        EXPECT_EQ(report.fault, Fault::none);
        return f;
    };
    const auto one_by_one   = updated([](int) { return 1; });
    const auto together     = updated([](int i) { return i < 150 ? 3 + i % 17 : 1000; });  // also more than a piece
    const ParticleView<D> a = one_by_one->s.particles.view(), b = together->s.particles.view();
    for (int i = 0; i < a.count; ++i) {
        EXPECT_EQ(a.material[i], b.material[i]);
        EXPECT_NEAR(a.V[i], b.V[i], 1e-14);
        for (int c = 0; c < D; ++c) {
            EXPECT_NEAR(a.x[i][c], b.x[i][c], 1e-14);
            EXPECT_NEAR(a.v[i][c], b.v[i][c], 1e-13);
            for (int d = 0; d < D; ++d) {
                EXPECT_NEAR(a.F[i](c, d), b.F[i](c, d), 1e-13);
                EXPECT_NEAR(a.sigma[i](c, d), b.sigma[i](c, d), 1e-7);
            }
        }
        const Material& m = law[a.material[i]];
        if (!m.law->is_hyperelastic) continue;
        const Stress<D> sigma = m.law->in<D>().initial_stress(m, a.F[i]);
        for (int k = 0; k < Stress<D>::size; ++k) EXPECT_NEAR(b.sigma[i].c[k], sigma.c[k], 1e-7);
    }
}

TEST(Gather, BatchesOfAnyLengthAndMaterial)
{
    test::for_each_spec(test::all_shapes(), [](const MethodSpec& spec) {
        if (has_cells(spec)) return;  // move otherwise
        check_batches<1>(spec);
        check_batches<2>(spec);
        check_batches<3>(spec);
    });
}

TEST(Gather, PicFractionBlends)
{
    Fixture<2> f(MethodSpec{});
    for (Lanes& n : f.s.field.nodes) n = make_lanes(2, 3, 0, 1, 0.5, -0.5, 0, 0);
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
        Fixture<2> f(test::shape_spec(Basis::hat, Domain::parallelepiped), 0.0);
        for (Lanes& n : f.s.field.nodes) n = Lanes{};
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
                  for (Lanes& n : f.s.field.nodes) n = make_lanes(10, 0, 0, 1, 0, 0, 0, 0);
              }),
              (std::pair{Fault::left_grid, 0}));
    EXPECT_EQ(report_of([](auto& f) { f.s.particles.v[8][1] = std::nan(""); }), (std::pair{Fault::not_finite, 8}));
    EXPECT_EQ(report_of([](auto& f) { f.s.particles.edges0[3] *= 1e4; }), (std::pair{Fault::domain_too_wide, 3}));
}

/// A box stretched by F_aa <= 0 has turned over: no length, no weights that mean anything.
TEST(Gather, TurnedBoxesAreReported)
{
    Fixture<2> f(test::shape_spec(Basis::hat, Domain::stretched_box), 0.0);
    for (Lanes& n : f.s.field.nodes) n = Lanes{};
    f.s.particles.F[4] = Mat<2>{{{-0.5, 1}, {-1, -0.5}}};  // J > 0
    TileReport report;
    f.passes.update_all(f.sweep(1.0), 0, f.s.particles.count, report);
    EXPECT_EQ(report.fault, Fault::domain_turned);
    EXPECT_EQ(report.particle, 4);
}

/// The same bytes for 1, 2, 3 and 8 threads, after several whole steps.
template <int D>
void check_threads(const MethodSpec& spec)
{
    auto run = [&](int threads) {
        set_thread_count(threads);
        Random random(3);
        const Explicit<D> method(test::unit_box<D>(D == 3 ? 12 : 32, spec));  // enough particles for threads to start
        State<D> s = method.start(test::plant_halves(method.model(), test::block(method.model(), 0.25, 0.75, 2)));
        for (int i = 0; i < s.particles.count; ++i)
            for (int a = 0; a < D; ++a) s.particles.v[i][a] = 2 + test::uniform(random, -0.1, 0.1);
        for (int k = 0; k < 5; ++k) method.step(s, 0.2 * courant_time_step(method.model(), s.particles));
        return s;
    };
    const int before       = thread_count();
    const State<D> one     = run(1);
    const Particles<D>& p1 = one.particles;
    auto is_same = [](const auto& f, const auto& g) { return std::memcmp(f.data(), g.data(), sizeof(f[0]) * f.size()) == 0; };
    for (int threads : {2, 3, 8}) {
        const State<D> many    = run(threads);
        const Particles<D>& pn = many.particles;
        EXPECT_TRUE(is_same(p1.x, pn.x));
        EXPECT_TRUE(is_same(p1.v, pn.v));
        EXPECT_TRUE(is_same(p1.sigma, pn.sigma));
        EXPECT_TRUE(p1.corner.empty() || is_same(p1.corner, pn.corner));
    }
    set_thread_count(before);
}
TEST(Threads, StepsAreIdenticalBitForBit)
{
    std::vector<MethodSpec> specs = test::all_shapes();
    for (const MethodSpec& spec : test::shapes()) {
        if (spec.domain != Domain::point && spec.domain != Domain::cell) continue;
        specs.push_back(spec);
        specs.back().mass       = MassMatrix::consistent;
        specs.back().lump_below = 0.2;
    }
    for (TimeScheme scheme : {TimeScheme::usf, TimeScheme::musl}) {
        specs.push_back(test::shape_spec(Basis::hat, Domain::parallelepiped));
        specs.back().scheme = scheme;
    }
    test::for_each_spec(specs, check_threads<2>);
    for (Domain d : {Domain::point, Domain::stretched_box, Domain::parallelepiped, Domain::cell})
        check_threads<3>(test::shape_spec(Basis::hat, d));
}

}  // namespace
}  // namespace ordo
