// Messages to the user. A closed or full stderr must not end a run.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <utility>

namespace ordo::io {

/// Whether this process leaves messages to another, which has the same ones.
inline bool& leaves_messages()
{
    static bool leaves = false;
    return leaves;
}

/// Prints to stderr; does nothing if stderr cannot be written.
template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) noexcept
{
    if (leaves_messages()) return;
    try {
        fmt::print(stderr, format, std::forward<Args>(args)...);
        std::fflush(stderr);
    } catch (const std::exception&) {
        std::clearerr(stderr);
    }
}

}  // namespace ordo::io
