// Runs pieces of work in parallel, each on one thread.
#pragma once

#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace squint::sweep {

/// Calls f(0) ... f(count - 1), each on one of `threads` threads.  The first exception stops the rest and is
/// rethrown here.
template <class F>
void side_by_side(std::size_t count, int threads, F&& f) {
    std::atomic<std::size_t> next{0};
    std::atomic<bool> stop{false};
    std::exception_ptr first;
    std::mutex mutex;
    const auto work = [&] {
        on_threads(1, [&] {  // parallel loops inside a piece stay on its thread
            for (std::size_t i; !stop && (i = next++) < count;) try {
                    f(i);
                } catch (...) {
                    const std::lock_guard lock(mutex);
                    if (!first) first = std::current_exception();
                    stop = true;
                }
        });
    };
    std::vector<std::thread> pool;
    for (int t = 1; t < std::min<int>(threads, static_cast<int>(std::max<std::size_t>(count, 1))); ++t)
        pool.emplace_back(work);
    work();
    for (std::thread& thread : pool) thread.join();
    if (first) std::rethrow_exception(first);
}

}  // namespace squint::sweep
