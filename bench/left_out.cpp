// What a scene does not need costs nothing: for each thing that a plan leaves out or narrows, frames without it, and
// frames of the same picture that carry it along.
//
//     bench_left_out [size=400] [phantom=128] [pairs=9]
//
// Each row has a scene where leaving it out matters, and one where it cannot: there the two must cost the same.
// Processor time of one thread, medians of paired frames, as Markdown.  Same: the two pictures have equal bits.
#include "bench/support/support.h"
#include "core/error.h"
#include "pipeline/record.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <utility>

namespace {

using namespace squint;
using namespace squint::bench;

using Overrides = std::vector<std::string>;

/// The same voxels in 16 bits each.
std::shared_ptr<const Volume> in_16_bits(const Volume& volume) {
    auto wide = std::make_shared<Volume>(volume);
    const auto count = static_cast<std::size_t>(volume.voxels());
    constexpr std::size_t kReadable = 64;  // bytes behind the last voxel
    std::shared_ptr<std::uint16_t[]> data(new std::uint16_t[count + kReadable / sizeof(std::uint16_t)]());
    const auto* narrow = static_cast<const std::uint8_t*>(volume.data.get());
    for (std::size_t i = 0; i < count; ++i) data[i] = narrow[i];
    wide->type = ScalarType::u16, wide->data = data;
    return wide;
}

struct Drawn {
    Plan plan;
    RenderOptions options;
};

class Rows {
  public:
    Rows(int size, std::int64_t phantom, int pairs) : size_(size), phantom_(phantom), pairs_(pairs) {
        std::printf("%dx%d pixels, a phantom of %lld^3 voxels.\n\n", size, size,
                    static_cast<long long>(phantom));
        std::puts(
            "| left out | carried along instead | scene | without, ms | with / without | same picture |\n"
            "|---|---|---|---|---|---|");
    }

    Scene scene(Overrides overrides) const {
        overrides.insert(overrides.begin(),
                         {fmt::format("image.width={}", size_), fmt::format("image.height={}", size_)});
        return phantom_scene(phantom_, false, overrides);
    }
    static Drawn drawn(const Scene& scene, bool skip = true) {
        return {make_plan(scene, volume_of(scene)), options(skip)};
    }
    static RenderOptions options(bool skip) {
        RenderOptions options;
        options.threads = 1, options.skip = skip;
        return options;
    }

    void row(const char* what, const char* instead, const char* where, const Drawn& without,
             const Drawn& with) const {
        const auto cost = [](const Drawn& d) {
            const double before = processor_ms();
            Rendering drawn = render(d.plan, d.options);
            return std::pair(processor_ms() - before, std::move(drawn.image));
        };
        const bool same = picture_hash(cost(without).second) == picture_hash(cost(with).second);
        std::vector<double> ratios, times;
        for (int i = 0; i < pairs_; ++i) {
            const double first = cost(without).first, second = cost(with).first;
            ratios.push_back(second / first), times.push_back(first);
        }
        std::printf("| %s | %s | %s | %.1f | %.2f | %s |\n", what, instead, where, median(times),
                    median(ratios), same ? "yes" : "but for rounding");
        std::fflush(stdout);
    }

  private:
    int size_;
    std::int64_t phantom_;
    int pairs_;
};

const Overrides kFog{"volume.bits=8", "transfer_function.points=[[0,1,1,1,0.02],[255,1,1,1,0.02]]"},
    kNothing{"volume.bits=8", "transfer_function.points=[[0,1,1,1,0],[255,1,1,1,0]]"};

Scene from_far_away(Scene scene, const Camera& camera) {
    const double distance = 1000 * camera.half_height;
    scene.camera.projection = Projection::perspective;
    scene.camera.eye = camera.center - camera.view * distance;
    scene.camera.fov_y = 2 * std::atan(camera.half_height / distance) * 180 / std::numbers::pi;
    return scene;
}

void print(const Rows& t) {
    struct Place {
        const char* name;
        Overrides overrides;
    };
    const auto lit = [](Scene scene) {
        scene.lights = {Light{}};
        scene.shading.ka = 1, scene.shading.kd = scene.shading.ks = 0;
        return scene;
    };
    for (const Place& p : {Place{"phantom", {}}, Place{"nothing visible", kNothing}})
        t.row("light", "a light with ka = 1, kd = ks = 0", p.name, Rows::drawn(t.scene(p.overrides)),
              Rows::drawn(lit(t.scene(p.overrides))));

    const auto with_a_wall = [](Scene scene) {
        const auto volume = volume_of(scene);
        const TransferFunction function = resolve_transfer_function(scene, *volume);
        TransferFunctionSettings& settings = scene.transfer_function = {};
        settings.unit_distance = function.unit_distance, settings.entries = function.entries;
        for (const ColorPoint& p : function.color)
            settings.color.push_back({p.value, p.color.x, p.color.y, p.color.z});
        for (const OpacityPoint& p : function.opacity) settings.opacity.push_back({p.value, p.alpha});
        // The last level of the type, with the function as it was up to the one before.
        const double last = volume->largest_representable();
        if (volume->largest + 2 > last) throw InputError("bench_left_out: the data reach the last level");
        settings.opacity.back()[0] = last - 1;
        settings.opacity.push_back({last, 1});
        return scene;
    };
    for (const Place& p :
         {Place{"phantom, pips", {"classification.method=pips"}}, Place{"phantom, pc", {}}}) {
        Scene plain = t.scene(p.overrides);
        t.row("opaque entries", "an opaque entry that no voxel has", p.name, Rows::drawn(plain),
              Rows::drawn(with_a_wall(plain)));
    }

    for (const Place& p : {Place{"phantom", {}}, Place{"nothing visible", kNothing}}) {
        const Scene scene = t.scene(p.overrides);
        const Drawn flat = Rows::drawn(scene);
        t.row("a direction for each ray (orthographic)", "an eye a thousand pictures away", p.name, flat,
              Rows::drawn(from_far_away(scene, flat.plan.camera)));
    }

    for (const Place& p : {Place{"phantom", {}}, Place{"fog in every voxel", kFog}}) {
        const Scene scene = t.scene(p.overrides);
        t.row("empty ranges", "every sample visited", p.name, Rows::drawn(scene), Rows::drawn(scene, false));
    }

    for (const Place& p : {Place{"fog in every voxel", kFog}, Place{"nothing visible", kNothing}}) {
        const Scene scene = t.scene(p.overrides);
        const Drawn narrow = Rows::drawn(scene);
        Drawn wide = narrow;
        wide.plan = make_plan(scene, in_16_bits(*narrow.plan.volume));
        t.row("half of each voxel (8-bit data)", "the same voxels in 16 bits", p.name, narrow, wide);
    }
}

}  // namespace

int main(int argc, char** argv) try {
    const Settings settings(argc, argv, {{"size", "400"}, {"phantom", "128"}, {"pairs", "9"}});
    print(Rows(static_cast<int>(settings.number("size")),
               static_cast<std::int64_t>(settings.number("phantom")),
               static_cast<int>(settings.number("pairs"))));
    return 0;
} catch (const squint::InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
}
