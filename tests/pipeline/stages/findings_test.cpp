// A picture that is empty, or of two values, has a line in the plan that says why; no other has one.
#include "pipeline/plan/findings.h"

#include "core/error.h"
#include "tests/truth/reference_cases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace squint {
namespace {

using namespace cases;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Values -1000 to 1200, as of a CT.
std::shared_ptr<const Volume> ct() {
    Volume v =
        *volume_of({9, 8, 7}, 12, Vec3(1), [](const Index3& p) { return (p.x + p.y + p.z) * 2200 / 21; });
    v.value_offset = -1000;
    return std::make_shared<const Volume>(v);
}

std::vector<std::string> found(const Scene& scene) {
    return findings_of(make_plan(scene, ct()));
}

Scene ct_scene() {
    Scene scene = plain_scene(8, 8);
    scene.transfer_function.points = {{0, 1, 0.5, 0, 0}, {1000, 1, 1, 1, 0.5}};
    return scene;
}

TEST(Findings, AnOrdinarySceneHasNone) {
    EXPECT_THAT(found(ct_scene()), IsEmpty());
    Scene surface = ct_scene();
    surface.transfer_function.points = {{300, 1, 1, 1, 0}, {301, 1, 1, 1, 1}};
    EXPECT_THAT(found(surface), IsEmpty()) << "one colour beyond a threshold is meant";
    Scene steps = ct_scene();
    steps.transfer_function.points = {
        {-500, 1, 0, 0, 0}, {-500, 1, 0, 0, 0.1}, {500, 0, 0, 1, 0.1}, {500, 0, 0, 1, 1}};
    EXPECT_THAT(found(steps), IsEmpty());
}

TEST(Findings, AClipBoxBesideTheVolume) {
    for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true}) {
            Scene scene = ct_scene();
            Vec3 corner(high ? -100.0 : 100.0);
            for (int other = 0; other < 3; ++other)
                if (other != axis) corner[other] = high ? 100 : -100;
            (high ? scene.clip.high : scene.clip.low) = corner;
            EXPECT_THAT(found(scene),
                        ElementsAre(AllOf(HasSubstr("clip: the box kept lies beside the volume"),
                                          HasSubstr(std::string("along ") + "xyz"[axis]),
                                          HasSubstr("the picture is empty"))));
        }
}

TEST(Findings, ACameraThatLooksElsewhere) {
    for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
        Scene scene = ct_scene();
        scene.camera.projection = projection;
        scene.camera.eye = Vec3(4, -50, 4), scene.camera.center = Vec3(4, -100, 4);
        EXPECT_THAT(found(scene), ElementsAre(HasSubstr("camera: the volume lies behind the eye")));
        scene.camera.center = Vec3(54, -49, 4);
        scene.camera.height = 10;
        EXPECT_THAT(found(scene),
                    ElementsAre(HasSubstr("camera: the volume lies beside what the picture shows")));
        scene.camera.center = Vec3(4, 0, 4);
        EXPECT_THAT(found(scene), IsEmpty());
        scene.camera.eye = Vec3(4, 4, 4), scene.camera.center = Vec3(5, 4, 4);
        EXPECT_THAT(found(scene), IsEmpty()) << "from inside";
    }
}

TEST(Findings, AFunctionOutsideTheData) {
    Scene scene = ct_scene();
    scene.transfer_function.points = {{5000, 1, 1, 1, 0}, {6000, 1, 1, 1, 0.5}};
    EXPECT_THAT(found(scene),
                ElementsAre(HasSubstr("no opacity is above 0 at the data's values, -1000 to 1200, only "
                                      "above 5000")));
    scene.transfer_function.points = {{-3000, 1, 1, 1, 0.5}, {-1000, 1, 1, 1, 0}};
    EXPECT_THAT(found(scene), ElementsAre(HasSubstr("only below -1000: the picture is empty")));
    scene.transfer_function.points = {{2000, 1, 1, 1, 0}, {2500, 1, 1, 1, 1}, {3000, 1, 1, 1, 0}};
    EXPECT_THAT(found(scene), ElementsAre(HasSubstr("only between 2000 and 3000: the picture is empty")));
    scene.transfer_function.points = {{0, 1, 1, 1, 0}};
    EXPECT_THAT(found(scene), ElementsAre(HasSubstr("every opacity is 0")));
    scene.transfer_function.points = {{1199, 1, 1, 1, 0}, {1201, 1, 1, 1, 1}};
    EXPECT_THAT(found(scene), IsEmpty()) << "the largest value is just seen";
}

TEST(Findings, AFunctionOfTwoValues) {
    Scene scene = ct_scene();
    scene.transfer_function.points = {{0, 0, 0, 0, 0}, {1, 1, 1, 1, 1}};
    EXPECT_THAT(found(scene),
                ElementsAre(AllOf(HasSubstr("it changes between 0 and 1 alone, 0.045 % of the data's values"),
                                  HasSubstr("transfer_function.range = \"data\" stretches it"))));
    scene.transfer_function.range.of_data = true;
    EXPECT_THAT(found(scene), IsEmpty());
}

TEST(Findings, RealTakesNoFormats) {
    Scene scene = ct_scene();
    scene.precision.override_[static_cast<std::size_t>(Wire::location)] = "u1.12";
    EXPECT_THROW(make_plan(scene, ct()), InputError);
    for (const char* preset : {"real", "float32"}) {
        scene.precision.preset = preset;
        EXPECT_NO_THROW(make_plan(scene, ct())) << preset;
    }
}

}  // namespace
}  // namespace squint
