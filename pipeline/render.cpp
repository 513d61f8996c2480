#include "pipeline/render.h"

#include "core/error.h"
#include "core/parallel.h"
#include "pipeline/machines/lanes/blocks_met.h"
#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/machines/model.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <vector>

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

struct ChannelKind {
    const char* name;
    bool is_words;
};

std::vector<ChannelKind> channels_of(const OutputSettings& output) {
    std::vector<ChannelKind> kinds;
    const auto add = [&](bool wanted, std::initializer_list<const char*> names, bool is_words = false) {
        for (const char* name : names)
            if (wanted) kinds.push_back({name, is_words});
    };
    add(true, {"R", "G", "B", "A"});
    add(output.depth, {"Z", "Z.mean"});
    add(output.normals, {"N.x", "N.y", "N.z"});
    add(output.samples, {"samples"});
    add(output.transparency, {"T"});
    add(output.fixed, {"fixed.R", "fixed.G", "fixed.B", "fixed.T"}, true);
    return kinds;
}

bool is_such(const Image& image, int width, int height, const std::vector<ChannelKind>& kinds) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const auto same = [&](const Channel& channel, const ChannelKind& kind) {
        return channel.name == kind.name && channel.values.size() == (kind.is_words ? 0 : pixels) &&
               channel.words.size() == (kind.is_words ? pixels : 0);
    };
    return image.width == width && image.height == height &&
           std::equal(image.channels.begin(), image.channels.end(), kinds.begin(), kinds.end(), same);
}

Image blank(int width, int height, const std::vector<ChannelKind>& kinds) {
    Image image;
    image.width = width, image.height = height;
    for (const ChannelKind& kind : kinds)
        kind.is_words ? image.add_words(kind.name) : image.add_float(kind.name);
    return image;
}

int thinned_size(int size, int every) {
    return (size - every / 2 + every - 1) / every;
}

void clear(const Tile& tile, Image& image) {
    const auto zero = [&](auto& pixels) {
        for (int y = tile.top; y < tile.bottom && !pixels.empty(); ++y) {
            const auto row = pixels.begin() + std::ptrdiff_t{y} * image.width;
            std::fill(row + tile.left, row + tile.right, 0);
        }
    };
    for (Channel& channel : image.channels) zero(channel.values), zero(channel.words);
}

void render_on_these_threads(const Plan& plan, const RenderOptions& options, Rendering& into) {
    Image& image = into.image;
    const std::vector<ChannelKind> kinds = channels_of(plan.scene.output);
    const bool is_used = is_such(image, plan.camera.width, plan.camera.height, kinds);
    if (!is_used) image = {}, image = blank(plan.camera.width, plan.camera.height, kinds);
    image.left = image.top = 0, image.is_display = false;

    RenderStatistics& statistics = into.statistics;
    statistics = {};
    statistics.threads = threads_for(0);
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
    if (!fast)
        statistics.why = model.why() + (obstacle && (!plan.real || plan.float32) ? ": " + *obstacle : "");
    statistics.layout = fast ? fast->layout() : "linear";
    statistics.setup_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - setup_start).count();

    const auto start = std::chrono::steady_clock::now();
    in_parallel(tiles.size(), [&](std::size_t i) {
        if (options.cancelled && *options.cancelled) stopped = true;
        if (stopped) return;
        const Tile& t = tiles[i];
        if (is_used) clear(t, image);
        if (fast)
            fast->render_tile(t.left, t.top, t.right, t.bottom, image, per_tile[i]);
        else
            model.render_tile(t.left, t.top, t.right, t.bottom, image, per_tile[i]);
        const std::size_t now = ++done;
        if (options.progress) options.progress(static_cast<double>(now) / static_cast<double>(tiles.size()));
    });
    if (stopped) throw Cancelled{};
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (fast) statistics.why = fast->why(), statistics.bytes = fast->bytes();
    for (const TileStatistics& t : per_tile) {
        statistics.rays += t.rays, statistics.samples += t.samples, statistics.visited += t.visited;
        statistics.refined.add(t.refined);
        if (t.wires)
            for (std::size_t w = 0; w < t.wires->size(); ++w) statistics.wires[w].merge((*t.wires)[w]);
    }
}

}  // namespace

Rendering render(const Plan& plan, const RenderOptions& options) {
    Rendering result;
    render(plan, options, result);
    return result;
}

void render(const Plan& plan, const RenderOptions& options, Rendering& into) {
    on_threads(options.threads, [&] { render_on_these_threads(plan, options, into); });
}

Image render_thinned(const Plan& plan, const RenderOptions& options, int every) {
    if (every == 1) return render(plan, options).image;
    Image image = blank(plan.camera.width, plan.camera.height, channels_of({}));
    std::atomic<bool> stopped{false};
    on_threads(options.threads, [&] {
        ModelRenderer model(plan);
        if (options.skip) model.skip_empty_space(lanes::room_of(options));
        in_parallel(thinned_size(image.height, every), [&](int i) {
            if (options.cancelled && *options.cancelled) stopped = true;
            const int row = i * every + every / 2;
            for (int column = every / 2; column < image.width && !stopped; column += every) {
                TileStatistics statistics;
                model.render_tile(column, row, column + 1, row + 1, image, statistics);
            }
        });
    });
    if (stopped) throw Cancelled{};
    return thinned(image, every);
}

Image thinned(const Image& image, int every) {
    Image part = blank(thinned_size(image.width, every), thinned_size(image.height, every), channels_of({}));
    for (Channel& channel : part.channels) {
        const std::vector<float>& from = image.find(channel.name)->values;
        auto to = channel.values.begin();
        for (int y = every / 2; y < image.height; y += every)
            for (int x = every / 2; x < image.width; x += every)
                *to++ = from[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(x)];
    }
    return part;
}

}  // namespace squint
