#include "app/commands.hpp"
#include "base/parallel.hpp"
#include "io/build.hpp"
#include "io/message.hpp"
#include "io/progress.hpp"
#include "io/writer.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/explicit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>

namespace ordo::app {

namespace {

volatile std::sig_atomic_t g_signal = 0;

extern "C" void remember_signal(int signal) { g_signal = signal; }

/// Finishes the step on SIGINT, SIGTERM and SIGHUP; a second signal of the same kind kills.
void catch_signals()
{
    struct sigaction action {};
    action.sa_handler = remember_signal;
    action.sa_flags   = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    sigaction(SIGHUP, &action, nullptr);
}

io::CaseInput read(const RunOptions& options)
{
    io::CaseInput input = io::read_case(options.file, options.overrides);
    if (options.output) {
        input.output.directory       = *options.output;
        input.output.at["directory"] = {"--output", 0, 0};
    }
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

/// Some methods have no stable time step; they run well where particles stay near sub-cell centres or runs are short.
void warn_of_instability(const MethodSpec& method)
{
    if (const Instability* found = instability_of(method))
        io::say("ordo: warning: with this method short waves grow, at any time step, once particles have left sub-cell centres: "
                "{} (docs/verification.md, Dispersion)\n",
                found->why);
}

template <int D>
int run_case(const io::CaseInput& input, bool quiet)
{
    io::Built<D> built = io::build<D>(input);
    io::require_writable(input.output);
    const Explicit<D> method(std::move(built.model));
    State<D> s = method.start(std::move(built.particles));
    method.project(s);  // for the first row
    s.projection.is_wanted = true;
    io::Writer<D> writer(input, method.model(), s.particles);
    if (!quiet)
        io::say("{}: {}D, {} particles, {} on {} thread{}\n", input.title.empty() ? "ordo" : input.title, D, s.particles.count,
                input.method.preset, thread_count(), thread_count() > 1 ? "s" : "");

    if (!quiet) warn_of_instability(method.model().method);

    catch_signals();
    io::Progress progress(quiet, input.time.end);
    const double end      = input.time.end;
    const double interval = *input.output.interval;
    long row_step = -1, frame_step = -1;  // of the last row and the last frame
    auto row = [&] {
        if (row_step != s.n) writer.row(s, s.dt_prev);
        row_step = s.n;
    };
    auto frame = [&] {
        if (frame_step != s.n) writer.frame(s);
        frame_step = s.n;
    };
    auto finish = [&] {
        frame();
        writer.finish();
        progress.done(s.n, s.t);
        if (!quiet) io::say("wrote {} frames and history.csv to {}\n", writer.frame_count(), writer.directory().string());
    };
    row();
    frame();
    double next_frame = interval;
    while (s.t < end && !g_signal) {
        double dt       = input.time.dt ? *input.time.dt : automatic_time_step(method.model(), s.particles, *input.time.cfl);
        const bool last = end - s.t < dt * (1 + 1e-9);
        if (last) dt = end - s.t;
        try {
            method.step(s, dt);
        } catch (const NumericalError&) {
            if (std::isfinite(totals(method.model(), s.particles).total_energy())) row();  // else the sums mean nothing
            finish();
            throw;
        }
        if (last) s.t = end;
        if (s.n % input.output.history_interval == 0) row();
        if (s.t >= next_frame - 1e-9 * dt) {
            row();
            frame();
            next_frame = (std::floor(s.t / interval + 1e-9) + 1) * interval;
        }
        progress.show(s.n, s.t, dt);
    }
    row();
    finish();
    if (!g_signal) return 0;
    io::say("ordo: stopped by signal {} at t = {:.6g} s; what was computed is written\n", static_cast<int>(g_signal), s.t);
    return 128 + static_cast<int>(g_signal);
}

template <int D>
int check_case(const io::CaseInput& input)
{
    io::Built<D> built = io::build<D>(input);
    io::require_writable(input.output);
    const Explicit<D> method(std::move(built.model));
    const State<D> s  = method.start(std::move(built.particles));
    const double unit = courant_time_step(method.model(), s.particles);
    const double dt   = input.time.dt ? *input.time.dt : automatic_time_step(method.model(), s.particles, *input.time.cfl);
    fmt::print("{}", io::echo_case(input));
    fmt::print(
        "\n# {} particles, {} cells, dt = {:.4g} s at the start (Courant number {:.3g}), about {:.0f} steps\n",
        built.particles.count,
        [&] {
            double n = 1;
            for (int a = 0; a < D; ++a) n *= method.model().cells[a];
            return n;
        }(),
        dt, dt / unit, std::ceil(input.time.end / dt - 1e-9));
    warn_of_instability(method.model().method);
    return 0;
}

}  // namespace

int run(const RunOptions& options)
{
    const io::CaseInput input = read(options);
    return with_dim(input.grid.dim, [&]<int D>() { return run_case<D>(input, options.quiet); });
}

int check(const RunOptions& options)
{
    const io::CaseInput input = read(options);
    return with_dim(input.grid.dim, [&]<int D>() { return check_case<D>(input); });
}

}  // namespace ordo::app
