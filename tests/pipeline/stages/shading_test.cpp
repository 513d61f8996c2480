// Stage 5's hard cases: dot products at and beyond one, powers, lights that add up, and what stays dark.
#include "pipeline/stages/shading-inl.h"

#include "pipeline/plan/plan.h"

#include "core/portable_math.h"
#include "fixedpoint/words.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;
using Vector = std::array<Word, 3>;

constexpr Word kOne = 1 << 15;                  // of every wire here but light and material
constexpr int kMaterial = 14, kLightBits = 14;  // as in the preset `default`

Spec unsigned_spec(int fraction_bits, Rounding rounding = Rounding::rnd_conv) {
    return {{1, fraction_bits, false}, rounding, Overflow::sat};
}
Spec signed_spec(int fraction_bits) {
    return {{1, fraction_bits, true}, Rounding::rnd_conv, Overflow::sat};
}

void set_power(ShadingStage& s, PowerRule rule, int exponent, int fraction_bits,
               Rounding rounding = Rounding::rnd_conv) {
    const Spec power = unsigned_spec(fraction_bits, rounding);
    s.power = rule, s.power_fraction = fraction_bits;
    s.squarings = static_cast<int>(bit_length(Word{exponent})) - 1;
    s.parabola_slope = exponent + 1;
    s.power_table_bits = std::min(10, fraction_bits);
    s.power_table = Table((1 << s.power_table_bits) + 1, 1);
    for (int i = 0; i <= 1 << s.power_table_bits; ++i)
        s.power_table.set(i, 0, portable::pow(std::ldexp(i, -s.power_table_bits), exponent), power);
    s.to_power_input = Rescale(15, power);
    s.to_power = Rescale(2 * fraction_bits, power);
    s.to_power_lerp = Rescale(2 * fraction_bits - s.power_table_bits, power);
    s.to_fall = Rescale(fraction_bits + 1, power);
    s.to_specular_sum = Rescale(fraction_bits + kMaterial, unsigned_spec(15));
}

void add_light(ShadingStage& s, const Vec3& towards, const Vec3& half) {
    const auto l = static_cast<std::size_t>(s.lights++);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        s.light[l][a] = quantise_real(towards[axis], s.light_spec);
        s.half[l][a] = quantise_real(half[axis], s.light_spec);
        s.color[l][a] = 1 << kMaterial;
    }
}

/// As plan.cpp builds it: straight colours, squarings to 64, no light yet.
ShadingStage stage_of(double ka, double kd, double ks, ShadingModel model = ShadingModel::blinn_phong) {
    const Spec material = unsigned_spec(kMaterial), intensity = unsigned_spec(15);
    ShadingStage s;
    s.model = model;
    s.color_fraction = s.normal_fraction = s.dot_fraction = s.intensity_fraction = 15;
    s.light_fraction = kLightBits, s.material_fraction = kMaterial;
    s.light_spec = signed_spec(kLightBits);
    s.ka = quantise_real(ka, material), s.kd = quantise_real(kd, material),
    s.ks = quantise_real(ks, material);
    set_power(s, PowerRule::squaring, 64, 15);
    s.to_dot = Rescale(15 + kLightBits, signed_spec(15));
    s.to_light_view = Rescale(2 * kLightBits, signed_spec(15));
    s.to_reflected = Rescale(30, signed_spec(15));
    s.to_diffuse_sum = Rescale(15 + kMaterial, intensity);
    s.to_diffuse = s.to_specular = Rescale(kMaterial + 15, intensity);
    s.to_lit = Rescale(30, unsigned_spec(15));
    s.to_faded = Rescale(30, intensity);
    s.gooch.to_faded = Rescale(30, signed_spec(15)), s.gooch.to_side = Rescale(16, intensity);
    return s;
}

ShadingStage lit_from_above(double ka, double kd, double ks, ShadingModel model = ShadingModel::blinn_phong) {
    ShadingStage s = stage_of(ka, kd, ks, model);
    add_light(s, Vec3(0, 0, 1), Vec3(0, 0, 1));
    return s;
}

/// A slab of one colour in every channel, opaque unless told.
Word lit(const ShadingStage& s, const Vector& normal, Word color, Word alpha = kOne,
         const Vector& view = {0, 0, 1 << kLightBits}) {
    RayWords<Word> ray{};
    ray.view = view;
    Vector channels{color, color, color};
    shade(s, ray, normal, alpha, channels);
    EXPECT_EQ(channels[0], channels[1]);
    EXPECT_EQ(channels[0], channels[2]);
    return channels[0];
}

// C5.1
TEST(Shading, WhereAllVectorsAgreeDiffuseAndHighlightAreOne) {
    for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong}) {
        EXPECT_EQ(lit(lit_from_above(0, 1, 0, model), {0, 0, kOne}, 12345), 12345);
        EXPECT_EQ(lit(lit_from_above(0, 0, 1, model), {0, 0, kOne}, 12345), kOne);
    }
    for (const PowerRule rule : {PowerRule::squaring, PowerRule::parabola, PowerRule::table}) {
        ShadingStage s = lit_from_above(0, 0, 1);
        set_power(s, rule, 64, 15);
        EXPECT_EQ(power(s, kOne), kOne);
        EXPECT_EQ(power(s, Word{0}), 0);
    }
}

// C5.2
TEST(Shading, ADotProductBeyondOneIsOne) {
    const ShadingStage s = lit_from_above(0, 0, 1);
    EXPECT_EQ(lit(s, {0, 0, kOne + 1}, 0), kOne);  // unclamped, the 64th power would be one and 64 last bits
    EXPECT_EQ(lit(lit_from_above(0, 1, 0), {0, 0, kOne + 1}, 20000), 20000);
}

// C5.3
TEST(Shading, ASurfaceAlongOrAwayFromTheLightHasAmbientOnly) {
    for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong, ShadingModel::cone}) {
        const ShadingStage s = lit_from_above(0.25, 0.5, 0.25, model);
        const Word ambient = 20000 / 4;
        EXPECT_EQ(lit(s, {kOne, 0, 0}, 20000), ambient);
        EXPECT_EQ(lit(s, {kOne, 0, -1}, 20000), ambient);
        EXPECT_EQ(lit(s, {0, 0, -kOne}, 20000), ambient);
    }
}

// C5.10: nothing jumps where a surface turns away.
TEST(Shading, TheTerminatorIsContinuous) {
    const ShadingStage s = lit_from_above(0.25, 0.75, 0);
    for (Word tilt = -4; tilt < 4; ++tilt)
        EXPECT_LE(lit(s, {kOne, 0, tilt + 1}, kOne) - lit(s, {kOne, 0, tilt}, kOne), 1);
}

// C5.4
TEST(Shading, ThePowerNeverFallsAsItsArgumentRises) {
    for (const PowerRule rule : {PowerRule::squaring, PowerRule::parabola, PowerRule::table})
        for (const Rounding rounding : {Rounding::trn, Rounding::rnd, Rounding::rnd_conv})
            for (const int exponent : {1, 2, 32, 64}) {
                ShadingStage s = stage_of(0, 0, 1);
                set_power(s, rule, exponent, 15, rounding);
                Word before = 0;
                for (Word x = 0; x <= kOne; ++x) {
                    const Word p = power(s, x);
                    ASSERT_GE(p, before) << x;
                    ASSERT_LE(p, kOne);
                    before = p;
                }
            }
}

// C5.4: each squaring doubles what the ones before it left; measured over all 65537 words of u1.16.
TEST(Shading, SixSquaringsAtSixteenBitsAreWithinTheirBounds) {
    for (const auto& [rounding, bound] : {std::pair{Rounding::trn, 6.9e-4}, {Rounding::rnd, 2.9e-4}}) {
        ShadingStage s = stage_of(0, 0, 1);
        set_power(s, PowerRule::squaring, 64, 16, rounding);
        s.to_power_input = Rescale(16, unsigned_spec(16));
        double worst = 0;
        for (Word x = 0; x <= 65536; ++x) {
            double exact = static_cast<double>(x) / 65536;
            for (int i = 0; i < 6; ++i) exact *= exact;
            worst = std::max(worst, std::abs(static_cast<double>(power(s, x)) / 65536 - exact));
        }
        EXPECT_LE(worst, bound);
        EXPECT_GE(worst, 0.95 * bound);
    }
}

TEST(Shading, TheTableOfPowersIsWithinItsBound) {
    // p^2 / 8 / 2^20 from lines between 1024 rows, half a last bit from a row, half from the result.
    for (const int exponent : {2, 16, 50, 64}) {
        ShadingStage s = stage_of(0, 0, 1);
        set_power(s, PowerRule::table, exponent, 15);
        const double bound = exponent * exponent / 8.0 / 1048576 + 1.0 / kOne;
        for (Word x = 0; x <= kOne; ++x)
            ASSERT_NEAR(static_cast<double>(power(s, x)) / kOne,
                        std::pow(static_cast<double>(x) / kOne, exponent), bound)
                << x;
    }
}

TEST(Shading, TheParabolaIsItsFormula) {
    ShadingStage s = stage_of(0, 0, 1);
    set_power(s, PowerRule::parabola, 31, 15);  // 1 - 16 (1 - x)
    for (Word x = 0; x <= kOne; ++x) ASSERT_EQ(power(s, x), std::max<Word>(0, kOne - 16 * (kOne - x)));
}

// An exponent of 32.5 falls by 16.75 (1 - x): its half is not lost.
TEST(Shading, TheParabolaKeepsTheFractionOfItsExponent) {
    const Scene scene = scene_with(built_in_scene(), {"volume.procedural=sphere", "volume.dims=8",
                                                      "shading.power=parabola", "shading.exponent=32.5"});
    const Plan plan = test::plan_of(scene);
    const Word one = Word{1} << plan.shading.power_fraction;
    for (const Word below : {Word{1}, Word{64}, one / 64, one / 20})
        EXPECT_EQ(power(plan.shading, one - below),
                  one - quantise(67 * below, Rescale(2, {{20, 0, false}, Rounding::rnd_conv})));
}

TEST(Shading, AConeIsItsFormulaWhateverThePowerRule) {
    for (const PowerRule rule : {PowerRule::squaring, PowerRule::table}) {
        ShadingStage s = lit_from_above(0, 0, 1, ShadingModel::cone);
        set_power(s, rule, 31, 15);
        s.parabola_slope = 32;  // half of it: 1 - 16 (1 - x), the energy of exponent 31
        for (Word x = 0; x <= kOne; x += 7)
            ASSERT_EQ(lit(s, {0, 0, x}, 0), std::max<Word>(0, kOne - 16 * (kOne - x)));
        s.parabola_slope = 62;  // the paper's
        EXPECT_EQ(lit(s, {0, 0, kOne - 100}, 0), kOne - 3100);
    }
}

/// A quarter of the matter's colour and blue on the cool side, half of it and yellow on the warm one.
ShadingStage gooch_stage() {
    ShadingStage s = lit_from_above(0, 0, 0, ShadingModel::gooch);
    s.gooch.share = {1 << (kMaterial - 2), 1 << (kMaterial - 1)};
    s.gooch.tone = {{{0, 1 << (kMaterial - 2)}, {0, 1 << (kMaterial - 2)}, {1 << (kMaterial - 1), 0}}};
    return s;
}
Vector gooch(const ShadingStage& s, const Vector& normal, Word confidence = kOne) {
    Vector color{16000, 16000, 16000};
    shade(s, RayWords<Word>{}, normal, kOne, color, confidence);
    return color;
}

TEST(Shading, GoochGoesFromCoolToWarmAsASurfaceTurnsToTheLight) {
    ShadingStage s = gooch_stage();
    const Vector cool{4000, 4000, 4000 + kOne / 2}, warm{8000 + kOne / 4, 8000 + kOne / 4, 8000};
    const Vector between{6000 + kOne / 8, 6000 + kOne / 8, 6000 + kOne / 4};  // not nothing: N.L is zero
    EXPECT_EQ(gooch(s, {0, 0, kOne}), warm);
    EXPECT_EQ(gooch(s, {0, 0, -kOne}), cool);
    EXPECT_EQ(gooch(s, {kOne, 0, 0}), between);
    EXPECT_EQ(gooch(s, {0, 0, 0}), between);
    s.fades = true;
    EXPECT_EQ(gooch(s, {0, 0, kOne}, 0), between);
    EXPECT_EQ(gooch(s, {0, 0, kOne}, kOne), warm);
    s.gooch.cool_to_light = true;  // as printed
    EXPECT_EQ(gooch(s, {0, 0, kOne}), cool);
    EXPECT_EQ(gooch(s, {0, 0, -kOne}), warm);
}

TEST(Shading, GoochIsHeldToTheOpacity) {
    ShadingStage s = gooch_stage();
    s.gooch.share = {1 << kMaterial, 1 << kMaterial};
    for (auto& tone : s.gooch.tone) tone = {1 << kMaterial, 1 << kMaterial};
    EXPECT_EQ(gooch(s, {0, 0, kOne}), (Vector{kOne, kOne, kOne}));
    s.premultiplied = true;
    Vector color{2000, 2000, 2000};
    shade(s, RayWords<Word>{}, Vector{0, 0, kOne}, Word{3000}, color, kOne);
    EXPECT_EQ(color, (Vector{3000, 3000, 3000}));
}

// C5.5
TEST(Shading, WeightsThatSumToOneLightWhiteToOneAndLightsSaturate) {
    EXPECT_EQ(lit(lit_from_above(0.25, 0.5, 0.25), {0, 0, kOne}, kOne), kOne);
    for (const auto& [ka, kd, ks] : {std::array{0.1, 0.6, 0.3}, {0.3, 0.3, 0.4}, {1 / 3.0, 1 / 3.0, 1 / 3.0}})
        EXPECT_LE(lit(lit_from_above(ka, kd, ks), {0, 0, kOne}, kOne), kOne + 2);  // three roundings of 2^-15
    ShadingStage s = stage_of(0, 1, 0);
    for (int l = 0; l < kMostLights; ++l) add_light(s, Vec3(0, 0, 1), Vec3(0, 0, 1));
    EXPECT_EQ(lit(s, {0, 0, kOne}, 30000), 30000);
    s.kd = 0, s.ks = 1 << kMaterial;
    EXPECT_EQ(lit(s, {0, 0, kOne}, 0), kOne);
}

// C5.6
TEST(Shading, AZeroNormalHasAmbientOnly) {
    for (const bool two_sided : {false, true})
        for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong, ShadingModel::cone})
            for (const PowerRule rule : {PowerRule::squaring, PowerRule::parabola, PowerRule::table}) {
                ShadingStage s = lit_from_above(0.5, 0.25, 0.25, model);
                set_power(s, rule, 8, 15);
                s.two_sided = two_sided;
                // A view from below the light: L.V is negative, so that -L.V alone would shine.
                EXPECT_EQ(lit(s, {0, 0, 0}, 20000, kOne, {0, 0, -(1 << kLightBits)}), 10000);
            }
}

// C5.7
TEST(Shading, OneTimesOneInSixteenBitsDoesNotOverflow) {
    ShadingStage s = stage_of(0, 0, 1);
    set_power(s, PowerRule::squaring, 64, 16);
    s.to_power_input = Rescale(16, unsigned_spec(16));
    EXPECT_EQ(power(s, Word{65536}), 65536);
    Range::needs = {};
    static_cast<void>(power(s, Range{0, 65536}));
    EXPECT_GT(Range::needs.result_bits, 32);  // 2^32 and a sign: the plan asks for a wider word
}

// C5.11
TEST(Shading, ATransparentSlabHasNoHighlight) {
    ShadingStage s = lit_from_above(0.25, 0.5, 0.25);
    s.premultiplied = true;
    EXPECT_EQ(lit(s, {0, 0, kOne}, 0, 0), 0);
    EXPECT_EQ(lit(s, {0, 0, kOne}, 100, 400), 175);  // 100 (ka + kd) + 400 ks
}

TEST(Shading, WhatALightAddsIsWeighedByConfidence) {
    std::mt19937_64 random(5);
    ShadingStage s = lit_from_above(0.25, 0.5, 0.25), fading = s;
    fading.fades = true;
    for (int i = 0; i < 2000; ++i) {
        const auto component = [&] { return static_cast<Word>(random() % 65537) - kOne; };
        const Vector n{component(), component(), component()};
        const auto faded = [&](Word confidence) {
            Vector color{25000, 25000, 25000};
            shade(fading, RayWords<Word>{}, n, kOne, color, confidence);
            return color[0];
        };
        const Word full = lit(s, n, 25000), ambient = 6250;
        ASSERT_EQ(faded(kOne), full);
        ASSERT_EQ(faded(0), ambient);
        // Two of four roundings to a half, each of a weight below one, and the last one's own.
        ASSERT_NEAR(static_cast<double>(faded(kOne / 4)), ambient + static_cast<double>(full - ambient) / 4,
                    2.5);
    }
}

TEST(Shading, BothSidesOfASurfaceAreLitAlikeWhereTheSceneSaysSo) {
    std::mt19937_64 random(1);
    for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong}) {
        ShadingStage s = stage_of(0.2, 0.5, 0.3, model);
        add_light(s, Vec3(0.6, 0, 0.8), Vec3(0.28, 0, 0.96));
        s.two_sided = true;
        set_power(s, PowerRule::squaring, 4, 15);
        for (int i = 0; i < 2000; ++i) {
            const auto component = [&] { return static_cast<Word>(random() % 32769) - 16384; };
            const Vector n{component(), component(), component()};
            ASSERT_EQ(lit(s, n, 25000), lit(s, {-n[0], -n[1], -n[2]}, 25000));
        }
    }
}

TEST(Shading, PhongReflectsTheLightAboutTheNormal) {
    // N = (0, 0, 1), L = (0.6, 0, 0.8): R = (-0.6, 0, 0.8), seen along R the highlight is one.
    ShadingStage s = stage_of(0, 0, 1, ShadingModel::phong);
    add_light(s, Vec3(0.6, 0, 0.8), Vec3(0, 0, 1));
    set_power(s, PowerRule::squaring, 1, 15);
    const auto towards = [](double x, double z) {
        return Vector{quantise_real(x, signed_spec(kLightBits)), 0,
                      quantise_real(z, signed_spec(kLightBits))};
    };
    // Half a last bit of each s1.14 component, twice over in 2 (N.L)(N.V): 4 last bits of 15 at most.
    EXPECT_NEAR(static_cast<double>(lit(s, {0, 0, kOne}, 0, kOne, towards(-0.6, 0.8))), kOne, 4);
    EXPECT_NEAR(static_cast<double>(lit(s, {0, 0, kOne}, 0, kOne, towards(0, 1))), 0.8 * kOne, 4);
    EXPECT_NEAR(static_cast<double>(lit(s, {0, 0, kOne}, 0, kOne, towards(0.6, 0.8))), 0.28 * kOne, 4);
}

TEST(Shading, ColouredLightsTintTheirOwnChannelOnly) {
    ShadingStage s = lit_from_above(0, 1, 0);
    s.white = false;
    s.color[0] = {1 << kMaterial, 1 << (kMaterial - 1), 0};
    Vector color{20000, 20000, 20000};
    shade(s, RayWords<Word>{}, Vector{0, 0, kOne}, kOne, color);
    EXPECT_EQ(color, (Vector{20000, 10000, 0}));
}

TEST(Shading, IntervalsHoldEveryLitColour) {
    std::mt19937_64 random(2);
    for (int i = 0; i < 800; ++i) {
        constexpr ShadingModel kModels[] = {ShadingModel::phong, ShadingModel::blinn_phong,
                                            ShadingModel::cone, ShadingModel::gooch};
        ShadingStage s = stage_of(0.3, 0.5, 0.4, kModels[random() % 4]);
        s.fades = random() % 2, s.gooch.cool_to_light = random() % 2;
        for (std::size_t side = 0; side < 2; ++side) {
            s.gooch.share[side] = static_cast<Word>(random() % ((1 << kMaterial) + 1));
            for (auto& tone : s.gooch.tone) tone[side] = static_cast<Word>(random() % ((1 << kMaterial) + 1));
        }
        const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
        for (int l = static_cast<int>(random() % 3); l >= 0; --l)
            add_light(s, Vec3(unit(), unit(), unit()).normalized(),
                      Vec3(unit(), unit(), unit()).normalized());
        s.two_sided = random() % 2, s.premultiplied = random() % 2;
        set_power(s, static_cast<PowerRule>(random() % 3), 1 << random() % 7, 15,
                  static_cast<Rounding>(random() % 4));
        RayWords<Word> ray{};
        RayWords<Range> rays{};
        const auto word = [&](Word one) {
            return static_cast<Word>(random() % static_cast<std::uint64_t>(2 * one + 1)) - one;
        };
        std::array<Range, 3> normals, colors;
        Vector normal, color;
        for (std::size_t a = 0; a < 3; ++a) {
            ray.view[a] = word(1 << kLightBits), rays.view[a] = {-(1 << kLightBits), 1 << kLightBits};
            normal[a] = word(kOne), normals[a] = {-kOne, kOne};
            color[a] = std::abs(word(kOne)), colors[a] = {0, kOne};
        }
        shade(s, ray, normal, std::abs(word(kOne)), color, std::abs(word(kOne)));
        shade(s, rays, normals, Range{0, kOne}, colors, Range{0, kOne});
        for (std::size_t a = 0; a < 3; ++a)
            ASSERT_TRUE(colors[a].low <= color[a] && color[a] <= colors[a].high) << i;
    }
}

}  // namespace
}  // namespace squint
