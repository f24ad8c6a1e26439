#include "app/commands.hpp"
#include "base/array.hpp"
#include "base/lanes.hpp"
#include "base/parallel.hpp"
#include "io/file.hpp"
#include "io/schema.hpp"
#include "method/explicit.hpp"
#include "method/planting.hpp"
#include "ordo_version.hpp"
#include "particles/seeding.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

namespace ordo::app {

namespace {

std::string build_flags()
{
    std::string flags = "g++ " __VERSION__;
#if defined(__clang__)
    flags = __VERSION__;
#endif
#if defined(__AVX512F__)
    flags += ", AVX-512";
#elif defined(__AVX2__)
    flags += ", AVX2";
#endif
#if defined(ORDO_OPENMP)
    flags += ", OpenMP";
#endif
#if defined(ORDO_CONTRACTS)
    flags += ", contracts";
#endif
    return flags;
}

void emit(const BenchOptions& options, const std::string& json, const std::string& text)
{
    if (!options.json) {
        fmt::print("{}", text);
    } else if (*options.json == "-") {
        fmt::print("{}", json);
    } else {
        io::AtomicFile file(*options.json);
        file.write(json);
        file.commit();
    }
}

double seconds_since(std::chrono::steady_clock::time_point begin)
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// A block of 3/4 of a unit box, 2^D particles a cell, vibrating a little: the problem of the project's speed targets.
template <int D>
int bench_method(const BenchOptions& options, const MethodSpec& spec)
{
    const double per_axis = std::pow(options.particles, 1.0 / D) / 2;  // cells along a side of the block
    const int n           = std::max(8, static_cast<int>(std::lround(per_axis / 0.75 / 8)) * 8);
    const double h        = 1.0 / n;
    const double E = 1e6, nu = 0.3;
    Model<D> model{};
    model.method    = spec;
    model.h         = Vec<D>::filled(h);
    model.cells     = Index<D>::filled(n);
    model.materials = {{MaterialModel::neo_hookean, 1e3, E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))}};
    model.body_forces.resize(2);

    const int low    = n / 8;
    const auto seeds = fill_box(Bounds<D>{Vec<D>::filled(low * h), Vec<D>::filled((n - low) * h)},
                                SubCells<D>{Vec<D>{}, model.h, Index<D>::filled(2)});
    Particles<D> p   = plant_all(model, seeds);
    for (int i = 0; i < p.count; ++i) {
        p.v[i][0] = 0.01 * std::sin(6 * p.x[i][0]);
        p.body[i] = p.x[i][0] > 0.5;  // bodies meet where enrichment wants an interface
    }
    enrich(model, p);
    Explicit<D> method(std::move(model));
    State<D> s      = method.start(std::move(p));
    const double dt = 0.2 * h / std::sqrt(E / 1e3);
    method.step(s, dt);  // touches all memory
    StageTimes times;
    method.measure(&times);
    const auto begin = std::chrono::steady_clock::now();
    for (int k = 0; k < options.steps; ++k) method.step(s, dt);
    const double seconds = seconds_since(begin);

    const double work       = static_cast<double>(s.particles.count) * options.steps;
    const std::size_t bytes = s.particles.bytes_per_particle();
    double named            = 0;
    std::string json =
        fmt::format("{{\"method\": \"{}\", \"dim\": {}, \"particles\": {}, \"cells_per_axis\": {}, \"steps\": {}, \"threads\": "
                    "{},\n \"seconds\": {}, \"particle_steps_per_second\": {},\n \"ns_per_particle\": {{",
                    options.method, D, s.particles.count, n, options.steps, thread_count(), seconds, work / seconds);
    std::string text =
        fmt::format("{} {}D: {} particles, {} steps, {} thread{}: {:.3g} M particle-steps/s\n", options.method, D,
                    s.particles.count, options.steps, thread_count(), thread_count() > 1 ? "s" : "", work / seconds / 1e6);
    for (int k = 0; k < StageTimes::count; ++k) {
        named += times.seconds[k];
        json += fmt::format("\"{}\": {}, ", StageTimes::names[k], 1e9 * times.seconds[k] / work);
        text += fmt::format("  {:<8} {:7.1f} ns per particle\n", StageTimes::names[k], 1e9 * times.seconds[k] / work);
    }
    json += fmt::format(
        "\"other\": {}}},\n \"bytes_per_particle\": {}, \"version\": \"{}\", \"commit\": \"{}\", \"build\": \"{}\"}}\n",
        1e9 * (seconds - named) / work, bytes, ORDO_VERSION, ORDO_COMMIT, build_flags());
    text += fmt::format("  {:<8} {:7.1f} ns per particle\n  {} bytes per particle; {}\n", "other", 1e9 * (seconds - named) / work,
                        bytes, build_flags());
    emit(options, json, text);
    return 0;
}

/// Peak of fused multiply-adds and bandwidth of a triad, over all threads.
int bench_machine(const BenchOptions& options)
{
    const int threads = thread_count();
    // Independent chains hide the latency of the multiply-add.
    constexpr int chains = 12;
    constexpr long turns = 20'000'000;
    std::vector<double> sums(static_cast<std::size_t>(threads));
    auto begin = std::chrono::steady_clock::now();
    parallel_for(threads, [&](std::ptrdiff_t t) {
        Lanes x[chains];
        for (int c = 0; c < chains; ++c) x[c] = make_lanes(c, 1, 2, 3, 4, 5, 6, 7);
        const Lanes a = make_lanes(1, 2, 3, 4, 5, 6, 7, 8);
        for (long k = 0; k < turns; ++k)
            for (Lanes& l : x) l = a + l * 0.999;
        for (const Lanes& l : x) sums[static_cast<std::size_t>(t)] += l[0];
    });
    const double gflops = 2.0 * 8 * chains * turns * threads / seconds_since(begin) * 1e-9;

    constexpr std::ptrdiff_t n = 1 << 25;
    Array<double> a(n), b(n), c(n);
    auto triad = [&] { parallel_for_each(n, [&](std::ptrdiff_t i) { a[i] = b[i] + 3.0 * c[i]; }); };
    triad();
    double best = 0;
    for (int k = 0; k < 5; ++k) {
        begin = std::chrono::steady_clock::now();
        triad();
        best = std::max(best, 3.0 * 8 * n / seconds_since(begin) * 1e-9);
    }
    const bool finite = std::isfinite(sums[0]);
    emit(options,
         fmt::format("{{\"threads\": {}, \"peak_gflops\": {}, \"bandwidth_gb_per_second\": {}, \"build\": \"{}\"}}\n", threads,
                     gflops, best, build_flags()),
         fmt::format("{} thread{}: {:.1f} Gflop/s of fused multiply-adds{}, {:.1f} GB/s (triad)\n{}\n", threads,
                     threads > 1 ? "s" : "", gflops, finite ? "" : " (overflow)", best, build_flags()));
    return 0;
}

}  // namespace

void require_writable_file(const std::string& option, const std::string& path)
{
    if (path.empty()) throw InputError(option + ": the name of the file is empty");
    try {
        io::AtomicFile probe(path);
    } catch (const OutputError& e) {
        throw InputError(option + " " + e.what());
    }
}

int bench(const BenchOptions& options)
{
    if (options.json && *options.json != "-") require_writable_file("--json", *options.json);
    if (options.machine) return bench_machine(options);
    const Preset* preset = find_preset(options.method);
    if (!preset)
        throw InputError("--method " + options.method + ": there is no such preset. " +
                         io::suggestion(options.method, preset_names()));
    switch (options.dim) {
    case 1: return bench_method<1>(options, preset->spec);
    case 2: return bench_method<2>(options, preset->spec);
    default: return bench_method<3>(options, preset->spec);
    }
}

}  // namespace ordo::app
