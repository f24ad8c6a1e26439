#include "threads.hpp"

#include "base/parallel.hpp"

#include <atomic>
#include <exception>
#include <thread>

#include <pthread.h>

namespace ordo::python {

namespace {

std::atomic<bool> g_has_pool = false, g_lost_pool = false;

}  // namespace

int default_threads()
{
    static const int count = [] {
        pthread_atfork(nullptr, nullptr, [] { g_lost_pool = g_lost_pool || g_has_pool; });
        return thread_count();
    }();
    return count;
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
