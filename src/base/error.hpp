// Three errors, three tools: the user's (InputError), the numerics' (NumericalError), the programmer's (ORDO_EXPECT).
#pragma once

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace ordo {

/// The user's input cannot be used: exit code 2, nothing written. The message says where, what, why and the remedy.
struct InputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The run cannot go on: exit code 1 after a last readable output. The message names step, time, particle, quantity.
struct NumericalError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Output cannot be written (disk full, unwritable file): exit code 1.
struct OutputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

[[noreturn]] inline void contract_failed(const char* what, const char* file, int line)
{
    std::fprintf(stderr, "ordo: contract violated: %s (%s:%d); this is a bug in ordo, please report it\n", what, file, line);
    std::abort();
}

}  // namespace ordo

// Contracts cost time, so they are compiled in the checked and sanitizer builds only.
#if defined(ORDO_CONTRACTS) && !defined(__CUDACC__)
#define ORDO_EXPECT(condition) ((condition) ? void(0) : ::ordo::contract_failed(#condition, __FILE__, __LINE__))
#else
#define ORDO_EXPECT(condition) void(0)
#endif
