// Ctrl-C between steps.
#pragma once

#include <pybind11/pybind11.h>

#include <csignal>

namespace ordo::python {

/// While it lives, Ctrl-C waits for the end of a step, so that it does not break a callback within. A second Ctrl-C does what Python does.
/// Only in Python's main thread, for the outermost of several, and where Python's own handler is set: a user's handler stays.
class WholeSteps {
  public:
    WholeSteps()
    {
        const pybind11::module_ signals = pybind11::module_::import("signal"), threading = pybind11::module_::import("threading");
        const bool is_main = threading.attr("current_thread")().is(threading.attr("main_thread")());
        if (!is_main || is_set() || !signals.attr("getsignal")(SIGINT).is(signals.attr("default_int_handler"))) return;
        interrupted() = 0;
        struct sigaction action {};
        action.sa_handler = remember;
        is_mine_ = is_set() = sigaction(SIGINT, &action, &before()) == 0;
    }
    /// A Ctrl-C that nobody has taken goes to Python.
    ~WholeSteps()
    {
        if (!is_mine_) return;
        sigaction(SIGINT, &before(), nullptr);
        is_set() = false;
        if (take()) PyErr_SetInterrupt();
    }
    WholeSteps(const WholeSteps&)            = delete;
    WholeSteps& operator=(const WholeSteps&) = delete;

    bool is_interrupted() const { return is_mine_ && interrupted(); }
    /// Whether Ctrl-C was pressed; the caller sees to it.
    bool take()
    {
        const bool is = is_mine_ && interrupted();
        if (is) interrupted() = 0;
        return is;
    }

  private:
    static volatile std::sig_atomic_t& interrupted()
    {
        static volatile std::sig_atomic_t flag = 0;
        return flag;
    }
    static bool& is_set()
    {
        static bool is = false;
        return is;
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

    bool is_mine_ = false;
};

}  // namespace ordo::python
