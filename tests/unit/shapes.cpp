// Weights and gradients of every domain on every basis, over random places and deformations, inside the grid, next to its
// faces and on periodic axes, in 1D, 2D and 3D.
#include "kernels/evolve.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <map>

namespace ordo {
namespace {

enum class Place { inside, wall, periodic };

/// One particle with a domain; `deformation` says how far from its initial domain. At a wall the domain is in the grid and
/// less than two cells from the face along every axis.
template <int D>
struct OneParticle {
    static constexpr int cells = 12;
    MethodSpec spec;
    Lattice<D> lattice;
    Particles<D> p{1, FieldGroups{.box = true, .corners = true, .cells = true}};
    Array<Lanes> nodes;  ///< with mass where the grid is

    static Vec<D> spacing()
    {
        Vec<D> h{};
        for (int a = 0; a < D; ++a) h[a] = 0.1 + 0.03 * a;  // cells that are no cubes
        return h;
    }
    OneParticle(const MethodSpec& method, test::Random& random, double deformation, Place place = Place::inside)
        : spec(method),
          lattice(Vec<D>::filled(-0.3), spacing(), Index<D>::filled(cells), Vec<D, bool>::filled(place == Place::periodic), 6,
                  grid_basis(method)),
          nodes(lattice.node_count())
    {
        for (int a = 0; a < D; ++a) {
            p.half[0][a]      = lattice.h[a] * test::uniform(random, 0.1, 0.25 + deformation);
            p.edges0[0](a, a) = 0.25 * lattice.h[a];
        }
        p.edges[0] = test::random_deformation<D>(random, deformation) * p.edges0[0];
        while (has_cells(spec) && !make_cell(random, deformation)) {}
        Vec<D> x{};
        for (int a = 0; a < D; ++a) {
            const double r = extent(a) * lattice.inv_h[a];
            double y       = test::uniform(random, 4, 8);
            if (place == Place::periodic) y = test::uniform(random, 0, cells);
            if (place == Place::wall) y = std::min(test::uniform(random, r, r + 2), cells - r);
            if (place == Place::wall && random() % 2) y = cells - y;
            x[a] = lattice.origin[a] + y * lattice.h[a];
        }
        shift(x - p.x[0]);
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            const Index<D> at        = lattice.index(static_cast<std::ptrdiff_t>(n));
            nodes[n][NodeLane::mass] = 1;
            for (int a = 0; a < D; ++a)
                if (place != Place::periodic && (at[a] < lattice.margin || at[a] > lattice.margin + cells))
                    nodes[n][NodeLane::mass] = 0;
        }
    }
    ParticleView<D> view() { return p.view(); }
    void shift(const Vec<D>& by)
    {
        p.x[0] += by;
        for (Vec<D>& c : p.corner) c += by;
    }
    CellWeights<D> corner_weights(Vec<D> (&x)[1 << D])
    {
        get_corners(p.cell[0], p.corner.data(), x);
        return (spec.weights == CornerWeights::exact ? exact_weights<D> : mean_weights<D>)(x, p.cell[0].is_simplex());
    }
    /// A cell around the parallelepiped, its corners moved about; false if it has folded.
    bool make_cell(test::Random& random, double deformation)
    {
        CornerPoints<D> points = own_corners();
        for (Vec<D>& c : points.x)
            for (int a = 0; a < D; ++a) c[a] += test::uniform(random, -0.1, 0.1) * std::min(deformation, 0.5) * lattice.h[a];
        CellMesh<D> mesh = weld(std::vector{points});
        if (spec.domain == Domain::simplex) mesh = split(mesh);
        p.cell[0] = mesh.cells.back();
        p.corner  = Array<Vec<D>>(mesh.corners.size());
        std::copy(mesh.corners.begin(), mesh.corners.end(), p.corner.begin());
        Vec<D> x[1 << D];
        const CellWeights<D> k = corner_weights(x);
        p.x[0]                 = centroid<D>(k, x);
        return k.is_sound;
    }
    CornerPoints<D> own_corners() { return corner_points(std::vector{Seed<D>{p.x[0], 1.0, p.edges[0]}})[0]; }
    /// From the particle to the edge of its domain along axis a, m.
    double extent(int a)
    {
        double r = 0;
        if (spec.domain == Domain::box || spec.domain == Domain::stretched_box) return p.half[0][a];
        if (spec.domain == Domain::parallelepiped)
            for (int d = 0; d < D; ++d) r += std::fabs(p.edges[0](a, d));
        if (has_cells(spec))
            for (int c = 0; c < p.cell[0].count(); ++c) r = std::max(r, std::fabs(p.corner[p.cell[0][c]][a] - p.x[0][a]));
        return r;
    }
    Vec<D> position(std::ptrdiff_t node) const
    {
        Vec<D> x{};
        const Index<D> at = lattice.index(node);
        for (int a = 0; a < D; ++a) x[a] = lattice.node_position(a, at[a]);
        return x;
    }
};

template <int D>
struct Weight {
    double w = 0;
    Vec<D> dw{};
};
template <int D>
std::map<std::ptrdiff_t, Weight<D>> weights(OneParticle<D>& one)
{
    std::map<std::ptrdiff_t, Weight<D>> r;
    test::with_shape<D>(one.spec, [&](auto shape) {
        decltype(shape)::type::for_each_node(one.lattice, one.view(), 0, one.nodes.data(),
                                             [&](std::ptrdiff_t node, double w, const Vec<D>& dw) {
                                                 r[node].w += w;
                                                 r[node].dw += dw;
                                             });
    });
    return r;
}
/// The weights of the point x on the basis of `one`.
template <int D>
std::map<std::ptrdiff_t, Weight<D>> point_weights(const OneParticle<D>& one, const Vec<D>& x)
{
    test::Random random(1);
    OneParticle<D> point(test::shape_spec(one.spec.basis, Domain::point), random, 0,
                         one.lattice.periodic[0] ? Place::periodic : Place::inside);
    point.p.x[0] = x;
    return weights(point);
}

/// f(one) for `count` random particles of each shape, place and deformation.
template <int D, class F>
void for_each_particle(int count, F&& f)
{
    test::for_each_spec(test::shapes(), [&](const MethodSpec& spec) {
        test::Random random(7);
        for (Place place : {Place::inside, Place::wall, Place::periodic})
            for (double deformation : {0.0, 0.4, 0.9, 3.0}) {
                const bool is_box = spec.domain == Domain::box || spec.domain == Domain::stretched_box;
                if (deformation > 0 && spec.domain == Domain::point) continue;
                if (deformation > 1 && !is_box) continue;
                for (int k = 0; k < count; ++k) {
                    OneParticle<D> one(spec, random, deformation, place);
                    f(one, random);
                }
            }
    });
}

/// Partition of unity, linear reproduction, sum of gradients zero, sum x_i (x) grad phi_i = I.
template <int D>
void check_moments(OneParticle<D>& one, test::Random&)
{
    double sum = 0;
    Vec<D> x{}, dsum{};
    Mat<D> xdw{};
    for (const auto& entry : weights(one)) {
        const Vec<D> at = one.position(entry.first);
        sum += entry.second.w;
        x += entry.second.w * at;
        dsum += entry.second.dw;
        xdw += outer(at - one.p.x[0], entry.second.dw);
        EXPECT_GE(entry.second.w, 0);
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    for (int a = 0; a < D; ++a) {
        EXPECT_NEAR(x[a], one.p.x[0][a], 1e-12);
        EXPECT_NEAR(dsum[a], 0, 2e-12 / one.lattice.h[a]);
        for (int b = 0; b < D; ++b) EXPECT_NEAR(xdw(a, b), a == b, 2e-12);
    }
}
TEST(Shapes, MomentsIn1D) { for_each_particle<1>(100, check_moments<1>); }
TEST(Shapes, MomentsIn2D) { for_each_particle<2>(50, check_moments<2>); }
TEST(Shapes, MomentsIn3D) { for_each_particle<3>(10, check_moments<3>); }

/// Points and boxes have the derivative of their weight as gradient; of corner domains and ddmpm it is something else.
template <int D>
void check_derivative(OneParticle<D>& one, test::Random&)
{
    if (one.spec.domain == Domain::parallelepiped || has_cells(one.spec) || one.spec.basis == Basis::ddmpm) return;
    const auto exact = weights(one);
    for (int a = 0; a < D; ++a) {
        const double y = one.lattice.cell_coordinate(a, one.p.x[0][a]);
        if (std::fabs(y - std::round(y)) < 1e-3) continue;  // hats have no derivative there
        auto shifted = [&](double by) {
            Vec<D> step{};
            step[a] = by * one.lattice.h[a];
            one.shift(step);
            const auto r = weights(one);
            one.shift(-step);
            return r;
        };
        auto plus = shifted(1e-5), minus = shifted(-1e-5);
        for (const auto& entry : exact)
            EXPECT_NEAR(entry.second.dw[a] * one.lattice.h[a], (plus[entry.first].w - minus[entry.first].w) / 2e-5, 1e-8);
    }
}
TEST(Shapes, GradientsOfPointsAndBoxesAreDerivatives)
{
    for_each_particle<1>(20, check_derivative<1>);
    for_each_particle<2>(10, check_derivative<2>);
    for_each_particle<3>(2, check_derivative<3>);
}

/// phi = sum_c w_c N(x_c), grad phi = sum_c g_c N(x_c). A parallelepiped is a cell of that form, whose weights
/// tests/unit/cells.cpp compares with integrals.
template <int D>
void check_corners(OneParticle<D>& one, test::Random&)
{
    if (one.spec.domain != Domain::parallelepiped && !has_cells(one.spec)) return;
    CornerPoints<D> at{};
    CellWeights<D> k{};
    if (has_cells(one.spec)) {
        k = one.corner_weights(at.x);
    } else {
        at = one.own_corners();
        k  = exact_weights<D>(at.x, false);
    }
    std::map<std::ptrdiff_t, Weight<D>> sum;
    for (int c = 0; c < k.count; ++c)
        for (const auto& entry : point_weights(one, at.x[c])) {
            sum[entry.first].w += k.w[c] * entry.second.w;
            sum[entry.first].dw += entry.second.w * k.g[c];
        }
    double steepest = 0;
    for (int c = 0; c < k.count; ++c) steepest = std::max(steepest, norm(k.g[c]));
    for (const auto& entry : weights(one)) {
        EXPECT_NEAR(entry.second.w, sum[entry.first].w, 1e-13);
        for (int a = 0; a < D; ++a) EXPECT_NEAR(entry.second.dw[a], sum[entry.first].dw[a], 1e-12 * steepest);
    }
}
TEST(Shapes, CornersGiveTheirSums)
{
    for_each_particle<1>(10, check_corners<1>);
    for_each_particle<2>(10, check_corners<2>);
    for_each_particle<3>(3, check_corners<3>);
}

/// Corners that have left the period give the weights of the cell inside it.
TEST(Shapes, CellsOutsideThePeriodAreTheSame)
{
    for (Domain domain : {Domain::cell, Domain::simplex}) {
        test::Random random(3);
        for (int k = 0; k < 50; ++k) {
            OneParticle<2> one(test::shape_spec(Basis::bspline2, domain), random, 0.4, Place::periodic);
            const auto inside  = weights(one);
            const double reach = Cell<2, BSpline<2>, true>::reach(one.lattice, one.view(), Batch{0, 1})[0];
            Turns<2> turns{{2, -3}};
            ParticleView<2> p = one.view();
            p.turns           = &turns;
            for (Vec<2>& c : one.p.corner)
                for (int a = 0; a < 2; ++a) c[a] += turns[a] * one.cells * one.lattice.h[a];
            std::map<std::ptrdiff_t, double> outside;
            Cell<2, BSpline<2>, true>::for_each_node(one.lattice, p, 0, nullptr,
                                                     [&](std::ptrdiff_t node, double w, const Vec<2>&) { outside[node] += w; });
            for (const auto& entry : inside) EXPECT_NEAR(entry.second.w, outside[entry.first], 1e-12);
            EXPECT_NEAR((Cell<2, BSpline<2>, true>::reach(one.lattice, p, Batch{0, 1})[0]), reach, 1e-12);
        }
    }
}

/// No weight lies further from the particle than `reach` and half the width of a function.
template <int D>
void check_reach(OneParticle<D>& one, test::Random&)
{
    double reach = 0;
    test::with_shape<D>(one.spec, [&](auto shape) {
        reach = decltype(shape)::type::reach(one.lattice, one.view(), Batch{0, 1})[0];
    });
    for (int a = 0; a < D; ++a) EXPECT_LE(one.extent(a), reach * one.lattice.h[a] + 1e-12);
    for (const auto& entry : weights(one)) {
        if (entry.second.w == 0 && norm(entry.second.dw) == 0) continue;
        const Vec<D> away = one.position(entry.first) - one.p.x[0];
        for (int a = 0; a < D; ++a)
            EXPECT_LE(std::fabs(away[a] / one.lattice.h[a]), reach + 0.5 * (one.lattice.basis.degree + 1) + 1e-9);
    }
}
TEST(Shapes, ReachIsHonest)
{
    for_each_particle<1>(50, check_reach<1>);
    for_each_particle<2>(20, check_reach<2>);
    for_each_particle<3>(3, check_reach<3>);
}

/// Weights are continuous where particles, sides and corners cross cells; gradients too, but for those of hats at points.
template <int D>
void check_continuity(OneParticle<D>& one, test::Random& random)
{
    const int a       = static_cast<int>(random() % D);
    double on_face[3] = {one.p.x[0][a], one.p.x[0][a] - one.extent(a), one.p.x[0][a] + one.extent(a)};
    for (double from : on_face) {
        const double y = one.lattice.cell_coordinate(a, from);
        Vec<D> before{}, across{};
        before[a] = (std::round(y) - y - 1e-12) * one.lattice.h[a];
        across[a] = 2e-12 * one.lattice.h[a];
        one.shift(before);
        auto w = weights(one);
        one.shift(across);
        const bool has_jump = one.spec.basis == Basis::hat && one.spec.domain == Domain::point;
        for (const auto& entry : weights(one)) {
            EXPECT_NEAR(entry.second.w, w[entry.first].w, 1e-10);
            for (int b = 0; b < D && !has_jump; ++b)
                EXPECT_NEAR(entry.second.dw[b] * one.lattice.h[b], w[entry.first].dw[b] * one.lattice.h[b], 1e-8);
        }
    }
}
TEST(Shapes, AreContinuousAcrossCells)
{
    for_each_particle<1>(10, check_continuity<1>);
    for_each_particle<2>(10, check_continuity<2>);
    for_each_particle<3>(2, check_continuity<3>);
}

/// Fluxes and values of which four lanes are given leave what eight lanes leave of which four are zero.
template <class S, bool is_upper, int D>
void check_half_lanes(OneParticle<D>& one, const Lanes& A, const Lanes (&X)[D])
{
    using Half   = HalfLanes<is_upper>;
    auto half_of = [](const Lanes& a) { return is_upper ? Half::of(a[4], a[5], a[6], a[7]) : Half::of(a[0], a[1], a[2], a[3]); };
    Half half[D];
    Lanes whole[D];
    for (int a = 0; a < D; ++a) {
        half[a]  = half_of(X[a]);
        whole[a] = Lanes(0.0) + half[a];
        for (int q = 0; q < 8; ++q) EXPECT_EQ(whole[a][q], (q >= 4) == is_upper ? X[a][q] : 0.0);
    }
    Array<Lanes> nodes[4];
    for (auto& n : nodes) {
        n = Array<Lanes>(one.nodes.size());
        for (std::size_t k = 0; k < n.size(); ++k) n[k][NodeLane::mass] = one.nodes[k][NodeLane::mass];
    }
    S::spread(one.lattice, one.view(), 0, nodes[0].data(), A, half);
    S::spread(one.lattice, one.view(), 0, nodes[1].data(), A, whole);
    S::spread(one.lattice, one.view(), 0, nodes[2].data(), half_of(A), half);
    S::spread(one.lattice, one.view(), 0, nodes[3].data(), Lanes(0.0) + half_of(A), whole);
    for (std::size_t k = 0; k < one.nodes.size(); ++k)
        for (int q = 0; q < 8; ++q) {
            EXPECT_NEAR(nodes[0][k][q], nodes[1][k][q], 1e-12 * (1 + std::fabs(nodes[1][k][q])));
            EXPECT_NEAR(nodes[2][k][q], nodes[3][k][q], 1e-12 * (1 + std::fabs(nodes[3][k][q])));
        }
}

/// The fast spread and collect equal the visited weights; for ddmpm also around nodes without mass.
template <int D>
void check_fast_forms(OneParticle<D>& one, test::Random& random)
{
    auto random_lanes = [&] {
        Lanes l{};
        for (int q = 0; q < 8; ++q) l[q] = q == NodeLane::mass ? 0.0 : test::uniform(random, -1, 1);
        return l;
    };
    Array<Lanes> nodes(one.nodes.size()), values(one.nodes.size()), field(one.nodes.size());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        field[n]                 = random_lanes();
        field[n][NodeLane::mass] = nodes[n][NodeLane::mass] = one.nodes[n][NodeLane::mass] = static_cast<double>(random() % 2);
    }
    const Lanes A = random_lanes();
    Lanes X[D];
    for (Lanes& x : X) x = random_lanes();
    Lanes value{}, value_alone{}, plain_value{}, plain_gradient[D] = {};
    Quad gradient[D] = {};
    test::with_shape<D>(one.spec, [&](auto shape) {
        using S = typename decltype(shape)::type;
        S::spread(one.lattice, one.view(), 0, nodes.data(), A, X);
        S::spread_value(one.lattice, one.view(), 0, values.data(), A);
        S::collect(one.lattice, one.view(), 0, field.data(), value, gradient);
        S::collect_value(one.lattice, one.view(), 0, field.data(), value_alone);
        check_half_lanes<S, false>(one, A, X);
        check_half_lanes<S, true>(one, A, X);
    });
    std::map<std::ptrdiff_t, Lanes> plain, plain_values;
    for (const auto& entry : weights(one)) {
        const std::ptrdiff_t node = entry.first;
        const Weight<D>& w        = entry.second;
        plain_values[node]        = A * w.w;
        plain[node]               = A * w.w;
        plain_value += field[node] * w.w;
        for (int a = 0; a < D; ++a) {
            plain[node] += X[a] * w.dw[a];
            plain_gradient[a] += field[node] * w.dw[a];
        }
    }
    double error = 0, error_of_gradient = 0, scale = 1;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const Lanes &to = plain[static_cast<std::ptrdiff_t>(n)], &to_value = plain_values[static_cast<std::ptrdiff_t>(n)];
        for (int q = 0; q < 8; ++q) {
            if (q == NodeLane::mass) continue;
            scale             = std::max(scale, std::fabs(to[q]));
            error_of_gradient = std::max(error_of_gradient, std::fabs(nodes[n][q] - to[q]));
            error             = std::max(error, std::fabs(values[n][q] - to_value[q]));
        }
    }
    for (int q = 0; q < 8; ++q) {
        error = std::max({error, std::fabs(value[q] - plain_value[q]), std::fabs(value_alone[q] - plain_value[q])});
        for (int a = 0; a < D && q < 4; ++a)
            error_of_gradient = std::max(error_of_gradient, std::fabs(gradient[a][q] - plain_gradient[a][q]));
    }
    EXPECT_LT(error, 1e-13);
    EXPECT_LT(error_of_gradient, 1e-12 * scale + 1e-11);
}
TEST(Shapes, FastFormsEqualThePlainOnes)
{
    for_each_particle<1>(10, check_fast_forms<1>);
    for_each_particle<2>(5, check_fast_forms<2>);
    for_each_particle<3>(1, check_fast_forms<3>);
}

/// A box whose sides lie on cell faces up to round-off must not leave a gradient without weight at the node beyond: its
/// force would act on no mass. Near the end of a box |dw| = sqrt(w/l), in cells.
TEST(Shapes, BoxOnCellFacesHasNoGradientWithoutWeight)
{
    test::Random random(31);
    for (int k = 0; k < 2000; ++k) {
        OneParticle<1> one(test::shape_spec(Basis::hat, Domain::box), random, 0.0);
        const double h   = one.lattice.h[0];
        one.p.half[0][0] = h / 4 * (1 + 1e-15 * test::uniform(random, -8, 8));
        one.p.x[0][0]  = one.lattice.node_position(0, 10) + (k % 2 ? h / 4 : -h / 4) * (1 + 1e-15 * test::uniform(random, -8, 8));
        const double l = one.p.half[0][0] / h;
        for (const auto& entry : weights(one)) {
            EXPECT_GE(entry.second.w, 0);
            EXPECT_LE(std::pow(entry.second.dw[0] * h, 2), 1.01 * entry.second.w / l);
        }
    }
}

/// Spline j of degree p on the knots (0 .. 0, 1, .., n - 1, n .. n), by the recursion of Cox and de Boor.
double knot_of(int n, int p, int k) { return std::clamp(k - p, 0, n); }
double cox_de_boor(int n, int degree, int p, int j, double y)
{
    auto t = [&](int k) { return knot_of(n, degree, k); };
    if (p == 0) return t(j) <= y && (y < t(j + 1) || (y == n && t(j) < n && t(j + 1) == n)) ? 1.0 : 0.0;
    double r = 0;
    if (t(j + p) > t(j)) r += (y - t(j)) / (t(j + p) - t(j)) * cox_de_boor(n, degree, p - 1, j, y);
    if (t(j + p + 1) > t(j + 1)) r += (t(j + p + 1) - y) / (t(j + p + 1) - t(j + 1)) * cox_de_boor(n, degree, p - 1, j + 1, y);
    return r;
}
double slope_de_boor(int n, int p, int j, double y)
{
    auto t   = [&](int k) { return knot_of(n, p, k); };
    double r = 0;
    if (t(j + p) > t(j)) r += p / (t(j + p) - t(j)) * cox_de_boor(n, p, p - 1, j, y);
    if (t(j + p + 1) > t(j + 1)) r -= p / (t(j + p + 1) - t(j + 1)) * cox_de_boor(n, p, p - 1, j + 1, y);
    return r;
}

template <int P>
void check_splines(int n)
{
    constexpr int margin = 2;
    const Lattice<1> g(Vec<1>{0.5}, Vec<1>{0.2}, {n}, {}, margin, {.degree = P});
    EXPECT_EQ(g.nodes[0], n + P + 2 * margin);
    test::Random random(3);
    std::vector<double> places{0.0, static_cast<double>(n)};
    for (int k = 0; k < 200; ++k)
        places.push_back(k % 10 ? test::uniform(random, 0, n) : std::floor(test::uniform(random, 0, n)));
    auto row = [&](double y, std::vector<double>& w, std::vector<double>& dw) {
        double some[P + 1], slopes[P + 1];
        const int first = BSpline<P>::row(g, 0, y + margin, some, slopes) - margin;
        w.assign(n + P, 0.0);
        dw.assign(n + P, 0.0);
        for (int k = 0; k <= P; ++k) {
            w.at(first + k)  = some[k];
            dw.at(first + k) = slopes[k];
        }
    };
    std::vector<double> w, dw, w_beyond, dw_beyond;
    for (double y : places) {
        row(y, w, dw);
        for (int j = 0; j < n + P; ++j) {
            EXPECT_NEAR(w[j], cox_de_boor(n, P, P, j, y), 1e-14) << n << " cells, spline " << j << " at " << y;
            EXPECT_NEAR(dw[j], slope_de_boor(n, P, j, y), 1e-13) << n << " cells, spline " << j << " at " << y;
        }
    }
    // The first and last interpolate; beyond a face values stay.
    for (double y : {0.0, static_cast<double>(n)}) {
        row(y, w, dw);
        EXPECT_EQ(w[y > 0 ? n + P - 1 : 0], 1.0);
        row(y > 0 ? y + 1.3 : -1.3, w_beyond, dw_beyond);
        EXPECT_EQ(w, w_beyond);
    }
    // Integrals and Greville points: int N = node_length, sum of N times the places is x, tested with the moments above.
    std::vector<double> length(n + P);
    for (int cell = 0; cell < n; ++cell)
        for (double s : {-1.0, 1.0}) {
            row(cell + 0.5 + s * 0.5 / std::sqrt(3.0), w, dw);
            for (int j = 0; j < n + P; ++j) length[j] += 0.5 * w[j] * g.h[0];
        }
    for (int j = 0; j < n + P; ++j) {
        EXPECT_NEAR(g.node_length(0, j + margin), length[j], 1e-14);
        double greville = 0;
        for (int k = 1; k <= P; ++k) greville += knot_of(n, P, j + k) / P;
        EXPECT_NEAR(g.node_position(0, j + margin), 0.5 + 0.2 * greville, 1e-14);
    }
}
TEST(Splines, AreThoseOfCoxAndDeBoor)
{
    for (int n = 1; n < 10; ++n) {
        check_splines<2>(n);
        check_splines<3>(n);
    }
}

/// Derivatives of one order below the degree are continuous at inner knots, by differences of the slopes.
TEST(Splines, CubicCurvaturesAreContinuous)
{
    const int n    = 7;
    const double e = 1e-4;
    for (int knot = 1; knot < n; ++knot)
        for (int j = 0; j < n + 3; ++j) {
            auto curvature = [&](double at) {
                const Lattice<1> g(Vec<1>{}, Vec<1>{1.0}, {n}, {}, 0, {.degree = 3});
                double w[4], plus[4], minus[4];
                const int first = BSpline<3>::row(g, 0, at + e / 2, w, plus);
                BSpline<3>::row(g, 0, at - e / 2, w, minus);
                return j < first || j > first + 3 ? 0.0 : (plus[j - first] - minus[j - first]) / e;
            };
            EXPECT_NEAR(curvature(knot - e), curvature(knot + e), 40 * e);
        }
}

/// Boxes on every basis against quadrature, up to six cells wide and beyond the faces of the grid.
TEST(Shapes, BoxesAreMeans)
{
    for (Basis basis : {Basis::hat, Basis::bspline2, Basis::bspline3}) {
        test::Random random(17);
        for (int k = 0; k < 30; ++k) {
            OneParticle<1> one(test::shape_spec(basis, Domain::box), random, 2.75, k % 3 ? Place::inside : Place::wall);
            if (k % 6 == 0) one.p.x[0][0] = one.lattice.origin[0] + one.lattice.h[0] * test::uniform(random, 0, 1);
            const int n    = 4000;
            const double l = one.p.half[0][0], x = one.p.x[0][0];
            std::map<std::ptrdiff_t, double> mean;
            for (int q = 0; q < n; ++q)
                for (double s : {-0.5, 0.5})
                    for (const auto& entry : point_weights(one, Vec<1>{x - l + (q + 0.5 + s / std::sqrt(3.0)) * 2 * l / n}))
                        mean[entry.first] += entry.second.w / (2 * n);
            auto high = point_weights(one, Vec<1>{x + l}), low = point_weights(one, Vec<1>{x - l});
            for (const auto& entry : weights(one)) {
                EXPECT_NEAR(entry.second.w, mean[entry.first], 1e-7);
                EXPECT_NEAR(entry.second.dw[0], (high[entry.first].w - low[entry.first].w) / (2 * l), 1e-11);
            }
        }
    }
}

/// grad~ N_i of ddmpm by its definition on n cells: alpha N_i' + (1 - alpha) sum_j N_j (1/V_j) int N_j N_i', in cells.
double dual_domain_slope(int n, double a0, int i, double y)
{
    auto N        = [](int j, double at) { return std::max(0.0, 1 - std::fabs(at - j)); };
    auto dN       = [](int j, double at) { return std::fabs(at - j) >= 1 ? 0.0 : at < j ? 1.0 : -1.0; };
    double smooth = 0;
    for (int j = 0; j <= n; ++j) {
        double V = 0, integral = 0;
        for (int cell = 0; cell < n; ++cell)
            for (double s : {-0.5, 0.5}) {
                const double at = cell + 0.5 + s / std::sqrt(3.0);
                V += 0.5 * N(j, at);
                integral += 0.5 * N(j, at) * dN(i, at);
            }
        smooth += N(j, y) * integral / V;
    }
    const double xi    = 2 * (y - std::floor(y)) - 1;
    const double alpha = a0 * (1 - xi * xi);
    return alpha * dN(i, y) + (1 - alpha) * smooth;
}

/// With a material that is all of the grid or a part of it: the nodes of the rest are never asked.
template <int D>
void check_dual_domain(double a0)
{
    test::Random random(21);
    MethodSpec spec = test::shape_spec(Basis::ddmpm, Domain::point);
    spec.a0         = a0;
    for (int k = 0; k < 60; ++k) {
        OneParticle<D> one(spec, random, 0.0);
        Index<D> from{}, n{};
        for (int a = 0; a < D; ++a) {
            from[a]       = static_cast<int>(random() % 6);
            n[a]          = 1 + static_cast<int>(random() % 6);
            one.p.x[0][a] = one.lattice.origin[a] + one.lattice.h[a] * (from[a] + test::uniform(random, 0, n[a]));
        }
        for (std::size_t node = 0; node < one.nodes.size(); ++node) {
            const Index<D> at = one.lattice.index(static_cast<std::ptrdiff_t>(node));
            bool is_material  = true;
            for (int a = 0; a < D; ++a) {
                const int j = at[a] - one.lattice.margin - from[a];
                is_material = is_material && j >= 0 && j <= n[a];
            }
            one.nodes[node][NodeLane::mass] = is_material;
        }
        for (const auto& entry : weights(one)) {
            const Index<D> at = one.lattice.index(entry.first);
            for (int a = 0; a < D; ++a) {
                double expected = 1;
                for (int b = 0; b < D; ++b) {
                    const int j    = at[b] - one.lattice.margin - from[b];
                    const double y = (one.p.x[0][b] - one.lattice.origin[b]) * one.lattice.inv_h[b] - from[b];
                    expected *= b != a ? std::max(0.0, 1 - std::fabs(y - j)) : dual_domain_slope(n[b], a0, j, y);
                }
                if (!(one.nodes[entry.first][NodeLane::mass] > 0)) expected = 0;
                EXPECT_NEAR(entry.second.dw[a] * one.lattice.h[a], expected, 1e-12);
            }
        }
    }
}
TEST(DualDomain, GradientIsThatOfItsDefinition)
{
    for (double a0 : {0.0, 0.5, 1.0}) {
        check_dual_domain<1>(a0);
        check_dual_domain<2>(a0);
        check_dual_domain<3>(a0);
    }
}

/// Parallelepipeds beyond the limit are scaled to it, and stay shapes.
TEST(Shapes, StretchLimitScalesParallelepipeds)
{
    test::Random random(5);
    for (double limit : {0.3, 1.0, 30.0})
        for (int k = 0; k < 200; ++k) {
            OneParticle<2> one(test::shape_spec(Basis::bspline2, Domain::parallelepiped), random, 0.0);
            one.p.F[0] = test::random_deformation<2>(random, 0.9) * (k % 2 ? 1.0 : 500.0);
            const Sweep<2> sweep{one.lattice, one.view(), nullptr, nullptr, 0, 0, limit};
            const Mat<2> full = one.p.F[0] * one.p.edges0[0];
            const Batch alone{0, 1};
            AffineEdges<2>::apply(sweep, alone);
            const double whole = corner_reach(one.lattice, load(&full, alone))[0];
            const double reach = corner_reach(one.lattice, load(one.p.edges.data(), alone))[0];
            EXPECT_LE(reach, limit);
            EXPECT_NEAR(reach, std::min(whole, limit), 1e-12);
            for (int a = 0; a < 2; ++a)
                for (int b = 0; b < 2; ++b) EXPECT_NEAR(one.p.edges[0](a, b), full(a, b) * std::min(1.0, limit / whole), 1e-12);
            if (limit < 2) check_moments(one, random);
        }
}

}  // namespace
}  // namespace ordo
