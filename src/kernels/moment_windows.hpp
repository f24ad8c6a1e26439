// Samples of many particles added to the records of their targets, window by window: the fast form of Moments::spread.
//
// Samples with the same W^D targets share a window. Their moments about its middle, times the weight of each target, are sums
// that stay in registers; the shift from the middle to the targets and the addition to the records come once a window.
#pragma once

#include "kernels/moments.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace ordo {

/// Gathers samples, then spreads them: for targets one cell apart that samples count W wide at.
template <int D, int degree, int fields, class Places, int W>
class MomentWindows {
    static_assert(Places::is_even);
    using M = Moments<D, degree, fields>;

  public:
    /// A sample at cell coordinates y.
    void add(const Vec<D>& y, const double (&u)[fields])
    {
        Sample s{};
        for (int a = 0; a < D; ++a) {
            s.first[a] = Places::template first<W>(y[a]);
            s.place[a] = Places::distance(y[a], s.first[a]) - middle;
        }
        for (int f = 0; f < fields; ++f) s.u[f] = u[f];
        samples_.push_back(s);
    }

    /// Adds all samples to the records of their targets and forgets them. The sums have one order, that of the samples.
    void spread(const Lattice<D>& g, Lanes* records)
    {
        if (samples_.empty()) return;
        sort();
        for (std::size_t w = 0; w + 1 < begin_.size(); ++w)
            if (begin_[w] < begin_[w + 1]) add_window(g, records, begin_[w], begin_[w + 1]);
        samples_.clear();
    }

  private:
    struct Sample {
        Vec<D> place;  ///< from the middle of the window, cells: -1/2 to 1/2
        double u[fields];
        Index<D> first;
    };

    static constexpr double middle = 0.5 * (W - 1);
    static constexpr int targets   = power_of(W, D);
    static constexpr int parts     = (targets + 7) / 8;  ///< Lanes of one number for all targets
    static constexpr int batch     = 16;                 ///< samples whose weights and numbers are kept at hand

    using Sums = Lanes[M::size * 8][parts];

    /// Finds the order by windows: the samples of window w are those from order_[begin_[w]] on.
    void sort()
    {
        Index<D> lo = samples_.front().first, hi = lo;
        for (const Sample& s : samples_)
            for (int a = 0; a < D; ++a) {
                lo[a] = smaller(lo[a], s.first[a]);
                hi[a] = larger(hi[a], s.first[a]);
            }
        auto window = [&](const Sample& s) {
            int w = 0;
            for (int a = D - 1; a >= 0; --a) w = w * (hi[a] - lo[a] + 1) + s.first[a] - lo[a];
            return w;
        };
        int windows = 1;
        for (int a = 0; a < D; ++a) windows *= hi[a] - lo[a] + 1;
        begin_.assign(windows + 1, 0);
        for (const Sample& s : samples_) ++begin_[window(s)];
        for (int w = 0, sum = 0; w <= windows; ++w) begin_[w] = sum += begin_[w];
        order_.resize(samples_.size());
        for (std::size_t i = samples_.size(); i-- > 0;) order_[--begin_[window(samples_[i])]] = static_cast<int>(i);
    }

    /// Samples [begin, end), all of one window.
    void add_window(const Lattice<D>& g, Lanes* records, int begin, int end) const
    {
        Sums sums{};
        for (int i = begin; i < end; i += batch) add_batch(sums, i, smaller(i + batch, end));
        shift(sums);
        Lanes* first = records + g.offset(samples_[order_[begin]].first) * M::size;
        for (int q = 0; q < parts; ++q)
            for (int part = 0; part < M::size; ++part) {
                Lanes block[8];  // eight numbers of eight targets
                for (int n = 0; n < 8; ++n) block[n] = sums[8 * part + n][q];
                transpose(block);
                for (int t = 8 * q; t < smaller(8 * q + 8, targets); ++t) {
                    std::ptrdiff_t target = 0;
                    for (int a = 0; a < D; ++a) target += g.stride[a] * steps.place[t][a];
                    first[target * M::size + part] += block[t % 8];
                }
            }
    }

    /// sums += weight of each target times each number, over samples [begin, end).
    void add_batch(Sums& sums, int begin, int end) const
    {
        constexpr int most = parts > 8 ? 1 : 24 / parts;  // numbers whose sums fit the registers
        double row[batch][D][W], number[batch][M::numbers];
        Lanes weight[batch][parts];
        for (int i = begin; i < end; ++i) {
            const Sample& s = samples_[order_[i]];
            for (int a = 0; a < D; ++a) spline_row<W>(s.place[a] + middle, row[i - begin][a]);
            M::evaluate(s.place, s.u, number[i - begin]);
        }
        for (int i = 0; i < end - begin; ++i) set_weights(row[i], weight[i]);
        constexpr int rest = M::numbers % most;
        for (int n = 0; n < M::numbers - rest; n += most) add_products<most>(sums, n, weight, number, end - begin);
        if constexpr (rest > 0) add_products<rest>(sums, M::numbers - rest, weight, number, end - begin);
    }
    template <int count>
    static void add_products(Sums& sums, int n, const Lanes (&weight)[batch][parts], const double (&number)[batch][M::numbers],
                             int samples)
    {
        Lanes sum[count][parts];
#pragma GCC unroll 24
        for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
            for (int q = 0; q < parts; ++q) sum[k][q] = sums[n + k][q];
        for (int i = 0; i < samples; ++i) {
#pragma GCC unroll 24
            for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
                for (int q = 0; q < parts; ++q) sum[k][q] += weight[i][q] * number[i][n + k];
        }
#pragma GCC unroll 24
        for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
            for (int q = 0; q < parts; ++q) sums[n + k][q] = sum[k][q];
    }

    /// The weight of a sample at each target, the first axis fastest; spare lanes are zero.
    static void set_weights(const double (&row)[D][W], Lanes (&weight)[parts])
    {
        auto* w = reinterpret_cast<double*>(weight);
        if constexpr (targets % 8 != 0) weight[parts - 1] = Lanes{};
        if constexpr (D == 1)
            for (int i = 0; i < W; ++i) w[i] = row[0][i];
        if constexpr (D == 2)
            for (int j = 0; j < W; ++j)
                for (int i = 0; i < W; ++i) w[j * W + i] = row[1][j] * row[0][i];
        if constexpr (D == 3)
            for (int k = 0; k < W; ++k)
                for (int j = 0; j < W; ++j) {
                    const double outer = row[2][k] * row[1][j];
                    for (int i = 0; i < W; ++i) w[(k * W + j) * W + i] = outer * row[0][i];
                }
    }

    /// Moments about the middle of the window become those about each target: axis by axis, m(e) -= d m(e - 1) for powers e
    /// from the highest down to 1, 2, ..., which makes (s - d)^e of s^e.
    static void shift(Sums& sums)
    {
        for (int a = 0; a < D; ++a)
            for (const auto& [to, from] : steps.of[a])
                for (int q = 0; q < parts; ++q) sums[to][q] += sums[from][q] * steps.back[a][q];
    }
    struct Step {
        int to, from;
    };
    struct Steps {
        Index<D> place[targets]{};  ///< of the targets in their window
        std::array<std::vector<Step>, D> of;
        Lanes back[D][parts]{};  ///< from the targets to the middle

        Steps()
        {
            int t = 0;
            IndexBox<D>{{}, Index<D>::filled(W)}.for_each([&](const Index<D>& k) {
                for (int a = 0; a < D; ++a) back[a][t / 8][t % 8] = middle - k[a];
                place[t++] = k;
            });
            for (int a = 0; a < D; ++a) {
                add<2 * degree>(a, 0);
                for (int f = 0; f < fields; ++f) add<degree>(a, M::products + f * M::unknowns);
            }
        }
        template <int highest>
        void add(int a, int offset)
        {
            constexpr Monomials<D, highest> all;
            for (int lowest = 1; lowest <= highest; ++lowest)
                for (int e = highest; e >= lowest; --e)
                    for (int k = 0; k < all.count; ++k) {
                        Index<D> down = all.exponent[k];
                        if (down[a]-- == e) of[a].push_back({offset + k, offset + all.find(down)});
                    }
        }
    };
    static inline const Steps steps{};

    std::vector<Sample> samples_;
    std::vector<int> order_, begin_;
};

}  // namespace ordo
