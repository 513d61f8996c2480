// The exact slab, the one-dimensional methods and opaque prediction against closed forms and each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/opaque_prediction.h"
#include "pipeline/classification/tables/pi1d_table.h"
#include "pipeline/classification/tables/power_series.h"
#include "tests/pipeline/classification/preintegration_cases.h"
#include "truth/post_classification.h"

namespace squint::preintegration {
namespace {

using cases::constant;
using cases::grey;
using cases::make_opaque;
using cases::ramp;
using cases::Slab;
using cases::spike;

double largest_difference(const SlabValue& a, const SlabValue& b) {
    const Vec3 d = a.color - b.color;
    return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z), std::abs(a.alpha - b.alpha)});
}

void expect_in_range(const SlabValue& value) {
    EXPECT_LE(value.alpha, 1);
    for (int k = 0; k < 3; ++k) {
        EXPECT_GE(value.color[k], 0);
        EXPECT_LE(value.color[k], value.alpha);
    }
}

TEST(ExactSlab, ReproducesTheTableOfReferenceValues) {
    // docs/math.md#c4 prints 15 decimals; the sums here are of fewer than 1000 terms of at most 1: 1e-14 covers
    // both.
    struct Reference {
        Entries entries;
        Slab slab;
        double color, alpha;
    };
    const std::vector<Reference> table = {
        {ramp(256), {0, 255, 1}, 0.249093732179515, 0.393469340287367},
        {ramp(256), {255, 0, 1}, 0.275221540992924, 0.393469340287367},
        {ramp(256), {0, 255, 20}, 0.280201990576880, 0.999954600070238},
        {ramp(256), {255, 0, 20}, 0.946962419007098, 0.999954600070238},
        {ramp(256), {128, 128, 1}, 0.198102563586884, 0.394657450895745},
        {ramp(256), {127, 128, 1}, 0.196671648595272, 0.393469340287367},
        {ramp(256), {128, 127, 1}, 0.196799700353346, 0.393469340287367},
        {spike(), {126, 127, 1}, 0.341505114452317, 0.999999999986250},
        {spike(), {127, 126, 1}, 0.983658694313697, 0.999999999986250},
        {spike(), {100, 150, 1}, 0.464652946104846, 0.639260792999411},
        {spike(), {150, 100, 1}, 0.472958203535404, 0.639260792999411},
        {spike(), {0, 255, 1}, 0.136396553360834, 0.194264698126520},
    };
    for (const auto& [entries, slab, color, alpha] : table) {
        const SlabValue value = exact_slab(entries, slab.front, slab.back, slab.length);
        EXPECT_NEAR(value.color.x, color, 1e-14) << slab.front << " -> " << slab.back;
        EXPECT_NEAR(value.alpha, alpha, 1e-14) << slab.front << " -> " << slab.back;
    }
}

TEST(ExactSlab, EqualsTheClosedFormForConstantExtinctionAndLinearColor) {
    // c = 1 - u, tau d = x: C = 1 - (1 - e^-x) / x.
    for (const double x : {1e-3, 0.1, 1.0, 7.0, 300.0}) {
        const Entries entries = cases::entries_of(2, [&](int i) { return cases::Matter{x, grey(1 - i)}; });
        EXPECT_NEAR(exact_slab(entries, 0, 1, 1).color.x, 1 + std::expm1(-x) / x, 1e-13) << x;
    }
}

TEST(ExactSlab, JoinsWhereItIsCut) {
    const Entries entries = cases::noise(64, 0.01, 20, 3);
    for (const Slab& slab : cases::slabs(64, 200, false, 4)) {
        const double middle = slab.front + 0.3 * (slab.back - slab.front);
        const SlabValue near = exact_slab(entries, slab.front, middle, 0.3 * slab.length);
        const SlabValue far = exact_slab(entries, middle, slab.back, 0.7 * slab.length);
        const SlabValue joined{near.color + far.color * (1 - near.alpha),
                               near.alpha + far.alpha * (1 - near.alpha)};
        // The cut is off by a rounding of s <= 64 (1e-14) against |ds|, d tau <= 40: 1e-10 for |ds| >= 0.004.
        if (std::abs(slab.back - slab.front) < 0.004) continue;
        EXPECT_LE(largest_difference(joined, exact_slab(entries, slab.front, slab.back, slab.length)), 1e-10);
    }
}

TEST(ExactSlab, EndsAtTheFirstWallOnTheWay) {
    Entries entries = constant(256, 0, 0.25);
    make_opaque(entries, 100, grey(0.5));
    make_opaque(entries, 120, grey(1));
    for (const auto& [front, back] : {std::pair{91, 109}, {109, 91}, {100, 109}, {91, 100}, {100, 100}})
        EXPECT_EQ(exact_slab(entries, front, back, 1).alpha, 1) << front << " -> " << back;
    // Matter in front of the wall is at most 8.3 deep over a millionth of the unit.
    EXPECT_NEAR(exact_slab(entries, 90, 130, 1e-6).color.x, 0.5, 1e-5);
    EXPECT_NEAR(exact_slab(entries, 130, 90, 1e-6).color.x, 1, 1e-5);
}

TEST(ExactSlab, IsOpaqueBetweenNeighbouringOpaqueEntriesAndNotBesideOne) {
    Entries entries = constant(8, 0.5, 0);
    make_opaque(entries, 3, grey(0));
    EXPECT_LT(exact_slab(entries, 3.25, 3.5, 0.01).alpha, 1);
    make_opaque(entries, 4, grey(1));
    const SlabValue value = exact_slab(entries, 3.25, 5, 1);
    EXPECT_EQ(value.alpha, 1);
    EXPECT_DOUBLE_EQ(value.color.x, 0.25);
}

TEST(OpaquePrediction, AgreesWithTheWalkOfTheExactSlab) {
    Entries entries = constant(64, 1e-9, 0.5);
    for (const int i : {0, 7, 8, 9, 30, 63}) make_opaque(entries, i, grey(1));
    for (Entry& entry : entries.entry) entry.extinction = 1e-9;
    const OpaquePrediction prediction = predict_opaque(entries);
    int walls = 0;
    for (const bool on_entries : {false, true}) {
        for (const Slab& slab : cases::slabs(64, 2000, on_entries, 5)) {
            const bool wall = prediction.first(slab.front, slab.back).has_value();
            EXPECT_EQ(wall, exact_slab(entries, slab.front, slab.back, slab.length).alpha == 1)
                << slab.front << " -> " << slab.back;
            walls += wall;
        }
    }
    EXPECT_GT(walls, 1000);
}

TEST(OpaquePrediction, KeepsTheRateOfTheWholeSlab) {
    // One colour before the wall, another at it; constant tau up to the wall's own entry, whose colour
    // PIPS(1) only averages.
    Entries entries = constant(256, 0.5, 0);
    make_opaque(entries, 100, grey(0));
    make_opaque(entries, 101, grey(0));
    entries.entry[99].color = grey(0);
    const OpaquePrediction prediction = predict_opaque(entries);
    const RealCutSlab cut = cut_at_opaque(entries, prediction, 90, 130, 1);
    EXPECT_TRUE(cut.wall);
    EXPECT_DOUBLE_EQ(cut.back, 100);
    EXPECT_DOUBLE_EQ(cut.length, 0.25);
    EXPECT_DOUBLE_EQ(cut_at_opaque(entries, prediction, 131, 71, 1).back, 101);
    EXPECT_DOUBLE_EQ(cut_at_opaque(entries, prediction, 131, 71, 1).length, 0.5);
    EXPECT_FALSE(predict_opaque(constant(4, 1, 1)).any);
}

TEST(OpaquePrediction, OfFiveWallsLeavesOrderOneWithinTheStudysError) {
    // docs/math.md#b6: five isosurfaces over a thin base; both directions, inclusive, the rate kept: 0.03 LSB8 at
    // 12 bits.
    Entries entries = constant(4096, 0.01, 0.5);
    for (const int i : {500, 1000, 1700, 2500, 3300}) {
        make_opaque(entries, i, grey(i / 4096.0));
        entries.entry[i].extinction = 0.01;
        entries.entry[i - 1].color = entries.entry[i + 1].color = entries.entry[i].color;
    }
    const PowerSeries method = build_power_series(entries, 1);
    double worst_color = 0, worst_alpha = 0;
    for (const Slab& slab : cases::slabs(4096, 4000, true, 6)) {
        const SlabValue value = method.slab(slab.front, slab.back, slab.length);
        const SlabValue truth = exact_slab(entries, slab.front, slab.back, slab.length);
        worst_color = std::max(worst_color, std::abs(value.color.x - truth.color.x));
        worst_alpha = std::max(worst_alpha, std::abs(value.alpha - truth.alpha));
    }
    // Colour: x^2 dc / 8 with x <= 0.02 and a swing of at most 0.5; alpha: rounding.
    EXPECT_LE(worst_color, 0.02 * 0.02 * 0.5 / 8);
    EXPECT_LE(worst_alpha, 1e-12);
}

TEST(PowerSeries, OfOrderOneIsExactInAlphaForEverySlab) {
    for (const Entries& entries :
         {ramp(256), spike(), cases::noise(256, 1e-3, 20, 6), constant(256, 1000, 0.5)}) {
        const PowerSeries method = build_power_series(entries, 1);
        for (const Slab& slab : cases::slabs(256, 500, false, 7)) {
            const SlabValue value = method.slab(slab.front, slab.back, slab.length);
            // T carries 256 roundings of at most 2^-53 T_total; r <= 2 / |ds| multiplies them, and only slabs
            // across an entry difference two prefixes.  With |ds| >= 1e-3 and T_total <= 2e3 (the deep one is
            // opaque anyway): 1e-7 T e^-T < 1e-9.
            if (std::abs(slab.back - slab.front) < 1e-3) continue;
            EXPECT_NEAR(value.alpha, exact_slab(entries, slab.front, slab.back, slab.length).alpha, 1e-9);
            expect_in_range(value);
        }
    }
}

TEST(PowerSeries, OfConstantColorIsThatColorTimesAlpha) {
    const Entries entries = cases::entries_of(256, [](int i) {
        return cases::Matter{0.1 + i % 7, grey(0.375)};
    });
    for (int order = 1; order <= 5; ++order) {
        const PowerSeries method = build_power_series(entries, order);
        for (const Slab& slab : cases::slabs(256, 300, false, 8)) {
            const SlabValue value = method.slab(slab.front, slab.back, slab.length);
            EXPECT_DOUBLE_EQ(value.color.x,
                             0.375 * value.alpha);  // K is clamped to the colours' range, which is one value
        }
    }
}

TEST(PowerSeries, OfEqualEndsIsThePointItself) {
    const Entries entries = cases::noise(64, 0.1, 10, 9);
    const PowerSeries method = build_power_series(entries, 3);
    const RealPostClassification point{entries};
    for (double s = 0; s <= 63; s += 0.375)
        EXPECT_EQ(largest_difference(method.slab(s, s, 0.5), point.slab(s, s, 0.5)), 0);
}

TEST(PowerSeries, HasNoJumpAtEqualEnds) {
    const Entries entries = cases::noise(64, 0.1, 10, 9);
    const PowerSeries method = build_power_series(entries, 1);
    const double step = 1.0 / 4096;  // one 12-bit fraction of an entry
    for (double s = 0.5; s < 62; s += 0.37) {
        const SlabValue here = method.slab(s, s, 1), beside = method.slab(s, s + step, 1);
        // tau and c change by at most 10 and 1 per entry, d = 1: C moves by less than their changes over half
        // a step.
        EXPECT_LE(largest_difference(here, beside), 11 * step) << s;
    }
}

TEST(PowerSeries, GainsWithItsOrderInShallowSlabs) {
    const Entries entries = ramp(64);
    double before = 1;
    for (int order = 1; order <= 5; ++order) {
        const PowerSeries method = build_power_series(entries, order);
        double worst = 0;
        for (const Slab& slab : cases::slabs(64, 400, true, 10)) {
            const SlabValue value = method.slab(slab.front, slab.back, 0.3);
            worst =
                std::max(worst, largest_difference(value, exact_slab(entries, slab.front, slab.back, 0.3)));
        }
        // x <= 0.3: each further term of the two series brings its own factor of about x.
        EXPECT_LE(worst, 0.5 * before) << "order " << order;
        before = worst;
    }
    EXPECT_LE(before, 1e-5);
}

TEST(PowerSeries, TransparentMatterStaysTransparent) {
    const Entries entries = constant(16, 0, 1);
    for (int order = 1; order <= 5; ++order) {
        const SlabValue value = build_power_series(entries, order).slab(2, 9, 4);
        EXPECT_EQ(value.alpha, 0);
        EXPECT_EQ(value.color, grey(0));
    }
}

TEST(PowerSeries, NamesThePoleOfEvenOrders) {
    const Entries entries = constant(256, 4, 0.5);
    EXPECT_EQ(judge_power_series(entries, 1, 1).action, Verdict::Action::use);
    const Verdict second = judge_power_series(entries, 2, 1);
    EXPECT_EQ(second.action, Verdict::Action::redirect);
    EXPECT_NE(second.reason.find("zero at an optical depth of 2,"), std::string::npos) << second.reason;
    EXPECT_EQ(judge_power_series(constant(256, 0.25, 0.5), 2, 1).action, Verdict::Action::use);
    const auto denominator = [](double x) { return 1 - x / 2 + x * x / 6 - x * x * x / 24; };
    EXPECT_NEAR(denominator(pole(4)), 0, 1e-9);
    EXPECT_LT(trusted_depth(2), pole(2));
    EXPECT_LT(trusted_depth(4), pole(4));
}

TEST(PowerSeries, RefusesHigherOrdersAtAMillionDeepPrefix) {
    const Entries entries = constant(65536, 20, 0.5);  // T_total = 1.3e6
    EXPECT_EQ(judge_power_series(entries, 1, 1).action, Verdict::Action::use);
    EXPECT_EQ(judge_power_series(entries, 3, 1).action, Verdict::Action::refuse);
    EXPECT_EQ(judge_power_series(entries, 5, 1).action, Verdict::Action::refuse);
}

TEST(PowerSeries, StaysInRangeAtEveryOrderAndDepth) {
    for (const double tau : {1e-5, 2.0, 2.785, 20.0}) {
        const Entries entries = cases::entries_of(64, [&](int i) {
            return cases::Matter{tau, grey(i < 32)};
        });
        for (int order = 1; order <= 5; ++order) {
            const PowerSeries method = build_power_series(entries, order);
            for (const Slab& slab : cases::slabs(64, 200, false, 11))
                expect_in_range(method.slab(slab.front, slab.back, slab.length));
        }
    }
}

TEST(PrefixTables, PiecewiseAndExactAgreeAtTheEntries) {
    const Entries entries = cases::noise(64, 0.1, 3, 12);
    const PrefixTables exact = build_prefix_tables(entries, 5);
    const PrefixTables piecewise = build_prefix_tables(entries, 5, Between::piecewise);
    for (int i = 0; i < 64; ++i) {
        EXPECT_NEAR(exact.depth_at(i), piecewise.depth_at(i), 1e-12);
        for (int k = 1; k <= 5; ++k) {
            const double scale = std::pow(exact.total_depth(), k);  // 64 roundings of X_k <= T^k
            EXPECT_LE((exact.moment_at(k, i) - piecewise.moment_at(k, i)).length(), 1e-13 * scale);
        }
    }
}

TEST(PrefixTables, MomentsRunRightBetweenEntries) {
    // Constant tau and c: X_k(s) = c (tau s)^k, which a linear interpolation of X_k misses for k >= 2
    // (docs/math.md#b4).
    for (const Between between : {Between::exact, Between::piecewise}) {
        const PrefixTables tables = build_prefix_tables(constant(16, 2, 0.5), 5, between);
        for (double s = 0; s <= 15; s += 0.3)
            for (int k = 1; k <= 5; ++k)
                EXPECT_NEAR(tables.moment_at(k, s).x, 0.5 * std::pow(2 * s, k), 1e-14 * std::pow(30, k))
                    << s << " " << k;
    }
}

TEST(PrefixTables, SubdividedTablesAreTheSameFunction) {
    const Entries entries = cases::noise(64, 0.1, 3, 14);
    const PrefixTables coarse = build_prefix_tables(entries, 1),
                       fine = build_prefix_tables(subdivided(entries, 4), 1);
    for (double s = 0; s <= 63; s += 0.21) {
        EXPECT_NEAR(fine.depth_at(4 * s), 4 * coarse.depth_at(s), 1e-11);
        EXPECT_LE((fine.moment_at(1, 4 * s) - coarse.moment_at(1, s) * 4).length(), 1e-11);
    }
}

TEST(PreIntegrated1D, LosesAThinWallByTheNumberOfEntries) {
    Entries entries = constant(256, 0, 0.5);
    make_opaque(entries, 100, grey(1));
    const RealPreIntegrated1D method = build_pi1d(entries, 1, MeanOf::opacity_kye);
    EXPECT_DOUBLE_EQ(method.slab(95, 105, 1).alpha, 0.1);  // a tent of area 1 over 10 entries
    EXPECT_DOUBLE_EQ(method.slab(100, 100, 1).alpha, 1);
}

TEST(PreIntegrated1D, EqualsThePointWhereNothingChanges) {
    const Entries entries = constant(256, 0.7, 0.5);
    const RealPreIntegrated1D kye = build_pi1d(entries, 0.5, MeanOf::opacity_kye);
    // 256 roundings in the prefix over |ds| >= 1e-3.
    for (const Slab& slab : cases::slabs(256, 100, false, 13))
        EXPECT_LE(largest_difference(kye.slab(slab.front, slab.back, 0.5), point_slab(entries, 3, 0.5)),
                  1e-10);
    EXPECT_LE(largest_difference(kye.slab(3, 9, 1.25), point_slab(entries, 3, 1.25)), 1e-12);
}

}  // namespace
}  // namespace squint::preintegration
