// The consistent mass matrix: its product and its solutions against dense matrices.
#include "kernels/nodes.hpp"
#include "method/layout.hpp"
#include "method/reconstruction.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace ordo {
namespace {

using Dense = std::vector<std::vector<double>>;

/// x of A x = b, by elimination with partial pivoting.
std::vector<double> solve_dense(Dense A, std::vector<double> b)
{
    const std::size_t n = b.size();
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k; i < n; ++i)
            if (std::fabs(A[i][k]) > std::fabs(A[pivot][k])) pivot = i;
        std::swap(A[k], A[pivot]);
        std::swap(b[k], b[pivot]);
        for (std::size_t i = k + 1; i < n; ++i) {
            const double q = A[i][k] / A[k][k];
            for (std::size_t j = k; j < n; ++j) A[i][j] -= q * A[k][j];
            b[i] -= q * b[k];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        for (std::size_t j = k + 1; j < n; ++j) b[k] -= A[k][j] * b[j];
        b[k] /= A[k][k];
    }
    return b;
}

/// A block of particles whose masses and momenta are on the nodes.
template <int D>
struct Body {
    static constexpr int first = NodeLane::increment;  ///< the lanes that are solved for
    Explicit<D> method;
    Passes<D> passes;
    State<D> s;

    Body(Model<D> model, double low, double high, int per_axis)
        : method(std::move(model)),
          passes(choose_passes<D>(method.model().method)),
          s(method.start(plant_all(method.model(), test::block(method.model(), low, high, per_axis))))
    {
        test::Random random(4);
        for (int i = 0; i < s.particles.count; ++i) {
            s.particles.m[i] *= test::uniform(random, 0.5, 1.5);
            for (int a = 0; a < D; ++a) s.particles.v[i][a] = test::uniform(random, -1, 1);
        }
        clear(s.field.nodes.data(), s.field.tiles);
        s.field.tiles.for_each_by_colour([&](const Tile& t) { passes.project(sweep(), t.begin, t.end); });
        s.field.halo.add(s.field.nodes.data(), 0, NodeLane::end);
        for (Lanes& n : s.field.nodes)
            for (int a = 0; a < D; ++a) n[first + a] = n[a];
        s.field.halo.copy(s.field.nodes.data());
    }
    Sweep<D> sweep() { return {s.lattice, s.particles.view(), s.field.nodes.data(), nullptr, 0, 0, 0}; }
    std::size_t size() const { return s.field.nodes.size(); }
    /// The node inside the period.
    std::size_t image(std::size_t node) const
    {
        const Index<D> at = s.lattice.index(static_cast<std::ptrdiff_t>(node));
        return static_cast<std::size_t>(s.lattice.offset(s.lattice.inside_period(at)));
    }
    /// The matrix from its definition, images folded.
    Dense dense_matrix()
    {
        Dense M(size(), std::vector<double>(size()));
        for (int p = 0; p < s.particles.count; ++p) {
            std::vector<double> phi(size());
            test::with_shape<D>(method.model().method, [&](auto shape) {
                decltype(shape)::type::for_each_node(
                    s.lattice, s.particles.view(), p, s.field.nodes.data(),
                    [&](std::ptrdiff_t node, double w, const Vec<D>&) { phi[image(static_cast<std::size_t>(node))] += w; });
            });
            for (std::size_t i = 0; i < size(); ++i)
                for (std::size_t j = 0; phi[i] != 0 && j < size(); ++j) M[i][j] += s.particles.m[p] * phi[i] * phi[j];
        }
        return M;
    }
    double mass(std::size_t i) const { return s.field.nodes[i][NodeLane::mass]; }
    bool is_lumped(std::size_t i, double lump_below) const
    {
        return filled_part(s.lattice, s.field.nodes.data(), s.lattice.index(static_cast<std::ptrdiff_t>(i))) < lump_below;
    }

    /// Component a of the solution with the dense matrix: lumped rows alone, known values on the right, the others by elimination.
    std::vector<double> expected(const Dense& M, int a, double lump_below, const std::vector<std::optional<double>>& known) const
    {
        std::vector<double> u(size());
        std::vector<std::size_t> rows;
        for (std::size_t i = 0; i < size(); ++i) {
            if (image(i) != i || !(mass(i) > 0)) continue;
            if (known[i])
                u[i] = *known[i];
            else if (is_lumped(i, lump_below))
                u[i] = s.field.nodes[i][first + a] / mass(i);
            else
                rows.push_back(i);
        }
        Dense A(rows.size(), std::vector<double>(rows.size()));
        std::vector<double> b(rows.size());
        for (std::size_t r = 0; r < rows.size(); ++r) {
            const std::size_t i = rows[r];
            for (std::size_t q = 0; q < rows.size(); ++q) A[r][q] = M[i][rows[q]];
            b[r] = s.field.nodes[i][first + a];
            for (std::size_t j = 0; j < size(); ++j) {
                if (M[i][j] == 0) continue;
                if (is_lumped(j, lump_below))
                    A[r][r] += M[i][j];
                else if (known[j])
                    b[r] -= M[i][j] * *known[j];
            }
        }
        const std::vector<double> x = solve_dense(A, b);
        for (std::size_t r = 0; r < rows.size(); ++r) u[rows[r]] = x[r];
        return u;
    }
    /// Solved in place; returns the iterations.
    int solve(double lump_below)
    {
        const MassSolver<D> solver(passes, lump_below, false);
        fill_known();
        solver.solve(s, sweep(), s.field.nodes.data(), s.field.known.data(), MassSolver<D>::kAcceleration);
        return solver.iterations();
    }
    void fill_known()
    {
        s.field.constraints.for_each_velocity(method.model().conditions, {}, [&](std::ptrdiff_t node, int a, bool, double v) {
            s.field.known[static_cast<std::size_t>(node)][first + a] = v;
        });
    }
    std::vector<std::optional<double>> known(int a)
    {
        std::vector<std::optional<double>> r(size());
        fill_known();
        s.field.constraints.for_each([&](std::ptrdiff_t node, int component, bool) {
            if (component == a) r[static_cast<std::size_t>(node)] = s.field.known[static_cast<std::size_t>(node)][first + a];
        });
        return r;
    }
};

template <int D>
Model<D> consistent_box(int cells, const MethodSpec& spec)
{
    Model<D> model    = test::unit_box<D>(cells, spec);
    model.method.mass = MassMatrix::consistent;
    return model;
}

template <int D>
void check_product(const MethodSpec& spec)
{
    Body<D> b(consistent_box<D>(D == 3 ? 5 : 8, spec), 0.25, 0.75, 2);
    const Dense M = b.dense_matrix();
    test::Random random(8);
    Array<Lanes> from(b.size());
    for (Lanes& n : from)
        for (int k = 0; k < NodeLane::end; ++k) n[k] = test::uniform(random, -1, 1);
    clear(b.s.field.nodes.data(), b.s.field.tiles);
    b.s.field.tiles.for_each_by_colour([&](const Tile& t) { b.passes.apply_mass(b.sweep(), from.data(), t.begin, t.end); });
    for (std::size_t i = 0; i < b.size(); ++i) {
        Lanes sum{};
        for (std::size_t j = 0; j < b.size(); ++j) sum += from[j] * M[i][j];
        for (int k = 0; k < NodeLane::end; ++k) EXPECT_NEAR(b.s.field.nodes[i][k], sum[k], 1e-13 * M[i][i] + 1e-14);
    }
}
TEST(MassMatrix, ProductEqualsTheDenseOne)
{
    test::for_each_spec(test::shapes(), [](const MethodSpec& spec) {
        check_product<1>(spec);
        check_product<2>(spec);
    });
    check_product<3>(test::shape_spec(Basis::bspline2, Domain::cell));
}

/// The product by rows is that of particles, of quadrature points where `is_of_points`.
template <int D>
void check_rows(const Model<D>& model, double low, double high, bool is_of_points)
{
    Body<D> b(model, low, high, 2);
    State<D>& s = b.s;
    test::Random random(6);
    for (int i = 0; i < s.particles.count; ++i)  // no longer in the order of cells
        for (int a = 0; a < D; ++a) s.particles.x[i][a] += test::uniform(random, -0.2, 0.2) * model.h[a];
    clear(s.field.nodes.data(), s.field.tiles);
    if (is_of_points) {
        fit_cells(model, b.passes.cell_fit, s, b.sweep());
        Sweep<D> view = b.sweep();
        view.p        = s.points.view();
        s.points.for_each_by_colour([&](const Tile& t) { b.passes.project_points(view, t.begin, t.end); });
    } else {
        s.field.tiles.for_each_by_colour([&](const Tile& t) { b.passes.project(b.sweep(), t.begin, t.end); });
    }
    s.field.halo.add(s.field.nodes.data(), 0, NodeLane::end);

    Array<Lanes> from(b.size()), to(b.size());
    for (Lanes& n : from)
        for (int k = 0; k < NodeLane::end; ++k) n[k] = test::uniform(random, -1, 1);
    s.field.halo.copy(from.data());
    const MassSolver<D> solver(b.passes, 0.0, is_of_points);
    solver.apply(s, b.sweep(), from.data(), to.data());

    solver.prepare(s, b.sweep(), s.field.nodes.data());
    const NodeRows<D>& rows = s.field.mass.rows;
    EXPECT_FALSE(s.field.mass.entries.empty());
    for (int i = 1; i < rows.end(); ++i) s.field.mass.p[i] = from[rows.node(i)];
    solver.multiply(s, b.sweep(), s.field.mass.p.data(), s.field.mass.q.data());
    int count = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
        if (b.image(i) != i || !(b.mass(i) > 0)) continue;
        const int row = rows.row(static_cast<std::ptrdiff_t>(i));
        ++count;
        ASSERT_GT(row, 0);
        for (int k = 0; k < NodeLane::end; ++k) EXPECT_NEAR(s.field.mass.q[row][k], to[i][k], 1e-14 * b.mass(i)) << i;
    }
    EXPECT_EQ(rows.count(), count);
}
template <int D>
void check_rows(const MethodSpec& spec, bool is_of_points)
{
    Model<D> model = consistent_box<D>(D == 3 ? 5 : 9, spec);
    check_rows(model, 0.21, 0.77, is_of_points);
    model.periodic[D - 1] = true;
    check_rows(model, 0.0, 1.0, is_of_points);
    model.periodic = Vec<D, bool>::filled(true);
    check_rows(model, 0.0, 1.0, is_of_points);
    check_rows(model, 0.0, 0.6, is_of_points);
}
TEST(MassMatrix, RowsMultiplyAsParticlesDo)
{
    for (const Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3, Basis::ddmpm}) {
        const MethodSpec spec = test::shape_spec(basis, Domain::point);
        SCOPED_TRACE(test::describe(spec));
        check_rows<1>(spec, false);
        check_rows<2>(spec, false);
        check_rows<3>(spec, false);
    }
    for (const char* name : {"tls-mpm", "tls-ddmpm", "tls-bsmpm"}) {
        SCOPED_TRACE(name);
        check_rows<1>(find_preset(name)->spec, true);
        check_rows<2>(find_preset(name)->spec, true);
        check_rows<3>(find_preset(name)->spec, true);
    }
}

/// Another order of the sums, or a place that two threads write to, would show.
TEST(MassMatrix, ThreadsDoNotMatter)
{
    for (const Basis basis : {Basis::bspline2, Basis::ddmpm}) {
        Model<2> model    = consistent_box<2>(64, test::shape_spec(basis, Domain::point));
        model.periodic[1] = true;
        Body<2> one(model, 0.0, 1.0, 2);
        const int threads = thread_count();
        set_thread_count(1);
        const int iterations = one.solve(0.3);
        EXPECT_GT(one.s.field.mass.rows.count(), 2 * kPiece);  // some pieces of each sum
        for (const int n : {2, 3}) {
            Body<2> other(model, 0.0, 1.0, 2);
            set_thread_count(n);
            EXPECT_EQ(other.solve(0.3), iterations);
            EXPECT_EQ(std::memcmp(one.s.field.nodes.data(), other.s.field.nodes.data(), one.size() * sizeof(Lanes)), 0);
        }
        set_thread_count(threads);
    }
}

/// The matrix is kept within a step. What happens to particles between steps must not find an old one.
TEST(MassMatrix, ChangedParticlesHaveAnotherMatrix)
{
    for (const TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl}) {
        Model<2> model          = consistent_box<2>(8, {.basis = Basis::bspline2, .scheme = scheme});
        model.method.lump_below = 0.0;
        const auto seeds        = test::block(model, 0.0, 1.0, 3);
        const Explicit<2> method(std::move(model));
        State<2> s = method.start(plant_all(method.model(), seeds));
        test::Random random(3);
        method.step(s, 0.1 * courant_time_step(method.model(), s.particles));
        for (int i = 0; i < s.particles.count; ++i) {
            s.particles.m[i] *= test::uniform(random, 0.5, 1.5);
            s.particles.v[i] = {test::uniform(random, -1, 1), test::uniform(random, -1, 1)};
        }
        method.project(s);
        Array<Lanes> product(s.field.nodes.size()), momentum(s.field.nodes.size());
        const Passes<2> passes = choose_passes<2>(method.model().method);
        const Sweep<2> view{s.lattice, s.particles.view(), momentum.data(), nullptr, 0, 0, 0};
        MassSolver<2>(passes, 0.0, false).apply(s, view, s.field.nodes.data(), product.data());
        s.field.tiles.for_each_by_colour([&](const Tile& t) { passes.project(view, t.begin, t.end); });
        for (std::size_t i = 0; i < s.field.nodes.size(); ++i)
            for (int a = 0; a < 2; ++a) EXPECT_NEAR(product[i][a], momentum[i][a], 1e-11 * s.field.nodes[i][NodeLane::mass]);
    }
}

template <int D>
void check_solution(const Model<D>& model, double low, double high)
{
    Body<D> b(model, low, high, 3);
    const Dense M           = b.dense_matrix();
    const double lump_below = lump_below_of(model.method);
    std::vector<double> u[D];
    Vec<D> before{}, after{};
    for (int a = 0; a < D; ++a) {
        u[a] = b.expected(M, a, lump_below, b.known(a));
        for (std::size_t i = 0; i < b.size(); ++i)
            if (b.image(i) == i) before[a] += b.s.field.nodes[i][b.first + a];
    }
    b.solve(lump_below);
    double size = 0;
    for (std::size_t i = 0; i < b.size(); ++i) size += b.mass(i);
    for (int a = 0; a < D; ++a) {
        for (std::size_t i = 0; i < b.size(); ++i) {
            if (b.mass(i) > 0) {
                EXPECT_NEAR(b.s.field.nodes[i][b.first + a], u[a][b.image(i)], 2e-9);
            }
            if (b.image(i) == i) after[a] += b.mass(i) * b.s.field.nodes[i][b.first + a];
        }
        if (model.conditions.empty()) {
            EXPECT_NEAR(after[a], before[a], 1e-11 * size);
        }
    }
}

/// Fixed on the left, prescribed along the first axis in the middle and beyond.
template <int D>
std::vector<Condition<D>> walls()
{
    Condition<D> pulled{.axis = 0, .outer_is_above = true, .at = 0.6, .type = ConditionType::velocity, .value = {}};
    pulled.value[0] = Field(0.7);
    return {Condition<D>{.axis = 0, .at = 0.0, .value = {}}, pulled};
}

template <int D>
void check_solutions(const MethodSpec& spec)
{
    Model<D> model = consistent_box<D>(D == 1 ? 12 : 6, spec);
    check_solution(model, 0.25, 0.75);
    check_solution(model, 0.26, 0.71);  // nodes that are nearly empty
    model.conditions = walls<D>();
    check_solution(model, 0.0, 0.75);
    model.conditions.clear();
    model.periodic = Vec<D, bool>::filled(true);
    check_solution(model, 0.0, 0.75);
    check_solution(model, 0.0, 1.0);
}
TEST(MassMatrix, SolutionEqualsTheDenseOne)
{
    test::for_each_spec(test::shapes(), [](const MethodSpec& spec) {
        check_solutions<1>(spec);
        check_solutions<2>(spec);
    });
}

/// Of a full box of particles in a regular order the matrix is a product over axes, and its preconditioner the inverse but for
/// the single precision of the factors.
template <int D>
void check_iterations(Basis basis)
{
    const auto model = consistent_box<D>(D == 3 ? 6 : 12, {.basis = basis, .mass = MassMatrix::consistent});
    Explicit<D> method(model);
    State<D> s = method.start(plant_all(model, test::block(model, 0.0, 1.0, 3)));
    test::Random random(5);
    for (int i = 0; i < s.particles.count; ++i)
        for (int a = 0; a < D; ++a) s.particles.v[i][a] = test::uniform(random, -1, 1);
    StageTimes times;
    method.measure(&times);
    method.project(s);
    EXPECT_EQ(times.mass_solves, 1);
    EXPECT_LE(times.mass_iterations, 3) << name_of(basis) << " in " << D << "D";
}
TEST(MassMatrix, PreconditionerIsTheInverseOfAFullBox)
{
    for (const auto& basis : Axis<Basis>::choices) {
        if (broken_rule(test::shape_spec(basis.value, Domain::point))) continue;
        check_iterations<1>(basis.value);
        check_iterations<2>(basis.value);
        check_iterations<3>(basis.value);
    }
}

/// Constrained rows are removed; solving all of them and then setting the known values is something else.
TEST(MassMatrix, KnownValuesAreNoAfterthought)
{
    Model<1> model = consistent_box<1>(12, test::shape_spec(Basis::bspline2, Domain::point));
    Body<1> free(model, 0.0, 0.75, 3);
    model.conditions = walls<1>();
    Body<1> held(model, 0.0, 0.75, 3);
    const auto known = held.known(0);
    free.solve(0.05);
    held.solve(0.05);
    double difference = 0;
    for (std::size_t i = 0; i < held.size(); ++i) {
        if (known[i]) {
            EXPECT_EQ(held.s.field.nodes[i][held.first], *known[i]);
        } else {
            difference = std::max(difference, std::fabs(held.s.field.nodes[i][held.first] - free.s.field.nodes[i][free.first]));
        }
    }
    EXPECT_GT(difference, 0.01);
}

/// A wall that starts to move takes the particles beside it along, as with lumped mass.
TEST(MassMatrix, PrescribedVelocitiesReachTheParticles)
{
    for (const Basis basis : {Basis::hat, Basis::bspline2, Basis::ddmpm})
        for (const TimeScheme scheme : {TimeScheme::usf, TimeScheme::usl, TimeScheme::musl}) {
            Model<1> model = consistent_box<1>(20, {.basis = basis, .scheme = scheme});
            Condition<1> wall{.at = 0.0, .type = ConditionType::velocity, .value = {}};
            wall.value[0]    = Field(0.01);
            model.conditions = {wall};
            const auto seeds = test::block(model, 0.0, 0.5, 3);
            const Explicit<1> method(std::move(model));
            State<1> s = method.start(plant_all(method.model(), seeds));
            for (int k = 0; k < 40; ++k) method.step(s, 0.2 * courant_time_step(method.model(), s.particles));
            EXPECT_NEAR(s.particles.v[0][0], 0.01, 0.002) << name_of(basis) << ", " << name_of(scheme);
        }
}

/// One particle in two cells does not determine the nodes: forces that it cannot carry have no solution.
TEST(MassMatrix, SingularOnesAreReported)
{
    Model<1> model = consistent_box<1>(16, MethodSpec{});
    model.h[0]     = 0.125;
    model.cells    = {8};
    Body<1> b(model, 0.25, 0.75, 1);
    for (int i = 0; i < b.s.particles.count; ++i) b.s.particles.m[i] *= i % 2;
    clear(b.s.field.nodes.data(), b.s.field.tiles);
    b.passes.project(b.sweep(), 0, b.s.particles.count);
    test::Random random(2);
    for (Lanes& n : b.s.field.nodes) n[b.first] = n[NodeLane::mass] * test::uniform(random, -1, 1);
    try {
        b.solve(0.0);
        FAIL() << "a singular matrix was solved";
    } catch (const NumericalError& e) {
        for (const char* part : {"step 0", "mass matrix", "smaller particles", "lump_below"})
            EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
}

/// Splines of which a free surface leaves only the tail: without lumping the solution is of no use.
TEST(MassMatrix, TailsOfSplinesAreLumped)
{
    for (Basis basis : {Basis::bspline2, Basis::bspline3}) {
        auto largest = [&](double lump_below, int& iterations) {
            Model<1> model = consistent_box<1>(16, test::shape_spec(basis, Domain::point));
            Body<1> b(model, 0.25, 0.75 + 0.2 / 16, 3);
            for (Stress<1>& sigma : b.s.particles.sigma) sigma(0, 0) = 1.0;
            for (Lanes& n : b.s.field.nodes) n[NodeLane::increment] = 0.0;
            b.passes.force(b.sweep(), 0, b.s.particles.count);
            iterations  = b.solve(lump_below);
            double size = 0;
            for (std::size_t i = 0; i < b.size(); ++i) size = std::max(size, std::fabs(b.s.field.nodes[i][b.first]));
            return size;
        };
        int with = 0, without = 0;
        const double sane = largest(0.05, with), wild = largest(0.0, without);
        EXPECT_LT(with, 60);
        EXPECT_GT(wild, 10 * sane);
    }
}

}  // namespace
}  // namespace ordo
