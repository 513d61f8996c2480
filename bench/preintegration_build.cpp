// Times to build the pre-integrated tables.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

#include "pipeline/classification/methods.h"
#include "pipeline/classification/tables/pi2d_table.h"
#include "pipeline/classification/tables/prefix_tables.h"
#include "pipeline/stages/presets.h"

namespace {

using namespace squint;

/// Four overlapping tents of opacity up to 0.9 per unit, as a user might draw.
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

/// From control points to a method's quantised words in the preset `default`: the cost of a change of the
/// transfer function.  Range 0: entries; range 1: the method; range 2: its order.
void BuildWords(benchmark::State& state) {
    const int size = static_cast<int>(state.range(0));
    const auto method = static_cast<Method>(state.range(1));
    TransferFunction function;
    for (int i = 0; i <= 8; ++i) {
        const double value = static_cast<double>(i) / 8 * (size - 1);
        function.color.push_back({value, {i / 8.0, 1 - i / 8.0, 0.5}});
        function.opacity.push_back({value, i % 2 ? 0.6 : 0.05});
    }
    function.entries = size;
    Volume volume;
    volume.scalar_bits = size > 256 ? 12 : 8;
    volume.largest = (1 << volume.scalar_bits) - 1;
    WireSpecs specs;
    preset_specs("default", {.scalar_bits = volume.scalar_bits, .entry_bits = volume.scalar_bits}, specs);
    ClassificationSettings settings;
    settings.method = method, settings.order = static_cast<int>(state.range(2)), settings.table_size = size;
    const int fraction = specs[Wire::classification_input].format.fraction_bits;
    for (auto _ : state) {
        const Entries entries = sample_entries(function, volume);
        const ClassificationMethod built = build_method({entries, specs, settings, 1, fraction, false});
        benchmark::DoNotOptimize(&built);
    }
    state.SetLabel(fmt::format("{} {}", name_of(method), settings.order_or_least()));
}
void every_method_and_size(benchmark::internal::Benchmark* b) {
    for (const int size : {256, 4096}) {
        for (const Method method : {Method::pc, Method::pi1d}) b->Args({size, static_cast<int>(method), 1});
        for (const int order : {1, 3}) b->Args({size, static_cast<int>(Method::pips), order});
        b->Args({size, static_cast<int>(Method::leg), 2});
    }
}
BENCHMARK(BuildWords)->Apply(every_method_and_size)->Unit(benchmark::kMicrosecond);

/// From entries to 16-bit words in a buffer that is reused.
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

// The program keeps memory that it used, so that building is timed, not the system's pages.
int main(int argc, char** argv) {
    mallopt(M_TRIM_THRESHOLD, 256 << 20), mallopt(M_MMAP_THRESHOLD, 256 << 20);
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
}
