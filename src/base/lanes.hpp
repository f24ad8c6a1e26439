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

static_assert(sizeof(Lanes) == 64);

}  // namespace ordo
