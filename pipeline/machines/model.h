// The golden model: one ray, one sample at a time, in scalar words.  Every other path must give its
// bits.
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"
#include "pipeline/refined.h"

#include <array>
#include <memory>
#include <string>

namespace squint {

struct TileStatistics {
    std::int64_t rays = 0, samples = 0, visited = 0;  // as RenderStatistics
    RefinedSlabs refined;
    std::unique_ptr<std::array<WireStatistics, kWires>> wires;  // with audit
};

namespace lanes {
struct EmptySpace;
}
template <class W>
struct Pixel;
template <class W>
struct ProjectedRay;

/// Stores a finished pixel in every channel of an image: where fixed point meets float.
void store_pixel(const Plan& plan, const Pixel<std::int64_t>& pixel, int column, int row, Image& image);
void store_pixel(const Plan& plan, const Pixel<Real<float>>& pixel, int column, int row, Image& image);

/// MIP, MinIP, average: the pixel of a ray, from the state of its projection.
Pixel<std::int64_t> project_pixel(const Plan& plan, const ProjectedRay<std::int64_t>& ray);

class ModelRenderer {
  public:
    explicit ModelRenderer(const Plan& plan, bool audit = false) : plan_(plan), audit_(audit) {}

    /// Leaves empty space out where words are doubles, and a transparent slab is the identity to their last bit:
    /// `room` bytes may be taken to find it.
    void skip_empty_space(std::int64_t room);

    /// Renders pixels [left, right) x [top, bottom) into every channel of `image`.  Many threads may call it
    /// at once for disjoint tiles.
    void render_tile(int left, int top, int right, int bottom, Image& image,
                     TileStatistics& statistics) const;

    /// The word, in a line: "64-bit integers", "double, nothing rounded", ...
    std::string why() const;

  private:
    const Plan& plan_;
    bool audit_;
    std::shared_ptr<const lanes::EmptySpace> empty_;
};

/// Every value on every wire along one ray, in the order of computation.  `slab` is -1 before the first slab.
/// Where nothing is rounded an event's `exact` is the value itself.
struct RayTrace {
    struct Event {
        std::int64_t slab;
        TraceEvent event;
    };
    std::vector<Event> events;
    RaySetup setup;
    std::array<double, 4> color;  // R G B A
};
RayTrace trace_ray(const Plan& plan, int column, int row);

}  // namespace squint
