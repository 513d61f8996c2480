// Preset `float32`: the same stages in float32 words, in lanes, and how near they come to `real`.
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

Plan plan_with(const std::string& preset, std::vector<std::string> overrides) {
    for (const char* common :
         {"volume.procedural=sphere", "volume.dims=33", "image.width=32", "image.height=32",
          "transfer_function.points=[[0,0.2,0.4,1,0],[4095,1,0.5,0.1,0.4]]", "sampling.termination=0"})
        overrides.push_back(common);
    overrides.insert(overrides.begin(), "classification.method=pc");
    overrides.push_back("precision.preset=" + preset);
    const Scene scene = scene_with(built_in_scene(), overrides);
    return test::plan_of(scene);
}

double largest_difference(const Image& a, const Image& b) {
    double largest = 0;
    for (const char* name : {"R", "G", "B", "A"})
        for (std::size_t i = 0; i < a.find(name)->values.size(); ++i)
            largest = std::max(largest, std::abs(double{a.find(name)->values[i]} - b.find(name)->values[i]));
    return largest;
}

TEST(Float32, RunsInLanes) {
    const Rendering picture = render(plan_with("float32", {}), {});
    EXPECT_EQ(picture.statistics.path, "lanes");
    EXPECT_EQ(picture.statistics.why.substr(0, 13), "float32 lanes");
}

TEST(Float32, MethodsWithoutFloatLanesRunInTheModelAndSayWhy) {
    const Rendering picture =
        render(plan_with("float32", {"classification.method=leg", "classification.order=2"}), {});
    EXPECT_EQ(picture.statistics.path, "model");
    EXPECT_NE(picture.statistics.why.find("float32: moments"), std::string::npos) << picture.statistics.why;
}

// 33 voxels a side: a location errs by 3 roundings of 2^-19 voxels, and the field rises by 4095 levels within
// 4 of them at most; with the three lerps' 2^-13 a sample errs by 1 / 160 of a level.  The ramp of 4095
// levels makes 2e-6 of it in colour and 6e-7 in opacity, and the composite of 57 slabs sees the opacities'
// errors times what T leaves of them: together below 2e-5.
TEST(Float32, ComesToDoubleAsNearAsFloatsDo) {
    const auto compare = [](const std::string& method, const std::string& form, const std::string& shading) {
        const std::vector<std::string> same{"classification.method=" + method,
                                            "classification.table_size=256", "compositing.form=" + form,
                                            "shading.model=" + shading};
        const Image floats = render(plan_with("float32", same), {}).image;
        const Image doubles = render(plan_with("real", same), {}).image;
        EXPECT_LE(largest_difference(floats, doubles), 2e-5) << method << ' ' << form << ' ' << shading;
    };
    for (const char* method : {"pc", "pc_mid", "pi2d", "pi1d", "pi1d_engel", "pips"})
        for (const char* shading : {"none", "phong", "blinn_phong"}) compare(method, "w", shading);
    for (const char* form : {"equation_9", "alpha", "back_to_front", "unit255_blinn"})
        compare("pc", form, "none");
}

}  // namespace
}  // namespace squint
