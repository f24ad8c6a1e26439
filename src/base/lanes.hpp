// Eight doubles that are added and scaled together: one node record, one cache line.
// One AVX-512 register, or two halves of 32 bytes where the machine is narrower: left to itself the compiler splits
// 64-byte vectors badly (a seventh of the speed on AVX2). Plain loops on a device.
#pragma once

#include "base/config.hpp"

namespace ordo {

#if !defined(__CUDACC__) && defined(__AVX512F__)
struct alignas(64) Lanes {
    using Vector = double __attribute__((vector_size(64)));
    Vector v;

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
ORDO_FLAT inline Lanes operator-(const Lanes& a) { return a * -1.0; }

/// Eight lanes from eight numbers.
ORDO_FLAT inline Lanes make_lanes(double a, double b, double c, double d, double e, double f, double g, double h)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {Lanes::Vector{a, b, c, d, e, f, g, h}};
#elif !defined(__CUDACC__)
    return {Lanes::Half{a, b, c, d}, Lanes::Half{e, f, g, h}};
#else
    return {{a, b, c, d, e, f, g, h}};
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
#else
    for (int j = 0; j < 8; ++j)
        for (int k = 0; k < j; ++k) {
            const double kept = rows[j][k];
            rows[j][k]        = rows[k][j];
            rows[k][j]        = kept;
        }
#endif
}

static_assert(sizeof(Lanes) == 64);

}  // namespace ordo
