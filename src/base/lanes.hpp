// Eight doubles that are added and scaled together: one node record, one cache line; or one number of eight particles, when
// Lanes is the scalar of Vec and Mat.
// One AVX-512 register, or two halves of 32 bytes on narrower machines, where the compiler itself splits 64-byte vectors
// badly (a seventh of the speed on AVX2). Plain loops on a device.
#pragma once

#include "base/config.hpp"

#include <cmath>

#if !defined(__CUDACC__) && defined(__AVX2__)
#include <immintrin.h>
#endif

namespace ordo {

using std::fabs;  // beside the overload for Lanes

#if !defined(__CUDACC__) && defined(__AVX512F__)
struct alignas(64) Lanes {
    using Vector = double __attribute__((vector_size(64)));
    Vector v;

    Lanes() = default;
    ORDO_FLAT Lanes(Vector a) : v(a) {}
    ORDO_FLAT explicit Lanes(double s) : v(s - Vector{}) {}

    ORDO_FLAT double& operator[](int k) { return reinterpret_cast<double*>(this)[k]; }
    ORDO_FLAT double operator[](int k) const { return v[k]; }
    ORDO_FLAT Lanes& operator+=(const Lanes& o)
    {
        v += o.v;
        return *this;
    }
    friend ORDO_FLAT Lanes operator+(Lanes a, const Lanes& b) { return {a.v + b.v}; }
    friend ORDO_FLAT Lanes operator-(Lanes a, const Lanes& b) { return {a.v - b.v}; }
    friend ORDO_FLAT Lanes operator*(Lanes a, double s) { return {a.v * s}; }
    friend ORDO_FLAT Lanes operator*(Lanes a, const Lanes& o) { return {a.v * o.v}; }
    friend ORDO_FLAT Lanes operator/(Lanes a, const Lanes& o) { return {a.v / o.v}; }
};
#elif !defined(__CUDACC__)
struct alignas(64) Lanes {
    using Half = double __attribute__((vector_size(32)));
    Half lo, hi;

    Lanes() = default;
    ORDO_FLAT Lanes(Half low, Half high) : lo(low), hi(high) {}
    ORDO_FLAT explicit Lanes(double s) : lo(s - Half{}), hi(s - Half{}) {}

    ORDO_FLAT double& operator[](int k) { return reinterpret_cast<double*>(this)[k]; }
    ORDO_FLAT double operator[](int k) const { return k < 4 ? lo[k] : hi[k - 4]; }
    ORDO_FLAT Lanes& operator+=(const Lanes& o)
    {
        lo += o.lo;
        hi += o.hi;
        return *this;
    }
    friend ORDO_FLAT Lanes operator+(Lanes a, const Lanes& b) { return {a.lo + b.lo, a.hi + b.hi}; }
    friend ORDO_FLAT Lanes operator-(Lanes a, const Lanes& b) { return {a.lo - b.lo, a.hi - b.hi}; }
    friend ORDO_FLAT Lanes operator*(Lanes a, double s) { return {a.lo * s, a.hi * s}; }
    friend ORDO_FLAT Lanes operator*(Lanes a, const Lanes& o) { return {a.lo * o.lo, a.hi * o.hi}; }
    friend ORDO_FLAT Lanes operator/(Lanes a, const Lanes& o) { return {a.lo / o.lo, a.hi / o.hi}; }
};
#else
struct alignas(64) Lanes {
    double c[8];

    Lanes() = default;
    ORDO_FLAT explicit Lanes(double s) : Lanes(s, s, s, s, s, s, s, s) {}
    ORDO_FLAT Lanes(double a, double b, double d, double e, double f, double g, double h, double i) : c{a, b, d, e, f, g, h, i} {}

    ORDO_FLAT double& operator[](int k) { return c[k]; }
    ORDO_FLAT double operator[](int k) const { return c[k]; }
    ORDO_FLAT Lanes& operator+=(const Lanes& o)
    {
        for (int k = 0; k < 8; ++k) c[k] += o.c[k];
        return *this;
    }
    friend ORDO_FLAT Lanes operator+(Lanes a, const Lanes& b) { return a += b; }
    friend ORDO_FLAT Lanes operator-(Lanes a, const Lanes& b)
    {
        for (int k = 0; k < 8; ++k) a.c[k] -= b.c[k];
        return a;
    }
    friend ORDO_FLAT Lanes operator*(Lanes a, double s)
    {
        for (int k = 0; k < 8; ++k) a.c[k] *= s;
        return a;
    }
    friend ORDO_FLAT Lanes operator*(Lanes a, const Lanes& o)
    {
        for (int k = 0; k < 8; ++k) a.c[k] *= o.c[k];
        return a;
    }
    friend ORDO_FLAT Lanes operator/(Lanes a, const Lanes& o)
    {
        for (int k = 0; k < 8; ++k) a.c[k] /= o.c[k];
        return a;
    }
};
#endif

ORDO_FLAT inline Lanes operator*(double s, const Lanes& a) { return a * s; }
ORDO_FLAT inline Lanes operator+(const Lanes& a, double s) { return a + Lanes(s); }
ORDO_FLAT inline Lanes operator+(double s, const Lanes& a) { return Lanes(s) + a; }
ORDO_FLAT inline Lanes operator-(const Lanes& a, double s) { return a - Lanes(s); }
ORDO_FLAT inline Lanes operator-(double s, const Lanes& a) { return Lanes(s) - a; }
ORDO_FLAT inline Lanes operator-(const Lanes& a) { return a * -1.0; }
ORDO_FLAT inline Lanes& operator-=(Lanes& a, const Lanes& b) { return a = a - b; }
ORDO_FLAT inline Lanes& operator*=(Lanes& a, const Lanes& b) { return a = a * b; }

/// The same, in a register: left to itself the compiler reads a number from memory again for each of its uses, and a kernel of
/// multiply-adds then waits for the reads.
ORDO_FLAT inline Lanes in_register(Lanes a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    asm("" : "+v"(a.v));
#elif !defined(__CUDACC__) && defined(__AVX2__)
    asm("" : "+x"(a.lo), "+x"(a.hi));
#endif
    return a;
}

/// The same for a place in memory: places at fixed distances from it need no arithmetic of their own then.
template <class T>
ORDO_FLAT inline T* in_register(T* place)
{
#if !defined(__CUDACC__)
    asm("" : "+r"(place));
#endif
    return place;
}

/// Lane by lane the larger and the smaller of two numbers; that of `a` where b is not a number.
ORDO_FLAT inline Lanes larger(const Lanes& a, const Lanes& b)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {_mm512_maskz_max_pd(0xff, b.v, a.v)};  // all lanes; the plain one warns falsely in g++ 12 (its bug 105593)
#elif !defined(__CUDACC__) && defined(__AVX2__)
    return {_mm256_max_pd(b.lo, a.lo), _mm256_max_pd(b.hi, a.hi)};
#elif !defined(__CUDACC__)
    return {b.lo > a.lo ? b.lo : a.lo, b.hi > a.hi ? b.hi : a.hi};
#else
    Lanes r = a;
    for (int k = 0; k < 8; ++k) r.c[k] = b.c[k] > a.c[k] ? b.c[k] : a.c[k];
    return r;
#endif
}
ORDO_FLAT inline Lanes smaller(const Lanes& a, const Lanes& b)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {_mm512_maskz_min_pd(0xff, b.v, a.v)};  // the same
#elif !defined(__CUDACC__) && defined(__AVX2__)
    return {_mm256_min_pd(b.lo, a.lo), _mm256_min_pd(b.hi, a.hi)};
#else
    return -larger(-a, -b);
#endif
}
ORDO_FLAT inline Lanes fabs(const Lanes& a) { return larger(a, -a); }

/// Eight lanes from eight numbers.
ORDO_FLAT inline Lanes make_lanes(double a, double b, double c, double d, double e, double f, double g, double h)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {Lanes::Vector{a, b, c, d, e, f, g, h}};
#elif !defined(__CUDACC__)
    return {Lanes::Half{a, b, c, d}, Lanes::Half{e, f, g, h}};
#else
    return {a, b, c, d, e, f, g, h};
#endif
}

/// Lane k of rows[j] and lane j of rows[k] change places.
ORDO_FLAT inline void transpose(Lanes (&rows)[8])
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    Lanes::Vector a[8], b[8];
    for (int k = 0; k < 8; k += 2) {  // pairs within the same two columns
        a[k]     = __builtin_shufflevector(rows[k].v, rows[k + 1].v, 0, 8, 2, 10, 4, 12, 6, 14);
        a[k + 1] = __builtin_shufflevector(rows[k].v, rows[k + 1].v, 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int k = 0; k < 8; k += 4)
        for (int j = k; j < k + 2; ++j) {
            b[j]     = __builtin_shufflevector(a[j], a[j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            b[j + 2] = __builtin_shufflevector(a[j], a[j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int j = 0; j < 4; ++j) {
        rows[j].v     = __builtin_shufflevector(b[j], b[j + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        rows[j + 4].v = __builtin_shufflevector(b[j], b[j + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
#elif !defined(__CUDACC__)
    using Half = Lanes::Half;
    auto four  = [](Half& a, Half& b, Half& c, Half& d) {
        const Half p = __builtin_shufflevector(a, b, 0, 4, 2, 6), q = __builtin_shufflevector(a, b, 1, 5, 3, 7);
        const Half r = __builtin_shufflevector(c, d, 0, 4, 2, 6), t = __builtin_shufflevector(c, d, 1, 5, 3, 7);
        a = __builtin_shufflevector(p, r, 0, 1, 4, 5);
        b = __builtin_shufflevector(q, t, 0, 1, 4, 5);
        c = __builtin_shufflevector(p, r, 2, 3, 6, 7);
        d = __builtin_shufflevector(q, t, 2, 3, 6, 7);
    };
    for (int k = 0; k < 8; k += 4) {
        four(rows[k].lo, rows[k + 1].lo, rows[k + 2].lo, rows[k + 3].lo);
        four(rows[k].hi, rows[k + 1].hi, rows[k + 2].hi, rows[k + 3].hi);
    }
    for (int k = 0; k < 4; ++k) {
        const Half kept = rows[k].hi;
        rows[k].hi      = rows[k + 4].lo;
        rows[k + 4].lo  = kept;
    }
#else
    for (int j = 0; j < 8; ++j)
        for (int k = 0; k < j; ++k) {
            const double kept = rows[j][k];
            rows[j][k]        = rows[k][j];
            rows[k][j]        = kept;
        }
#endif
}

/// Whether all lanes are numbers and none is negative.
ORDO_FLAT inline bool none_negative(const Lanes& a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return _mm512_cmp_pd_mask(a.v, _mm512_setzero_pd(), _CMP_GE_OQ) == 0xff;
#elif !defined(__CUDACC__) && defined(__AVX2__)
    const auto is = [](Lanes::Half h) { return _mm256_movemask_pd(_mm256_cmp_pd(h, _mm256_setzero_pd(), _CMP_GE_OQ)); };
    return (is(a.lo) & is(a.hi)) == 0xf;
#else
    bool r = true;
    for (int k = 0; k < 8; ++k) r = r && a[k] >= 0;
    return r;
#endif
}

/// Lane by lane `a` where `condition` is positive, else `b`, also where it is not a number. For kernels that are templates on
/// their scalar: no lane depends on its neighbours.
ORDO_FLAT inline Lanes choose(const Lanes& condition, const Lanes& a, const Lanes& b)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {condition.v > 0 ? a.v : b.v};
#elif !defined(__CUDACC__)
    return {condition.lo > 0 ? a.lo : b.lo, condition.hi > 0 ? a.hi : b.hi};
#else
    Lanes r = b;
    for (int k = 0; k < 8; ++k) r.c[k] = condition.c[k] > 0 ? a.c[k] : b.c[k];
    return r;
#endif
}
ORDO_FLAT constexpr double choose(double condition, double a, double b) { return condition > 0 ? a : b; }

/// Whether any lane is positive.
ORDO_FLAT inline bool any_positive(const Lanes& a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return _mm512_cmp_pd_mask(a.v, _mm512_setzero_pd(), _CMP_GT_OQ) != 0;
#elif !defined(__CUDACC__) && defined(__AVX2__)
    const auto is = [](Lanes::Half h) { return _mm256_movemask_pd(_mm256_cmp_pd(h, _mm256_setzero_pd(), _CMP_GT_OQ)); };
    return (is(a.lo) | is(a.hi)) != 0;
#else
    bool r = false;
    for (int k = 0; k < 8; ++k) r = r || a[k] > 0;
    return r;
#endif
}
ORDO_FLAT constexpr bool any_positive(double a) { return a > 0; }

/// The largest lane.
ORDO_FLAT inline double largest(const Lanes& a)
{
    double r = a[0];
    for (int k = 1; k < 8; ++k) r = a[k] > r ? a[k] : r;
    return r;
}

/// The sum of the lanes.
ORDO_FLAT inline double sum(const Lanes& a)
{
    double r = 0.0;
    for (int k = 0; k < 8; ++k) r += a[k];
    return r;
}

/// Four lanes, for values that only the first four of eight lanes hold: half the work.
struct alignas(32) Quad {
#if !defined(__CUDACC__)
    using Vector = double __attribute__((vector_size(32)));
    Vector v;

    ORDO_FLAT double& operator[](int k) { return reinterpret_cast<double*>(this)[k]; }
    ORDO_FLAT double operator[](int k) const { return v[k]; }
    ORDO_FLAT Quad& operator+=(const Quad& o)
    {
        v += o.v;
        return *this;
    }
    friend ORDO_FLAT Quad operator-(Quad a, const Quad& b) { return {a.v - b.v}; }
    friend ORDO_FLAT Quad operator*(Quad a, double s) { return {a.v * s}; }
#else
    double v[4];

    ORDO_FLAT double& operator[](int k) { return v[k]; }
    ORDO_FLAT double operator[](int k) const { return v[k]; }
    ORDO_FLAT Quad& operator+=(const Quad& o)
    {
        for (int k = 0; k < 4; ++k) v[k] += o.v[k];
        return *this;
    }
    friend ORDO_FLAT Quad operator-(Quad a, const Quad& b)
    {
        for (int k = 0; k < 4; ++k) a.v[k] -= b.v[k];
        return a;
    }
    friend ORDO_FLAT Quad operator*(Quad a, double s)
    {
        for (int k = 0; k < 4; ++k) a.v[k] *= s;
        return a;
    }
#endif
};

/// `low` takes the first four lanes, `join` makes eight lanes from two times four.
ORDO_FLAT inline Quad low(const Lanes& a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {__builtin_shufflevector(a.v, a.v, 0, 1, 2, 3)};
#elif !defined(__CUDACC__)
    return {a.lo};
#else
    return {{a[0], a[1], a[2], a[3]}};
#endif
}
ORDO_FLAT inline Lanes join(const Quad& a, const Quad& b)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7)};
#elif !defined(__CUDACC__)
    return {a.v, b.v};
#else
    return {a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]};
#endif
}

/// Eight lanes of which four may differ from zero, the first or the last, to add to others: half the work where eight lanes take two registers.
#if !defined(__CUDACC__) && !defined(__AVX512F__)
template <bool is_upper>
struct HalfLanes {
    Lanes::Half v{};

    ORDO_FLAT static HalfLanes of(double a, double b, double c, double d) { return {Lanes::Half{a, b, c, d}}; }
    ORDO_FLAT HalfLanes& operator+=(const HalfLanes& o)
    {
        v += o.v;
        return *this;
    }
    friend ORDO_FLAT HalfLanes operator+(HalfLanes a, const HalfLanes& b) { return {a.v + b.v}; }
    friend ORDO_FLAT HalfLanes operator-(HalfLanes a, const HalfLanes& b) { return {a.v - b.v}; }
    friend ORDO_FLAT HalfLanes operator*(HalfLanes a, double s) { return {a.v * s}; }
    friend ORDO_FLAT Lanes operator+(Lanes a, const HalfLanes& b)
    {
        (is_upper ? a.hi : a.lo) += b.v;
        return a;
    }
    friend ORDO_FLAT Lanes operator-(Lanes a, const HalfLanes& b)
    {
        (is_upper ? a.hi : a.lo) -= b.v;
        return a;
    }
};
template <bool is_upper>
ORDO_FLAT inline Lanes& operator+=(Lanes& a, const HalfLanes<is_upper>& b)
{
    return a = a + b;
}
#else
template <bool is_upper>
struct HalfLanes : Lanes {
    ORDO_FLAT HalfLanes(const Lanes& a = Lanes(0.0)) : Lanes(a) {}  // implicit for what the operators give; of() makes them
    ORDO_FLAT static HalfLanes of(double a, double b, double c, double d)
    {
        return is_upper ? make_lanes(0, 0, 0, 0, a, b, c, d) : make_lanes(a, b, c, d, 0, 0, 0, 0);
    }
};
#endif
using LowerLanes = HalfLanes<false>;
using UpperLanes = HalfLanes<true>;

/// Lane k of lanes in memory, where k is known only at run time: `operator[]` would choose between two registers first.
ORDO_FLAT inline double lane_at(const Lanes& a, int k) { return reinterpret_cast<const double*>(&a)[k]; }

/// Each lane rounded towards zero, as int; lanes must fit.
ORDO_FLAT inline void to_int(const Lanes& a, int* to)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    using Whole       = int __attribute__((vector_size(32)));
    const Whole whole = __builtin_convertvector(a.v, Whole);
    __builtin_memcpy(to, &whole, sizeof whole);
#else
    for (int k = 0; k < 8; ++k) to[k] = static_cast<int>(a[k]);
#endif
}
/// Each lane rounded towards zero; lanes must fit an int.
ORDO_FLAT inline Lanes truncate(const Lanes& a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    using Whole = int __attribute__((vector_size(32)));
    return {__builtin_convertvector(__builtin_convertvector(a.v, Whole), Lanes::Vector)};
#elif !defined(__CUDACC__)
    using Whole = int __attribute__((vector_size(16)));
    return {__builtin_convertvector(__builtin_convertvector(a.lo, Whole), Lanes::Half),
            __builtin_convertvector(__builtin_convertvector(a.hi, Whole), Lanes::Half)};
#else
    Lanes r = a;
    for (int k = 0; k < 8; ++k) r[k] = static_cast<int>(a[k]);
    return r;
#endif
}

static_assert(sizeof(Lanes) == 64 && sizeof(Quad) == 32);

}  // namespace ordo
