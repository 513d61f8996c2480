#include "core/compare.h"

#include "core/error.h"
#include "core/srgb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

using namespace squint;
using testing::HasSubstr;

Image flat(int width, int height, float value) {
    Image image{width, height, {}};
    for (const char* name : {"R", "G", "B", "A"})
        for (float& v : image.add_float(name).values) v = value;
    return image;
}

Image noise(int width, int height, unsigned seed) {
    Image image = flat(width, height, 0);
    std::mt19937 random(seed);
    for (Channel& channel : image.channels)
        for (float& v : channel.values) v = static_cast<float>(random()) * 0x1p-32f;
    return image;
}

std::string message(const Image& a, const Image& b) {
    try {
        (void)compare(a, b);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Compare, IdenticalPicturesHaveNoPsnrAndAnSsimOfOne) {
    const Image image = noise(40, 30, 1);
    const Comparison result = compare(image, image);
    ASSERT_EQ(result.all.size(), 5u);
    ASSERT_EQ(result.foreground.size(), 5u);
    for (const Difference& d : result.all) {
        EXPECT_TRUE(d.identical);
        EXPECT_FALSE(d.psnr);
        EXPECT_EQ(d.rmse, 0);
        EXPECT_EQ(d.largest, 0);
        EXPECT_EQ(d.ssim, 1);
        EXPECT_EQ(d.pixels, 1200);
    }
    EXPECT_EQ(result.all.back().channel, "RGB");
}

TEST(Compare, OnePixelOfOneChannelGivesTheFiguresByHand) {
    const Image a = flat(20, 20, 0.5f);
    Image b = a;
    b.find("G")->values[3 * 20 + 7] = 0.75f;
    const Comparison result = compare(a, b);
    const Difference& green = result.channel("G", false);
    EXPECT_FALSE(green.identical);
    EXPECT_EQ(green.rmse, 0.25 / 20);  // sqrt(1/16 / 400)
    EXPECT_EQ(green.bias, -0.25 / 400);
    EXPECT_EQ(green.largest, 0.25);
    EXPECT_EQ(green.largest_x, 7);
    EXPECT_EQ(green.largest_y, 3);
    EXPECT_NEAR(*green.psnr, 20 * std::log10(80), 1e-13);  // 38 dB to a few roundings
    EXPECT_TRUE(result.channel("R", false).identical);
    const Difference& joint = result.channel("RGB", false);
    EXPECT_NEAR(joint.rmse, 0.25 / 20 / std::sqrt(3), 1e-17);
    EXPECT_EQ(joint.largest_x, 7);
    EXPECT_FALSE(joint.identical);
}

TEST(Compare, TheForegroundIsWhereEitherPictureHasMatter) {
    Image a = flat(12, 12, 0), b = a;
    a.find("A")->values[0] = 1e-30f;
    b.find("A")->values[5] = 1;
    b.find("R")->values[5] = 0.5f;
    b.find("R")->values[6] = 0.5f;  // outside
    const Comparison result = compare(a, b);
    EXPECT_EQ(result.channel("R", true).pixels, 2);
    EXPECT_EQ(result.channel("R", true).bias, -0.25);
    EXPECT_EQ(result.channel("R", false).bias, -1.0 / 144);

    const Comparison empty = compare(flat(12, 12, 0), flat(12, 12, 0));
    EXPECT_EQ(empty.channel("R", true).pixels, 0);
    EXPECT_TRUE(empty.channel("R", true).identical);

    a.channels.pop_back(), b.channels.pop_back();
    EXPECT_EQ(compare(a, b).channel("R", true).pixels, 144) << "no A: all";
}

TEST(Compare, AMillionSmallDifferencesKeepTheirBias) {
    const Image a = flat(1000, 1000, 0.25f);
    Image b = a;
    for (float& v : b.find("R")->values) v = 0.25f + 0x1p-24f;
    const Difference red = compare(a, b, false, false).channel("R", false);
    EXPECT_EQ(red.bias, -0x1p-24);  // sums of one power of two are exact
    EXPECT_EQ(red.rmse, 0x1p-24);
}

TEST(Compare, SsimEqualsItsDefinitionWindowByWindow) {
    const int width = 17, height = 14;
    const Image a = noise(width, height, 2);
    Image b = a;
    const Image other = noise(width, height, 3);
    for (std::size_t i = 0; i < b.channels[0].values.size(); ++i)
        b.channels[0].values[i] += 0.3f * other.channels[0].values[i];

    double weights = 0, total = 0;
    const auto weight = [](int dx, int dy) { return std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5)); };
    for (int dy = -5; dy <= 5; ++dy)
        for (int dx = -5; dx <= 5; ++dx) weights += weight(dx, dy);
    for (int y = 5; y < height - 5; ++y) {
        for (int x = 5; x < width - 5; ++x) {
            double m_a = 0, m_b = 0, v_a = 0, v_b = 0, cov = 0;
            for (const bool second : {false, true}) {  // means first, then moments about them
                for (int dy = -5; dy <= 5; ++dy) {
                    for (int dx = -5; dx <= 5; ++dx) {
                        const auto i = static_cast<std::size_t>((y + dy) * width + x + dx);
                        const double w = weight(dx, dy) / weights;
                        const double p = a.channels[0].values[i], q = b.channels[0].values[i];
                        if (!second) {
                            m_a += w * p, m_b += w * q;
                        } else {
                            v_a += w * (p - m_a) * (p - m_a), v_b += w * (q - m_b) * (q - m_b),
                                cov += w * (p - m_a) * (q - m_b);
                        }
                    }
                }
            }
            total += (2 * m_a * m_b + 1e-4) * (2 * cov + 9e-4) /
                     ((m_a * m_a + m_b * m_b + 1e-4) * (v_a + v_b + 9e-4));
        }
    }
    // Variances as differences of means lose 121 roundings of 2^-53 against a denominator above 9e-4: below
    // 1e-10.
    EXPECT_NEAR(*compare(a, b).channel("R", false).ssim, total / ((width - 10) * (height - 10)), 1e-10);
    EXPECT_FALSE(compare(noise(10, 40, 1), noise(10, 40, 2)).channel("R", false).ssim) << "no whole window";
}

TEST(Compare, SrgbEncodesColoursAndLeavesAlpha) {
    const Image a = flat(11, 11, 0.25f), b = flat(11, 11, 0.5f);
    const Comparison result = compare(a, b, true);
    EXPECT_NEAR(result.channel("R", false).bias, srgb_from_linear(0.25) - srgb_from_linear(0.5), 1e-15);
    EXPECT_EQ(result.channel("A", false).bias, -0.25);
}

TEST(Compare, ChannelsAreFoundByNameAndWordsAreSigned) {
    Image a = flat(2, 1, 0.5f), b = a;
    std::reverse(b.channels.begin(), b.channels.end());
    a.add_words("fixed.R").words = {0xffffffffu, 5};
    b.add_words("fixed.R").words = {1, 5};
    const Comparison result = compare(a, b);
    EXPECT_TRUE(result.channel("G", false).identical);
    EXPECT_EQ(result.channel("fixed.R", false).bias, -1);
    EXPECT_EQ(result.channel("fixed.R", false).largest, 2);
    EXPECT_FALSE(result.channel("fixed.R", false).psnr);
}

TEST(Compare, WhatCannotBeComparedIsRefusedAndNeverPasses) {
    const Image good = flat(3, 2, 0.5f);
    EXPECT_THAT(message(good, flat(2, 3, 0.5f)), HasSubstr("sizes differ, 3 x 2 and 2 x 3"));
    Image other = good;
    other.channels[3].name = "Z";
    EXPECT_THAT(message(good, other), HasSubstr("channels differ, \"R G B A\" and \"R G B Z\""));
    other = good, other.channels.pop_back();
    EXPECT_THAT(message(good, other), HasSubstr("channels differ"));
    EXPECT_THAT(message(other, good), HasSubstr("channels differ"));
    other = good, other.channels[0].words.assign(6, 1), other.channels[0].values.clear();
    EXPECT_THAT(message(good, other), HasSubstr("words in one image"));
    other = good, other.left = 1;
    EXPECT_THAT(message(good, other), HasSubstr("lie at different places, from x 0, y 0 and x 1, y 0"));
    for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
        other = good, other.channels[1].values[4] = bad;
        EXPECT_THAT(message(good, other),
                    HasSubstr("second image, channel G: 1 values are not finite, the first at x 1, y 1"));
        EXPECT_THAT(message(other, other), HasSubstr("not finite")) << "also when both have it";
    }
    EXPECT_THAT(message(Image{}, Image{}), HasSubstr("no pixels"));
}

TEST(Difference, IsSignedAndAmplified) {
    const Image a = flat(2, 2, 0.25f), b = flat(2, 2, 0.5f);
    EXPECT_EQ(difference(a, b, 8).find("R")->values[3], -2);
    EXPECT_EQ(difference(b, a).find("R")->values[3], 0.25f);
}

}  // namespace
