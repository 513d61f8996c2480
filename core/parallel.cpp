#include "core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <mutex>
#include <optional>

namespace squint {
namespace {

/// Unless it is told so, oneTBB starts no more threads than there are processors, and says on stderr that it does not.
/// What was asked for once stays allowed.
void allow(int threads) {
    using Control = tbb::global_control;
    static std::mutex lock;
    static std::optional<Control> most;
    const std::lock_guard held(lock);
    if (static_cast<std::size_t>(threads) <= Control::active_value(Control::max_allowed_parallelism)) return;
    most.reset();  // of two the lower would count
    most.emplace(Control::max_allowed_parallelism, static_cast<std::size_t>(threads));
}

}  // namespace

int threads_for(int asked) {
    return asked > 0 ? asked : tbb::this_task_arena::max_concurrency();
}

void on_threads(int threads, const std::function<void()>& work) {
    const int count = threads_for(threads);
    allow(count);
    tbb::task_arena arena(count);
    arena.execute(work);
}

void isolated(const std::function<void()>& work) {
    tbb::this_task_arena::isolate(work);
}

void run_turns(std::int64_t count, void (*turn)(const void* loop, std::int64_t i), const void* loop) {
    using Range = tbb::blocked_range<std::int64_t>;
    const auto run = [=](const Range& range) {
        for (std::int64_t i = range.begin(); i != range.end(); ++i) turn(loop, i);
    };
    tbb::parallel_for(Range(0, count, 1), run, tbb::simple_partitioner());
}

}  // namespace squint
