// Where along a slab its light comes from (shading.inside centroid and two_point), and what two gradients make of it.
// The exact values are those of even matter, x = int tau, white, between gradients of lengths 1 and q that turn by an
// angle from the light.
#include "pipeline/slab-inl.h"
#include "tests/pipeline/stages/word_of.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using test::word_of;
using Word = std::int64_t;
using Exact = Real<double>;

Plan plan_of(const std::string& rule, const std::string& points, const std::string& preset,
             std::vector<std::string> more = {}) {
    std::vector<std::string> settings{"volume.procedural=ramp",
                                      "volume.dims=33",
                                      "volume.bits=8",
                                      "classification.method=pips",
                                      "classification.order=1",
                                      "transfer_function.unit_distance=1",
                                      "shading.model=blinn_phong",
                                      "shading.ka=0",
                                      "shading.kd=1",
                                      "shading.ks=0",
                                      "shading.exponent=32",
                                      "lights=[{headlight=true}]",
                                      "camera.projection=orthographic",
                                      "sampling.step=1",
                                      "shading.inside=" + rule,
                                      "precision.preset=" + preset,
                                      "transfer_function.points=" + points};
    settings.insert(settings.end(), more.begin(), more.end());
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}
std::string even(double x) {
    return fmt::format("[[0,1,1,1,{0:.17g}],[255,1,1,1,{0:.17g}]]", -std::expm1(-x));
}
const PrefixLookup& prefix_of(const Plan& plan) {
    return std::get<PowerSeriesOfOrder1>(plan.method).prefix;
}
/// Places of a slab of full length between two entries.
template <class W>
LightPlaces<W> places(const Plan& plan, double front, double back) {
    const double entry = std::ldexp(1.0, plan.specs[Wire::classification_input].format.fraction_bits);
    return places_of_light(plan.inside, prefix_of(plan), word_of<W>(front * entry), word_of<W>(back * entry),
                           word_of<W>(std::ldexp(1.0, plan.location.length_fraction)));
}
template <class W>
double way(W place) {
    return std::ldexp(to_double(place), -kWayBits);
}

TEST(LightPlaces, OfEvenMatterAreExact) {
    const Plan centroid = plan_of("centroid", even(1), "real"), two = plan_of("two_point", even(1), "real"),
               words = plan_of("two_point", even(1), "default");
    // Rising, falling, a part of an entry, and a point.
    for (const auto& [front, back] : {std::pair{0.0, 255.0}, {255.0, 0.0}, {7.25, 7.75}, {9.0, 9.0}}) {
        EXPECT_NEAR(way(places<Exact>(centroid, front, back).near), 0.418023293, 1e-8);
        EXPECT_NEAR(way(places<Exact>(two, front, back).near), 0.136373855, 1e-8);
        EXPECT_NEAR(way(places<Exact>(two, front, back).far), 0.699672731, 1e-8);
        // Rounded to kWayBits.
        EXPECT_NEAR(way(places<Word>(words, front, back).near), 0.136373855, 0x1p-13 + 4 * 0x1p-14);
        EXPECT_NEAR(way(places<Word>(words, front, back).far), 0.699672731, 0x1p-13 + 4 * 0x1p-14);
    }
    // Between rows of EvenMatter, and beyond the last.
    for (const double x : {0.01, 0.33, 1.71, 7.4}) {
        const double mean = 1 / x - 1 / std::expm1(x);
        EXPECT_NEAR(way(places<Exact>(plan_of("centroid", even(x), "real"), 0, 255).near), mean, 2e-5) << x;
    }
}

// Matter that thickens evenly, tau = depth s / 255: the slab's own centroid.  The places are straight in the depth
// in front of them (LEG(2)), which is what they err by; Simpson's rule gives its first moment exactly.
TEST(LightPlaces, OfARampAreTheColourOfItsScalar) {
    struct Ramp {
        double front, back, depth, exact, allowed;
    };
    for (const Ramp& r : {Ramp{0, 255, 1, 0.633070239, 1e-3}, Ramp{255, 0, 1, 0.300526096, 1e-3},
                          Ramp{0, 255, 5, 0.505718919, 0.02}, Ramp{255, 0, 5, 0.189785701, 0.02}}) {
        std::string points;
        for (int s = 0; s < 256; ++s)
            points += fmt::format("{}[{},1,1,1,{:.17g}]", s ? "," : "[", s, -std::expm1(-r.depth * s / 255));
        const Plan plan = plan_of("centroid", points + "]", "real", {"transfer_function.entries=256"});
        EXPECT_NEAR(way(places<Exact>(plan, r.front, r.back).near), r.exact, r.allowed) << r.depth;
    }
}

// Before a wall stands next to nothing: its gradient lights the slab.  From the wall on, it alone.
TEST(LightPlaces, AreTheWalls) {
    for (const char* rule : {"centroid", "two_point"}) {
        const Plan plan = plan_of(rule, "[[0,1,1,1,0],[100,1,1,1,0],[101,1,1,1,1],[255,1,1,1,1]]", "default",
                                  {"transfer_function.entries=256"});
        const LightPlaces<Word> there = places<Word>(plan, 0, 202), here = places<Word>(plan, 101, 202);
        // Within one entry before the wall extinction rises: a 202nd of the way.
        EXPECT_NEAR(way(there.far), 0.5, 1.0 / 202) << rule;
        EXPECT_EQ(here.near, 0);
        EXPECT_EQ(here.far, 0);
        if (plan.inside.rule == InsideRule::two_point) {
            EXPECT_EQ(there.far, Word{1} << (kWayBits - 1));
            EXPECT_GT(there.share, Word{1} << (kShareBits - 1));
            EXPECT_EQ(here.share, Word{1} << kShareBits);
        }
        // A front between two opaque entries is opaque, whatever entry comes next.
        for (const auto& [front, back] :
             {std::pair{200.25, 200.75}, {200.75, 200.25}, {200.25, 202.0}, {200.5, 20.0}}) {
            const LightPlaces<Word> inside = places<Word>(plan, front, back);
            EXPECT_EQ(inside.near, 0) << rule << ' ' << front << ' ' << back;
            EXPECT_EQ(inside.far, 0) << rule << ' ' << front << ' ' << back;
            const LightPlaces<Exact> exact = places<Exact>(plan, front, back);
            EXPECT_EQ(way(exact.near), 0) << rule << ' ' << front << ' ' << back;
            EXPECT_EQ(way(exact.far), 0) << rule << ' ' << front << ' ' << back;
        }
    }
}

// A thin slab seen from its other side: u -> 1 - u.
TEST(LightPlaces, OfThinMatterTurnWithTheRay) {
    const Plan plan =
        plan_of("two_point", "[[0,1,1,1,0.0001],[90,1,1,1,0.0003],[120,1,1,1,0],[255,1,1,1,0.0002]]", "real",
                {"transfer_function.entries=256"});
    for (double front = 0; front < 255; front += 17)
        for (double back = 3; back < 255; back += 19) {
            const LightPlaces<Exact> there = places<Exact>(plan, front, back),
                                     turned = places<Exact>(plan, back, front);
            if (front == back) continue;
            // They lean by a sixth of the depth.
            EXPECT_NEAR(way(there.near), 1 - way(turned.far), 1e-4) << front << ' ' << back;
            EXPECT_NEAR(way(there.far), 1 - way(turned.near), 1e-4);
            EXPECT_LE(way(there.near), way(there.far));
        }
}

/// The light of even matter of depth 1 whose gradient turns by so many degrees and grows `ratio` times as long.
template <class W>
double lit(const Plan& plan, double degrees, double ratio, bool highlight = false) {
    const LightPlaces<W> at = places<W>(plan, 0, 255);
    const double angle = degrees * std::numbers::pi / 180;
    const double length = 20 * std::ldexp(1.0, plan.specs[Wire::gradient].format.fraction_bits);
    const Vec3 towards = -plan.camera.view, across = towards.cross(Vec3(0.3, 0.9, 0.1)).normalized();
    const Vec3 turned = (towards * std::cos(angle) + across * std::sin(angle)) * ratio;
    const auto gradient = [&](const Vec3& normal) {
        return std::array<W, 3>{word_of<W>(-normal[0] * length), word_of<W>(-normal[1] * length),
                                word_of<W>(-normal[2] * length)};
    };
    const Slab<W> slab = classify(std::get<PowerSeriesOfOrder1>(plan.method), word_of<W>(0),
                                  word_of<W>(static_cast<double>(plan.input.highest)),
                                  word_of<W>(std::ldexp(1.0, plan.location.length_fraction)));
    const auto light = [&](W place) {
        std::array<W, 3> color = slab.color;
        if (highlight) color.fill(word_of<W>(0));
        shade(
            plan.shading, RayWords<W>{},
            normalise(plan.gradient, gradient_up_to(plan.inside, gradient(towards), gradient(turned), place)),
            slab.alpha, color);
        return color;
    };
    const std::array<W, 3> color = light_of_places(plan.inside, light(at.near), light(at.far), at.share);
    return to_double(color[1]) / std::ldexp(1.0, plan.shading.color_fraction) * to_double(slab.alpha) /
           static_cast<double>(plan.inside.one_alpha);
}

TEST(LightPlaces, LightATurningSlab) {
    struct Turning {
        double degrees, ratio, centroid, two_point, lobe;
    };
    const std::vector<std::string> lobe{"shading.kd=0", "shading.ks=1"};
    const Plan centroid = plan_of("centroid", even(1), "real"), two = plan_of("two_point", even(1), "real"),
               shiny = plan_of("two_point", even(1), "real", lobe),
               words = plan_of("two_point", even(1), "default");
    for (const Turning& t :
         {Turning{30, 1, 0.617174, 0.610155, 0.326880}, Turning{60, 1, 0.574781, 0.544766, 0.244937},
          Turning{90, 1, 0.513405, 0.436858, 0.213122}, Turning{60, 4, 0.442266, 0.473314, 0.024663},
          Turning{90, 4, 0.207785, 0.300942, 0.001469}}) {
        EXPECT_NEAR(lit<Exact>(centroid, t.degrees, t.ratio), t.centroid, 1e-6)
            << t.degrees << ' ' << t.ratio;
        EXPECT_NEAR(lit<Exact>(two, t.degrees, t.ratio), t.two_point, 1e-6) << t.degrees << ' ' << t.ratio;
        EXPECT_NEAR(lit<Exact>(shiny, t.degrees, t.ratio, true), t.lobe, 1e-6) << t.degrees << ' ' << t.ratio;
        // Half a last bit of the way, 2^-11 in 8-bit data, turns a normal by 4 times its share of the angle, at most.
        EXPECT_NEAR(lit<Word>(words, t.degrees, t.ratio), lit<Exact>(two, t.degrees, t.ratio),
                    4 * t.degrees * std::numbers::pi / 180 * 0x1p-12 + 6 * 0x1p-15);
    }
}

// Scaling before a normal is made moves it by a last bit.
void expect_near(const std::array<Word, 3>& a, const std::array<Word, 3>& b) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LE(std::abs(a[i] - b[i]), 1) << i;
}
TEST(LightPlaces, TakeTheOtherGradientWhereOneIsZero) {
    const Plan plan = plan_of("two_point", even(1), "default");
    const std::array<Word, 3> none{0, 0, 0}, some{3 << 12, -(4 << 12), 12 << 12},
        other{-(3 << 12), 4 << 12, -(12 << 12)};
    const LightPlaces<Word> at = places<Word>(plan, 0, 255);
    const auto between = [&](const std::array<Word, 3>& front, const std::array<Word, 3>& back, Word place) {
        return normalise(plan.gradient, gradient_up_to(plan.inside, front, back, place));
    };
    for (const Word place : {at.near, at.far}) {
        expect_near(between(none, some, place), normalise(plan.gradient, some));
        expect_near(between(some, none, place), normalise(plan.gradient, some));
        EXPECT_EQ(between(none, none, place), none);
    }
    // Opposite gradients: the two faces; half way, none.
    expect_near(between(some, other, at.near), normalise(plan.gradient, some));
    expect_near(between(some, other, at.far), normalise(plan.gradient, other));
    EXPECT_EQ(between(some, other, Word{1} << (kWayBits - 1)), none);
}

}  // namespace
}  // namespace squint
