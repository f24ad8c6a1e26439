// Compiler switches and host/device marks; included by everything, knows nothing.
#pragma once

#if defined(__CUDACC__)
#define ORDO_HD __host__ __device__
#else
#define ORDO_HD
#endif

// For functions that are rarely called in a particle loop: inlining them would only cost compile time.
#if defined(__GNUC__) && !defined(__CUDACC__)
#define ORDO_CALL __attribute__((noinline))
#else
#define ORDO_CALL
#endif

// For the small tensor operations in particle loops: otherwise the compiler calls them (measured: 60 % of a gather).
// Off under the address sanitizer, whose builds would take minutes a file, and with ORDO_FLATTEN=OFF: passes_hat.cpp then takes
// 12 s at -O1 instead of 35 s.
#if defined(__GNUC__) && !defined(__CUDACC__) && defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(ORDO_NO_FLATTEN)
#define ORDO_FLAT ORDO_HD __attribute__((always_inline))
#else
#define ORDO_FLAT ORDO_HD
#endif

// ORDO_FLAT for lambdas: device code takes its marks from where a lambda stands.
#if defined(__CUDACC__)
#define ORDO_FLAT_LAMBDA
#else
#define ORDO_FLAT_LAMBDA ORDO_FLAT
#endif
