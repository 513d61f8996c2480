// Light inside a slab: its places, the angle that decides its pieces, and their light (docs/math.md#b7;
// the exact values are those of a slab of even matter, x = 1, between normals that turn from L by an angle).
#include "pipeline/stages/inside-inl.h"

#include "fixedpoint/words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;
using Vector = std::array<Word, 3>;

constexpr Word kOne = 1 << 15;

Spec unsigned_spec(int integer_bits, int fraction_bits) {
    return {{integer_bits, fraction_bits, false}, Rounding::rnd_conv, Overflow::sat};
}
Spec signed_spec(int integer_bits, int fraction_bits) {
    return {{integer_bits, fraction_bits, true}, Rounding::rnd_conv, Overflow::sat};
}

/// As plan.cpp builds it: locations u8.23, inputs u12.8, lengths u1.9, light u1.15.
InsideStage stage_of(bool rounds = true) {
    InsideStage s;
    for (int b = 0; b < static_cast<int>(s.to_location.size()); ++b)
        s.to_location[static_cast<std::size_t>(b)] = Rescale(23 + b, signed_spec(8, 23));
    for (int b = 0; b <= kMostCuts; ++b) {
        s.to_input[static_cast<std::size_t>(b)] = Rescale(8 + b, signed_spec(12, 8));
        s.to_length[static_cast<std::size_t>(b)] = Rescale(9 + b, unsigned_spec(1, 9));
    }
    s.most_apart = {2 << 23, 2 << 23, 2 << 23}, s.limit = {255 << 23, 255 << 23, 255 << 23};
    s.highest_input = 4095 << 8;
    s.one_alpha = kOne, s.lit = true, s.largest_color = 2 * kOne - 1;
    s.most_light = s.one_alpha * s.largest_color;
    s.to_part = Rescale(30, unsigned_spec(1, 15)), s.to_whole = Rescale(15, unsigned_spec(1, 15));
    if (!rounds) s.visit([](auto& rescale_or_table) { rescale_or_table.active = false; });
    return s;
}

TEST(Inside, PlacesStandWhereTheirPartSays) {
    const InsideStage s = stage_of();
    std::mt19937_64 random(1);
    for (int i = 0; i < 20'000; ++i) {
        Vector front, back;
        for (std::size_t a = 0; a < 3; ++a) {
            front[a] = static_cast<Word>(random() % (200 << 23)) + (10 << 23);
            back[a] = front[a] + static_cast<Word>(random() % (4 << 23)) - (2 << 23);
        }
        for (int bits = 1; bits <= kMostCuts + 1; ++bits)
            for (int part = 0; part <= 1 << bits; ++part) {
                const Vector there = location_between(s, front, back, part, bits);
                // The same place from the other side: two roundings of half a last bit.
                const Vector seen_back = location_between(s, back, front, (1 << bits) - part, bits);
                for (std::size_t a = 0; a < 3; ++a) {
                    const double exact = static_cast<double>(front[a]) +
                                         std::ldexp(static_cast<double>((back[a] - front[a]) * part), -bits);
                    ASSERT_NEAR(static_cast<double>(there[a]), exact, 0.5);
                    ASSERT_LE(std::abs(there[a] - seen_back[a]), 1);
                }
            }
    }
}

TEST(Inside, CutsOfAnInputAreOrderedAndPiecesLengthsAddUp) {
    const InsideStage s = stage_of();
    std::mt19937_64 random(2);
    for (int i = 0; i < 20'000; ++i) {
        const Word front = static_cast<Word>(random() % (4096 << 8)),
                   back = static_cast<Word>(random() % (4096 << 8));
        const Word length = 1 + static_cast<Word>(random() % 512);
        for (int bits = 1; bits <= kMostCuts; ++bits) {
            Word near = front, near_length = 0;
            for (int part = 1; part <= 1 << bits; ++part) {
                const Word far = input_between(s, front, back, part, bits);
                ASSERT_TRUE(front <= back ? near <= far : far <= near);
                ASSERT_NEAR(static_cast<double>(far),
                            static_cast<double>(front) +
                                std::ldexp(static_cast<double>((back - front) * part), -bits),
                            0.5);
                const Word far_length = length_up_to(s, length, part, bits);
                ASSERT_GE(far_length, near_length);
                near = far, near_length = far_length;
            }
            ASSERT_EQ(near, back);
            ASSERT_EQ(near_length, length);
        }
    }
}

TEST(Inside, TheAngleBetweenTheEndsDecidesThePieces) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    const double first = std::acos(31 / 32.0), second = std::acos(23 / 32.0);
    const double near = 0.12 * std::numbers::pi / 180;  // 12-bit components, and floors of lengths
    int met[3] = {};
    for (int i = 0; i < 50'000; ++i) {
        std::array<double, 3> g[2];
        const double turn = i % 3 == 0 ? 2 : 0.5;
        for (std::size_t a = 0; a < 3; ++a) g[0][a] = unit(random), g[1][a] = g[0][a] + turn * unit(random);
        std::array<Vector, 2> raw;
        std::array<std::array<Real<double>, 3>, 2> exact;
        double dot = 0, size[2] = {};
        for (std::size_t e = 0; e < 2; ++e) {
            const double scale = std::ldexp(1.0, 13 + static_cast<int>(random() % 8));
            for (std::size_t a = 0; a < 3; ++a) {
                raw[e][a] = static_cast<Word>(g[e][a] * scale),
                exact[e][a] = {static_cast<double>(raw[e][a])};
                size[e] += exact[e][a].v * exact[e][a].v;
            }
        }
        for (std::size_t a = 0; a < 3; ++a) dot += exact[0][a].v * exact[1][a].v;
        const double angle = std::acos(std::clamp(dot / std::sqrt(size[0] * size[1]), -1.0, 1.0));
        const Word pieces = angle <= first ? 0 : angle <= second ? 1 : 2;
        ASSERT_EQ(cuts_between(exact[0], exact[1]).v, static_cast<double>(pieces)) << angle;
        ASSERT_EQ(cuts_between(raw[0], raw[1]), cuts_between(raw[1], raw[0]));
        if (std::abs(angle - first) < near || std::abs(angle - second) < near) continue;
        ASSERT_EQ(cuts_between(raw[0], raw[1]), pieces) << angle;
        ++met[pieces];
    }
    for (const int count : met) EXPECT_GT(count, 2000);
}

TEST(Inside, AZeroGradientDoesNotTurnAndOppositeOnesTurnMost) {
    const Vector zero{0, 0, 0};
    for (const Vector& g : {Vector{1, 0, 0}, Vector{-3, 70, 2}, Vector{1 << 20, -(1 << 20), 5}}) {
        EXPECT_EQ(cuts_between(g, zero), 0);
        EXPECT_EQ(cuts_between(zero, g), 0);
        EXPECT_EQ(cuts_between(g, g), 0);
        EXPECT_EQ(cuts_between(g, Vector{4 * g[0], 4 * g[1], 4 * g[2]}), 0);
        EXPECT_EQ(cuts_between(g, Vector{-g[0], -g[1], -g[2]}), 2);
    }
    EXPECT_EQ(cuts_between(zero, zero), 0);
}

/// Even matter of depth 1 whose raw gradient turns by `degrees` from the light's direction to one `ratio`
/// times as long, lit in so many pieces by the gradient at the middle of each: diffuse light, as 1.15.
template <class W>
double light_in_pieces(const InsideStage& s, double degrees, double ratio, int pieces) {
    const auto word = [](double value) {
        if constexpr (std::same_as<W, Word>)
            return static_cast<Word>(std::floor(value * kOne + 0.5));
        else
            return W{value * kOne};
    };
    const double angle = degrees * std::numbers::pi / 180;
    PieceLight<W> sum = no_piece<W>(s);
    for (int i = 0; i < pieces; ++i) {
        const double u = (i + 0.5) / pieces;
        const double along = 1 - u + u * ratio * std::cos(angle), across = u * ratio * std::sin(angle);
        const W color = word(std::max(0.0, along / std::hypot(along, across)));
        add_piece(s, sum, std::array<W, 3>{color, color, color}, word(-std::expm1(-1.0 / pieces)));
    }
    return to_double(color_of_pieces(s, sum)[0]) / kOne * -std::expm1(-1.0);
}

struct Turning {
    double degrees, ratio, truth, mean;
};
constexpr Turning kTurning[] = {{30, 1, 0.610311850223, 0.610582},
                                {60, 1, 0.547380184847, 0.547432},
                                {90, 1, 0.450977859425, 0.446977},
                                {60, 4, 0.468598769880, 0.413820},
                                {90, 4, 0.283648669966, 0.153312}};

TEST(Inside, PiecesApproachTheExactLightOfATurningSlab) {
    const InsideStage exact = stage_of(false);
    for (const Turning& t : kTurning) {
        const double one = light_in_pieces<Real<double>>(exact, t.degrees, t.ratio, 1),
                     two = light_in_pieces<Real<double>>(exact, t.degrees, t.ratio, 2),
                     four = light_in_pieces<Real<double>>(exact, t.degrees, t.ratio, 4);
        EXPECT_NEAR(one, t.mean, 5e-7);
        EXPECT_LT(std::abs(two - t.truth), std::abs(one - t.truth));
        EXPECT_LT(std::abs(four - t.truth), std::abs(two - t.truth) / 2.5);
        EXPECT_NEAR(four, t.truth, 0.0018);
        EXPECT_NEAR(light_in_pieces<Real<double>>(exact, t.degrees, t.ratio, 4096), t.truth, 1e-8);
    }
}

TEST(Inside, RoundingCostsPiecesALastBitOfTheirLight) {
    const InsideStage rounded = stage_of(), exact = stage_of(false);
    // Of each piece: half a last bit of its share, of its opacity behind the others, and of its colour.
    for (const Turning& t : kTurning)
        for (const int pieces : {1, 2, 4})
            EXPECT_NEAR(light_in_pieces<Word>(rounded, t.degrees, t.ratio, pieces),
                        light_in_pieces<Real<double>>(exact, t.degrees, t.ratio, pieces),
                        1.5 * pieces / kOne);
}

TEST(Inside, PiecesOfOneColourKeepIt) {
    const InsideStage s = stage_of();
    std::mt19937_64 random(4);
    for (int i = 0; i < 20'000; ++i) {
        const Word color = static_cast<Word>(random() % (kOne + 1));
        PieceLight<Word> sum = no_piece<Word>(s);
        Word most = 0;
        for (int piece = 0; piece < 4; ++piece) {
            const Word alpha = random() % 4 == 0 ? kOne : static_cast<Word>(random() % (kOne + 1));
            add_piece(s, sum, Vector{color, color, color}, alpha);
            most = std::max(most, alpha);
        }
        const Vector joined = color_of_pieces(s, sum);
        if (most > 0) {
            ASSERT_EQ(joined, (Vector{color, color, color}));
        }
        ASSERT_LE(sum.through, kOne - most);
    }
    EXPECT_EQ(color_of_pieces(s, no_piece<Word>(s)), (Vector{0, 0, 0}));
}

// A wall: what lies behind it is not seen.
TEST(Inside, NothingBehindAnOpaquePieceIsSeen) {
    const InsideStage s = stage_of();
    PieceLight<Word> sum = no_piece<Word>(s);
    add_piece(s, sum, Vector{100, 200, 300}, kOne);
    const PieceLight<Word> wall = sum;
    add_piece(s, sum, Vector{30000, 0, 9}, kOne / 2);
    EXPECT_EQ(sum.light, wall.light);
    EXPECT_EQ(color_of_pieces(s, sum), (Vector{100, 200, 300}));
}

}  // namespace
}  // namespace squint
