// Walls between samples: how many rays miss one, or meet it late, and what looking twice costs.
//
//     SQUINT_DATA=... bench_walls [scenes=cthead,engine,bonsai] [walls=1400,120,120] [steps=1,0.5,0.25] [size=96]
//                     [speed=cthead_opaque,...] [pairs=7] [picture=256]
//
// A scene's volume behind a function of one wall; a ray's own first hit is sought in doubles, 48 samples a voxel.
// Missed: it goes on behind it.  Late: the slab that it ends in begins over a voxel behind it.  Speed: processor
// time of a frame that looks twice over one that does not, the median of paired frames of configs/bench.  It
// prints Markdown.
#include "bench/support/support.h"
#include "core/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

namespace {

using namespace squint;
using namespace squint::bench;

double trilinear(const Volume& volume, const Vec3& at) {
    std::int64_t cell[3];
    double w[3];
    for (int a = 0; a < 3; ++a) {
        const double p = std::clamp(at[a], 0.0, static_cast<double>(volume.dims[a] - 1));
        cell[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(p), 0, volume.dims[a] - 2);
        w[a] = p - static_cast<double>(cell[a]);
    }
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
        const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
        sum += (x ? w[0] : 1 - w[0]) * (y ? w[1] : 1 - w[1]) * (z ? w[2] : 1 - w[2]) *
               static_cast<double>(volume.at(cell[0] + x, cell[1] + y, cell[2] + z));
    }
    return sum;
}

/// Steps from a ray's entry to its first scalar from `wall` on.
std::optional<double> first_hit(const Volume& volume, const RaySetup& ray, double step, double wall) {
    constexpr double kSamples = 48;
    const double apart = 1 / (kSamples * step), end = ray.slabs - 1 + ray.last_length;
    for (double k = 0; k <= end; k += apart)
        if (trilinear(volume, ray.first + ray.step * k) >= wall) return k;
    return std::nullopt;
}

struct Share {
    double hits = 0, missed = 0, late = 0;
    double slabs = 0, looked_twice = 0;
    std::string text() const {
        return fmt::format("{:.2f} + {:.2f}", 100 * missed / hits, 100 * late / hits);
    }
};

Share share_of(const std::string& name, const std::string& wall, double step, int size, const char* rule) {
    Scene scene =
        data_scene(name + "_opaque", false,
                   {fmt::format("sampling.step={}", step), fmt::format("image.width={}", size),
                    fmt::format("image.height={}", size), "classification.method=pips", "output.depth=true",
                    "precision.preset=real", fmt::format("classification.opaque_prediction={}", rule),
                    fmt::format("transfer_function.points=[[0,1,1,1,0],[{},1,1,1,0],[{},1,1,1,1]]",
                                std::stod(wall) - 1, wall)});
    scene.camera.turntable = 1;
    const Plan plan = make_plan(scene, volume_of(scene));
    const auto& entries = plan.entries.entry;
    const auto opaque = std::find_if(entries.begin(), entries.end(), [](const Entry& e) { return e.opaque; });
    const double level = static_cast<double>(opaque - entries.begin()) * plan.entries.scalars_per_entry;
    const Rendering picture = render(plan);
    const auto channel = [&](const char* wanted) {
        for (const Channel& c : picture.image.channels)
            if (c.name == wanted) return &c.values;
        throw InputError("bench_walls: no channel");
    };
    const std::vector<float>&alpha = *channel("A"), &depth = *channel("Z");
    Share share;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const RaySetup ray = plan.set_up(x, y);
            if (ray.slabs == 0) continue;
            const std::optional<double> hit = first_hit(*plan.volume, ray, step, level);
            if (!hit) continue;
            const auto at =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x);
            ++share.hits;
            const double met = (static_cast<double>(depth[at]) - ray.entry_distance) / plan.step_world;
            if (alpha[at] < 0.5F)
                ++share.missed;
            else if (met > *hit + 1 / step)
                ++share.late;
        }
    share.slabs = static_cast<double>(picture.statistics.visited);
    share.looked_twice = static_cast<double>(picture.statistics.refined.looked_twice);
    return share;
}

void print_speed(const std::string& name, bool lit, int pairs, int size) {
    const auto plan_with = [&](const char* rule) {
        Scene scene = data_scene(
            name, lit,
            {"classification.method=pips", fmt::format("image.width={}", size),
             fmt::format("image.height={}", size), fmt::format("classification.opaque_prediction={}", rule)});
        scene.camera.turntable = 1;
        return make_plan(scene, volume_of(scene));
    };
    const Plan ends = plan_with("ends"), twice = plan_with("twice");
    RenderOptions options;
    options.threads = 1;
    const auto cost = [&](const Plan& plan) {
        const double before = processor_ms();
        const Rendering drawn = render(plan, options);
        return std::pair(processor_ms() - before, drawn.statistics);
    };
    cost(ends), cost(twice);
    std::vector<double> ratios, of_ends;
    RenderStatistics last;
    for (int i = 0; i < pairs; ++i) {
        const double first = cost(ends).first;
        const auto [second, statistics] = cost(twice);
        ratios.push_back(second / first), of_ends.push_back(first), last = statistics;
    }
    std::printf("| %s | %s | %.1f | %.3f | %.2f %% |\n", name.c_str(), lit ? "lit" : "unlit", median(of_ends),
                median(ratios),
                100 * static_cast<double>(last.refined.looked_twice) / static_cast<double>(last.visited));
}

}  // namespace

int main(int argc, char** argv) try {
    const Settings settings(argc, argv,
                            {{"scenes", "cthead,engine,bonsai"},
                             {"walls", "1400,120,120"},
                             {"steps", "1,0.5,0.25"},
                             {"size", "96"},
                             {"speed", "cthead_opaque,engine_opaque,bonsai_opaque"},
                             {"pairs", "7"},
                             {"picture", "256"}});
    const std::vector<std::string> scenes = settings.list("scenes"), walls = settings.list("walls");
    const int size = static_cast<int>(settings.number("size"));
    std::puts(
        "| volume, wall | step | rays with a wall | ends: missed + late, % | twice | looked at twice |");
    std::puts("|---|---|---|---|---|---|");
    for (std::size_t i = 0; i < std::min(scenes.size(), walls.size()); ++i)
        for (const double step : settings.numbers("steps")) {
            const Share ends = share_of(scenes[i], walls[i], step, size, "ends"),
                        twice = share_of(scenes[i], walls[i], step, size, "twice");
            std::printf("| %s, %s | %g | %.0f | %s | %s | %.1f %% of slabs |\n", scenes[i].c_str(),
                        walls[i].c_str(), step, ends.hits, ends.text().c_str(), twice.text().c_str(),
                        100 * twice.looked_twice / twice.slabs);
        }
    std::puts("\n| scene | | ends, ms | twice / ends | looked at twice |\n|---|---|---|---|---|");
    for (const std::string& name : settings.list("speed"))
        for (const bool lit : {false, true})
            print_speed(name, lit, static_cast<int>(settings.number("pairs")),
                        static_cast<int>(settings.number("picture")));
    return 0;
} catch (const squint::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
}
