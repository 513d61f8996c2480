// From a sample to table entries: exact where there is an entry a level, within its bound where not.
#include "core/procedural.h"
#include "fixedpoint/words.h"
#include "pipeline/classification/entries-inl.h"
#include "pipeline/plan/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;

Plan plan_of(int bits, int entries, const std::string& sample, const std::string& input) {
    Scene scene = built_in_scene();
    scene.classification.method = Method::pc;
    scene.transfer_function = {};
    scene.transfer_function.points = {{0, 1, 1, 1, 0.5}};
    scene.transfer_function.unit_distance = 1;
    scene.transfer_function.entries = entries;
    scene.precision.override_[static_cast<std::size_t>(Wire::sample)] = sample;
    scene.precision.override_[static_cast<std::size_t>(Wire::classification_input)] = input;
    return make_plan(
        scene, std::make_shared<Volume>(make_procedural(*find_procedural("ramp"), Index3(8, 8, 8), bits)));
}

TEST(ClassificationInput, AnEntryALevelTakesTheSampleAsItIs) {
    const Plan plan = plan_of(8, 256, "u8.6", "u8.6");
    for (Word sample = 0; sample <= 255 << 6; ++sample)
        ASSERT_EQ(classification_input(plan.input, sample), sample);
    EXPECT_EQ(classification_input(plan.input, Word{(255 << 6) + 63}), 255 << 6);  // no entry lies beyond
}

// Half a last bit from the wire; entries per level are rounded to 2^-20 of themselves.
TEST(ClassificationInput, OtherEntriesAreReachedWithinHalfALastBit) {
    for (const int bits : {5, 8, 12, 16})
        for (const int entries : {2, 3, 17, 256, 1000, 4096}) {
            const std::string sample = "u" + std::to_string(bits) + ".4";
            const Plan plan = plan_of(bits, entries, sample, "u12.10 rnd");
            const Word most = (Word{1} << (bits + 4)) - 16;
            for (Word s = 0; s <= most; s += std::max<Word>(1, most / 3000)) {
                const double exact = plan.entries.coordinate(static_cast<double>(s) / 16);
                const double found = static_cast<double>(classification_input(plan.input, s)) / 1024;
                ASSERT_NEAR(found, exact, 0.5 / 1024 + exact * 0x1p-20)
                    << bits << " bits, " << entries << " entries, sample " << s;
            }
        }
}

TEST(ClassificationInput, IntervalsHoldEveryInput) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 200; ++i) {
        const int fraction = static_cast<int>(random() % 9), entries = 2 + static_cast<int>(random() % 500);
        const Plan plan = plan_of(8, entries, "u8." + std::to_string(fraction),
                                  "u9." + std::to_string(random() % 12) + " trn");
        const Range all = classification_input(plan.input, Range{0, Word{255} << fraction});
        for (int j = 0; j < 200; ++j) {
            const Word sample = static_cast<Word>(random() % ((std::uint64_t{255} << fraction) + 1));
            const Word input = classification_input(plan.input, sample);
            ASSERT_TRUE(all.low <= input && input <= all.high);
        }
    }
}

}  // namespace
}  // namespace squint
