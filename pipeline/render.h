// Renders a plan: the one entrance to every path through the pipeline.
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"
#include "pipeline/refined.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace squint {

enum class Path { automatic, model, lanes };

struct RenderOptions {
    int threads = 0;  // 0: one per processor
    int tile = 32;    // pixels a side
    Path path = Path::automatic;
    std::string target;  // the name of a SIMD target ("AVX3", "AVX2", "SSE4", "EMU128"); empty: the best
    LayoutRule layout = LayoutRule::automatic;
    std::int64_t layout_bytes =
        -1;              // memory for a layout beside the volume itself; below 0: half of what is free
    bool skip = true;    // skip empty space
    bool audit = false;  // count what each wire carries; runs the audited model
    std::function<void(double)> progress;  // gets the part done, from any thread
    const std::atomic<bool>* cancelled = nullptr;
};

struct RenderStatistics {
    std::string path, target, why, layout;  // what ran, and why
    int threads = 1;
    std::int64_t rays = 0, samples = 0;  // rays that meet the volume; slabs composited
    std::int64_t visited = 0;            // slabs that went through the stages and were not skipped as empty
    RefinedSlabs refined;
    double seconds = 0;                        // of ray casting alone
    double setup_seconds = 0;                  // of layouts and blocks that were built for this picture
    std::int64_t bytes = 0;                    // volume layouts, tables and buffers
    std::array<WireStatistics, kWires> wires;  // with audit
};

/// Thrown when `cancelled` became true.
struct Cancelled {};

struct Rendering {
    Image image;
    RenderStatistics statistics;
};

/// Renders R G B A and the channels that the scene asks for.  Threads, tiles, path, target and layout do not
/// change a bit.
Rendering render(const Plan& plan, const RenderOptions& options = {});
/// The same into a rendering of before, whose image keeps its memory where size and channels are the same: a frame of
/// an animation waits for no new pages.  All that it held is replaced.
void render(const Plan& plan, const RenderOptions& options, Rendering& into);

/// The colours of pixels (every i + every / 2) in both directions, as a picture: gives errors of a large picture from a
/// part of it.  One of `every` is rendered as a whole; of more, each pixel by the model.
Image render_thinned(const Plan& plan, const RenderOptions& options, int every);
/// The same pixels of an image.
Image thinned(const Image& image, int every);

}  // namespace squint
