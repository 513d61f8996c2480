// One picture, whatever draws it: a dozen small scenes by every SIMD target, thread count, tile size and
// layout, with and without skipping empty space, each with each.  The random scenes of same_bits_test.cpp
// meet these choices by chance, here all of them meet.
#include "core/volume_data.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

struct NamedScene {
    std::string name;
    std::vector<std::string> settings;
};

std::vector<NamedScene> dozen() {
    const std::string lit = "shading.model=blinn_phong", unlit = "shading.model=none",
                      perspective = "camera.projection=perspective";
    const auto method = [](const std::string& name) { return "classification.method=" + name; };
    // Empty, opaque, and both at a sphere's surface.
    const std::string ball = "volume.procedural=sphere",
                      wall =
                          "transfer_function.points=[[0, 1, 1, 1, 0], [1500, 1, 0.5, 0.2, 0], [1800, 1, 0.5, "
                          "0.2, 1], [4095, 0.2, 0.4, 1, 1]]";
    return {
        {"pc", {unlit}},
        {"pc, lit", {lit, perspective, "shading.gradient=sobel", "shading.two_sided=true"}},
        {"pc, 8 bits, cut", {lit, "volume.bits=8", "clip.low=[5, 9, 3]", "clip.high=[21, 20.5, 17]"}},
        {"pc_mid, equation 9", {unlit, perspective, method("pc_mid"), "precision.preset=squeeze"}},
        {"pi2d, opaque, lit", {lit, ball, wall, method("pi2d"), "shading.model=phong"}},
        {"pi2d, eight bits", {unlit, method("pi2d_no_attenuation"), "precision.preset=eight_bit"}},
        {"pi1d", {lit, method("pi1d"), "compositing.form=alpha", "volume.spacing=[1, 0.7, 1.6]"}},
        {"pi1d_engel, inside", {unlit, method("pi1d_engel"), perspective, "camera.eye=[9, 12, 11]"}},
        {"pips, opaque, lit", {lit, ball, wall, perspective, method("pips"), "sampling.step=1.7"}},
        {"pips 3", {unlit, method("pips"), "classification.order=3", "sampling.step=0.6"}},
        {"leg, back to front", {lit, method("leg"), "compositing.form=back_to_front", "sampling.step=0.37"}},
        {"mip", {unlit, perspective, "compositing.mode=mip"}},
        {"average", {unlit, "compositing.mode=average", "volume.bits=8"}},
        {"depth, normals, gradients from samples",
         {lit, "shading.gradient=central_samples", "output.depth=true", "output.normals=true"}},
        {"float32", {lit, perspective, method("pips"), "precision.preset=float32"}},
    };
}

/// The same voxels elsewhere: nothing is kept for them.
std::shared_ptr<const Volume> fresh(const Volume& volume) {
    const std::size_t bytes = static_cast<std::size_t>(volume.voxels()) * volume.scalar_bytes();
    const std::shared_ptr<void> voxels = allocate_voxels(bytes, volume.name);
    std::memcpy(voxels.get(), volume.data.get(), bytes);
    Volume copy = volume;
    copy.data = voxels;
    return std::make_shared<const Volume>(copy);
}

TEST(SameBits, ADozenScenesHaveTheModelsBitsByEveryCombinationOfTheWaysToDrawThem) {
    int pictures = 0, failures = 0;
    for (const NamedScene& named : dozen()) {
        std::vector<std::string> settings{
            "volume.dims=[26, 23, 21]", "camera.height=28",    "image.width=24",          "image.height=24",
            "output.fixed=true",        "output.samples=true", "classification.method=pc"};
        settings.insert(settings.end(), named.settings.begin(), named.settings.end());
        const Scene scene = scene_with(built_in_scene(), settings);
        Plan plan = test::plan_of(scene);
        RenderOptions golden;
        golden.threads = 1, golden.path = Path::model;
        const Rendering model = render(plan, golden);
        ASSERT_GT(model.statistics.samples, 1000) << named.name;
        const std::string expected = picture_hash(model.image);
        for (const std::string& target : lanes::target_names())
            for (const int threads : {1, 2, 7})
                for (const int tile : {5, 8, 32})
                    for (const LayoutRule layout : {LayoutRule::linear, LayoutRule::cells})
                        for (const bool skip : {true, false}) {
                            // Its cells are built anew, by all threads at once.
                            plan.volume = fresh(*plan.volume);
                            RenderOptions options;
                            options.target = target, options.threads = threads, options.tile = tile;
                            options.layout = layout, options.skip = skip;
                            const Rendering found = render(plan, options);
                            ++pictures;
                            EXPECT_EQ(found.statistics.path, "lanes") << named.name;
                            if (picture_hash(found.image) == expected) continue;
                            ADD_FAILURE() << named.name << ": target " << target << ", threads " << threads
                                          << ", tile " << tile << ", " << found.statistics.layout
                                          << (skip ? ", " : ", without skipping, ") << found.statistics.why
                                          << "; settings " << fmt::format("{}", settings);
                            ASSERT_LT(++failures, 5);
                        }
    }
    RecordProperty("pictures", pictures);
}

}  // namespace
}  // namespace squint
