// Adds the samples of many particles to the records of their targets, window by window: the fast form of Moments::spread.
//
// Samples with the same W^D targets share a window. Their moments about its middle, times the weight of each target, are summed
// in registers; the shift from the middle to the targets and the addition to the records are done once per window.
#pragma once

#include "kernels/moments.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace ordo {

/// Collects samples, then spreads them to targets one cell apart, W targets per axis and sample.
template <int D, int degree, int fields, class Places, int W, int totals = 0>
class MomentWindows {
    static_assert(Places::is_even);
    using M = Moments<D, degree, fields, totals>;

  public:
    /// Adds samples at cell coordinates y with values u, in the first `count` lanes; the other lanes must repeat some of them.
    ORDO_FLAT void add(const Vec<D, Lanes>& y, const Lanes (&u)[M::values], int count)
    {
        if (kept_[0].size() < static_cast<std::size_t>(count_) + 8)
            for (auto& numbers : kept_) numbers.resize(2 * numbers.size() + 64);
        for (int a = 0; a < D; ++a) {
            Lanes place;
            const Lanes first = Places::template first<W>(y[a], place);
            keep(a, first);
            keep(D + a, place - middle);
            low_[a]  = count_ == 0 ? first : smaller(low_[a], first);
            high_[a] = count_ == 0 ? first : larger(high_[a], first);
        }
        for (int f = 0; f < M::values; ++f) keep(2 * D + f, u[f]);
        count_ += count;
    }

    /// Adds all samples to the records of their targets and forgets them; fields from `used` on are left out. Sums are in the
    /// order of the samples.
    void spread(const Lattice<D>& g, Lanes* records, int used = fields)
    {
        if (count_ == 0) return;
        used_ = used == fields ? M::numbers : M::products + used * M::unknowns;
        for (int t = 0; t < targets; ++t) offset_[t] = g.offset(window.place[t]) * M::size;
        sort();
        Lanes weight[batch][parts];
        alignas(64) double number[M::numbers][batch];
        Sums sums{};
        int w = 0;
        for (int begin = 0, end; begin < count_; begin = end) {
            end = smaller(begin + batch, count_);
            for (int i = begin; i < end; i += 8) prepare(&order_[i], smaller(8, end - i), i - begin, weight, number);
            for (int i = begin, next; i < end; i = next) {
                while (begin_[w + 1] <= i) ++w;
                next = smaller(begin_[w + 1], end);
                add_samples(sums, i == begin_[w], weight, number, i - begin, next - begin);
                if (next == begin_[w + 1]) add_to_records(g, records, order_[i], sums);
            }
        }
        count_ = 0;
    }

  private:
    static constexpr double middle = 0.5 * (W - 1);
    static constexpr int targets   = power_of(W, D);
    static constexpr int parts     = (targets + 7) / 8;    ///< Lanes of one number for all targets
    static constexpr int batch     = parts > 2 ? 32 : 64;  ///< samples whose weights and numbers are prepared at once
#if defined(__AVX512F__)
    static constexpr int wide = parts, registers = 24;
#else
    static constexpr int wide = smaller(parts, 2), registers = 6;
#endif
    static constexpr int most = smaller(registers / wide, M::numbers);  ///< numbers whose sums for `wide` parts fit in registers

    using Sums = Lanes[M::size * 8][parts];

    ORDO_FLAT void keep(int number, const Lanes& value) { __builtin_memcpy(kept_[number].data() + count_, &value, sizeof value); }
    ORDO_FLAT double first(int a, int sample) const { return kept_[a][sample]; }

    /// Sorts samples by windows: those of window w are order_[begin_[w]] to order_[begin_[w + 1] - 1].
    void sort()
    {
        std::array<int, D> low, step;
        int windows = 1;
        for (int a = 0; a < D; ++a) {
            low[a]  = static_cast<int>(-largest(-low_[a]));
            step[a] = windows;
            windows *= static_cast<int>(largest(high_[a])) - low[a] + 1;
        }
        window_.resize(kept_[0].size());
        begin_.assign(windows + 1, 0);
        for (int i = 0; i < count_; i += 8) {
            Lanes w{};
            for (int a = 0; a < D; ++a) {
                Lanes first;
                __builtin_memcpy(static_cast<void*>(&first), &kept_[a][i], sizeof first);
                w += (first - low[a]) * step[a];
            }
            to_int(w, &window_[i]);
        }
        for (int i = 0; i < count_; ++i) ++begin_[window_[i]];
        for (int w = 0, sum = 0; w <= windows; ++w) begin_[w] = sum += begin_[w];
        order_.resize(count_);
        for (int i = count_; i-- > 0;) order_[--begin_[window_[i]]] = i;
    }

    /// Adds the sums of the window of this sample to the records.
    void add_to_records(const Lattice<D>& g, Lanes* records, int sample, Sums& sums) const
    {
        shift(sums);
        Index<D> at{};
        for (int a = 0; a < D; ++a) at[a] = static_cast<int>(first(a, sample));
        Lanes* to = records + g.offset(at) * M::size;
        for (int q = 0; q < parts; ++q)
            for (int part = 0; part < M::size && 8 * part < used_; ++part) {
                Lanes block[8];  // eight numbers of eight targets
                for (int n = 0; n < 8; ++n) block[n] = sums[8 * part + n][q];
                transpose(block);
                for (int k = 0; k < smaller(8, targets - 8 * q); ++k) to[offset_[8 * q + k] + part] += block[k];
            }
    }

    /// sums += weight of each target times each number, over samples [begin, end) of the batch; sums start at zero if `are_new`.
    void add_samples(Sums& sums, bool are_new, const Lanes (&weight)[batch][parts], const double (&number)[M::numbers][batch],
                     int begin, int end) const
    {
        for (int q = 0; q < parts; q += wide) {
            int n = 0;
            for (; n + most <= used_; n += most) add_products<most>(sums, are_new, n, q, weight, number, begin, end);
            for (; n < used_; ++n) add_products<1>(sums, are_new, n, q, weight, number, begin, end);
        }
    }

    /// Weights and numbers of up to eight samples of any windows, stored as i, i + 1, ... of the batch; spare ones repeat the
    /// last.
    ORDO_FLAT void prepare(const int* sample, int count, int i, Lanes (&weight)[batch][parts],
                           double (&number)[M::numbers][batch]) const
    {
        int at[8];
        for (int k = 0; k < 8; ++k) at[k] = sample[smaller(k, count - 1)];
        auto get = [&](int kept) {
            const double* p = kept_[kept].data();
            return make_lanes(p[at[0]], p[at[1]], p[at[2]], p[at[3]], p[at[4]], p[at[5]], p[at[6]], p[at[7]]);
        };
        Vec<D, Lanes> place;
        Lanes u[M::values], numbers[M::numbers], row[D][W];
        for (int a = 0; a < D; ++a) {
            place[a] = get(D + a);
            spline_row<W>(place[a] + middle, row[a]);
        }
        for (int f = 0; f < M::values; ++f) u[f] = get(2 * D + f);
        M::evaluate(place, u, numbers);
        for (int n = 0; n < M::numbers; ++n) __builtin_memcpy(&number[n][i], &numbers[n], sizeof(Lanes));

        Lanes outer[power_of(W, D - 1) + 1];  // products of the weights along the other axes, and zero for spare targets
        outer[power_of(W, D - 1)] = Lanes{};
        for (int k = 0; k < power_of(W, D - 1); ++k) {
            outer[k] = D > 1 ? row[D > 1][k % W] : Lanes(1.0);
            if constexpr (D > 2) outer[k] *= row[2][k / W];
        }
        for (int q = 0; q < parts; ++q) {
            Lanes block[8];  // eight targets of eight samples
            for (int k = 0; k < 8; ++k) block[k] = outer[window.outer[8 * q + k]] * row[0][window.place[8 * q + k][0]];
            transpose(block);
            for (int k = 0; k < 8; ++k) weight[i + k][q] = block[k];
        }
    }
    /// The same for `count` numbers from n on and the targets of `wide` parts from q on.
    template <int count>
    ORDO_FLAT static void add_products(Sums& sums, bool are_new, int n, int q, const Lanes (&weight)[batch][parts],
                                       const double (&number)[M::numbers][batch], int begin, int end)
    {
        Lanes sum[count][wide];
#pragma GCC unroll 24
        for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
            for (int r = 0; r < wide; ++r) sum[k][r] = are_new ? Lanes{} : sums[n + k][q + r];
        for (int i = begin; i < end; ++i) {
            if constexpr (count < wide) {  // the fewer factors stay in registers with the sums
                double u[count];
#pragma GCC unroll 8
                for (int k = 0; k < count; ++k) u[k] = number[n + k][i];
#pragma GCC unroll 8
                for (int r = 0; r < wide; ++r) {
                    const Lanes w = in_register(weight[i][q + r]);
#pragma GCC unroll 8
                    for (int k = 0; k < count; ++k) sum[k][r] += w * u[k];
                }
            } else {
                Lanes w[wide];
#pragma GCC unroll 8
                for (int r = 0; r < wide; ++r) w[r] = in_register(weight[i][q + r]);
#pragma GCC unroll 24
                for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
                    for (int r = 0; r < wide; ++r) sum[k][r] += w[r] * number[n + k][i];
            }
        }
#pragma GCC unroll 24
        for (int k = 0; k < count; ++k)
#pragma GCC unroll 8
            for (int r = 0; r < wide; ++r) sums[n + k][q + r] = sum[k][r];
    }

    /// Moments about the middle of the window become moments about each target: axis by axis, m(e) -= d m(e - 1) for powers e
    /// from the highest down to 1, 2, ..., which turns s^e into (s - d)^e.
    ORDO_FLAT static void shift(Sums& sums)
    {
        static constexpr Steps steps;
        auto step = [&](int n) {
            for (int q = 0; q < parts; ++q) {
                Lanes back;
                __builtin_memcpy(static_cast<void*>(&back), window.back[steps.axis[n]][q], sizeof back);
                sums[steps.to[n]][q] += sums[steps.from[n]][q] * back;
            }
        };
        if constexpr (parts <= 2) {  // few parts stay in registers
#pragma GCC unroll 64
            for (int n = 0; n < steps.count; ++n) step(n);
        } else {
            for (int n = 0; n < steps.count; ++n) step(n);
        }
    }
    struct Steps {
        static constexpr int most = 1 + M::numbers * D * 2 * degree;  // each number changes as often as its power

        int count = 0;
        int axis[most]{}, to[most]{}, from[most]{};

        constexpr Steps()
        {
            for (int a = 0; a < D; ++a) {
                add<2 * degree>(a, 0);
                for (int f = 0; f < fields; ++f) add<degree>(a, M::products + f * M::unknowns);
            }
        }
        template <int highest>
        constexpr void add(int a, int offset)
        {
            constexpr Monomials<D, highest> all;
            for (int lowest = 1; lowest <= highest; ++lowest)
                for (int e = highest; e >= lowest; --e)
                    for (int k = 0; k < all.count; ++k) {
                        Index<D> down = all.exponent[k];
                        if (down[a]-- != e) continue;
                        axis[count]   = a;
                        to[count]     = offset + k;
                        from[count++] = offset + all.find(down);
                    }
        }
    };

    /// The targets of a window, the first axis fastest.
    struct Window {
        Index<D> place[8 * parts]{};
        int outer[8 * parts]{};                  ///< the place along the axes after the first; W^(D-1) for spare targets
        alignas(64) double back[D][parts][8]{};  ///< distance from the targets to the middle

        constexpr Window()
        {
            for (int t = 0; t < 8 * parts; ++t) outer[t] = t < targets ? t / W : power_of(W, D - 1);
            for (int t = 0; t < targets; ++t)
                for (int a = 0, left = t; a < D; ++a, left /= W) {
                    place[t][a]           = left % W;
                    back[a][t / 8][t % 8] = middle - place[t][a];
                }
        }
    };
    static constexpr Window window{};

    // For each sample: first target and distance from the middle of the window along each axis, cells; values of the fields.
    std::array<std::vector<double>, 2 * D + M::values> kept_;
    Vec<D, Lanes> low_{}, high_{};  ///< bounds of the first targets
    int count_ = 0, used_ = 0;
    std::vector<int> window_, order_, begin_;
    std::array<std::ptrdiff_t, targets> offset_;  ///< of the record of each target from that of the first
};

}  // namespace ordo
