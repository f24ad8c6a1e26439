// Splines with removable knots, banded matrices of one axis, Gauss rules of cells.
#include "solve/banded.hpp"
#include "solve/incomplete_cholesky.hpp"
#include "spline/axis.hpp"
#include "spline/axis_matrix.hpp"
#include "spline/cell.hpp"
#include "spline/cut_rule.hpp"
#include "spline/ghost_penalty.hpp"
#include "spline/matrix.hpp"
#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace ordo {
namespace {

/// f(axis) for degrees, with and without knots next to the walls and periodic.
template <class F>
void for_each_axis_of_splines(F&& f)
{
    for (int degree = 1; degree <= SplineAxis::max_degree; ++degree) {
        for (const int removed : {0, 1, 2}) f(SplineAxis{degree, 9, removed, false});
        f(SplineAxis{degree, 9, 0, true});
    }
}

/// f(function, value, slope) at a place.
template <class F>
void at(const SplineAxis& axis, double y, F&& f)
{
    with_degree(axis.degree, [&]<int P>() {
        double w[P + 1], dw[P + 1];
        const int span = axis.span_of(axis.cell_of(y));
        axis.row<P>(span, y, w, dw);
        for (int j = 0; j <= P; ++j) f(axis.wrapped(span + j), w[j], dw[j]);
    });
}

std::vector<double> row(const SplineAxis& axis, double y)
{
    std::vector<double> r(axis.count());
    at(axis, y, [&](int i, double w, double) { r[i] += w; });
    return r;
}

TEST(Splines, ReproduceLinesAndIntegrate)
{
    for_each_axis_of_splines([](const SplineAxis& axis) {
        SCOPED_TRACE(axis.degree * 10 + axis.removed);
        std::vector<double> integral(axis.count());
        constexpr int n = 1800;
        for (int k = 0; k < n; ++k) {
            const double y = 9.0 * (k + 0.5) / n;
            double sum = 0, line = 0, slope = 0;
            at(axis, y, [&](int i, double w, double dw) {
                EXPECT_GE(w, 0);
                sum += w;
                line += w * axis.center(i);
                slope += dw;
                integral[i] += w * 9.0 / n;
            });
            EXPECT_NEAR(sum, 1, 1e-14);
            EXPECT_NEAR(slope, 0, 1e-13);
            if (!axis.periodic) {
                EXPECT_NEAR(line, y, 1e-13);
            }
        }
        for (int i = 0; i < axis.count(); ++i) EXPECT_NEAR(integral[i], axis.integral(i), 1e-4);
    });
}

TEST(Splines, SlopesAreThoseOfValues)
{
    for_each_axis_of_splines([](const SplineAxis& axis) {
        for (const double y : {0.3, 1.7, 4.4, 7.2, 8.9}) {
            constexpr double d             = 1e-6;
            const std::vector<double> high = row(axis, y + d), low = row(axis, y - d);
            std::vector<double> slope(axis.count());
            at(axis, y, [&](int i, double, double dw) { slope[i] += dw; });
            for (int i = 0; i < axis.count(); ++i) EXPECT_NEAR(slope[i], (high[i] - low[i]) / (2 * d), 1e-8);
        }
    });
}

/// Without a knot a spline is one polynomial over the cells on both sides of it: the jump of its highest derivative is gone.
TEST(Splines, RemovedKnotsAreNone)
{
    for (int degree = 1; degree <= SplineAxis::max_degree; ++degree)
        for (const int removed : {0, 1, 2}) {
            const SplineAxis axis{degree, 9, removed, false};
            EXPECT_EQ(axis.count(), 9 + degree - 2 * removed);
            for (int knot = 1; knot <= 8; ++knot) {
                // The divided difference of degree + 1 of a polynomial of this degree is zero across the knot.
                std::vector<std::vector<double>> rows;
                for (int k = 0; k <= degree + 1; ++k) rows.push_back(row(axis, knot - 0.9 + 1.8 * k / (degree + 1)));
                double jump = 0;
                for (int i = 0; i < axis.count(); ++i) {
                    double difference = 0, binomial = 1;
                    for (int k = 0; k <= degree + 1; ++k) {
                        difference += (k % 2 ? -1 : 1) * binomial * rows[k][i];
                        binomial *= static_cast<double>(degree + 1 - k) / (k + 1);
                    }
                    jump = std::max(jump, std::fabs(difference));
                }
                const bool is_removed = knot <= removed || knot >= 9 - removed;
                if (is_removed)
                    EXPECT_LT(jump, 1e-13);
                else
                    EXPECT_GT(jump, 1e-5);
            }
        }
}

TEST(Banded, SolvesWhatWasMultiplied)
{
    test::Random random(3);
    for (const bool periodic : {false, true})
        for (const int size : {1, 2, 3, 7, 8, 20})
            for (const int band : {0, 1, 2, 3, 5}) {
                // A sum of squares of pieces of rows: positive definite.
                std::vector<double> full(size * size);
                Banded<double> one(size, band, periodic);
                Banded<Lanes> eight(size, band, periodic);
                auto add = [&](int i, int j, double value) {
                    full[i * size + j] += value;
                    one.add(i, j, value);
                    eight.add(i, j, make_lanes(1, 2, 3, 4, 5, 6, 7, 8) * value);
                };
                for (int k = 0; k < 3 * size; ++k) {
                    std::vector<double> w(band + 1);
                    for (double& v : w) v = test::uniform(random, -1, 1);
                    for (int i = 0; i <= band; ++i)
                        for (int j = 0; j <= band; ++j) {
                            const int row = k % size + i, column = k % size + j;
                            if (periodic || (row < size && column < size)) add(row % size, column % size, w[i] * w[j]);
                        }
                }
                for (int i = 0; i < size; ++i) add(i, i, 0.1);
                std::vector<double> x(size), b(size);
                for (double& v : x) v = test::uniform(random, -1, 1);
                std::vector<Lanes> b8(2 * size, Lanes(0.0));
                for (int i = 0; i < size; ++i) {
                    for (int j = 0; j < size; ++j) b[i] += full[i * size + j] * x[j];
                    b8[2 * i] = Lanes(b[i]);
                }
                EXPECT_EQ(one.factor(1e-12), -1);
                EXPECT_EQ(eight.factor(1e-12), -1);
                one.solve(b.data(), 1);
                eight.solve(b8.data(), 2);
                for (int i = 0; i < size; ++i) {
                    EXPECT_NEAR(b[i], x[i], 1e-10);
                    for (int k = 0; k < 8; ++k) EXPECT_NEAR(b8[2 * i][k], x[i] / (k + 1), 1e-10);
                }
            }
}

TEST(Banded, NamesTheRowThatOthersDetermine)
{
    for (const bool periodic : {false, true}) {
        Banded<double> m(12, 1, periodic);
        for (int i = 0; i < 12; ++i) m.add(i, i, i == 5 ? 0.0 : 1.0);
        EXPECT_EQ(m.factor(1e-12), 5);
    }
}

TEST(Banded, MatricesOfAnAxisAreTransposed)
{
    AxisMatrix m(2, 3);
    m.add(0, 0, 1);
    m.add(0, 1, 2);
    m.add(1, 2, 3);
    m.add(1, 2, 4);
    const double from[] = {1, 10, 100};
    double to[2]        = {};
    m.multiply(from, to, 1);
    EXPECT_EQ(to[0], 21);
    EXPECT_EQ(to[1], 700);
    const AxisMatrix t = m.transposed();
    EXPECT_EQ(t.rows(), 3);
    const double back[] = {1, 10};
    double three[3]     = {};
    t.multiply(back, three, 1);
    EXPECT_EQ(three[0], 1);
    EXPECT_EQ(three[1], 2);
    EXPECT_EQ(three[2], 70);
}

/// evaluate and integrate are each other's transpose, and evaluate is the sum over functions.
template <int D>
void check_quadrature()
{
    constexpr int P = 3;
    SplineSpace<D> space;
    std::vector<double> B[D];
    Vec<D, const double*> rows{};
    test::Random random(8);
    for (int a = 0; a < D; ++a) {
        space.axis[a] = {P, 5, 0, false};
        for (int k = 0; k < 4 * (P + 1); ++k) B[a].push_back(test::uniform(random, -1, 1));
        rows[a] = B[a].data();
    }
    SplineCell<D, P> cell(space, Index<D>::filled(2)), back = cell;
    std::vector<Lanes> values(power_of(4, D));
    for (Lanes& r : cell.records) r = Lanes(test::uniform(random, -1, 1));
    CellQuadrature<D, P> q(rows, 4);
    q.evaluate(cell);
    double one = 0, other = 0;
    for (int g = 0; g < power_of(4, D); ++g) {
        values[g]    = Lanes(test::uniform(random, -1, 1));
        double plain = 0;
        for (int j = 0; j < power_of(P + 1, D); ++j) {
            double w = 1;
            for (int a = 0, rest_g = g, rest_j = j; a < D; ++a, rest_g /= 4, rest_j /= P + 1)
                w *= rows[a][rest_g % 4 * (P + 1) + rest_j % (P + 1)];
            plain += w * cell.records[j][0];
        }
        EXPECT_NEAR(q.values[g][5], plain, 1e-13);
        one += values[g][0] * q.values[g][0];
    }
    std::copy(values.begin(), values.end(), q.values);
    q.integrate(back);
    for (int j = 0; j < power_of(P + 1, D); ++j) other += back.records[j][7] * cell.records[j][0];
    EXPECT_NEAR(one, other, 1e-12);
}
TEST(Splines, QuadratureOfACellIsItsTranspose)
{
    check_quadrature<1>();
    check_quadrature<2>();
    check_quadrature<3>();
}

/// A x is sum_g w_g N_i(y_g) N_j(y_g) x_j over random points of all cells: with one weight, and with one for each half of the lanes.
template <int D, int P, int W>
void check_matrix(int cells, int removed, bool is_periodic)
{
    SplineSpace<D> space;
    for (int a = 0; a < D; ++a) space.axis[a] = {P, cells + a, is_periodic ? 0 : removed, is_periodic};
    test::Random random(5);
    const std::size_t count = space.count();
    std::vector<Lanes> x(count), product(count), plain(count, Lanes(0.0));
    for (Lanes& of : x)
        for (int k = 0; k < 8; ++k) of[k] = test::uniform(random, -1, 1);
    SplineMatrix<D> matrix;
    matrix.clear(space, W, P + is_periodic);
    std::array<std::vector<std::array<double, 2>>, D> along;  // sum_g w_g N_i N_j of one axis
    for (int a = 0; a < D; ++a) along[a].resize(space.axis[a].count() * (P + 1));
    Index<D> all{};
    for (int a = 0; a < D; ++a) all[a] = cells + a;
    IndexBox<D>{{}, all}.for_each([&](const Index<D>& cell) {
        constexpr int points = 3;
        double rows[points][D][P + 1], dw[P + 1], weights[points][2];
        for (int g = 0; g < points; ++g) {
            for (int a = 0; a < D; ++a)
                space.axis[a].template row<P>(space.axis[a].span_of(cell[a]), cell[a] + test::uniform(random, 0, 1), rows[g][a],
                                              dw);
            for (double& w : weights[g]) w = test::uniform(random, 0.5, 1);
            for (int a = 0; a < D; ++a)
                for (int i = 0; i <= P; ++i)
                    for (int j = i; j <= P; ++j)
                        for (const int w : {0, 1})
                            along[a][space.axis[a].wrapped(space.first_of(cell)[a] + i) * (P + 1) + j - i][w] +=
                                weights[g][w] * rows[g][a][i] * rows[g][a][j];
            auto each = [&](auto&& use) {
                IndexBox<D>{{}, Index<D>::filled(P + 1)}.for_each([&](const Index<D>& k) {
                    Index<D> at{};
                    double w = 1.0;
                    for (int a = 0; a < D; ++a) {
                        at[a] = space.axis[a].wrapped(space.first_of(cell)[a] + k[a]);
                        w *= rows[g][a][k[a]];
                    }
                    use(space.number(at), w);
                });
            };
            Lanes sum(0.0);
            each([&](std::size_t i, double w) { sum += x[i] * w; });
            for (int k = 0; k < 8; ++k) sum[k] *= weights[g][W == 2 && k > 3];
            each([&](std::size_t i, double w) { plain[i] += sum * w; });
        }
        CellPairs<D, P, W> pairs;
        pairs.set_points(
            0, points,
            [&](std::ptrdiff_t g) {
                Vec<D, const double*> r{};
                for (int a = 0; a < D; ++a) r[a] = rows[g][a];
                return r;
            },
            [&](std::ptrdiff_t g) {
                std::array<double, W> r{};
                std::copy_n(weights[g], W, r.data());
                return r;
            });
        matrix.add(cell, pairs);
    });
    matrix.finish();
    matrix.multiply(x.data(), product.data());
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 8; ++k) EXPECT_NEAR(product[i][k], plain[i][k], 1e-13) << i;

    for (std::size_t i = 0; i < count; ++i) {
        double sum = 0.0;
        matrix.for_each_entry(static_cast<std::ptrdiff_t>(i), [&](std::ptrdiff_t j, double entry) { sum += entry * x[j][6]; });
        EXPECT_NEAR(sum, plain[i][6], 1e-13) << i;
    }

    if (is_periodic) return;
    const auto sums = matrix.sums_along_axes();
    for (int a = 0; a < D; ++a)
        for (std::size_t i = 0; i < sums[a].size(); ++i)
            for (const int k : {0, 7}) EXPECT_NEAR(sums[a][i][k], along[a][i][W == 2 && k > 3], 1e-12) << i;
}
TEST(SplineMatrix, IsTheSumOverPoints)
{
    for (const bool is_periodic : {false, true}) {
        for (const int cells : {3, 5, 9}) {
            check_matrix<1, 1, 1>(cells, 0, is_periodic);
            check_matrix<1, 5, 2>(cells, 1, is_periodic);
            check_matrix<2, 2, 2>(cells, 0, is_periodic);
            check_matrix<2, 3, 1>(cells, 1, is_periodic);
        }
        check_matrix<2, 5, 1>(7, 2, is_periodic);
        check_matrix<3, 2, 1>(3, 0, is_periodic);
        check_matrix<3, 3, 2>(4, 0, is_periodic);
        check_matrix<3, 4, 2>(5, 1, is_periodic);
        check_matrix<3, 5, 1>(4, 1, is_periodic);
    }
}

/// A grid of points gives what its points give one by one.
template <int D, int P>
void check_grid_of_points(int count)
{
    test::Random random(6);
    std::vector<double> rows[D], weights;
    Vec<D, const double*> values{};
    for (int a = 0; a < D; ++a) {
        for (int k = 0; k < count * (P + 1); ++k) rows[a].push_back(test::uniform(random, 0, 1));
        values[a] = rows[a].data();
    }
    for (int g = 0; g < power_of(count, D); ++g) weights.push_back(test::uniform(random, 0, 1));
    CellPairs<D, P, 1> grid, points;
    grid.set_grid(count, values, weights.data());
    points.set_points(
        0, std::ssize(weights),
        [&](std::ptrdiff_t g) {
            Vec<D, const double*> r{};
            for (int a = 0, rest = static_cast<int>(g); a < D; ++a, rest /= count) r[a] = values[a] + rest % count * (P + 1);
            return r;
        },
        [&](std::ptrdiff_t g) { return std::array{weights[g]}; });
    for (int o = 0; o < CellPairs<D, P, 1>::others; ++o)
        for (int e = 0; e < CellPairs<D, P, 1>::line; ++e)
            EXPECT_NEAR(grid.of(o)[e], points.of(o)[e], 1e-12 * static_cast<double>(weights.size()));
}
TEST(SplineMatrix, TakesGridsOfPoints)
{
    check_grid_of_points<1, 3>(4);
    check_grid_of_points<2, 2>(3);
    check_grid_of_points<2, 5>(6);
    check_grid_of_points<3, 3>(5);
    check_grid_of_points<3, 5>(6);
}

/// The factor of a matrix that fills in nothing is exact; of another it is close enough for conjugate gradients; one with a pivot that is
/// not positive is raised.
TEST(IncompleteCholesky, SolvesBands)
{
    constexpr int n = 40;
    for (const bool is_dense : {true, false}) {
        IncompleteCholesky factor;
        std::vector<std::vector<double>> A(n, std::vector<double>(n, 0.0));
        test::Random random(3);
        for (int i = 0; i < n; ++i) {
            std::vector<IncompleteCholesky::Entry> left;
            A[i][i] = 4.0 + test::uniform(random, 0, 1);
            for (int j = std::max(0, i - 6); j < i; ++j) {
                if (!is_dense && (i - j) % 6 > 1) continue;
                const double value = test::uniform(random, -0.5, 0.5);
                A[i][j] = A[j][i] = value;
                left.insert(left.begin(), {{j, 0.25 * value}, {j, 0.75 * value}});
            }
            factor.add_row(left, A[i][i]);
        }
        factor.factor();
        std::vector<Lanes> x(n), b(n, Lanes(0.0)), found(n);
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < 8; ++k) x[i][k] = test::uniform(random, -1, 1);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) b[i] += x[j] * A[i][j];
        factor.solve(b.data(), found.data());
        double largest = 0.0;
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < 8; ++k) largest = std::max(largest, std::fabs(found[i][k] - x[i][k]));
        if (is_dense)
            EXPECT_LT(largest, 1e-14);
        else {
            EXPECT_LT(largest, 0.05);
            EXPECT_GT(largest, 1e-8);
        }
    }
}
TEST(IncompleteCholesky, RaisesPivotsThatAreNotPositive)
{
    IncompleteCholesky factor;
    std::vector<IncompleteCholesky::Entry> none, left{{0, 1.0}};
    factor.add_row(none, 1.0);
    factor.add_row(left, 1.0);  // singular
    factor.factor();
    const Lanes r[] = {Lanes(1.0), Lanes(1.0)};
    Lanes z[2];
    factor.solve(r, z);
    EXPECT_NEAR(z[0][0], 0.5, 1e-3);
    EXPECT_NEAR(z[1][0], 0.5, 1e-3);
}

/// The value of sum c_k N_k at a place, in cells.
template <int D>
double value_at(const SplineSpace<D>& space, const std::vector<double>& c, const Vec<D>& y)
{
    std::vector<double> rows[D];
    for (int a = 0; a < D; ++a) rows[a] = row(space.axis[a], y[a]);
    double r = 0.0;
    IndexBox<D>{{}, space.counts()}.for_each([&](const Index<D>& k) {
        double weight = c[space.number(k)];
        for (int a = 0; a < D; ++a) weight *= rows[a][k[a]];
        r += weight;
    });
    return r;
}

/// Coefficients of a product of powers of the axes' places, where they are not periodic.
template <int D>
std::vector<double> polynomial(const SplineSpace<D>& space, int degree)
{
    std::vector<double> c(space.count(), 1.0);
    IndexBox<D>{{}, space.counts()}.for_each([&](const Index<D>& k) {
        for (int a = 0; a < D; ++a) {
            const SplineAxis& axis = space.axis[a];
            if (axis.periodic) continue;
            std::vector<double> sums(axis.degree + 1, 0.0);  // elementary symmetric functions of the knots
            sums[0] = 1.0;
            for (int j = 1; j <= axis.degree; ++j)
                for (int q = j; q > 0; --q) sums[q] += sums[q - 1] * axis.knot(k[a] - axis.degree + j);
            double choose = 1.0;
            for (int q = 1; q <= degree; ++q) choose *= static_cast<double>(axis.degree + 1 - q) / q;
            c[space.number(k)] *= sums[degree] / choose;  // the blossom of y^degree
        }
    });
    return c;
}

/// g(u, u) of splines whose highest derivative jumps by `size` at one plane across an axis is size^2 times the area of its faces;
/// polynomials have none; the matrix gives the same product.
template <int D>
void check_ghost_penalty(int degree, int removed, bool is_periodic)
{
    constexpr int n = D == 3 ? 8 : 12;
    SplineSpace<D> space;
    for (int a = 0; a < D; ++a) space.axis[a] = {degree, n, removed, is_periodic && a == 0};
    const std::size_t count = space.count();
    std::vector<Cover> ball;
    IndexBox<D>{{}, Index<D>::filled(n)}.for_each([&](const Index<D>& k) {
        double square = 0.0;
        for (int a = 0; a < D; ++a) square += (k[a] + 0.5 - 0.45 * n) * (k[a] + 0.5 - 0.45 * n);
        const double r = std::sqrt(square) / n;
        ball.push_back(r < 0.3 ? Cover::all : r < 0.44 ? Cover::part : Cover::none);
    });
    const GhostPenalty<D> of_ball(space, Index<D>::filled(n), ball);
    auto product = [&](const GhostPenalty<D>& g, const std::vector<double>& from) {
        std::vector<double> to(count, 0.0);
        g.multiply(1.0, from.data(), to.data());
        return to;
    };
    for (int power = 0; power <= degree; ++power)
        for (const double of : product(of_ball, polynomial(space, power))) EXPECT_NEAR(of, 0.0, 1e-9 * std::pow(n, power * D));

    std::vector<double> from(count);  // the same by a matrix
    std::vector<Lanes> records(count), sums(count);
    test::Random random(7);
    for (std::size_t i = 0; i < count; ++i) records[i] = Lanes(from[i] = test::uniform(random, -1, 1));
    SplineMatrix<D> matrix;
    matrix.clear(space, 2, degree + 1);
    const double weights[] = {1.0, 3.0};
    of_ball.add_to(matrix, weights);
    matrix.finish();
    matrix.multiply(records.data(), sums.data());
    const std::vector<double> whole = product(of_ball, from);
    double size                     = 0.0;
    for (const double of : whole) size = std::max(size, std::fabs(of));
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_NEAR(sums[i][2], whole[i], 1e-13 * size);
        EXPECT_NEAR(sums[i][5], 3 * whole[i], 3e-13 * size);
    }

    // (y - n/2)_+^degree along the last axis, times 1: by the truncated power's blossom.
    const GhostPenalty<D> everywhere(space, Index<D>::filled(n), std::vector<Cover>(ball.size(), Cover::part));
    std::vector<double> c(count, 1.0);
    const SplineAxis& last = space.axis[D - 1];
    double jump            = 1.0;
    for (int r = 2; r <= degree; ++r) jump *= r;
    IndexBox<D>{{}, space.counts()}.for_each([&](const Index<D>& k) {
        double& blossom = c[space.number(k)];
        for (int j = 1; j <= degree; ++j) blossom *= last.knot(k[D - 1] - degree + j) - 0.5 * n;
        if (last.knot(k[D - 1] - degree + 1) <= 0.5 * n) blossom = 0.0;  // of the polynomial before the plane
    });
    const std::vector<double> g = product(everywhere, c);
    double energy               = 0.0;
    for (std::size_t i = 0; i < count; ++i) energy += c[i] * g[i];
    EXPECT_NEAR(energy, jump * jump * std::pow(n, D - 1), 1e-9 * jump * jump * std::pow(n, D - 1));
}
TEST(GhostPenalty, IsTheJumpOfTheHighestDerivative)
{
    for (int degree = 1; degree <= 5; ++degree)
        for (const int removed : {0, 2}) {
            SCOPED_TRACE(10 * degree + removed);
            check_ghost_penalty<1>(degree, removed, false);
            check_ghost_penalty<2>(degree, removed, false);
            check_ghost_penalty<2>(degree, removed, true);
            if (degree < 4 && removed == 0) check_ghost_penalty<3>(degree, removed, false);
        }
}

/// |volume - exact| over the exact one, of rules in the cells of a unit box.
template <int D, class F>
double volume_error(const std::vector<LevelSet<D>>& body, int cells, int points, double exact, const F& f)
{
    double sum = 0.0;
    IndexBox<D>{{}, Index<D>::filled(cells)}.for_each([&](const Index<D>& k) {
        Vec<D> lower{};
        for (int a = 0; a < D; ++a) lower[a] = static_cast<double>(k[a]) / cells;
        for_each_point_inside<D>(body, lower, lower + Vec<D>::filled(1.0 / cells), points, [&](const Vec<D>& x, double weight) {
            EXPECT_GT(weight, 0);
            sum += weight * f(x);
        });
    });
    return std::fabs(sum / exact - 1);
}
TEST(CutRule, IntegratesOverCurvedBodies)
{
    constexpr double pi = std::numbers::pi, r = 0.371;
    auto one = [](const auto&) { return 1.0; };
    const Vec<3> middle{0.51, 0.47, 0.52};
    LevelSet<1> rod  = [&](const Vec<1>& x) { return std::fabs(x[0] - middle[0]) - r; };
    LevelSet<2> disk = [&](const Vec<2>& x) { return norm(x - Vec<2>{middle[0], middle[1]}) - r; };
    LevelSet<2> hole = [&](const Vec<2>& x) { return 0.2 - norm(x - Vec<2>{middle[0], middle[1]}); };
    LevelSet<3> ball = [&](const Vec<3>& x) { return norm(x - middle) - r; };
    EXPECT_LT(volume_error<1>({rod}, 5, 3, 2 * r, one), 1e-14);
    for (const int points : {3, 4}) {  // order 2 points
        const double least = std::pow(2, 2 * points - 0.5);
        EXPECT_GT(volume_error<2>({disk}, 10, points, pi * r * r, one),
                  least * volume_error<2>({disk}, 20, points, pi * r * r, one));
        EXPECT_GT(volume_error<3>({ball}, 8, points, 4 * pi / 3 * r * r * r, one),
                  least * volume_error<3>({ball}, 16, points, 4 * pi / 3 * r * r * r, one));
    }
    auto moment = [&](const Vec<2>& x) { return (x[0] - middle[0]) * (x[0] - middle[0]); };
    EXPECT_LT(volume_error<2>({disk}, 10, 5, pi * r * r * r * r / 4, moment), 1e-9);
    EXPECT_LT(volume_error<2>({disk, hole}, 10, 5, pi * (r * r - 0.04), one), 1e-7);  // two surfaces in some cells
    std::vector<LevelSet<2>> square;
    for (int side = 0; side < 4; ++side)
        square.push_back([angle = 0.3 + side * pi / 2](const Vec<2>& x) {
            return (x[0] - 0.5) * std::cos(angle) + (x[1] - 0.5) * std::sin(angle) - 0.3;
        });
    EXPECT_LT(volume_error<2>(square, 10, 3, 0.36, one), 1e-5);  // corners
}

}  // namespace
}  // namespace ordo
