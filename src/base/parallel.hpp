// The only place that knows of threads. Results of these loops do not depend on their number.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#if defined(ORDO_OPENMP)
#include <omp.h>
#endif

namespace ordo {

#if defined(ORDO_OPENMP)
inline int thread_count() { return omp_get_max_threads(); }
inline int thread_index() { return omp_get_thread_num(); }
inline void set_thread_count(int n) { omp_set_num_threads(n); }
#else
inline int thread_count() { return 1; }
inline int thread_index() { return 0; }
inline void set_thread_count(int) {}
#endif

/// f(k) by a call: a loop with threads and one without share its code.
template <class F>
[[gnu::noinline]] void call_apart(F& f, std::ptrdiff_t k)
{
    f(k);
}

/// f(k) for k in [0, n), each k by one thread, in any order. The calls must not touch common data, and must not throw.
/// `worth` is false where they are too short to pay for threads.
template <class F>
void parallel_for(std::ptrdiff_t n, F&& f, [[maybe_unused]] bool worth = true)
{
#if defined(ORDO_OPENMP)
    if (n > 1 && worth && thread_count() > 1) {  // a parallel region of one thread costs a team and two calls of the system
#pragma omp parallel for schedule(dynamic, 1)
        for (std::ptrdiff_t k = 0; k < n; ++k) call_apart(f, k);
        return;
    }
#endif
    for (std::ptrdiff_t k = 0; k < n; ++k) call_apart(f, k);
}

/// f(thread, number of threads) by all threads at once, for work that one hands to another; thread 0 is the one that calls. `worth` as above.
template <class F>
void parallel_team(F&& f, [[maybe_unused]] bool worth = true)
{
#if defined(ORDO_OPENMP)
    if (worth && thread_count() > 1) {
#pragma omp parallel
        f(omp_get_thread_num(), omp_get_num_threads());
        return;
    }
#endif
    f(0, 1);
}

/// Elements per piece of a reduction: fixed, so that the order of a sum does not depend on the threads.
inline constexpr std::ptrdiff_t kPiece = 2048;

/// f(begin, end) over pieces of [0, n). `worth` as above.
template <class F>
void parallel_pieces(std::ptrdiff_t n, F&& f, std::ptrdiff_t piece = kPiece, bool worth = true)
{
    parallel_for((n + piece - 1) / piece, [&](std::ptrdiff_t k) { f(k * piece, std::min(n, (k + 1) * piece)); }, worth);
}

/// f(i) for i in [0, n), in pieces: for f that may cost less than its scheduling.
template <class F>
void parallel_for_each(std::ptrdiff_t n, F&& f, std::ptrdiff_t piece = kPiece, bool worth = true)
{
    parallel_pieces(
        n,
        [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            for (std::ptrdiff_t i = begin; i < end; ++i) f(i);
        },
        piece, worth);
}

/// The fold of f(i) over [0, n) by `combine(total, value)`, starting at `zero`. Pieces are folded in parallel and then combined
/// in order, so the result is the same for any number of threads.
template <class T, class F, class Combine>
T parallel_reduce(std::ptrdiff_t n, T zero, F&& f, Combine&& combine)
{
    std::vector<T> partial(static_cast<std::size_t>((n + kPiece - 1) / kPiece), zero);
    parallel_pieces(n, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        T total = zero;
        for (std::ptrdiff_t i = begin; i < end; ++i) combine(total, f(i));
        partial[static_cast<std::size_t>(begin / kPiece)] = total;
    });
    T total = zero;
    for (const T& p : partial) combine(total, p);
    return total;
}

}  // namespace ordo
