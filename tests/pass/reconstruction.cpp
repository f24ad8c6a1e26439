// What a step reconstructs, through whole projections and gathers: least-squares velocities, fields of cells, gradients at
// cell centres, polynomials of particles. Exact fields, plain sums written here, conservation, threads, periodic axes.
#include "method/reconstruction.hpp"
#include "kernels/affine.hpp"
#include "kernels/moments.hpp"
#include "kernels/nodes.hpp"
#include "method/layout.hpp"
#include "shape/affine_point.hpp"
#include "shape/bspline.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>

namespace ordo {
namespace {

/// Taylor least squares of everything, on a basis.
MethodSpec tls(Basis basis)
{
    MethodSpec spec = find_preset("tls-mpm")->spec;
    spec.basis      = basis;
    return spec;
}

using test::Random;
using test::uniform;

// ---- fields and bodies -----------------------------------------------------------------------------------------------

/// A random linear velocity.
template <int D>
struct Linear {
    Mat<D> A{};
    Vec<D> b{};

    explicit Linear(Random& random)
    {
        for (int i = 0; i < D; ++i) {
            b[i] = uniform(random, -1, 1);
            for (int j = 0; j < D; ++j) A(i, j) = uniform(random, -1, 1);
        }
    }
    Vec<D> operator()(const Vec<D>& x) const { return A * x + b; }
};

/// A random polynomial of a degree.
template <int D>
class Polynomial {
  public:
    Polynomial(Random& random, int degree)
    {
        for (int k = 0; k < binomial(degree + D, D); ++k) coefficient_[k] = uniform(random, -1, 1);
    }
    double operator()(const Vec<D>& x) const
    {
        double p[count], sum = 0;
        Monomials<D, 3>::evaluate(x, p);
        for (int k = 0; k < count; ++k) sum += coefficient_[k] * p[k];
        return sum;
    }

  private:
    static constexpr int count = Monomials<D, 3>::count;
    double coefficient_[count]{};
};

/// One of them for each component.
template <int D>
struct PolynomialVector {
    std::vector<Polynomial<D>> component;

    PolynomialVector(Random& random, int degree)
    {
        for (int a = 0; a < D; ++a) component.emplace_back(random, degree);
    }
    Vec<D> operator()(const Vec<D>& x) const
    {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = component[a](x);
        return v;
    }
};

/// A body in the unit box: blocks of `per_axis` particles a cell and axis, without those that are cut out.
template <int D>
struct Body {
    double low, high;
    int per_axis                              = 2;
    std::function<bool(const Vec<D>&)> is_cut = [](const Vec<D>&) { return false; };

    std::vector<Seed<D>> seeds(const Model<D>& model) const
    {
        std::vector<Seed<D>> r = test::block(model, low, high, per_axis);
        r.erase(std::remove_if(r.begin(), r.end(), [&](const Seed<D>& s) { return is_cut(s.x); }), r.end());
        return r;
    }
};
template <int D>
State<D> start(const Explicit<D>& method, const Body<D>& body)
{
    return method.start(plant_all(method.model(), body.seeds(method.model())));
}

/// The body with places, corners and all that particles carry at random.
template <int D>
State<D> start_at_random(const Explicit<D>& method, const Body<D>& body, Random& random)
{
    const Model<D>& model = method.model();
    State<D> s            = start(method, body);
    Particles<D>& p       = s.particles;
    const double size     = 0.45 * model.h[0] / body.per_axis;  // that each stays in its sub-cell
    auto jitter           = [&](Vec<D>& x) {
        for (int a = 0; a < D; ++a) x[a] += uniform(random, -size, size);
    };
    auto shuffle = [&](Vec<D>& v) {
        for (int a = 0; a < D; ++a) v[a] = uniform(random, -1, 1);
    };
    for (Vec<D>& corner : p.corner) jitter(corner);
    for (Vec<D>& v : p.corner_velocity) shuffle(v);
    for (int i = 0; i < p.count; ++i) {
        jitter(p.x[i]);
        shuffle(p.v[i]);
        p.m[i] *= uniform(random, 0.5, 1.5);
        for (int a = 0; a < D; ++a)
            for (int b = a; b < D; ++b) p.sigma[i](a, b) = p.sigma[i](b, a) = uniform(random, -100, 100);
        for (int a = 0; a < D && !p.L.empty(); ++a)
            for (int b = 0; b < D; ++b) p.L[i](a, b) = uniform(random, -1, 1);
        for (int k = 0; k < power_of(3, D) && !p.modes.empty(); ++k) shuffle(p.modes[i].c[k]);
    }
    if (method.model().method.domain != Domain::point) test::follow(model, s);
    sort_particles(model, s);
    return s;
}

template <int D>
Vec<D> velocity(const Lanes& node)
{
    Vec<D> v{};
    for (int a = 0; a < D; ++a) v[a] = node[NodeLane::velocity + a];
    return v;
}

/// f(node, place) for each node with mass; of those that repeat each other only the one inside the period.
template <int D, class F>
void for_each_node_with_mass(State<D>& s, F&& f)
{
    for (std::size_t n = 0; n < s.field.nodes.size(); ++n) {
        const auto node = static_cast<std::ptrdiff_t>(n);
        Index<D> image  = s.lattice.index(node);
        for (int a = 0; a < D; ++a)
            if (s.lattice.periodic[a]) image[a] = s.lattice.periodic_image(a, image[a]);
        if (s.lattice.offset(image) == node && s.field.nodes[n][NodeLane::mass] > 0)
            f(s.field.nodes[n], place_of_node(s.lattice, node));
    }
}

template <int D, class Velocity>
void expect_velocities(State<D>& s, const Velocity& v, double tolerance)
{
    double error = 0;
    int count    = 0;
    for_each_node_with_mass(s, [&](const Lanes& node, const Vec<D>& x) {
        error = std::max(error, norm(velocity<D>(node) - v(x)));
        ++count;
    });
    EXPECT_LT(error, tolerance);
    EXPECT_GT(count, 1);
}

template <int D>
Sweep<D> sweep(const Explicit<D>& method, State<D>& s, double dt = 0, double pic = 0)
{
    return {s.lattice, s.particles.view(), s.field.nodes.data(), method.model().materials.data(), dt, pic, 0.0,
            false,     s.gradients.data()};
}

/// A gather of all particles.
template <int D>
void gather_all(const Explicit<D>& method, State<D>& s, typename Passes<D>::Gather pass, double dt = 0, double pic = 0)
{
    TileReport report;
    pass(sweep(method, s, dt, pic), 0, s.particles.count, report);
}

/// The velocity gradients that particles take from the nodes.
template <int D>
std::vector<Mat<D>> gradients(const Explicit<D>& method, State<D>& s)
{
    const Passes<D> passes = choose_passes<D>(method.model().method);
    if (passes.gradient_at_center) find_cell_gradients(passes, s, s.field.nodes.data());
    for (Mat<D>& F : s.particles.F) F = Mat<D>::identity();
    gather_all(method, s, passes.deform, 1.0);
    std::vector<Mat<D>> L;
    for (const Mat<D>& F : s.particles.F) L.push_back(F - Mat<D>::identity());
    return L;
}

template <int D>
double largest_entry(const Mat<D>& m)
{
    double r = 0;
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r = std::isfinite(m(a, b)) ? std::max(r, std::fabs(m(a, b))) : 1e300;
    return r;
}

/// f(node, w, dw) for particle i, with nodes that repeat each other folded into one.
template <int D, class F>
void visit(const MethodSpec& spec, const State<D>& s, const ParticleView<D>& p, int i, F&& f)
{
    test::with_shape<D>(spec, [&](auto shape) {
        decltype(shape)::type::for_each_node(s.lattice, p, i, s.field.nodes.data(),
                                             [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
                                                 const Index<D> at = s.lattice.index(node);
                                                 f(s.lattice.offset(s.lattice.inside_period(at)), w, dw);
                                             });
    });
}

MethodSpec fit_spec(Projection projection, Basis basis = Basis::hat, Weight weight = Weight::cubic)
{
    return {.basis = basis, .projection = projection, .weight = weight};
}

MethodSpec preset(std::string_view name)
{
    for (const Preset& p : presets())
        if (p.name == name) return p.spec;
    throw InputError("there is no preset called " + std::string(name));
}

/// Half the support of a weight, cells.
double support(Weight weight) { return weight == Weight::hat ? 1.0 : weight == Weight::quadratic ? 1.5 : 2.0; }

// ---- projections mls and imls ----------------------------------------------------------------------------------------

template <int D>
void check_linear_field(const MethodSpec& spec)
{
    constexpr int cells = D == 3 ? 6 : D == 2 ? 8 : 16;
    Random random(11);
    const Linear<D> v(random);
    const Explicit<D> method(test::unit_box<D>(cells, spec));
    // Bodies whose last nodes with mass, half a support of their functions beyond, have two layers of particles in reach of
    // the weight: where the body ends on faces of cells, and for the narrowest functions where it does not.
    const double p = spec.basis == Basis::bspline3 ? 3 : spec.basis == Basis::bspline2 ? 2 : 1, h = 1.0 / cells;
    std::vector<Body<D>> bodies{{0.0, 1.0}};
    if (0.5 * (p - 1) + 0.75 < support(spec.weight)) {
        bodies.push_back({0.0, 3 * h});
        bodies.push_back({2 * h, 4 * h});
    }
    if (0.5 * (p + 1) + 0.75 < support(spec.weight)) bodies.push_back({1.3 * h, 4.1 * h});
    for (const Body<D>& body : bodies) {
        SCOPED_TRACE("body from " + std::to_string(body.low) + " to " + std::to_string(body.high));
        State<D> s = start(method, body);
        if (body.low == 1.3 * h) {  // the grid's sub-cells end on its faces
            for (Vec<D>& x : s.particles.x) x += Vec<D>::filled(0.3 * h);
            for (Vec<D>& x : s.particles.corner) x += Vec<D>::filled(0.3 * h);
            sort_particles(method.model(), s);
        }
        set_velocities(s.particles, 0, s.particles.count, v, method.model().h);
        method.project(s);
        expect_velocities(s, v, 1e-11);
        EXPECT_EQ(s.projection.fit.dropped, 0);
        EXPECT_EQ(s.projection.fit.fallback, 0);
    }
}

/// Methods of every basis, weight and kind of samples.
std::vector<MethodSpec> fits(Projection projection)
{
    std::vector<MethodSpec> r;
    for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3})
        for (const auto& weight : Axis<Weight>::choices) {
            MethodSpec spec = fit_spec(projection, basis, weight.value);
            r.push_back(spec);
            spec.samples = Samples::corners;
            for (Domain domain : {Domain::box, Domain::parallelepiped, Domain::cell}) {
                spec.domain = domain;
                r.push_back(spec);
            }
        }
    for (std::size_t k = 0, count = r.size(); k < count; ++k) {
        r.push_back(r[k]);
        r.back().limiter = Limiter::slope;
    }
    return r;
}

TEST(VelocityFit, LinearFieldIsReproduced)
{
    for (Projection projection : {Projection::mls, Projection::imls})
        test::for_each_spec(fits(projection), [](const MethodSpec& spec) {
            check_linear_field<1>(spec);
            check_linear_field<2>(spec);
        });
    test::for_each_spec(fits(Projection::imls), [](const MethodSpec& spec) {
        if (spec.weight == Weight::cubic) check_linear_field<3>(spec);
    });
}

template <int D>
void check_polynomial_field(MethodSpec spec, int degree)
{
    spec.degree = degree;
    SCOPED_TRACE("degree " + std::to_string(degree));
    Random random(12);
    const PolynomialVector<D> v(random, degree);
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 4 : 8, spec));
    State<D> s = start(method, {0.0, 1.0, D == 3 ? 2 : 3});
    set_velocities(s.particles, 0, s.particles.count, v, method.model().h);
    method.project(s);
    expect_velocities(s, v, 1e-11);
    EXPECT_EQ(s.projection.fit.dropped, 0);
}

TEST(VelocityFit, PolynomialsOfItsDegreeAreReproduced)
{
    for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3})
        for (Projection projection : {Projection::mls, Projection::imls}) {
            MethodSpec spec = fit_spec(projection, basis);
            MethodSpec cell = spec;
            cell.domain     = Domain::cell;
            cell.samples    = Samples::corners;  // which have velocities of their own
            for (int degree = 0; degree <= 3; ++degree) {
                check_polynomial_field<1>(spec, degree);
                check_polynomial_field<2>(spec, degree);
                check_polynomial_field<2>(cell, degree);
                if (projection == Projection::imls) check_polynomial_field<3>(spec, degree);
            }
        }
}

/// Particles on a line or plane that crosses the grid: the last axis is not determined. The linear field is known on it.
template <int D>
void check_flat(Projection projection)
{
    const Explicit<D> method(test::unit_box<D>(8, fit_spec(projection)));
    const double h = method.model().h[0];
    Random random(13);
    const Linear<D> v(random);
    auto onto = [](Vec<D> x) {
        x[D - 1] = 0.4;
        for (int a = 0; a < D - 1; ++a) x[D - 1] += 0.2 * x[a];
        return x;
    };
    std::vector<Seed<D>> seeds;
    for (Seed<D> seed : test::block(method.model(), 0.0, 1.0, 2)) {
        if (seed.x[D - 1] > h / 2) continue;  // one layer
        seed.x = onto(seed.x);
        seeds.push_back(seed);
    }
    State<D> s = method.start(plant_all(method.model(), seeds));
    set_velocities(s.particles, 0, s.particles.count, v, method.model().h);
    method.project(s);
    int nodes = 0;
    for_each_node_with_mass(s, [&](const Lanes&, const Vec<D>&) { ++nodes; });
    EXPECT_GT(nodes, 16);
    EXPECT_EQ(s.projection.fit.dropped, nodes);
    if (projection == Projection::imls) {
        EXPECT_EQ(s.projection.fit.fallback, 0);
        expect_velocities(
            s, [&](const Vec<D>& x) { return v(onto(x)); }, 1e-11);
        return;
    }
    EXPECT_EQ(s.projection.fit.fallback, nodes);
    auto mean = [&](const Vec<D>& x) {
        Vec<D> sum{};
        double weights = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            double w = 1;
            for (int a = 0; a < D; ++a) w *= spline_weight<4>((s.particles.x[i][a] - x[a]) / h);
            sum += w * s.particles.v[i];
            weights += w;
        }
        return sum * (1 / weights);
    };
    expect_velocities(s, mean, 1e-13);
}
TEST(VelocityFit, OfParticlesOnAPlane)
{
    check_flat<2>(Projection::imls);
    check_flat<2>(Projection::mls);
    check_flat<3>(Projection::imls);
    check_flat<3>(Projection::mls);
}

template <int D>
struct Sample {
    Vec<D> x, v;
};

/// The samples of a method; shared corners once.
template <int D>
std::vector<Sample<D>> samples_of(const MethodSpec& spec, const Particles<D>& p)
{
    std::vector<Sample<D>> r;
    for (int i = 0; i < p.count; ++i) r.push_back({p.x[i], p.v[i]});
    if (spec.samples == Samples::particles) return r;
    for (std::size_t c = 0; c < p.corner.size(); ++c) r.push_back({p.corner[c], p.corner_velocity[c]});
    for (int i = 0; i < p.count && p.corner.empty(); ++i)
        IndexBox<D>{{}, Index<D>::filled(2)}.for_each([&](const Index<D>& side) {
            Vec<D> arm{};
            for (int a = 0; a < D; ++a)
                if (spec.domain == Domain::box)
                    arm[a] = (2 * side[a] - 1) * p.half[i][a];
                else
                    arm += (2.0 * side[a] - 1) * column(p.edges[i], a);
            r.push_back({p.x[i] + arm, p.v[i] + p.L[i] * arm});
        });
    return r;
}

/// Adds a velocity along x that grows with x^3, and what particles carry of its gradient: near x = 1 slopes explain most of all
/// velocities.
template <int D>
void add_slope(Particles<D>& p)
{
    constexpr double size = 300.0;
    for (int i = 0; i < p.count; ++i) {
        p.v[i][0] += size * p.x[i][0] * p.x[i][0] * p.x[i][0];
        if (!p.L.empty()) p.L[i](0, 0) += 3 * size * p.x[i][0] * p.x[i][0];
    }
    for (std::size_t c = 0; c < p.corner.size(); ++c)
        p.corner_velocity[c][0] += size * p.corner[c][0] * p.corner[c][0] * p.corner[c][0];
}

/// What limiter slope takes of a fit: 0 where its slopes explain at most 16 times what they leave of the variance of samples, 1 from 64
/// times on, and where they leave nothing.
template <int D>
double part_of_slopes(const std::vector<std::pair<Sample<D>, double>>& weighted, const std::function<Vec<D>(const Vec<D>&)>& fit)
{
    double weights = 0, squares = 0, explained = 0, left = 0;
    Vec<D> mean{};
    for (const auto& [sample, w] : weighted) {
        weights += w;
        mean += w * sample.v;
        squares += w * dot(sample.v, sample.v);
    }
    for (const auto& [sample, w] : weighted) {
        const Vec<D> fitted = fit(sample.x);
        explained += w * dot(fitted - mean * (1 / weights), fitted - mean * (1 / weights));
        left += w * dot(sample.v - fitted, sample.v - fitted);
    }
    return left <= 1e-13 * squares || explained >= 64 * left ? 1.0 : std::max(0.0, (explained / left - 16) / 48);
}

/// Nodes that took none of their fit, a part, all.
struct LimitedNodes {
    int none = 0, some = 0, all = 0;
};

/// Every node against a sum over all samples; particles in part of the box only, so that some nodes have few.
template <int D, int degree, int W>
void check_against_plain_fit(MethodSpec spec, bool is_periodic, LimitedNodes& limited)
{
    using M               = Moments<D, degree, D>;
    const bool is_limited = spec.limiter == Limiter::slope;
    SCOPED_TRACE(test::describe(spec) + ", degree " + std::to_string(degree) + (is_periodic ? ", periodic" : ""));
    spec.degree    = degree;
    spec.weight    = W == 2 ? Weight::hat : W == 3 ? Weight::quadratic : Weight::cubic;
    Model<D> model = test::unit_box<D>(D == 3 ? 6 : 8, spec);
    model.periodic = Vec<D, bool>::filled(false);
    if (is_periodic) model.periodic[0] = true;
    const Explicit<D> method(model);
    Random random(14);
    Body<D> body{0.0, 1.0};
    body.is_cut = [&](const Vec<D>& x) {
        return (D > 1 && (x[D - 1] < 0.3 || x[D - 1] > 0.8)) || uniform(random, 0, 1) < (D == 1 ? 0.5 : W == 2 ? 0.85 : 0.7);
    };
    State<D> s = start_at_random(method, body, random);
    if (is_limited) add_slope(s.particles);
    method.project(s);

    const Lattice<D>& g = s.lattice;
    std::vector<Lanes> sums(s.field.nodes.size());
    for (int i = 0; i < s.particles.count; ++i)
        visit<D>(spec, s, s.particles.view(), i, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            sums[node][NodeLane::mass] += w * s.particles.m[i];
            for (int a = 0; a < D; ++a) sums[node][NodeLane::velocity + a] += w * s.particles.m[i] * s.particles.v[i][a];
        });
    const auto samples = samples_of(spec, s.particles);
    FitReport expected;
    double error = 0;
    int nodes = 0, in_doubt = 0;
    for_each_node_with_mass(s, [&](const Lanes& node, const Vec<D>& x) {
        ++nodes;
        Lanes record[M::size]{};
        std::vector<std::pair<Sample<D>, double>> weighted;
        for (const Sample<D>& sample : samples) {
            Vec<D> d{};
            double w = 1;
            for (int a = 0; a < D; ++a) {
                d[a] = (sample.x[a] - x[a]) * g.inv_h[a];
                if (g.periodic[a]) d[a] -= g.cells[a] * std::round(d[a] / g.cells[a]);
                w *= spline_weight<W>(d[a]);
            }
            if (!(w > 0)) continue;
            M::add(record, d, w, sample.v.c);
            weighted.push_back({{d, sample.v}, w});
        }
        const std::ptrdiff_t n = &node - s.field.nodes.data();
        Vec<D> v               = velocity<D>(sums[n]) * (1 / sums[n][NodeLane::mass]);
        if (!(M::weight(record) > 0)) {
            ++expected.fallback;
        } else {
            double m[M::unknowns][M::unknowns], b[M::unknowns];
            M::matrix(record, m);
            const Ldl<M::unknowns> system(m);
            expected.dropped += system.dropped;
            // A pivot near the tolerance, or one that follows it, is made of round-off: kept in one sum, dropped in another.
            double smallest = 1;
            for (int k = 0; k < M::unknowns; ++k)
                if (system.D[k] > 0) smallest = std::min(smallest, system.D[k] / m[k][k]);
            if (smallest < 1e-5) {
                ++in_doubt;
                return;
            }
            const bool is_mean = spec.projection == Projection::mls && system.dropped > 0;
            expected.fallback += is_mean;
            const Vec<D> by_mass = v;
            double coefficients[D][M::unknowns];
            for (int a = 0; a < D; ++a) {
                M::right_side(record, a, b);
                system.solve(b);
                std::copy(b, b + M::unknowns, coefficients[a]);
                v[a] = is_mean ? M::mean(record, a) : b[0];
            }
            if (is_limited && !is_mean) {
                const double part = part_of_slopes<D>(weighted, [&](const Vec<D>& d) {
                    double p[M::unknowns];
                    Monomials<D, degree>::evaluate(d, p);
                    Vec<D> r{};
                    for (int a = 0; a < D; ++a)
                        for (int k = 0; k < M::unknowns; ++k) r[a] += coefficients[a][k] * p[k];
                    return r;
                });
                v                 = part * v + (1 - part) * by_mass;
                ++(part == 0 ? limited.none : part == 1 ? limited.all : limited.some);
            }
        }
        // Few samples give large velocities, and as large errors of round-off.
        error = std::max(error, norm(velocity<D>(node) - v) / (1 + norm(v)));
    });
    EXPECT_LT(error, 1e-9);
    EXPECT_LE(in_doubt, 0.2 * nodes);
    EXPECT_LE(std::labs(s.projection.fit.dropped - expected.dropped), in_doubt * (M::unknowns - 1));
    EXPECT_LE(std::labs(s.projection.fit.fallback - expected.fallback), in_doubt);
    if (degree > 0 && W == 2 && spec.samples == Samples::particles) {
        EXPECT_GT(expected.dropped, 0) << "no node with few samples";
    }
}

TEST(VelocityFit, EqualsThePlainSum)
{
    LimitedNodes limited;
    for (Projection projection : {Projection::mls, Projection::imls})
        for (const MethodSpec& spec : fits(projection)) {
            if (spec.weight != Weight::cubic) continue;  // set below
            for (bool is_periodic : {false, true}) {
                check_against_plain_fit<1, 1, 4>(spec, is_periodic, limited);
                check_against_plain_fit<2, 1, 2>(spec, is_periodic, limited);
                check_against_plain_fit<2, 1, 3>(spec, is_periodic, limited);
                if (spec.limiter == Limiter::slope) continue;  // of linear fits
                check_against_plain_fit<2, 0, 2>(spec, is_periodic, limited);
                check_against_plain_fit<2, 2, 4>(spec, is_periodic, limited);
            }
            if (spec.basis != Basis::bspline3 && projection == Projection::imls)
                check_against_plain_fit<3, 1, 4>(spec, true, limited);
        }
    EXPECT_GT(limited.none, 100);
    EXPECT_GT(limited.some, 100);
    EXPECT_GT(limited.all, 100);
}

// ---- quadrature cell -------------------------------------------------------------------------------------------------

/// Sets density, stress and body force of the particles to given fields.
template <int D, class Scalar>
void set_fields(Particles<D>& p, const Scalar& density, const std::vector<Polynomial<D>>& stress)
{
    for (int i = 0; i < p.count; ++i) {
        p.m[i] = density(p.x[i]) * p.V[i];
        int k  = 0;
        for (int a = 0; a < D; ++a)
            for (int b = a; b < D; ++b) p.sigma[i](a, b) = p.sigma[i](b, a) = stress[k++](p.x[i]);
    }
}

template <int D>
std::vector<Polynomial<D>> random_stress(Random& random, int degree)
{
    std::vector<Polynomial<D>> r;
    for (int k = 0; k < D * (D + 1) / 2; ++k) r.emplace_back(random, degree);
    return r;
}

template <int D>
void set_body_force(Model<D>& model, const PolynomialVector<D>& b)
{
    model.body_force_kernel = [b](const ParticleView<D>& p, std::ptrdiff_t begin, std::ptrdiff_t end, double) {
        for (std::ptrdiff_t i = begin; i < end; ++i) p.b[i] = b(p.x[i]);
    };
}

/// The quadrature points have the fields.
template <int D, class Scalar>
void expect_fields(State<D>& s, const Scalar& density, const std::vector<Polynomial<D>>& stress, const PolynomialVector<D>& b)
{
    const ParticleView<D> q = s.points.view();
    ASSERT_NE(q.b, nullptr);
    double error = 0;
    for (int k = 0; k < q.count; ++k) {
        error  = std::max(error, std::fabs(q.m[k] / (q.V[k] * density(q.x[k])) - 1));
        error  = std::max(error, norm(q.b[k] - b(q.x[k])));
        int at = 0;
        for (int c = 0; c < D; ++c)
            for (int d = c; d < D; ++d, ++at) {
                error = std::max(error, std::fabs(q.sigma[k](c, d) - stress[at](q.x[k])));
            }
    }
    EXPECT_LT(error, 1e-12);
}

/// The cells of the grid that hold particles, by the offset of their lower node.
template <int D>
std::set<std::ptrdiff_t> cells_of(const Lattice<D>& g, const Vec<D>* x, int count)
{
    std::set<std::ptrdiff_t> r;
    for (int i = 0; i < count; ++i) {
        Index<D> cell{};
        for (int a = 0; a < D; ++a) cell[a] = static_cast<int>(std::floor(g.cell_coordinate(a, x[i][a])));
        r.insert(g.offset(cell));
    }
    return r;
}

template <int D>
void check_linear_cells(const MethodSpec& spec)
{
    Random random(15);
    const Polynomial<D> slope(random, 1);
    auto density = [&](const Vec<D>& x) { return 1000 * (5 + slope(x)); };
    const PolynomialVector<D> b(random, 1);
    const auto stress = random_stress<D>(random, 1);
    Model<D> model    = test::unit_box<D>(D == 3 ? 6 : 8, spec);
    set_body_force(model, b);
    const Explicit<D> method(model);
    const double h = model.h[0];
    for (const Body<D>& body :
         std::vector<Body<D>>{{0.0, 1.0}, {0.0, 3 * h}, {2 * h, 4 * h}, {1.5 * h, 4.5 * h}, {0.0, 2.5 * h, 4}}) {
        SCOPED_TRACE("body from " + std::to_string(body.low) + " to " + std::to_string(body.high));
        State<D> s = start(method, body);
        set_fields(s.particles, density, stress);
        method.project(s);
        expect_fields(s, density, stress, b);
        EXPECT_EQ(cells_of(s.lattice, s.points.x.data(), s.points.count),
                  cells_of(s.lattice, s.particles.x.data(), s.particles.count));
        EXPECT_EQ(static_cast<std::size_t>(s.points.count), cells_of(s.lattice, s.particles.x.data(), s.particles.count).size());
        double volume = 0, mass = 0, expected = 0;
        for (int k = 0; k < s.points.count; ++k) {
            volume += s.points.V[k];
            mass += s.points.m[k];
        }
        for (int i = 0; i < s.particles.count; ++i) expected += s.particles.m[i];
        // A cell that the body fills has its mass, for the density is linear; a part of a cell has it at its centroid.
        const bool ends_on_faces = std::fabs(std::remainder(body.high, h)) < 1e-9;
        if (ends_on_faces || spec.cell_volume == CellVolume::filled) {
            EXPECT_NEAR(mass, expected, 1e-12 * expected);
        } else {
            EXPECT_GT(volume, std::pow(body.high - body.low, D) * 1.1);
        }
        EXPECT_NEAR(s.projection.mass_after, mass, 1e-12 * mass);
    }
}
TEST(CellQuadrature, LinearFieldsAreExact)
{
    for (CellVolume volume : {CellVolume::full, CellVolume::filled})
        for (Basis basis : {Basis::hat, Basis::bspline2}) {
            MethodSpec spec  = fit_spec(Projection::mls, basis);
            spec.quadrature  = Quadrature::cell;
            spec.cell_volume = volume;
            SCOPED_TRACE(test::describe(spec));
            check_linear_cells<1>(spec);
            check_linear_cells<2>(spec);
            if (basis == Basis::hat) check_linear_cells<3>(spec);
        }
}

/// A bar that ends a quarter into a cell: full cells count three quarters of a cell too much, h/L of the mass.
TEST(CellQuadrature, MassOfABodyThatEndsInsideACell)
{
    auto error = [](CellVolume volume, int cells) {
        MethodSpec spec  = fit_spec(Projection::mls);
        spec.quadrature  = Quadrature::cell;
        spec.cell_volume = volume;
        const Explicit<1> method(test::unit_box<1>(cells, spec));
        State<1> s = start(method, {0.0, 0.5 + 0.25 / cells, 4});
        for (int i = 0; i < s.particles.count; ++i) s.particles.m[i] *= std::exp(s.particles.x[i][0]);
        const ProjectionReport& r = method.project(s);
        return std::fabs(r.mass_after / r.mass_before - 1);
    };
    for (int cells : {16, 32, 64, 128}) {
        const double of_full  = error(CellVolume::full, cells);
        const double expected = std::exp(0.5) / (std::exp(0.5) - 1) * 0.75 / cells;  // density at the end over the mass
        EXPECT_GT(of_full, 0.8 * expected) << cells;
        EXPECT_LT(of_full, 1.2 * expected) << cells;
        EXPECT_LT(error(CellVolume::filled, cells), 0.01 * of_full) << cells;
    }
}

// ---- Taylor least squares --------------------------------------------------------------------------------------------

std::vector<MethodSpec> tls_specs(int degree)
{
    std::vector<MethodSpec> r;
    for (Basis basis : {Basis::hat, Basis::ddmpm, Basis::bspline2})
        for (MassMatrix mass : {MassMatrix::lumped, MassMatrix::consistent})
            for (CellVolume volume : {CellVolume::full, CellVolume::filled}) {
                MethodSpec spec  = tls(basis);
                spec.mass        = mass;
                spec.cell_volume = volume;
                spec.degree      = degree;
                r.push_back(spec);
            }
    return r;
}

template <int D>
void check_tls_keeps(const MethodSpec& spec, bool is_periodic)
{
    Model<D> model = test::unit_box<D>(D == 3 ? 4 : 8, spec);
    if (is_periodic) model.periodic[0] = true;
    const Explicit<D> method(model);
    Random random(16);
    State<D> s                = start_at_random(method, {0.0, 1.0, 3}, random);
    const ProjectionReport& r = method.project(s);
    double mass               = 0;
    Vec<3> momentum{};
    for (int k = 0; k < s.points.count; ++k) {
        mass += s.points.m[k];
        momentum += s.points.m[k] * padded(s.points.v[k]);
    }
    EXPECT_NEAR(mass, r.mass_before, 1e-14 * r.mass_before);
    EXPECT_NEAR(r.mass_after, r.mass_before, 1e-14 * r.mass_before);
    for (int a = 0; a < D; ++a) {
        EXPECT_NEAR(momentum[a], r.momentum_before[a], 1e-14 * r.mass_before);
        // The consistent matrix is solved by iterations, to 1e-13 of each component's norm.
        EXPECT_NEAR(r.momentum_after[a], r.momentum_before[a], (spec.mass == MassMatrix::lumped ? 1e-14 : 1e-12) * r.mass_before);
    }
}
TEST(TaylorQuadrature, MassAndMomentumAreKept)
{
    for (int degree : {1, 2})
        test::for_each_spec(tls_specs(degree), [](const MethodSpec& spec) {
            for (bool is_periodic : {false, true}) {
                check_tls_keeps<1>(spec, is_periodic);
                check_tls_keeps<2>(spec, is_periodic);
            }
        });
    check_tls_keeps<3>(tls(Basis::bspline2), true);
}

/// Particles at the points of a Gauss rule with its weights as volumes, so that their masses sum to the integral of the
/// density: then the fit that keeps the mass of the cell is the plain one, and exact.
template <int D>
void check_quadratic_cells(const MethodSpec& spec)
{
    Random random(17);
    const Polynomial<D> shape(random, 2);
    auto density = [&](const Vec<D>& x) { return 1000 * (12 + shape(x)); };
    const PolynomialVector<D> momentum(random, 2), b(random, 2);
    const auto stress = random_stress<D>(random, 2);
    Model<D> model    = test::unit_box<D>(4, spec);
    set_body_force(model, b);
    const Explicit<D> method(model);
    std::vector<Seed<D>> seeds = Body<D>{0.0, 1.0, 3}.seeds(model);
    for (Seed<D>& seed : seeds)
        for (int a = 0; a < D; ++a) {
            const double cell = std::floor(seed.x[a] / model.h[a]), side = std::round(3 * (seed.x[a] / model.h[a] - cell - 0.5));
            seed.x[a] = (cell + 0.5 + side * 0.5 * std::sqrt(0.6)) * model.h[a];
            seed.volume *= side == 0 ? 4.0 / 3 : 5.0 / 6;
        }
    State<D> s = method.start(plant_all(model, seeds));
    set_fields(s.particles, density, stress);
    for (int i = 0; i < s.particles.count; ++i) s.particles.v[i] = momentum(s.particles.x[i]) * (1 / density(s.particles.x[i]));
    method.project(s);
    expect_fields(s, density, stress, b);
    EXPECT_EQ(s.points.count, power_of(8, D));
    EXPECT_EQ(s.projection.fit.dropped, 0);
    for (int k = 0; k < s.points.count; ++k)
        EXPECT_LT(norm(s.points.v[k] * density(s.points.x[k]) - momentum(s.points.x[k])), 1e-11);
}
TEST(TaylorQuadrature, QuadraticFieldsAreExact)
{
    test::for_each_spec(tls_specs(2), [](const MethodSpec& spec) {
        check_quadratic_cells<1>(spec);
        check_quadratic_cells<2>(spec);
    });
    check_quadratic_cells<3>(tls(Basis::hat));
}

// ---- gradient adjoint ------------------------------------------------------------------------------------------------

/// Masses of the nodes are those that the body leaves; velocities are v there, and elsewhere what must not be used.
template <int D, class Velocity>
void set_nodes(const Explicit<D>& method, State<D>& s, const Velocity& v)
{
    method.project(s);
    for (std::size_t n = 0; n < s.field.nodes.size(); ++n) {
        const bool has_mass = s.field.nodes[n][NodeLane::mass] > 0;
        const Vec<D> at     = v(place_of_node(s.lattice, static_cast<std::ptrdiff_t>(n)));
        for (int a = 0; a < D; ++a) {
            s.field.nodes[n][NodeLane::velocity + a]  = has_mass ? at[a] : 1e6;
            s.field.nodes[n][NodeLane::increment + a] = 0;
        }
    }
}

template <int D>
bool is_in_ball(const Vec<D>& x)
{
    return norm(x - Vec<D>::filled(0.5)) < 0.2;
}

/// From the whole box to a single particle: with walls, free surfaces, a hole, rows thinner than a cell.
template <int D>
std::vector<Body<D>> bodies(double h)
{
    std::vector<Body<D>> r{{0.0, 1.0}, {0.0, 4 * h}, {2 * h, 5 * h}, {1.5 * h, 4.5 * h}, {2 * h, 3 * h}, {2 * h, 2.5 * h}};
    r.push_back({.low = 0.0, .high = 1.0, .is_cut = is_in_ball<D>});
    r.push_back({.low = 0.0, .high = 1.0, .is_cut = [h](const Vec<D>& x) { return x[D - 1] > h; }});
    r.push_back({.low = h, .high = 6 * h, .is_cut = [h](const Vec<D>& x) { return x[D - 1] > 1.5 * h; }});
    return r;
}

MethodSpec adjoint(Basis basis, Domain domain, Quadrature quadrature)
{
    MethodSpec spec = preset("impm-adjoint");
    spec.basis      = basis;
    spec.domain     = domain;
    spec.quadrature = quadrature;
    return spec;
}

template <int D>
void check_linear_gradients(const MethodSpec& spec)
{
    Random random(18);
    const Linear<D> v(random);
    const Explicit<D> method(test::unit_box<D>(8, spec));
    int number = 0;
    for (const Body<D>& body : bodies<D>(method.model().h[0])) {
        SCOPED_TRACE(test::describe(spec) + ", body " + std::to_string(number++));
        State<D> s = start(method, body);
        set_nodes(method, s, v);
        double error = 0;
        for (const Mat<D>& L : gradients(method, s)) error = std::max(error, largest_entry(L - v.A));
        EXPECT_LT(error, 1e-12);
    }
}
TEST(AdjointGradient, OfLinearVelocityIsExact)
{
    for (Quadrature quadrature : {Quadrature::cell, Quadrature::particle})
        for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3}) {
            for (Domain domain : {Domain::point, Domain::box, Domain::parallelepiped}) {
                const MethodSpec spec = adjoint(basis, domain, quadrature);
                check_linear_gradients<1>(spec);
                check_linear_gradients<2>(spec);
            }
            check_linear_gradients<3>(adjoint(basis, Domain::point, quadrature));
        }
}

/// With hats the gradients at centres are exact for quadratic velocities, and stay so where cells are filled and where they
/// go on beyond walls.
template <int D>
void check_quadratic_gradients()
{
    Random random(19);
    const PolynomialVector<D> v(random, 2);
    const Explicit<D> method(test::unit_box<D>(8, adjoint(Basis::hat, Domain::point, Quadrature::particle)));
    const double h = method.model().h[0];
    for (const Body<D>& body :
         std::vector<Body<D>>{{0.0, 1.0}, {0.0, 4 * h}, {1.5 * h, 5.5 * h}, {.low = 0.0, .high = 1.0, .is_cut = is_in_ball<D>}}) {
        SCOPED_TRACE("body from " + std::to_string(body.low) + " to " + std::to_string(body.high));
        State<D> s = start(method, body);
        set_nodes(method, s, v);
        const auto L = gradients(method, s);
        double error = 0;
        for (int i = 0; i < s.particles.count; ++i)
            for (int b = 0; b < D; ++b) {
                Vec<D> d{};
                d[b]               = 0.5;
                const Vec<D> slope = v(s.particles.x[i] + d) - v(s.particles.x[i] - d);
                error              = std::max(error, norm(column(L[i], b) - slope));
            }
        EXPECT_LT(error, 1e-12);
    }
}
TEST(AdjointGradient, OfQuadraticVelocityIsExactWithHats)
{
    check_quadratic_gradients<1>();
    check_quadratic_gradients<2>();
    check_quadratic_gradients<3>();
}

/// Bodies thinner than two cells do not determine how gradients go on beside them: particles take that of their functions.
template <int D>
void check_thin_bodies(Basis basis)
{
    const MethodSpec spec = adjoint(basis, Domain::point, Quadrature::particle);
    const Explicit<D> method(test::unit_box<D>(8, spec));
    const double h = method.model().h[0];
    Random random(21);
    std::vector<Body<D>> thin{{2 * h, 3 * h}, {2 * h, 2.5 * h}};
    if (D > 1) thin.push_back({.low = h, .high = 6 * h, .is_cut = [h](const Vec<D>& x) { return x[D - 1] > 1.5 * h; }});
    for (const Body<D>& body : thin) {
        SCOPED_TRACE(test::describe(spec) + ", body to " + std::to_string(body.high));
        State<D> s = start(method, body);
        set_nodes(method, s, [&](const Vec<D>&) {
            Vec<D> v{};
            for (int a = 0; a < D; ++a) v[a] = uniform(random, -1, 1);
            return v;
        });
        const auto L = gradients(method, s);
        for (int i = 0; i < s.particles.count; ++i) {
            Mat<D> sum{};
            visit<D>(spec, s, s.particles.view(), i,
                     [&](std::ptrdiff_t node, double, const Vec<D>& dw) { sum += outer(velocity<D>(s.field.nodes[node]), dw); });
            EXPECT_LT(largest_entry(L[i] - sum), 1e-12);
        }
    }
}
TEST(AdjointGradient, OfThinBodiesIsThatOfTheFunctions)
{
    check_thin_bodies<1>(Basis::hat);
    check_thin_bodies<2>(Basis::hat);
    check_thin_bodies<3>(Basis::hat);
}

/// Sums written here, of random velocities, where all cells around a particle are known.
template <int D>
void check_gradients_against_plain_sum(Basis basis, bool is_periodic)
{
    const MethodSpec spec = adjoint(basis, Domain::point, Quadrature::particle);
    Model<D> model        = test::unit_box<D>(8, spec);
    if (is_periodic) model.periodic[0] = true;
    const Explicit<D> method(model);
    Random random(20);
    State<D> s = start(method, {0.0, 1.0});
    set_nodes(method, s, [&](const Vec<D>&) {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = uniform(random, -1, 1);
        return v;
    });
    s.field.halo.copy(s.field.nodes.data());
    const auto L = gradients(method, s);
    Particles<D> point(1, {});
    double error = 0;
    int count    = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        const Vec<D> x = s.particles.x[i];
        bool is_inside = true;
        for (int a = 0; a < D; ++a)
            is_inside = is_inside && (s.lattice.periodic[a] || (x[a] > model.h[a] && x[a] < 1 - model.h[a]));
        if (!is_inside) continue;
        ++count;
        Mat<D> sum{};
        IndexBox<D>{Index<D>::filled(-2), Index<D>::filled(3)}.for_each([&](const Index<D>& k) {
            double w = 1;
            for (int a = 0; a < D; ++a) {
                const double center = (std::floor(x[a] / model.h[a]) + k[a] + 0.5) * model.h[a];
                w *= spline_weight<3>((x[a] - center) / model.h[a]);
                point.x[0][a] = s.lattice.periodic[a] ? center - std::floor(center) : center;
            }
            if (!(w > 0)) return;
            visit<D>(spec, s, point.view(), 0, [&](std::ptrdiff_t node, double, const Vec<D>& dw) {
                sum += w * outer(velocity<D>(s.field.nodes[node]), dw);
            });
        });
        error = std::max(error, largest_entry(L[i] - sum));
    }
    EXPECT_LT(error, 1e-12);
    EXPECT_GT(count, 10);
}
TEST(AdjointGradient, EqualsThePlainSum)
{
    for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3})
        for (bool is_periodic : {false, true}) {
            check_gradients_against_plain_sum<1>(basis, is_periodic);
            check_gradients_against_plain_sum<2>(basis, is_periodic);
            check_gradients_against_plain_sum<3>(basis, is_periodic);
        }
}

// ---- particles that carry a field ------------------------------------------------------------------------------------

std::vector<MethodSpec> carriers(Projection projection, const std::vector<Basis>& bases_of_points)
{
    std::vector<MethodSpec> r;
    for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3})
        for (Domain domain : {Domain::point, Domain::box, Domain::parallelepiped, Domain::cell}) {
            if (domain == Domain::point && std::count(bases_of_points.begin(), bases_of_points.end(), basis) == 0) continue;
            r.push_back({.basis = basis, .domain = domain, .projection = projection});
            if (projection == Projection::affine) r.back().update = Update::apic;
        }
    return r;
}
std::vector<MethodSpec> affine_specs() { return carriers(Projection::affine, {Basis::bspline2, Basis::bspline3}); }

/// Nodes have the linear field of the particles, at free surfaces too, and the particles get it back.
template <int D>
void check_affine_field(const MethodSpec& spec)
{
    Random random(22);
    const Linear<D> v(random);
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 4 : 8, spec));
    const Passes<D> passes = choose_passes<D>(spec);
    const double h         = method.model().h[0];
    for (const Body<D>& body : std::vector<Body<D>>{{0.0, 1.0}, {0.0, 2.5 * h}, {1.5 * h, 3 * h}}) {
        SCOPED_TRACE("body from " + std::to_string(body.low) + " to " + std::to_string(body.high));
        State<D> s = start(method, body);
        set_velocities(s.particles, 0, s.particles.count, v, method.model().h);
        method.project(s);
        expect_velocities(s, v, 1e-11);
        for (int i = 0; i < s.particles.count; ++i) {
            s.particles.v[i] = {};
            s.particles.L[i] = {};
        }
        for (Lanes& n : s.field.nodes)
            for (int a = 0; a < D; ++a) n[NodeLane::increment + a] = 0;
        ASSERT_NE(passes.keep, nullptr);
        gather_all(method, s, passes.keep);
        gather_all(method, s, passes.update_velocity, 0, 1);
        double error = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            error = std::max(error, norm(s.particles.v[i] - v(s.particles.x[i])));
            error = std::max(error, largest_entry(s.particles.L[i] - v.A));
        }
        EXPECT_LT(error, 1e-10);  // gradients that are set are differences, and lose four digits
    }
}
TEST(Affine, LinearFieldGoesToNodesAndBack)
{
    std::vector<MethodSpec> specs = affine_specs();
    for (const MethodSpec& spec : carriers(Projection::gradient_enhanced, {Basis::hat, Basis::bspline2, Basis::bspline3}))
        specs.push_back(spec);
    test::for_each_spec(specs, [](const MethodSpec& spec) {
        check_affine_field<1>(spec);
        check_affine_field<2>(spec);
        check_affine_field<3>(spec);
    });
}

/// What points leave at the nodes and take from them equals the plain sums over nodes, inside and at faces.
template <int D, class Basis>
void check_affine_passes(MethodSpec spec)
{
    SCOPED_TRACE(test::describe(spec));
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 6 : 8, spec));
    const Passes<D> passes = choose_passes<D>(spec);
    Random random(28);
    State<D> s       = start_at_random(method, {0.0, 1.0}, random);
    auto nodes_after = [&](auto pass) {
        clear(s.field.nodes.data(), s.field.tiles);
        s.field.tiles.for_each_by_colour([&](const Tile& t) { pass(sweep(method, s), t.begin, t.end); });
        return std::vector<Lanes>(s.field.nodes.begin(), s.field.nodes.end());
    };
    const std::vector<Lanes> plain = nodes_after(project_affine<Point<D, Basis>>), fast = nodes_after(passes.project);
    double error = 0, size = 0;
    for (std::size_t i = 0; i < plain.size(); ++i)
        for (int a = 0; a < NodeLane::end; ++a) {
            error = std::max(error, std::fabs(plain[i][a] - fast[i][a]));
            size  = std::max(size, std::fabs(plain[i][a]));
        }
    EXPECT_LT(error, 1e-14 * size);

    set_nodes(method, s, [&](const Vec<D>&) {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = uniform(random, -1, 1);
        return v;
    });
    auto matrices_after = [&](auto pass) {
        gather_all(method, s, pass);
        return std::vector<Mat<D>>(s.particles.L.begin(), s.particles.L.begin() + s.particles.count);
    };
    const std::vector<Mat<D>> L      = matrices_after(keep_affine<Point<D, Basis>>);
    const std::vector<Mat<D>> L_fast = matrices_after(passes.keep);
    error = size = 0;
    for (std::size_t i = 0; i < L.size(); ++i) {
        error = std::max(error, largest_entry(L[i] - L_fast[i]));
        size  = std::max(size, largest_entry(L[i]));
    }
    EXPECT_LT(error, 1e-12 * size);
}
TEST(Affine, PassesOfPointsEqualThePlainOnes)
{
    for (const char* name : {"apic", "mls-mpm"})
        for (const Basis basis : {Basis::bspline2, Basis::bspline3}) {
            MethodSpec spec = preset(name);
            spec.basis      = basis;
            auto check      = [&]<class B>(B) {
                check_affine_passes<1, B>(spec);
                check_affine_passes<2, B>(spec);
                check_affine_passes<3, B>(spec);
            };
            basis == Basis::bspline2 ? check(BSpline<2>{}) : check(BSpline<3>{});
        }
}

/// x (x) y - y (x) x: the angular momentum of a momentum y at x, in any dimension.
template <int D>
Mat<D> moment(const Vec<D>& x, const Vec<D>& y)
{
    return outer(x, y) - outer(y, x);
}

/// Of the particles: orbital, and of the affine part sum_i w m (x_i - x_p) x C (x_i - x_p).
template <int D>
Mat<D> angular_momentum_of_particles(const MethodSpec& spec, State<D>& s)
{
    Mat<D> r{};
    const ParticleView<D> p = s.particles.view();
    for (int i = 0; i < p.count; ++i) {
        r += p.m[i] * moment(p.x[i], p.v[i]);
        visit<D>(spec, s, p, i, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            const Vec<D> d = place_of_node(s.lattice, node) - p.x[i];
            r += w * p.m[i] * moment(d, p.L[i] * d);
        });
    }
    return r;
}
template <int D>
Mat<D> angular_momentum_of_nodes(State<D>& s)
{
    Mat<D> r{};
    for_each_node_with_mass(
        s, [&](const Lanes& node, const Vec<D>& x) { r += node[NodeLane::mass] * moment(x, velocity<D>(node)); });
    return r;
}

template <int D>
void check_angular_momentum(const MethodSpec& spec)
{
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 6 : 8, spec));
    const Passes<D> passes = choose_passes<D>(spec);
    Random random(23);
    // Domains that overhang the grid have no nodes of splines there; points come up to its faces.
    const double low          = spec.domain == Domain::point ? 0.0 : method.model().h[0];
    State<D> s                = start_at_random(method, {low, 1.0 - low}, random);
    const Mat<D> before       = angular_momentum_of_particles(spec, s);
    const ProjectionReport& r = method.project(s);
    const Mat<D> nodes        = angular_momentum_of_nodes(s);
    EXPECT_LT(largest_entry(nodes - before), 1e-14 * r.mass_before);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(r.momentum_after[a], r.momentum_before[a], 1e-14 * r.mass_before);
    EXPECT_GT(largest_entry(nodes), 1e-4 * r.mass_before);

    for (Lanes& n : s.field.nodes)
        for (int a = 0; a < D; ++a) n[NodeLane::increment + a] = 0;
    gather_all(method, s, passes.keep);
    gather_all(method, s, passes.update_velocity, 0, 1);
    EXPECT_LT(largest_entry(angular_momentum_of_particles(spec, s) - nodes), 1e-14 * r.mass_before);
}
TEST(Affine, AngularMomentumIsKept)
{
    test::for_each_spec(affine_specs(), [](const MethodSpec& spec) {
        check_angular_momentum<2>(spec);
        check_angular_momentum<3>(spec);
    });
}

/// Where functions reproduce linear fields L_p adds no momentum.
template <int D>
void check_momentum_of_gradients(const MethodSpec& spec)
{
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 6 : 8, spec));
    Random random(24);
    const double low          = spec.domain == Domain::point ? 0.0 : method.model().h[0];
    State<D> s                = start_at_random(method, {low, 1.0 - low}, random);
    const ProjectionReport& r = method.project(s);
    EXPECT_NEAR(r.mass_after, r.mass_before, 1e-14 * r.mass_before);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(r.momentum_after[a], r.momentum_before[a], 1e-14 * r.mass_before);
}
TEST(GradientEnhanced, MomentumIsKept)
{
    test::for_each_spec(carriers(Projection::gradient_enhanced, {Basis::hat, Basis::bspline2, Basis::bspline3}),
                        [](const MethodSpec& spec) {
                            check_momentum_of_gradients<1>(spec);
                            check_momentum_of_gradients<2>(spec);
                            check_momentum_of_gradients<3>(spec);
                        });
}

/// Gradient affine: B_p D_p^-1 of any nodal velocities, A of linear ones, and forces whose power is that of the stresses.
template <int D>
void check_affine_gradient(Basis basis)
{
    MethodSpec spec = preset("mls-mpm");
    spec.basis      = basis;
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 4 : 8, spec));
    const Passes<D> passes = choose_passes<D>(spec);
    Random random(25);
    State<D> s = start_at_random(method, {0.0, 1.0}, random);
    const Linear<D> v(random);
    set_nodes(method, s, v);
    double error = 0;
    for (const Mat<D>& L : gradients(method, s)) error = std::max(error, largest_entry(L - v.A));
    EXPECT_LT(error, 1e-12);

    s = start_at_random(method, {0.0, 1.0}, random);
    clear(s.field.nodes.data(), s.field.tiles);
    s.field.tiles.for_each_by_colour([&](const Tile& t) { passes.force(sweep(method, s), t.begin, t.end); });
    double power_of_nodes = 0, power_of_stress = 0, size = 0;
    for (Lanes& n : s.field.nodes)
        for (int a = 0; a < D; ++a) {
            n[NodeLane::velocity + a] = uniform(random, -1, 1);
            power_of_nodes += n[NodeLane::velocity + a] * n[NodeLane::increment + a];
        }
    const std::vector<Stress<D>> sigma(s.particles.sigma.begin(), s.particles.sigma.end());
    const std::vector<double> V(s.particles.V.begin(), s.particles.V.end());
    const auto L = gradients(method, s);
    error        = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        power_of_stress += V[i] * ddot(in_plane(sigma[i]), L[i]);
        size += V[i] * std::fabs(ddot(in_plane(sigma[i]), L[i]));
        Mat<D> B{}, inertia{};
        visit<D>(spec, s, s.particles.view(), i, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
            const Vec<D> d = place_of_node(s.lattice, node) - s.particles.x[i];
            B += w * outer(velocity<D>(s.field.nodes[node]), d);
            inertia += w * outer(d, d);
        });
        error = std::max(error, largest_entry(L[i] - B * inverse(inertia)));
    }
    EXPECT_LT(error, 1e-11);
    EXPECT_NEAR(power_of_nodes, -power_of_stress, 1e-13 * size);
}
TEST(Affine, GradientAndForcesAreAdjoint)
{
    for (Basis basis : {Basis::bspline2, Basis::bspline3}) {
        check_affine_gradient<1>(basis);
        check_affine_gradient<2>(basis);
        check_affine_gradient<3>(basis);
    }
}

/// Nodal velocities survive the way to particles and back, where the particles' polynomials hold them: products of
/// polynomials of the degree along each axis, of quadratic splines at degree 2 any values.
template <int D>
void check_round_trip(Basis basis, int degree)
{
    MethodSpec spec = preset("polypic");
    spec.basis      = basis;
    spec.degree     = degree;
    SCOPED_TRACE(test::describe(spec) + ", degree " + std::to_string(degree));
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 4 : 8, spec));
    const Passes<D> passes = choose_passes<D>(spec);
    Random random(26);
    State<D> s         = start_at_random(method, {0.0, 1.0}, random);
    const bool is_any  = basis == Basis::bspline2 && degree == 2;
    auto random_vector = [&] {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = uniform(random, -1, 1);
        return v;
    };
    std::vector<Vec<D>> coefficient(power_of(degree + 1, D));
    for (Vec<D>& c : coefficient) c = random_vector();
    set_nodes(method, s, [&](const Vec<D>& x) {
        if (is_any) return random_vector();
        Vec<D> v{};
        std::size_t k = 0;
        IndexBox<D>{{}, Index<D>::filled(degree + 1)}.for_each([&](const Index<D>& power) {
            double product = 1;
            for (int a = 0; a < D; ++a) product *= std::pow(x[a], power[a]);
            v += product * coefficient[k++];
        });
        return v;
    });
    const std::vector<Lanes> nodes(s.field.nodes.begin(), s.field.nodes.end());
    gather_all(method, s, passes.keep);
    gather_all(method, s, passes.update_velocity, 0, 1);
    const ProjectionReport& r = method.project(s);
    double error              = 0;
    for_each_node_with_mass(s, [&](const Lanes& node, const Vec<D>&) {
        error = std::max(error, norm(velocity<D>(node) - velocity<D>(nodes[&node - s.field.nodes.data()])));
    });
    EXPECT_LT(error, 1e-11);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(r.momentum_after[a], r.momentum_before[a], 1e-14 * r.mass_before);
}
TEST(Polynomials, NodalFieldsSurviveTheParticles)
{
    for (Basis basis : {Basis::bspline2, Basis::bspline3})
        for (int degree : {1, 2}) {
            check_round_trip<1>(basis, degree);
            check_round_trip<2>(basis, degree);
            check_round_trip<3>(basis, degree);
        }
}

/// Whatever polynomials particles have, they add no momentum.
template <int D>
void check_momentum_of_modes(int degree)
{
    MethodSpec spec = preset("polypic");
    spec.degree     = degree;
    const Explicit<D> method(test::unit_box<D>(D == 3 ? 4 : 8, spec));
    Random random(27);
    State<D> s                = start_at_random(method, {0.0, 1.0}, random);
    const ProjectionReport& r = method.project(s);
    for (int a = 0; a < D; ++a) EXPECT_NEAR(r.momentum_after[a], r.momentum_before[a], 1e-14 * r.mass_before);
}
TEST(Polynomials, MomentumIsKept)
{
    for (int degree : {1, 2}) {
        check_momentum_of_modes<1>(degree);
        check_momentum_of_modes<2>(degree);
        check_momentum_of_modes<3>(degree);
    }
}

// ---- threads and periodic axes ---------------------------------------------------------------------------------------

/// The same bytes for 1, 2 and 3 threads, after several whole steps.
template <int D>
void check_threads(const MethodSpec& spec, int cells, int per_axis)
{
    auto run = [&](int threads) {
        set_thread_count(threads);
        Random random(3);
        const Explicit<D> method(test::unit_box<D>(cells, spec));
        State<D> s = start(method, {0.25, 0.75, per_axis});
        set_velocities(
            s.particles, 0, s.particles.count,
            [&](const Vec<D>& x) {
                Vec<D> v{};
                for (int a = 0; a < D; ++a) v[a] = 2 + 0.1 * std::sin(20 * x[a] + a);
                return v;
            },
            method.model().h);
        for (Vec<D>& v : s.particles.v) v[0] += uniform(random, -0.01, 0.01);
        for (int k = 0; k < 3; ++k) method.step(s, 0.2 * courant_time_step(method.model(), s.particles));
        return s;
    };
    const int before     = thread_count();
    State<D> one         = run(1);
    const auto same_size = [](const auto& f, const auto& g) { return f.size() == g.size(); };
    const auto is_same   = [&](const auto& f, const auto& g) {
        return same_size(f, g) && (f.empty() || std::memcmp(f.data(), g.data(), sizeof(f[0]) * f.size()) == 0);
    };
    EXPECT_GE(one.particles.count, 1500);
    for (int threads : {2, 3}) {
        const State<D> many = run(threads);
        EXPECT_TRUE(is_same(one.particles.x, many.particles.x));
        EXPECT_TRUE(is_same(one.particles.v, many.particles.v));
        EXPECT_TRUE(is_same(one.particles.F, many.particles.F));
        EXPECT_TRUE(is_same(one.particles.sigma, many.particles.sigma));
        EXPECT_TRUE(is_same(one.particles.L, many.particles.L));
        EXPECT_TRUE(is_same(one.particles.modes, many.particles.modes));
        EXPECT_TRUE(is_same(one.particles.corner, many.particles.corner));
        EXPECT_TRUE(is_same(one.particles.corner_velocity, many.particles.corner_velocity));
        EXPECT_EQ(one.projection.fit.dropped, many.projection.fit.dropped);
        EXPECT_EQ(one.projection.fit.fallback, many.projection.fit.fallback);
    }
    set_thread_count(before);
}
TEST(Threads, ReconstructionsAreIdenticalBitForBit)
{
    MethodSpec icpdi2 = preset("icpdi2");
    icpdi2.samples    = Samples::corners;
    test::for_each_spec({preset("cpls"), icpdi2, preset("tls-mpm"), preset("polypic"), preset("apic"),
                         MethodSpec{.projection = Projection::gradient_enhanced}},
                        [](const MethodSpec& spec) { check_threads<2>(spec, 32, 3); });
    check_threads<2>(preset("impm-adjoint"), 64, 2);  // cells enough for threads
    check_threads<3>(preset("impm-adjoint"), 12, 2);
}

/// A body that fills a period, moved by half of it: what meets at the seam was in the middle.
void check_moved_body(const MethodSpec& spec)
{
    auto run = [&](double shift) {
        Model<2> model = test::unit_box<2>(8, spec);
        model.periodic = {true, false};
        const Explicit<2> method(model);
        Body<2> body{0.0, 1.0, 3};
        body.is_cut                = [](const Vec<2>& x) { return x[1] < 0.25 || x[1] > 0.75; };
        std::vector<Seed<2>> seeds = body.seeds(model);
        for (Seed<2>& seed : seeds) seed.x[0] += shift + 0.013;
        State<2> s  = method.start(plant_all(model, seeds));
        auto wobble = [&](const Vec<2>& x) {
            const double angle = 2 * std::numbers::pi * (x[0] - shift);
            return Vec<2>{1 + 0.05 * std::sin(angle), 0.05 * std::cos(angle + 3 * x[1])};
        };
        set_velocities(s.particles, 0, s.particles.count, wobble, model.h);
        for (int k = 0; k < 10; ++k) method.step(s, 0.2 * courant_time_step(model, s.particles));
        std::vector<std::pair<Vec<2>, Mat<2>>> r(s.particles.x.size());
        for (int i = 0; i < s.particles.count; ++i) r[s.particles.id[i]] = {s.particles.v[i], in_plane(s.particles.sigma[i])};
        return r;
    };
    const auto here = run(0.0), there = run(0.5);
    ASSERT_EQ(here.size(), there.size());
    double error = 0, size = 0;
    for (std::size_t i = 0; i < here.size(); ++i) {
        error = std::max(error, norm(here[i].first - there[i].first));
        error = std::max(error, largest_entry(here[i].second - there[i].second) / 1000);
        size  = std::max(size, largest_entry(here[i].second));
    }
    EXPECT_LT(error, 1e-12);
    EXPECT_GT(size, 1.0);
}
TEST(Periodic, BodyMovedByHalfAPeriod)
{
    std::vector<MethodSpec> specs;
    for (const char* name :
         {"cpls", "icpdi2", "impm-adjoint", "imls-mpm", "mls-bsmpm", "tls-mpm", "tls-bsmpm", "apic", "polypic"})
        specs.push_back(preset(name));
    test::for_each_spec(specs, check_moved_body);
}

}  // namespace
}  // namespace ordo
