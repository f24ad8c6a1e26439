// Threads of calls from Python: their number, and forks.
#pragma once

#include <functional>
#include <optional>

namespace ordo::python {

/// The number of threads of a call: all cores unless it says it. Throws InputError.
int threads_of(std::optional<int> wanted);

/// f() on `count` threads. A process that was forked has no threads of the pool that OpenMP made before and would wait for them for ever:
/// there a new thread calls f, which gets a pool of its own. What f throws is thrown here.
void with_threads(int count, const std::function<void()>& f);

}  // namespace ordo::python
