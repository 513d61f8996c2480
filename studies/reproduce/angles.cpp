#include "studies/reproduce/angles.h"

#include "core/parallel.h"
#include "pipeline/render.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <cmath>

namespace squint::reproduce {
namespace {

using namespace HWY_NAMESPACE;
using W = Real<double>;

Vec3 vector_of(const std::array<W, 3>& g) {
    return {g[0].v, g[1].v, g[2].v};
}

struct Counts {
    int slabs = 0, above_60 = 0, above_90 = 0;
};
template <class M>
Counts counts_along(const Plan& plan, const M& method, int column, int row) {
    Counts counts;
    const RaySetup setup = plan.set_up(column, row);
    if (setup.slabs == 0) return counts;
    const RayWords<W> ray = ray_words<W>(plan, setup);
    const Silent silent;
    const FromVolume voxels{*plan.volume};
    const Places<W, FromVolume> places(plan, voxels, ray, silent);
    const W full = constant<W>(std::int64_t{1} << plan.location.length_fraction);
    Sample<W> front = places.sample(constant<W>(0));
    for (int k = 0; k < setup.slabs; ++k) {
        Sample<W> back = places.sample(constant<W>(k + 1));
        if (classify(method, front.input, back.input, full).alpha.v > 0) {
            const Vec3 a = vector_of(places.gradient_of(front)), b = vector_of(places.gradient_of(back));
            const double lengths = std::sqrt(a.dot(a) * b.dot(b));
            if (lengths > 0) {
                const double cosine = a.dot(b) / lengths;
                ++counts.slabs, counts.above_60 += cosine < 0.5, counts.above_90 += cosine < 0;
            }
        }
        front = back;
    }
    return counts;
}

}  // namespace

Image gradient_turns(const Plan& plan, int threads, const std::atomic<bool>* cancelled) {
    Image image{plan.camera.width, plan.camera.height, {}};
    for (const char* name : {"slabs", "angle60", "angle90"}) image.add_float(name);
    std::atomic<bool> stopped{false};
    on_threads(threads, [&] {
        in_parallel(image.height, [&](int row) {
            if (cancelled && *cancelled) stopped = true;
            if (stopped) return;
            for (int column = 0; column < image.width; ++column) {
                const Counts counts = std::visit(
                    [&](const auto& m) { return counts_along(plan, m, column, row); }, plan.method);
                const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                                       static_cast<std::size_t>(column);
                image.channels[0].values[at] = static_cast<float>(counts.slabs);
                image.channels[1].values[at] = static_cast<float>(counts.above_60);
                image.channels[2].values[at] = static_cast<float>(counts.above_90);
            }
        });
    });
    if (stopped) throw Cancelled{};
    return image;
}

}  // namespace squint::reproduce
