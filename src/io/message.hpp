// Messages to the user. A closed or full stderr must not end a run.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <utility>

namespace ordo::io {

/// Prints to stderr; does nothing if stderr cannot be written.
template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) noexcept
{
    try {
        fmt::print(stderr, format, std::forward<Args>(args)...);
        std::fflush(stderr);
    } catch (const std::exception&) {
        std::clearerr(stderr);
    }
}

}  // namespace ordo::io
