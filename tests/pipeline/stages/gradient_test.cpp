// Stage 3's hard cases: fields whose gradient is known exactly, and what normalising must keep.
#include "pipeline/stages/gradient-inl.h"

#include "fixedpoint/words.h"
#include "pipeline/stages/presets.h"
#include "tests/pipeline/stages/neighbourhoods.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;
using Vector = std::array<Word, 3>;

constexpr GradientRule kVoxelRules[] = {GradientRule::central, GradientRule::sobel, GradientRule::analytic};

/// Voxels of 12 bits, weights of 8, gradients sI.F, normals s1.F: as plan.cpp builds it.
GradientStage stage_of(GradientRule rule, int fraction_bits, int normal_bits,
                       Rounding rounding = Rounding::rnd_conv) {
    const Spec gradient{{13, fraction_bits, true}, rounding, Overflow::sat};
    const int gained = rule == GradientRule::central ? 1 : rule == GradientRule::sobel ? 5 : 0;
    GradientStage s;
    s.rule = rule, s.weight_bits = 8;
    s.to_first = Rescale(gained + 8, gradient);
    s.to_second = s.to_gradient = Rescale(fraction_bits + 8, gradient);
    s.normal_fraction = normal_bits;
    s.to_normal = Rescale(-kNormalGuard, Spec{{1, normal_bits, true}, rounding, Overflow::sat});
    return s;
}

double length_of(const Vector& v, double one) {
    return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])) / one;
}

// C3.1
TEST(Gradient, AConstantFieldHasNoneAndNoNormal) {
    for (const GradientRule rule : kVoxelRules) {
        const GradientStage s = stage_of(rule, 4, 15);
        const auto flat = neighbourhood_of([](int, int, int) { return Word{1234}; });
        const Vector gradient = gradient_of(s, flat, {100, 200, 50});
        EXPECT_EQ(gradient, (Vector{0, 0, 0}));
        EXPECT_EQ(normalise(s, gradient), (Vector{0, 0, 0}));
    }
}

// C3.2
TEST(Gradient, ALinearFieldHasItsOwnSlopesEverywhere) {
    for (const GradientRule rule : kVoxelRules)
        for (const Rounding rounding : {Rounding::trn, Rounding::rnd_conv}) {
            const GradientStage s = stage_of(rule, 4, 15, rounding);
            const auto linear =
                neighbourhood_of([](int x, int y, int z) { return Word{2000} + 17 * x - 40 * y + 3 * z; });
            for (const Word w : {0, 1, 77, 128, 255, 256})
                EXPECT_EQ(gradient_of(s, linear, {w, 256 - w, w / 2}), (Vector{17 << 4, -40 * 16, 3 << 4}));
        }
}

// C3.2: outside the volume the nearest voxel is repeated, so the border's central difference is halved.
TEST(Gradient, TheBorderVoxelHasHalfTheSlopeByCentralDifferencesAndAllOfItAnalytically) {
    const auto border = neighbourhood_of([](int x, int, int) { return Word{100} + 20 * std::max(x, 0); });
    EXPECT_EQ(gradient_of(stage_of(GradientRule::central, 4, 15), border, {0, 0, 0})[0], 10 << 4);
    EXPECT_EQ(gradient_of(stage_of(GradientRule::central, 4, 15), border, {256, 0, 0})[0], 20 << 4);
    EXPECT_EQ(gradient_of(stage_of(GradientRule::analytic, 4, 15), border, {0, 0, 0})[0], 20 << 4);
}

// C3.3
TEST(Gradient, AStepOfOneLevelNeedsAFractionBit) {
    const auto step = neighbourhood_of([](int x, int, int) { return Word{x > 0}; });
    const Vector at_corner{0, 0, 0};
    EXPECT_EQ(gradient_of(stage_of(GradientRule::central, 1, 15), step, at_corner)[0], 1);  // one half
    EXPECT_EQ(gradient_of(stage_of(GradientRule::central, 0, 15, Rounding::trn), step, at_corner)[0], 0);
}

// C3.4: half to even is odd, floor is not.
TEST(Gradient, AMirroredFieldHasTheMirroredGradient) {
    std::mt19937_64 random(1);
    for (const GradientRule rule : kVoxelRules) {
        const GradientStage s = stage_of(rule, 2, 15);
        for (int i = 0; i < 500; ++i) {
            Neighbourhood<Word> n, mirrored;
            for (Word& v : n.voxel) v = static_cast<Word>(random() % 4096);
            for (int j = 0; j < 64; ++j)
                mirrored.voxel[static_cast<std::size_t>(j)] = n.voxel[static_cast<std::size_t>(j ^ 3)];
            const auto weight = [&] { return static_cast<Word>(random() % 257); };
            const Vector w{weight(), weight(), weight()};
            const Vector there = gradient_of(s, n, w),
                         back = gradient_of(s, mirrored, {256 - w[0], w[1], w[2]});
            ASSERT_EQ(back, (Vector{-there[0], there[1], there[2]}));
        }
    }
    const GradientStage floor = stage_of(GradientRule::central, 0, 15, Rounding::trn);
    const auto up = neighbourhood_of([](int x, int, int) { return Word{x > 0}; });
    const auto down = neighbourhood_of([](int x, int, int) { return Word{x < 0}; });
    EXPECT_EQ(gradient_of(floor, up, {0, 0, 0})[0], 0);
    EXPECT_EQ(gradient_of(floor, down, {0, 0, 0})[0], -1);
}

// C3.4 in the preset's own formats: a mirrored volume has the mirrored gradient, bit for bit.
TEST(Gradient, ThePresetDefaultIsOddInTheField) {
    std::mt19937_64 random(11);
    for (const int scalar_bits : {8, 12, 16}) {
        WireSpecs specs;
        ASSERT_TRUE(preset_specs("default", {.scalar_bits = scalar_bits}, specs));
        const int weight = specs[Wire::weight].format.fraction_bits,
                  lerp = specs[Wire::gradient_lerp].format.fraction_bits;
        for (const GradientRule rule : kVoxelRules) {
            GradientStage s;
            s.rule = rule, s.weight_bits = weight;
            const int gained = rule == GradientRule::central ? 1 : rule == GradientRule::sobel ? 5 : 0;
            s.to_first = Rescale(gained + weight, specs[Wire::gradient_lerp]);
            s.to_second = Rescale(lerp + weight, specs[Wire::gradient_lerp]);
            s.to_gradient = Rescale(lerp + weight, specs[Wire::gradient]);
            for (int i = 0; i < 2000; ++i) {
                Neighbourhood<Word> n, negative;
                for (std::size_t j = 0; j < 64; ++j)
                    n.voxel[j] = static_cast<Word>(random() % (1u << scalar_bits)),
                    negative.voxel[j] = -n.voxel[j];
                // Few distinct weights, so that halves come up.
                const auto place = [&] { return static_cast<Word>(random() % 9) << (weight - 3); };
                const Vector w{place(), place(), place()}, there = gradient_of(s, n, w);
                ASSERT_EQ(gradient_of(s, negative, w), (Vector{-there[0], -there[1], -there[2]}));
            }
        }
    }
}

// C3.5
TEST(Gradient, TheSteepestFieldFitsItsWord) {
    const auto steepest = neighbourhood_of([](int x, int y, int z) {
        return Word{x + y + z > 0 ? 4095
                                  : 0};  // at the corner: 4095 on one side of every axis, 0 on the other
    });
    const GradientStage s = stage_of(GradientRule::central, 12, 15);
    const Vector gradient = gradient_of(s, steepest, {0, 0, 0});
    Word squares = 0;
    for (const Word g : gradient) {
        EXPECT_EQ(g, 4095 << 11);  // 2047.5
        squares += g * g;
    }
    EXPECT_EQ(to_real(squares, {24, 24, false}), 3 * 2047.5 * 2047.5);  // 12576768.75
    const Vector normal = normalise(s, gradient);
    for (const Word n : normal) EXPECT_NEAR(static_cast<double>(n), -32768 / std::sqrt(3.0), 2);  // 2^-14
}

// C3.6: half a last bit of each component moves the end of a vector one level long by sqrt(3)/2 last bits.
TEST(Gradient, AShortGradientsDirectionIsAsGoodAsItsFraction) {
    std::mt19937_64 random(2);
    const auto component = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
    for (const int fraction : {4, 8, 12}) {
        const double most = std::asin(std::sqrt(3.0) / 2 * std::ldexp(1.0, -fraction));
        const Spec spec{{4, fraction, true}, Rounding::rnd, Overflow::sat};
        double worst = 0;
        for (int i = 0; i < 100'000; ++i) {
            const Vec3 exact = Vec3(component(), component(), component()).normalized();
            const Vec3 rounded(static_cast<double>(quantise_real(exact.x, spec)),
                               static_cast<double>(quantise_real(exact.y, spec)),
                               static_cast<double>(quantise_real(exact.z, spec)));
            const Vec3 across = exact.cross(rounded);
            worst = std::max(worst, std::atan2(across.length(), exact.dot(rounded)));
        }
        EXPECT_LE(worst, most) << fraction;
        EXPECT_GE(worst, 0.85 * most) << fraction;  // the bound is nearly met
    }
}

// The definition of normalise(): 2^-14 from scaling, half a last bit from the quotient.
TEST(Normalise, GivesAUnitVectorAgainstTheGradient) {
    std::mt19937_64 random(3);
    for (const int bits : {8, 12, 15, 20}) {
        const GradientStage s = stage_of(GradientRule::central, 12, bits);
        const double one = std::ldexp(1.0, bits);
        for (int i = 0; i < 50'000; ++i) {
            const auto component = [&] {
                return (static_cast<Word>(random() >> 38) - (1 << 25)) >> (random() % 25);
            };
            const Vector g{component(), component(), component()};
            const double length = length_of(g, 1);
            if (length == 0) continue;
            const Vector normal = normalise(s, g);
            for (std::size_t a = 0; a < 3; ++a)
                ASSERT_NEAR(static_cast<double>(normal[a]) / one, -static_cast<double>(g[a]) / length,
                            0x1p-14 + 0.5 / one)
                    << g[0] << ' ' << g[1] << ' ' << g[2] << " bits " << bits;
        }
    }
}

TEST(Normalise, AxesAndDiagonalsAreExact) {
    const GradientStage s = stage_of(GradientRule::central, 4, 15);
    const Word one = 1 << 15;
    for (const Word size : {1, 2, 3, 5, 100, 4095, 65535, 1 << 24}) {
        EXPECT_EQ(normalise(s, Vector{size, 0, 0}), (Vector{-one, 0, 0}));
        EXPECT_EQ(normalise(s, Vector{0, -size, 0}), (Vector{0, one, 0}));
        const Vector diagonal = normalise(s, Vector{size, size, size});
        EXPECT_EQ(diagonal[0], diagonal[1]);
        EXPECT_EQ(diagonal[1], diagonal[2]);
    }
}

TEST(Normalise, IsOddAndDoesNotKnowOneAxisFromAnother) {
    std::mt19937_64 random(4);
    const GradientStage s = stage_of(GradientRule::central, 4, 12);
    for (int i = 0; i < 50'000; ++i) {
        const auto component = [&] { return static_cast<Word>(random() % 20001) - 10000; };
        const Vector g{component(), component(), component()};
        const Vector n = normalise(s, g);
        ASSERT_EQ(normalise(s, Vector{-g[0], -g[1], -g[2]}), (Vector{-n[0], -n[1], -n[2]}));
        ASSERT_EQ(normalise(s, Vector{g[2], g[0], g[1]}), (Vector{n[2], n[0], n[1]}));
    }
}

// C3.7
TEST(Normalise, ALengthSlightlyAboveOneIsWhatRoundingLeaves) {
    std::mt19937_64 random(5);
    const GradientStage s = stage_of(GradientRule::central, 12, 15);
    Word most = 0;
    for (int i = 0; i < 100'000; ++i) {
        const auto component = [&] { return static_cast<Word>(random() % 65537) - 32768; };
        const Vector n = normalise(s, Vector{component(), component(), component()});
        most = std::max(most, (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) >> 15);
    }
    // Three components off by 2^-14 + 2^-16 at most move N.N by 2 sqrt(3) (2^-14 + 2^-16) or 8.7 last bits.
    EXPECT_LE(most, (1 << 15) + 9);
    EXPECT_GE(most, 1 << 15);
}

// C3.8
TEST(Gradient, WiderSpacingMakesItsComponentSmaller) {
    GradientStage s = stage_of(GradientRule::central, 8, 15);
    const Spec spacing{{1, 12, false}}, gradient{{13, 8, true}};
    s.isotropic = false, s.spacing_fraction = 12;
    for (std::size_t a = 0; a < 3; ++a) {
        s.spacing_exact[a] = a == 2 ? 0.5 : 1;
        s.spacing[a] = quantise_real(s.spacing_exact[a], spacing);
    }
    s.to_scaled = Rescale(8 + 12, gradient);
    EXPECT_EQ(to_world<Word>(s, 100, 0), 100);
    EXPECT_EQ(to_world<Word>(s, 100, 2), 50);
    EXPECT_EQ(to_world<Word>(s, -100, 2), -50);
    const Vector equal{100, 100, 100};
    const Vector scaled{to_world<Word>(s, equal[0], 0), to_world<Word>(s, equal[1], 1),
                        to_world<Word>(s, equal[2], 2)};
    const Vector normal = normalise(s, scaled);
    EXPECT_NEAR(static_cast<double>(normal[2]) / static_cast<double>(normal[0]), 0.5, 0x1p-13);
}

// C3.9: the order of lerps is x, y, z, so that bits agree where nothing is lost on the way: with 16 fraction
// bits two levels of 8-bit weights are exact, and the third rounds the same number.
TEST(Gradient, SwappedAxesSwapComponentsBitForBit) {
    std::mt19937_64 random(6);
    for (const GradientRule rule : kVoxelRules) {
        GradientStage s = stage_of(rule, 21, 15);
        s.to_gradient = Rescale(21 + 8, Spec{{13, 4, true}});
        for (int i = 0; i < 500; ++i) {
            Neighbourhood<Word> n, turned;  // turned(x, y, z) = n(y, z, x)
            for (Word& v : n.voxel) v = static_cast<Word>(random() % 4096);
            for (int z = 0; z < 4; ++z)
                for (int y = 0; y < 4; ++y)
                    for (int x = 0; x < 4; ++x)
                        turned.voxel[static_cast<std::size_t>((z * 4 + y) * 4 + x)] = n.at(y, z, x);
            const auto weight = [&] { return static_cast<Word>(random() % 257); };
            const Vector w{weight(), weight(), weight()};
            const Vector here = gradient_of(s, n, w), there = gradient_of(s, turned, {w[2], w[0], w[1]});
            ASSERT_EQ(there, (Vector{here[2], here[0], here[1]}));
        }
    }
}

TEST(Gradient, SobelIsTheWeightedMeanOfNineCentralDifferences) {
    std::mt19937_64 random(7);
    Neighbourhood<Word> n;
    for (Word& v : n.voxel) v = static_cast<Word>(random() % 4096);
    Word sum = 0;
    for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a)
            sum += (2 - std::abs(a)) * (2 - std::abs(b)) * (n.at(2, 1 + a, 1 + b) - n.at(0, 1 + a, 1 + b));
    EXPECT_EQ(sobel_difference<Word>(n, 1, 1, 1, 0), sum);
    const GradientStage s = stage_of(GradientRule::sobel, 5, 15);  // 32 times the gradient: nothing is lost
    EXPECT_EQ(gradient_of(s, n, {0, 0, 0})[0], sum);
}

TEST(Gradient, SamplesToEitherSideAreHalved) {
    GradientStage s;
    s.to_gradient = Rescale(12 + 1, Spec{{13, 12, true}});
    EXPECT_EQ(sample_difference<Word>(s, 300 << 12, 100 << 12), 100 << 12);
    EXPECT_EQ(sample_difference<Word>(s, 0, 4095 << 12), -(Word{4095} << 11));
}

/// Confidence in u1.15 up to a floor of raw units.
GradientStage fading_stage(double floor) {
    GradientStage s = stage_of(GradientRule::central, 8, 15);
    s.confidence_fraction = 15;
    s.to_confidence = Rescale(0, Spec{{1, 15, false}, Rounding::rnd_conv, Overflow::sat});
    fade_in_up_to(s, floor);
    return s;
}

TEST(Confidence, IsOneFromTheFloorOnAndNearTheRatioBelow) {
    std::mt19937_64 random(9);
    for (const double floor : {1.0, 2.5, 100.0, 16384.0, 32767.0, 40000.0, 1e6, 1.6e7}) {
        const GradientStage s = fading_stage(floor);
        for (int i = 0; i < 20'000; ++i) {
            const double size = floor * static_cast<double>(random() % 4000) / 2000;
            const auto component = [&] {
                return static_cast<Word>(size * (static_cast<double>(random() >> 11) * 0x1p-52 - 1));
            };
            const Vector g{component(), component(), component()};
            const double length = length_of(g, 1), part = std::min(1.0, length / std::floor(floor));
            const Word k = confidence(s, g);
            ASSERT_LE(k, 1 << 15);
            ASSERT_NEAR(static_cast<double>(k) * 0x1p-15, part, 0x1p-13 + 0x1p-16) << floor;
            if (length >= floor) {
                ASSERT_EQ(k, 1 << 15) << g[0] << ' ' << g[1] << ' ' << g[2];
            }
        }
        EXPECT_EQ(confidence(s, Vector{0, 0, 0}), 0);
    }
}

TEST(Confidence, NeverFallsAsAGradientGrows) {
    for (const double floor : {3.0, 900.0, 70000.0}) {
        const GradientStage s = fading_stage(floor);
        Word before = 0;
        for (Word x = 0; x <= static_cast<Word>(2 * floor); x += 1 + static_cast<Word>(floor) / 2000) {
            const Word k = confidence(s, Vector{x, -x / 3, x / 2});
            ASSERT_GE(k, before) << x;
            before = k;
        }
        EXPECT_EQ(before, 1 << 15);
    }
}

// 2^-40 of 8 bits' range, in levels: a rounding in doubles leaves 1e-13.
TEST(Normalise, InDoublesARoundingOfZeroIsZero) {
    GradientStage s = stage_of(GradientRule::central, 8, 15);
    s.to_normal.active = false;
    s.vanishing = kVanishing * 255 * 256;
    const auto normal_of = [&](double x) {
        return normalise(s, std::array<Real<double>, 3>{{{x * 256}, {0}, {-0.0}}});
    };
    for (const double x : {0.0, 1.1e-13, -2.3e-10}) EXPECT_EQ(normal_of(x)[0].v, 0) << x;
    EXPECT_EQ(normal_of(2.4e-10)[0].v, -32768);
    EXPECT_EQ(normal_of(-1e-3)[0].v, 32768);
}

TEST(Gradient, IntervalsHoldEveryFieldsGradientAndNormal) {
    std::mt19937_64 random(8);
    for (const GradientRule rule : kVoxelRules)
        for (int i = 0; i < 2000; ++i) {
            const auto rounding = static_cast<Rounding>(random() % 4);
            GradientStage s =
                stage_of(rule, static_cast<int>(random() % 13), 8 + static_cast<int>(random() % 9), rounding);
            Neighbourhood<Word> n;
            Neighbourhood<Range> all;
            all.voxel.fill(Range{0, 4095});
            for (Word& v : n.voxel)
                v = random() % 2 ? 4095 : static_cast<Word>(random() % 4096) & -(random() % 2);
            const auto weight = [&] { return static_cast<Word>(random() % 257); };
            const Range one{0, 256};
            const Vector gradient = gradient_of(s, n, {weight(), weight(), weight()});
            std::array<Range, 3> range;
            for (int axis = 0; axis < 3; ++axis)
                range[static_cast<std::size_t>(axis)] =
                    voxel_difference(s, all, std::array<Range, 3>{one, one, one}, axis);
            const Vector normal = normalise(s, gradient);
            const std::array<Range, 3> normals = normalise(s, range);
            for (std::size_t a = 0; a < 3; ++a) {
                ASSERT_TRUE(range[a].low <= gradient[a] && gradient[a] <= range[a].high);
                ASSERT_TRUE(normals[a].low <= normal[a] && normal[a] <= normals[a].high);
            }
        }
}

}  // namespace
}  // namespace squint
