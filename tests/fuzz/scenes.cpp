// Bytes draw a legal scene: its picture is finite, lanes give the model's, and in doubles no colour passes its opacity.
#include "core/volume_source.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/fuzz/fuzz_file.h"

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>

namespace squint::fuzz {
namespace {

template <class E>
E one_of(FuzzedDataProvider& draw) {
    return static_cast<E>(
        draw.ConsumeIntegralInRange<int>(0, static_cast<int>(std::size(EnumNames<E>::names)) - 1));
}

Vec3 vector(FuzzedDataProvider& draw, double most) {
    const auto part = [&] { return draw.ConsumeFloatingPointInRange<double>(-most, most); };
    const double x = part(), y = part(), z = part();
    return {x, y, z};
}

std::string spec(FuzzedDataProvider& draw) {
    static const char* const kRounding[] = {"", " trn", " trn_zero", " rnd", " rnd_conv"};
    static const char* const kOverflow[] = {"", " sat", " wrap"};
    std::string text = draw.ConsumeBool() ? "s" : "u";
    text += std::to_string(draw.ConsumeIntegralInRange<int>(0, 16)) + ".";
    text += std::to_string(draw.ConsumeIntegralInRange<int>(1, 24));
    text += kRounding[draw.ConsumeIntegralInRange<int>(0, 4)];
    return text + kOverflow[draw.ConsumeIntegralInRange<int>(0, 2)];
}

/// Last, so that bytes found earlier keep their meaning; refused more often than not if each were drawn each time.
void draw_what_few_scenes_set(FuzzedDataProvider& draw, Scene& scene) {
    const auto now_and_then = [&] { return draw.ConsumeIntegralInRange<int>(0, 3) == 1; };
    const auto unit = [&] { return draw.ConsumeProbability<double>(); };
    if (now_and_then()) scene.sampling.interpolation = one_of<InterpolationRule>(draw);
    if (now_and_then()) scene.sampling.lerp = one_of<LerpRule>(draw);
    if (now_and_then()) scene.transfer_function.entries = draw.ConsumeIntegralInRange<int>(2, 64);
    ClassificationSettings& classification = scene.classification;
    if (now_and_then()) classification.order = draw.ConsumeIntegralInRange<int>(1, 5);
    if (now_and_then()) classification.lookup = one_of<TableLookup>(draw);
    if (now_and_then()) classification.encoding = one_of<AlphaEncoding>(draw);
    if (now_and_then()) classification.opaque_prediction = one_of<WallRule>(draw);
    if (now_and_then()) classification.as_printed = draw.ConsumeBool();
    ShadingSettings& shading = scene.shading;
    if (now_and_then()) shading.inside = one_of<InsideRule>(draw);
    if (now_and_then()) shading.exaggeration = 7 * unit();
    if (now_and_then()) shading.gradient_floor = 400 * unit();
    if (now_and_then()) shading.cone_slope = one_of<ConeSlope>(draw);
    if (now_and_then()) shading.cool_side = one_of<CoolSide>(draw);
    if (now_and_then()) shading.ka = unit(), shading.kd = unit(), shading.ks = unit();
}

Scene scene_from(FuzzedDataProvider& draw) {
    static const char* const kVolumes[] = {"phantom",  "sphere", "marschner_lobb", "shells", "ramp",
                                           "constant", "fog"};
    const auto unit = [&] { return draw.ConsumeProbability<double>(); };
    Scene scene;
    scene.volume.procedural = kVolumes[draw.ConsumeIntegralInRange<int>(0, 6)];
    const auto size = [&] { return std::int64_t{draw.ConsumeIntegralInRange<int>(1, 9)}; };
    const std::int64_t x = size(), y = size(), z = size();
    scene.volume.dims = {x, y, z};
    scene.volume.bits = draw.ConsumeIntegralInRange<int>(4, 12);
    const double most = std::ldexp(1.0, scene.volume.bits);
    std::vector<double> values;
    for (int i = draw.ConsumeIntegralInRange<int>(1, 5); i > 0; --i) values.push_back(unit() * most);
    std::sort(values.begin(), values.end());
    for (const double value : values) {
        const double r = unit(), g = unit(), b = unit(),
                     alpha = draw.ConsumeBool() ? unit() : draw.ConsumeBool();
        scene.transfer_function.points.push_back({value, r, g, b, alpha});
    }
    scene.transfer_function.unit_distance = 0.05 + 4 * unit();
    scene.camera.projection = one_of<Projection>(draw);
    scene.camera.azimuth = 360 * unit(), scene.camera.elevation = 180 * unit() - 90;
    scene.image.width = 7, scene.image.height = 5;
    scene.sampling.step = 0.1 + 2 * unit();
    scene.sampling.termination = draw.ConsumeBool() ? 0 : unit() * 0.5;
    scene.sampling.position = one_of<PositionRule>(draw);
    if (draw.ConsumeBool()) scene.clip.low = vector(draw, 4);
    for (int i = draw.ConsumeIntegralInRange<int>(0, 2); i > 0; --i)
        scene.lights.push_back({draw.ConsumeBool(), vector(draw, 1) + Vec3(0, 0, 1.5), Vec3(1)});
    scene.shading.model = one_of<ShadingModel>(draw), scene.shading.gradient = one_of<GradientRule>(draw);
    scene.shading.power = one_of<PowerRule>(draw),
    scene.shading.exponent = 1 << draw.ConsumeIntegralInRange<int>(0, 8);
    scene.shading.two_sided = draw.ConsumeBool();
    scene.classification.method = one_of<Method>(draw);
    scene.classification.table_size = 64;
    scene.compositing.mode = one_of<CompositingMode>(draw),
    scene.compositing.form = one_of<CompositingForm>(draw);
    scene.output.depth = draw.ConsumeBool(), scene.output.normals = draw.ConsumeBool();
    // `auto` renders the picture many times over: it is none of the presets drawn.
    static_assert(std::end(kPrecisionPresets)[-1] == "auto");
    scene.precision.preset =
        kPrecisionPresets[draw.ConsumeIntegralInRange<std::size_t>(0, std::size(kPrecisionPresets) - 2)];
    for (int i = draw.ConsumeIntegralInRange<int>(0, 3); i > 0; --i)
        scene.precision.override_[draw.ConsumeIntegralInRange<std::size_t>(0, kWires - 1)] = spec(draw);
    draw_what_few_scenes_set(draw, scene);
    return scene;
}

void check_picture(const Plan& plan, const Image& image) {
    for (const Channel& channel : image.channels)
        if (channel.name.size() == 1 && channel.name != "Z")
            for (const float value : channel.values)
                if (!std::isfinite(value)) std::abort();
    const ShadingSettings& shading = plan.scene.shading;
    if (plan.scene.precision.preset != "real" || (plan.lit && shading.ka + shading.kd + shading.ks > 1))
        return;
    const std::vector<float>& alpha = image.find("A")->values;
    for (const char* name : {"R", "G", "B"})
        for (std::size_t i = 0; i < alpha.size(); ++i)
            if (image.find(name)->values[i] > alpha[i] + 1e-6F) std::abort();
}

/// Says at the end how many of the scenes were legal.
struct Count {
    std::int64_t drawn = 0, legal = 0;
    ~Count() {
        std::fprintf(stderr, "%lld scenes, %lld of them legal\n", static_cast<long long>(drawn),
                     static_cast<long long>(legal));
    }
};

}  // namespace
}  // namespace squint::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    static fuzz::Count count;
    ++count.drawn;
    FuzzedDataProvider draw(data, size);
    const Scene scene = fuzz::scene_from(draw);
    fuzz::read_or_refuse([&] {
        const auto volume = std::make_shared<const Volume>(load_volume(scene.volume));
        const Plan plan = make_plan(scene, volume);
        RenderOptions options;
        options.threads = 1, options.path = Path::model;
        const Image model = render(plan, options).image;
        fuzz::check_picture(plan, model);
        options.path = Path::automatic;
        if (picture_hash(render(plan, options).image) != picture_hash(model)) std::abort();
        ++count.legal;
    });
    return 0;
}
