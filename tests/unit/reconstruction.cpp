// The engine of reconstruction against algorithms that share nothing with it, and against numbers of the papers.
#include "kernels/moments.hpp"
#include "kernels/taylor.hpp"
#include "verification/published_fits.hpp"

#include "support/particles.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

namespace ordo::test {
namespace {

using verification::fit_by_cholesky;
using verification::GramSchmidtFit;
using verification::Sample;

template <int D>
using Samples = std::vector<Sample<D>>;

struct Fit {
    double value;
    int dropped;
};

/// The engine's fit at a place, from moments about the origin of the samples.
template <int D, int degree>
Fit fit(const Samples<D>& samples, const Vec<D>& at = {})
{
    using M = Moments<D, degree, 1>;
    Lanes record[M::size]{};
    for (const Sample<D>& s : samples) M::add(record, s.x, s.weight, {s.value});
    double m[M::unknowns][M::unknowns], b[M::unknowns], p[M::unknowns], value = 0.0;
    M::matrix(record, m);
    M::right_side(record, 0, b);
    const Ldl<M::unknowns> system(m);
    system.solve(b);
    Monomials<D, degree>::evaluate(at, p);
    for (int k = 0; k < M::unknowns; ++k) value += p[k] * b[k];
    return {value, system.dropped};
}

/// The same at the origin, from the record that `spread` leaves at a node which stands there.
template <int D, int degree, int W>
Fit fit_spread(const Samples<D>& samples)
{
    using M = Moments<D, degree, 1>;
    const Lattice<D> g({}, Vec<D>::filled(1.0), Index<D>::filled(6), {}, 3);
    const Index<D> node = Index<D>::filled(6);
    std::vector<Lanes> records(g.node_count() * M::size, Lanes{});
    for (const Sample<D>& s : samples) {
        Vec<D> y = s.x;
        for (int a = 0; a < D; ++a) y[a] += node[a];
        M::template spread<HatNodes, W>(g, records.data(), y, {s.value});
    }
    double m[M::unknowns][M::unknowns], x[M::unknowns], b[M::unknowns], value = 0.0;
    M::matrix(&records[g.offset(node) * M::size], m);
    M::right_side(&records[g.offset(node) * M::size], 0, b);
    const Ldl<M::unknowns> system(m);
    system.first_row(x);
    for (int k = 0; k < M::unknowns; ++k) value += x[k] * b[k];
    return {value, system.dropped};
}

template <int W, int D>
Sample<D> sample_at(const Vec<D>& x, double value)
{
    Sample<D> s{x, 1.0, value};
    for (int a = 0; a < D; ++a) s.weight *= spline_weight<W>(x[a]);
    return s;
}

/// Samples of random values at random places in the support of the weight around the origin.
template <int D, int W>
Samples<D> random_samples(Random& random, int count)
{
    Samples<D> samples;
    for (int s = 0; s < count; ++s) {
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = uniform(random, -0.5 * W, 0.5 * W);
        samples.push_back(sample_at<W>(x, uniform(random, -1, 1)));
    }
    return samples;
}

/// Samples at x = start + t direction + s across, t and s random: on a plane, on a line where `across` is zero.
template <int D>
Samples<D> flat_samples(Random& random, int count, const Vec<D>& start, const Vec<D>& direction, const Vec<D>& across = {})
{
    Samples<D> samples;
    for (int s = 0; s < count; ++s) {
        const double t = uniform(random, -1, 1), r = uniform(random, -1, 1);
        samples.push_back(sample_at<4>(start + t * direction + r * across, uniform(random, -1, 1)));
    }
    return samples;
}

/// f(D, degree) for 1D to 3D and degrees up to 3, as integral constants.
template <class F>
void for_each_fit(F&& f)
{
    auto degrees = [&]<int D>(std::integral_constant<int, D> d) {
        f(d, std::integral_constant<int, 0>{});
        f(d, std::integral_constant<int, 1>{});
        f(d, std::integral_constant<int, 2>{});
        f(d, std::integral_constant<int, 3>{});
    };
    degrees(std::integral_constant<int, 1>{});
    degrees(std::integral_constant<int, 2>{});
    degrees(std::integral_constant<int, 3>{});
}

// ---- moving least squares --------------------------------------------------------------------------------------------

template <int D, int degree, int W>
void compare_regular(Random& random)
{
    SCOPED_TRACE("D " + std::to_string(D) + " degree " + std::to_string(degree) + " width " + std::to_string(W));
    for (int trial = 0; trial < 20; ++trial) {
        const auto samples = random_samples<D, W>(random, 4 * Monomials<D, degree>::count);
        const Fit engine = fit<D, degree>(samples), spread = fit_spread<D, degree, W>(samples);
        EXPECT_EQ(engine.dropped, 0);
        EXPECT_EQ(spread.dropped, 0);
        EXPECT_NEAR(engine.value, (GramSchmidtFit<D, degree>{}(samples, {})), 1e-12);
        EXPECT_NEAR(engine.value, (fit_by_cholesky<D, degree>(samples, {})), 1e-12);
        EXPECT_NEAR(engine.value, spread.value, 1e-12);
    }
}

TEST(Reconstruction, OfRegularSamplesEqualsGramSchmidtAndCholesky)
{
    Random random(21);
    for_each_fit([&]<int D, int degree>(std::integral_constant<int, D>, std::integral_constant<int, degree>) {
        compare_regular<D, degree, 2>(random);
        compare_regular<D, degree, 3>(random);
        compare_regular<D, degree, 4>(random);
    });
}

template <int D, int degree>
void compare_deficient(const Samples<D>& samples, int rank)
{
    SCOPED_TRACE("D " + std::to_string(D) + " degree " + std::to_string(degree));
    const Fit engine = fit<D, degree>(samples), spread = fit_spread<D, degree, 4>(samples);
    EXPECT_EQ(engine.dropped, (Monomials<D, degree>::count - rank));
    EXPECT_EQ(spread.dropped, engine.dropped);
    const double reference = GramSchmidtFit<D, degree>{}(samples, {});
    EXPECT_NEAR(engine.value, reference, 1e-12 * std::max(1.0, std::fabs(reference)));
    EXPECT_NEAR(spread.value, reference, 1e-12 * std::max(1.0, std::fabs(reference)));
}

TEST(Reconstruction, OfDeficientSamplesEqualsGramSchmidt)
{
    Random random(22);
    for (int trial = 0; trial < 20; ++trial) {
        // A line is a polynomial of one variable, a plane one of two.
        const auto line = flat_samples<2>(random, 16, {0.3, -0.2}, {0.7, 1.1});
        compare_deficient<2, 1>(line, 2);
        compare_deficient<2, 2>(line, 3);
        compare_deficient<2, 3>(line, 4);
        const auto upright = flat_samples<2>(random, 16, {0.3, -0.2}, {0.0, 1.5});
        compare_deficient<2, 1>(upright, 2);
        compare_deficient<2, 2>(upright, 3);
        const auto thread = flat_samples<3>(random, 16, {0.3, -0.2, 0.1}, {0.7, 1.1, -0.9});
        compare_deficient<3, 1>(thread, 2);
        compare_deficient<3, 2>(thread, 3);
        const auto plane = flat_samples<3>(random, 48, {0.3, -0.2, 0.1}, {0.7, 0.4, -0.3}, {-0.5, 0.6, 0.8});
        compare_deficient<3, 1>(plane, 3);
        compare_deficient<3, 2>(plane, 6);
        compare_deficient<3, 3>(plane, 10);
    }
}

TEST(Reconstruction, OfFewSamplesEqualsGramSchmidt)
{
    // Fewer samples than unknowns: as many monomials as samples stay, and the fit goes through all of them.
    Samples<2> corners;
    const Vec<2> places[] = {{-1.2, -0.5}, {0.7, -1.1}, {-0.3, 0.8}, {1.3, 0.6}, {0.1, -0.1}};
    for (int n = 1; n <= 5; ++n) {
        corners.push_back(sample_at<4>(places[n - 1], 0.3 * n * n - 1));
        compare_deficient<2, 2>(corners, n);
        compare_deficient<2, 3>(corners, n);
        for (const Sample<2>& s : corners) EXPECT_NEAR((fit<2, 2>(corners, s.x).value), s.value, 1e-12);
    }
    Samples<3> three{sample_at<4>(Vec<3>{0.1, 0.9, -0.3}, 1.0), sample_at<4>(Vec<3>{-0.8, 0.2, 0.5}, -2.0),
                     sample_at<4>(Vec<3>{0.4, -0.7, 0.6}, 0.5)};
    compare_deficient<3, 1>(three, 3);
    compare_deficient<3, 2>(three, 3);
}

/// Tran et al. (2019), Figs. 1 to 3 and their appendix: polynomials of degree 2 from two or three points.
TEST(Reconstruction, PolynomialsOfTranFigures)
{
    auto moments = [](const std::vector<double>& places) {
        Lanes record[Moments<1, 2, 1>::size]{};
        for (double x : places) Moments<1, 2, 1>::add(record, {x}, spline_weight<4>(x), {std::exp(x)});
        double M[3][3];
        Moments<1, 2, 1>::matrix(record, M);
        return Ldl<3>(M);
    };
    // Fig. 1: x and x^2 less their means, <x^2, x> = 0.
    const Ldl<3> equal = moments({-0.5, 0.0, 0.5});
    const double w0 = 2.0 / 3, w1 = 23.0 / 48;  // eq. 10 at 0 and 1/2
    EXPECT_EQ(equal.dropped, 0);
    EXPECT_NEAR(equal.L[1][0], 0.0, 1e-16);
    EXPECT_NEAR(equal.L[2][0], 0.5 * w1 / (w0 + 2 * w1), 1e-15);
    EXPECT_NEAR(equal.L[2][1], 0.0, 1e-16);
    EXPECT_EQ(moments({-0.99, 0.95, 0.9}).dropped, 0);  // Fig. 2
    // Fig. 3: <p_3, p_3> = 0, and the first two make the line through both points.
    const Ldl<3> two = moments({-0.1, 0.5});
    EXPECT_EQ(two.dropped, 1);
    EXPECT_EQ(two.D[2], 0.0);
    const Samples<1> both{sample_at<4>(Vec<1>{-0.1}, 3.0), sample_at<4>(Vec<1>{0.5}, 6.0)};
    EXPECT_NEAR((fit<1, 2>(both, {1.5}).value), 11.0, 1e-12);
}

// ---- monomials -------------------------------------------------------------------------------------------------------

template <int D>
Samples<D> shifted(Samples<D> samples, const Vec<D>& by)
{
    for (Sample<D>& s : samples) s.x += by;
    return samples;
}

template <int D, int degree>
void compare_shifted(const Samples<D>& samples)
{
    SCOPED_TRACE("D " + std::to_string(D) + " degree " + std::to_string(degree));
    Vec<D> origin{};
    for (int a = 0; a < D; ++a) origin[a] = a % 2 ? 0.5 : -1.0;
    const Fit relative = fit<D, degree>(samples), absolute = fit<D, degree>(shifted(samples, origin), origin);
    EXPECT_EQ(relative.dropped, absolute.dropped);
    EXPECT_NEAR(relative.value, absolute.value, 1e-12 * std::max(1.0, std::fabs(relative.value)));
}

/// The monomials that deficient samples leave contain, with each, all its divisors: the order is by degree and agrees with
/// products. What they span is then the same about any origin, and so is the fit (far from the origin but for round-off).
TEST(Monomials, ShiftedAndAbsoluteOnesGiveTheSameFit)
{
    Random random(23);
    for (int trial = 0; trial < 20; ++trial) {
        compare_shifted<1, 1>(random_samples<1, 4>(random, 8));
        compare_shifted<2, 1>(random_samples<2, 4>(random, 12));
        compare_shifted<2, 2>(random_samples<2, 4>(random, 24));
        compare_shifted<3, 1>(random_samples<3, 4>(random, 16));
        const auto line  = flat_samples<2>(random, 16, {0.3, -0.2}, {0.7, 1.1});
        const auto plane = flat_samples<3>(random, 48, {0.3, -0.2, 0.1}, {0.7, 0.4, -0.3}, {-0.5, 0.6, 0.8});
        compare_shifted<2, 1>(line);
        compare_shifted<2, 2>(line);
        compare_shifted<3, 1>(plane);
        compare_shifted<3, 2>(plane);
    }
    compare_shifted<2, 1>({sample_at<4>(Vec<2>{0.3, 0.7}, 2.0)});
    compare_shifted<2, 1>({sample_at<4>(Vec<2>{0.3, 0.7}, 2.0), sample_at<4>(Vec<2>{-0.2, 0.1}, 1.0)});
    compare_shifted<2, 2>({sample_at<4>(Vec<2>{0.3, 0.7}, 2.0), sample_at<4>(Vec<2>{-0.2, 0.1}, 1.0),
                           sample_at<4>(Vec<2>{0.9, -0.6}, 3.0), sample_at<4>(Vec<2>{-0.8, -0.9}, -1.0)});
}

/// Not so the order of the axes: of points on a line the first axis across stays.
TEST(Monomials, OrderOfAxesCountsForDeficientSamplesOnly)
{
    auto exchanged = [](Samples<2> samples) {
        for (Sample<2>& s : samples) std::swap(s.x[0], s.x[1]);
        return samples;
    };
    Random random(24);
    const auto regular = random_samples<2, 4>(random, 24);
    EXPECT_NEAR((fit<2, 1>(regular).value), (fit<2, 1>(exchanged(regular)).value), 1e-12);
    // u = x on the line y = x - 0.5: as a function of x it is 0 at the origin, as one of y it is 0.5.
    Samples<2> line;
    for (const double x : {-0.6, -0.1, 0.3, 0.8}) line.push_back(sample_at<4>(Vec<2>{x, x - 0.5}, x));
    EXPECT_NEAR((fit<2, 1>(line).value), 0.0, 1e-14);
    EXPECT_NEAR((fit<2, 1>(exchanged(line)).value), 0.5, 1e-14);
}

/// (0.4 + x - y/2 + z/4)^power.
template <int D>
double polynomial(const Vec<D>& x, int power)
{
    constexpr double factor[] = {1.0, -0.5, 0.25};
    double sum                = 0.4;
    for (int a = 0; a < D; ++a) sum += factor[a] * x[a];
    return std::pow(sum, power);
}

TEST(Reconstruction, ReproducesPolynomialsOfItsDegree)
{
    Random random(25);
    for_each_fit([&]<int D, int degree>(std::integral_constant<int, D>, std::integral_constant<int, degree>) {
        for (int power = 0; power <= degree + 1; ++power) {
            double largest = 0.0;
            for (int trial = 0; trial < 20; ++trial) {
                auto samples = random_samples<D, 4>(random, 6 * Monomials<D, degree>::count);
                for (Sample<D>& s : samples) s.value = polynomial<D>(s.x, power);
                largest = std::max(largest, std::fabs(fit<D, degree>(samples).value - polynomial<D>({}, power)));
            }
            SCOPED_TRACE("D " + std::to_string(D) + " degree " + std::to_string(degree) + " power " + std::to_string(power));
            if (power <= degree)
                EXPECT_LT(largest, 1e-13);
            else
                EXPECT_GT(largest, 1e-3);
        }
    });
}

TEST(Reconstruction, OfDegreeZeroIsShepard)
{
    Random random(26);
    const auto samples = random_samples<2, 4>(random, 20);
    Lanes record[Moments<2, 0, 1>::size]{};
    double sum = 0.0, weights = 0.0;
    for (const Sample<2>& s : samples) {
        Moments<2, 0, 1>::add(record, s.x, s.weight, {s.value});
        sum += s.weight * s.value;
        weights += s.weight;
    }
    EXPECT_NEAR((Moments<2, 0, 1>::mean(record, 0)), sum / weights, 1e-15);
    EXPECT_NEAR((fit<2, 0>(samples).value), sum / weights, 1e-15);
}

/// Gong (2015), Table 4.1, with h = 1/5: cells of [-1, 1], four equally spaced points in each.
TEST(Reconstruction, GivesGongTable)
{
    const double printed[3][3] = {{0, 0, 0}, {-0.0688, 0, 0.0687}, {0.1306, -0.0069, 0.1306}};  // first node, inner ones, last
    const double exact[3][3]   = {{0, 0, 0}, {-0.06875, 0, 0.06875}, {0.130625, -0.006875, 0.130625}};
    const Lattice<1> g({-1.0}, {0.2}, {10}, {}, 1);
    using M = Moments<1, 0, 1>;
    for (int power = 0; power <= 2; ++power) {
        std::vector<Lanes> records(g.node_count() * M::size, Lanes{});
        for (int s = 0; s < 40; ++s) {
            const double x = -1 + (s + 0.5) * 0.05;
            M::spread<HatNodes, 2>(g, records.data(), {g.cell_coordinate(0, x)}, {std::pow(x, power)});
        }
        for (int i = 0; i <= 10; ++i) {
            const double x     = g.node_position(0, i + 1);
            const double error = std::pow(x, power) - M::mean(&records[(i + 1) * M::size], 0);
            const int column   = i == 0 ? 0 : i == 10 ? 2 : 1;
            EXPECT_NEAR(error, exact[power][column], 1e-15) << "power " << power << " node " << i + 1;
            EXPECT_NEAR(error, printed[power][column], 0.5e-4 + 1e-15) << "power " << power << " node " << i + 1;
        }
    }
}

// ---- Taylor least squares --------------------------------------------------------------------------------------------

/// Least squares by Householder's reflections: min |A c - b|, A of full rank, one row a sample.
std::vector<double> solve_by_householder(std::vector<std::vector<double>> A, std::vector<double> b)
{
    const std::size_t m = A.size(), n = A[0].size();
    for (std::size_t k = 0; k < n; ++k) {
        double norm = 0.0;
        for (std::size_t i = k; i < m; ++i) norm += A[i][k] * A[i][k];
        norm = A[k][k] > 0 ? -std::sqrt(norm) : std::sqrt(norm);
        std::vector<double> v(m, 0.0);
        for (std::size_t i = k; i < m; ++i) v[i] = A[i][k];
        v[k] -= norm;
        double vv = 0.0;
        for (double e : v) vv += e * e;
        auto reflect = [&](auto&& entry) {
            double dot = 0.0;
            for (std::size_t i = k; i < m; ++i) dot += v[i] * entry(i);
            for (std::size_t i = k; i < m; ++i) entry(i) -= 2 * dot / vv * v[i];
        };
        for (std::size_t j = k; j < n; ++j) reflect([&](std::size_t i) -> double& { return A[i][j]; });
        reflect([&](std::size_t i) -> double& { return b[i]; });
    }
    std::vector<double> c(n);
    for (std::size_t k = n; k-- > 0;) {
        c[k] = b[k];
        for (std::size_t j = k + 1; j < n; ++j) c[k] -= A[k][j] * c[j];
        c[k] /= A[k][k];
    }
    return c;
}

/// The Taylor functions at a distance from the centre, in cells: monomials less their means over the cell.
template <int D, int degree>
std::vector<double> taylor_functions(const Vec<D>& x)
{
    constexpr int n = Monomials<D, degree>::count;
    double p[n];
    Monomials<D, degree>::evaluate(x, p);
    std::vector<double> r(p, p + n);
    for (int k = 1; k < n; ++k) {
        double mean = 1.0;
        for (int a = 0; a < D; ++a) {
            const int e = monomials<D, degree>.exponent[k][a] + 1;
            mean *= (std::pow(0.5, e) - std::pow(-0.5, e)) / e;
        }
        r[k] -= mean;
    }
    return r;
}

template <int D, int degree>
void compare_taylor(Random& random, bool keep_mean)
{
    SCOPED_TRACE("D " + std::to_string(D) + " degree " + std::to_string(degree) + (keep_mean ? " with mean" : ""));
    using T           = TaylorLeastSquares<D, degree, 1>;
    const double mean = 0.37;
    Lanes record[T::M::size]{};
    std::vector<std::vector<double>> A;
    std::vector<double> b;
    for (int s = 0; s < 4 * T::unknowns; ++s) {
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = uniform(random, -0.5, 0.5);
        const double u = uniform(random, -1, 1);
        T::M::add(record, x, 1.0, {u});
        A.push_back(taylor_functions<D, degree>(x));
        b.push_back(keep_mean ? u - mean : u);
        if (keep_mean) A.back().erase(A.back().begin());
    }
    std::vector<double> wanted = A[0].empty() ? std::vector<double>{} : solve_by_householder(A, b);
    if (keep_mean) wanted.insert(wanted.begin(), mean);
    const T taylor(record);
    typename T::Coefficients c;
    if (keep_mean)
        taylor.fit_with_mean(0, mean, c);
    else
        taylor.fit(0, c);
    EXPECT_EQ(taylor.dropped(), 0);
    EXPECT_EQ(taylor.dropped_with_mean(), 0);
    double integral = 0.0;
    for (int k = 0; k < 1 << D; ++k) {
        const Vec<D> x               = gauss_point<D>(k);
        const std::vector<double> at = taylor_functions<D, degree>(x);
        double value                 = 0.0;
        for (int j = 0; j < T::unknowns; ++j) value += wanted[j] * at[j];
        EXPECT_NEAR(T::evaluate(c, x), value, 1e-12);
        integral += T::evaluate(c, x) / (1 << D);
    }
    if (keep_mean) {
        EXPECT_NEAR(integral, mean, 1e-14);
    }
}

TEST(TaylorLeastSquares, EqualsHouseholder)
{
    Random random(27);
    for_each_fit([&]<int D, int degree>(std::integral_constant<int, D>, std::integral_constant<int, degree>) {
        for (int trial = 0; trial < 20; ++trial) {
            compare_taylor<D, degree>(random, false);
            compare_taylor<D, degree>(random, true);
        }
    });
}

/// Wobbes et al. (2020), sec. 2.1: sin x cos y from six points a cell, on [0, 5]^2 in cells of size 1.
TEST(TaylorLeastSquares, GivesWobbesExampleIn2D)
{
    using T        = TaylorLeastSquares<2, 2, 1>;
    auto u         = [](double x, double y) { return std::sin(x) * std::cos(y); };
    double squares = 0.0, integral = 0.0;
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j) {
            const double xc = i + 0.5, yc = j + 0.5;
            Lanes record[T::M::size]{};
            for (const double x : {-1.0 / 6, 1.0 / 6})
                for (const double y : {-0.25, 0.0, 0.25}) T::M::add(record, {x, y}, 1.0, {u(xc + x, yc + y)});
            const T taylor(record);
            EXPECT_EQ(taylor.dropped(), 1) << "x^2 is constant on two lines";
            EXPECT_EQ(taylor.dropped_with_mean(), 0) << "and the constant is not fitted here";
            T::Coefficients c;
            taylor.fit_with_mean(0, (std::cos(i) - std::cos(i + 1)) * (std::sin(j + 1) - std::sin(j)), c);
            for (int k = 0; k < 4; ++k) {
                const Vec<2> g     = gauss_point<2>(k);
                const double value = T::evaluate(c, g), e = value - u(xc + g[0], yc + g[1]);
                squares += e * e;
                integral += value / 4;
            }
        }
    const double exact = (1 - std::cos(5.0)) * std::sin(5.0);
    EXPECT_NEAR(std::sqrt(squares / 100), 6.1710e-3, 1e-7);
    EXPECT_LT(std::fabs(integral / exact - 1), 2e-15);
}

/// The same in 1D: sin x + 2 on [0, 4 pi] from three random points in each of four cells. The integral needs no luck.
TEST(TaylorLeastSquares, KeepsIntegralOfWobbesExampleIn1D)
{
    using T            = TaylorLeastSquares<1, 2, 1>;
    constexpr double h = std::numbers::pi;
    Random random(28);
    for (int trial = 0; trial < 50; ++trial) {
        double integral = 0.0;
        for (int i = 0; i < 4; ++i) {
            Lanes record[T::M::size]{};
            for (int s = 0; s < 3; ++s) {
                const double x = uniform(random, -0.5, 0.5);
                T::M::add(record, {x}, 1.0, {std::sin((i + 0.5 + x) * h) + 2});
            }
            const T taylor(record);
            EXPECT_EQ(taylor.dropped(), 0);
            T::Coefficients c;
            taylor.fit_with_mean(0, 2 + (std::cos(i * h) - std::cos((i + 1) * h)) / h, c);
            for (int k = 0; k < 2; ++k) integral += T::evaluate(c, gauss_point<1>(k)) * h / 2;
        }
        EXPECT_NEAR(integral / (8 * h), 1.0, 1e-14);
    }
}

}  // namespace
}  // namespace ordo::test
