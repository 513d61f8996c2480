// The profile of a picture: what it says of each wire is what the formats that it names then do.
#include "studies/sweep/profile.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

namespace squint {
namespace {

using Json = nlohmann::ordered_json;

Scene small_scene(const char* method) {
    Scene scene = built_in_scene();
    scene = scene_with(scene, {"volume.dims=24", "image.width=24", "image.height=24", "camera.height=26",
                               "lights=[]", std::string("classification.method=") + method});
    return scene;
}

struct Profiled {
    Certificate certificate;
    Json wires;
};
Profiled profile(const Scene& scene, const std::shared_ptr<const Volume>& volume) {
    const Plan plan = make_plan(scene, volume);
    RenderOptions options;
    options.audit = true;
    const Rendering rendering = render(plan, options);
    const Certificate certificate = certify(plan);
    return {certificate, sweep::profile_of(plan, rendering.statistics, certificate)};
}

int width_of(const Json& format) {
    Spec spec;
    EXPECT_EQ(parse_spec(format.get<std::string>(), spec), "");
    return spec.format.width();
}

TEST(Profile, FormatsThatAreEnoughKeepTheBudgetAndOverflowNowhere) {
    for (const char* method : {"pc", "pips"}) {
        Scene scene = small_scene(method);
        const auto volume = test::volume_of(scene);
        const Profiled before = profile(scene, volume);
        int held = 0, enough = 0;
        for (const auto& [name, wire] : before.wires.items()) {
            if (!wire.contains("enough")) continue;
            held += width_of(wire["format"]), enough += width_of(wire["enough"]);
            const auto at = std::find_if(kWireInfo.begin(), kWireInfo.end(),
                                         [&name = name](const WireInfo& w) { return w.name == name; });
            ASSERT_NE(at, kWireInfo.end()) << name;
            scene.precision.override_[static_cast<std::size_t>(at - kWireInfo.begin())] =
                wire["enough"].get<std::string>();
        }
        EXPECT_LT(enough, held) << method;
        const Profiled after = profile(scene, volume);
        const double budget = scene.precision.budget;
        // No pixel has the greatest share of every wire.
        EXPECT_LE(after.certificate.most_decided, budget) << method;
        EXPECT_GT(after.certificate.most_decided, budget / 10) << method;
        for (const auto& [name, wire] : after.wires.items()) {
            if (before.wires[name]["saturated"] == 0) {
                EXPECT_EQ(wire["saturated"], 0) << method << ' ' << name;
            }
            EXPECT_EQ(wire["wrapped"], 0) << method << ' ' << name;
        }
    }
}

// The page's first line counts the same bits, and says what no certificate is there for.
TEST(Profile, TheFirstLineSaysWhatIsProvenAndWhatOverflows) {
    Scene scene = small_scene("pc");
    const auto volume = test::volume_of(scene);
    scene.precision.override_[static_cast<std::size_t>(Wire::color)] = "u0.6";
    const Plan plan = make_plan(scene, volume);
    RenderOptions options;
    options.audit = true;
    const Rendering rendering = render(plan, options);
    const Json none = sweep::profile_data(plan, rendering, std::string("this has no bound"), "squint render");
    EXPECT_NE(none["answer"]["text"].get<std::string>().find("No bound is proven."), std::string::npos);
    EXPECT_NE(none["not_measured"].dump().find("this has no bound"), std::string::npos);
    const Json proven = sweep::profile_data(plan, rendering, certify(plan), "squint render");
    EXPECT_EQ(proven["answer"]["good"], false) << "six bits of colour";
    EXPECT_EQ(proven["points"][0]["audit"].size(), none["points"][0]["audit"].size());
}

}  // namespace
}  // namespace squint
