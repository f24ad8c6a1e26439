// Wall time per stage of the step, for `ordo bench`.
#pragma once

#include <array>
#include <chrono>
#include <string_view>

namespace ordo {

/// Wall time per stage of the step, s, and the number of solves with the consistent mass matrix and of their iterations.
struct StageTimes {
    enum Stage { sort, body_force, scatter, fit, nodes, gather, count };
    static constexpr std::array<std::string_view, count> names{"sort", "body_force", "scatter", "fit", "nodes", "gather"};
    std::array<double, count> seconds{};
    long mass_solves = 0, mass_iterations = 0;
};

/// Adds the time from construction to destruction to a stage; does nothing if `times` is null.
class Stopwatch {
  public:
    Stopwatch(StageTimes* times, StageTimes::Stage stage) : times_(times), stage_(stage)
    {
        if (times_) begin_ = Clock::now();
    }
    ~Stopwatch()
    {
        if (times_) times_->seconds[stage_] += std::chrono::duration<double>(Clock::now() - begin_).count();
    }
    Stopwatch(const Stopwatch&) = delete;

  private:
    using Clock = std::chrono::steady_clock;
    StageTimes* times_;
    StageTimes::Stage stage_;
    Clock::time_point begin_{};
};

}  // namespace ordo
