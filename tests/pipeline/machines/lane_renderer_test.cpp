// The lanes' own ways through a picture against the plain ones: the same bits.
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace squint {
namespace {

/// A picture of a volume loaded for it alone, so that no other's cells are kept for it.
Rendering rendered(std::vector<std::string> overrides, const RenderOptions& options) {
    overrides.insert(overrides.begin(), "classification.method=pc");
    const Scene scene = scene_with(built_in_scene(), overrides);
    return render(test::plan_of(scene), options);
}

TEST(LaneRenderer, TakesTheSameBitsFromCellsWhateverRoomTheyHave) {
    // 27 blocks of 8 x 8 x 8 cells of 16 bytes, the last ones cut by the volume's faces.
    const std::vector<std::string> small{"volume.dims=[21, 18, 23]", "image.width=40", "image.height=36"};
    constexpr std::int64_t kBlockBytes = 8192;
    constexpr std::int64_t kTables = 27 * 4 + 150 * 5;  // of cells, and of 5 x 5 x 6 blocks that may be empty
    for (const char* shading : {"none", "blinn_phong"})
        for (const char* method : {"pc", "pips"}) {
            std::vector<std::string> overrides = small;
            overrides.push_back(std::string("shading.model=") + shading);
            overrides.push_back(std::string("classification.method=") + method);
            RenderOptions options;
            options.layout = LayoutRule::linear;
            const std::string expected = picture_hash(rendered(overrides, options).image);
            options.layout = LayoutRule::cells;
            for (const std::int64_t room : {std::int64_t{0}, kTables + kBlockBytes,
                                            kTables + 5 * kBlockBytes + 17, kTables + 1000 * kBlockBytes})
                for (const bool skip : {true, false}) {
                    options.layout_bytes = room, options.skip = skip;
                    const Rendering cells = rendered(overrides, options);
                    EXPECT_EQ(picture_hash(cells.image), expected) << shading << ' ' << method << ' ' << room;
                    EXPECT_EQ(cells.statistics.layout.substr(0, 5), "cells");
                    EXPECT_LE(cells.statistics.bytes, room);
                }
        }
}

// A lane holds 31 bits and a sign; the sum of a slab's two ends has one bit more than a gradient.
TEST(LaneRenderer, LeavesGradientsThatAreWiderThanALaneToTheModel) {
    const auto with = [](const char* gradient, const char* method, const char* inside) {
        return std::vector<std::string>{"volume.procedural=shells",
                                        "volume.dims=32",
                                        std::string("precision.gradient=") + gradient,
                                        std::string("classification.method=") + method,
                                        std::string("shading.inside=") + inside,
                                        "image.width=48",
                                        "image.height=48"};
    };
    RenderOptions lanes;
    lanes.path = Path::lanes;
    // A mean is kept as a sum, of one bit more; between two places a difference is multiplied.
    for (const auto& [method, inside, widest, too_wide, why] :
         {std::tuple{"pc", "front", "s12.19", "s12.20", "s12.20 is wider than a lane's"},
          std::tuple{"pips", "mean", "s12.18", "s12.19", "s12.19 is wider than a lane's"},
          std::tuple{"pips", "two_point", "s12.19", "s12.20", "factors of 33 bits"}}) {
        RenderOptions model;
        model.path = Path::model;
        EXPECT_EQ(picture_hash(rendered(with(widest, method, inside), lanes).image),
                  picture_hash(rendered(with(widest, method, inside), model).image))
            << method;
        try {
            rendered(with(too_wide, method, inside), lanes);
            ADD_FAILURE() << method << ": " << too_wide << " was taken by lanes";
        } catch (const std::exception& refused) {
            EXPECT_THAT(refused.what(), testing::HasSubstr(std::string("gradient: ") + why)) << method;
        }
        EXPECT_EQ(picture_hash(rendered(with(too_wide, method, inside), {}).image),
                  picture_hash(rendered(with(too_wide, method, inside), model).image))
            << method;
    }
}

/// The model's picture and the lanes', which must take the scene.
void expect_lanes_to_have_the_models_bits(const std::vector<std::string>& overrides) {
    const auto text = [&] {
        std::string all;
        for (const std::string& o : overrides) all += o + ' ';
        return all;
    };
    RenderOptions options;
    options.path = Path::model;
    const std::string expected = picture_hash(rendered(overrides, options).image);
    options.path = Path::lanes;
    for (const bool skip : {true, false}) {
        options.skip = skip;
        EXPECT_EQ(picture_hash(rendered(overrides, options).image), expected) << text() << skip;
    }
}

TEST(LaneRenderer, ProjectsMipMinipAndAverage) {
    for (const char* mode : {"mip", "minip", "average"})
        for (const char* method : {"pc", "pc_mid", "pi2d", "pips", "pi1d"})
            for (const char* form : {"w", "back_to_front", "unit255_shift"})
                expect_lanes_to_have_the_models_bits(
                    {"volume.procedural=shells", "volume.dims=[19, 24, 29]", "image.width=21",
                     "image.height=18", "output.samples=true", std::string("compositing.mode=") + mode,
                     std::string("classification.method=") + method,
                     std::string("compositing.form=") + form});
}

void expect_skipping_to_change_no_bit(const std::vector<std::string>& settings) {
    RenderOptions options;
    options.path = Path::lanes;
    const Rendering skipped = rendered(settings, options);
    options.skip = false;
    const Rendering all = rendered(settings, options);
    EXPECT_EQ(picture_hash(skipped.image), picture_hash(all.image));
    EXPECT_EQ(skipped.statistics.samples, all.statistics.samples);
    EXPECT_LT(skipped.statistics.visited, all.statistics.visited);
}
TEST(LaneRenderer, LeavesOutWhatCannotBeAMaximumThatIsSeen) {
    expect_skipping_to_change_no_bit({"volume.procedural=shells", "volume.dims=64", "image.width=32",
                                      "image.height=32", "compositing.mode=mip"});
}
TEST(LaneRenderer, LeavesOutEmptySpaceBackToFront) {
    for (const char* method : {"pc", "pips"})
        expect_skipping_to_change_no_bit({"volume.procedural=phantom", "volume.dims=64", "image.width=32",
                                          "image.height=32", "shading.model=none",
                                          "compositing.form=back_to_front",
                                          std::string("classification.method=") + method});
}

TEST(LaneRenderer, NotesDepthAndTheFirstVisibleSlabsNormal) {
    for (const char* channel : {"output.depth=true", "output.normals=true"})
        for (const char* method : {"pc", "pips"})
            for (const char* form : {"w", "alpha", "back_to_front", "unit255_shift"})
                expect_lanes_to_have_the_models_bits({"volume.procedural=shells", "volume.dims=[19, 24, 29]",
                                                      "image.width=21", "image.height=18",
                                                      "shading.model=blinn_phong", channel,
                                                      std::string("classification.method=") + method,
                                                      std::string("compositing.form=") + form});
}

// What is seen first does not depend on whether its depth is asked for.
TEST(LaneRenderer, GivesTheSameNormalsWithAndWithoutDepth) {
    for (const Path path : {Path::model, Path::lanes}) {
        const std::vector<std::string> scene{
            "volume.procedural=shells",  "volume.dims=24",     "image.width=24", "image.height=24",
            "shading.model=blinn_phong", "output.normals=true"};
        std::vector<std::string> with_depth = scene;
        with_depth.emplace_back("output.depth=true");
        RenderOptions options;
        options.path = path;
        const Image alone = rendered(scene, options).image, both = rendered(with_depth, options).image;
        for (const char* name : {"N.x", "N.y", "N.z"})
            EXPECT_EQ(alone.find(name)->values, both.find(name)->values) << name;
    }
}

TEST(LaneRenderer, MakesGradientsOfSamples) {
    for (const char* dims : {"[19, 24, 29]", "[19, 1, 23]", "[1, 21, 22]"})
        for (const char* method : {"pc", "pips"})
            for (const char* wire :
                 {"precision.weight=u1.7", "precision.location=u6.24", "precision.sample=u8.20"})
                expect_lanes_to_have_the_models_bits(
                    {"volume.procedural=shells", std::string("volume.dims=") + dims, "volume.bits=8",
                     "volume.spacing=[1, 1.3, 0.8]", "image.width=21", "image.height=18",
                     "shading.model=blinn_phong", "shading.gradient=central_samples",
                     std::string("classification.method=") + method, wire});
}

TEST(LaneRenderer, TakesVolumesOneVoxelThick) {
    for (const char* dims : {"[1, 20, 20]", "[20, 1, 20]", "[20, 20, 1]", "[1, 1, 20]", "[1, 1, 1]"})
        for (const char* shading : {"none", "blinn_phong"})
            expect_lanes_to_have_the_models_bits({std::string("volume.dims=") + dims, "image.width=20",
                                                  "image.height=20",
                                                  std::string("shading.model=") + shading});
}

}  // namespace
}  // namespace squint
