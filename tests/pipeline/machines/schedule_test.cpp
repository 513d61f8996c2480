// How batches are cut: the order is the composition's, and a schedule says what it misses.
#include "pipeline/machines/lanes/schedule.h"

#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/render.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"
#include "scene/scene.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace squint::lanes {
namespace {

using namespace HWY_NAMESPACE;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Plan plan_with(std::vector<std::string> settings) {
    for (const char* common :
         {"volume.dims=16", "image.width=64", "image.height=64", "classification.method=pc"})
        settings.insert(settings.begin(), common);
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}

Schedule schedule_with(const std::vector<std::string>& settings, bool in_cells = true) {
    static constexpr std::uint8_t kSomewhere = 0;
    const Plan plan = plan_with(settings);
    VoxelSource source;
    source.volume = plan.volume.get();
    source.cells = in_cells ? &kSomewhere : nullptr;
    return schedule_of(plan, kernels_for(plan, ways_of(plan), source, find_target("")));
}

/// Whether this machine has vectors: plain C++ has no kernels of two stages.
bool has_vectors() {
    return find_target("") < HWY_EMU128;
}

/// Hears which parts the composition enters, each once in a row.
struct Parts : Silent {
    std::vector<Part> heard;
    void at(Part part) {
        if (heard.empty() || heard.back() != part) heard.push_back(part);
    }
};

TEST(Schedule, RunsThePartsOfTheCompositionInItsOrder) {
    const Plan plan = plan_with({"shading.model=blinn_phong", "shading.inside=front"});
    // A slab that is seen: the composition enters every part.
    std::vector<Part> whole;
    for (int y = 0; y < 64 && whole.size() < 8; ++y) {
        const RaySetup ray = plan.set_up(32, y);
        const RayWords<std::int64_t> words = ray_words<std::int64_t>(plan, ray);
        const FromVolume voxels{*plan.volume};
        std::visit(
            [&](const auto& method) {
                for (int k = 0; k < ray.slabs; ++k) {
                    Parts parts;
                    Slabs<std::int64_t, std::decay_t<decltype(method)>, FromVolume, Parts> slabs(
                        plan, method, voxels, words, ray.slabs, parts);
                    slabs.step(k);
                    if (parts.heard.size() > whole.size()) whole = parts.heard;
                }
            },
            plan.method);
    }
    const Schedule schedule = schedule_with({"shading.model=blinn_phong", "shading.inside=front"});
    std::vector<Part> scheduled;
    for (const auto* segments : {&schedule.ahead, &schedule.now})
        for (const Segment segment : *segments)
            for (const Part part : parts_of(segment)) scheduled.push_back(part);
    EXPECT_EQ(scheduled, whole);
    EXPECT_EQ(whole.size(), 8U);
}

TEST(Schedule, TheDefaultUnlitRunsTheFastestKernels) {
    if (!has_vectors()) GTEST_SKIP();
    const Schedule schedule = schedule_with({"shading.model=none"});
    EXPECT_EQ(schedule.name, "locate+address|fetch+interpolate.u16|classify+composite.unit15");
    EXPECT_THAT(schedule.missed, IsEmpty());
    EXPECT_THAT(schedule.ahead, ElementsAre(Segment::locate_address));
}

TEST(Schedule, FineStepsAskForNoWideLanesOfClassification) {
    if (!has_vectors()) GTEST_SKIP();
    const auto fine = [](const char* method) {
        return schedule_with({"shading.model=none", "sampling.step=0.2", "classification.table_size=64",
                              std::string("classification.method=") + method});
    };
    EXPECT_THAT(fine("pc").name, HasSubstr("classify+composite.unit26"));
    for (const char* method : {"pips", "pi2d", "pi1d"}) {
        const Schedule schedule = fine(method);
        EXPECT_THAT(schedule.name, HasSubstr("composite.unit26"));
        EXPECT_THAT(schedule.missed, ElementsAre(HasSubstr("composite.unit26"))) << schedule.name;
    }
}

// A joined colour is a mean of its pieces' colours, and no brighter than they are: intervals know.
TEST(Schedule, SecondLooksKeepTheCompositingOfUnits) {
    if (!has_vectors()) GTEST_SKIP();
    const Schedule schedule = schedule_with({"shading.model=none", "classification.method=pips",
                                             "transfer_function.points=[[0,1,1,1,0],[1000,1,1,1,1]]"});
    EXPECT_THAT(schedule.name, HasSubstr("look_twice"));
    EXPECT_THAT(schedule.name, HasSubstr("composite.unit15"));
}

// Places of light divide depths of a whole function by each other; they ask for no wide lanes.
TEST(Schedule, PlacesOfLightKeepTheLanesOfSlabsThatAreNotLit) {
    const auto bits = [](const char* model) {
        return ways_of(plan_with({std::string("shading.model=") + model, "shading.inside=two_point",
                                  "classification.method=pips",
                                  "transfer_function.points=[[0,1,1,1,0],[1000,1,1,1,0.9],[2000,1,1,1,1]]"}))
            .classification.bits;
    };
    EXPECT_EQ(bits("none"), 32);
    EXPECT_EQ(bits("blinn_phong"), 32);
}

TEST(Schedule, SaysWhichKernelItMissesAndWhy) {
    if (!has_vectors()) GTEST_SKIP();
    EXPECT_THAT(schedule_with({"shading.model=none"}, false).missed,
                ElementsAre("fetch: the volume lies as it is"));
    EXPECT_THAT(schedule_with({"shading.model=none", "compositing.form=alpha"}).missed,
                ElementsAre(AllOf(HasSubstr("composite"), HasSubstr("form has another value"))));
    EXPECT_THAT(
        schedule_with(
            {"shading.model=none",
             "transfer_function.points=[[0, 0, 0, 1, 0.1], [900, 0, 0, 1, 0.1], [901, 1, 0, 0, 0.1]]"})
            .missed,
        ElementsAre("classify+composite.unit15: rows do not fit 16 bits"));
}

TEST(Schedule, AProjectionClassifiesNoSlab) {
    const Schedule schedule = schedule_with({"compositing.mode=mip", "shading.model=none"});
    EXPECT_EQ(schedule.now.back(), Segment::project);
    EXPECT_THAT(schedule.name, Not(HasSubstr("classify")));
}

TEST(Schedule, IsReportedWithThePictureAndWithThePlan) {
    const Plan plan = plan_with({"shading.model=none"});
    const Schedule schedule = schedule_with({"shading.model=none"});
    EXPECT_THAT(render(plan).statistics.why, HasSubstr("schedule " + schedule.name));
    EXPECT_THAT(words_in_lanes(plan), HasSubstr("schedule " + schedule.name));
    EXPECT_THAT(words_in_lanes(plan), Not(HasSubstr("lit cells")));
}

TEST(Schedule, APlanSaysWhyItHasNoLitCells) {
    if (!has_vectors()) GTEST_SKIP();
    const auto words = [](const std::vector<std::string>& settings) {
        return words_in_lanes(plan_with(settings));
    };
    EXPECT_THAT(words({}), HasSubstr("; lit cells once they pay"));
    EXPECT_THAT(words({"volume.bits=16"}), HasSubstr("; no lit cells: voxels have 16 bits"));
    EXPECT_THAT(words({"shading.gradient=sobel"}), HasSubstr("; no lit cells: rule has another value"));
}

}  // namespace
}  // namespace squint::lanes
