// squint against VTK's fixed-point mapper: the same scenes, frame by frame in turn, in one run.  Progress on
// standard error, a line of JSON for each case on standard output; bench/tables.py makes
// docs/measurements/vtk.md of it.
//
//     SQUINT_DATA=... bench_against_vtk [scenes=cthead_opaque,...] [lit=0,1] [steps=1,0.5] [threads=1,2]
//                                       [frames=8] [size=800] [every=4]
#include "bench/peers/vtk/vtk_peer.h"
#include "bench/support/support.h"
#include "core/error.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace squint;
using namespace squint::bench;

struct Times {
    std::vector<double> cast, whole, processor;  // ms; processor: of the whole, all threads
    Json json() const {
        return {{"cast_ms", median(cast)}, {"whole_ms", median(whole)}, {"processor_ms", median(processor)}};
    }
};

/// A way of ours to render a scene.
struct Contender {
    std::string name;
    std::vector<std::string> overrides;
    Times one_run{};
};

struct Case {
    std::string name;
    bool lit;
    double step;
};

/// Makes plan and picture, in the memory of the picture before as VTK does, and adds their times.
void timed(const Scene& scene, const std::shared_ptr<const Volume>& volume, int frame, int threads,
           Times& times, Rendering& rendering) {
    const Stopwatch watch;
    const double before = processor_ms();
    const Plan plan = make_plan(scene, volume, frame);
    RenderOptions options;
    options.threads = threads;
    render(plan, options, rendering);
    times.whole.push_back(watch.ms());
    times.processor.push_back(processor_ms() - before);
    times.cast.push_back(1000 * rendering.statistics.seconds);
}

double first_frame_of_ours(const Scene& scene, const Volume& volume, int threads) {
    const auto copy = fresh_copy(volume);
    Times times;
    Rendering rendering;
    timed(scene, copy, 0, threads, times, rendering);
    return times.whole[0];
}

double first_frame_of_vtk(const Plan& plan, const Camera& camera, int threads) {
    const Stopwatch watch;
    VtkPeer peer(plan, threads);
    peer.render(camera);
    return watch.ms();
}

std::vector<double> ratios(const std::vector<double>& theirs, const std::vector<double>& ours) {
    std::vector<double> quotients;
    for (std::size_t i = 0; i < ours.size(); ++i) quotients.push_back(theirs[i] / ours[i]);
    return quotients;
}

Scene scene_of(const Case& c, const std::vector<std::string>& overrides, const Settings& settings) {
    std::vector<std::string> all = overrides;
    all.push_back(fmt::format("sampling.step={}", c.step));
    for (const char* side : {"width", "height"})
        all.push_back(fmt::format("image.{}={}", side, settings.number("size")));
    all.push_back(fmt::format("camera.turntable={}", settings.number("frames")));
    return data_scene(c.name, c.lit, all);
}

/// One scene at one step: every thread count, frames in turn, errors of the first frame.
Json compare_case(const Case& c, const Settings& settings) {
    const std::vector<Contender> contenders{{"pc", {}}, {"pips", {"classification.method=pips"}}};
    const Scene scene = scene_of(c, {}, settings);
    const auto volume = volume_of(scene);
    const Plan plan = make_plan(scene, volume);
    const int every = static_cast<int>(settings.number("every"));
    const Image real = thinned_real(plan, 0, every), reference = thinned_reference(plan, 0, every);

    Json record{{"scene", c.name}, {"lit", c.lit}, {"step", c.step}, {"runs", Json::array()}};
    VtkPeer peer(plan, 1);
    for (const double threads : settings.numbers("threads")) {
        const int n = static_cast<int>(threads);
        Json run{{"threads", n}};
        const double vtk_first = first_frame_of_vtk(plan, plan.camera, n);
        Times vtk;
        std::vector<Contender> ours = contenders;
        std::vector<Rendering> pictures(ours.size());
        Json errors = Json::object();
        std::vector<Json> details(ours.size());
        peer.set_threads(n);
        peer.render(plan.camera);  // what is built once
        for (int frame = 0; frame < scene.camera.turntable; ++frame) {
            const Camera camera = make_plan(scene, volume, frame).camera;
            const double before = processor_ms();
            const VtkPeer::Frame theirs = peer.render(camera);
            vtk.processor.push_back(processor_ms() - before);
            vtk.cast.push_back(theirs.cast_ms), vtk.whole.push_back(theirs.whole_ms);
            if (frame == 0) {
                const Image part = thinned(theirs.image, every);
                errors["vtk"] = {{"psnr_double", psnr(part, thinned(peer.in_double(every), every))},
                                 {"psnr_real", psnr(part, real)},
                                 {"psnr_reference", psnr(part, reference)}};
            }
            for (std::size_t i = 0; i < ours.size(); ++i) {
                const Scene changed = scene_of(c, ours[i].overrides, settings);
                Times not_counted;  // what is built once
                Rendering& mine = pictures[i];
                if (frame == 0) timed(changed, volume, frame, n, not_counted, mine);
                timed(changed, volume, frame, n, ours[i].one_run, mine);
                if (frame > 0) continue;
                const Image part = thinned(mine.image, every);
                const Plan own = make_plan(changed, volume);
                details[i] = {{"psnr_real", psnr(part, thinned_real(own, 0, every))},
                              {"psnr_reference", psnr(part, reference)},
                              {"path", mine.statistics.path},
                              {"target", mine.statistics.target},
                              {"samples", mine.statistics.samples}};
            }
        }
        run["vtk"] = vtk.json();
        run["vtk"].update(errors["vtk"]);
        run["vtk"]["first_ms"] = vtk_first;
        for (std::size_t i = 0; i < ours.size(); ++i) {
            Json& mine = run[ours[i].name] = ours[i].one_run.json();
            mine.update(details[i]);
            mine["first_ms"] = first_frame_of_ours(scene_of(c, ours[i].overrides, settings), *volume, n);
            mine["times_faster"] = median(ratios(vtk.cast, ours[i].one_run.cast));
            mine["times_faster_processor"] = median(ratios(vtk.processor, ours[i].one_run.processor));
            mine["times_faster_whole"] = median(ratios(vtk.whole, ours[i].one_run.whole));
        }
        run["load"] = load();
        std::fputs(
            fmt::format(
                "{:22} {:5} step {:<4} {} thread(s): VTK {:7.1f} ms {:5.1f} dB, pc {:7.1f} ms {:5.1f} dB, "
                "{:5.2f} times faster; pips {:7.1f} ms; load {:.1f}\n",
                c.name, c.lit ? "lit" : "unlit", c.step, n, run["vtk"]["cast_ms"].get<double>(),
                run["vtk"]["psnr_double"].get<double>(), run["pc"]["cast_ms"].get<double>(),
                run["pc"]["psnr_real"].get<double>(), run["pc"]["times_faster"].get<double>(),
                run["pips"]["cast_ms"].get<double>(), load())
                .c_str(),
            stderr);
        record["runs"].push_back(run);
    }
    return record;
}

/// Fog of one unit of 255 in a cube of 128: how its error changes as the step shrinks.
Json fog(const Settings& settings) {
    Json points = Json::array();
    for (double step = 1; step >= 1.0 / 32; step /= 2) {
        const Scene scene =
            scene_with(built_in_scene(),
                       {"volume.procedural=fog",
                        "transfer_function.points=[[0,1,1,1,0.0],[1,1,1,1,0.03],[255,1,1,1,0.03]]",
                        "transfer_function.unit_distance=1", "image.width=200", "image.height=200",
                        "lights=[]", "classification.method=pc", fmt::format("sampling.step={}", step)});
        const auto volume = volume_of(scene);
        const Plan plan = make_plan(scene, volume);
        const int every = static_cast<int>(settings.number("every"));
        VtkPeer peer(plan, 1);
        const VtkPeer::Frame theirs = peer.render(plan.camera);
        const Image reference = thinned_reference(plan, 0, every);
        const Image vtk = thinned(theirs.image, every), ours = thinned(render(plan).image, every);
        points.push_back({{"step", step},
                          {"vtk_psnr_double", psnr(vtk, thinned(peer.in_double(every), every))},
                          {"vtk_psnr_reference", psnr(vtk, reference)},
                          {"pc_psnr_real", psnr(ours, thinned_real(plan, 0, every))},
                          {"pc_psnr_reference", psnr(ours, reference)}});
        std::fputs((points.back().dump() + "\n").c_str(), stderr);
    }
    return points;
}

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
    return text;
}

}  // namespace

int main(int argc, char** argv) try {
    const Settings settings(argc, argv,
                            {{"scenes", joined(data_scene_names())},
                             {"lit", "0,1"},
                             {"steps", "1,0.5"},
                             {"threads", "1,2"},
                             {"frames", "8"},
                             {"size", "800"},
                             {"every", "4"}});
    if (!has_data()) throw InputError("SQUINT_DATA: names no folder with the volumes of configs/bench");
    print_line({{"machine", machine()}});
    print_line({{"fog", fog(settings)}});
    for (const std::string& name : settings.list("scenes"))
        for (const double lit : settings.numbers("lit"))
            for (const double step : settings.numbers("steps"))
                print_line({{"case", compare_case({name, lit != 0, step}, settings)}});
    return 0;
} catch (const InputError& error) {
    std::fputs(fmt::format("{}\n", error.what()).c_str(), stderr);
    return 2;
}
