// How time and memory grow with the picture, the volume, the step and the threads: the procedural phantom,
// PC, unlit.
//
//     bench_growth --benchmark_out=growth.json        (SQUINT_BENCH_LARGE=1 adds 1024^3: 2 GiB of voxels)
//
// The time is that of the ray cast alone, in frames after the first.  Counters: `ns_per_sample` over all
// samples of all rays; `ns_per_visited` over those that were not skipped as empty; `peak_mib` of resident
// memory while plan and first picture were made (with the volume); `setup_ms` of what is built once for a
// volume; `load`. bench/growth.py prints tables and slopes, and draws them.
#include "bench/support/support.h"
#include "core/error.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

using namespace squint;
using namespace squint::bench;

struct Point {
    std::string axis;  // what grows
    double at = 0;     // how far
    std::int64_t volume = 256;
    int image = 800;
    double step = 1;
    int threads = 1;
    bool skip = true;
};

void time_point(benchmark::State& state, const Point& point) {
    const Scene scene = phantom_scene(
        point.volume, false,
        {fmt::format("image.width={}", point.image), fmt::format("image.height={}", point.image),
         fmt::format("sampling.step={}", point.step)});
    const auto volume = volume_of(scene);
    RenderOptions options;
    options.threads = point.threads, options.skip = point.skip;
    reset_peak_memory();
    const Plan plan = make_plan(scene, volume);
    Rendering last = render(plan, options);
    const double setup_ms = 1000 * last.statistics.setup_seconds;
    const double peak_mib = static_cast<double>(peak_memory()) / (1 << 20);
    double seconds = 0, samples = 0, visited = 0;
    for (auto step : state) {
        (void)step;
        render(plan, options, last);
        state.SetIterationTime(last.statistics.seconds);
        seconds += last.statistics.seconds, samples += static_cast<double>(last.statistics.samples);
        visited += static_cast<double>(last.statistics.visited);
    }
    state.counters["at"] = point.at;
    state.counters["ns_per_sample"] = 1e9 * seconds / samples;
    state.counters["ns_per_visited"] = 1e9 * seconds / visited;
    state.SetLabel(last.statistics.layout.substr(0, last.statistics.layout.find(':')));
    state.counters["setup_ms"] = setup_ms;
    state.counters["peak_mib"] = peak_mib;
    state.counters["load"] = load();
}

std::vector<Point> points() {
    std::vector<Point> all;
    for (const int size : {100, 200, 400, 800, 1600})
        all.push_back({.axis = "image", .at = static_cast<double>(size), .image = size});
    for (const double step : {2.0, 1.0, 0.5, 0.25, 0.125})
        all.push_back({.axis = "step", .at = step, .step = step});
    for (int threads = 1; threads <= static_cast<int>(std::thread::hardware_concurrency()); threads *= 2)
        all.push_back({.axis = "threads", .at = static_cast<double>(threads), .threads = threads});
    std::vector<std::int64_t> sizes{64, 128, 256, 512};
    if (std::getenv("SQUINT_BENCH_LARGE")) sizes.push_back(1024);
    for (const std::int64_t size : sizes)
        for (const bool skip : {true, false})
            all.push_back({.axis = skip ? "volume" : "volume_no_skipping",
                           .at = static_cast<double>(size),
                           .volume = size,
                           .skip = skip});
    return all;
}

}  // namespace

int main(int argc, char** argv) try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    for (const Point& point : points())
        benchmark::RegisterBenchmark(fmt::format("growth/{}/{}", point.axis, point.at).c_str(),
                                     [=](benchmark::State& s) { time_point(s, point); })
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond)
            ->MeasureProcessCPUTime();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
} catch (const InputError& error) {
    std::fputs(fmt::format("{}\n", error.what()).c_str(), stderr);
    return 2;
}
