// shading.gradient cubic_spline, and shading.exaggeration: stage 3's rules beside differences and lerps.
#include "pipeline/render.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/faces.h"
#include "pipeline/stages/gradient-inl.h"
#include "tests/pipeline/stages/neighbourhoods.h"
#include "tests/truth/reference_cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using namespace cases;
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
Vector gradient_of(const Neighbourhood<Word>& n, const Vector& weight) {
    return gradient_of(spline_stage(), n, weight);
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
            const int half = t / 2;
            const double x = t / 8.0, y = (8 - t) / 8.0, z = half / 8.0;
            const Vector found = gradient_of(field, {t * 32, (8 - t) * 32, half * 32});
            const double exact[] = {2 * a * x + b * y + a * b, b * x + 2 * c * y + e * z, 2 * d * z + e * y};
            // Three levels round, the first two times the sums of |weights|, 1.25 each.
            for (std::size_t axis = 0; axis < 3; ++axis)
                ASSERT_NEAR(static_cast<double>(found[axis]), exact[axis] * (1 << kFraction),
                            0.5 + 0.625 + 0.79);
        }
    }
}

// ------------------------------------------------------------------------------------ exaggeration

Plan lit_plan(const std::shared_ptr<const Volume>& volume, double exaggeration, const char* preset,
              GradientRule rule = GradientRule::central) {
    Scene scene = plain_scene(5, 5);
    scene.transfer_function.points = {{0, 1, 0.5, 0.25, 0.3}};
    scene.classification.method = Method::pips;
    scene.lights = {{.headlight = true}};
    scene.shading = {.gradient = rule, .exaggeration = exaggeration};
    scene.precision.preset = preset;
    look(scene, *volume, Vec3(1, 2, 3));
    return make_plan(scene, volume);
}
std::shared_ptr<const Volume> bumpy() {
    return volume_of({12, 11, 10}, 12, Vec3(1, 1.5, 1), [](const Index3& p) {
        return 2000 + 50 * static_cast<double>(p.z) +
               400 * std::sin(static_cast<double>(p.x * p.x + 3 * p.y));
    });
}
/// The vector that the stages make of a place's voxels, over its length; and by doubles, from its definition.
struct Turned {
    Vec3 found, exact;
};
Turned turned_at(const Plan& plan, const Index3& cell, const Vec3& place) {
    const Volume& v = *plan.volume;
    const FromVolume voxels{v};
    const std::array<Word, 3> at{cell.x, cell.y, cell.z};
    const double one = 1 << plan.gradient.weight_bits;
    const std::array<Word, 3> weight{static_cast<Word>(place.x * one), static_cast<Word>(place.y * one),
                                     static_cast<Word>(place.z * one)};
    Vector gradient, mean;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        gradient[a] = to_world(plan.gradient,
                               voxel_difference(plan.gradient, voxels.neighbourhood(at), weight, axis), axis);
        mean[a] = to_world(plan.box_gradient,
                           voxel_difference(plan.box_gradient, voxels.box_sums(at), weight, axis), axis);
    }
    const Vector raw = exaggerated(plan.gradient, plan.box_gradient, gradient, mean);
    // Trilinear in central differences of voxels, and of means over the 5^3 voxels about each.
    const auto difference = [&](const Index3& p, int axis) {
        const Index3 e(axis == 0, axis == 1, axis == 2);
        const auto voxel = [&](const Index3& q) {
            return static_cast<double>(
                v.at(voxel_at(q.x, v.dims.x), voxel_at(q.y, v.dims.y), voxel_at(q.z, v.dims.z)));
        };
        return (voxel(p + e) - voxel(p - e)) / 2 * v.smallest_spacing() / v.spacing[axis];
    };
    const auto interpolated = [&](auto&& at_voxel) {
        Vec3 sum(0);
        for (int i = 0; i < 8; ++i) {
            const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
            const double w =
                (x ? place.x : 1 - place.x) * (y ? place.y : 1 - place.y) * (z ? place.z : 1 - place.z);
            for (int axis = 0; axis < 3; ++axis) sum[axis] += w * at_voxel(cell + Index3(x, y, z), axis);
        }
        return sum;
    };
    const Vec3 g = interpolated(difference);
    const Vec3 m = interpolated([&](const Index3& p, int axis) {
        double sum = 0;
        for (int i = 0; i < 125; ++i)
            sum += difference(p + Index3(i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2), axis);
        return sum / 125;
    });
    const Vec3 n = g * (-1 / g.length()), around = m * (-1 / m.length());
    const Vec3 exact = (n + (n - around) * plan.scene.shading.exaggeration).normalized();
    const Vec3 words(static_cast<double>(raw[0]), static_cast<double>(raw[1]), static_cast<double>(raw[2]));
    return {words * (-1 / words.length()), exact};
}

// Inside the volume, where no voxel is repeated, the gradient of sums is the sum of gradients.
TEST(Exaggeration, TurnsTheNormalFromTheMeanOfTheGradientsAbout) {
    std::mt19937 random(9);
    const auto volume = volume_of({16, 14, 15}, 12, Vec3(1, 1.5, 1),
                                  [&](const Index3&) { return static_cast<int>(random() % 4096); });
    for (const double e : {0.5, 1.0, 4.0}) {
        const Plan plan = lit_plan(volume, e, "wide");
        for (int i = 0; i < 60; ++i) {
            const auto part = [&] { return static_cast<double>(random() % 256) / 256; };
            const Index3 cell(4 + random() % 6, 4 + random() % 5, 4 + random() % 5);
            const Turned turned = turned_at(plan, cell, Vec3(part(), part(), part()));
            // A gradient of hundreds of levels in words of 2^-14 of its length, twice, e + 1 times more.
            EXPECT_LT((turned.found - turned.exact).length(), 8 * (1 + e) * 0x1p-14) << i;
        }
    }
}

TEST(Exaggeration, KeepsANormalThatIsItsSurroundingsAndNoneWhereThereIsNone) {
    const auto ramp = volume_of({12, 12, 12}, 12, Vec3(1), [](const Index3& p) {
        return 500 + 30 * static_cast<double>(p.x) - 20 * static_cast<double>(p.y);
    });
    const Turned turned = turned_at(lit_plan(ramp, 3, "default"), Index3(5, 5, 5), Vec3(0.25, 0.5, 0.75));
    EXPECT_LT((turned.found - turned.exact).length(), 8 * 4 * 0x1p-14);
    EXPECT_LT((turned.exact - Vec3(-30, 20, 0).normalized()).length(), 1e-12);

    const auto flat = volume_of({6, 6, 6}, 12, Vec3(1), [](const Index3&) { return 700; });
    const Plan plan = lit_plan(flat, 3, "default");
    EXPECT_EQ(exaggerated(plan.gradient, plan.box_gradient, Vector{0, 0, 0}, Vector{0, 0, 0}),
              (Vector{0, 0, 0}));
    // No gradient of its own, but one about it: still none.
    EXPECT_EQ(exaggerated(plan.gradient, plan.box_gradient, Vector{0, 0, 0}, Vector{100, 5, 0}),
              (Vector{0, 0, 0}));
    // None about it: its own.
    const Vector own = exaggerated(plan.gradient, plan.box_gradient, Vector{3000, 0, 0}, Vector{0, 0, 0});
    EXPECT_EQ(own[1], 0);
    EXPECT_EQ(own[2], 0);
    EXPECT_NEAR(static_cast<double>(own[0]), 3000, 3000 * 0x1p-13);
}

TEST(Exaggeration, ZeroIsOff) {
    const Plan plan = lit_plan(bumpy(), 0, "default");
    EXPECT_FALSE(plan.gradient.exaggerated.wanted);
    for (const Wire wire : plan.used_wires) EXPECT_NE(wire, Wire::exaggeration);
}

// Without rounding and ever smaller steps both come to the reference, which integrates them on its own.
TEST(Exaggeration, AndTheSplineComeToTheReference) {
    const auto volume = bumpy();
    struct {
        double exaggeration;
        GradientRule rule;
    } const cases[] = {{0, GradientRule::cubic_spline},
                       {1.5, GradientRule::central},
                       {1.5, GradientRule::cubic_spline},
                       {0.75, GradientRule::sobel}};
    for (const auto& c : cases) {
        Scene scene = lit_plan(volume, c.exaggeration, "real", c.rule).scene;
        scene.sampling.termination = 0;
        const Image exact = render_reference(make_plan(scene, volume), {.threads = 1, .tolerance = 1e-7});
        double before = 0;
        for (const double step : {0.25, 0.0625}) {
            scene.sampling.step = step;
            const Image found = render(make_plan(scene, volume)).image;
            double most = 0;
            for (std::size_t k = 0; k < 4; ++k)
                for (std::size_t i = 0; i < found.channels[k].values.size(); ++i)
                    most = std::max(most, std::abs(static_cast<double>(found.channels[k].values[i]) -
                                                   static_cast<double>(exact.channels[k].values[i])));
            // A quarter of the step: light's corners alone keep the error from a sixteenth.
            if (before > 0) {
                EXPECT_LT(most, before / 4);
            }
            before = most;
        }
        EXPECT_LT(before, 0.5 / 255);
    }
}

}  // namespace
}  // namespace squint
