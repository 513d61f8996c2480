// The presets, and the page that lists them.
#include "pipeline/stages/presets.h"

#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <sstream>

namespace squint {
namespace {

TEST(Presets, ThePageHoldsTheTableOfEveryWire) {
    std::ifstream file(SQUINT_SOURCE_DIR "/docs/pipeline.md");
    std::stringstream page;
    page << file.rdbuf();
    EXPECT_NE(page.str().find(preset_table_markdown()), std::string::npos)
        << "write this into docs/pipeline.md:\n"
        << preset_table_markdown();
}

// A wire that a stage forgets would have a format of no bits.
TEST(Presets, EveryWireIsSaidOnceByItsOwnStage) {
    const std::array<std::pair<const char*, std::vector<WireFormats>>, 6> stages{
        {{"sample location", location_wires({})},
         {"interpolation", interpolation_wires({})},
         {"gradient", gradient_wires({})},
         {"classification", classification_wires({})},
         {"shading", shading_wires({})},
         {"compositing", compositing_wires({})}}};
    std::array<int, kWires> said{};
    for (const auto& [stage, wires] : stages)
        for (const WireFormats& formats : wires) {
            EXPECT_EQ(info(formats.wire).stage, stage) << info(formats.wire).name;
            ++said[static_cast<std::size_t>(formats.wire)];
        }
    for (int i = 0; i < kWires; ++i)
        EXPECT_EQ(said[static_cast<std::size_t>(i)], 1) << info(static_cast<Wire>(i)).name;
}

TEST(Presets, SqueezeIsThePaperToTheLetter) {
    WireSpecs w;
    ASSERT_TRUE(preset_specs("squeeze", {}, w));
    // Section 5's table, and the conventions for what it leaves out.
    EXPECT_EQ(to_string(w[Wire::location]), "u11.12 trn sat");
    EXPECT_EQ(to_string(w[Wire::direction]), "s1.12 trn sat");
    EXPECT_EQ(to_string(w[Wire::sample]), "u12.12 trn sat");
    EXPECT_EQ(to_string(w[Wire::classification_input]), "u12.0 trn sat");
    EXPECT_EQ(to_string(w[Wire::normal]), "s1.12 trn sat");
    EXPECT_EQ(to_string(w[Wire::lit_color]), "u1.15 trn sat");
    EXPECT_EQ(to_string(w[Wire::transparency]), "u1.15 trn sat");
    EXPECT_EQ(preset_form("squeeze"), CompositingForm::equation_9);
}

TEST(Presets, WideKeepsNineBitsAndTheRaysOwnInTablesAndCompositing) {
    for (int ray_bits = 1; ray_bits <= 13; ++ray_bits) {
        WireSpecs w;
        ASSERT_TRUE(preset_specs("wide", {.ray_bits = ray_bits}, w));
        for (const Wire wire : {Wire::table_alpha, Wire::table_color, Wire::slab_alpha, Wire::contribution,
                                Wire::color, Wire::transparency})
            EXPECT_GE(w[wire].format.fraction_bits, 9 + ray_bits) << info(wire).name;
    }
}

// docs/conventions.md: `default` rounds halves to even.  Interpolation rounds them up, so that a lerp seen from
// its other end is the same number (docs/math.md#c2; docs/decisions/0002).
// Interpolation and what tables give back, the input that asks them included: docs/decisions/0002.
TEST(Presets, DefaultRoundsHalvesToEvenButInInterpolationAndLookups) {
    WireSpecs w;
    ASSERT_TRUE(preset_specs("default", {}, w));
    for (int i = 0; i < kWires; ++i) {
        const auto wire = static_cast<Wire>(i);
        const bool stored = wire == Wire::table_color || wire == Wire::table_alpha ||
                            wire == Wire::table_extinction || wire == Wire::table_moment;
        const bool up = wire == Wire::weight || info(wire).stage == "interpolation" ||
                        (info(wire).stage == "classification" && !stored);
        EXPECT_EQ(w[wire].rounding, up ? Rounding::rnd : Rounding::rnd_conv) << info(wire).name;
    }
}

TEST(Presets, DefaultFollowsTheStepWhereThirtyTwoBitsHoldNoMore) {
    const auto bits = [](double step, int ray_bits) {
        return accumulating_bits({.ray_bits = ray_bits, .step = step});
    };
    EXPECT_EQ(bits(1, 9), 15);
    EXPECT_EQ(bits(0.5, 10), 15);
    EXPECT_EQ(bits(0.25, 11), 20);
    EXPECT_EQ(bits(0.25, 4), 15);
    EXPECT_EQ(bits(1, 13), 22);
    EXPECT_EQ(bits(0.001, 20), kMostChosenFractionBits);
    WireSpecs w;
    ASSERT_TRUE(preset_specs("default", {.ray_bits = 11, .total_depth_bits = 5, .step = 0.25}, w));
    for (const Wire wire :
         {Wire::table_alpha, Wire::table_extinction, Wire::slab_depth, Wire::slab_alpha, Wire::slab_color,
          Wire::lit_color, Wire::contribution, Wire::color, Wire::transparency})
        EXPECT_GE(w[wire].format.fraction_bits, 20) << info(wire).name;
}

// White fog, one ray through 128 voxels of it, 0.3 to 0.9 opaque.  60 dB is an error of 0.001, and N
// roundings of half a last bit of 9 + log2(N) bits are 2^-10.  At steps of 1/2 and 1, in 15 bits, fog has 60
// dB where its opacity's own rounding allows (docs/measurements/rounding.md).
TEST(Presets, DefaultKeepsSixtyDecibelsOfFogAtEveryStep) {
    for (const double opacity : {0.003, 0.01, 0.02})
        for (const char* method : {"pc", "pips"})
            for (const double step : {0.25, 0.125, 0.0625, 0.03125}) {
                const auto pixel_with = [&](const std::string& preset) {
                    const Scene scene = scene_with(
                        built_in_scene(),
                        {"volume.procedural=constant", "volume.dims=129", "transfer_function.unit_distance=1",
                         fmt::format("transfer_function.points=[[0,1,1,1,{0}],[255,1,1,1,{0}]]", opacity),
                         "camera.azimuth=0", "camera.elevation=0", "camera.height=0.1", "image.width=1",
                         "image.height=1", "shading.model=none", fmt::format("sampling.step={}", step),
                         fmt::format("classification.method={}", method), "precision.preset=" + preset});
                    const auto volume = test::volume_of(scene);
                    RenderOptions options;
                    options.threads = 1;
                    const Image image = render(make_plan(scene, volume), options).image;
                    return std::array<double, 2>{image.find("A")->values[0], image.find("R")->values[0]};
                };
                const auto fixed = pixel_with("default"), real = pixel_with("real");
                EXPECT_GT(real[0], 0.3);
                for (const std::size_t channel : {0u, 1u})
                    EXPECT_NEAR(fixed[channel], real[channel], 0.001)
                        << opacity << ' ' << method << " step " << step;
            }
}

TEST(Presets, AnUnknownNameIsRefused) {
    WireSpecs w;
    EXPECT_FALSE(preset_specs("defualt", {}, w));
}

// Squeeze, section 2.
TEST(Presets, EarlierSystemsHaveTheBitsThatTheirPapersSay) {
    WireSpecs volumepro, vizard2, ultravis;
    ASSERT_TRUE(preset_specs("volumepro", {}, volumepro));
    ASSERT_TRUE(preset_specs("vizard2", {}, vizard2));
    ASSERT_TRUE(preset_specs("ultravis", {.scalar_bits = 8, .entry_bits = 8}, ultravis));
    for (int i = 0; i < kWires; ++i) {
        const auto wire = static_cast<Wire>(i);
        EXPECT_LE(volumepro[wire].format.fraction_bits, 12) << info(wire).name;
    }
    EXPECT_EQ(to_string(volumepro[Wire::sample]), "u12.0 trn sat");
    EXPECT_EQ(to_string(vizard2[Wire::table_color]), "u0.8 trn sat");
    EXPECT_EQ(to_string(vizard2[Wire::table_alpha]), "u0.16 trn sat");
    EXPECT_EQ(to_string(vizard2[Wire::transparency]), "u1.15 trn sat");
    EXPECT_EQ(to_string(ultravis[Wire::sample]), "u8.0 trn sat");
    EXPECT_EQ(to_string(ultravis[Wire::color]), "u1.15 trn sat");
    for (const char* name : {"volumepro", "vizard2", "ultravis"})
        EXPECT_EQ(preset_form(name), CompositingForm::equation_9) << name;
}

}  // namespace
}  // namespace squint
