// The classification methods in fixed point: against their mathematics in double, against themselves in other
// words, and what no input may break.
#include "classification_cases.h"
#include "core/error.h"
#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/pi1d_table.h"
#include "pipeline/classification/tables/pi2d_table.h"
#include "pipeline/classification/tables/power_series.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "preintegration_cases.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <random>

namespace squint {
namespace {

using cases::all_methods;
using cases::Classifier;
using cases::make_classifier;
using cases::MethodCase;
using preintegration::SlabValue;
namespace pre = preintegration;

double largest_difference(const SlabValue& a, const SlabValue& b) {
    double largest = std::abs(a.alpha - b.alpha);
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a.color[c] - b.color[c]));
    return largest;
}

struct NamedEntries {
    std::string name;
    Entries entries;
};
std::vector<NamedEntries> functions() {
    using namespace pre::cases;
    std::vector<NamedEntries> all{{"ramp", ramp(256)},
                                  {"noise", noise(256, 1e-3, 2, 5)},
                                  {"dense", noise(256, 2, 20, 6)},
                                  {"spike", spike()},
                                  {"fog", constant(256, 0x1p-15, 0.7)},
                                  {"nothing", constant(256, 0, 0.5)},
                                  {"walls", noise(256, 0.01, 0.2, 7)}};
    for (const int wall : {0, 60, 61, 140, 255}) make_opaque(all.back().entries, wall, {1, 0.5, 0});
    return all;
}

std::vector<pre::cases::Slab> slabs_of(int count, bool on_entries) {
    return pre::cases::slabs(256, count, on_entries, 11);
}

/// The mathematics in double of a method, for full slabs with ends on entries.
SlabValue in_double(const Entries& entries, const MethodCase& m, double front, double back) {
    switch (m.method) {
        case Method::pc:
            return pre::point_slab(entries, front, 1);
        case Method::pi1d:
            return pre::build_pi1d(entries, 1, pre::MeanOf::opacity_kye).slab(front, back, 1);
        case Method::pi1d_engel:
            return pre::build_pi1d(entries, 1, pre::MeanOf::clamped_extinction_engel).slab(front, back, 1);
        case Method::pi2d:
            return pre::build_pi2d(entries, entries.size(), 1).slab(front, back, 1);
        case Method::pi2d_no_attenuation:
            return pre::build_pi2d_without_self_attenuation(entries, entries.size(), 1).slab(front, back, 1);
        case Method::pips:
            return pre::build_power_series(entries, m.order).slab(front, back, 1);
        default:
            return pre::build_legendre_series(entries, m.order, 1).slab(front, back, 1);
    }
}

// At wide formats (20 bits and more on every wire) what is left is rounding of a few steps of 2^-20, but for
// prefixes of 2^-24 over spans: far below half an LSB8.  Ends stand on entries, where both hold the same
// tables.  The moment methods model a colour constant inside an entry: a smooth function, whose entries are
// 1/255 apart in colour and below 1/255 + 1/100 deep, differs by less than depth times colour step, 2e-5.
TEST(ClassificationMethods, WideWordsAreWithinHalfAnLsb8OfTheirDoubles) {
    for (const MethodCase& method : all_methods()) {
        const bool moments =
            (method.method == Method::pips && method.order > 1) || method.method == Method::leg;
        const Entries entries = moments ? pre::cases::ramp(256) : pre::cases::noise(256, 1e-3, 2, 5);
        const Classifier wide = make_classifier(entries, method, "wide");
        double worst = 0;
        for (const auto& s : slabs_of(60, true)) {
            // Engel's clamp holds between two entries; one point is the point itself, as in every method.
            if (s.front == s.back && method.method == Method::pi1d_engel) continue;
            worst = std::max(worst, largest_difference(wide.slab(s.front, s.back),
                                                       in_double(entries, method, s.front, s.back)));
        }
        EXPECT_LE(worst, 0.5 / 255) << method.name();
    }
}

// docs/math.md#b2: up to the depth at which it cuts, LEG(2) and LEG(3) stay within half an LSB8 of the exact
// integral; cut in four pieces, what is left behind three of them is e^-4.5 of an error of 0.18 at most. 0.09
// LSB8 are rounding (wide) and the colour's step inside an entry.
TEST(LegendreSeries, DeepSlabsStayWithinTheirBoundOfTheExactIntegral) {
    for (const double tau : {0.2, 1.0, 4.0, 20.0}) {
        const Entries entries = pre::cases::entries_of(1024, [&](int i) {
            return pre::cases::Matter{tau, pre::cases::grey(i < 512)};
        });
        for (const int order : {2, 3, 4}) {
            const Classifier leg = make_classifier(entries, {Method::leg, order}, "wide");
            for (const double front : {0.0, 1023.0}) {
                const SlabValue exact = pre::exact_slab(entries, front, 1023 - front, 1);
                EXPECT_LE(largest_difference(leg.slab(front, 1023 - front), exact), 0.0021 + 0.09 / 255)
                    << "tau " << tau << " order " << order << " from " << front;
            }
        }
    }
}

TEST(ClassificationMethods, ColourIsNeverAboveOpacityNorBelowZero) {
    for (const NamedEntries& function : functions())
        for (const MethodCase& method : all_methods())
            for (const char* preset : {"default", "squeeze", "eight_bit", "wide"}) {
                const Classifier c = make_classifier(function.entries, method, preset);
                const std::int64_t one_alpha = std::int64_t{1} << c.alpha_fraction,
                                   one_color = std::int64_t{1} << c.color_fraction;
                for (const auto& s : slabs_of(40, false)) {
                    const double steps = std::min(s.length, 1.0);
                    const Slab<Int128> slab =
                        c.words<Int128>(c.input(s.front), c.input(s.back), c.length(steps));
                    ASSERT_TRUE(0 <= slab.alpha && slab.alpha <= one_alpha) << method.name() << function.name;
                    // A straight colour is at most one, a premultiplied one at most its opacity.
                    const Int128 most = c.premultiplied ? slab.alpha * one_color / one_alpha : one_color;
                    for (const Int128 color : slab.color)
                        ASSERT_TRUE(0 <= color && color <= most)
                            << method.name() << ' ' << preset << ' ' << function.name << ": "
                            << to_double(color) << " of " << to_double(most) << ", " << s.front << " to "
                            << s.back << ", " << steps;
                }
            }
}

void expect_lanes_equal_the_model(const Classifier& c, int bits, const std::string& name) {
    std::vector<std::int32_t> front, back, length;
    for (const auto& s : slabs_of(32, false)) {
        front.push_back(static_cast<std::int32_t>(c.input(s.front)));
        back.push_back(static_cast<std::int32_t>(c.input(s.back)));
        length.push_back(static_cast<std::int32_t>(c.length(std::min(s.length, 1.0))));
    }
    const auto found = cases::classify_in_lanes(c.method, bits, front, back, length);
    for (std::size_t i = 0; i < front.size(); ++i) {
        const Slab<Int128> model = c.words<Int128>(front[i], back[i], length[i]);
        // A straight colour that nobody sees may be any of those that there are.
        const bool any_color = model.alpha == 0 && !c.premultiplied;
        for (std::size_t channel = 0; any_color && channel < 3; ++channel)
            ASSERT_TRUE(0 <= found[channel][i] && found[channel][i] <= std::int64_t{1} << c.color_fraction)
                << name << ' ' << bits << " bits: " << found[channel][i];
        for (std::size_t channel = any_color ? 3 : 0; channel < 4; ++channel)
            ASSERT_EQ(found[channel][i],
                      static_cast<std::int64_t>(channel < 3 ? model.color[channel] : model.alpha))
                << name << ' ' << bits << " bits, channel " << channel << ", inputs " << front[i] << ", "
                << back[i] << ", length " << length[i];
    }
}

/// What the plan asks of a word: every input the table has, every length.
WordNeeds needs_of(const Classifier& c) {
    Range::needs = {};
    const Range input{0, c.input(c.entries.size() - 1)};
    c.words(input, input, Range{0, c.length(1)});
    return Range::needs;
}

TEST(ClassificationMethods, LanesEqualTheModelBitForBit) {
    int in_32 = 0, in_64 = 0;
    for (const NamedEntries& function : functions())
        for (const MethodCase& method : all_methods())
            for (const char* preset : {"default", "squeeze", "eight_bit", "wide"}) {
                const Classifier c = make_classifier(function.entries, method, preset);
                const WordNeeds needs = needs_of(c);
                const std::string name = method.name() + " " + preset + " " + function.name;
                ASSERT_LE(needs.result_bits, 127) << name;
                if (needs.operand_bits > 32 || needs.lane_bits > 64) continue;
                if (needs.lane_bits <= 32) ++in_32, expect_lanes_equal_the_model(c, 32, name);
                ++in_64, expect_lanes_equal_the_model(c, 64, name);
            }
    RecordProperty("in_32", in_32), RecordProperty("in_64", in_64);
    EXPECT_GT(in_64, 100);
}

TEST(ClassificationMethods, DefaultFormatsFitLanesForEightAndTwelveBits) {
    for (const int entries : {256, 4096})
        for (const MethodCase& method : all_methods()) {
            const WordNeeds needs =
                needs_of(make_classifier(pre::cases::ramp(entries), method, "default", 64));
            EXPECT_LE(needs.operand_bits, 32) << method.name() << ' ' << entries;
            EXPECT_LE(needs.lane_bits, 64) << method.name() << ' ' << entries;
        }
}

struct CollectWords {
    std::vector<std::int64_t>& words;
    void operator()(Table& t) const {
        for (int i = 0; i < t.rows(); ++i)
            for (int c = 0; c < t.columns(); ++c) words.push_back(t.word(i, c));
    }
    void operator()(CellTable&) const {}
    void operator()(Rescale&) const {}
};

// Tables without their exact values are filled many words at a time: in the plan, and here first.
TEST(ClassificationMethods, TablesHaveTheSameWordsWithAndWithoutTheirExactValues) {
    for (const char* preset : {"default", "squeeze"})
        for (const NamedEntries& function : functions())
            for (const MethodCase& m : all_methods()) {
                Classifier c = make_classifier(function.entries, m, preset);
                ClassificationMethod plain =
                    build_method({c.entries, c.specs, c.settings, 1, c.input_fraction, false});
                std::vector<std::int64_t> one_by_one, many;
                std::visit([&](auto& method) { method.visit(CollectWords{one_by_one}); }, c.method);
                std::visit([&](auto& method) { method.visit(CollectWords{many}); }, plain);
                ASSERT_EQ(many, one_by_one) << preset << ' ' << function.name << ' ' << m.name();
            }
}

TEST(ClassificationMethods, AnOrderThatIsNotGivenIsTheLeastOfItsMethod) {
    const auto hash_of = [](const std::string& method, const std::string& order) {
        const Scene scene = scene_with(
            built_in_scene(),
            {"volume.dims=24", "camera.height=28", "sampling.step=4", "image.width=16", "image.height=16",
             "classification.method=" + method, "classification.order=" + order});
        const auto volume = test::volume_of(scene);
        return picture_hash(render(make_plan(scene, volume)).image);
    };
    EXPECT_EQ(hash_of("leg", "auto"), hash_of("leg", "2"));
    EXPECT_NE(hash_of("leg", "auto"), hash_of("leg", "3"));
    EXPECT_EQ(hash_of("pips", "auto"), hash_of("pips", "1"));
    EXPECT_NE(hash_of("pips", "auto"), hash_of("pips", "3"));
    EXPECT_THROW(hash_of("leg", "1"), InputError);
}

template <class... M>
int types_that_serve(const std::variant<M...>*, const ClassificationSettings& settings) {
    return (static_cast<int>(M::serves(settings)) + ...);
}
TEST(ClassificationMethods, EachSettingIsServedByOneType) {
    ClassificationSettings settings;
    for (std::size_t name = 0; name < std::size(EnumNames<Method>::names); ++name)
        for (int order = 0; order <= 6; ++order) {
            settings.method = static_cast<Method>(name);
            settings.order = order == 0 ? std::nullopt : std::optional(order);
            EXPECT_EQ(types_that_serve(static_cast<const ClassificationMethod*>(nullptr), settings), 1)
                << name_of(settings.method) << ' ' << order;
        }
}

TEST(PreIntegrated2D, CellsOfSixteenBitsTakeEightBytes) {
    const Entries entries = pre::cases::ramp(256);
    const Classifier c = make_classifier(entries, {Method::pi2d}, "default", 512);
    EXPECT_EQ(std::get<PreIntegrated2D>(c.method).cells.bytes(), 512u * 512 * 8);
    const Classifier wide = make_classifier(entries, {Method::pi2d}, "wide", 512);
    EXPECT_EQ(std::get<PreIntegrated2D>(wide.method).cells.bytes(), 512u * 512 * 16);
}

// The exact table's colour has the full slab's self-attenuation: for a slab of half the length alpha is exact
// (to the depth's and the opacity's last bits), and the colour errs by less than x dc / 8 of alpha.
TEST(PreIntegrated2D, AShorterSlabIsExactInOpacity) {
    const Entries entries = pre::cases::ramp(256);
    const Classifier c = make_classifier(entries, {Method::pi2d}, "wide");
    for (const auto& s : slabs_of(40, true)) {
        if (s.front == s.back) continue;
        const SlabValue exact = pre::exact_slab(entries, s.front, s.back, 0.5),
                        found = c.slab(s.front, s.back, 0.5);
        EXPECT_NEAR(found.alpha, exact.alpha, 0x1p-18);
        const double swing = std::abs(s.front - s.back) / 255;
        EXPECT_NEAR(found.color.x, exact.color.x, exact.alpha * swing / 8 + 0x1p-18);
    }
}

// B6: both directions, both ends included, the first wall wins, the ratio of the whole slab is kept.  The
// method's own error stands in front of the wall: a base of 0.02 per step, so below 0.02 of a colour.
TEST(OpaquePrediction, EveryMethodStopsAtTheFirstWall) {
    Entries entries = pre::cases::constant(256, 0.02, 0.25);
    pre::cases::make_opaque(entries, 100, {1, 0, 0});
    pre::cases::make_opaque(entries, 120, {0, 1, 0});
    for (const MethodCase& method : all_methods()) {
        if (method.method == Method::pc) continue;
        const Classifier c = make_classifier(entries, method, "default");
        const struct {
            double front, back;
            Vec3 wall;
        } slabs[] = {{91, 109, {1, 0, 0}}, {109, 91, {1, 0, 0}},  {100, 109, {1, 0, 0}},
                     {91, 100, {1, 0, 0}}, {100, 100, {1, 0, 0}}, {91, 130, {1, 0, 0}},
                     {130, 91, {0, 1, 0}}, {110, 130, {0, 1, 0}}};
        for (const auto& s : slabs) {
            const SlabValue found = c.slab(s.front, s.back);
            EXPECT_EQ(found.alpha, 1) << method.name() << ' ' << s.front << ' ' << s.back;
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(found.color[k], s.wall[k], 0.15)
                    << method.name() << ' ' << s.front << ' ' << s.back;
        }
        EXPECT_LT(c.slab(101, 119).alpha, 0.5) << method.name();
    }
}

// Words with fractions: the first entry at or above a quarter of a raw unit beyond a wall is the next one.
TEST(OpaquePrediction, AWallLessThanARawUnitBehindIsNotMet) {
    Entries entries = pre::cases::constant(256, 0.02, 0.25);
    pre::cases::make_opaque(entries, 100, {1, 0, 0});
    for (const MethodCase& method : all_methods()) {
        if (method.method == Method::pc) continue;
        const Classifier c = make_classifier(entries, method, "wide");
        const auto alpha = [&](double beyond, double back) {
            const auto raw = [&](double entry) { return std::ldexp(entry, c.input_fraction); };
            return std::ldexp(c.words(Real<double>{raw(100) + beyond}, Real<double>{raw(back)},
                                      Real<double>{std::ldexp(1, c.length_fraction)})
                                  .alpha.v,
                              -c.alpha_fraction);
        };
        EXPECT_EQ(alpha(0, 109), 1) << method.name();
        EXPECT_LT(alpha(0.25, 109), 0.5) << method.name();
        EXPECT_LT(alpha(-0.25, 91), 0.5) << method.name();
        EXPECT_EQ(alpha(-0.25, 109), 1) << method.name();
        EXPECT_EQ(alpha(0.25, 91), 1) << method.name();
    }
}

TEST(ClassificationMethods, WithoutAnOpaqueEntryNothingIsPredicted) {
    const Entries entries = pre::cases::ramp(256);
    for (const MethodCase& method : all_methods()) {
        if (method.method == Method::pc) continue;
        const Classifier c = make_classifier(entries, method, "default");
        std::visit(
            [&]<class M>(const M& m) {
                if constexpr (!std::is_same_v<M, PostClassification>) {
                    EXPECT_FALSE(m.prefix.predicts);
                }
            },
            c.method);
    }
}

TEST(PowerSeries, EvenOrdersSayWhereTheirPoleIs) {
    const Entries dense = pre::cases::constant(256, 5, 0.5);
    for (const auto& [order, pole] : {std::pair{2, "2"}, std::pair{4, "2.78529"}}) {
        ClassificationReport report;
        std::visit([&](const auto& m) { m.describe(report); },
                   make_classifier(dense, {Method::pips, order}, "default").method);
        ASSERT_FALSE(report.notes.empty());
        EXPECT_NE(report.notes.back().find(std::string("is zero at an optical depth of ") + pole),
                  std::string::npos)
            << report.notes.back();
    }
}

TEST(ClassificationMethods, PrefixSumsBeyondTheirFormatAreRefused) {
    const Entries dense = pre::cases::constant(256, 20, 0.5);
    WireSpecs specs = make_classifier(dense, {Method::pips, 1}, "default").specs;
    specs[Wire::table_extinction].format.integer_bits = 4;
    ClassificationSettings settings;
    settings.method = Method::pips;
    EXPECT_THROW(build_method({dense, specs, settings, 1, 8}), InputError);
}

// Squeeze, section 4.4.2: R G B in 8 bits and T in 15.
TEST(Classification, EntriesMayStoreTheirTransparency) {
    const Entries entries = pre::cases::noise(256, 1e-3, 2, 5);
    Classifier c = make_classifier(entries, {Method::pc}, "squeeze");
    ClassificationSettings settings;
    settings.encoding = AlphaEncoding::transparency;
    for (const char* format : {"u1.15 trn", "u1.8 rnd"}) {
        ASSERT_EQ(parse_spec(format, c.specs[Wire::table_alpha]), "");
        const Spec spec = c.specs[Wire::table_alpha];
        const EntryLookup lookup = build_entry_lookup({c.entries, c.specs, settings, 1, c.input_fraction});
        for (int i = 0; i < entries.size(); ++i) {
            const double transparency = std::exp(-entries.entry[static_cast<std::size_t>(i)].extinction);
            ASSERT_EQ(lookup.table.word(i << lookup.row_bits, EntryLookup::alpha),
                      spec.format.one() - quantise_real(transparency, spec))
                << format << ' ' << i;
        }
    }
}

Classifier as_printed(const Entries& entries, int order) {
    Classifier c = make_classifier(entries, {Method::pips, order}, "default");
    c.settings.as_printed = true;
    c.method = build_method({c.entries, c.specs, c.settings, 1, c.input_fraction});
    return c;
}

// docs/math.md#c4, 6: extinction 2, colour 1 falling to 0.  Moments of 1 - y are 1 / ((k + 1) (k + 2)), so the series of
// order 3 gives (1/2 - 2/6 + 2/12) / (1 - 1 + 4/6) = 1/2, and that of order 2 divides by zero.  Rectangles shift the
// colour by half an entry.
TEST(Classification, AsPrintedTheSeriesHasItsPole) {
    Entries entries = pre::cases::constant(256, 2, 0);
    for (int i = 0; i < 256; ++i) entries.entry[static_cast<std::size_t>(i)].color = Vec3(1 - i / 255.0);
    const SlabValue third = as_printed(entries, 3).slab(0, 255), second = as_printed(entries, 2).slab(0, 255);
    const double alpha = 1 - std::exp(-2.0);
    EXPECT_NEAR(third.alpha, alpha, 1e-3);
    EXPECT_NEAR(third.color.x / alpha, 0.5, 0.5 / 255 + 1e-3);
    EXPECT_GT(second.color.x / alpha, 1.5);  // as far as its word goes
    const SlabValue mended = make_classifier(entries, {Method::pips, 2}, "default").slab(0, 255);
    EXPECT_LE(mended.color.x, mended.alpha);
}

// docs/math.md#b6: ascending slabs alone, and strictly.
TEST(Classification, AsPrintedPredictionMissesHalfTheWalls) {
    Entries entries = pre::cases::constant(256, 0.01, 0.2);
    pre::cases::make_opaque(entries, 128, {1, 0.5, 0});
    for (const int order : {1, 3}) {
        const Classifier printed = as_printed(entries, order),
                         mended = make_classifier(entries, {Method::pips, order}, "default");
        for (const auto& [front, back] : {std::pair{119, 137}, {137, 119}, {119, 128}, {128, 137}})
            EXPECT_EQ(mended.slab(front, back).alpha, 1) << order << ' ' << front;
        EXPECT_EQ(printed.slab(119, 137).alpha, 1) << order;
        EXPECT_EQ(printed.slab(128, 137).alpha, 1) << order;
        EXPECT_LT(printed.slab(137, 119).alpha, 1) << order;
        EXPECT_LT(printed.slab(119, 128).alpha, 1) << order;
    }
}

}  // namespace
}  // namespace squint
