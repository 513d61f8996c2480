#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace squint {
namespace {

TEST(Parallel, EveryTurnRunsOnceAndItsResultIsSeenAfterTheLoop) {
    for (const int count : {0, 1, 2, 1000}) {
        std::vector<int> turns(static_cast<std::size_t>(count), 0);
        on_threads(4, [&] { in_parallel(count, [&](int i) { ++turns[static_cast<std::size_t>(i)]; }); });
        EXPECT_EQ(turns, std::vector<int>(static_cast<std::size_t>(count), 1));
    }
}

TEST(Parallel, PiecesMeetAndTheLastIsShorter) {
    std::vector<int> end_of(10, 0);
    in_parallel_pieces(10, 4, [&](int first, int end) { end_of[static_cast<std::size_t>(first)] = end; });
    EXPECT_EQ(end_of, (std::vector<int>{4, 0, 0, 0, 8, 0, 0, 0, 10, 0}));
}

TEST(Parallel, PartsAreJoinedInTheirOrder) {
    const auto fold = [](std::string& part, int i) { part += static_cast<char>('a' + i); };
    const auto join = [](const std::string& a, const std::string& b) { return a + b; };
    EXPECT_EQ(reduce_in_parallel(26, 3, std::string(), fold, join), "abcdefghijklmnopqrstuvwxyz");
    EXPECT_EQ(reduce_in_parallel(0, 3, std::string("none"), fold, [](auto a, auto) { return a; }), "none");
}

TEST(Parallel, AnExceptionOfATurnReachesTheCaller) {
    const auto throw_at_7 = [](int i) {
        if (i == 7) throw std::runtime_error("seventh");
    };
    EXPECT_THROW(on_threads(2, [&] { in_parallel(100, throw_at_7); }), std::runtime_error);
}

// More than there are processors, too: each turn waits for the others.
TEST(Parallel, AsManyTurnsRunAtOnceAsThreadsAreAskedFor) {
    for (const int threads : {2, 5, 16, 3}) {
        std::atomic<int> there{0};
        testing::internal::CaptureStderr();
        const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
        on_threads(threads, [&] {
            in_parallel(threads, [&](int) {
                ++there;
                while (there < threads && std::chrono::steady_clock::now() < patience)
                    std::this_thread::yield();
            });
        });
        EXPECT_LT(std::chrono::steady_clock::now(), patience) << threads;
        EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << threads;
    }
}

TEST(Parallel, OneThreadIsTheCallers) {
    std::set<std::thread::id> threads;
    on_threads(1, [&] { in_parallel(1000, [&](int) { threads.insert(std::this_thread::get_id()); }); });
    EXPECT_EQ(threads, std::set<std::thread::id>{std::this_thread::get_id()});
}

TEST(Parallel, NoughtIsOneAProcessorOrAsManyAsThereAreAround) {
    EXPECT_EQ(threads_for(0), static_cast<int>(std::thread::hardware_concurrency()));
    EXPECT_EQ(threads_for(5), 5);
    on_threads(3, [] {
        EXPECT_EQ(threads_for(0), 3);
        on_threads(0, [] { EXPECT_EQ(threads_for(0), 3); });
        on_threads(2, [] { EXPECT_EQ(threads_for(0), 2); });
        EXPECT_EQ(threads_for(5), 5);
    });
}

#ifdef __SANITIZE_THREAD__
/// Two turns at once; turn 1 calls touch(1) after turn 0 has called touch(0), which nothing tells the sanitizer.
template <class F>
void touch_from_two_turns(const F& touch) {
    std::atomic<int> begun{0}, touched{0};
    const auto wait_for = [](const std::atomic<int>& count, int much) {
        while (count.load(std::memory_order_relaxed) < much) std::this_thread::yield();
    };
    on_threads(2, [&] {
        in_parallel(2, [&](int i) {
            begun.fetch_add(1, std::memory_order_relaxed);
            wait_for(begun, 2);
            wait_for(touched, i);
            touch(i);
            touched.fetch_add(1, std::memory_order_relaxed);
        });
    });
}

// That the sanitizer is silent elsewhere says something: it sees turns that write the same, and blames none that do not.
TEST(ParallelDeathTest, TheThreadSanitizerSeesTurnsThatWriteTheSame) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto race = [] {
        int shared = 0;
        touch_from_two_turns([&](int i) { shared = i; });
        std::exit(shared > 1);
    };
    EXPECT_EXIT(race(), testing::ExitedWithCode(66), "data race");
    const auto apart = [] {
        std::vector<int> each(2, 0);
        touch_from_two_turns([&](int i) { each[static_cast<std::size_t>(i)] = i; });
        std::exit(each[1] - 1);
    };
    EXPECT_EXIT(apart(), testing::ExitedWithCode(0), "");
}
#endif

}  // namespace
}  // namespace squint
