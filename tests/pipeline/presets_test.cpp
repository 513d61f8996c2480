// The presets, and the page that lists them.
#include "pipeline/presets.h"

#include <gtest/gtest.h>

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

TEST(Presets, AnUnknownNameIsRefused) {
    WireSpecs w;
    EXPECT_FALSE(preset_specs("defualt", {}, w));
}

}  // namespace
}  // namespace squint
