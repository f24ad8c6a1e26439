#include "threads.hpp"

#include "base/error.hpp"
#include "base/parallel.hpp"

#include <atomic>
#include <exception>
#include <string>
#include <thread>

#include <pthread.h>

namespace ordo::python {

namespace {

std::atomic<bool> g_has_pool = false, g_lost_pool = false;

}  // namespace

int threads_of(std::optional<int> wanted)
{
    static const int all = [] {
        pthread_atfork(nullptr, nullptr, [] { g_lost_pool = g_lost_pool || g_has_pool; });
        return thread_count();
    }();
    if (wanted && !(*wanted >= 1 && *wanted <= 1024))
        throw InputError("threads: must be 1 to 1024 (got " + std::to_string(*wanted) + ")");
    return wanted.value_or(all);
}

void with_threads(int count, const std::function<void()>& f)
{
    auto call = [&] {
        const int before = thread_count();
        set_thread_count(count);
        try {
            f();
        } catch (...) {
            set_thread_count(before);
            throw;
        }
        set_thread_count(before);
    };
    if (!g_lost_pool) {
        g_has_pool = g_has_pool || count > 1;
        return call();
    }
    std::exception_ptr failure;
    std::thread([&] {
        try {
            call();
        } catch (...) {
            failure = std::current_exception();
        }
    }).join();
    if (failure) std::rethrow_exception(failure);
}

}  // namespace ordo::python
