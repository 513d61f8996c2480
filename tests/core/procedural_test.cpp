#include "core/procedural.h"

#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace squint {
namespace {

using testing::ElementsAre;

const ProceduralField& named(const char* name) {
    const ProceduralField* field = find_procedural(name);
    if (!field) throw std::logic_error(name);
    return *field;
}

TEST(Procedural, HasTheFieldsOfTheSceneReference) {
    std::vector<std::string> names;
    for (const ProceduralField& field : procedural_fields()) names.push_back(field.name);
    EXPECT_THAT(names, ElementsAre("phantom", "sphere", "marschner_lobb", "shells", "ramp", "constant", "fog",
                                   "polynomial", "noisy_sphere"));
    EXPECT_EQ(find_procedural("sphare"), nullptr);
}

class EveryField : public testing::TestWithParam<std::string> {};

TEST_P(EveryField, StaysWithinZeroAndOne) {
    const ProceduralField& field = named(GetParam().c_str());
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 20000; ++i) {
        const Vec3 p{unit(random), unit(random), unit(random)};
        const double value = field.value(p);
        EXPECT_TRUE(value >= 0 && value <= 1) << p << " " << value;
    }
}

// A central difference of a smooth field errs by c h^2: the difference of two steps, h and h / 2, is 3/4 c
// h^2 and bounds the better one's error of 1/4 c h^2.  Rounding adds at most 2^-52 of 1 at each end, times 64
// for the operations of a field.
TEST_P(EveryField, TheGradientIsTheDerivativeOfTheValue) {
    const ProceduralField& field = named(GetParam().c_str());
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> unit(0, 1);
    const double h = 1e-5, rounding = 64 * 2 * 0x1p-52 / h;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 p{unit(random), unit(random), unit(random)};
        const Vec3 gradient = field.gradient(p);
        for (int axis = 0; axis < 3; ++axis) {
            const auto slope = [&](double step) {
                Vec3 before = p, after = p;
                before[axis] -= step, after[axis] += step;
                return (field.value(after) - field.value(before)) / (2 * step);
            };
            const double coarse = slope(h), fine = slope(h / 2);
            EXPECT_NEAR(gradient[axis], fine, std::abs(coarse - fine) + rounding) << p << " axis " << axis;
        }
    }
}

TEST_P(EveryField, GradientsAreFiniteAtTheMiddleAndTheCorners) {
    const ProceduralField& field = named(GetParam().c_str());
    for (const double x : {0.0, 0.5, 1.0})
        for (const double y : {0.0, 0.5, 1.0})
            for (const double z : {0.0, 0.5, 1.0})
                for (int axis = 0; axis < 3; ++axis)
                    EXPECT_TRUE(std::isfinite(field.gradient({x, y, z})[axis]));
}

INSTANTIATE_TEST_SUITE_P(Fields, EveryField,
                         testing::Values("phantom", "sphere", "marschner_lobb", "shells", "ramp", "constant",
                                         "fog", "polynomial", "noisy_sphere"),
                         [](const auto& test) { return test.param; });

TEST(Procedural, ScalarsAreTheRoundedValuesAtVoxelCentres) {
    const Volume volume = make_procedural(named("ramp"), {256, 2, 3}, 8);
    EXPECT_EQ(volume.type, ScalarType::u8);
    EXPECT_EQ(volume.scalar_bits, 8);
    for (std::int64_t x = 0; x < 256; ++x) EXPECT_EQ(volume.at(x, 1, 2), x);
    EXPECT_EQ(volume.smallest, 0u);
    EXPECT_EQ(volume.largest, 255u);
}

TEST(Procedural, FogIsOneUnitAtEightBits) {
    const Volume volume = make_procedural(named("fog"), {3, 3, 3}, 8);
    EXPECT_EQ(volume.smallest, 1u);
    EXPECT_EQ(volume.largest, 1u);
}

TEST(Procedural, ConstantIsHalfOfFullScaleRoundedUp) {
    EXPECT_EQ(make_procedural(named("constant"), {1, 1, 1}, 12).at(0, 0, 0), 2048u);
}

TEST(Procedural, AnAxisOfOneVoxelIsSampledInItsMiddle) {
    EXPECT_EQ(make_procedural(named("ramp"), {1, 4, 4}, 8).at(0, 0, 0), 128u);
}

TEST(Procedural, MarschnerLobbHasItsClosedFormOnTheAxis) {
    // On the axis the ripple is cos(12 pi) = 1: (1 - sin(pi z / 2) + 1/2) / 2.5, z from -1 to 1.
    const ProceduralField& field = named("marschner_lobb");
    // portable::cos and sin err by at most 2^-50, the argument 12 pi by 2^-47 where the cosine is flat; the
    // rest is exact or rounds below 2^-52: 2^-46 is above their sum.
    for (const double z : {0.0, 0.25, 0.5, 0.75, 1.0})
        EXPECT_NEAR(field.value({0.5, 0.5, z}), (1.5 - std::sin(M_PI * (z - 0.5))) / 2.5, 0x1p-46) << z;
}

TEST(Procedural, ThePhantomHasEveryLevelOnItsWay) {
    // From the front inwards, a little above the middle: air, bone of the brow, brain.
    const ProceduralField& field = named("phantom");
    EXPECT_EQ(field.value({0.5, 0.0, 0.65}), 0);
    bool skin = false, tissue = false, bone = false, brain = false, vessel = false;
    for (int i = 0; i < 4000; ++i)
        for (const double z : {0.62, 0.55}) {
            const double value = field.value({0.55, i / 4000.0, z});
            skin |= std::abs(value - 0.16) < 1e-3;
            tissue |= std::abs(value - 0.32) < 1e-3;
            bone |= std::abs(value - 0.55) < 1e-3;
            brain |= std::abs(value - 0.72) < 1e-3;
            vessel |= value > 0.9;
        }
    EXPECT_TRUE(skin && tissue && bone && brain && vessel) << skin << tissue << bone << brain << vessel;
}

TEST(Procedural, IsTheSameVolumeEveryTime) {
    const Volume a = make_procedural(named("phantom"), {32, 32, 32}, 12);
    const Volume b = make_procedural(named("phantom"), {32, 32, 32}, 12);
    EXPECT_EQ(a.content_hash, b.content_hash);
    EXPECT_NE(a.content_hash, make_procedural(named("phantom"), {32, 32, 32}, 11).content_hash);
}

// The hash is of the voxels of the whole formula, before it was spared where its value is known.
TEST(Procedural, ThePhantomIsThatOfItsWholeFormula) {
    EXPECT_EQ(make_procedural(named("phantom"), {97, 97, 97}, 16).content_hash,
              "c1d507e5a443376d75822e9cd0c4ed05");
}

TEST(Procedural, RefusesBitsSizesAndSpacingsThatCannotBe) {
    EXPECT_THROW(make_procedural(named("ramp"), {2, 2, 2}, 17), InputError);
    EXPECT_THROW(make_procedural(named("ramp"), {2, 0, 2}, 8), InputError);
    EXPECT_THROW(make_procedural(named("ramp"), {2, 2, 2}, 8, {1, -1, 1}), InputError);
}

}  // namespace
}  // namespace squint
