#include "app/commands.hpp"
#include "base/parallel.hpp"
#include "io/build.hpp"
#include "io/checkpoint.hpp"
#include "io/hdf5.hpp"
#include "io/message.hpp"
#include "io/progress.hpp"
#include "io/writer.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/explicit.hpp"
#include "method/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <optional>

namespace ordo::app {

namespace {

volatile std::sig_atomic_t g_signal = 0;

extern "C" void remember_signal(int signal) { g_signal = signal; }

/// Finishes the step on SIGINT, SIGTERM and SIGHUP, but for one that nohup has switched off; a second signal of the same kind
/// kills.
void catch_signals()
{
    struct sigaction action {};
    action.sa_handler = remember_signal;
    action.sa_flags   = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
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

/// A case from its start, or from a checkpoint, to its end or to a signal.
template <int D>
class Run {
  public:
    Run(const io::CaseInput& input, const RunOptions& options) : Run(input, options, io::build<D>(input)) {}

    /// Returns the exit code.
    int go()
    {
        if (is_complete()) {
            if (!quiet_) io::say("nothing is left to do: the checkpoint is at t = {:.6g} s\n", s_.t);
            return 0;
        }
        if (restart_) {
            watch_.resume(restart_->watched);
            writer_.emplace(input_, method_.model(), *restart_);
        } else {
            watch_.start(s_);
            method_.project(s_);  // for the first row
            writer_.emplace(input_, method_.model(), s_.particles);
        }
        s_.projection.is_wanted = true;
        announce();
        catch_signals();
        if (!restart_) {
            writer_->row(s_);
            writer_->frame(s_);
        }
        progress_.emplace(quiet_, s_.t, input_.time.end);
        while (!is_complete() && !g_signal) step();
        finish(!is_cut_ && io::has_hdf5() && (g_signal || checkpoints_.are_wanted()));
        if (!g_signal) return 0;
        io::say("ordo: stopped by signal {} at t = {:.6g} s; what was computed is written\n", static_cast<int>(g_signal), s_.t);
        return 128 + static_cast<int>(g_signal);
    }

  private:
    Run(const io::CaseInput& input, const RunOptions& options, io::Built<D> built)
        : input_(input),
          quiet_(options.quiet),
          method_(std::move(built.model)),
          s_(method_.start(std::move(built.particles))),
          checkpoints_(input, method_.model()),
          watch_(method_.model(), input.watch_spec, [](const std::string& found) { io::say("ordo: warning: {}\n", found); })
    {
        io::require_writable(input.output);
        if (options.restart) restart_ = checkpoints_.read(*options.restart, s_);
    }

    void announce() const
    {
        if (quiet_) return;
        io::say("{}: {}D, {} particles, {} on {} thread{}\n", input_.title.empty() ? "ordo" : input_.title, D, s_.particles.count,
                input_.method.preset, thread_count(), thread_count() > 1 ? "s" : "");
        if (restart_) io::say("goes on from step {}, t = {:.6g} s\n", s_.n, s_.t);
        warn_of_instability(method_.model().method);
    }

    // Steps add up to the end but for rounding; what is left then is no step.
    static constexpr double kRounding = 1e-6;  ///< of a step
    bool is_complete() const { return input_.time.end - s_.t <= kRounding * s_.dt_prev; }

    void step()
    {
        double dt = input_.time.dt ? *input_.time.dt : automatic_time_step(method_.model(), s_.particles, *input_.time.cfl);
        const double left = input_.time.end - s_.t;
        is_cut_           = left < dt * (1 - kRounding);
        if (is_cut_) {  // a run with a later end would not make this step: it goes on from the state before it
            dt = left;
            if (checkpoints_.are_wanted()) checkpoints_.write(s_, written());
        }
        try {
            if (input_.time.dt) watch_.before_step(s_, dt);
            method_.step(s_, dt);
            watch_.after_step(s_);
        } catch (const NumericalError&) {
            const bool means_something = std::isfinite(totals(method_.model(), s_.particles).total_energy());
            if (means_something && has_stepped()) writer_->row(s_);
            write_last_frame();
            throw;
        }
        if (is_cut_) {
            s_.t      = input_.time.end;
            s_.t_rest = 0;
        }
        writer_->write_if_due(s_, dt);
        if (!is_cut_ && !is_complete() && checkpoints_.is_due(s_)) checkpoints_.write(s_, written());
        progress_->show(s_.n, s_.t, dt);
    }

    /// The last row and frame, which a run that goes on from here does not have. Once there is a checkpoint at the end nothing is
    /// left to do, so that it comes last; before the end it is what matters most.
    void finish(bool has_checkpoint)
    {
        const io::Written before = written();
        if (has_checkpoint && !is_complete()) checkpoints_.write(s_, before);
        if (has_stepped()) writer_->row(s_);
        write_last_frame();
        if (has_checkpoint) checkpoints_.write(s_, before);
    }

    /// Else a restart has no nodes and no projection to write of.
    bool has_stepped() const { return !restart_ || s_.n > restart_->step; }

    io::Written written()
    {
        io::Written w = writer_->written();
        w.step        = s_.n;
        w.watched.assign(watch_.energies().begin(), watch_.energies().end());
        return w;
    }

    void write_last_frame()
    {
        if (has_stepped()) writer_->frame(s_);
        writer_->finish();
        progress_->done(s_.n, s_.t);
        for (int k = 0; k < WatchSpec::count; ++k)
            if (const long n = watch_.found()[k]; n > 1) io::say("ordo: warning: {} in {} steps\n", WatchSpec::names[k], n);
        if (!quiet_) io::say("wrote {} frames and history.csv to {}\n", writer_->frame_count(), writer_->directory().string());
    }

    const io::CaseInput& input_;
    bool quiet_;
    Explicit<D> method_;
    State<D> s_;
    io::Checkpoints<D> checkpoints_;
    Watch<D> watch_;
    std::optional<io::Written> restart_;
    std::optional<io::Writer<D>> writer_;
    std::optional<io::Progress> progress_;
    bool is_cut_ = false;  ///< the last step
};

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
    return with_dim(input.grid.dim, [&]<int D>() { return Run<D>(input, options).go(); });
}

int check(const RunOptions& options)
{
    const io::CaseInput input = read(options);
    return with_dim(input.grid.dim, [&]<int D>() { return check_case<D>(input); });
}

}  // namespace ordo::app
