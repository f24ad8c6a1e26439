// What ranks find together: the first of several things, and errors that all of them must throw.
#pragma once

#include "base/error.hpp"
#include "base/ranks.hpp"

#include <cmath>
#include <exception>
#include <limits>
#include <string>

namespace ordo {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// What make() gives, bytes, on the rank with the lowest number, of several the first; nothing if numbers are infinite on all.
template <class Make>
Bytes bytes_of_first(Ranks& ranks, double number, const Make& make)
{
    const double least = -largest(ranks, -number);
    if (std::isinf(least)) return {};
    const int mine = number == least ? ranks.index() : ranks.count();
    const int from = -static_cast<int>(largest(ranks, -static_cast<double>(mine)));
    Bytes bytes;
    if (ranks.index() == from) bytes = make();
    ranks.share(bytes, from);
    return bytes;
}

/// The same for a text.
template <class Make>
std::string text_of_first(Ranks& ranks, double number, const Make& make)
{
    const Bytes bytes = bytes_of_first(ranks, number, [&] {
        const std::string text = make();
        return Bytes(text.begin(), text.end());
    });
    return {bytes.begin(), bytes.end()};
}

/// Calls of one rank in the midst of what all ranks do. After the first error, which is kept for `agree`, there are no more.
class KeptFailure {
  public:
    template <class F>
    void run(const F& f)
    {
        if (failure_) return;
        try {
            f();
        } catch (...) {
            failure_ = std::current_exception();
        }
    }
    void rethrow() const
    {
        if (failure_) std::rethrow_exception(failure_);
    }

  private:
    std::exception_ptr failure_;
};

/// Calls f() on all ranks. If it throws one of ordo's errors on some, all of them throw that of the first.
template <class F>
void agree(Ranks& ranks, const F& f)
{
    if (ranks.is_alone()) return f();
    enum Kind : char { input, numerical, output };
    std::string error;  // its kind, then its text
    auto keep = [&](Kind kind, const std::exception& e) { error = std::string(1, kind) + e.what(); };
    try {
        f();
    } catch (const InputError& e) {
        keep(input, e);
    } catch (const NumericalError& e) {
        keep(numerical, e);
    } catch (const OutputError& e) {
        keep(output, e);
    }
    const std::string first = text_of_first(ranks, error.empty() ? kNowhere : ranks.index(), [&] { return error; });
    if (first.empty()) return;
    const std::string text = first.substr(1);
    switch (static_cast<Kind>(first[0])) {
    case input: throw InputError(text);
    case numerical: throw NumericalError(text);
    case output: throw OutputError(text);
    }
}

/// The same with f() called on rank 0 only: for files, which it writes.
template <class F>
void on_first(Ranks& ranks, const F& f)
{
    agree(ranks, [&] {
        if (ranks.index() == 0) f();
    });
}

}  // namespace ordo
