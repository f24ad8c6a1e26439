// Samples of many particles, sorted by windows: samples with the same W^D targets share a window.
#pragma once

#include "grid/lattice.hpp"
#include "shape/weights.hpp"

#include <algorithm>
#include <vector>

namespace ordo {

/// Collects samples with `values` numbers each. Targets are one cell apart, W along each axis.
template <int D, int values, class Places, int W>
class WindowSort {
    static_assert(Places::is_even);

  public:
    /// Adds samples at cell coordinates y with values u, in the first `count` lanes; the other lanes must repeat some of them.
    ORDO_FLAT void add(const Vec<D, Lanes>& y, const Lanes (&u)[values], int count)
    {
        if (samples_.size() < static_cast<std::size_t>(count_) + 8) {
            samples_.resize(2 * samples_.size() + 64);
            for (auto& numbers : window_of_) numbers.resize(samples_.size());
        }
        Lanes number[8 * parts]{};
        for (int a = 0; a < D; ++a) {
            const Lanes first = Places::template first<W>(y[a], number[a]);
            to_int(first, &window_of_[a][count_]);
            low_[a]  = count_ == 0 ? first : smaller(low_[a], first);
            high_[a] = count_ == 0 ? first : larger(high_[a], first);
        }
        for (int f = 0; f < values; ++f) number[D + f] = u[f];
        for (int q = 0; q < parts; ++q) {
            Lanes block[8];
            for (int k = 0; k < 8; ++k) block[k] = number[8 * q + k];
            transpose(block);
            for (int k = 0; k < 8; ++k) samples_[count_ + k].part[q] = block[k];
        }
        count_ += count;
    }

    int count() const { return count_; }
    /// Forgets all samples.
    void clear() { count_ = 0; }

    /// Sorts samples by windows, the first axis fastest: those of window w are begin(w) to begin(w + 1) - 1.
    void sort()
    {
        Index<D> step;
        int windows = 1;
        for (int a = 0; a < D; ++a) {
            first_[a]  = static_cast<int>(-largest(-low_[a]));
            extent_[a] = static_cast<int>(largest(high_[a])) - first_[a] + 1;
            step[a]    = windows;
            windows *= extent_[a];
        }
        begin_.assign(windows + 1, 0);
        std::vector<int>& window = window_of_[0];
        for (int i = 0; i < count_; ++i) {
            int w = window[i] - first_[0];
            for (int a = 1; a < D; ++a) w += (window_of_[a][i] - first_[a]) * step[a];
            window[i] = w;
        }
        for (int i = 0; i < count_; ++i) ++begin_[window[i]];
        for (int w = 0, sum = 0; w <= windows; ++w) begin_[w] = sum += begin_[w];
        order_.resize(count_ + 7);  // get() reads eight, the last ones are not used
        for (int i = count_; i-- > 0;) order_[--begin_[window[i]]] = i;
    }
    int begin(int window) const { return begin_[window]; }
    const Index<D>& first() const { return first_; }    ///< the first target of the first window
    const Index<D>& extent() const { return extent_; }  ///< windows along each axis

    /// Distances from the first targets of their windows, in cells, and values of eight sorted samples from i on; those after the last
    /// are of any samples.
    ORDO_FLAT void get(int i, Vec<D, Lanes>& distance, Lanes (&u)[values]) const
    {
        for (int q = 0; q < parts; ++q) {
            Lanes block[8];
            for (int k = 0; k < 8; ++k) block[k] = samples_[order_[i + k]].part[q];
            transpose(block);
            for (int k = 0; k < 8; ++k) {
                if (const int n = 8 * q + k; n < D)
                    distance[n] = block[k];
                else if (n < D + values)
                    u[n - D] = block[k];
            }
        }
    }

  private:
    static constexpr int parts = (D + values + 7) / 8;
    struct Sample {
        Lanes part[parts];  // distance from the first target of its window along each axis, cells; values
    };

    std::vector<Sample> samples_;
    std::vector<int> window_of_[D], order_, begin_;  ///< the first target of each sample along each axis, then the window
    Vec<D, Lanes> low_{}, high_{};                   ///< bounds of the first targets
    Index<D> first_{}, extent_{};
    int count_ = 0;
};

}  // namespace ordo
