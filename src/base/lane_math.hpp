// sin, cos, exp, log and sqrt of eight numbers at once, for stresses of eight particles and for body forces by automatic
// differentiation. Uses glibc's vector library (libmvec) if CMake found it and the machine has the registers, else a loop.
#pragma once

#include "base/lanes.hpp"

#include <cmath>

// Names of glibc's vector ABI: e is AVX-512, d is AVX2; the number is the number of lanes.
#if defined(ORDO_LIBMVEC) && defined(__AVX512F__)
extern "C" {
[[gnu::const]] ordo::Lanes::Vector _ZGVeN8v_sin(ordo::Lanes::Vector);
[[gnu::const]] ordo::Lanes::Vector _ZGVeN8v_cos(ordo::Lanes::Vector);
[[gnu::const]] ordo::Lanes::Vector _ZGVeN8v_log(ordo::Lanes::Vector);
[[gnu::const]] ordo::Lanes::Vector _ZGVeN8v_exp(ordo::Lanes::Vector);
}
#elif defined(ORDO_LIBMVEC) && defined(__AVX2__)
extern "C" {
[[gnu::const]] ordo::Lanes::Half _ZGVdN4v_sin(ordo::Lanes::Half);
[[gnu::const]] ordo::Lanes::Half _ZGVdN4v_cos(ordo::Lanes::Half);
[[gnu::const]] ordo::Lanes::Half _ZGVdN4v_log(ordo::Lanes::Half);
[[gnu::const]] ordo::Lanes::Half _ZGVdN4v_exp(ordo::Lanes::Half);
}
#endif

namespace ordo {

using std::cos;
using std::exp;
using std::log;
using std::sin;
using std::sqrt;

template <class F>
ORDO_FLAT inline Lanes each_lane(Lanes a, F&& f)
{
    for (int k = 0; k < 8; ++k) a[k] = f(a[k]);
    return a;
}

#if defined(ORDO_LIBMVEC) && defined(__AVX512F__)
ORDO_FLAT inline Lanes sin(const Lanes& a) { return {_ZGVeN8v_sin(a.v)}; }
ORDO_FLAT inline Lanes cos(const Lanes& a) { return {_ZGVeN8v_cos(a.v)}; }
ORDO_FLAT inline Lanes log(const Lanes& a) { return {_ZGVeN8v_log(a.v)}; }
ORDO_FLAT inline Lanes exp(const Lanes& a) { return {_ZGVeN8v_exp(a.v)}; }
#elif defined(ORDO_LIBMVEC) && defined(__AVX2__)
ORDO_FLAT inline Lanes sin(const Lanes& a) { return {_ZGVdN4v_sin(a.lo), _ZGVdN4v_sin(a.hi)}; }
ORDO_FLAT inline Lanes cos(const Lanes& a) { return {_ZGVdN4v_cos(a.lo), _ZGVdN4v_cos(a.hi)}; }
ORDO_FLAT inline Lanes log(const Lanes& a) { return {_ZGVdN4v_log(a.lo), _ZGVdN4v_log(a.hi)}; }
ORDO_FLAT inline Lanes exp(const Lanes& a) { return {_ZGVdN4v_exp(a.lo), _ZGVdN4v_exp(a.hi)}; }
#else
ORDO_FLAT inline Lanes sin(const Lanes& a)
{
    return each_lane(a, [](double x) { return std::sin(x); });
}
ORDO_FLAT inline Lanes cos(const Lanes& a)
{
    return each_lane(a, [](double x) { return std::cos(x); });
}
ORDO_FLAT inline Lanes log(const Lanes& a)
{
    return each_lane(a, [](double x) { return std::log(x); });
}
ORDO_FLAT inline Lanes exp(const Lanes& a)
{
    return each_lane(a, [](double x) { return std::exp(x); });
}
#endif
ORDO_FLAT inline Lanes sqrt(const Lanes& a)
{
#if !defined(__CUDACC__) && defined(__AVX512F__)
    return {_mm512_maskz_sqrt_pd(0xff, a.v)};  // all lanes; the plain one warns falsely in g++ 12 (its bug 105593)
#elif !defined(__CUDACC__) && defined(__AVX2__)
    return {_mm256_sqrt_pd(a.lo), _mm256_sqrt_pd(a.hi)};
#else
    return each_lane(a, [](double x) { return std::sqrt(x); });
#endif
}

}  // namespace ordo
