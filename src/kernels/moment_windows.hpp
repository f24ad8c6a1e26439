// Adds the samples of many particles to the records of their targets, window by window: the fast form of Moments::spread.
//
// Samples with the same W^D targets share a window. In a window a number of a record is a sum over samples of products of polynomials, one
// of each axis: the weight of a target times a power of the distance from it. So samples are summed once for all targets, as products of
// Bernstein polynomials. These sums become numbers of targets axis by axis: those of the windows of a row along x, those of rows along y,
// and of layers along z, where each target is visited once a row or layer and not once a window.
#pragma once

#include "kernels/moments.hpp"
#include "kernels/window_sort.hpp"

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

namespace ordo {

/// The weight of each of the W targets of a window, times a power e of the distance from it in cells, as sum of of[t][e][i] f^i s^(n - i)
/// with n = W - 1 + highest; f is the fraction of a cell in spline_row, s = 1 - f. All terms of a sum have one sign, but for powers about the
/// middle target of an odd W, so that small weights keep their digits.
template <int W, int highest>
struct WeightPolynomials {
    static constexpr int count = W + highest;  ///< terms

    double of[W][highest + 1][count]{};

    constexpr WeightPolynomials()
    {
        for (int t = 0; t < W; ++t)
            for (int e = 0; e <= highest; ++e) {
                const double before = 0.5 * W - 1 - t;
                set_spline(t, W - 1, of[t][e]);
                for (int k = 0; k < highest; ++k)  // the distance is (before + 1) f + before s, and 1 is f + s
                    multiply(of[t][e], W + k, k < e ? before + 1 : 1.0, k < e ? before : 1.0);
            }
    }

  private:
    /// c, of `terms` terms, becomes c (a f + b s).
    static constexpr void multiply(double* c, int terms, double a, double b)
    {
        for (int i = terms; i >= 0; --i) c[i] = (i > 0 ? a * c[i - 1] : 0.0) + (i < terms ? b * c[i] : 0.0);
    }
    /// Piece t of the spline of degree p from the pieces t and t - 1 of degree p - 1 (Cox and de Boor).
    static constexpr void set_spline(int t, int p, double* c)
    {
        if (p == 0) {
            c[0] = 1.0;
            return;
        }
        double same[W]{}, before[W]{};
        if (t < p) set_spline(t, p - 1, same);
        if (t > 0) set_spline(t - 1, p - 1, before);
        multiply(same, p, static_cast<double>(t) / p, static_cast<double>(t + 1) / p);
        multiply(before, p, static_cast<double>(p - t + 1) / p, static_cast<double>(p - t) / p);
        for (int i = 0; i <= p; ++i) c[i] = same[i] + before[i];
    }
};

/// Collects samples, then spreads them to targets one cell apart, W targets per axis and sample.
template <int D, int degree, int fields, class Places, int W, int totals = 0>
class MomentWindows {
    static_assert(D > 1);
    using M = Moments<D, degree, fields, totals>;

  public:
    /// Adds samples at cell coordinates y with values u, in the first `count` lanes; the other lanes must repeat some of them.
    ORDO_FLAT void add(const Vec<D, Lanes>& y, const Lanes (&u)[M::values], int count) { samples_.add(y, u, count); }

    /// Multiply-adds of eight lanes for each sample, in the sums of its window.
    static constexpr int work(int used = fields)
    {
        return sum_all([&](auto kind) { return kind.products * kind.used_parts(used); });
    }

    /// Adds all samples to the records of their targets and forgets them; fields from `used` on are left out, which
    /// goes with no totals. Sums are in the order of the samples of a window, then of windows. All records of the box of the targets
    /// are written: those without a sample get zeros added.
    void spread(const Lattice<D>& g, Lanes* records, int used = fields)
    {
        if (samples_.count() == 0) return;
        samples_.sort();
        used_  = used;
        nodes_ = samples_.extent() + Index<D>::filled(W - 1);
        begin_ = done_ = window_ = 0;
        int lines                = 1;
        for (int a = 1; a < D; ++a) {
            lines *= nodes_[a - 1];
            lines_[a].assign((lines + 7) * size_at(a), Lanes{});  // the last ones are read eight at a time
        }
        add_along<D - 1>(g, records);
        samples_.clear();
    }

  private:
    /// Numbers of a record that are summed alike: monomials of the distance up to a power, times each of some values, or times 1. Of
    /// values from `full` on only the sum without a distance is a number of the record.
    template <int highest, int values_, int full_, int first_value_, int first_number_>
    struct Kind {
        static constexpr int power = highest, values = values_, full = full_, first_value = first_value_,
                             first_number = first_number_;
        static constexpr int terms        = W + power;                 ///< polynomials of an axis
        static constexpr int products     = power_of(terms, D - 1);    ///< of polynomials of all axes but the last
        static constexpr int parts        = (terms * values + 7) / 8;  ///< Lanes of polynomials of the last axis times values
        static constexpr WeightPolynomials<W, power> weight{};

        /// Lanes of what is summed along the first A axes: monomials of these, times polynomials of those between, times parts.
        static constexpr int size_at(int A) { return binomial(power + A, A) * power_of(terms, D - 1 - A) * parts; }
        /// The values and parts that count where of all fields only the first `used` do.
        static constexpr int used_values(int used) { return first_value == 0 && used < fields ? used : values; }
        static constexpr int used_parts(int used) { return (terms * used_values(used) + 7) / 8; }
        /// The place in the record of monomial k times value v; -1 if it is not in it.
        static constexpr int number(int v, int k)
        {
            constexpr int count = Monomials<D, power>::count;
            return v < full ? first_number + v * count + k : k == 0 ? first_number + full * count + v - full : -1;
        }
    };
    static constexpr int parts_of(int values, int power) { return ((W + power) * values + 7) / 8; }
    /// Whether totals cost less among the right-hand sides, where they may fill spare lanes.
    static constexpr bool has_own_totals = totals > 0 && power_of(W, D - 1) * parts_of(totals, 0) <
                                                             power_of(W + degree, D - 1) *
                                                                 (parts_of(M::values, degree) - parts_of(fields, degree));
    using Matrix     = Kind<2 * degree, 1, 1, -1, 0>;
    using RightSides = Kind<degree, has_own_totals ? fields : M::values, fields, 0, M::products>;
    using Totals     = Kind<0, totals, totals, fields, M::products + fields * M::unknowns>;

    /// f(kind) for each kind.
    template <class F>
    ORDO_FLAT static void for_each_kind(F&& f)
    {
        f(Matrix{});
        f(RightSides{});
        if constexpr (has_own_totals) f(Totals{});
    }
    /// The sums of of(kind) over all kinds, and over those before K.
    template <class Of>
    static constexpr int sum_all(Of&& of)
    {
        return of(Matrix{}) + of(RightSides{}) + (has_own_totals ? of(Totals{}) : 0);
    }
    template <class K, class Of>
    static constexpr int sum_before(Of&& of)
    {
        return (K::first_number > 0 ? of(Matrix{}) : 0) + (K::first_number > M::products ? of(RightSides{}) : 0);
    }
    static constexpr int size_at(int A)
    {
        return sum_all([&](auto kind) { return kind.size_at(A); });
    }
    template <class K>
    static constexpr int offset_at(int A)
    {
        return sum_before<K>([&](auto kind) { return kind.size_at(A); });
    }

    static constexpr auto of_products = [](auto kind) { return kind.products; };
    static constexpr auto of_parts    = [](auto kind) { return kind.parts; };
    static constexpr int all_products = sum_all(of_products), all_parts = sum_all(of_parts);
    static constexpr int batch = 32;  ///< samples that are prepared at once
#if defined(__AVX512F__)
    static constexpr int in_registers = 12;  ///< sums
#else
    static constexpr int in_registers = 6;
#endif

    /// Sums of all windows of a line of axis A (of a row, of a layer, of all layers): returns whether there are any.
    template <int A>
    bool add_along(const Lattice<D>& g, Lanes* records)
    {
        bool has_samples = false;
        for (int k = 0; k < samples_.extent()[A]; ++k) {
            bool has = false;
            if constexpr (A == 0)
                has = add_window();
            else
                has = add_along<A - 1>(g, records);
            if (!has) continue;
            has_samples = true;
            if constexpr (A == D - 1)
                add_to_records(g, records, k);
            else
                sum_along<A>(k);
            if constexpr (A > 0) std::fill(lines_[A].begin(), lines_[A].end() - 7 * size_at(A), Lanes{});
        }
        return has_samples;
    }

    /// Sums over the samples of the next window; returns whether it has any.
    bool add_window()
    {
        const int begin = samples_.begin(window_), end = samples_.begin(++window_);
        for (int i = begin, next; i < end; i = next) {
            if (i == done_) {
                begin_ = done_;
                done_  = smaller(begin_ + batch, samples_.count());
                for (int k = begin_; k < done_; k += 8) prepare(k);
            }
            next = smaller(end, done_);
            for_each_kind([&](auto kind) {
                using K               = decltype(kind);
                constexpr int most    = in_registers / K::terms > 0 ? in_registers / K::terms * K::terms : in_registers;
                constexpr int product = sum_before<K>(of_products), part = sum_before<K>(of_parts);
                for (int q = 0; q < K::used_parts(used_); ++q) {
                    Lanes* sums = sums_ + offset_at<K>(0) + q;
                    int n       = 0;
                    for (; n + most <= K::products; n += most)
                        add_products<most, K::parts>(sums + n * K::parts, i == begin, product + n, part + q, i - begin_,
                                                     next - begin_);
                    if constexpr (constexpr int left = K::products % most; left > 0)
                        add_products<left, K::parts>(sums + n * K::parts, i == begin, product + n, part + q, i - begin_,
                                                     next - begin_);
                }
            });
        }
        return begin < end;
    }
    /// Adds `count` products, each times a part, over samples [begin, end) of the batch to sums that lie `stride` apart; they start at zero
    /// if `are_new`.
    template <int count, int stride>
    ORDO_FLAT void add_products(Lanes* sums, bool are_new, int product, int part, int begin, int end)
    {
        Lanes sum[count];
        for_constants<count>([&](auto k) ORDO_FLAT_LAMBDA { sum[k] = are_new ? Lanes{} : sums[k * stride]; });
        for (int i = begin; i < end; ++i) {
            const Lanes v = in_register(vector_[i][part]);
            for_constants<count>([&](auto k) ORDO_FLAT_LAMBDA { sum[k] += v * product_[product + k][i]; });
        }
        for_constants<count>([&](auto k) ORDO_FLAT_LAMBDA { sums[k * stride] = sum[k]; });
    }

    /// Products and parts of eight sorted samples from i on.
    ORDO_FLAT void prepare(int i)
    {
        Vec<D, Lanes> f;
        Lanes u[M::values];
        samples_.get(i, f, u);
        Powers of_f[D], of_s[D];
        for (int a = 0; a < D; ++a) {
            set_powers(f[a] - (0.5 * W - 1), of_f[a]);
            set_powers(0.5 * W - f[a], of_s[a]);
        }
        const int at = i - begin_;
        for_each_kind([&](auto kind) {
            using K = decltype(kind);
            Lanes x[K::terms], y[K::terms], z[K::terms];
            for_constants<K::terms>([&](auto k) ORDO_FLAT_LAMBDA {
                constexpr int of_other = K::terms - 1 - k;
                x[k]                   = of_f[0][k] * of_s[0][of_other];
                if constexpr (D > 2) y[k] = of_f[1][k] * of_s[1][of_other];
                z[k] = of_f[D - 1][k] * of_s[D - 1][of_other];
            });
            for_constants<K::products>([&](auto k) ORDO_FLAT_LAMBDA {
                Lanes p = x[k % K::terms];
                if constexpr (D > 2) p *= y[k / K::terms];
                __builtin_memcpy(&product_[sum_before<K>(of_products) + k][at], &p, sizeof p);
            });
            for_constants<K::parts>([&](auto q) ORDO_FLAT_LAMBDA {
                Lanes block[8];
                for_constants<8>([&](auto k) ORDO_FLAT_LAMBDA {
                    constexpr int n = 8 * q + k, value = n / K::terms;
                    if constexpr (value >= K::values)
                        block[k] = Lanes{};
                    else if constexpr (K::first_value < 0)
                        block[k] = z[n % K::terms];
                    else
                        block[k] = z[n % K::terms] * u[K::first_value + value];
                });
                transpose(block);
                for (int k = 0; k < 8; ++k) vector_[at + k][sum_before<K>(of_parts) + q] = block[k];
            });
        });
    }
    using Powers = Lanes[Matrix::terms];
    ORDO_FLAT static void set_powers(const Lanes& x, Powers& power)
    {
        power[0] = Lanes(1.0);
        for (int k = 1; k < Matrix::terms; ++k) power[k] = power[k - 1] * x;
    }

    /// The sum over terms of an axis for target t and a power of the distance.
    template <class K, int t, int power>
    ORDO_FLAT static Lanes combine(const Lanes (&term)[K::terms])
    {
        Lanes r{};
        for_constants<K::terms>([&](auto i) ORDO_FLAT_LAMBDA {
            if constexpr (constexpr double c = K::weight.of[t][power][i]; c != 0.0) r += term[i] * c;
        });
        return r;
    }
    /// f(t, e, number of monomial m of A coordinates times power e of the next one) for each target t of a window and power e.
    template <class K, int A, int m, class F>
    ORDO_FLAT static void for_each_target(F&& f)
    {
        constexpr int left = K::power - total<A, K::power>(m);
        for_constants<W>([&](auto t) ORDO_FLAT_LAMBDA {
            for_constants<left + 1>([&](auto e)
                                        ORDO_FLAT_LAMBDA { f(t, e, std::integral_constant<int, raised<A, K::power>(m, e)>{}); });
        });
    }

    /// Sums along axis A: what window or line k along it has goes to the W targets of this window or line.
    template <int A>
    void sum_along(int k)
    {
        int lines = 1;
        for (int a = 0; a < A; ++a) lines *= nodes_[a];
        for (int line = 0; line < lines; ++line)
            for_each_kind([&](auto kind) {
                using K            = decltype(kind);
                constexpr int rest = power_of(K::terms, D - 2 - A);
                const Lanes* from  = (A == 0 ? sums_ : &lines_[A][line * size_at(A)]) + offset_at<K>(A);
                Lanes* to          = &lines_[A + 1][(k * lines + line) * size_at(A + 1)] + offset_at<K>(A + 1);
                const int stride   = lines * size_at(A + 1);
                for_constants<binomial(K::power + A, A)>([&](auto m) ORDO_FLAT_LAMBDA {
                    for (int j = 0; j < rest; ++j)
                        for (int q = 0; q < K::used_parts(used_); ++q) {
                            Lanes term[K::terms];
                            for_constants<K::terms>(
                                [&](auto i) ORDO_FLAT_LAMBDA { term[i] = from[((m * rest + j) * K::terms + i) * K::parts + q]; });
                            for_each_target<K, A, m>([&](auto t, auto e, auto monomial) ORDO_FLAT_LAMBDA {
                                to[t * stride + (monomial * rest + j) * K::parts + q] += combine<K, t, e>(term);
                            });
                        }
                });
            });
    }
    /// The total power of monomial m of A coordinates.
    template <int A, int power>
    static constexpr int total(int m)
    {
        int r = 0;
        if constexpr (A > 0)
            for (int a = 0; a < A; ++a) r += monomials<A, power>.exponent[m][a];
        return r;
    }
    /// The number of monomial m of A coordinates times power e of the next one.
    template <int A, int power>
    static constexpr int raised(int m, int e)
    {
        Index<A + 1> exponent{};
        if constexpr (A > 0)
            for (int a = 0; a < A; ++a) exponent[a] = monomials<A, power>.exponent[m][a];
        exponent[A] = e;
        return monomials<A + 1, power>.find(exponent);
    }

    /// Sums along the last axis: what line k along it has goes to the records of the W targets.
    void add_to_records(const Lattice<D>& g, Lanes* records, int k)
    {
        constexpr int A = D - 1;
        IndexBox<D> rows{samples_.first(), samples_.first() + nodes_};
        rows.hi[0] = rows.lo[0] + 1;
        rows.lo[A] += k;
        rows.hi[A] = rows.lo[A] + 1;
        int line   = 0;
        rows.for_each([&](const Index<D>& row) {
            for (int x = 0; x < nodes_[0]; x += 8) {
                Lanes number[W][M::size * 8];
                for (int t = 0; t < W; ++t)
                    for (int n = used_ < fields ? M::products : M::numbers; n < M::size * 8; ++n) number[t][n] = Lanes{};
                for_each_kind([&](auto kind) {
                    using K           = decltype(kind);
                    const Lanes* from = &lines_[A][(line + x) * size_at(A)] + offset_at<K>(A);
                    for_constants<binomial(K::power + A, A)>([&](auto m) ORDO_FLAT_LAMBDA {
                        Lanes polynomials[K::parts][8];  // lanes are targets
                        for (int q = 0; q < K::parts; ++q) {
                            for (int i = 0; i < 8; ++i) polynomials[q][i] = from[i * size_at(A) + m * K::parts + q];
                            transpose(polynomials[q]);
                        }
                        for (int v = 0; v < K::used_values(used_); ++v) {
                            Lanes term[K::terms];
                            for (int i = 0; i < K::terms; ++i)
                                term[i] = polynomials[(v * K::terms + i) / 8][(v * K::terms + i) % 8];
                            for_each_target<K, A, m>([&](auto t, auto e, auto monomial) ORDO_FLAT_LAMBDA {
                                if (const int n = K::number(v, monomial); n >= 0) number[t][n] = combine<K, t, e>(term);
                            });
                        }
                    });
                });
                for (int t = 0; t < W; ++t) {
                    Lanes* to = records + (g.offset(row) + x * g.stride[0] + t * g.stride[A]) * M::size;
                    for (int part = 0; part < M::size; ++part) {
                        Lanes block[8];
                        for (int i = 0; i < 8; ++i) block[i] = number[t][8 * part + i];
                        transpose(block);
                        for (int i = 0; i < smaller(8, nodes_[0] - x); ++i) to[i * M::size + part] += block[i];
                    }
                }
            }
            line += nodes_[0];
        });
    }

    WindowSort<D, M::values, Places, W> samples_;
    // Products and parts of the samples from begin_ on, before done_; sums over the samples of a window.
    alignas(64) double product_[all_products][batch];
    Lanes vector_[batch][all_parts], sums_[size_at(0)];
    std::array<std::vector<Lanes>, D> lines_;  ///< sums along the first 1, 2, ... axes
    Index<D> nodes_{};                         ///< targets along each axis
    int used_ = fields, window_ = 0, begin_ = 0, done_ = 0;
};

/// Whether samples spread by windows; else Moments::spread does it.
template <int D, class Places>
inline constexpr bool has_windows = D > 1 && Places::is_even;

/// Multiply-adds of eight lanes for each sample.
template <int D, int degree, int fields, class Places, int W, int totals = 0>
constexpr int work_of_sample(int used = fields)
{
    if constexpr (has_windows<D, Places>)
        return MomentWindows<D, degree, fields, Places, W, totals>::work(used);
    else
        return power_of(W, D) * Moments<D, degree, fields, totals>::size;
}

}  // namespace ordo
