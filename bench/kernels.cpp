// Every kernel of the fast path alone, with data in the first-level cache: time per 16 samples.  Each is
// first checked against the model's own lines.
//
//     bench_kernels --benchmark_filter='AVX2/default, cells/'
//
// Names are kernel/TARGET/case/kernel.  The time is that of one call, on a batch of 8 steps of 16 rays or on
// as many lit samples as were drawn; `per_16` is that of 16 samples.
#include "core/error.h"
#include "tests/pipeline/machines/kernel_checker.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdio>

namespace {

using namespace squint;
using namespace squint::lanes;

void time_kernel(benchmark::State& state, const KernelCheck& check) {
    check.draw();
    check.run();
    if (const std::string difference = check.difference(); !difference.empty())
        return state.SkipWithError(difference.c_str());
    for (auto step : state) {
        (void)step;
        check.run();
        benchmark::ClobberMemory();
    }
    state.counters["per_16"] =
        benchmark::Counter(static_cast<double>(check.samples()) / 16,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

}  // namespace

int main(int argc, char** argv) try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    static const std::vector<KernelCase> cases = kernel_cases();
    static std::vector<std::unique_ptr<KernelChecker>> checkers;
    for (const std::string& target : target_names())
        for (const KernelCase& c : cases) {
            checkers.push_back(std::make_unique<KernelChecker>(c, find_target(target), 1));
            for (const KernelCheck& check : checkers.back()->checks())
                benchmark::RegisterBenchmark(
                    fmt::format("kernel/{}/{}/{}", target, c.name, check.kernel).c_str(),
                    [check](benchmark::State& state) { time_kernel(state, check); });
        }
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
} catch (const squint::InputError& error) {
    std::fputs(fmt::format("{}\n", error.what()).c_str(), stderr);
    return 2;
}
