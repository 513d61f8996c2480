// From frame to frame only what changed is made anew: each picture has the bits of one made from nothing.
#include "pipeline/plan/kept_method.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

using Settings = std::vector<std::string>;

const Settings kBuiltIn{"volume.dims=[37, 29, 41]", "image.width=52", "image.height=47"};
const std::string kOtherFunction =
    "transfer_function.points=[[0, 1, 1, 1, 0], [2500, 1, 0.5, 0.2, 0], [2700, 1, 0.5, 0.2, 1], "
    "[4095, 0.2, 0.4, 1, 0.2]]";

Scene scene_of(const Settings& more) {
    Settings all = kBuiltIn;
    all.insert(all.end(), more.begin(), more.end());
    return scene_with(built_in_scene(), all);
}
std::shared_ptr<const Volume> volume_of(const Scene& scene) {
    return test::volume_of(scene);
}

// Each differs from the one before it in what its line says.
const std::vector<Settings>& frames() {
    static const std::vector<Settings> all{
        {},
        {"camera.azimuth=77"},
        {"camera.azimuth=77", "camera.projection=perspective"},
        {"camera.azimuth=-20", "shading.model=none"},
        {"camera.azimuth=-20", "shading.model=none", kOtherFunction},
        {"camera.azimuth=140", "shading.model=none", kOtherFunction},
        {"camera.azimuth=140", kOtherFunction, "image.width=80"},
        {"camera.azimuth=140", kOtherFunction, "image.width=52", "image.height=80"},
        {"camera.azimuth=141", kOtherFunction, "output.depth=true"},
        {"camera.azimuth=142", kOtherFunction, "output.depth=true", "output.normals=true"},
        {"camera.azimuth=143", kOtherFunction, "output.fixed=true"},
        {"camera.azimuth=144", kOtherFunction, "output.fixed=true", "clip.low=[0, 12, 0]"},
        {"camera.azimuth=145", kOtherFunction},
        {"sampling.step=0.7"},
        {"sampling.step=0.7", "precision.table_alpha=u1.11"},
        {"sampling.step=0.7", "precision.preset=squeeze"},
        {"sampling.step=0.7", "precision.preset=float32"},
        {"sampling.step=0.7", "precision.preset=real"},
        {"transfer_function.points=[[0, 1, 1, 1, 0], [4095, 1, 1, 1, 0]]"},
        {},
    };
    return all;
}

TEST(Frames, OneAfterAnotherTheyHaveTheBitsOfEachAlone) {
    for (const char* method : {"pc", "pi2d", "pi1d", "pips", "leg"})
        for (const Path path : {Path::automatic, Path::model}) {
            const auto volume = volume_of(scene_of({}));
            Rendering kept;
            for (const Settings& frame : frames()) {
                Settings settings = frame;
                settings.push_back(std::string("classification.method=") + method);
                settings.emplace_back("classification.table_size=64");
                const Scene scene = scene_of(settings);
                RenderOptions options;
                options.path = path, options.tile = 13, options.threads = 2;
                render(make_plan(scene, volume), options, kept);
                const Rendering alone = render(make_plan(scene, volume_of(scene)), options);
                EXPECT_EQ(picture_hash(kept.image), picture_hash(alone.image))
                    << method << ' ' << (frame.empty() ? "" : frame.back());
                EXPECT_EQ(kept.statistics.samples, alone.statistics.samples);
                EXPECT_EQ(kept.statistics.visited, alone.statistics.visited);
            }
        }
}

TEST(Frames, TheyKeepTheMemoryOfAPictureOfTheSameKind) {
    const Scene scene = scene_of({});
    const Plan plan = make_plan(scene, volume_of(scene));
    Rendering kept = render(plan);
    const float* place = kept.image.channels[0].values.data();
    render(make_plan(scene_of({"camera.azimuth=99"}), plan.volume), {}, kept);
    EXPECT_EQ(kept.image.channels[0].values.data(), place);
}

TEST(Frames, AnImageThatHeldOtherThingsIsReplaced) {
    const Scene scene = scene_of({});
    const Plan plan = make_plan(scene, volume_of(scene));
    const std::string expected = picture_hash(render(plan).image);
    Rendering kept = render(plan);
    kept.image.channels[1].values.pop_back();
    render(plan, {}, kept);
    EXPECT_EQ(picture_hash(kept.image), expected);
    kept.image.channels[2].words.assign(kept.image.channels[2].values.size(), 7);
    kept.image.channels[2].values.clear();
    kept.image.left = 3, kept.image.is_display = true;
    render(plan, {}, kept);
    EXPECT_EQ(picture_hash(kept.image), expected);
    EXPECT_EQ(kept.image.left, 0);
    EXPECT_FALSE(kept.image.is_display);
}

// The words of a table that a plan made and another took over.
TEST(Frames, TablesAreTakenOverWhereNothingTheyDependOnChanged) {
    const auto volume = volume_of(scene_of({}));
    const auto words = [&](const Settings& settings, const std::shared_ptr<const Volume>& of) {
        Settings pi2d = settings;
        pi2d.emplace_back("classification.method=pi2d");
        return std::get<PreIntegrated2D>(make_plan(scene_of(pi2d), of).method).cells.narrow_words();
    };
    const std::uint16_t* first = words({}, volume);
    EXPECT_EQ(words({"camera.azimuth=3", "image.width=20", "shading.kd=0.1"}, volume), first);
    EXPECT_NE(words({}, volume_of(scene_of({}))), first) << "another volume's";
    EXPECT_NE(words({"transfer_function.unit_distance=1.25"}, volume), first);
}

}  // namespace
}  // namespace squint
