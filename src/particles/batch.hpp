// Up to eight particles at a time, as Vec and Mat of Lanes: lane k belongs to particle first + k.
#pragma once

#include "base/lanes.hpp"
#include "base/stress.hpp"
#include "base/vec.hpp"

#include <cstddef>
#include <cstdint>

namespace ordo {

/// Particles first, ..., first + count - 1, count from 1 to 8. Spare lanes repeat the last one.
struct Batch {
    static constexpr int size = 8;

    int first, count;

    /// The next particles of [first, end).
    ORDO_FLAT static Batch of(int first, int end) { return {first, smaller(size, end - first)}; }

    ORDO_FLAT int particle(int lane) const { return first + smaller(lane, count - 1); }
    ORDO_FLAT bool is_full() const { return count == size; }
};

/// Whether all particles of a batch have the same number in a field, such as their material.
ORDO_FLAT inline bool are_alike(const std::int32_t* field, const Batch& b)
{
    int others = 0;
    for (int k = 1; k < b.count; ++k) others += field[b.first + k] != field[b.first];
    return others == 0;
}

/// The lanes f(particle), one by one.
template <class F>
ORDO_FLAT inline Lanes each_particle(const Batch& b, F&& f)
{
    Lanes r{};
    for (int k = 0; k < Batch::size; ++k) r[k] = f(b.particle(k));
    return r;
}

/// Loads fewer than eight particles from a field of N doubles per particle, and stores them.
ORDO_HD ORDO_CALL inline void load_some(const double* from, int N, int count, Lanes* number)
{
    for (int c = 0; c < N; ++c)
        for (int k = 0; k < Batch::size; ++k) number[c][k] = from[smaller(k, count - 1) * N + c];
}
ORDO_HD ORDO_CALL inline void store_some(double* to, int N, int count, const Lanes* number)
{
    for (int k = 0; k < count; ++k)
        for (int c = 0; c < N; ++c) to[k * N + c] = number[c][k];
}

#if !defined(__CUDACC__) && defined(__AVX512F__)
/// N registers in memory hold elements of `width` doubles, N for each of 8 / width particles. In order, register c holds element c of all
/// these particles. `in` goes from memory to order, `out` back: lane k of the result c is lane order[c][1][k] of the first two
/// registers, those of the second counted from 8, unless order[c][r][k] above 7 takes it from register r > 1.
template <int N, int width>
struct Interleaving {
    using Order = long long[N][N][8];
    alignas(64) Order in, out;

    constexpr Interleaving() : in(), out()
    {
        for (int c = 0; c < N; ++c)
            for (int k = 0; k < 8; ++k) {
                const int place = (k / width * N + c) * width + k % width;  // in memory
                take(in, c, k, place / 8, place % 8);
                const int element = (8 * c + k) / width;
                take(out, c, k, element % N, element / N * width + k % width);
            }
    }

  private:
    static constexpr void take(Order& order, int c, int k, int from, int lane)
    {
        for (int r = 1; r < N; ++r) order[c][r][k] = from == r ? 8 + lane : (r == 1 && from == 0) ? lane : k;
    }
};
template <int N, int width>
inline constexpr Interleaving<N, width> interleaving{};

template <int N>
ORDO_FLAT inline void reorder(const long long (&order)[N][N][8], const Lanes* from, Lanes* to)
{
    for (int c = 0; c < N; ++c) {
        to[c] = from[0];
        for (int r = 1; r < N; ++r) to[c].v = _mm512_permutex2var_pd(to[c].v, _mm512_load_epi64(order[c][r]), from[r].v);
    }
}

/// Eight particles with up to six numbers each, or nine. Pairs of numbers take half as many steps as single ones.
template <int N>
ORDO_FLAT inline void load_full(const double* p, Lanes (&number)[N])
{
    if constexpr (N == 9) {
        Lanes row[8];
        for (int k = 0; k < 8; ++k) row[k] = {_mm512_loadu_pd(p + 9 * k)};
        transpose(row);
        for (int c = 0; c < 8; ++c) number[c] = row[c];
        number[8] = make_lanes(p[8], p[17], p[26], p[35], p[44], p[53], p[62], p[71]);
    } else {
        static_assert(N <= 6);
        Lanes in[N];
        for (int r = 0; r < N; ++r) in[r] = {_mm512_loadu_pd(p + 8 * r)};
        if constexpr (N % 2 == 1) {
            reorder<N>(interleaving<N, 1>.in, in, number);
        } else {
            constexpr int half = N / 2;
            Lanes pairs[N];  // of the first four particles, of the last four
            for (int f = 0; f < N; f += half) reorder<half>(interleaving<half, 2>.in, in + f, pairs + f);
            for (int q = 0; q < half; ++q) {
                const Lanes two[2] = {pairs[q], pairs[half + q]};
                reorder<2>(interleaving<2, 1>.in, two, number + 2 * q);
            }
        }
    }
}
template <int N>
ORDO_FLAT inline void store_full(double* p, const Lanes (&number)[N])
{
    if constexpr (N == 9) {
        Lanes row[8];
        for (int c = 0; c < 8; ++c) row[c] = number[c];
        transpose(row);
        for (int k = 0; k < 8; ++k) {
            _mm512_storeu_pd(p + 9 * k, row[k].v);
            p[9 * k + 8] = number[8][k];
        }
    } else {
        Lanes out[N];
        if constexpr (N % 2 == 1) {
            reorder<N>(interleaving<N, 1>.out, number, out);
        } else {
            constexpr int half = N / 2;
            Lanes pairs[N];
            for (int q = 0; q < half; ++q) {
                Lanes two[2];
                reorder<2>(interleaving<2, 1>.out, number + 2 * q, two);
                pairs[q]        = two[0];
                pairs[half + q] = two[1];
            }
            for (int f = 0; f < N; f += half) reorder<half>(interleaving<half, 2>.out, pairs + f, out + f);
        }
        for (int r = 0; r < N; ++r) _mm512_storeu_pd(p + 8 * r, out[r].v);
    }
}
#elif !defined(__CUDACC__)
/// Two numbers of one particle.
using Two = double __attribute__((vector_size(16)));
ORDO_FLAT inline Two load_two(const double* p)
{
    Two r;
    __builtin_memcpy(&r, p, sizeof r);
    return r;
}
ORDO_FLAT inline void store_two(double* p, Two a) { __builtin_memcpy(p, &a, sizeof a); }

/// Two of the N numbers of each of four particles, and one of them. Whole rows of numbers would need more registers than there are.
template <int N>
ORDO_FLAT inline void load_four(const double* p, Lanes::Half& first, Lanes::Half& second)
{
    const Two a = load_two(p), b = load_two(p + N), c = load_two(p + 2 * N), d = load_two(p + 3 * N);
    const Lanes::Half ac = __builtin_shufflevector(a, c, 0, 1, 2, 3), bd = __builtin_shufflevector(b, d, 0, 1, 2, 3);
    first  = __builtin_shufflevector(ac, bd, 0, 4, 2, 6);
    second = __builtin_shufflevector(ac, bd, 1, 5, 3, 7);
}
template <int N>
ORDO_FLAT inline void load_four(const double* p, Lanes::Half& only)
{
    only = Lanes::Half{p[0], p[N], p[2 * N], p[3 * N]};
}
template <int N>
ORDO_FLAT inline void store_four(double* p, Lanes::Half first, Lanes::Half second)
{
    const Lanes::Half ac = __builtin_shufflevector(first, second, 0, 4, 2, 6),
                      bd = __builtin_shufflevector(first, second, 1, 5, 3, 7);
    store_two(p, __builtin_shufflevector(ac, ac, 0, 1));
    store_two(p + N, __builtin_shufflevector(bd, bd, 0, 1));
    store_two(p + 2 * N, __builtin_shufflevector(ac, ac, 2, 3));
    store_two(p + 3 * N, __builtin_shufflevector(bd, bd, 2, 3));
}
template <int N>
ORDO_FLAT inline void store_four(double* p, Lanes::Half only)
{
    for (int k = 0; k < 4; ++k) p[k * N] = only[k];
}

/// Eight particles with N numbers each.
template <int N>
ORDO_FLAT inline void load_full(const double* p, Lanes (&number)[N])
{
    for (int c = 0; c + 1 < N; c += 2) {
        load_four<N>(p + c, number[c].lo, number[c + 1].lo);
        load_four<N>(p + 4 * N + c, number[c].hi, number[c + 1].hi);
    }
    if constexpr (N % 2 == 1) {
        load_four<N>(p + N - 1, number[N - 1].lo);
        load_four<N>(p + 5 * N - 1, number[N - 1].hi);
    }
}
template <int N>
ORDO_FLAT inline void store_full(double* p, const Lanes (&number)[N])
{
    for (int c = 0; c + 1 < N; c += 2) {
        store_four<N>(p + c, number[c].lo, number[c + 1].lo);
        store_four<N>(p + 4 * N + c, number[c].hi, number[c + 1].hi);
    }
    if constexpr (N % 2 == 1) {
        store_four<N>(p + N - 1, number[N - 1].lo);
        store_four<N>(p + 5 * N - 1, number[N - 1].hi);
    }
}
#else
/// Eight particles with N numbers each.
template <int N>
ORDO_FLAT inline void load_full(const double* p, Lanes (&number)[N])
{
    load_some(p, N, Batch::size, number);
}
template <int N>
ORDO_FLAT inline void store_full(double* p, const Lanes (&number)[N])
{
    store_some(p, N, Batch::size, number);
}
#endif

/// The same for a batch, full or not.
template <int N>
ORDO_FLAT inline void load(const double* field, const Batch& b, Lanes (&number)[N])
{
    const double* p = field + static_cast<std::ptrdiff_t>(b.first) * N;
    if (b.is_full()) {
        load_full(p, number);
    } else {
        Lanes some[N];  // in memory, so `number` can stay in registers
        load_some(p, N, b.count, some);
        for (int c = 0; c < N; ++c) number[c] = some[c];
    }
}
template <int N>
ORDO_FLAT inline void store(double* field, const Batch& b, const Lanes (&number)[N])
{
    double* p = field + static_cast<std::ptrdiff_t>(b.first) * N;
    if (b.is_full()) {
        store_full(p, number);
    } else {
        Lanes some[N];
        for (int c = 0; c < N; ++c) some[c] = number[c];
        store_some(p, N, b.count, some);
    }
}

ORDO_FLAT inline Lanes load(const double* field, const Batch& b)
{
    Lanes r[1];
    load(field, b, r);
    return r[0];
}
template <int D>
ORDO_FLAT inline Vec<D, Lanes> load(const Vec<D>* field, const Batch& b)
{
    Vec<D, Lanes> r;
    load(field[0].c, b, r.c);
    return r;
}
/// Matrices are more than the registers of AVX2 hold: there a copy of their numbers would cost moves, with AVX-512 it saves some.
template <int D>
ORDO_FLAT inline Mat<D, Lanes> load(const Mat<D>* field, const Batch& b)
{
    Mat<D, Lanes> r;
#if defined(__AVX512F__)
    Lanes number[D * D];
    load(field[0].c[0], b, number);
    for (int c = 0; c < D * D; ++c) r(c / D, c % D) = number[c];
#else
    load(field[0].c[0], b, *reinterpret_cast<Lanes(*)[D * D]>(r.c[0]));
#endif
    return r;
}
template <int D>
ORDO_FLAT inline Stress<D, Lanes> load(const Stress<D>* field, const Batch& b)
{
    Stress<D, Lanes> r;
    load(field[0].c, b, r.c);
    return r;
}
ORDO_FLAT inline void store(double* field, const Batch& b, const Lanes& value)
{
    const Lanes number[1] = {value};
    store(field, b, number);
}
template <int D>
ORDO_FLAT inline void store(Vec<D>* field, const Batch& b, const Vec<D, Lanes>& value)
{
    store(field[0].c, b, value.c);
}
template <int D>
ORDO_FLAT inline void store(Mat<D>* field, const Batch& b, const Mat<D, Lanes>& value)
{
#if defined(__AVX512F__)
    Lanes number[D * D];
    for (int c = 0; c < D * D; ++c) number[c] = value(c / D, c % D);
    store(field[0].c[0], b, number);
#else
    store(field[0].c[0], b, *reinterpret_cast<const Lanes(*)[D * D]>(value.c[0]));
#endif
}
template <int D>
ORDO_FLAT inline void store(Stress<D>* field, const Batch& b, const Stress<D, Lanes>& value)
{
    store(field[0].c, b, value.c);
}

}  // namespace ordo
