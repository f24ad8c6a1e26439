#include "app/bench_block.hpp"
#include "app/ceilings.hpp"
#include "app/commands.hpp"
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "io/file.hpp"
#include "io/input.hpp"
#include "io/message.hpp"
#include "io/method_names.hpp"
#include "ordo_version.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <map>
#include <new>

namespace ordo::app {

namespace {

using Json = nlohmann::ordered_json;

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

/// A preset with the changes of --set, in a dimension, and the result of its run.
struct Outcome {
    std::string method;
    std::vector<std::string> overrides;
    BenchTask task;
    std::string refused, failed;  ///< why; empty if it ran
    Measurement m{};

    bool has_run() const { return refused.empty() && failed.empty(); }
};

/// Work per particle and step, and shares of the ceilings.
struct Shares {
    double rate, flops, bytes, of_peak, of_bandwidth;

    Shares(const Measurement& m, const Ceilings& c)
        : rate(m.particle_steps() / m.seconds),
          flops(m.work.total().flops / m.particles),
          bytes(m.work.total().bytes / m.particles),
          of_peak(flops * rate / c.flops),
          of_bandwidth(bytes * rate / c.bandwidth)
    {}
};

std::string plural(int n, const std::string& what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

/// The seconds outside of all stages.
double other_seconds(const Measurement& m)
{
    double rest = m.seconds;
    for (const double s : m.stages) rest -= s;
    return std::max(rest, 0.0);  // medians of parts may exceed the median of the whole
}

std::string title(const Outcome& o)
{
    std::string text = fmt::format("{} {}D, {}", o.method, o.task.dim, o.task.material.law->name);
    for (const std::string& s : o.overrides) text += " " + s;
    return text;
}

// ---- JSON -----------------------------------------------------------------------------------------------------------------

Json to_json(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json per_particle(const StepWork& work, int particles, double Work::*what)
{
    Json parts = Json::object();
    for (int k = 0; k < StageTimes::count; ++k) parts[std::string(StageTimes::names[k])] = work.stages[k].*what / particles;
    return parts;
}

Json to_json(const Outcome& o, const Ceilings& ceilings)
{
    const Measurement& m = o.m;
    Json json = {{"method", o.method}, {"dim", o.task.dim}, {"material", o.task.material.law->name}, {"set", o.overrides}};
    if (!o.refused.empty()) json["refused"] = o.refused;
    if (!o.failed.empty()) json["failed"] = o.failed;
    if (!o.has_run()) return json;
    const Shares shares(m, ceilings);
    Json ns = Json::object();
    for (int k = 0; k < StageTimes::count; ++k) ns[std::string(StageTimes::names[k])] = 1e9 * m.stages[k] / m.particle_steps();
    ns["other"] = 1e9 * other_seconds(m) / m.particle_steps();
    json.update({{"particles", m.particles},
                 {"cells_per_axis", m.cells_per_axis},
                 {"courant_number", m.courant_number},
                 {"steps", m.steps},
                 {"repeats", o.task.repeats},
                 {"threads", thread_count()},
                 {"seconds", m.seconds},
                 {"particle_steps_per_second", shares.rate},
                 {"ns_per_particle", ns},
                 {"bytes_per_particle", static_cast<long>(m.bytes_per_particle)},
                 {"resident_bytes_per_particle", to_json(m.resident_bytes)},
                 {"setup_bytes_per_particle", to_json(m.setup_bytes)},
                 {"node_visits_per_particle", m.work.visits / m.particles},
                 {"mass_solves_per_step", m.mass_solves},
                 {"mass_iterations_per_step", m.mass_iterations},
                 {"flops_per_particle_step", shares.flops},
                 {"traffic_bytes_per_particle_step", shares.bytes},
                 {"flops_per_particle", per_particle(m.work, m.particles, &Work::flops)},
                 {"traffic_bytes_per_particle", per_particle(m.work, m.particles, &Work::bytes)},
                 {"peak_gflops", ceilings.flops * 1e-9},
                 {"bandwidth_gb_per_second", ceilings.bandwidth * 1e-9},
                 {"share_of_peak_flops", shares.of_peak},
                 {"share_of_bandwidth", shares.of_bandwidth},
                 {"version", ORDO_VERSION},
                 {"commit", ORDO_COMMIT},
                 {"build", build_flags()}});
    return json;
}

void write_json(const std::string& file, const Json& json)
{
    const std::string text = json.dump(1) + "\n";
    if (file == "-") {
        fmt::print("{}", text);
        return;
    }
    io::AtomicFile out(file);
    out.write(text);
    out.commit();
}

// ---- text -----------------------------------------------------------------------------------------------------------------

std::string bytes_text(const std::optional<double>& bytes) { return bytes ? fmt::format("{:.0f}", *bytes) : "-"; }

std::string machine_text(const Ceilings& c)
{
    return fmt::format("{}: {:.1f} Gflop/s of fused multiply-adds, {:.1f} GB/s (triad, three streams)\n{}\n",
                       plural(thread_count(), "thread"), c.flops * 1e-9, c.bandwidth * 1e-9, build_flags());
}

/// All about one method.
std::string page(const Outcome& o, const Ceilings& ceilings)
{
    const Measurement& m = o.m;
    const Shares shares(m, ceilings);
    std::string text = fmt::format("{}: {} particles, {}{}, {}: {:.3g} M particle-steps/s\n", title(o), m.particles,
                                   plural(m.steps, "step"), o.task.repeats > 1 ? fmt::format(" {} times", o.task.repeats) : "",
                                   plural(thread_count(), "thread"), shares.rate / 1e6);
    text += "  per particle and step      ns     flop    bytes\n";
    const double ns = 1e9 / m.particle_steps();
    for (int k = 0; k < StageTimes::count; ++k)
        text += fmt::format("  {:<18} {:10.1f} {:8.0f} {:8.0f}\n", StageTimes::names[k], m.stages[k] * ns,
                            m.work.stages[k].flops / m.particles, m.work.stages[k].bytes / m.particles);
    text += fmt::format("  {:<18} {:10.1f}\n", "other", other_seconds(m) * ns);
    text += fmt::format("  {:<18} {:10.1f} {:8.0f} {:8.0f}\n", "all", m.seconds * ns, shares.flops, shares.bytes);
    text += fmt::format("  {:.0f} % of the peak of {:.1f} Gflop/s, {:.0f} % of the bandwidth of {:.1f} GB/s\n",
                        100 * shares.of_peak, ceilings.flops * 1e-9, 100 * shares.of_bandwidth, ceilings.bandwidth * 1e-9);
    text += fmt::format("  {:.0f} bytes per particle in arrays; resident at most {}, until set up {}\n", m.bytes_per_particle,
                        bytes_text(m.resident_bytes), bytes_text(m.setup_bytes));
    if (m.mass_solves > 0)
        text += fmt::format("  mass matrix: {:.3g} iterations a solve, {:.3g} solves a step\n", m.mass_iterations / m.mass_solves,
                            m.mass_solves);
    return text + "  " + build_flags() + "\n";
}

constexpr auto kHeader = "method        dim  particles  steps  M steps/s  ns: scatter       fit     nodes    gather  resident    "
                         "flop    bytes  % peak  "
                         "% bandwidth\n";

/// One line about one method.
std::string row(const Outcome& o, const Ceilings& ceilings)
{
    const std::string name = fmt::format("{:<13} {:3}  ", o.method, o.task.dim);
    if (!o.refused.empty()) return name + "refused: " + o.refused + "\n";
    if (!o.failed.empty()) return name + "failed: " + o.failed + "\n";
    const Measurement& m = o.m;
    const Shares shares(m, ceilings);
    auto ns = [&](StageTimes::Stage stage) { return 1e9 * m.stages[stage] / m.particle_steps(); };
    return name + fmt::format("{:9}  {:5}  {:9.3g}  {:11.1f} {:9.1f} {:9.1f} {:9.1f} {:>9} {:7.0f} {:8.0f} {:7.1f} {:12.1f}\n",
                              m.particles, m.steps, shares.rate / 1e6, ns(StageTimes::scatter), ns(StageTimes::fit),
                              ns(StageTimes::nodes), ns(StageTimes::gather), bytes_text(m.resident_bytes), shares.flops,
                              shares.bytes, 100 * shares.of_peak, 100 * shares.of_bandwidth);
}

void print(const std::string& text)
{
    fmt::print("{}", text);
    std::fflush(stdout);
}

// ---- the command ----------------------------------------------------------------------------------------------------------

/// The material of the block: Young's modulus 1e6 Pa, density 1000 kg/m^3 or about that stiff, and so weak that it flows from the
/// first steps on, as a law costs most there.
Material bench_material(const std::string& law, int dim)
{
    static const std::map<std::string, std::vector<std::string>> others{
        {"linear-rate-1d", {"young=1e6"}},
        {"fluid", {"sound_speed=30", "viscosity=1e-3"}},
        {"cam-clay",
         {"shear=4e5", "swelling_index=0.01", "compression_index=0.1", "critical_slope=1", "reference_pressure=8e3",
          "preconsolidation=8e3"}},
        {"ogden", {"bulk=8e5", "moduli=[3e5, -1e5]", "exponents=[2, -2]"}},
        {"mooney-rivlin", {"bulk=8e5", "c10=1.5e5", "c01=0.5e5"}}};
    static const std::map<std::string, std::vector<std::string>> more{
        {"j2", {"yield=1e-3", "hardening=1e5"}},
        {"drucker-prager", {"friction_angle=30", "dilation_angle=10", "cohesion=1e-3"}},
        {"mohr-coulomb", {"friction_angle=30", "dilation_angle=10", "cohesion=1e-3"}},
        {"johnson-cook",
         {"A=1e-3", "B=1e5", "n=0.5", "C=0.01", "m=1", "reference_rate=1e-3", "reference_temperature=300",
          "melting_temperature=1000", "specific_heat=1000", "taylor_quinney=0.9"}},
        {"mu-i",
         {"friction_static=0.3", "friction_dynamic=0.6", "inertial_number=0.3", "grain_diameter=1e-3", "grain_density=2000"}}};
    if (!find_law(law)) {
        std::vector<std::string> names;
        for (const LawRow& row : laws()) names.emplace_back(row.name);
        throw InputError(fmt::format("--material {}: there is no such law. {}", law, io::suggestion(law, names)));
    }
    std::vector<std::string> settings{"young=1e6", "poisson=0.3"};
    if (const auto found = others.find(law); found != others.end()) settings = found->second;
    if (const auto found = more.find(law); found != more.end())
        settings.insert(settings.end(), found->second.begin(), found->second.end());
    return io::read_material(law, settings, dim).second;
}

/// The preset with the axes of --set, which may also be written method.AXIS as in other commands.
Outcome choose(const BenchOptions& options, const std::string& method, int dim, const BenchTask& task)
{
    Outcome o{.method = method, .overrides = options.overrides, .task = task, .refused = {}, .failed = {}};
    o.task.dim      = dim;
    o.task.material = bench_material(options.material, dim);
    o.task.method   = io::preset_called(method).spec;
    for (const std::string& text : options.overrides) {
        auto [key, value]          = parse_setting(text);
        const bool is_qualified    = key.starts_with("method.");
        const std::string& at_axis = is_qualified ? key.substr(7) : key;
        io::set_axis(o.task.method, is_qualified ? "--set method." : "--set ", at_axis, value);
    }
    return o;
}

void run(Outcome& o)
{
    try {
        io::require_allowed(o.method, o.task.method);
        o.m = run_bench(o.task);
    } catch (const InputError& e) {
        o.refused = e.what();
    } catch (const NumericalError& e) {
        o.failed = e.what();
    } catch (const std::bad_alloc&) {
        o.failed = "out of memory; use fewer particles";
    }
}

int bench_machine(const BenchOptions& options)
{
    const Ceilings c = measure_ceilings();
    if (options.json)
        write_json(*options.json, {{"threads", thread_count()},
                                   {"peak_gflops", c.flops * 1e-9},
                                   {"bandwidth_gb_per_second", c.bandwidth * 1e-9},
                                   {"build", build_flags()}});
    else
        print(machine_text(c));
    return 0;
}

int bench_one(const BenchOptions& options)
{
    const BenchTask task{.method    = {},
                         .material  = {},
                         .dim       = 3,
                         .particles = options.particles.value_or(1'000'000),
                         .steps     = options.steps.value_or(20),
                         .repeats   = options.repeats};
    Outcome o = choose(options, options.method.value_or("mpm"), options.dim.value_or(3), task);
    run(o);
    if (!o.refused.empty()) throw InputError(o.refused);
    if (!o.failed.empty()) throw NumericalError(o.failed);
    const Ceilings ceilings = measure_ceilings();  // after the run, so that its arrays do not count as memory of the method
    if (options.json)
        write_json(*options.json, to_json(o, ceilings));
    else
        print(page(o, ceilings));
    return 0;
}

int bench_all(const BenchOptions& options)
{
    const BenchTask task{.method    = {},
                         .material  = {},
                         .dim       = 3,
                         .particles = options.particles.value_or(200'000),
                         .steps     = options.steps,
                         .repeats   = options.repeats};
    std::vector<Outcome> outcomes;
    for (const int dim : options.dim ? std::vector{*options.dim} : std::vector{2, 3})
        for (const std::string& method : preset_names()) outcomes.push_back(choose(options, method, dim, task));
    const Ceilings ceilings = measure_ceilings();
    const bool is_text      = !options.json;
    if (is_text) print(machine_text(ceilings) + kHeader);
    Json json    = Json::array();
    int failures = 0;
    for (Outcome& o : outcomes) {
        run(o);
        failures += !o.failed.empty();
        json.push_back(to_json(o, ceilings));
        if (is_text) print(row(o, ceilings));
    }
    if (!is_text) write_json(*options.json, json);
    if (failures > 0) io::say("ordo: {} of {} runs failed\n", failures, outcomes.size());
    return failures > 0 ? 1 : 0;
}

}  // namespace

int bench(const BenchOptions& options)
{
    if (options.json && *options.json != "-") require_writable_file("--json", *options.json);
    if (options.machine) return bench_machine(options);
    if (options.all && options.method) throw InputError("--all runs every preset; leave out --method");
    return options.all ? bench_all(options) : bench_one(options);
}

}  // namespace ordo::app
