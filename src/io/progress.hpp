// The progress line on stderr: rewritten in place on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>

namespace ordo::io {

class Progress {
  public:
    Progress(bool quiet, double begin, double end);  // s

    /// Shows step, time, dt and the time left; at most a few times a second.
    void show(long step, double t, double dt);
    /// Ends the line.
    void done(long step, double t);

  private:
    using Clock = std::chrono::steady_clock;
    bool quiet_, terminal_;
    double begin_, end_;
    Clock::time_point started_ = Clock::now(), last_ = started_;
};

}  // namespace ordo::io
