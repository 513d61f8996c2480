// Whole frames of 800x800: time beside error, for every way to render them.
//
//     bench_frame --benchmark_filter='phantom_256/unlit' --benchmark_repetitions=5 --benchmark_out=frame.json
//
// The time is that of the ray cast alone.  Counters: `whole_ms` with plan and tables; `ns_per_sample` over
// all samples of all rays (in empty space, too: compare with skipping off); `psnr` of the foreground against
// the same picture in double, in dB (200: equal); and the machine's `load`.  Before timing, lanes and model
// must give the same bits.  `/float32` and `/default` are the same frame in float32 and in fixed-point
// words.
#include "bench/support/support.h"
#include "core/error.h"
#include "pipeline/record.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <optional>

namespace {

using namespace squint;
using namespace squint::bench;

struct Method {
    std::string name;
    std::vector<std::string> overrides;
};

const std::vector<Method>& methods() {
    static const std::vector<Method> all{
        {"pc", {}},
        {"pi2d_256", {"classification.method=pi2d"}},
        {"pi2d_4096", {"classification.method=pi2d", "classification.table_size=4096"}},
        {"pi1d", {"classification.method=pi1d"}},
        {"pips", {"classification.method=pips"}},
    };
    return all;
}

enum class Picture { same, new_transfer_function };

/// What is timed: a scene, a method and a way to draw it.
struct Frame {
    std::string scene;  // a file of configs/bench, or the size of a phantom
    bool lit = false;
    double step = 1;
    Method method = methods()[0];
    std::string way = "default";
    RenderOptions options{};
    Picture picture = Picture::same;
    int size = 800;
    std::string preset = "default";

    std::string name() const {
        return fmt::format("frame/{}/{}/step_{}/{}/{}/threads_{}",
                           std::isdigit(scene[0]) ? "phantom_" + scene : scene, lit ? "lit" : "unlit", step,
                           method.name, way, options.threads);
    }
    Scene read() const {
        std::vector<std::string> overrides = method.overrides;
        overrides.push_back(fmt::format("sampling.step={}", step));
        overrides.push_back(fmt::format("image.width={}", size));
        overrides.push_back(fmt::format("image.height={}", size));
        overrides.push_back("precision.preset=" + preset);
        return std::isdigit(scene[0]) ? phantom_scene(std::stoll(scene), lit, overrides)
                                      : data_scene(scene, lit, overrides);
    }
};

RenderOptions with(int threads, const std::string& target = "", bool skip = true) {
    RenderOptions options;
    options.threads = threads, options.target = target, options.skip = skip;
    return options;
}

/// The SIMD targets of this build that this machine has.
const std::vector<std::string>& targets() {
    static const std::vector<std::string> found = [] {
        const Scene scene = phantom_scene(16, false, {"image.width=4", "image.height=4"});
        const Plan plan = make_plan(scene, volume_of(scene));
        std::vector<std::string> there;
        for (const char* target : {"AVX3", "AVX2", "SSE4", "NEON", "EMU128", "SCALAR"}) try {
                render(plan, with(1, target));
                there.push_back(target);
            } catch (const InputError&) {  // not there
            }
        return there;
    }();
    return found;
}

double psnr_of(const Frame& frame, const Plan& plan, const Image& picture) {
    static std::map<std::string, double> known;  // bits do not depend on the way to draw
    const std::string key = fmt::format("{} {} {} {} {} {}", frame.scene, frame.lit, frame.step,
                                        frame.method.name, frame.size, frame.preset);
    constexpr int kEvery = 8;
    const auto found = known.find(key);
    if (found != known.end()) return found->second;
    return known[key] = psnr(thinned(picture, kEvery), thinned_real(plan, 0, kEvery));
}

void time_frame(benchmark::State& state, const Frame& frame) try {
    Scene scene = frame.read();
    const auto volume = volume_of(scene);
    std::optional<Plan> plan = make_plan(scene, volume);
    Rendering last = render(*plan, frame.options);
    const double error = psnr_of(frame, *plan, last.image);
    double seconds = 0, samples = 0, whole = 0;
    for (auto step : state) {
        (void)step;
        const Stopwatch watch;
        if (frame.picture == Picture::new_transfer_function) {
            scene.transfer_function.unit_distance *= 1.001;
            plan.emplace(make_plan(scene, volume));
        }
        render(*plan, frame.options, last);
        const double all = watch.ms() / 1000;
        state.SetIterationTime(frame.picture == Picture::same ? last.statistics.seconds : all);
        seconds += last.statistics.seconds, samples += static_cast<double>(last.statistics.samples),
            whole += all;
    }
    state.SetLabel(last.statistics.path + " " + last.statistics.target);
    state.counters["ns_per_sample"] = 1e9 * seconds / samples;
    state.counters["whole_ms"] = 1e3 * whole / static_cast<double>(state.iterations());
    state.counters["psnr"] = error;
    state.counters["load"] = load();
} catch (const InputError& error) {  // a method or a target this build or machine lacks
    state.SkipWithError(error.what());
}

/// Checks that the lanes of every target and the model give the same picture.  Throws InputError.
void check_bits() {
    for (const char* preset : {"default", "float32"})
        for (const char* method : {"pc", "pi2d", "pi1d", "pips"})
            for (const bool lit : {false, true}) {
                const Frame frame{.scene = "24",
                                  .lit = lit,
                                  .method = {method,
                                             {fmt::format("classification.method={}", method),
                                              "classification.table_size=64"}},
                                  .size = 32,
                                  .preset = preset};
                const Scene scene = frame.read();
                const Plan plan = make_plan(scene, volume_of(scene));
                const auto picture = [&](Path path, const std::string& target) {
                    RenderOptions options = with(1, target);
                    options.path = path;
                    return picture_hash(render(plan, options).image);
                };
                const std::string model = picture(Path::model, "");
                for (const std::string& target : targets())
                    if (picture(Path::automatic, target) != model)
                        throw InputError(fmt::format("{} {} {}, {}: lanes and model differ", preset, method,
                                                     lit ? "lit" : "unlit", target));
            }
}

std::vector<Frame> frames_of(const std::string& scene) {
    std::vector<Frame> frames;
    for (const bool lit : {false, true}) {
        const Frame plain{.scene = scene, .lit = lit, .options = with(1)};
        for (const Method& method : methods()) {
            Frame frame = plain;
            frame.method = method;
            frames.push_back(frame);
            frame.way = "no_skipping", frame.options = with(1, "", false);
            frames.push_back(frame);
            // Fixed point against float32 on the same layout: these two beside the two above.
            frame.preset = "float32", frame.way = "float32_no_skipping";
            frames.push_back(frame);
            frame.way = "float32", frame.options = with(1);
            frames.push_back(frame);
            frame.preset = plain.preset;
            frame.way = "new_transfer_function", frame.options = with(1);
            frame.picture = Picture::new_transfer_function;
            frames.push_back(frame);
        }
        for (const std::string& target : targets()) {
            Frame frame = plain;
            frame.way = target + "_no_skipping", frame.options = with(1, target, false);
            frames.push_back(frame);
        }
        Frame frame = plain;
        frame.options = with(2);
        frames.push_back(frame);
        frame.way = "no_skipping", frame.options = with(2, "", false);
        frames.push_back(frame);
        frame = plain, frame.step = 0.5;
        frames.push_back(frame);
        frame = plain, frame.way = "linear_no_skipping", frame.options = with(1, "", false);
        frame.options.layout = LayoutRule::linear;
        frames.push_back(frame);
        frame.way = "model_200x200", frame.size = 200, frame.options = with(1),
        frame.options.path = Path::model;
        frames.push_back(frame);
        frame.way = "lanes_200x200", frame.options = with(1, "", false);
        frames.push_back(frame);
    }
    return frames;
}

}  // namespace

int main(int argc, char** argv) try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    check_bits();
    std::vector<std::string> scenes{"64", "128", "256"};
    if (has_data())
        for (const std::string& name : data_scene_names()) scenes.push_back(name);
    for (const std::string& scene : scenes)
        for (const Frame& frame : frames_of(scene))
            benchmark::RegisterBenchmark(frame.name().c_str(),
                                         [=](benchmark::State& s) { time_frame(s, frame); })
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
