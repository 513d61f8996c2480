#include "core/transfer_function.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace {

using namespace squint;
using testing::HasSubstr;

Volume volume_of_bits(int bits) {
    Volume volume;
    volume.scalar_bits = bits;
    return volume;
}

TransferFunction ramp() {
    TransferFunction function;
    function.color = {{0, {0, 0, 0}}, {100, {1, 0.5, 0}}};
    function.opacity = {{50, 0}, {150, 0.5}};
    return function;
}

std::string message(const TransferFunction& function) {
    try {
        check(function);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(TransferFunction, IsLinearBetweenPointsAndConstantOutside) {
    const TransferFunction function = ramp();
    EXPECT_EQ(function.color_at(25), Vec3(0.25, 0.125, 0));
    EXPECT_EQ(function.color_at(-7), Vec3(0, 0, 0));
    EXPECT_EQ(function.color_at(100), Vec3(1, 0.5, 0));
    EXPECT_EQ(function.color_at(1000), Vec3(1, 0.5, 0));
    EXPECT_EQ(function.alpha_at(50), 0);
    EXPECT_EQ(function.alpha_at(75), 0.125);
    EXPECT_EQ(function.alpha_at(1e9), 0.5);
}

TEST(TransferFunction, TwoPointsAtOneValueAreAStepAndTheLaterHoldsThere) {
    TransferFunction function = ramp();
    function.opacity = {{0, 0.25}, {10, 0.25}, {10, 1}, {20, 1}};
    EXPECT_EQ(function.alpha_at(std::nextafter(10, 0)), 0.25);
    EXPECT_EQ(function.alpha_at(10), 1);
    EXPECT_EQ(function.alpha_at(15), 1);
    function.opacity = {{0, 0.25}, {10, 0.5}, {10, 0.75}, {10, 0}};
    EXPECT_EQ(function.alpha_at(10), 0);
    function.opacity = {{10, 0.5}, {10, 0.75}};
    EXPECT_EQ(function.alpha_at(std::nextafter(10, 0)), 0.5);
    EXPECT_EQ(function.alpha_at(11), 0.75);
}

TEST(TransferFunction, ThereIsAnEntryForEveryLevelUpTo4096) {
    for (const auto& [bits, count] :
         {std::pair{1, 2}, std::pair{8, 256}, std::pair{12, 4096}, std::pair{16, 4096}}) {
        const Entries entries = sample_entries(ramp(), volume_of_bits(bits));
        EXPECT_EQ(entries.size(), count);
        EXPECT_EQ(entries.scalars_per_entry, ((1 << bits) - 1.0) / (count - 1));
        EXPECT_EQ(entries.coordinate((1 << bits) - 1), count - 1)
            << "the last entry stands at the largest scalar";
    }
    TransferFunction function = ramp();
    function.entries = 17;
    EXPECT_EQ(sample_entries(function, volume_of_bits(8)).size(), 17);
    EXPECT_EQ(sample_entries(function, volume_of_bits(8)).scalars_per_entry, 255.0 / 16);
}

TEST(TransferFunction, PointsAreInTheFilesUnits) {
    Volume volume = volume_of_bits(8);
    volume.value_scale = 2, volume.value_offset = -50;
    const Entries entries = sample_entries(ramp(), volume);
    EXPECT_EQ(entries.entry[50].alpha, 0);     // value 50
    EXPECT_EQ(entries.entry[75].alpha, 0.25);  // value 100
    EXPECT_EQ(entries.entry[25].color, Vec3(0, 0, 0));
    EXPECT_EQ(entries.entry[75].color, Vec3(1, 0.5, 0));
}

TEST(TransferFunction, ExtinctionGivesTheOpacityBackOverUnitDistance) {
    TransferFunction function = ramp();
    function.opacity = {{0, 0}, {255, 0.9}};
    function.unit_distance = 2.5;
    for (const Entry& entry : sample_entries(function, volume_of_bits(8)).entry) {
        EXPECT_NEAR(1 - std::exp(-entry.extinction * 2.5), entry.alpha,
                    4e-16);  // alpha below one and four roundings
        EXPECT_FALSE(entry.opaque);
    }
    const Entry clear = sample_entries(function, volume_of_bits(8)).entry[0];
    EXPECT_EQ(clear.extinction, 0);
    EXPECT_FALSE(std::signbit(clear.extinction));
}

TEST(TransferFunction, OnlyAnAlphaOfExactlyOneIsOpaqueAndEveryOtherIsCapped) {
    TransferFunction function = ramp();
    function.opacity = {{10, 0}, {10, 0.99999}, {20, 1}, {20, 1}, {30, 1}, {30, 0}};
    const Entries entries = sample_entries(function, volume_of_bits(8));
    const double cap = 12 * std::log(2);  // alpha = 1 - 2^-12
    for (int i = 10; i <= 30; ++i) {
        const Entry& entry = entries.entry[static_cast<std::size_t>(i)];
        EXPECT_EQ(entry.opaque, i >= 20 && i < 30) << i;
        if (i < 30) {
            EXPECT_NEAR(entry.extinction, cap, cap * 1e-15) << i;
        }
    }
    EXPECT_TRUE(entries.any_opaque());
    EXPECT_FALSE(sample_entries(ramp(), volume_of_bits(8)).any_opaque());
}

TEST(TransferFunction, WhatCannotBeSampledIsRefusedByName) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message(ramp()), "");
    TransferFunction f = ramp();
    f.name = "mine", f.color.clear();
    EXPECT_EQ(message(f), "mine, colour: no points, allowed is one or more");
    f = ramp(), f.opacity.clear();
    EXPECT_THAT(message(f), HasSubstr("opacity: no points"));
    f = ramp(), f.opacity[1].value = 49;
    EXPECT_THAT(message(f), HasSubstr("point 2: value 49 after 50, allowed is ascending"));
    f = ramp(), f.color[0].value = nan;
    EXPECT_THAT(message(f), HasSubstr("colour point 1: value nan is not finite"));
    for (const double bad : {nan, -0.1, 1.1}) {
        f = ramp(), f.opacity[0].alpha = bad;
        EXPECT_THAT(message(f), HasSubstr("opacity point 1: alpha")) << bad;
        f = ramp(), f.color[1].color.z = bad;
        EXPECT_THAT(message(f), HasSubstr("colour point 2")) << bad;
    }
    for (const double bad : {nan, 0.0, -1.0, std::numeric_limits<double>::infinity()}) {
        f = ramp(), f.unit_distance = bad;
        EXPECT_THAT(message(f), HasSubstr("unit_distance")) << bad;
    }
    for (const int bad : {-1, 1, 65537}) {
        f = ramp(), f.entries = bad;
        EXPECT_THAT(message(f), HasSubstr("allowed is 2 to 65536")) << bad;
    }
}

// A stretch between two points is sampled many entries at a time; a scale below zero runs through the points
// backwards.
TEST(TransferFunction, EntriesHaveTheBitsOfTheFunctionAtTheirValue) {
    TransferFunction function = ramp();
    function.color.push_back({100, {0.25, 0.75, 1}}), function.color.push_back({170.3, {0.1, 0.9, 0}});
    function.opacity.insert(function.opacity.begin(), {{-30, 0.9}, {-30, 0.1}, {49.9, 1.0 / 3}});
    for (const double scale : {1.0, 0.37, -0.71, 25.0})
        for (const double offset : {0.0, -40.0, 100.0, 210.5}) {
            Volume volume = volume_of_bits(8);
            volume.value_scale = scale, volume.value_offset = offset;
            const Entries entries = sample_entries(function, volume);
            for (int i = 0; i < entries.size(); ++i) {
                const Entry& entry = entries.entry[static_cast<std::size_t>(i)];
                const double value = scale * i + offset;
                ASSERT_EQ(entry.color, function.color_at(value)) << value;
                ASSERT_EQ(entry.alpha, function.alpha_at(value)) << value;
            }
        }
}

TEST(TransferFunction, EveryMachineGetsTheseBits) {
    TransferFunction function = ramp();
    function.color = {{0, {0.1, 0.2, 0.3}}, {1000, {0.9, 0.1, 0.7}}, {4095, {0.3, 1, 0.2}}};
    function.opacity = {{0, 0}, {700, 0.013}, {3000, 0.77}, {4095, 1}};
    function.unit_distance = 0.7;
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&](double x) { hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u; };
    for (const Entry& entry : sample_entries(function, volume_of_bits(12)).entry)
        add(entry.color.x), add(entry.color.y), add(entry.color.z), add(entry.alpha), add(entry.extinction);
    EXPECT_EQ(hash, 0x2bb1e7ebe1792b32u);
}

}  // namespace
