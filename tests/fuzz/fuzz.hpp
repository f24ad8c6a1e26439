// What the targets share: inputs as files in memory, and what a reader may do with a bad one.
#pragma once

#include "base/error.hpp"
#include "io/build.hpp"
#include "method/courant.hpp"
#include "setup/schemes.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

namespace ordo::fuzz {

/// Ends the target with a message; libFuzzer keeps the input.
[[noreturn]] inline void fail(std::string_view what)
{
    fmt::print(stderr, "fuzz: {}\n", what);
    std::abort();
}

/// A file in memory that is written anew for each input; readers open it by its path.
class MemoryFile {
  public:
    explicit MemoryFile(std::string_view text = {}) : descriptor_(memfd_create("fuzz", 0)) { write(text); }
    MemoryFile(const MemoryFile&) = delete;

    std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }
    void write(std::string_view text)
    {
        if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, text.data(), text.size(), 0) != std::ssize(text))
            fail("no file in memory");
    }

  private:
    int descriptor_;
};

/// True where f() takes its input. An InputError refuses it, in one line; any other exception ends the target.
template <class F>
bool accepts(F&& f)
{
    try {
        f();
        return true;
    } catch (const InputError& e) {
        const std::string_view message = e.what();
        for (const char c : message)
            if (static_cast<unsigned char>(c) < 0x20) fail("the error is more than a line: " + std::string(message));
        if (message.find(": ") == message.npos) fail("the error does not say where: " + std::string(message));
        return false;
    }
}

/// Builds what was read and starts it, as `ordo check` does. At most so many particles: more would be slow, not wrong.
template <int D>
void start(const io::CaseInput& input, double most_particles = 1000)
{
    accepts([&] {
        io::Built<D> built                            = io::build<D>(input, most_particles);
        const std::unique_ptr<const Scheme<D>> scheme = make_scheme(std::move(built.model));
        const State<D> s                              = scheme->start(std::move(built.particles));
        const double dt = input.time.dt ? *input.time.dt : automatic_time_step(scheme->model(), s.particles, *input.time.cfl);
        if (!(dt > 0)) fail(fmt::format("the time step is {}", dt));
        for (int i = 0; i < s.particles.count; ++i)
            if (!(s.particles.V0[i] > 0)) fail(fmt::format("particle {} has the volume {}", i, s.particles.V0[i]));
    });
}

}  // namespace ordo::fuzz
