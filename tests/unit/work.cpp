// The work of a step: counted node visits against the shapes themselves, operations against sums by hand.
#include "app/work.hpp"
#include "spline/scheme.hpp"
#include "support/particles.hpp"

namespace ordo {
namespace {

const MethodSpec& spec_of(std::string_view preset) { return find_preset(preset)->spec; }

template <int D>
struct Stepped {
    Explicit<D> method;
    State<D> s;

    explicit Stepped(const MethodSpec& spec)
        : method(test::unit_box<D>(8, spec)),
          s(method.start(test::plant_halves(method.model(), test::block(method.model(), 0.25, 0.75, 2))))
    {
        method.step(s, 1e-6);
    }
    StepWork work(double solves = 0, double iterations = 0) { return count_work(method, s, solves, iterations); }
    double particles() const { return s.particles.count; }
};

/// Visits of nodes with a shape's own definition.
template <int D>
double visits(const MethodSpec& spec, State<D>& s)
{
    double n = 0;
    test::with_shape<D>(spec, [&](auto shape) {
        using S = typename decltype(shape)::type;
        for (int i = 0; i < s.particles.count; ++i)
            S::for_each_node(s.lattice, s.particles.view(), i, s.field.nodes.data(),
                             [&](std::ptrdiff_t, double, const Vec<D>&) { ++n; });
    });
    return n;
}

template <int D>
void check_visits(const MethodSpec& spec)
{
    if (spec.basis == Basis::ddmpm) return;  // whose definition visits the neighbours too
    const Explicit<D> method(test::unit_box<D>(8, spec));
    test::Random random(3);
    State<D> s = test::random_state(method, 20, random);
    EXPECT_EQ(count_work(method, s, 0, 0).visits, visits(spec, s));
}

TEST(Work, VisitsAreThoseOfTheShape)
{
    test::for_each_spec(test::all_shapes(), check_visits<1>);
    test::for_each_spec(test::all_shapes(), check_visits<2>);
    test::for_each_spec(test::all_shapes(), check_visits<3>);
}

TEST(Work, VisitsOfAParticle)
{
    const std::pair<std::string_view, double> in_3d[] = {{"mpm", 8},    {"ugimp", 27},  {"cpdi1", 64},
                                                         {"cpdi2", 64}, {"cpdi2t", 32}, {"bscpdi2", 216},
                                                         {"bsmpm", 27}, {"ddmpm", 8},   {"fem", 8}};
    for (const auto& [preset, wanted] : in_3d) {
        SCOPED_TRACE(preset);
        Stepped<3> block(spec_of(preset));
        EXPECT_EQ(block.work().visits, wanted * block.particles());
    }
}

/// mpm in 3D. The scatter has 2 rows of 3 operations on eight lanes, 4 of 2.5 and 8 nodes of 3, and 3 + 9 for m v and V sigma;
/// the gather 2 of 5, 4 of 4, 8 of 3, then 9 for dt L, 141 for F, J and the stress, 12 for v and 6 for x.
TEST(Work, OperationsOfMpm)
{
    Stepped<3> block(spec_of("mpm"));
    const StepWork work = block.work();
    EXPECT_EQ(work.stages[StageTimes::scatter].flops, (8 * (2 * 3 + 4 * 2.5 + 8 * 3) + 3 + 9) * block.particles());
    EXPECT_EQ(work.stages[StageTimes::gather].flops, (8 * (2 * 5 + 4 * 4 + 8 * 3) + 9 + 141 + 12 + 6) * block.particles());
    EXPECT_EQ(work.stages[StageTimes::fit].flops, 0);
}
/// Two scatters: m and m v with 2, 4 and 8 of 1, 1 and 2 operations, forces alone with 2 of 2.5, 4 of 2 and 8 of 2.
TEST(Work, OperationsOfMpmWithStressesFirst)
{
    MethodSpec spec = spec_of("mpm");
    spec.scheme     = TimeScheme::usf;
    Stepped<3> block(spec);
    EXPECT_EQ(block.work().stages[StageTimes::scatter].flops,
              (8 * (2 + 4 + 8 * 2) + 3 + 8 * (2 * 2.5 + 4 * 2 + 8 * 2) + 9) * block.particles());
}

/// Scatter: x, v, m, V, sigma, and each node with mass twice. The block has 4 cells a side, 5 nodes.
TEST(Work, TrafficOfMpm)
{
    Stepped<3> block(spec_of("mpm"));
    const StepWork work = block.work();
    const double nodes  = 5 * 5 * 5;
    EXPECT_EQ(work.stages[StageTimes::scatter].bytes, (2 * 24 + 2 * 8 + 48) * block.particles() + 2 * 64 * nodes);
    EXPECT_EQ(work.stages[StageTimes::gather].bytes,
              (2 * 24 + 2 * 24 + 2 * 72 + 48 + 8 + 8 + 4) * block.particles() + 64 * nodes);
}

/// A particle of cpls has nine samples. Each adds 6 x 6 products of polynomials of x and y times 6 of z, in one Lanes, for the matrix, and 5 x 5 times 5 of z for
/// each of three right-hand sides, in two.
TEST(Work, FitsCountSamplesAndTheirProducts)
{
    Stepped<3> all(spec_of("cpls")), particles(spec_of("icpdi1"));
    const double more     = all.work().stages[StageTimes::fit].flops - particles.work().stages[StageTimes::fit].flops;
    const double products = 6 * 6 * 1 + 5 * 5 * 2, corners = 8 * 4 * 9 + 45;  // the last for their velocities
    EXPECT_EQ(more, all.particles() * (8 * products * 16 + corners));
}

/// An iteration multiplies each row, of 25 entries, and solves along both axes to and fro with 5 operations; the rest is on the
/// records. A solve more multiplies once more: factors are those of the step.
TEST(Work, MassMatrixCostsItsIterations)
{
    Stepped<2> block(spec_of("bsmpm"));
    const double none = block.work(1, 0).total().flops, one = block.work(1, 1).total().flops,
                 ten = block.work(1, 10).total().flops;
    EXPECT_DOUBLE_EQ(ten - none, 10 * (one - none));
    const double nodes = 6 * 6;  // of 4 x 4 cells
    EXPECT_EQ(one - none, nodes * 8 * (25 * 2 + 2 * 2 * 5 + 18));
    EXPECT_EQ(block.work(2, 0).total().flops - none, nodes * 8 * (25 * 2 + 12));
}

/// Every preset in every dimension has work, and none where it has no pass.
template <int D>
void check_presets()
{
    for (const Preset& preset : presets()) {
        if (has_stages_of_runge_kutta(preset.spec)) continue;  // see OfSplines
        SCOPED_TRACE(preset.name);
        Stepped<D> block(preset.spec);
        const StepWork work = block.work(1, 5);
        for (const auto stage : {StageTimes::scatter, StageTimes::nodes, StageTimes::gather}) {
            EXPECT_GT(work.stages[stage].flops, 0);
            EXPECT_GT(work.stages[stage].bytes, 0);
        }
        const bool fits = fits_velocity(preset.spec) || preset.spec.quadrature != Quadrature::particle;
        EXPECT_EQ(work.stages[StageTimes::fit].flops > 0, fits);
    }
}
TEST(Work, OfEveryPreset)
{
    check_presets<1>();
    check_presets<2>();
    check_presets<3>();
}

/// An iteration multiplies all entries of a function by a record, and factors along the axes and vectors by a few.
TEST(Work, OfSplines)
{
    const SplineScheme<3> method(test::walled_box<3>(5, spec_of("spline4")));
    State<3> s = method.start(plant_all(method.model(), test::block(method.model(), 0.0, 1.0, 2)));
    method.step(s, 1e-6);
    SplineIterations iterations = method.scratch().iterations;
    const StepWork work         = count_work(method, s, 0, 0);
    ++iterations[SplineSolve::velocity];
    const StepWork more    = count_spline_work(method.model(), s, iterations);
    const double functions = 8 * 8 * 8;
    EXPECT_DOUBLE_EQ(more.stages[StageTimes::fit].flops - work.stages[StageTimes::fit].flops,
                     functions * 8 * (2 * 7 * 7 * 7 + 4 * 3 * 3 + 16));
    for (const auto stage : {StageTimes::fit, StageTimes::nodes, StageTimes::gather}) {
        EXPECT_GT(work.stages[stage].flops, 0);
        EXPECT_GT(work.stages[stage].bytes, 0);
    }
}

}  // namespace
}  // namespace ordo
