// squint search --guarantee pictures: what it writes is proven, and what it proves is written.
#include "studies/search/by_certificate.h"
#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/scene_bound.h"
#include "tests/own_folder.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace squint::search {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ByCertificate : public ::testing::Test {
  protected:
    Settings small(double most_error) const {
        Settings s;
        s.overrides = {"volume.dims=16", "image.width=12", "image.height=10", "camera.height=16",
                       "lights=[]"};
        s.most_error = most_error, s.views = 2, s.threads = 1;
        s.folder = (folder / "run").string();
        return s;
    }
    const test::OwnFolder folder;
};

TEST_F(ByCertificate, WritesFormatsWhoseCertificatesHoldForEveryPicture) {
    for (const double most : {0.5, 2.0, 8.0}) {
        const Settings s = small(most);
        const CertifiedResult r = run_by_certificate(s);
        ASSERT_EQ(r.failure, "");
        EXPECT_LE(r.found.bound, most);
        EXPECT_GT(r.found.bound, most / 3) << "no more bits than asked for";
        EXPECT_LE(r.found.error, r.found.bound);
        EXPECT_EQ(r.pictures, 2u);
        // As a user reads them.
        std::vector<std::string> overrides = s.overrides;
        overrides.push_back("precision.preset=\"" + r.formats_file + "\"");
        overrides.push_back("camera.turntable=2");
        const Scene scene = scene_with(built_in_scene(), overrides);
        const auto volume = test::volume_of(scene);
        double worst = 0;
        for (int view = 0; view < 2; ++view)
            worst = std::max(worst, certify(make_plan(scene, volume, view)).most);
        EXPECT_DOUBLE_EQ(worst, r.found.bound);
    }
}

TEST_F(ByCertificate, WritesFormatsWhoseSceneBoundHoldsForEveryView) {
    Settings s = small(4);
    s.every_view = true;
    s.overrides.push_back("classification.method=pc");
    const CertifiedResult r = run_by_certificate(s);
    ASSERT_EQ(r.failure, "");
    EXPECT_LE(r.found.bound, 4);
    EXPECT_LE(r.found.error, r.found.bound);
    EXPECT_EQ(r.json["guarantee"], "scene");
    std::vector<std::string> overrides = s.overrides;
    overrides.push_back("precision.preset=\"" + r.formats_file + "\"");
    const Scene scene = scene_with(built_in_scene(), overrides);
    const auto volume = test::volume_of(scene);
    EXPECT_LE(bound_scene(make_plan(scene, volume)).most, r.found.bound);
}

TEST_F(ByCertificate, WritesFormatsForEveryViewOfALitScene) {
    Settings s = small(8);
    s.every_view = true;
    for (const char* override_ :
         {"classification.method=pc", "lights=[{headlight=true}]", "shading.gradient_floor=16"})
        s.overrides.emplace_back(override_);
    const CertifiedResult r = run_by_certificate(s);
    ASSERT_EQ(r.failure, "");
    EXPECT_LE(r.found.bound, 8);
    EXPECT_LE(r.found.error, r.found.bound);
}

TEST_F(ByCertificate, TakesFewerBitsForALooserBound) {
    double bits = INFINITY;
    for (const double most : {0.4, 1.0, 4.0, 16.0}) {
        const CertifiedResult r = run_by_certificate(small(most));
        EXPECT_LT(r.found.bits, bits) << most;
        bits = r.found.bits;
    }
}

TEST_F(ByCertificate, SaysWhoBindsWhereABoundCannotBeMet) {
    const CertifiedResult none = run_by_certificate(small(1e-9));
    EXPECT_THAT(none.failure, HasSubstr("--max-error: found 1e-09, but the nearest formats have a bound of"));
    EXPECT_THAT(none.failure, HasSubstr(" makes "));
    EXPECT_EQ(none.formats_file, "");
    EXPECT_FALSE(fs::exists(folder / "run" / "formats.toml"));
}

TEST_F(ByCertificate, RefusesWhatIsNotBoundedInOneLine) {
    Settings s = small(1);
    s.overrides.insert(s.overrides.end(), {"classification.method=pips", "classification.as_printed=true"});
    try {
        run_by_certificate(s);
        FAIL() << "a formula as printed was not refused";
    } catch (const InputError& error) {
        EXPECT_THAT(
            error.what(),
            HasSubstr("--guarantee pictures: the built-in scene: classification.as_printed is not bounded"));
    }
}

}  // namespace
}  // namespace squint::search
