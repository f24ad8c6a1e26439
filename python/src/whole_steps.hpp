// Ctrl-C between steps.
#pragma once

#include <pybind11/pybind11.h>

#include <csignal>

namespace ordo::python {

/// While it lives, Ctrl-C waits for the end of a step, so that it does not break a callback within. A second Ctrl-C does what Python does.
/// Only in Python's main thread, and where Python's own handler is set: a user's handler stays.
class WholeSteps {
  public:
    WholeSteps()
    {
        const pybind11::module_ signals = pybind11::module_::import("signal"), threading = pybind11::module_::import("threading");
        const bool is_main = threading.attr("current_thread")().is(threading.attr("main_thread")());
        if (!is_main || !signals.attr("getsignal")(SIGINT).is(signals.attr("default_int_handler"))) return;
        interrupted() = 0;
        struct sigaction action {};
        action.sa_handler = remember;
        is_set_           = sigaction(SIGINT, &action, &before()) == 0;
    }
    ~WholeSteps()
    {
        if (!is_set_) return;
        sigaction(SIGINT, &before(), nullptr);
        interrupted() = 0;
    }
    WholeSteps(const WholeSteps&)            = delete;
    WholeSteps& operator=(const WholeSteps&) = delete;

    static bool is_interrupted() { return interrupted() != 0; }

  private:
    static volatile std::sig_atomic_t& interrupted()
    {
        static volatile std::sig_atomic_t flag = 0;
        return flag;
    }
    static struct sigaction& before()
    {
        static struct sigaction action {};
        return action;
    }
    static void remember(int signal)
    {
        if (interrupted() && before().sa_handler) return before().sa_handler(signal);
        interrupted() = 1;
    }

    bool is_set_ = false;
};

}  // namespace ordo::python
