#include "studies/sweep/picture_figures.h"

#include "core/compare.h"
#include "pipeline/machines/model.h"
#include "pipeline/record.h"

#include <algorithm>

namespace squint::sweep {
namespace {

Json figures(const Comparison& comparison, const std::string& channel) {
    Json json = json_of(comparison.channel(channel, true));
    if (const auto& ssim = comparison.channel(channel, false).ssim) json["ssim"] = *ssim;
    return json;
}

}  // namespace

Image colors_of(const Image& image) {
    Image colors{image.width, image.height, {}};
    for (const char* name : {"R", "G", "B", "A"}) colors.channels.push_back(*image.find(name));
    return colors;
}

Json errors_of(const Image& picture, const Image& other, const Measure& measure) {
    const Comparison linear = compare(picture, other, false, measure.ssim);
    Json json{{"color", figures(linear, "RGB")}, {"alpha", figures(linear, "A")}};
    if (measure.srgb) json["color_srgb"] = figures(compare(picture, other, true, measure.ssim), "RGB");
    return json;
}

double color_above_alpha(const Image& image) {
    const auto& alpha = image.find("A")->values;
    double most = 0;
    for (const char* name : {"R", "G", "B"}) {
        const auto& color = image.find(name)->values;
        for (std::size_t i = 0; i < color.size(); ++i)
            most = std::max(most, static_cast<double>(color[i]) - static_cast<double>(alpha[i]));
    }
    return most * 255;
}

Json conservation(const Scene& scene, const std::shared_ptr<const Volume>& volume,
                  const RenderOptions& options) {
    Scene white = scene;
    const TransferFunction tf = resolve_transfer_function(white, *volume);
    white.transfer_function = {};
    white.transfer_function.color = {{0, 1, 1, 1}};
    for (const OpacityPoint& p : tf.opacity) white.transfer_function.opacity.push_back({p.value, p.alpha});
    white.transfer_function.unit_distance = tf.unit_distance, white.transfer_function.entries = tf.entries;
    white.lights.clear();
    const Image image = render(make_plan(white, volume), options).image;
    const auto &color = image.find("R")->values, &alpha = image.find("A")->values;
    double low = 0, high = 0;
    for (std::size_t i = 0; i < color.size(); ++i) {
        const double excess = static_cast<double>(color[i]) - static_cast<double>(alpha[i]);
        low = std::min(low, excess), high = std::max(high, excess);
    }
    return {{"least_lsb8", low * 255}, {"most_lsb8", high * 255}};
}

Json stuck_transparency(const Plan& plan) {
    constexpr int kRays = 32;
    const int across = (plan.camera.width + kRays - 1) / kRays,
              down = (plan.camera.height + kRays - 1) / kRays;
    std::int64_t rays = 0, visible = 0, stuck = 0;
    for (int y = down / 2; y < plan.camera.height; y += down)
        for (int x = across / 2; x < plan.camera.width; x += across) {
            const RayTrace ray = trace_ray(plan, x, y);
            rays += ray.setup.slabs > 0;
            std::int64_t slab = -1, alpha = 0, before = -1, after = -1;
            const auto end_slab = [&] {
                if (alpha > 0 && after >= 0) ++visible, stuck += before > 0 && after == before;
                if (after >= 0) before = after;
                alpha = 0, after = -1;
            };
            for (const RayTrace::Event& event : ray.events) {
                if (event.slab != slab) end_slab(), slab = event.slab;
                if (event.event.wire == static_cast<int>(Wire::slab_alpha)) alpha = event.event.raw;
                if (event.event.wire == static_cast<int>(Wire::transparency)) after = event.event.raw;
            }
            end_slab();
        }
    return {{"rays", rays}, {"visible_samples", visible}, {"stuck_samples", stuck}};
}

}  // namespace squint::sweep
