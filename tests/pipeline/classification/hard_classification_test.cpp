// The hard cases of classification (docs/math.md#c4 and #b6), each a test by name: what no method may break, and how
// far it may be from the exact integral.
#include "classification_cases.h"
#include "core/error.h"
#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/plan/short_slabs.h"
#include "pipeline/render.h"
#include "preintegration_cases.h"
#include "scene/scene.h"
#include "tests/plan_of.h"
#include "truth/slab_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace squint {
namespace {

using cases::all_methods;
using cases::Classifier;
using cases::make_classifier;
using cases::MethodCase;
namespace pre = preintegration;
using pre::SlabValue;

constexpr MethodCase kPips1{Method::pips, 1};

bool is_slab_method(const MethodCase& m) {
    return m.method != Method::pc;
}
/// Alpha from the exact prefix sum, at any length.
bool has_exact_opacity(const MethodCase& m) {
    return m.method == Method::pips || m.method == Method::leg;
}

struct Reference {
    double front, back, length, color, alpha;
};

// docs/math.md#c4's table.  PI2D with a node an entry and wide words holds the integral itself: half a last bit of
// 2^-20 in every cell.
TEST(HardClassification, ReferenceValuesOfTheRampAndTheSpike) {
    const Reference ramp[] = {{0, 255, 1, 0.249093732179515, 0.393469340287367},
                              {255, 0, 1, 0.275221540992924, 0.393469340287367},
                              {0, 255, 20, 0.280201990576880, 0.999954600070238},
                              {255, 0, 20, 0.946962419007098, 0.999954600070238},
                              {128, 128, 1, 0.198102563586884, 0.394657450895745},
                              {127, 128, 1, 0.196671648595272, 0.393469340287367},
                              {128, 127, 1, 0.196799700353346, 0.393469340287367}};
    const Reference spike[] = {{126, 127, 1, 0.341505114452317, 0.999999999986250},
                               {127, 126, 1, 0.983658694313697, 0.999999999986250},
                               {100, 150, 1, 0.464652946104846, 0.639260792999411},
                               {150, 100, 1, 0.472958203535404, 0.639260792999411},
                               {0, 255, 1, 0.136396553360834, 0.194264698126520}};
    const auto check = [](const Entries& entries, auto& references) {
        for (const Reference& r : references) {
            const SlabValue exact = pre::exact_slab(entries, r.front, r.back, r.length);
            EXPECT_NEAR(exact.color.x, r.color, 1e-13);
            EXPECT_NEAR(exact.alpha, r.alpha, 1e-13);
            const SlabValue found =
                make_classifier(entries, {Method::pi2d}, "wide", 256, r.length).slab(r.front, r.back);
            // A point is colour times opacity of the entry's words: one rounding more.
            EXPECT_NEAR(found.color.x, r.color, 0x1p-19) << r.front << " to " << r.back;
            EXPECT_NEAR(found.alpha, r.alpha, 0x1p-19) << r.front << " to " << r.back;
        }
    };
    check(pre::cases::ramp(256), ramp);
    check(pre::cases::spike(), spike);
}

TEST(HardClassification, EqualEndsAreThePointItself) {
    const Entries entries = pre::cases::noise(256, 1e-3, 2, 3);
    const Classifier point = make_classifier(entries, {Method::pc}, "default");
    for (const MethodCase& method : all_methods()) {
        const Classifier c = make_classifier(entries, method, "default");
        for (double s = 0; s <= 255; s += 0.75) {
            const SlabValue expected = point.slab(s, s), found = c.slab(s, s);
            EXPECT_EQ(found.alpha, expected.alpha) << method.name() << ' ' << s;
            // A premultiplied colour is rounded once more.
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(found.color[k], expected.color[k], 0x1p-16) << method.name();
        }
    }
}

TEST(HardClassification, WhereNothingAbsorbsNothingIsSeen) {
    const Entries entries = pre::cases::constant(256, 0, 0.5);
    for (const MethodCase& method : all_methods()) {
        const Classifier c = make_classifier(entries, method, "default");
        for (const auto& s : pre::cases::slabs(256, 40, false, 2)) {
            const SlabValue found = c.slab(s.front, s.back, std::min(s.length, 1.0));
            EXPECT_EQ(found.alpha, 0) << method.name();
            EXPECT_EQ(found.color, Vec3(0, 0, 0)) << method.name();
        }
    }
}

// Straight colours are one exactly.  Premultiplied ones are rounded beside their opacity: one last bit of
// 2^-15.
TEST(HardClassification, WhiteMatterShinesAsMuchAsItHides) {
    Entries entries = pre::cases::noise(256, 1e-3, 2, 4);
    for (Entry& entry : entries.entry) entry.color = {1, 1, 1};
    for (const MethodCase& method : all_methods()) {
        if (method.method == Method::pi2d_no_attenuation) continue;  // never darkens: limited by alpha alone
        const Classifier c = make_classifier(entries, method, "default");
        for (const auto& s : pre::cases::slabs(256, 60, false, 2)) {
            const SlabValue found = c.slab(s.front, s.back, std::min(s.length, 1.0));
            // Engel's variant has no attenuation either: at most the opacity.
            if (method.method == Method::pi1d_engel) continue;
            EXPECT_NEAR(found.color.x, found.alpha, c.premultiplied ? 0x1p-15 : 0)
                << method.name() << ' ' << s.front << ' ' << s.back << ' ' << s.length;
        }
    }
}

TEST(HardClassification, OneColourIsItsShareOfTheOpacity) {
    Entries entries = pre::cases::noise(256, 1e-3, 2, 4);
    for (Entry& entry : entries.entry) entry.color = {0.75, 0.5, 0.25};
    for (const MethodCase& method : all_methods()) {
        if (!has_exact_opacity(method)) continue;
        const Classifier c = make_classifier(entries, method, "default");
        for (const auto& s : pre::cases::slabs(256, 60, false, 2)) {
            const SlabValue found = c.slab(s.front, s.back);
            for (int k = 0; k < 3; ++k) {
                // PIPS(1) divides two prefix sums that are rounded to 2^-20 each; where the slab is as thin
                // as that, its colour hardly counts.  The others clamp to the entries' own range.
                const double bound = method.order == 1 ? 4 * 0x1p-20 * 256 : 0;
                EXPECT_NEAR(found.color[k], (3 - k) * 0.25 * found.alpha, bound) << method.name();
            }
        }
    }
}

TEST(HardClassification, OpacityIsTheSameFromBothSides) {
    for (const Entries& entries : {pre::cases::noise(256, 1e-3, 2, 4), pre::cases::spike()})
        for (const MethodCase& method : all_methods()) {
            if (!is_slab_method(method)) continue;
            const Classifier c = make_classifier(entries, method, "default");
            for (const auto& s : pre::cases::slabs(256, 60, false, 9)) {
                const double steps = std::min(s.length, 1.0);
                // Three lerps of the 2-D table round in another order: one last bit each way.
                const bool table =
                    method.method == Method::pi2d || method.method == Method::pi2d_no_attenuation;
                EXPECT_NEAR(c.slab(s.front, s.back, steps).alpha, c.slab(s.back, s.front, steps).alpha,
                            table ? 0x1p-14 : 0)
                    << method.name();
            }
        }
}

TEST(HardClassification, OpacityGrowsWithLength) {
    const Entries entries = pre::cases::noise(256, 1e-3, 2, 4);
    for (const MethodCase& method : all_methods()) {
        if (!has_exact_opacity(method)) continue;
        const Classifier c = make_classifier(entries, method, "default");
        for (const auto& s : pre::cases::slabs(256, 20, false, 9)) {
            double before = 0;
            for (int steps = 1; steps <= 16; ++steps) {
                const double alpha = c.slab(s.front, s.back, steps / 16.0).alpha;
                EXPECT_GE(alpha, before) << method.name();
                before = alpha;
            }
        }
    }
}

// Colour 1 falling to 0 at x = 2: K = 0.65652; PIPS(2) has its pole there and takes PIPS(1)'s mean.
TEST(HardClassification, AtThePoleTheMeanColourStands) {
    const Entries entries = pre::cases::entries_of(256, [](int i) {
        return pre::cases::Matter{2, pre::cases::grey(1 - i / 255.0)};
    });
    const double alpha = 1 - std::exp(-2.0);
    const auto color = [&](const MethodCase& m) {
        return make_classifier(entries, m, "wide").slab(0, 255).color.x;
    };
    EXPECT_NEAR(pre::exact_slab(entries, 0, 255, 1).color.x / alpha, 0.65652, 1e-5);
    EXPECT_NEAR(color({Method::pips, 2}) / alpha, 0.5, 1e-4);
    EXPECT_NEAR(color({Method::pips, 4}) / alpha, 0.5, 1e-4);
    // A colour linear in depth is L_0 and L_1 alone: LEG is exact, up to the colour's step inside an entry.
    for (const int order : {2, 3, 4})
        EXPECT_NEAR(color({Method::leg, order}) / alpha, 0.65652, 5e-4) << order;
}

// Of C = 0.99995 at x = 20, the front half bright, the first piece of LEG alone sees 1 - e^-1.5 and more, and
// its pieces are of one colour but the one with the step in it, behind e^-4.5: nearer than 1/50.
TEST(HardClassification, ADeepSlabIsTheColourOfItsFront) {
    const Entries entries = pre::cases::entries_of(256, [](int i) {
        return pre::cases::Matter{20, pre::cases::grey(i < 128)};
    });
    for (const int order : {2, 3, 4}) {
        const Classifier leg = make_classifier(entries, {Method::leg, order}, "default");
        EXPECT_NEAR(leg.slab(0, 255).color.x, 0.99995, 0.02) << order;
        EXPECT_NEAR(leg.slab(255, 0).color.x, 0.00005, 0.02) << order;
    }
    EXPECT_NEAR(make_classifier(entries, kPips1, "default").slab(0, 255).color.x, 0.5, 0.01);
}

struct Rms {
    double pips = 0, leg = 0;
    int slabs = 0;
};
/// Colour errors of PIPS(1) and LEG(2) against the exact integral over slabs of `least` to `most` entries.
Rms rms_of(const Entries& entries, double step, double least, double most, const char* preset, bool depth_1) {
    const Classifier pips = make_classifier(entries, kPips1, preset, 0, step),
                     leg = make_classifier(entries, {Method::leg, 2}, preset, 0, step);
    Rms rms;
    for (const auto& s : pre::cases::slabs(entries.size(), 4000, false, 21)) {
        const double reach = std::abs(s.back - s.front);
        if (reach < least || reach > most) continue;
        const SlabValue exact = pre::exact_slab(entries, s.front, s.back, step);
        // Depth 1, give or take a fifth.
        if (depth_1 && std::abs(-std::log1p(-exact.alpha) - 1) > 0.2) continue;
        const SlabValue a = pips.slab(s.front, s.back), b = leg.slab(s.front, s.back);
        for (int k = 0; k < 3; ++k) {
            rms.pips += std::pow(a.color[k] - exact.color[k], 2);
            rms.leg += std::pow(b.color[k] - exact.color[k], 2);
        }
        ++rms.slabs;
    }
    rms.pips = std::sqrt(rms.pips / (3 * rms.slabs)), rms.leg = std::sqrt(rms.leg / (3 * rms.slabs));
    return rms;
}
struct Named {
    std::string name;
    Entries entries;
    double step;  // at which slabs of many entries are 1 deep
};
std::vector<Named> functions_for_leg() {
    using pre::cases::grey;
    using pre::cases::Matter;
    return {{"ramp", pre::cases::ramp(256), 2},
            {"plateau",
             pre::cases::entries_of(
                 256,
                 [](int i) {
                     return Matter{i < 60 || i > 200 ? 0.1 : 1, {i / 255.0, i < 128 ? 1.0 : 0.0, 0.5}};
                 }),
             1},
            {"noise", pre::cases::noise(256, 0.2, 3, 31), 1},
            {"wild noise", pre::cases::noise(256, 1e-3, 2, 5), 3.8},
            {"even",
             pre::cases::entries_of(256,
                                    [](int i) {
                                        return Matter{1, grey(0.5 + 0.5 * std::sin(i / 9.0))};
                                    }),
             1}};
}

// Slabs 1 deep over eight entries and more, so that none of these functions has an entry deeper than 0.5 in
// one: LEG(2) has half PIPS(1)'s error at most, 6 dB.  (Measured: 18 to 34 dB.)
TEST(HardClassification, LegendreGainsSixDecibelsOnSlabsOfDepthOne) {
    for (const char* preset : {"default", "wide"})
        for (const Named& f : functions_for_leg()) {
            const Rms rms = rms_of(f.entries, f.step, 8, 256, preset, true);
            EXPECT_GE(rms.slabs, 50) << f.name;
            const double gain = 20 * std::log10(rms.pips / rms.leg);
            EXPECT_GE(gain, 6) << f.name << ' ' << preset;
        }
}

// On slabs of any depth and reach LEG(2) is never worse by more than 0.1 dB, but where both are within a last
// bit of u1.15.
TEST(HardClassification, LegendreIsNeverWorseThanPips) {
    for (const char* preset : {"default", "wide"})
        for (const Named& f : functions_for_leg())
            for (const double step : {0.01, 0.1, 1.0, 10.0})
                for (const auto& [least, most] : {std::pair{0.0, 1.0}, {1.0, 5.0}, {5.0, 256.0}}) {
                    const Rms rms = rms_of(f.entries, step, least, most, preset, false);
                    if (rms.slabs == 0 || rms.leg < 0x1p-15) continue;
                    EXPECT_GE(20 * std::log10(rms.pips / rms.leg), -0.1) << f.name << ' ' << preset;
                }
}

// Fog of 2^-15 toggling between two entries, 1024 times: each slab one last bit of u1.15, as its own alpha.
TEST(HardClassification, FogOfOneUnitIsOneUnit) {
    const Entries entries = pre::cases::constant(256, -std::log1p(-0x1p-15), 0.7);
    for (const MethodCase& method : all_methods()) {
        const Classifier c = make_classifier(entries, method, "default");
        for (const auto& [front, back] : {std::pair{100.0, 101.0}, std::pair{101.0, 100.0}}) {
            const double seen = c.slab(front, back).alpha;
            EXPECT_EQ(seen, 0x1p-15) << method.name();
            EXPECT_NEAR(1 - std::pow(1 - seen, 1024), 0.030767, 1e-6);
        }
    }
}

// |ds| of one last bit, 2^-8: T is evaluated exactly between its words, which are rounded by 2^-21 each, so
// that the depth errs by 2^-20 and the opacity by a last bit of its own more.  Where T is kept straight
// between entries, half an entry's step of extinction is left: half an LSB8.
TEST(HardClassification, EndsOneBitApartDoNotBlowUp) {
    const Entries entries = pre::cases::ramp(256);
    for (const MethodCase& method : all_methods()) {
        if (!has_exact_opacity(method)) continue;
        const Classifier c = make_classifier(entries, method, "default");
        for (double s = 0; s < 255; s += 0.99) {
            const double there = s + 0x1p-8;
            const SlabValue exact = pre::exact_slab(entries, s, there, 1);
            for (const SlabValue& found : {c.slab(s, there), c.slab(there, s)}) {
                EXPECT_NEAR(found.alpha, exact.alpha, 0x1p-15 + 0.5 / 255) << method.name() << ' ' << s;
                EXPECT_LE(found.color.x, found.alpha);
            }
        }
    }
}

// An entry 1.5 deep from black to white beside entries 20 deep, a 35th of its block's depth: the words hold
// its moments but the last.  L_2 and L_3 are zero, and the held moment errs by 2^-10 of its part: 2 W_1 3
// 2^-10 = 0.28 LSB8, W_1(1.5) = 0.19.  One mean colour is 22 off.
TEST(HardClassification, APartThinInItsBlockKeepsTheMomentsThatWordsHold) {
    Entries entries;
    for (int i = 0; i < 256; ++i)
        entries.entry.push_back({Vec3(i > 10, i > 10, i > 10), 0, i == 10 || i == 11 ? 3.0 : 40.0, false});
    for (const int order : {2, 3, 4}) {
        const Classifier c = make_classifier(entries, {Method::leg, order}, "default", 0, 0.5);
        for (const auto& [front, back] : {std::pair{10.0, 11.0}, {11.0, 10.0}})
            EXPECT_NEAR(c.slab(front, back).color.x, pre::exact_slab(entries, front, back, 0.5).color.x,
                        0.28 / 255)
                << order << ' ' << front;
    }
}

// Beside spikes, walls and in noise T bends inside an entry, and so do its words: opacity is the exact one to
// 2^-15 of its words and 2^-18 of T's; half an LSB8 where rows are so narrow that T is straight in them.
// Colour is constant in a sub-entry: with 32 of them (8192 rows over 255 entries) it errs by 2/3 of the swing
// over 32 at most, a swing of one.
TEST(HardClassification, SlabsOfOneBitInsideAnEntryFollowItsBend) {
    for (const Entries& entries :
         {pre::cases::spike(), pre::cases::noise(256, 1e-3, 2, 5), pre::cases::noise(256, 2, 20, 6)})
        for (const MethodCase& method : all_methods()) {
            if (!has_exact_opacity(method)) continue;
            const Classifier c = make_classifier(entries, method, "default");
            for (int entry = 100; entry < 140; ++entry)
                for (const double place : {0.0, 0x1p-8, 0.25, 0.5, 0.75, 1 - 0x1p-8})
                    for (const double reach : {0x1p-8, 0x1p-7, 2.0}) {
                        const double s = entry + place;
                        const SlabValue exact = pre::exact_slab(entries, s, s + reach, 1);
                        for (const SlabValue& found : {c.slab(s, s + reach), c.slab(s + reach, s)}) {
                            EXPECT_NEAR(found.alpha, exact.alpha, 0.5 / 255 + 0x1p-15 + 0x1p-18)
                                << method.name() << ' ' << s << " + " << reach;
                            for (int k = 0; k < 3 && reach < 1; ++k)
                                EXPECT_NEAR(found.color[k], exact.color[k], 2.0 / 3 / 32 + 0x1p-14)
                                    << method.name() << ' ' << s << " + " << reach;
                        }
                    }
        }
}

// Optical depths that add up to 1.3 million, 16 bits: PIPS(1) within half an LSB8 of the exact opacity.
TEST(HardClassification, AMillionOfDepthKeepsItsOpacity) {
    const Entries entries = pre::cases::constant(65536, 20, 0.5);
    const Classifier c = make_classifier(entries, kPips1, "wide");
    for (const double front : {1.0, 30000.0, 65000.0})
        for (const double reach : {1.0, 3.0, 500.0}) {
            const SlabValue exact = pre::exact_slab(entries, front, front + reach, 1);
            EXPECT_NEAR(c.slab(front, front + reach).alpha, exact.alpha, 0.5 / 255);
            EXPECT_NEAR(c.slab(front, front + reach).color.x, exact.color.x, 0.5 / 255);
        }
}

double largest_difference_lsb8(const Image& a, const Image& b) {
    double worst = 0;
    for (const char* channel : {"R", "G", "B", "A"}) {
        const auto &x = a.find(channel)->values, &y = b.find(channel)->values;
        for (std::size_t i = 0; i < x.size(); ++i)
            worst = std::max(worst, 255.0 * std::abs(double{x[i]} - double{y[i]}));
    }
    return worst;
}

constexpr std::array<bool, kWires> kPlaces = [] {
    std::array<bool, kWires> rounded{};
    for (std::size_t w = 0; w < rounded.size(); ++w) rounded[w] = kWireInfo[w].stage == "sample location";
    return rounded;
}();

/// What the plan says that tables of words leave out and doubles do not: PI2D's cells and short slabs both have.
double left_out_by_words(const Plan& plan) {
    double sum = 0;
    for (const Approximation& a : plan.approximations)
        if (a.of != "cells between their nodes" && a.of != kShorterSlabs) sum += a.lsb8;
    return sum;
}

/// Wires rounded before a double classifies: its tables are the words' own, so that it is the same function of its
/// inputs, rows and all; `places`: of the samples; `inputs`: of all that comes before, so that its inputs are the same.
enum class Before { classification, places, inputs };
std::array<bool, kWires> rounded_before(Before what) {
    std::array<bool, kWires> rounded = what == Before::classification ? std::array<bool, kWires>{} : kPlaces;
    for (const Wire wire : {Wire::table_color, Wire::table_alpha, Wire::table_extinction, Wire::table_moment})
        rounded[static_cast<std::size_t>(wire)] = true;
    if (what != Before::inputs) return rounded;
    for (std::size_t w = 0; w < rounded.size(); ++w)
        rounded[w] = rounded[w] || kWireInfo[w].stage == "interpolation";
    rounded[static_cast<std::size_t>(Wire::classification_input)] = true;
    return rounded;
}

/// Words of `wide` against a double with the same tables, in LSB8: 24 fraction bits, half a last bit of which at each of
/// 1000 samples is 0.008, on each of the wires that add up along a ray.
constexpr double kSameTables = 0.05;

/// Every method's words of `wide` on a scene, unlit, against a double that reads the same tables, at every pixel,
/// walls and all.  That double against `real`, which takes the entries' own curves: half an LSB8 beside what
/// the plan says that tables leave out.  What a method refuses is left out.  SQUINT_HARD_SIZE: another number of pixels
/// a side.
void expect_half_an_lsb8(const std::string& name, Scene scene, int size, bool same_places = false) {
    if (const char* asked = std::getenv("SQUINT_HARD_SIZE")) size = std::atoi(asked);
    const std::string pixels = std::to_string(size);
    scene = scene_with(scene, {"image.width=" + pixels, "image.height=" + pixels,
                               "classification.table_size=256", "camera.turntable=1", "shading.model=none"});
    const auto volume = test::volume_of(scene);
    double most = 0;
    for (const NamedMethod& method : every_method()) {
        scene.classification.method = method.method, scene.classification.order = method.order;
        Image words, same_tables, real;
        double left_out = 0;
        try {
            scene.precision.preset = "wide";
            Plan plan = make_plan(scene, volume);
            words = render(plan).image;
            left_out = left_out_by_words(plan);
            bool clamps = false;
            for (const Entry& entry : plan.entries.entry)
                clamps = clamps || entry.extinction * plan.step_world > 1;
            // Engel's clamp holds between two different ends only (docs/classification.md): where an entry is deeper
            // than 1 the method jumps at a span of nothing, which words reach and doubles do not.  It is held where
            // its inputs are the words' own.
            const bool jumps = method.method == Method::pi1d_engel && clamps;
            set_active(plan, rounded_before(jumps         ? Before::inputs
                                            : same_places ? Before::places
                                                          : Before::classification));
            same_tables = render(plan).image;
            if (!jumps) {
                set_active(plan, same_places ? kPlaces : std::array<bool, kWires>{});
                real = render(plan).image;
            }
        } catch (const InputError&) {
            EXPECT_EQ(name, "million") << method.name;
            continue;
        }
        const double worst = largest_difference_lsb8(words, same_tables);
        EXPECT_LE(worst, kSameTables) << name << ' ' << method.name;
        most = std::max(most, worst);
        if (real.width == 0) continue;
        EXPECT_LE(largest_difference_lsb8(same_tables, real), 0.5 + left_out) << name << ' ' << method.name;
    }
    testing::Test::RecordProperty(name, std::to_string(most));
}
std::vector<std::filesystem::path> scenes_in(const std::string& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(SQUINT_SOURCE_DIR "/configs/" + folder))
        if (file.path().extension() == ".toml") files.push_back(file.path());
    std::sort(files.begin(), files.end());
    return files;
}

// Fraction bits of tables and compositing of 9 + log2(samples) and more (`wide`): every method on every scene
// within half an LSB8 of itself in double, at every pixel.
TEST(HardClassification, WideWordsArePicturesWithinHalfAnLsb8OfTheirDoubles) {
    for (const auto& file : scenes_in("hard"))
        expect_half_an_lsb8(file.stem(), read_scene(file.string()), 24);
}
TEST(HardPictures, WideWordsAreWithinHalfAnLsb8OnTheHeadAndLeeAndShinsScenes) {
    expect_half_an_lsb8("head", built_in_scene(), 16);
    for (const int figure : {5, 8}) {
        const std::string name = "figure_" + std::to_string(figure);
        expect_half_an_lsb8(name, read_scene(SQUINT_SOURCE_DIR "/configs/lee_shin/" + name + ".toml"), 16);
    }
}
TEST(HardPictures, WideWordsAreWithinHalfAnLsb8OnVolumesOfData) {
    if (!std::getenv("SQUINT_DATA")) GTEST_SKIP() << "SQUINT_DATA names no folder";
    for (const auto& file : scenes_in("bench"))
        expect_half_an_lsb8(file.stem(), read_scene(file.string()), 8);
    // Figure 7: a wall one entry wide in voxels that change by a thousand entries from one to the next.
    // Places that are a ten-thousandth of an entry off, at 24 bits of location, are 0.6 LSB8.
    for (const std::string name : {"figure_6", "figure_7"})
        expect_half_an_lsb8(name, read_scene(SQUINT_SOURCE_DIR "/configs/lee_shin/" + name + ".toml"), 8,
                            name == "figure_7");
}

// A step's depth beyond 16, where the only slab of a ray is short: the depth of a whole step must not
// saturate before its share is taken.
// The prefix sums of the deepest have 13 fraction bits, rounded at both ends; the depth and the opacity have
// 16 and 15.
TEST(HardClassification, AShortSlabOfDeepMatterKeepsItsDepth) {
    for (const double tau : {15.0, 20.0, 120.0, 1000.0})
        for (const MethodCase& method : all_methods()) {
            if (method.method == Method::pi1d_engel || method.method == Method::pi1d)
                continue;  // not exact in alpha
            const Classifier c = make_classifier(pre::cases::constant(256, tau, 0.5), method, "default");
            for (const double steps : {0.25, 0.0625, 2.0 / 512})
                EXPECT_NEAR(c.slab(10, 11, steps).alpha, -std::expm1(-tau * steps), 0x1p-13 * steps + 0x1p-15)
                    << method.name() << ' ' << tau << ' ' << steps;
        }
}

// Every scene of configs/hard with every method: refused in one line, or no slab outside 0 <= C <= alpha
// <= 1.
TEST(HardClassification, NoMethodLeavesItsRangeOnAnyHardScene) {
    int scenes = 0;
    for (const auto& file : std::filesystem::directory_iterator(SQUINT_SOURCE_DIR "/configs/hard")) {
        if (file.path().extension() != ".toml" || file.path().stem() == "million") continue;
        ++scenes;
        Scene scene = read_scene(file.path().string());
        const auto volume = test::volume_of(scene);
        for (const char* preset : {"default", "eight_bit"})
            for (const NamedMethod& method : every_method()) {
                scene.precision.preset = preset;
                scene.classification.method = method.method, scene.classification.order = method.order;
                scene.classification.table_size = 64;
                const SlabCheck check = check_slabs(make_plan(scene, volume), false);
                EXPECT_EQ(check.beyond, 0) << file.path().stem() << ' ' << method.name << ' ' << preset
                                           << ": from " << check.worst.front << " to " << check.worst.back;
                EXPECT_GT(check.slabs, 30);
            }
    }
    EXPECT_GE(scenes, 16);
}

}  // namespace
}  // namespace squint
