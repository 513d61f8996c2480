#include "pipeline/render.h"

#include "core/error.h"
#include "core/threads.h"
#include "pipeline/machines/lanes/blocks_met.h"
#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/machines/model.h"

#include <fmt/format.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>

namespace squint {
namespace {

struct Tile {
    int left, top, right, bottom;
};

std::vector<Tile> tiles_of(int width, int height, int size) {
    std::vector<Tile> tiles;
    for (int top = 0; top < height; top += size)
        for (int left = 0; left < width; left += size)
            tiles.push_back({left, top, std::min(left + size, width), std::min(top + size, height)});
    return tiles;
}

void add_channels(const Scene& scene, Image& image) {
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    if (scene.output.depth) image.add_float("Z"), image.add_float("Z.mean");
    if (scene.output.normals) image.add_float("N.x"), image.add_float("N.y"), image.add_float("N.z");
    if (scene.output.samples) image.add_float("samples");
    if (scene.output.transparency) image.add_float("T");
    if (scene.output.fixed)
        for (const char* name : {"fixed.R", "fixed.G", "fixed.B", "fixed.T"}) image.add_words(name);
}

}  // namespace

Rendering render(const Plan& plan, const RenderOptions& options) {
    Rendering result;
    Image& image = result.image;
    image.width = plan.camera.width, image.height = plan.camera.height;
    add_channels(plan.scene, image);

    RenderStatistics& statistics = result.statistics;
    statistics.threads = threads_for(options.threads);
    const std::vector<Tile> tiles = tiles_of(image.width, image.height, std::max(1, options.tile));
    std::vector<TileStatistics> per_tile(tiles.size());
    std::atomic<std::size_t> done{0};
    std::atomic<bool> stopped{false};
    const auto setup_start = std::chrono::steady_clock::now();
    const std::optional<std::string> obstacle =
        options.audit ? "wires are audited" : lanes::what_needs_the_model(plan);
    if (obstacle && options.path == Path::lanes) throw InputError(fmt::format("--path lanes: {}", *obstacle));
    std::optional<lanes::LaneRenderer> fast;
    if (!obstacle && options.path != Path::model) fast.emplace(plan, options);
    ModelRenderer model(plan, options.audit);
    if (!fast && options.skip) model.skip_empty_space(lanes::room_of(options));
    statistics.path = fast ? "lanes" : "model";
    statistics.target = fast ? fast->target() : "";
    statistics.why =
        fast ? fast->why() : model.why() + (obstacle && (!plan.real || plan.float32) ? ": " + *obstacle : "");
    statistics.layout = fast ? fast->layout() : "linear";
    statistics.setup_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - setup_start).count();

    const auto start = std::chrono::steady_clock::now();
    tbb::task_arena arena(statistics.threads);
    arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, tiles.size(), 1),
            [&](const tbb::blocked_range<std::size_t>& range) {
                for (std::size_t i = range.begin(); i != range.end(); ++i) {
                    if (options.cancelled && *options.cancelled) stopped = true;
                    if (stopped) return;
                    const Tile& t = tiles[i];
                    if (fast)
                        fast->render_tile(t.left, t.top, t.right, t.bottom, image, per_tile[i]);
                    else
                        model.render_tile(t.left, t.top, t.right, t.bottom, image, per_tile[i]);
                    const std::size_t now = ++done;
                    if (options.progress)
                        options.progress(static_cast<double>(now) / static_cast<double>(tiles.size()));
                }
            },
            tbb::simple_partitioner());
    });
    if (stopped) throw Cancelled{};
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    statistics.bytes = fast ? fast->bytes() : 0;
    for (const TileStatistics& t : per_tile) {
        statistics.rays += t.rays, statistics.samples += t.samples, statistics.visited += t.visited;
        statistics.refined.add(t.refined);
        if (t.wires)
            for (std::size_t w = 0; w < t.wires->size(); ++w) statistics.wires[w].merge((*t.wires)[w]);
    }
    return result;
}

}  // namespace squint
