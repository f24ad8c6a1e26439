#include "io/progress.hpp"

#include "io/message.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace ordo::io {

namespace {

std::string duration(double seconds)
{
    const long s = std::lround(seconds);
    if (s < 60) return fmt::format("{} s", s);
    if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
    return fmt::format("{} h {} min", s / 3600, s / 60 % 60);
}

}  // namespace

Progress::Progress(bool quiet, double begin, double end)
    : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0), begin_(begin), end_(end)
{}

void Progress::show(long step, double t, double dt)
{
    if (quiet_) return;
    const auto now      = Clock::now();
    const double period = terminal_ ? 0.2 : 10.0;  // s; logs should stay short
    if (std::chrono::duration<double>(now - last_).count() < period) return;
    last_              = now;
    const double spent = std::chrono::duration<double>(now - started_).count();
    const double left  = t > begin_ ? spent * (end_ - t) / (t - begin_) : 0;
    say("{}step {}  t = {:.4g} of {:.4g} s  dt = {:.3g} s  {:3.0f} %  {} left{}", terminal_ ? "\r\033[K" : "", step, t, end_, dt,
        100 * t / end_, duration(left), terminal_ ? "" : "\n");
}

void Progress::done(long step, double t)
{
    if (quiet_) return;
    const double spent = std::chrono::duration<double>(Clock::now() - started_).count();
    say("{}{} steps to t = {:.6g} s in {:.2f} s\n", terminal_ ? "\r\033[K" : "", step, t, spent);
}

}  // namespace ordo::io
