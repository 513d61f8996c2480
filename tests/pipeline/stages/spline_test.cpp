// shading.gradient cubic_spline.
#include "pipeline/stages/gradient-inl.h"

#include <gtest/gtest.h>

#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;
using Vector = std::array<Word, 3>;

constexpr int kWeightBits = 8, kOne = 1 << kWeightBits, kSplineBits = 15, kFraction = 6;

GradientStage spline_stage() {
    const Spec gradient{{13, kFraction, true}, Rounding::rnd_conv, Overflow::sat};
    GradientStage s;
    s.rule = GradientRule::cubic_spline, s.weight_bits = kWeightBits, s.spline_fraction = kSplineBits;
    s.to_spline = Rescale(3 * kWeightBits + 1, {{1, kSplineBits, true}, Rounding::rnd_conv, Overflow::sat});
    s.to_first = Rescale(kSplineBits, gradient);
    s.to_second = s.to_gradient = Rescale(kFraction + kSplineBits, gradient);
    return s;
}
template <class F>
Neighbourhood<Word> neighbourhood_of(F&& value) {
    Neighbourhood<Word> n;
    for (int i = 0; i < 64; ++i)
        n.voxel[static_cast<std::size_t>(i)] = value((i & 3) - 1, (i >> 2 & 3) - 1, (i >> 4) - 1);
    return n;
}
Vector gradient_of(const Neighbourhood<Word>& n, const Vector& weight) {
    const GradientStage s = spline_stage();
    return {voxel_difference(s, n, weight, 0), voxel_difference(s, n, weight, 1),
            voxel_difference(s, n, weight, 2)};
}

TEST(Spline, ItsWeightsSumToOneAtEveryPlaceAndAreTheMirroredPlacesMirrored) {
    const GradientStage s = spline_stage();
    for (Word t = 0; t <= kOne; ++t) {
        const auto slope = spline_slope_weights(s, t), slope_back = spline_slope_weights(s, kOne - t);
        const auto value = spline_weights(s, t), value_back = spline_weights(s, kOne - t);
        EXPECT_EQ(slope[0] + slope[1] + slope[2], 1 << kSplineBits);
        EXPECT_EQ(value[0] + value[1] + value[2] + value[3], 1 << kSplineBits);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(slope[i], slope_back[2 - i]) << t;
        for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(value[i], value_back[3 - i]) << t;
        // Of Catmull and Rom, to the half bit of a weight and what three of them leave to one.
        const double x = static_cast<double>(t) / kOne, one = 1 << kSplineBits;
        const double exact[] = {(-x + 2 * x * x - x * x * x) / 2, (2 - 5 * x * x + 3 * x * x * x) / 2,
                                (x + 4 * x * x - 3 * x * x * x) / 2, (-x * x + x * x * x) / 2};
        for (std::size_t i = 0; i < 4; ++i)
            EXPECT_NEAR(static_cast<double>(value[i]), exact[i] * one, i % 3 == 0 ? 0.5 : 2.0) << t;
    }
}

TEST(Spline, AConstantFieldHasNoGradientAndALinearOneItsOwn) {
    const auto flat = neighbourhood_of([](int, int, int) { return Word{4095}; });
    const auto linear =
        neighbourhood_of([](int x, int y, int z) { return Word{2000} + 17 * x - 40 * y + 3 * z; });
    for (const Word w : {0, 1, 77, 128, 200, 255, 256}) {
        EXPECT_EQ(gradient_of(flat, {w, kOne - w, w / 2}), (Vector{0, 0, 0}));
        EXPECT_EQ(gradient_of(linear, {w, kOne - w, w / 2}),
                  (Vector{17 << kFraction, -40 * (1 << kFraction), 3 << kFraction}));
    }
}

TEST(Spline, AtAVoxelItIsTheCentralDifference) {
    std::mt19937 random(3);
    for (int i = 0; i < 200; ++i) {
        Neighbourhood<Word> n;
        for (Word& v : n.voxel) v = static_cast<Word>(random() % 4096);
        for (int corner = 0; corner < 8; ++corner) {
            const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
            const Vector found = gradient_of(n, {x * kOne, y * kOne, z * kOne});
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_EQ(found[static_cast<std::size_t>(axis)],
                          central_difference(n, 1 + x, 1 + y, 1 + z, axis) << (kFraction - 1));
        }
    }
}

// Weights are exact at eighths of a voxel, and the spline is as good as quadratics.
TEST(Spline, AQuadraticFieldHasItsOwnSlopes) {
    std::mt19937 random(7);
    const auto some = [&] { return static_cast<int>(random() % 21) - 10; };
    for (int i = 0; i < 100; ++i) {
        const int a = some(), b = some(), c = some(), d = some(), e = some();
        const auto field = neighbourhood_of([&](int x, int y, int z) {
            return Word{2000} + a * x * x + b * x * y + c * y * y + d * z * z + e * y * z + a * b * x;
        });
        for (const int t : {0, 1, 3, 4, 5, 7, 8}) {
            const double x = t / 8.0, y = (8 - t) / 8.0, z = (t / 2) / 8.0;
            const Vector found = gradient_of(field, {t * 32, (8 - t) * 32, t / 2 * 32});
            const double exact[] = {2 * a * x + b * y + a * b, b * x + 2 * c * y + e * z, 2 * d * z + e * y};
            // Three levels round, the first two times the sums of |weights|, 1.25 each.
            for (std::size_t axis = 0; axis < 3; ++axis)
                ASSERT_NEAR(static_cast<double>(found[axis]), exact[axis] * (1 << kFraction),
                            0.5 + 0.625 + 0.79);
        }
    }
}

}  // namespace
}  // namespace squint
