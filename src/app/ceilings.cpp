#include "app/ceilings.hpp"

#include "base/array.hpp"
#include "base/lanes.hpp"
#include "base/parallel.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

namespace ordo::app {

namespace {

/// The shortest time of f() over `runs` runs, s.
template <class F>
double least_seconds(int runs, F&& f)
{
    double least = 1e300;
    for (int k = 0; k < runs; ++k) {
        const auto begin = std::chrono::steady_clock::now();
        f();
        least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return least;
}

double peak_flops()
{
    // Independent chains hide the latency of the multiply-add; all of them must fit in registers.
#if defined(__AVX512F__)
    constexpr int chains = 12;
#else
    constexpr int chains = 6;
#endif
    constexpr long turns = 1'000'000;  // takes milliseconds, so that threads find cores that are free
    const int threads    = thread_count();
    std::vector<Lanes> sums(static_cast<std::size_t>(threads));  // keeps the compiler from removing the work
    const double seconds = least_seconds(30, [&] {
        parallel_for(threads, [&](std::ptrdiff_t t) {
            Lanes x[chains];
            for (int c = 0; c < chains; ++c) x[c] = make_lanes(c, 1, 2, 3, 4, 5, 6, 7);
            const Lanes a = make_lanes(1, 2, 3, 4, 5, 6, 7, 8);
            for (long k = 0; k < turns; ++k)
                for (Lanes& l : x) l = a + l * 0.999;
            for (const Lanes& l : x) sums[static_cast<std::size_t>(t)] += l;
        });
    });
    double sum           = 0;
    for (const Lanes& l : sums) sum += l[0];
    return sum > 0 ? 2.0 * 8 * chains * turns * threads / seconds : 0.0;
}

double triad_bandwidth()
{
    constexpr std::ptrdiff_t n = 1 << 24;  // 128 MiB per stream, more than caches hold
    Array<double> a(n), b(n), c(n);
    auto triad = [to = a.data(), one = b.data(), other = c.data()] {
        parallel_pieces(n, [=](std::ptrdiff_t begin, std::ptrdiff_t end) {
            for (std::ptrdiff_t i = begin; i < end; ++i) to[i] = one[i] + 3.0 * other[i];
        });
    };
    std::fill(b.begin(), b.end(), 1.0);  // untouched, both would be a single page of zeros
    std::fill(c.begin(), c.end(), 1.0);
    triad();
    return 3.0 * sizeof(double) * n / least_seconds(5, triad);
}

}  // namespace

Ceilings measure_ceilings() { return {peak_flops(), triad_bandwidth()}; }

}  // namespace ordo::app
