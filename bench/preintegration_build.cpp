// Build times of the pre-integrated tables.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "pipeline/preintegration/pi2d.h"
#include "pipeline/preintegration/prefix_tables.h"

namespace {

using namespace squint;

/// Four overlapping tents of opacity up to 0.9 per unit, as a user would draw.
Entries drawn(int size) {
    Entries entries;
    for (int i = 0; i < size; ++i) {
        const double s = static_cast<double>(i) / (size - 1);
        double alpha = 0;
        for (int k = 0; k < 4; ++k) alpha = std::max(alpha, 0.9 - 8 * std::abs(s - 0.2 - 0.2 * k));
        entries.entry.push_back({{s, 1 - s, 0.5}, alpha, -std::log(1 - std::max(alpha, 0.0)), false});
    }
    return entries;
}

void BuildPrefixTables(benchmark::State& state) {
    const Entries entries = drawn(static_cast<int>(state.range(0)));
    for (auto _ : state) {
        auto tables = preintegration::build_prefix_tables(entries, static_cast<int>(state.range(1)));
        benchmark::DoNotOptimize(tables.depth.data());
    }
}
BENCHMARK(BuildPrefixTables)->Args({256, 1})->Args({4096, 1})->Args({4096, 2})->Unit(benchmark::kMicrosecond);

/// From entries to 16-bit words in a buffer that is used again.
void BuildPi2d(benchmark::State& state) {
    const int size = static_cast<int>(state.range(0));
    const Entries entries = drawn(size);
    std::vector<std::uint16_t> words(static_cast<std::size_t>(size) * size * 4);
    for (auto _ : state) {
        preintegration::build_pi2d_words<std::uint16_t>(entries, size, 1, words,
                                                        preintegration::EncodeU16{15});
        benchmark::DoNotOptimize(words.data());
    }
}
BENCHMARK(BuildPi2d)->Arg(256)->Arg(1024)->Arg(4096)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
