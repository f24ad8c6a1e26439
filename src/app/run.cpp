#include "app/commands.hpp"
#include "app/ranks.hpp"
#include "base/agree.hpp"
#include "base/parallel.hpp"
#include "io/build.hpp"
#include "io/message.hpp"
#include "io/observers.hpp"
#include "io/vtk.hpp"
#include "method/courant.hpp"
#include "method/sharing.hpp"
#include "setup/time_step.hpp"
#include "sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string_view>

namespace ordo::app {

namespace {

volatile std::sig_atomic_t g_signal = 0;

extern "C" void remember_signal(int signal) { g_signal = signal; }

/// SIGINT, SIGTERM and SIGHUP (unless nohup ignores it) end the run after the step; a second signal of the same kind kills it. With
/// several ranks SIGUSR1 does too: mpiexec passes it on and kills nobody.
void catch_signals(bool has_ranks)
{
    struct sigaction action {};
    action.sa_handler = remember_signal;
    action.sa_flags   = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    if (has_ranks) sigaction(SIGUSR1, &action, nullptr);
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

io::CaseInput read(const RunOptions& options)
{
    io::CaseInput input = io::read_case(options.file, options.overrides);
    if (options.output) {
        input.output.directory       = *options.output;
        input.output.at["directory"] = {"--output", 0, 0};
    }
    input.output.directory = io::expanded_directory(input);
    return input;
}

/// f.template operator()<D>() for the dimension of the case.
template <class F>
auto with_dim(int dim, F&& f)
{
    switch (dim) {
    case 1: return f.template operator()<1>();
    case 2: return f.template operator()<2>();
    default: return f.template operator()<3>();
    }
}

/// Some methods have no stable time step; they still work if particles stay near sub-cell centres or runs are short.
void warn_of_instability(const MethodSpec& method)
{
    if (const Instability* found = instability_of(method))
        io::say("ordo: warning: with this method short waves grow, at any time step, once particles have left sub-cell centres: "
                "{} (docs/verification.md, Dispersion)\n",
                found->why);
}

/// The name of a directory as one word of a shell, which is no option.
std::string in_shell(const std::string& name)
{
    constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./+-=:,@%";
    if (name.starts_with('-')) return in_shell("./" + name);
    if (!name.empty() && name.find_first_not_of(plain) == std::string::npos) return name;
    std::string quoted = "'";
    for (const char c : name) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

/// What a shell needs before python3 where the Python module lies beside the program, as in a build tree: it is not installed.
std::string module_beside()
{
    std::error_code none;
    const auto module = folder_of_program() / "python";
    if (!std::filesystem::exists(module / "ordo" / "__init__.py", none)) return "";
    return "PYTHONPATH=" + in_shell(std::filesystem::proximate(module, none).string()) + " ";
}

/// The messages at the end of a run.
template <int D>
class Summary : public Observer<D> {
  public:
    Summary(const io::Writer<D>& writer, bool quiet) : writer_(writer), quiet_(quiet) {}

    void failed(Simulation<D>& sim, const NumericalError&) override { ended(sim); }
    void ended(Simulation<D>& sim) override
    {
        for (int k = 0; k < WatchSpec::count; ++k)
            if (const long n = sim.watch()->found()[k]; n > 1) io::say("ordo: warning: {} in {} steps\n", WatchSpec::names[k], n);
        if (quiet_) return;
        const std::string directory = writer_.directory().string(), module = module_beside();
        io::say("wrote {} frames and history.csv to {}\nto look at it: {}python3 -m ordo.report {}\n", writer_.frame_count(),
                directory, module, in_shell(directory));
    }

  private:
    const io::Writer<D>& writer_;
    bool quiet_;
};

/// The signal that any rank has got, the same on all after each step; 0 if none.
template <int D>
class JoinSignals : public Observer<D> {
  public:
    void after_step(Simulation<D>& sim, const StepSize&) override
    {
        signal_ = static_cast<int>(largest(*sim.state().ranks, static_cast<double>(g_signal)));
    }
    int signal() const { return signal_; }

  private:
    int signal_ = 0;
};

template <int D>
void announce(const io::CaseInput& input, const Simulation<D>& sim, Ranks& ranks, bool is_restart)
{
    const State<D>& s       = sim.state();
    const std::string parts = ranks.is_alone() ? "" : fmt::format(" of {} ranks", ranks.count());
    std::int64_t particles  = s.particles.count;
    ranks.add({&particles, 1});
    io::say("{}: {}D, {} particles, {} on {} thread{}{}\n", input.title.empty() ? "ordo" : input.title, D, particles,
            input.method.preset, thread_count(), thread_count() > 1 ? "s" : "", parts);
    if (is_restart) io::say("continues from step {}, t = {:.6g} s\n", s.n, s.t);
    for (const std::string& note : sim.notes()) io::say("ordo: note: {}\n", note);
    warn_of_instability(sim.model().method);
}

template <int D>
Simulation<D> simulation_of(const io::CaseInput& input, setup::Built<D> built, Ranks& ranks = alone())
{
    return Simulation<D>(
        std::move(built), input.watch_spec, [](const std::string& found) { io::say("ordo: warning: {}\n", found); }, ranks);
}

/// Builds a case and starts the ranks of `launch`. Each of them makes a share of the particles.
template <int D>
setup::Built<D> build_and_start(const io::CaseInput& input, const RunOptions& options, Launch& launch)
{
    const setup::Share share = launched_share();
    std::optional<setup::Built<D>> built;
    KeptFailure failure;  // perhaps on some ranks only, which cannot tell the others yet
    failure.run([&] {
        built.emplace(io::build<D>(input, setup::kMostParticles, share));
        if (share.count > 1) require_shareable(built->model);
    });
    Ranks& ranks = launch.start();
    if (!options.has_threads) launch.divide_threads();
    agree(ranks, [&] { failure.rethrow(); });
    if (share.count > 1) io::require_runnable(input, *built, ranks);
    return std::move(*built);
}

/// A method that is faster, and what it costs.
std::string faster_than(const MethodSpec& m)
{
    if (m.mass == MassMatrix::consistent) return "method.mass = \"lumped\" spares the solver of each step, cpdi1 too";
    if (fits_velocity(m) || m.projection == Projection::tls || m.quadrature != Quadrature::particle) return "cpdi1 takes no fits";
    if (m.domain == Domain::point && m.basis == Basis::hat) return "a coarser grid is all that is faster";
    return "ugimp and mpm are faster";
}

/// Says how long the run may take if that is more than an hour, judging from the time of the first projection.
template <int D>
void warn_of_long_run(const io::CaseInput& input, const Simulation<D>& sim, double seconds_of_projection)
{
    constexpr double projections = 2.0, hour = 3600.0;  // that a step takes: 0.7 to 4.2 were measured
    const double steps   = input.time.end / setup::time_step(sim.time(), sim.model(), sim.state().particles, *sim.state().ranks);
    const double seconds = projections * seconds_of_projection * steps;
    if (seconds < hour) return;
    io::say("ordo: note: this run may take about {:.2g} hours for {:.3g} steps; {}; more --threads, a coarser grid and a larger "
            "time.cfl "
            "help too\n",
            seconds / hour, steps, faster_than(sim.model().method));
}

/// The output files of a run: new ones, after projecting for the first row, or those that a restart continues.
template <int D>
io::Writer<D> files_of(const io::CaseInput& input, Simulation<D>& sim, io::RunDirectory& directory, Ranks& ranks,
                       const std::optional<io::Written>& restart, bool quiet)
{
    if (restart) {
        sim.watch()->resume(restart->watched, sim.state());
        return {input, sim.model(), directory, ranks, *restart};
    }
    const auto begin = std::chrono::steady_clock::now();
    sim.scheme().project(sim.state());
    if (!quiet) warn_of_long_run(input, sim, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    return {input, sim.model(), directory, ranks, io::probe_particles(input, sim.state())};
}

/// Runs a case from its start or a checkpoint to its end or a signal. Returns the exit code.
template <int D>
int run_case(const io::CaseInput& input, const RunOptions& options, Launch& launch)
{
    const io::Earlier earlier = options.restart     ? io::Earlier::go_on
                                : options.overwrite ? io::Earlier::overwrite
                                                    : io::Earlier::refuse;
    io::require_usable(input.output, earlier);
    setup::Built<D> built = build_and_start<D>(input, options, launch);
    Ranks& ranks          = launch.ranks();
    Simulation<D> sim     = simulation_of(input, std::move(built), ranks);
    std::optional<io::RunDirectory> directory;
    std::optional<io::Checkpoints<D>> checkpoints;
    std::optional<io::Written> restart;
    agree(ranks, [&] { directory.emplace(input.output, earlier, ranks.index() == 0); });
    agree(ranks, [&] { checkpoints.emplace(input, sim.model(), *directory); });
    if (options.restart) restart = checkpoints->read(*options.restart, sim);
    if (sim.is_complete()) {
        if (!options.quiet) io::say("nothing is left to do: the checkpoint is at t = {:.6g} s\n", sim.state().t);
        return 0;
    }
    io::Writer<D> writer             = files_of(input, sim, *directory, ranks, restart, options.quiet);
    sim.state().projection.is_wanted = true;

    io::ShowProgress<D> progress(options.quiet);
    Summary<D> summary(writer, options.quiet);
    JoinSignals<D> signals;
    const auto is_stopped = [&] { return signals.signal() != 0; };
    io::KeepCheckpoints<D> keep(*checkpoints, writer, is_stopped);
    for (Observer<D>* observer :
         {static_cast<Observer<D>*>(&signals), static_cast<Observer<D>*>(&writer), static_cast<Observer<D>*>(&progress),
          static_cast<Observer<D>*>(&summary), static_cast<Observer<D>*>(&keep)})
        sim.add(*observer);
    if (!options.quiet) announce(input, sim, ranks, restart.has_value());
    catch_signals(!ranks.is_alone());
    sim.run(is_stopped);
    if (!is_stopped()) return 0;
    io::say("ordo: stopped by signal {} at t = {:.6g} s; results so far are written\n", signals.signal(), sim.state().t);
    return 128 + signals.signal();
}

void print_body(const setup::BodyReport& b, int dim)
{
    fmt::print("# {}: {} particles, {:.6g} {}, {:.6g} {}", b.name, b.particles, b.mass,
               std::array{"kg/m^2", "kg/m", "kg"}[dim - 1], b.volume, std::array{"m", "m^2", "m^3"}[dim - 1]);
    if (const double more = b.true_volume ? b.volume / *b.true_volume - 1 : 0.0; std::fabs(more) > 1e-12)
        fmt::print(", {:+.2g} % of its shape", 100 * more);
    fmt::print("\n");
}

template <int D>
void print_stage(const Stage<D>& stage, const Simulation<D>& sim, const io::CaseInput& input)
{
    fmt::print("# stage \"{}\": t = {:.6g} to {:.6g} s", stage.name, stage.start, stage.end);
    if (stage.residual > 0) fmt::print(", to a residual of {:.3g}", stage.residual);
    if (stage.damping.type != DampingType::none)
        fmt::print(", {} damping", kDampingNames[static_cast<std::size_t>(stage.damping.type)]);
    for (const int b : stage.removed) fmt::print("; without \"{}\"", sim.bodies()[static_cast<std::size_t>(b)].name);
    for (const auto& change : stage.materials)
        fmt::print("; \"{}\" becomes {}", sim.bodies()[static_cast<std::size_t>(change.body)].name,
                   input.materials[static_cast<std::size_t>(change.material)].name);
    fmt::print("\n");
}

template <int D>
int check_case(const io::CaseInput& input)
{
    const Simulation<D> sim = simulation_of(input, io::build<D>(input));
    io::require_usable(input.output, io::Earlier::go_on);
    const Particles<D>& particles = sim.state().particles;
    const double unit             = courant_time_step(sim.model(), particles);
    const double dt               = setup::time_step(sim.time(), sim.model(), particles);
    double cells                  = 1;
    for (int a = 0; a < D; ++a) cells *= sim.model().cells[a];
    fmt::print("{}", io::echo_case(input));
    fmt::print("\n# {} particles, {} cells, dt = {:.4g} s at the start (Courant number {:.3g}), about {:.0f} steps\n",
               particles.count, cells, dt, dt / unit, std::ceil(input.time.end / dt - 1e-9));
    const auto frame = static_cast<double>(io::size_of_frame(sim.model(), sim.state(), io::style_of(input.output)));
    const double many =
        std::min(std::floor(input.time.end / *input.output.interval + 1e-9) + 2, std::ceil(input.time.end / dt - 1e-9) + 1);
    fmt::print("# a file of particles takes {:.3g} MB{}, about {:.0f} of them {:.3g} MB\n", frame / 1e6,
               input.output.compression == "none" ? "" : " before compression", many, many * frame / 1e6);
    for (const setup::BodyReport& b : sim.bodies()) print_body(b, D);
    for (const Stage<D>& stage : sim.stages()) print_stage(stage, sim, input);
    for (const std::string& note : sim.notes()) fmt::print("# note: {}\n", note);
    if (io::has_results(input.output.directory))
        fmt::print("# {} holds results: ordo run needs --overwrite, --restart or another --output\n", input.output.directory);
    warn_of_instability(sim.model().method);
    return 0;
}

}  // namespace

int run(const RunOptions& options)
{
    // The ranks end with the program: when one of them has, a launcher kills the others, and main has to say why first.
    static Launch launch;
    try {
        const io::CaseInput input = read(options);
        return with_dim(input.grid.dim, [&]<int D>() { return run_case<D>(input, options, launch); });
    } catch (const std::exception& e) {
        launch.fail(e);
        throw;
    }
}

int check(const RunOptions& options)
{
    const io::CaseInput input = read(options);
    return with_dim(input.grid.dim, [&]<int D>() { return check_case<D>(input); });
}

}  // namespace ordo::app
