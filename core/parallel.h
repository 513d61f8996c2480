// Work on many threads: the only place that knows of oneTBB's loops.
#pragma once

#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstdint>
#include <functional>
#include <vector>

namespace squint {

/// `asked`, or where that is 0 as many threads as loops take here: on_threads()'s, else one a processor.
int threads_for(int asked);

/// Runs `work`, whose parallel loops together take threads_for(threads) threads, one of them the caller's.
void on_threads(int threads, const std::function<void()>& work);

/// Runs `work`, which holds a lock: a thread that waits in its loops takes up turns of these loops alone, as
/// others may need the lock.
void isolated(const std::function<void()>& work);

/// Calls turn(loop, 0) ... turn(loop, count - 1): in_parallel() without types.
void run_turns(std::int64_t count, void (*turn)(const void* loop, std::int64_t i), const void* loop);

/// Calls turn(0) ... turn(count - 1), each on any thread, and returns when all have ended.  An exception ends
/// the loop, with some turns left out, and is rethrown here.  A turn should take a microsecond or more.
template <std::integral Index, class F>
void in_parallel(Index count, const F& turn) {
    // What is before the loop happens before every turn, and every turn before what is after it.  oneTBB sees to
    // that; these two say it to the thread sanitizer, which does not see into oneTBB.
    struct Order {
        std::atomic<char> begun{0}, ended{0};
        Order() { begun.store(1, std::memory_order_release); }
        ~Order() { ended.load(std::memory_order_acquire); }
    };
    struct Turn {
        std::atomic<char>& ended;
        ~Turn() { ended.fetch_add(1, std::memory_order_release); }
    };
    struct Loop {
        const F& turn;
        mutable Order order;
    };
    const Loop loop{turn, {}};
    run_turns(
        static_cast<std::int64_t>(count),
        [](const void* of, std::int64_t i) {
            const Loop& my = *static_cast<const Loop*>(of);
            my.order.begun.load(std::memory_order_acquire);
            const Turn ends{my.order.ended};
            my.turn(static_cast<Index>(i));
        },
        &loop);
}

/// The same over pieces of `size` turns: turns(first, end).
template <std::integral Index, class F>
void in_parallel_pieces(Index count, Index size, const F& turns) {
    in_parallel((count + size - 1) / size, [&](Index piece) {
        const Index first = piece * size;
        turns(first, std::min<Index>(first + size, count));
    });
}

/// Pieces folded from `none` by fold(part, i), then joined in their order by join(a, b).
template <std::integral Index, class Part, class Fold, class Join>
Part reduce_in_parallel(Index count, Index size, const Part& none, const Fold& fold, const Join& join) {
    std::vector<Part> parts(static_cast<std::size_t>((count + size - 1) / size), none);
    in_parallel_pieces(count, size, [&](Index first, Index end) {
        Part part = none;
        for (Index i = first; i < end; ++i) fold(part, i);
        parts[static_cast<std::size_t>(first / size)] = part;
    });
    Part all = none;
    for (const Part& part : parts) all = join(all, part);
    return all;
}

}  // namespace squint
