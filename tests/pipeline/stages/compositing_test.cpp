// Stage 6's hard cases: long fogs in every form and mode, what transparency and opacity must leave alone, and
// how far each order of compositing is from the exact sum.
#include "pipeline/stages/compositing-inl.h"

#include "fixedpoint/words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;
using Pixel = Accumulated<Word>;
using enum CompositingForm;

constexpr CompositingForm kForms[] = {
    w, w_carry, equation_9, alpha, back_to_front, unit255_shift, unit255_blinn};

/// Every wire u1.F, as plan.cpp builds it.
CompositingStage stage_of(CompositingForm form, int bits, Rounding rounding, bool premultiplied = false) {
    const Spec spec{{1, bits, false}, rounding, Overflow::sat};
    CompositingStage s;
    s.form = form, s.premultiplied = premultiplied;
    s.alpha_fraction = s.color_fraction = s.contribution_fraction = s.transparency_fraction = bits;
    s.to_contribution = s.to_transparency = s.to_color = s.to_slab_color = Rescale(2 * bits, spec);
    if (s.takes_from_transparency()) s.to_transparency = Rescale(bits, spec);
    s.to_color_sum = s.to_transparency_sum = s.color_to_code = Rescale(bits, spec);
    if (form == w_carry) {
        s.to_contribution = Rescale(2 * bits, {spec.format, Rounding::trn, Overflow::sat});
        const Spec whole{{1, 2 * bits, false}};  // C is exact
        s.sum_fraction = 2 * bits, s.to_color = s.to_color_sum = Rescale(2 * bits, whole);
    }
    if (s.is_unit255()) {
        const Spec code{{bits, 0, false}, Rounding::rnd, Overflow::sat};
        s.alpha_to_code = s.color_to_code = Rescale(bits, code);
        s.to_color_sum = Rescale(0, code);
    }
    return s;
}

void add(const CompositingStage& s, Pixel& pixel, Word color, Word alpha) {
    composite(s, pixel, std::array<Word, 3>{color, color, color}, alpha);
}

/// T after `samples` of one opacity, from `start` or all of it.
Word transparency_behind(const CompositingStage& s, int samples, Word opacity, Word start = -1) {
    Pixel pixel = nothing_yet<Word>(s);
    if (start >= 0) pixel.transparency = start;
    for (int i = 0; i < samples; ++i) add(s, pixel, 0, opacity);
    return transparency(s, pixel);
}

// C6.1
TEST(Compositing, AMillionTransparentSamplesLeaveExactlyOne) {
    for (const CompositingForm form : kForms)
        for (const Rounding rounding : {Rounding::trn, Rounding::rnd, Rounding::rnd_conv}) {
            if (form == unit255_shift) continue;
            const CompositingStage s = stage_of(form, form == unit255_blinn ? 8 : 15, rounding);
            EXPECT_EQ(transparency_behind(s, 1'000'000, 0), s.unit()) << name_of(form);
        }
}

TEST(Compositing, ABareShiftLosesAllOf255In255TransparentSamples) {
    const CompositingStage s = stage_of(unit255_shift, 8, Rounding::trn);
    EXPECT_EQ(transparency_behind(s, 254, 0), 1);
    EXPECT_EQ(transparency_behind(s, 255, 0), 0);
}

TEST(Compositing, BlinnsProductIsTheRoundedOneForEveryPairAndTheBareShiftIsNot) {
    const CompositingStage blinn = stage_of(unit255_blinn, 8, Rounding::trn),
                           shift = stage_of(unit255_shift, 8, Rounding::trn);
    int differ = 0;
    for (Word a = 0; a < 256; ++a)
        for (Word b = 0; b < 256; ++b) {
            ASSERT_EQ(unit_product(blinn, a, b),
                      (2 * a * b + 255) / 510);  // round(ab / 255): 255 is odd, no ties
            ASSERT_EQ(unit_product(shift, a, b), a * b / 256);
            differ += unit_product(shift, a, b) != unit_product(blinn, a, b);
        }
    EXPECT_GT(differ, 30000);
}

// C6.2 and the table of Squeeze's fog, 1024 samples of one last bit: T left by equation 9.
TEST(Compositing, FogByEquationNine) {
    struct Row {
        int bits;
        Word truncated, rounded;
    };
    for (const Row& row : {Row{8, 0, 128}, Row{10, 0, 512}, Row{12, 3072, 3072}, Row{14, 15360, 15360},
                           Row{15, 31744, 31744}, Row{16, 64512, 64512}}) {
        EXPECT_EQ(transparency_behind(stage_of(equation_9, row.bits, Rounding::trn), 1024, 1), row.truncated);
        EXPECT_EQ(transparency_behind(stage_of(equation_9, row.bits, Rounding::rnd), 1024, 1), row.rounded);
    }
    for (const Rounding rounding : {Rounding::trn, Rounding::rnd})
        EXPECT_EQ(transparency_behind(stage_of(equation_9, 15, rounding), 8192, 1), 24576);
}

TEST(Compositing, FogByTheWFormIsLostWhenTruncatedAndKeptWhenRounded) {
    for (const int bits : {8, 10, 12, 14, 15, 16}) {
        const Word one = Word{1} << bits;
        // floor(T / one) is 1 for the first sample and 0 ever after.
        EXPECT_EQ(transparency_behind(stage_of(w, bits, Rounding::trn), 1024, 1), one - 1);
        // A last bit a sample until T is one half; there the tie goes to zero.
        EXPECT_EQ(transparency_behind(stage_of(w, bits, Rounding::rnd_conv), 1024, 1),
                  std::max(one - 1024, one / 2));
    }
}

TEST(Compositing, FogByOpacityIsLostWhenTruncated) {
    for (const int bits : {8, 10, 12, 14, 15, 16})
        EXPECT_EQ(transparency_behind(stage_of(alpha, bits, Rounding::trn), 1024, 1), (Word{1} << bits) - 1);
}

TEST(Compositing, OpacityOneOf128LeavesSevenBitsOpaqueTruncatingAndHalfWayRounding) {
    // Squeeze, 4.1.2.2: 1.7 bits are opaque after 128 samples of one last bit truncating; rounding stalls.
    EXPECT_EQ(transparency_behind(stage_of(equation_9, 7, Rounding::trn), 127, 1), 1);
    EXPECT_EQ(transparency_behind(stage_of(equation_9, 7, Rounding::trn), 128, 1), 0);
    EXPECT_EQ(transparency_behind(stage_of(equation_9, 7, Rounding::rnd), 5000, 1), 64);
}

// What is rounded at a slab is what the slab before it has left over: sums of it telescope (docs/compositing.md).
TEST(Compositing, CarriedRemaindersKeepFogOfAnyLengthWithinOneLastBit) {
    std::mt19937_64 random(11);
    for (const int bits : {4, 8, 12, 15}) {
        const CompositingStage s = stage_of(w_carry, bits, Rounding::trn);
        const auto one = static_cast<double>(s.unit());
        for (const int samples : {1, 64, 1024, 30'000, 1'000'000})
            for (const bool drawn : {false, true}) {
                Pixel pixel = nothing_yet<Word>(s);
                long double exact = one;
                for (int k = 0; k < samples; ++k) {
                    const Word a = drawn ? static_cast<Word>(random() % 3) : 1;
                    add(s, pixel, 0, a);
                    exact *= 1 - static_cast<long double>(a) / one;
                    ASSERT_TRUE(pixel.remainder >= 0 && pixel.remainder < Word{1} << bits);
                }
                // Each step's error is shrunk by what lies behind it, so the telescoped sum stays below one; half
                // a bit of it is where the remainder starts.
                EXPECT_LE(std::abs(static_cast<double>(pixel.transparency) - static_cast<double>(exact)), 1)
                    << bits << " bits, " << samples << " samples";
            }
    }
}

TEST(Compositing, CarriedRemaindersKeepColoursWithinTheirVariationAlongTheRay) {
    std::mt19937_64 random(12);
    constexpr int kBits = 12;
    const CompositingStage s = stage_of(w_carry, kBits, Rounding::trn);
    const double one = 1 << kBits;
    for (int ray = 0; ray < 300; ++ray) {
        const int samples = 1 + static_cast<int>(random() % 400);
        std::vector<Word> opacity, color;
        for (int k = 0; k < samples; ++k) {
            opacity.push_back(static_cast<Word>(random() % 4097 >> random() % 12));
            color.push_back(ray % 2 ? static_cast<Word>(random() % 4097) : 4096 * k / samples);
        }
        Pixel pixel = nothing_yet<Word>(s);
        for (std::size_t k = 0; k < opacity.size(); ++k) add(s, pixel, color[k], opacity[k]);
        // G: what lies behind, as seen at T = 1; the error is sum of (r_k - r_(k+1)) (c_k - G_(k+1)), in last bits.
        double behind = 0, variation = 0, last = 0;
        for (std::size_t k = opacity.size(); k-- > 0;) {
            const double c = static_cast<double>(color[k]) / one, a = static_cast<double>(opacity[k]) / one;
            const double weight = c - behind;
            if (k + 1 < opacity.size()) variation += std::abs(weight - last);
            last = weight, behind = c * a + (1 - a) * behind;
        }
        const double error = static_cast<double>(pixel.color[0]) / one - behind * one;  // in last bits of w
        EXPECT_LE(std::abs(error), 1 + variation) << samples << " samples";
    }
}

// C6.3
TEST(Compositing, BelowOneHalfRoundingStallsOnThinFog) {
    const auto lsb8 = [](int bits, Rounding rounding) {
        const auto start = static_cast<Word>(std::floor(0.49 * std::ldexp(1.0, bits)));
        const CompositingStage s = stage_of(equation_9, bits, rounding);
        const double exact = static_cast<double>(start) * std::pow(1 - std::ldexp(1.0, -bits), 1024);
        return 255 * std::ldexp(static_cast<double>(transparency_behind(s, 1024, 1, start)) - exact, -bits);
    };
    EXPECT_EQ(transparency_behind(stage_of(equation_9, 15, Rounding::rnd), 1024, 1, 16056), 16056);
    EXPECT_NEAR(lsb8(15, Rounding::rnd), 3.84, 0.005);
    EXPECT_NEAR(lsb8(15, Rounding::trn), -4.12, 0.005);
    EXPECT_NEAR(lsb8(18, Rounding::rnd), 0.49, 0.005);
    EXPECT_NEAR(lsb8(18, Rounding::trn), -0.51, 0.005);
    EXPECT_NEAR(lsb8(20, Rounding::rnd), 0.12, 0.005);
    EXPECT_NEAR(lsb8(20, Rounding::trn), -0.13, 0.005);
}

// C6.3: each of N samples rounds T by up to half a last bit, and no later one makes that larger, so N
// 2^-(F+1) bounds the error, half an LSB8 at F = 8 + log2 N; a stall comes near it, so that one bit less does
// not do.
TEST(Compositing, HalfAStepOfADisplayTakesEightBitsAndTheLogarithmOfTheSamples) {
    const auto worst_lsb8 = [](int bits, int samples) {
        const CompositingStage s = stage_of(equation_9, bits, Rounding::rnd);
        double worst = 0;
        for (Word alpha = 1; alpha <= 64; ++alpha)
            for (const double part : {0.1, 0.25, 0.49, 0.499, 0.75, 0.9, 1.0}) {
                const auto start = static_cast<Word>(std::floor(part * std::ldexp(1.0, bits)));
                const double exact = static_cast<double>(start) *
                                     std::pow(1 - std::ldexp(static_cast<double>(alpha), -bits), samples);
                const auto left = static_cast<double>(transparency_behind(s, samples, alpha, start));
                worst = std::max(worst, 255 * std::ldexp(std::fabs(left - exact), -bits));
            }
        return worst;
    };
    for (const int p : {4, 6, 8, 10}) {
        EXPECT_LE(worst_lsb8(8 + p, 1 << p), 0.5) << p;
        EXPECT_GT(worst_lsb8(7 + p, 1 << p), 0.5) << p;
    }
}

struct Ray {
    std::vector<Word> color, alpha;  // premultiplied, C <= alpha, u1.15
};
Ray random_ray(std::mt19937_64& random, int samples) {
    Ray ray;
    const int thin = static_cast<int>(random() % 15);  // most alphas below 2^-thin
    for (int i = 0; i < samples; ++i) {
        const auto a = static_cast<Word>((random() % 32769) >> thin);
        ray.alpha.push_back(a);
        ray.color.push_back(static_cast<Word>(random() % static_cast<std::uint64_t>(a + 1)));
    }
    return ray;
}
double exact_color(const Ray& ray) {
    double sum = 0, clear = 1;
    for (std::size_t i = 0; i < ray.color.size(); ++i) {
        sum += static_cast<double>(ray.color[i]) * clear;
        clear *= 1 - static_cast<double>(ray.alpha[i]) / 32768;
    }
    return sum;
}
Word composited(CompositingForm form, Rounding rounding, const Ray& ray) {
    const CompositingStage s = stage_of(form, 15, rounding, true);
    Pixel pixel = nothing_yet<Word>(s);
    const std::size_t n = ray.color.size();
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t at = form == back_to_front ? n - 1 - i : i;
        add(s, pixel, ray.color[at], ray.alpha[at]);
    }
    return pixel.color[0];
}

// C6.4.  Rounding, C loses half a last bit a sample and T, half a last bit a sample too, another sum of
// C <= alpha times that; back to front only the first.  Truncating, twice as much and always downwards.
TEST(Compositing, BothOrdersAreWithinTheirBoundsOfTheExactSum) {
    std::mt19937_64 random(1);
    constexpr double kDoubles = 1e-6;  // rounding of the exact sum itself
    for (const int n : {64, 1024})
        for (int i = 0; i < 200; ++i) {
            const Ray ray = random_ray(random, n);
            const double exact = exact_color(ray);
            const auto error = [&](CompositingForm form, Rounding rounding) {
                return static_cast<double>(composited(form, rounding, ray)) - exact;
            };
            ASSERT_LE(std::abs(error(equation_9, Rounding::rnd)), n + kDoubles);
            ASSERT_LE(std::abs(error(back_to_front, Rounding::rnd)), n / 2.0 + kDoubles);
            ASSERT_LE(error(equation_9, Rounding::trn), kDoubles);
            ASSERT_GE(error(equation_9, Rounding::trn), -2 * n - kDoubles);
            ASSERT_LE(error(back_to_front, Rounding::trn), kDoubles);
            ASSERT_GE(error(back_to_front, Rounding::trn), -n - kDoubles);
        }
}

// C6.5
TEST(Compositing, WhiteFogAndItsTransparencySumToOneInTheWForm) {
    std::mt19937_64 random(2);
    for (const Rounding rounding : {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv})
        for (int i = 0; i < 50; ++i) {
            const CompositingStage s = stage_of(w, 15, rounding);
            Pixel white = nothing_yet<Word>(s), grey = white;
            for (int k = 0; k < 400; ++k) {
                const auto a = static_cast<Word>((random() % 32769) >> random() % 15);
                add(s, white, 1 << 15, a);
                add(s, grey, static_cast<Word>(random() % 32769), a);
                ASSERT_EQ(white.color[0] + white.transparency, 1 << 15);
                ASSERT_GE(grey.color[0], 0);
                ASSERT_LE(grey.color[0], (1 << 15) - grey.transparency);
            }
        }
}

TEST(Compositing, EquationNineRoundsWhiteFogAndItsTransparencyEachOnItsOwn) {
    const CompositingStage s = stage_of(equation_9, 15, Rounding::rnd);
    Pixel white = nothing_yet<Word>(s);
    add(s, white, 1 << 15, 1), add(s, white, 1 << 15, 1 << 14);  // half of 32767 goes up in C and in T
    EXPECT_EQ(white.color[0] + white.transparency, (1 << 15) + 1);
}

// C6.6
TEST(Compositing, BehindAnOpaqueSampleNothingIsSeen) {
    std::mt19937_64 random(3);
    for (const CompositingForm form : kForms)
        for (const bool premultiplied : {false, true}) {
            const int bits = form == unit255_shift || form == unit255_blinn ? 8 : 15;
            const CompositingStage s = stage_of(form, bits, Rounding::rnd_conv, premultiplied);
            const Word one = Word{1} << bits;
            Pixel pixel = nothing_yet<Word>(s), hidden = pixel;
            const auto sample = [&](Pixel& p) {
                const auto a = static_cast<Word>(random() % static_cast<std::uint64_t>(one + 1));
                add(s, p, premultiplied ? a / 2 : one / 3, a);
            };
            if (form == back_to_front) {  // what came before is hidden
                for (int i = 0; i < 9; ++i) sample(hidden);
                add(s, hidden, 77, one), add(s, pixel, 77, one);
                EXPECT_EQ(hidden.color, pixel.color);
                EXPECT_EQ(hidden.transparency, 0);
                continue;
            }
            sample(pixel), add(s, pixel, 77, one);
            hidden = pixel;
            for (int i = 0; i < 9; ++i) sample(hidden);
            EXPECT_EQ(transparency(s, hidden), 0) << name_of(form);
            EXPECT_EQ(hidden.color, pixel.color) << name_of(form);
        }
}

// C6.7
TEST(Compositing, EndingARayBelowAThresholdCostsNoMoreThanTheThreshold) {
    std::mt19937_64 random(4);
    CompositingStage s = stage_of(w, 15, Rounding::rnd_conv);
    s.threshold = 32;  // 2^-10
    for (int i = 0; i < 300; ++i) {
        Pixel pixel = nothing_yet<Word>(s);
        Word ended = -1;
        for (int k = 0; k < 500; ++k) {
            add(s, pixel, static_cast<Word>(random() % 32769),
                static_cast<Word>((random() % 32769) >> i % 8));
            if (ended < 0 && !goes_on(s, pixel)) ended = pixel.color[0];
        }
        if (ended < 0) continue;
        ASSERT_GE(pixel.color[0], ended);
        ASSERT_LE(pixel.color[0] - ended, 31);  // C + T <= one, and T was below 32
    }
}

// C6.8: 1 - sqrt(1 - 0.3), twice over, is 0.3: half a last bit of a' twice, of a once, of each product once.
TEST(Compositing, TwoHalfStepsAreOneWholeOne) {
    const Spec spec{{1, 15, false}};
    const Word half = quantise_real(0.163339973465924, spec), whole = quantise_real(0.3, spec);
    for (const CompositingForm form : {w, equation_9, alpha, back_to_front}) {
        const CompositingStage s = stage_of(form, 15, Rounding::rnd_conv);
        EXPECT_NEAR(static_cast<double>(transparency_behind(s, 2, half)),
                    static_cast<double>(transparency_behind(s, 1, whole)), 2)
            << name_of(form);
    }
}

// C6.9
TEST(Compositing, ThreeSamplesDoNotKnowHowTheyAreBracketed) {
    std::mt19937_64 random(5);
    for (int i = 0; i < 100'000; ++i) {
        const Ray ray = random_ray(random, 3);
        // Front to back is (a over b) over c, back to front a over (b over c).
        ASSERT_LE(std::abs(composited(equation_9, Rounding::rnd, ray) -
                           composited(back_to_front, Rounding::rnd, ray)),
                  2);
    }
}

// C6.10
TEST(Compositing, TransparentSamplesChangeNoBitWherever) {
    std::mt19937_64 random(6);
    for (const CompositingForm form : kForms) {
        if (form == unit255_shift) continue;  // there they do, and the plan skips no empty space
        for (const Rounding rounding : {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv})
            for (const bool premultiplied : {false, true}) {
                const CompositingStage s =
                    stage_of(form, form == unit255_blinn ? 8 : 15, rounding, premultiplied);
                const auto one = static_cast<std::uint64_t>(Word{1} << s.alpha_fraction);
                Pixel plain = nothing_yet<Word>(s), padded = plain;
                for (int k = 0; k < 300; ++k) {
                    const auto a = static_cast<Word>((random() % (one + 1)) >> random() % 8);
                    const Word c = premultiplied ? a / 3 : static_cast<Word>(random() % (one + 1));
                    add(s, plain, c, a), add(s, padded, c, a);
                    add(s, padded, premultiplied ? 0 : static_cast<Word>(random() % (one + 1)), 0);
                    ASSERT_EQ(plain.color, padded.color) << name_of(form);
                    ASSERT_EQ(plain.transparency, padded.transparency) << name_of(form);
                }
            }
    }
}

TEST(Compositing, IntervalsHoldEveryPixel) {
    std::mt19937_64 random(7);
    for (int i = 0; i < 20'000; ++i) {
        const CompositingForm form = kForms[random() % std::size(kForms)];
        const int bits = 4 + static_cast<int>(random() % 12);
        const CompositingStage s = stage_of(form, bits, static_cast<Rounding>(random() % 4), random() % 2);
        const Word one = Word{1} << bits;
        const auto up_to = [&](Word most) {
            return static_cast<Word>(random() % static_cast<std::uint64_t>(most + 1));
        };
        Pixel pixel{{up_to(one), up_to(one), up_to(one)}, up_to(s.unit())};
        const Range all{0, one}, unit{0, s.unit()};
        Accumulated<Range> pixels{{all, all, all}, unit};
        composite(s, pixel, std::array<Word, 3>{up_to(one), up_to(one), up_to(one)}, up_to(one));
        composite(s, pixels, std::array<Range, 3>{all, all, all}, all);
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_TRUE(pixels.color[c].low <= pixel.color[c] && pixel.color[c] <= pixels.color[c].high)
                << name_of(form);
        ASSERT_TRUE(pixels.transparency.low <= pixel.transparency &&
                    pixel.transparency <= pixels.transparency.high)
            << name_of(form);
    }
}

// Squeeze, section 4.1.2.1: the buffer holds the straight colour.
CompositingStage straight_stage(int bits, Rounding rounding) {
    CompositingStage s = stage_of(straight, bits, rounding);
    s.sum_fraction = s.numerator_fraction = bits;
    s.to_color = Rescale(bits, {{1, bits, false}, rounding, Overflow::sat});
    s.to_color.divides = true;
    return s;
}

TEST(Compositing, AStraightColourOfEvenMatterStaysItself) {
    for (const Rounding rounding : {Rounding::trn, Rounding::rnd, Rounding::rnd_conv})
        for (const int bits : {8, 15}) {
            const CompositingStage s = straight_stage(bits, rounding);
            const Word one = Word{1} << bits;
            for (const Word color : {Word{0}, Word{1}, one / 3, one}) {
                Pixel pixel = nothing_yet<Word>(s);
                for (int i = 0; i < 300; ++i) add(s, pixel, color, 1 + i % 7);
                EXPECT_EQ(pixel.color[0], color) << bits;
            }
        }
}

TEST(Compositing, AStraightColourIsLeftAloneByNothingAndReplacedByNoneBehindAWall) {
    const CompositingStage s = straight_stage(15, Rounding::rnd_conv);
    const Word one = Word{1} << 15;
    Pixel pixel = nothing_yet<Word>(s);
    add(s, pixel, one, 0);  // opacity zero over zero
    EXPECT_EQ(pixel.color[0], 0);
    EXPECT_EQ(pixel.transparency, one);
    add(s, pixel, 12345, 777);
    const Pixel before = pixel;
    add(s, pixel, one, 0);
    EXPECT_EQ(pixel.color, before.color);
    EXPECT_EQ(pixel.transparency, before.transparency);
    add(s, pixel, 20000, one);
    EXPECT_EQ(pixel.transparency, 0);
    const Pixel wall = pixel;
    add(s, pixel, one, one / 2);
    EXPECT_EQ(pixel.color, wall.color);
}

// Slab k's division rounds C by half a last bit at most, and what is gathered is C A: N slabs, A <= 1, leave
// N / 2 last bits beside the sum of c (T - T') over the T that the buffer holds.
TEST(Compositing, AStraightColourTimesItsOpacityIsTheSumWithinHalfALastBitASlab) {
    std::mt19937_64 random(5);
    constexpr int kBits = 15, kSlabs = 200;
    const CompositingStage s = straight_stage(kBits, Rounding::rnd_conv);
    for (int ray = 0; ray < 200; ++ray) {
        Pixel pixel = nothing_yet<Word>(s);
        double sum = 0;
        for (int k = 0; k < kSlabs; ++k) {
            const Word before = pixel.transparency, color = static_cast<Word>(random() % 32769);
            add(s, pixel, color, static_cast<Word>(random() % (ray % 2 ? 600 : 40)));
            sum += static_cast<double>(color) * static_cast<double>(before - pixel.transparency);
        }
        const double gathered =
            static_cast<double>(pixel.color[0]) * static_cast<double>(s.unit() - pixel.transparency);
        ASSERT_NEAR(gathered / 32768, sum / 32768, kSlabs / 2.0);
        const std::array<double, 4> shown =
            color_of(s, Accumulated<double>{{static_cast<double>(pixel.color[0]), 0, 0},
                                            static_cast<double>(pixel.transparency)});
        ASSERT_DOUBLE_EQ(shown[0], gathered / 32768 / 32768);
    }
}

}  // namespace
}  // namespace squint
