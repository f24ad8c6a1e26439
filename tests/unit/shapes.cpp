// Weights and gradients of every domain, over random places and deformations, in 1D, 2D and 3D.
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <map>

namespace ordo {
namespace {

/// One particle with a domain; `deformation` says how far from its initial domain.
template <int D>
struct OneParticle {
    Lattice<D> lattice{Vec<D>::filled(-0.3), spacing(), Index<D>::filled(12), Vec<D, bool>{}, 3};
    Particles<D> p{1, FieldGroups{.box = true, .corners = true}};

    static Vec<D> spacing()
    {
        Vec<D> h{};
        for (int a = 0; a < D; ++a) h[a] = 0.1 + 0.03 * a;  // cells that are no cubes
        return h;
    }
    OneParticle(test::Random& random, double deformation)
    {
        for (int a = 0; a < D; ++a) {
            p.x[0][a]         = lattice.origin[a] + test::uniform(random, 4, 8) * lattice.h[a];
            p.half[0][a]      = lattice.h[a] * test::uniform(random, 0.1, 0.25 + deformation);
            p.edges0[0](a, a) = 0.25 * lattice.h[a];
        }
        p.edges[0] = test::random_deformation<D>(random, deformation) * p.edges0[0];
    }
    ParticleView<D> view() { return p.view(); }
};

template <Shape S>
std::map<std::ptrdiff_t, std::pair<double, Vec<S::dim>>> weights(OneParticle<S::dim>& one)
{
    std::map<std::ptrdiff_t, std::pair<double, Vec<S::dim>>> r;
    S::for_each_node(one.lattice, one.view(), 0, [&](std::ptrdiff_t node, double w, const Vec<S::dim>& dw) {
        r[node].first += w;
        r[node].second += dw;
    });
    return r;
}

template <Shape S>
void check_moments(double deformation)
{
    constexpr int D = S::dim;
    test::Random random(7);
    for (int k = 0; k < 200; ++k) {
        OneParticle<D> one(random, deformation);
        double sum = 0;
        Vec<D> x{}, dsum{};
        Mat<D> xdw{};
        for (const auto& [node, w] : weights<S>(one)) {
            Vec<D> at{};
            const Index<D> index = one.lattice.index(node);
            for (int a = 0; a < D; ++a) at[a] = one.lattice.node_position(a, index[a]);
            sum += w.first;
            x += w.first * at;
            dsum += w.second;
            xdw += outer(at, w.second);
        }
        EXPECT_NEAR(sum, 1, 1e-12);
        for (int a = 0; a < D; ++a) {
            EXPECT_NEAR(x[a], one.p.x[0][a], 1e-12);
            EXPECT_NEAR(dsum[a], 0, 1e-12 / one.lattice.h[a]);
            for (int b = 0; b < D; ++b) EXPECT_NEAR(xdw(a, b), a == b, 1e-12);
        }
    }
}

/// Partition of unity, linear reproduction, sum of gradients zero, sum x_i (x) grad phi_i = I.
template <int D>
void check_all_moments()
{
    check_moments<Point<D, Hat>>(0.0);
    for (double deformation : {0.0, 0.4, 0.9}) {
        check_moments<Box<D>>(deformation);
        check_moments<Parallelepiped<D, Hat>>(deformation);
    }
}
TEST(Shapes, MomentsIn1D) { check_all_moments<1>(); }
TEST(Shapes, MomentsIn2D) { check_all_moments<2>(); }
TEST(Shapes, MomentsIn3D) { check_all_moments<3>(); }

template <Shape S>
void check_gradient_is_derivative(double deformation)
{
    constexpr int D = S::dim;
    test::Random random(11);
    for (int k = 0; k < 50; ++k) {
        OneParticle<D> one(random, deformation);
        const auto exact = weights<S>(one);
        const Vec<D> x   = one.p.x[0];
        for (int a = 0; a < D; ++a) {
            const double e = 1e-5 * one.lattice.h[a];
            // Away from kinks, where the hat has no derivative and the box's slope a kink.
            const double y = one.lattice.cell_coordinate(a, x[a]);
            if (std::fabs(y - std::round(y)) < 1e-3) continue;
            one.p.x[0][a] = x[a] + e;
            auto plus     = weights<S>(one);
            one.p.x[0][a] = x[a] - e;
            auto minus    = weights<S>(one);
            one.p.x[0]    = x;
            for (const auto& [node, w] : exact)
                EXPECT_NEAR(w.second[a] * one.lattice.h[a], (plus[node].first - minus[node].first) / (2e-5), 1e-8);
        }
    }
}
TEST(Shapes, HatAndBoxGradientsAreDerivatives)
{
    check_gradient_is_derivative<Point<1, Hat>>(0);
    check_gradient_is_derivative<Point<2, Hat>>(0);
    check_gradient_is_derivative<Point<3, Hat>>(0);
    check_gradient_is_derivative<Box<1>>(0.5);
    check_gradient_is_derivative<Box<2>>(0.5);
    check_gradient_is_derivative<Box<3>>(0.5);
}

/// A corner domain's gradient is the mean over the domain of the gradient of sum_c N_i(x_c) M_c, with the multilinear
/// functions M_c of the domain: here by Gauss integration (2 points an axis are exact). It is not the derivative of phi.
template <int D>
void check_mean_gradient()
{
    using S = Parallelepiped<D, Hat>;
    test::Random random(13);
    for (int k = 0; k < 50; ++k) {
        OneParticle<D> one(random, 0.5);
        const Mat<D> r = one.p.edges[0];
        std::map<std::ptrdiff_t, Vec<D>> mean;
        const double g = 1 / std::sqrt(3.0);
        for (int q = 0; q < (1 << D); ++q) {
            Vec<D> xi{};
            for (int a = 0; a < D; ++a) xi[a] = q >> a & 1 ? g : -g;
            for (int c = 0; c < (1 << D); ++c) {
                Vec<D> dM{}, at = one.p.x[0];  // gradient of M_c in the domain's own coordinates; corner
                for (int d = 0; d < D; ++d) {
                    dM[d] = S::sign(c, d) / 2;
                    for (int e = 0; e < D; ++e)
                        if (e != d) dM[d] *= (1 + S::sign(c, e) * xi[e]) / 2;
                    at += S::sign(c, d) * column(r, d);
                }
                const Vec<D> gradient = transpose(inverse(r)) * dM * (1.0 / (1 << D));
                OneParticle<D> corner(random, 0.0);
                corner.p.x[0] = at;
                for (const auto& [node, w] : weights<Point<D, Hat>>(corner)) mean[node] += w.first * gradient;
            }
        }
        for (const auto& [node, w] : weights<S>(one))
            for (int a = 0; a < D; ++a) EXPECT_NEAR(w.second[a], mean[node][a], 1e-12 / one.lattice.h[a]);
    }
}
TEST(Shapes, CornerGradientIsTheMeanGradient)
{
    check_mean_gradient<1>();
    check_mean_gradient<2>();
    check_mean_gradient<3>();
}

/// The box's weight is the mean of the hats over the box: compared with a fine midpoint rule.
TEST(Shapes, BoxIsTheMeanOfHats)
{
    test::Random random(17);
    for (int k = 0; k < 20; ++k) {
        OneParticle<1> one(random, 0.9);
        const int n    = 20000;
        const double x = one.p.x[0][0], l = one.p.half[0][0];
        std::map<std::ptrdiff_t, double> mean;
        OneParticle<1> point(random, 0.0);
        for (int q = 0; q < n; ++q) {
            point.p.x[0][0] = x - l + (q + 0.5) * 2 * l / n;
            for (const auto& [node, w] : weights<Point<1, Hat>>(point)) mean[node] += w.first / n;
        }
        for (const auto& [node, w] : weights<Box<1>>(one)) EXPECT_NEAR(w.first, mean[node], 1e-8);
    }
}

/// A box whose sides lie on cell faces up to round-off must not leave a gradient without weight at the node beyond: its
/// force would act on no mass. Near the end of a box |dw| = sqrt(w/l), in cells.
TEST(Shapes, BoxOnCellFacesHasNoGradientWithoutWeight)
{
    test::Random random(31);
    for (int k = 0; k < 2000; ++k) {
        OneParticle<1> one(random, 0.0);
        const double h   = one.lattice.h[0];
        one.p.half[0][0] = h / 4 * (1 + 1e-15 * test::uniform(random, -8, 8));
        one.p.x[0][0]  = one.lattice.node_position(0, 7) + (k % 2 ? h / 4 : -h / 4) * (1 + 1e-15 * test::uniform(random, -8, 8));
        const double l = one.p.half[0][0] / h;
        for (const auto& [node, w] : weights<Box<1>>(one)) {
            EXPECT_GE(w.first, 0);
            EXPECT_LE(std::pow(w.second[0] * h, 2), 1.01 * w.first / l);
        }
    }
}

/// No weight lies further from the particle than `reach` and the cell at its end.
template <Shape S>
void check_reach()
{
    constexpr int D = S::dim;
    test::Random random(19);
    for (int k = 0; k < 200; ++k) {
        OneParticle<D> one(random, 0.9);
        const double reach = S::reach(one.lattice, one.view(), 0);
        for (const auto& [node, w] : weights<S>(one)) {
            if (w.first == 0 && norm(w.second) == 0) continue;
            const Index<D> index = one.lattice.index(node);
            for (int a = 0; a < D; ++a) EXPECT_LE(std::fabs(index[a] - one.lattice.cell_coordinate(a, one.p.x[0][a])), reach + 1);
        }
    }
}
TEST(Shapes, ReachIsHonest)
{
    check_reach<Point<2, Hat>>();
    check_reach<Box<1>>();
    check_reach<Box<3>>();
    check_reach<Parallelepiped<1, Hat>>();
    check_reach<Parallelepiped<2, Hat>>();
    check_reach<Parallelepiped<3, Hat>>();
}

/// Weights are continuous where particles cross cells.
template <Shape S>
void check_continuity()
{
    constexpr int D = S::dim;
    test::Random random(23);
    for (int k = 0; k < 50; ++k) {
        OneParticle<D> one(random, 0.4);
        const double face = one.lattice.origin[0] + 6 * one.lattice.h[0];
        one.p.x[0][0]     = face - 1e-12;
        auto before       = weights<S>(one);
        one.p.x[0][0]     = face + 1e-12;
        for (const auto& [node, w] : weights<S>(one)) EXPECT_NEAR(w.first, before[node].first, 1e-9);
    }
}
TEST(Shapes, WeightsAreContinuousAcrossCells)
{
    check_continuity<Point<2, Hat>>();
    check_continuity<Box<2>>();
    check_continuity<Parallelepiped<2, Hat>>();
    check_continuity<Parallelepiped<3, Hat>>();
}

/// The fast spread and collect equal the visited weights.
template <Shape S>
void check_fast_forms(double deformation)
{
    constexpr int D = S::dim;
    test::Random random(29);
    for (int k = 0; k < 20; ++k) {
        OneParticle<D> one(random, deformation);
        auto random_lanes = [&] {
            Lanes l{};
            for (int q = 0; q < 8; ++q) l[q] = test::uniform(random, -1, 1);
            return l;
        };
        Array<Lanes> nodes(one.lattice.node_count()), values(one.lattice.node_count()), field(one.lattice.node_count());
        for (Lanes& n : field) n = random_lanes();
        const Lanes A = random_lanes();
        Lanes X[D];
        for (Lanes& x : X) x = random_lanes();
        S::spread(one.lattice, one.view(), 0, nodes.data(), A, X);
        S::spread_value(one.lattice, one.view(), 0, values.data(), A);
        Lanes value{}, value_alone{}, gradient[D] = {}, plain_value{}, plain_gradient[D] = {};
        S::collect(one.lattice, one.view(), 0, field.data(), value, gradient);
        S::collect_value(one.lattice, one.view(), 0, field.data(), value_alone);

        std::map<std::ptrdiff_t, Lanes> plain, plain_values;
        for (const auto& [node, w] : weights<S>(one)) {
            plain_values[node] = A * w.first;
            plain[node]        = A * w.first;
            plain_value += field[node] * w.first;
            for (int a = 0; a < D; ++a) {
                plain[node] += X[a] * w.second[a];
                plain_gradient[a] += field[node] * w.second[a];
            }
        }
        for (std::size_t n = 0; n < nodes.size(); ++n)
            for (int q = 0; q < 8; ++q) {
                EXPECT_NEAR(nodes[n][q], plain[static_cast<std::ptrdiff_t>(n)][q], 1e-11);
                EXPECT_NEAR(values[n][q], plain_values[static_cast<std::ptrdiff_t>(n)][q], 1e-13);
            }
        for (int q = 0; q < 8; ++q) {
            EXPECT_NEAR(value[q], plain_value[q], 1e-13);
            EXPECT_NEAR(value_alone[q], plain_value[q], 1e-13);
            for (int a = 0; a < D; ++a) EXPECT_NEAR(gradient[a][q], plain_gradient[a][q], 1e-11);
        }
    }
}
template <int D>
void check_all_fast_forms()
{
    check_fast_forms<Point<D, Hat>>(0);
    for (double deformation : {0.2, 0.9}) {
        check_fast_forms<Box<D>>(deformation);
        check_fast_forms<Parallelepiped<D, Hat>>(deformation);
    }
}
TEST(Shapes, FastFormsEqualThePlainOnes)
{
    check_all_fast_forms<1>();
    check_all_fast_forms<2>();
    check_all_fast_forms<3>();
}

}  // namespace
}  // namespace ordo
