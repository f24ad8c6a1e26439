// Threads of calls from Python: their number, and forks.
#pragma once

#include <functional>

namespace ordo::python {

/// The number of threads of simulations that do not say theirs.
int default_threads();

/// f() on `count` threads. A process that was forked has no threads of the pool that OpenMP made before and would wait for them for ever:
/// there a new thread calls f, which gets a pool of its own. What f throws is thrown here.
void with_threads(int count, const std::function<void()>& f);

}  // namespace ordo::python
