// LEG(n), its weights and splitting, and the tables that do not cancel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/legendre.h"
#include "tests/pipeline/classification/preintegration_cases.h"
#include "truth/overlapped_tables.h"

namespace squint::preintegration {
namespace {

using cases::constant;
using cases::grey;
using cases::Slab;

double largest_error(const auto& method, const Entries& entries, const std::vector<Slab>& slabs) {
    double worst = 0;
    for (const auto& [front, back, length] : slabs) {
        const SlabValue value = method.slab(front, back, length),
                        truth = exact_slab(entries, front, back, length);
        for (int k = 0; k < 3; ++k) {
            if (!(std::abs(value.color[k] - truth.color[k]) <= worst))
                worst = std::abs(value.color[k] - truth.color[k]);
        }
    }
    return worst;
}

TEST(LegendreWeight, EqualsItsDefinitionByQuadrature) {
    // W_j = (-1)^j (x/2) int P_j(y) e^(-x (y+1) / 2) dy over [-1, 1].  20000 midpoints err by h^2 / 24
    // = 4.2e-10 times (x/2) int |f''| <= x (15 + 6x + x^2 / 4), for P_3 and all below.
    const auto legendre = [](int j, double y) {
        return j == 0 ? 1 : j == 1 ? y : j == 2 ? (3 * y * y - 1) / 2 : (5 * y * y * y - 3 * y) / 2;
    };
    for (const double x : {1e-3, 0.5, 3.0, 20.0, 23.9, 24.1, 60.0}) {
        for (int j = 0; j < kMostLegendre; ++j) {
            double sum = 0;
            for (int i = 0; i < 20000; ++i) {
                const double y = (i + 0.5) / 10000 - 1;
                sum += legendre(j, y) * std::exp(-x * (y + 1) / 2) / 10000;
            }
            EXPECT_NEAR(legendre_weight(j, x), (j % 2 ? -1 : 1) * x / 2 * sum,
                        4.2e-10 * x * (15 + 6 * x + x * x / 4) + 1e-14)
                << j << " " << x;
        }
    }
}

TEST(LegendreWeight, IsBoundedByOneAndByTheDepth) {
    for (double x = 0; x < 2000; x = x * 1.3 + 1e-6) {
        for (int j = 0; j < kMostLegendre; ++j) {
            EXPECT_GE(legendre_weight(j, x), 0);
            EXPECT_LE(legendre_weight(j, x), std::min(1.0, x));
        }
    }
}

TEST(LegendreSeries, ReproducesTheStudysErrorsOfK) {
    // docs/math.md#b2: constant tau, colour 1 in the front half, 0 behind; printed to 3 decimals, one of them a
    // piecewise step smeared over one entry of 1024, which moves K by less than x / 1024.
    for (const auto& [x, two, four] :
         {std::tuple{1.0, 0.0005, 0.0}, {2.0, 0.004, 0.0}, {3.0, 0.011, 0.0}, {6.0, 0.051, -0.003}}) {
        const Entries entries = cases::entries_of(1025, [depth = x](int i) {
            return cases::Matter{depth, grey(i < 512 ? 1 : i == 512 ? 0.5 : 0)};
        });
        const double truth = exact_slab(entries, 0, 1024, 1).color.x / -std::expm1(-x);
        for (const auto& [order, error] : {std::pair{2, two}, {4, four}}) {
            const SlabValue value = build_legendre_series(entries, order, 1, 1e9).slab(0, 1024, 1);
            EXPECT_NEAR(value.color.x / value.alpha - truth, error, 0.0006 + x / 1024) << order << " " << x;
        }
    }
}

TEST(LegendreSeries, IsExactWhereTheColorIsAPolynomialOfTheDepth) {
    // tau constant and c linear in s: two moments say all.
    const Entries entries = cases::entries_of(64, [](int i) { return cases::Matter{2, grey(i / 63.0)}; });
    for (int order = 2; order <= 4; ++order) {
        // Prefixes reach T d = 252, whose power n times 2^-53 is lost where |ds| = 1 and more below: 2e-14
        // 252^4 / |ds|^4.
        std::vector<Slab> slabs = cases::slabs(64, 300, true, 31);
        EXPECT_LE(largest_error(build_legendre_series(entries, order, 2), entries, slabs),
                  order < 4 ? 1e-8 : 1e-5)
            << order;
    }
}

TEST(LegendreSeries, BeatsPipsOnSlabsOfDepthOneByFarMoreThanSixDecibels) {
    const Entries entries = cases::noise(256, 0.01, 0.4, 32);
    std::vector<Slab> slabs;
    for (const Slab& slab : cases::slabs(256, 800, true, 33)) slabs.push_back({slab.front, slab.back, 2});
    const auto rms = [&](const auto& method) {
        double sum = 0;
        for (const auto& [front, back, length] : slabs) {
            const double error =
                method.slab(front, back, length).color.x - exact_slab(entries, front, back, length).color.x;
            sum += error * error;
        }
        return std::sqrt(sum / static_cast<double>(slabs.size()));
    };
    const double one = rms(build_power_series(entries, 1)), two = rms(build_legendre_series(entries, 2, 2));
    EXPECT_GT(20 * std::log10(one / two), 6);
}

TEST(LegendreSeries, HoldsAtTwentyDeepWithABrightFront) {
    // docs/math.md#c4: C = 0.99995 where PIPS(1) gives 0.5.
    const Entries entries = cases::entries_of(256, [](int i) { return cases::Matter{20, grey(i < 128)}; });
    const SlabValue value = build_legendre_series(entries, 2, 1).slab(0, 255, 1);
    EXPECT_NEAR(value.color.x, exact_slab(entries, 0, 255, 1).color.x,
                1.0 / 1024);  // it stops at a transparency of 2^-10
    EXPECT_NEAR(build_power_series(entries, 1).slab(0, 255, 1).color.x, 0.5, 0.01);
}

TEST(LegendreSeries, SubEntriesMendAnEntryThatAloneIsDeep) {
    const Entries entries = cases::spike();
    LegendreSeries fine = build_legendre_series(entries, 2, 1);
    EXPECT_GT(fine.per_entry, 1);
    for (const auto& [front, back] : {std::pair{126, 127}, {127, 126}, {100, 150}, {0, 255}}) {
        const SlabValue truth = exact_slab(entries, front, back, 1), value = fine.slab(front, back, 1);
        EXPECT_NEAR(value.alpha, truth.alpha, 1e-12);
        // What two moments cannot see begins with 5 L_2 W_2(x): |L_2| <= 0.193 (the mean of P_2's positive
        // part) times the swing of 0.8, W_2 <= 0.0105 at the depth of 1.02 that 100 -> 150 has, and a sixth
        // of that for all higher ones.  A slab of 25 deep is cut in pieces 1.5 deep over which the colour
        // changes by 0.8 / 4 at most: less than that; plus the spent 2^-10.
        EXPECT_NEAR(value.color.x, truth.color.x, 5 * 0.193 * 0.8 * 0.0105 * 7 / 6 + 1.0 / 1024)
            << front << " -> " << back;
    }
}

TEST(LegendreSeries, StaysBetweenZeroAndAlphaOnEverything) {
    Entries walls = cases::noise(64, 1e-3, 20, 34);
    cases::make_opaque(walls, 20, grey(1));
    cases::make_opaque(walls, 40, grey(0));
    for (const Entries& entries : {cases::ramp(64), walls, constant(64, 1000, 0.5),
                                   constant(64, 1.0 / 32768, 1), constant(64, 0, 1)}) {
        for (int order = 1; order <= 4; ++order) {
            const LegendreSeries method = build_legendre_series(entries, order, 2);
            for (const Slab& slab : cases::slabs(64, 200, false, 35)) {
                const SlabValue value = method.slab(slab.front, slab.back, slab.length);
                ASSERT_LE(value.alpha, 1);
                for (int k = 0; k < 3; ++k) {
                    ASSERT_GE(value.color[k], 0);
                    ASSERT_LE(value.color[k], value.alpha * (1 + 1e-12));
                }
            }
        }
    }
}

TEST(LegendreSeries, PicksDisjointTablesWherePrefixesCancel) {
    EXPECT_FALSE(build_legendre_series(cases::noise(64, 0.1, 1, 36), 2, 1).disjoint);
    const LegendreSeries deep = build_legendre_series(cases::noise(1024, 100, 1000, 36), 4, 1);
    EXPECT_TRUE(deep.disjoint);
    EXPECT_NE(deep.reason.find("disjoint"), std::string::npos);
}

TEST(DisjointTables, EqualThePrefixesWhereThoseAreGood) {
    const Entries entries = cases::noise(50, 0.01, 0.2, 37);
    const PrefixTables prefix = build_prefix_tables(entries, 4);
    const DisjointTables disjoint = build_disjoint_tables(entries, 4);
    const DisjointTables single = build_disjoint_tables(entries, 4, Storage::float32);
    for (const bool on_entries : {true, false}) {
        for (const auto& [front, back, length] : cases::slabs(50, 400, on_entries, 38)) {
            if (std::abs(back - front) < 0.5) continue;
            const Moments a = prefix.moments(front, back, length, 4),
                          b = disjoint.moments(front, back, length, 4);
            const Moments c = single.moments(front, back, length, 4);
            EXPECT_NEAR(a.depth, b.depth, 1e-12);
            // T d <= 20 in units of r = 4: (20 * 4)^4 2^-53 for the prefixes, 2^-24 of each moment's bound
            // x^(k+1) for float.
            for (int k = 0; k < 4; ++k) {
                EXPECT_LE((a.q[k] - b.q[k]).length(), 1e-7);
                EXPECT_LE((c.q[k] - b.q[k]).length(), 32 * std::ldexp(std::pow(b.depth, k + 1), -24));
            }
        }
    }
}

TEST(DisjointTables, KeepTheirAccuracyAtAMillionDeep) {
    // Far from zero the same matter gives the same moments.
    const Entries entries = cases::entries_of(4096, [](int i) {
        return cases::Matter{i < 4000 ? 300 : 0.1 + 0.05 * (i % 5), grey(i % 3 / 2.0)};
    });
    const Entries alone = cases::entries_of(96, [&](int i) {
        const Entry& entry = entries.entry[4000 + i];
        return cases::Matter{entry.extinction, entry.color};
    });
    const DisjointTables far = build_disjoint_tables(entries, 4), near = build_disjoint_tables(alone, 4);
    for (const auto& [front, back, length] : cases::slabs(96, 200, false, 39)) {
        if (std::abs(back - front) < 1e-3) continue;
        const Moments a = far.moments(4000 + front, 4000 + back, length, 4),
                      b = near.moments(front, back, length, 4);
        for (int k = 0; k < 4; ++k)
            EXPECT_LE((a.q[k] - b.q[k]).length(), 1e-9);  // 4000 + front rounds s by 5e-13
    }
}

TEST(OverlappedTables, EqualTheDisjointTables) {
    const Entries entries = cases::noise(50, 0.01, 3, 40);
    const DisjointTables disjoint = build_disjoint_tables(entries, 4);
    const OverlappedTables overlapped = build_overlapped_tables(entries, 4);
    for (const bool on_entries : {true, false}) {
        for (const auto& [front, back, length] : cases::slabs(50, 400, on_entries, 41)) {
            if (std::abs(back - front) < 1e-3) continue;
            const Moments a = overlapped.moments(front, back, length, 4),
                          b = disjoint.moments(front, back, length, 4);
            EXPECT_NEAR(a.depth, b.depth, 1e-12);
            // Four slabs of at most 3 d deep, r at most 2 per whole entry: (4 * 6)^(k+1) 2^-53 times the 8
            // terms of a shift.
            for (int k = 0; k < 4; ++k)
                EXPECT_LE((a.q[k] - b.q[k]).length(), std::ldexp(8 * std::pow(24, k + 1), -53) + 1e-13);
        }
    }
}

TEST(OverlappedTables, LoseWhatTheirWordsLose) {
    // Even matter: every block of a level is alike, and a slab is at least a quarter of its block.
    const Entries entries = cases::entries_of(200, [](int i) { return cases::Matter{0.5, grey(i % 2)}; });
    const OverlappedTables exact = build_overlapped_tables(entries, 2),
                           coarse = build_overlapped_tables(entries, 2, 16),
                           fine = build_overlapped_tables(entries, 2, 24);
    double worst_coarse = 0, worst_fine = 0;
    for (const auto& [front, back, length] : cases::slabs(200, 400, true, 42)) {
        if (front == back) continue;
        const auto error = [&exact, from = front, to = back](const OverlappedTables& tables) {
            const Vec3 a = legendre_color(tables.moments(from, to, 1, 2), 2),
                       b = legendre_color(exact.moments(from, to, 1, 2), 2);
            return std::abs(a.x - b.x) * 255;
        };
        worst_coarse = std::max(worst_coarse, error(coarse));
        worst_fine = std::max(worst_fine, error(fine));
    }
    // A word's half unit is 2^-17 of a scale of at most 2 * 4 x (and twice that squared for k = 1), x = 0.5;
    // LEG's factors 3 and 2 and two ends: 255 * 2^-17 * 40 = 0.08 LSB8; 8 bits more take 256 off.
    EXPECT_GT(worst_coarse, 0);
    EXPECT_LE(worst_coarse, 0.08);
    EXPECT_LE(worst_fine, 0.08 / 256);
}

}  // namespace
}  // namespace squint::preintegration
