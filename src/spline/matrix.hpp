// Symmetric matrices sum_g w_g N_i N_j over points g, formed once and multiplied often, for the systems of projection `spline-fit`.
//
// N_i N_j is a product over the axes, which stays the same when i and j exchange their numbers along one axis. So an entry depends
// only on the smaller of the two numbers and on their distance along each axis: (P+1)^D numbers a function hold its (2P+1)^D entries.
#pragma once

#include "base/array.hpp"
#include "base/index.hpp"
#include "base/lanes.hpp"
#include "base/parallel.hpp"
#include "spline/axis.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

namespace ordo {

/// One number in the lower four lanes, another in the upper four.
ORDO_FLAT inline Lanes halves(double low, double high) { return make_lanes(low, low, low, low, high, high, high, high); }

/// The pairs (i, i + distance) of the P + 1 functions of an axis in a cell.
template <int P>
struct AxisPairs {
    static constexpr int width = P + 1, count = width * (P + 2) / 2;
    struct Pair {
        int i, distance;
    };
    static constexpr std::array<Pair, count> all = [] {
        std::array<Pair, count> r{};
        int k = 0;
        for (int distance = 0; distance < width; ++distance)
            for (int i = 0; i + distance < width; ++i) r[k++] = {i, distance};
        return r;
    }();

    /// The products of the values w of the functions.
    ORDO_FLAT static void multiply(const double* w, double* to)
    {
        for (int k = 0; k < count; ++k) to[k] = w[all[k].i] * w[all[k].i + all[k].distance];
    }
};

/// The sums over points of a cell of weights times products of pairs of functions; W weights a point.
template <int D, int P, int W>
class CellPairs {
  public:
    using Pairs               = AxisPairs<P>;
    static constexpr int axis = Pairs::count, line = axis * W, others = power_of(axis, D - 1);
    using Weights = std::array<double, W>;

    /// The sums of one line: of the pair `other` of the other axes with all pairs of the first, [pair][weight].
    const double* of(int other) const { return sums_ + other * line; }

    /// Sums over points k in [begin, end); row(k) has the values there of the functions, an array for each axis.
    template <class Row, class Weight>
    void set_points(std::ptrdiff_t begin, std::ptrdiff_t end, const Row& row, const Weight& weight)
    {
        std::ptrdiff_t k = begin + (end - begin) % 2;
        if (k > begin)
            add<1, true>(begin, row, weight);
        else if (k < end)
            add<2, true>(k, row, weight), k += 2;
        else
            std::fill_n(sums_, others * line, 0.0);
        for (; k < end; k += 2) add<2, false>(k, row, weight);
    }

    /// The same for a grid of points, `count` along an axis, the first axis fastest; values[a] has those of the functions of an axis,
    /// [point][function].
    void set_grid(int count, const Vec<D, const double*>& values, const double* weights) requires(W == 1)
    {
        constexpr int most = SplineAxis::max_degree + 1;
        double products[D][most * axis], part[2][larger(power_of(axis, D - 1) * most, axis * power_of(most, D - 1))];
        for (int a = 0; a < D; ++a)
            for (int g = 0; g < count; ++g) Pairs::multiply(values[a] + g * Pairs::width, products[a] + g * axis);
        const double* from = weights;  // [pairs of the axes after a][points of a and of the axes before]
        int outer = 1, inner = 1;
        for (int a = 1; a < D; ++a) inner *= count;
        for (int a = D - 1; a > 0; --a) {
            double* const to = part[a % 2];
            for (int o = 0; o < outer; ++o)
                for (int pair = 0; pair < axis; ++pair) {
                    double* const sums = to + (o * axis + pair) * inner;
                    for (int i = 0; i < inner; ++i) sums[i] = products[a][pair] * from[o * count * inner + i];
                    for (int g = 1; g < count; ++g)
                        for (int i = 0; i < inner; ++i)
                            sums[i] += products[a][g * axis + pair] * from[(o * count + g) * inner + i];
                }
            from = to;
            outer *= axis;
            inner /= count;
        }
        for (int o = 0; o < outer; ++o) {
            double* const sums = sums_ + o * axis;
            for (int e = 0; e < axis; ++e) sums[e] = products[0][e] * from[o * count];
            for (int g = 1; g < count; ++g)  // along x
                for (int e = 0; e < axis; ++e) sums[e] += products[0][g * axis + e] * from[o * count + g];
        }
    }

  private:
    template <int batch, bool is_first, class Row, class Weight>
    ORDO_FLAT void add(std::ptrdiff_t k, const Row& row, const Weight& weight)
    {
        double first[batch][line], rest[others][batch];
        for (int b = 0; b < batch; ++b) {
            const Vec<D, const double*> w = row(k + b);
            const Weights weights         = weight(k + b);
            double pairs[D][axis];
            for (int a = 0; a < D; ++a) Pairs::multiply(w[a], pairs[a]);
            for (int e = 0; e < axis; ++e)
                for (int v = 0; v < W; ++v) first[b][e * W + v] = pairs[0][e] * weights[v];
            if constexpr (D == 1) rest[0][b] = 1.0;
            if constexpr (D == 2)
                for (int o = 0; o < axis; ++o) rest[o][b] = pairs[1][o];
            if constexpr (D == 3)
                for (int j = 0; j < axis; ++j)
                    for (int o = 0; o < axis; ++o) rest[j * axis + o][b] = pairs[2][j] * pairs[1][o];
        }
        for (int o = 0; o < others; ++o) {
            double* const sums = sums_ + o * line;
            for (int e = 0; e < line; ++e) {
                double sum = is_first ? 0.0 : sums[e];
                for (int b = 0; b < batch; ++b) sum += rest[o][b] * first[b][e];
                sums[e] = sum;
            }
        }
    }

    alignas(64) double sums_[others * line];
};

/// A symmetric matrix over the functions of a space, for one weight or for two: then the lower four lanes have the first, the
/// upper four the second.
template <int D>
class SplineMatrix {
  public:
    /// Makes all entries zero. Functions of one cell are up to the degree apart, which is the least band.
    void clear(const SplineSpace<D>& space, int weights, int band)
    {
        space_   = space;
        weights_ = weights;
        band_    = band;
        counts_  = space.counts();
        rows_    = 1;
        for (int a = 1; a < D; ++a) rows_ *= counts_[a];
        whole_ = (counts_[0] + kBlock - 1) / kBlock * kBlock;
        keep_room(entries_, static_cast<std::size_t>(rows_) * row_size());
        parallel_for(rows_, [&](std::ptrdiff_t row) { std::memset(row_data(row), 0, row_size() * sizeof(double)); });
    }

    /// Adds the sums of a cell. Cells that share no function may be added at the same time.
    template <int P, int W>
    void add(const Index<D>& cell, const CellPairs<D, P, W>& sums)
    {
        using Pairs          = AxisPairs<P>;
        const Index<D> first = space_.first_of(cell);
        std::ptrdiff_t at[Pairs::count];
        for (int e = 0; e < Pairs::count; ++e)
            at[e] = ((band_ + space_.axis[0].wrapped(first[0] + Pairs::all[e].i)) * (band_ + 1) + Pairs::all[e].distance) * W;
        constexpr int others = CellPairs<D, P, W>::others, ahead = 4;
        std::array<double*, others + ahead> lines;
        for (int o = 0; o < others; ++o) {
            std::ptrdiff_t row = 0;
            int distances      = 0;
            for (int a = D - 1, number = o; a > 0; --a) {
                const auto pair = Pairs::all[a == D - 1 ? number / power_of(Pairs::count, D - 2) : number % Pairs::count];
                row             = row * counts_[a] + space_.axis[a].wrapped(first[a] + pair.i);
                distances       = distances * (band_ + 1) + pair.distance;
            }
            lines[o] = row_data(row) + distances * line_size();
        }
        std::fill_n(lines.data() + others, ahead, lines[0]);
        for (int o = 0; o < others; ++o) {
            for (int k = 0; k < (P + 1) * (P + 1) * W; k += 8) __builtin_prefetch(lines[o + ahead] + at[0] + k, 1);
            const double* const from = sums.of(o);
            for (int e = 0; e < Pairs::count; ++e)
                for (int w = 0; w < W; ++w) lines[o][at[e] + w] += from[e * W + w];
        }
    }

    /// Adds weights times products over the axes of symmetric matrices, for size[a] functions of each axis from `first` on.
    void add(const Index<D>& first, const Index<D>& size, const Vec<D, const double*>& matrices, const double* weights)
    {
        Index<D> others = size;
        others[0]       = 1;
        IndexBox<D>{{}, others}.for_each([&](const Index<D>& i) {
            Index<D> last = others;
            last[0]       = 1;
            IndexBox<D>{i, last}.for_each([&](const Index<D>& j) {
                std::ptrdiff_t row = 0;
                int distances      = 0;
                double of_others   = 1.0;
                for (int a = D - 1; a > 0; --a) {
                    row       = row * counts_[a] + space_.axis[a].wrapped(first[a] + i[a]);
                    distances = distances * (band_ + 1) + j[a] - i[a];
                    of_others *= matrices[a][i[a] * size[a] + j[a]];
                }
                double* const line = row_data(row) + distances * line_size();
                for (int k = 0; k < size[0]; ++k)
                    for (int l = k; l < size[0]; ++l)
                        for (int w = 0; w < weights_; ++w)
                            line[((band_ + space_.axis[0].wrapped(first[0] + k)) * (band_ + 1) + l - k) * weights_ + w] +=
                                of_others * matrices[0][k * size[0] + l] * weights[w];
            });
        });
    }

    /// Call it after the last cell.
    void finish()
    {
        active_.assign(rows_, {0, 0});
        parallel_for(
            rows_,
            [&](std::ptrdiff_t row) {
                const std::ptrdiff_t record = (band_ + 1) * weights_;
                for (int d = 0; space_.axis[0].periodic && d < power_of(band_ + 1, D - 1); ++d) {
                    double* const line = row_data(row) + d * line_size();
                    for (int k = 0; k < band_; ++k)  // the functions before the first, the last of them nearest
                        std::copy_n(line + (band_ + before(band_ - k)) * record, record, line + k * record);
                }
                const double* const diagonal = row_data(row) + band_ * record + weights_ - 1;
                Interval& of                 = active_[row];
                of.end                       = counts_[0];
                while (of.begin < of.end && diagonal[of.begin * record] == 0.0) ++of.begin;
                while (of.begin < of.end && diagonal[(of.end - 1) * record] == 0.0) --of.end;
            },
            is_long());
        pieces_.clear();
        std::ptrdiff_t room = 0;
        for (std::ptrdiff_t row = 0; row < rows_; ++row) {
            Interval of{row * counts_[0] + active_[row].begin, row * counts_[0] + active_[row].end};
            while (of.begin < of.end) {
                if (room == 0) {
                    pieces_.emplace_back();
                    room = kPiece;
                }
                const Interval now{of.begin, std::min(of.end, of.begin + room)};
                auto& piece = pieces_.back();
                if (!piece.empty() && piece.back().end == now.begin)
                    piece.back().end = now.end;
                else
                    piece.push_back(now);
                room -= now.end - now.begin;
                of.begin = now.end;
            }
        }
    }

    /// to = A from.
    void multiply(const Lanes* from, Lanes* to)
    {
        auto by_weights = [&]<int B>() {
            if (weights_ == 1)
                multiply_by<B, 1>(from, to);
            else
                multiply_by<B, 2>(from, to);
        };
        if (band_ > SplineAxis::max_degree)
            by_weights.template operator()<SplineAxis::max_degree + 1>();
        else
            with_degree(band_, by_weights);
    }

    /// For each axis the sums of the entries (i, i + distance) of all functions i with the same number along it, over the columns that
    /// have the same distance along it: [number][distance].
    std::array<std::vector<Lanes>, D> sums_along_axes() const
    {
        const int width             = band_ + 1;
        const std::ptrdiff_t planes = D > 1 ? counts_[D - 1] : 1, rows = rows_ / planes;
        std::vector<std::array<std::vector<Lanes>, D>> parts(planes);  // added in order, so that threads do not matter
        parallel_for(
            planes,
            [&](std::ptrdiff_t plane) {
                auto& part = parts[plane];
                for (int a = 0; a < D; ++a) part[a].assign(counts_[a] * width, Lanes(0.0));
                for (std::ptrdiff_t row = plane * rows; row < (plane + 1) * rows; ++row)
                    for (int d = 0; d < power_of(width, D - 1); ++d) {
                        int at[D], distance[D];
                        double times[D];  // how many entries an entry stands for, along each axis
                        std::ptrdiff_t rest = row;
                        for (int a = 1, rest_d = d; a < D; ++a, rest_d /= width) {
                            at[a]       = static_cast<int>(rest % counts_[a]);
                            distance[a] = rest_d % width;
                            times[a]    = distance[a] > 0 ? 2.0 : 1.0;
                            rest /= counts_[a];
                        }
                        auto others = [&](int axis) {
                            double r = 1.0;
                            for (int a = 1; a < D; ++a)
                                if (a != axis) r *= times[a];
                            return r;
                        };
                        const double* entry = row_data(row) + d * line_size() + band_ * width * weights_;
                        Lanes line(0.0);
                        const double all = others(0);
                        for (int i = 0; i < counts_[0]; ++i)
                            for (int k = 0; k < width; ++k, entry += weights_) {
                                const Lanes of = halves(entry[0], entry[weights_ - 1]);
                                part[0][i * width + k] += of * all;
                                line += of * (k > 0 ? 2.0 : 1.0);
                            }
                        for (int a = 1; a < D; ++a) part[a][at[a] * width + distance[a]] += line * others(a);
                    }
            },
            is_long());
        std::array<std::vector<Lanes>, D> r = std::move(parts[0]);
        for (std::size_t plane = 1; plane < parts.size(); ++plane)
            for (int a = 0; a < D; ++a)
                for (std::size_t k = 0; k < r[a].size(); ++k) r[a][k] += parts[plane][a][k];
        return r;
    }

    /// use(column, entry for the last weight) for the entries of a row in the active columns of all lines.
    template <class Use>
    void for_each_entry(std::ptrdiff_t row, const Use& use) const
    {
        const std::ptrdiff_t line = row / counts_[0];
        const int at              = static_cast<int>(row % counts_[0]);
        for_each_source(line, [&](std::ptrdiff_t other, std::ptrdiff_t least, int distances) {
            const double* const entries = row_data(least) + distances * line_size();
            for (int by = -band_; by <= band_; ++by) {
                int column = at + by;
                if (space_.axis[0].periodic) column = (column % counts_[0] + counts_[0]) % counts_[0];
                if (column < active_[other].begin || column >= active_[other].end) continue;
                const int first = by < 0 ? column : at;
                use(other * counts_[0] + column,
                    entries[((band_ + first) * (band_ + 1) + std::abs(by)) * weights_ + weights_ - 1]);
            }
        });
    }

    /// Functions that have entries, from `begin` up to `end`.
    struct Interval {
        std::ptrdiff_t begin, end;
    };
    /// All of them, in pieces that a thread handles at a time: they do not depend on the number of threads.
    const std::vector<std::vector<Interval>>& active() const { return pieces_; }

  private:
    static constexpr int kBlock = 4;  ///< functions of a line that are multiplied at a time

    std::size_t line_size() const { return static_cast<std::size_t>(band_ + whole_) * (band_ + 1) * weights_; }
    std::size_t row_size() const { return power_of(band_ + 1, D - 1) * line_size(); }
    double* row_data(std::ptrdiff_t row) { return entries_.data() + row * row_size(); }
    const double* row_data(std::ptrdiff_t row) const { return entries_.data() + row * row_size(); }

    /// The function k places before the first of a periodic line.
    int before(int k) const { return (counts_[0] - k % counts_[0]) % counts_[0]; }

    /// Some functions of a line, and the entries that join them to those of a row.
    struct Source {
        const Lanes* x;
        const double* entries;
    };

    /// use(line, the line with the smaller numbers, number of the distances) for the lines that have functions near
    /// those of a line.
    template <class Use>
    void for_each_source(std::ptrdiff_t line, const Use& use) const
    {
        Index<D> at{}, other{};
        for (int a = 1; a < D; ++a) {
            at[a] = static_cast<int>(line % counts_[a]);
            line /= counts_[a];
        }
        IndexBox<D> around = IndexBox<D>::around(Index<D>{}, band_);
        around.lo[0]       = 0;
        around.hi[0]       = 1;
        around.for_each([&](const Index<D>& by) {
            std::ptrdiff_t place = 0, least = 0;
            int distances = 0;
            for (int a = D - 1; a > 0; --a) {
                other[a] = at[a] + by[a];
                if (space_.axis[a].periodic)
                    other[a] = (other[a] % counts_[a] + counts_[a]) % counts_[a];
                else if (other[a] < 0 || other[a] >= counts_[a])
                    return;
                place     = place * counts_[a] + other[a];
                least     = least * counts_[a] + (by[a] < 0 ? other[a] : at[a]);
                distances = distances * (band_ + 1) + std::abs(by[a]);
            }
            if (active_[place].begin < active_[place].end) use(place, least, distances);
        });
    }

    template <int B, int W>
    void multiply_by(const Lanes* from, Lanes* to)
    {
        const std::size_t padded = B + whole_ + B;
        keep_room(padded_, rows_ * padded);
        parallel_for(
            rows_,
            [&](std::ptrdiff_t row) {
                if (active_[row].begin < active_[row].end) pad<B>(from + row * counts_[0], padded_.data() + row * padded);
            },
            is_long());
        parallel_for(
            rows_,
            [&](std::ptrdiff_t row) {
                Lanes* const sums = to + row * counts_[0];
                const auto begin  = static_cast<int>(active_[row].begin) / kBlock * kBlock;
                int k             = begin;
                std::fill_n(sums, begin, Lanes(0.0));
                if (active_[row].begin < active_[row].end) {
                    std::array<Source, power_of(2 * B + 1, D - 1)> sources;
                    int count = 0;
                    for_each_source(row, [&](std::ptrdiff_t other, std::ptrdiff_t least, int distances) {
                        sources[count++] = {padded_.data() + other * padded, row_data(least) + distances * line_size()};
                    });
                    for (; k < active_[row].end; k += kBlock)
                        multiply_block<B, W>(sources.data(), count, k, sums + k, std::min(kBlock, counts_[0] - k));
                }
                if (k < counts_[0]) std::fill_n(sums + k, counts_[0] - k, Lanes(0.0));
            },
            is_long());
    }
    bool is_long() const { return rows_ * counts_[0] > 1000; }

    /// A line with P functions before the first and after the last: those of the next periods, or zeros.
    template <int B>
    void pad(const Lanes* from, Lanes* to) const
    {
        const bool is_periodic = space_.axis[0].periodic;
        for (int k = 0; k < B; ++k) to[k] = is_periodic ? from[before(B - k)] : Lanes(0.0);
        std::copy_n(from, counts_[0], to + B);
        for (int k = counts_[0]; k < whole_ + B; ++k) to[B + k] = is_periodic ? from[k % counts_[0]] : Lanes(0.0);
    }

    template <int B, int W>
    ORDO_FLAT static void multiply_block(const Source* sources, int count, int first, Lanes* to, int kept)
    {
        Lanes sums[kBlock];
        for (Lanes& sum : sums) sum = Lanes(0.0);
        for (int s = 0; s < count; ++s) {
            const Lanes* const x  = sources[s].x + first;
            const double* const t = sources[s].entries + static_cast<std::ptrdiff_t>(first) * (B + 1) * W;
            for (int line = 0; line < kBlock * (B + 1) * W; line += 8) __builtin_prefetch(t + (kBlock + B) * (B + 1) * W + line);
            for_constants<kBlock + 2 * B>([&](auto j) ORDO_FLAT_LAMBDA {
                const Lanes of = in_register(x[j]);  // function first + j - B
                for_constants<kBlock>([&](auto r) ORDO_FLAT_LAMBDA {
                    constexpr int by = j - B - r;  // from function first + r
                    if constexpr (by >= -B && by <= B) {
                        constexpr int column      = j;
                        const int least           = by < 0 ? column : B + r;
                        const double* const entry = t + (least * (B + 1) + (by < 0 ? -by : by)) * W;
                        const Lanes weight        = halves(entry[0], entry[W - 1]);
                        sums[r] += of * weight;
                    }
                });
            });
        }
        for (int r = 0; r < kept; ++r) to[r] = sums[r];
    }

    SplineSpace<D> space_{};
    int weights_ = 1, band_ = 1;  ///< band: the largest distance along an axis
    Index<D> counts_{};
    std::ptrdiff_t rows_ = 0;  ///< lines of functions along the first axis
    int whole_           = 0;  ///< functions of a line, filled up to whole blocks
    /// [row][distances along the other axes][function, `band` of the period before first][distance][weight]
    Array<double> entries_;
    Array<Lanes> padded_;                        ///< lines of a vector, see pad
    std::vector<Interval> active_;               ///< of each line, from its first function
    std::vector<std::vector<Interval>> pieces_;  ///< see active
};

}  // namespace ordo
