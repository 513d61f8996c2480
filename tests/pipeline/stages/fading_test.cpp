// Light that fades inside a slab: pi2d's tables of where it lies, and what linear and nlpi make of it between two
// normals (docs/papers/guetat.md).  The exact values are those of even matter, x = int tau.
#include "core/error.h"
#include "pipeline/classification/tables/fade_table.h"
#include "pipeline/slab-inl.h"
#include "tests/pipeline/stages/word_of.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using preintegration::FadeMoments;
using test::word_of;
using Word = std::int64_t;

Entries even_matter(double x) {
    Entries entries;
    entries.entry.resize(2);
    for (Entry& entry : entries.entry) entry.color = Vec3(1, 1, 1), entry.extinction = x;
    return entries;
}

struct Moments {
    double x, i0, i1, i2, i3;
};
constexpr Moments kMoments[] = {{0.5, 0.393469340287, 0.180408020862, 0.115101423736, 0.084077882702},
                                {1, 0.632120558829, 0.264241117657, 0.160602794143, 0.113928941257},
                                {2, 0.864664716763, 0.296997075145, 0.161661791908, 0.107157404626},
                                {4, 0.981684361111, 0.227105451389, 0.095237086806, 0.053112176216}};

TEST(FadeMoments, AreTheExactOnesOfEvenMatter) {
    for (const Moments& m : kMoments)
        for (const double back : {1.0, 0.0, 0.25}) {  // rising, falling, and a part of an entry
            const FadeMoments b = preintegration::fade_moments(even_matter(m.x), back == 0 ? 1 : 0, back, 1);
            for (std::size_t c = 0; c < 4; ++c) {
                EXPECT_NEAR(b[0][c] + b[1][c] + b[2][c] + b[3][c], m.i0, 1e-12);
                EXPECT_NEAR(preintegration::first_moment(b)[c], m.i1, 1e-12);
                EXPECT_NEAR(b[2][c] / 3 + b[3][c], m.i2, 1e-12);
                EXPECT_NEAR(b[3][c], m.i3, 1e-12);
            }
        }
}

/// Matter with a colour and an extinction of its own at every entry, thin, thick and none.
Entries any_matter(int size, unsigned seed) {
    std::mt19937_64 random(seed);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    Entries entries;
    entries.entry.resize(static_cast<std::size_t>(size));
    for (Entry& entry : entries.entry) {
        entry.color = Vec3(unit(), unit(), unit());
        const std::uint64_t kind = random() % 8;
        entry.extinction = kind < 2 ? 0 : kind == 2 ? 200 * unit() : 3 * unit();
    }
    return entries;
}

TEST(FadeMoments, OfTablesAreThoseOfEachSlab) {
    for (const auto& size : {std::pair{100, 100}, {300, 129}, {40, 161}}) {
        const int entries = size.first, nodes = size.second;
        const Entries matter = any_matter(entries, 7);
        const auto tables = preintegration::build_fades(matter, nodes, 0.8, false),
                   first = preintegration::build_fades(matter, nodes, 0.8, true);
        ASSERT_EQ(tables.size(), 3u);
        ASSERT_EQ(first.size(), 1u);
        for (int front = 0; front < nodes; front += 3)
            for (int back = 0; back < nodes; back += 2) {
                const auto coordinate = [&](int node) { return node * (entries - 1.0) / (nodes - 1); };
                const FadeMoments b =
                    preintegration::fade_moments(matter, coordinate(front), coordinate(back), 0.8);
                const auto at = static_cast<std::size_t>(front * nodes + back) * 4;
                for (std::size_t c = 0; c < 4; ++c) {
                    // Three roundings of 2^-53 at each of 97 steps, which grow by (1 + 1/65)^(3 97) = 86 while
                    // the origin moves, in Bernstein sums of up to 12 moments.
                    for (std::size_t k = 1; k < 4; ++k) ASSERT_NEAR(tables[k - 1][at + c], b[k][c], 4e-11);
                    ASSERT_NEAR(first[0][at + c], preintegration::first_moment(b)[c], 4e-11);
                }
            }
    }
}

Plan plan_of(const std::string& rule, double x, const std::string& preset,
             std::vector<std::string> more = {}) {
    std::vector<std::string> settings{
        "volume.procedural=ramp",
        "volume.dims=33",
        "volume.bits=12",
        "classification.method=pi2d",
        "classification.table_size=64",
        "transfer_function.entries=64",
        "transfer_function.unit_distance=1",
        "shading.model=blinn_phong",
        "shading.ka=0",
        "shading.kd=1",
        "shading.ks=0",
        "shading.inside=" + rule,
        "precision.preset=" + preset,
        "sampling.step=1",
        fmt::format("transfer_function.points=[[0,1,1,1,{0:.17g}],[4095,1,1,1,{0:.17g}]]", -std::expm1(-x))};
    settings.insert(settings.end(), more.begin(), more.end());
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}
template <class W, class M>
FadingLight<W> fades_of(const Plan& plan, const M& method, W front, W back, W length, const Slab<W>& slab) {
    if constexpr (requires { method.fades; })
        return fading_light(method, front, back, length, slab);
    else
        return fading_light_of_quarters(plan.inside, method, front, back, length, slab);
}

/// The light of even matter of depth x whose unit normal turns by so many degrees from the light's direction, lit
/// over its whole slab.
template <class W, class M = PreIntegrated2D>
double lit(const Plan& plan, double degrees) {
    const auto& method = std::get<M>(plan.method);
    const W front = word_of<W>(0), back = word_of<W>(static_cast<double>(plan.input.highest)),
            full = word_of<W>(std::ldexp(1.0, plan.location.length_fraction));
    Slab<W> slab = classify(method, front, back, full);
    const FadingLight<W> light = fades_of(plan, method, front, back, full, slab);
    const double angle = degrees * std::numbers::pi / 180,
                 one = std::ldexp(1.0, plan.shading.normal_fraction);
    const Vec3 towards =
        plan.scene.lights[0].headlight ? -plan.camera.view : plan.scene.lights[0].direction.normalized();
    const Vec3 across = towards.cross(Vec3(0.3, 0.9, 0.1)).normalized();
    const Vec3 turned = towards * std::cos(angle) + across * std::sin(angle);
    const auto as_word = [&](const Vec3& v) {
        return std::array<W, 3>{word_of<W>(v[0] * one), word_of<W>(v[1] * one), word_of<W>(v[2] * one)};
    };
    shade_fading(plan.shading, RayWords<W>{}, {as_word(towards), as_word(turned)},
                 {word_of<W>(0), word_of<W>(0)}, light, slab.color);
    const double color = to_double(slab.color[1]) / std::ldexp(1.0, plan.shading.color_fraction);
    return M::kPremultiplied
               ? color
               : color * to_double(slab.alpha) / std::ldexp(1.0, method.prefix.entries.alpha_fraction);
}

struct Turning {
    double degrees, linear, nlpi;
};
constexpr Turning kTurning[] = {{0, 0.632120558829, 0.632120558829},
                                {30, 0.596719, 0.610460},
                                {60, 0.500000, 0.549691},
                                {90, 0.367879, 0.462261}};

TEST(FadingLight, OfATurningSlabIsThePapers) {
    const Plan linear = plan_of("linear", 1, "real"), nlpi = plan_of("nlpi", 1, "real");
    for (const Turning& t : kTurning) {
        EXPECT_NEAR(lit<Real<double>>(linear, t.degrees), t.linear, 1e-6) << t.degrees;
        // A table of 257 rows for the arc, straight between them.
        EXPECT_NEAR(lit<Real<double>>(nlpi, t.degrees), t.nlpi, 4e-6) << t.degrees;
    }
    // Beyond 90 degrees the quadratic is left for the straight line.
    for (const double degrees : {91.0, 120.0, 180.0})
        EXPECT_NEAR(lit<Real<double>>(nlpi, degrees), lit<Real<double>>(linear, degrees), 1e-9) << degrees;
}

// Without tables over both ends: from what the method makes of the slab's quarters.
template <class M>
void expect_the_papers(const std::string& method, double x) {
    const std::vector<std::string> of{"classification.method=" + method,
                                      "classification.order=" + std::string(method == "leg" ? "2" : "1")};
    const Plan linear = plan_of("linear", x, "real", of), nlpi = plan_of("nlpi", x, "real", of),
               words = plan_of("nlpi", x, "default", of), table = plan_of("nlpi", x, "real"),
               straight = plan_of("linear", x, "real");
    for (const double degrees : {0.0, 30.0, 60.0, 88.0, 180.0}) {  // not 90, where the quadratic ends
        // Lines between rows of `lean` err by 2e-5 of a quarter.
        EXPECT_NEAR((lit<Real<double>, M>(linear, degrees)), lit<Real<double>>(straight, degrees), 1e-5)
            << degrees;
        // The quarter's light is moved, and keeps its even spread: (x / 4)^2 / 240 / 16 of b'' <= 6.
        EXPECT_NEAR((lit<Real<double>, M>(nlpi, degrees)), lit<Real<double>>(table, degrees),
                    1e-5 + x * x / 16 / 240 / 16 * 6)
            << degrees;
        // A share, a part and a coefficient of 14 bits for each of four parts.
        EXPECT_NEAR((lit<Word, M>(words, degrees)), (lit<Real<double>, M>(nlpi, degrees)), 12 * 0x1p-15)
            << degrees;
    }
}
TEST(FadingLight, OfQuartersIsThePapersToo) {
    for (const double x : {0.25, 1.0, 2.0}) {
        expect_the_papers<PowerSeriesOfOrder1>("pips", x);
        expect_the_papers<MomentSeries>("leg", x);
    }
}

/// Calls light_of(plan, front, back, length) for random slabs, now and then a point, of a function with a wall and of
/// one without: the wall ends some.
template <class LightOf>
void expect_parts(const std::vector<std::string>& method, const LightOf& light_of) {
    for (const char* rule : {"linear", "nlpi"})
        for (const bool has_wall : {false, true}) {
            std::vector<std::string> settings = method;
            settings.push_back(
                has_wall ? "transfer_function.points="
                           "[[0,1,0.2,0,0],[1000,0,1,0.4,0.3],[2015,0.5,0.5,1,1],[2500,1,1,1,0.1]]"
                         : "transfer_function.points="
                           "[[0,1,0.2,0,0],[1000,0,1,0.4,0.3],[2500,0.5,0.5,1,0.9],[4095,1,1,1,0.1]]");
            const Plan plan = plan_of(rule, 1, "default", settings);
            std::mt19937_64 random(11);
            const auto below = [&](Word end) {
                return static_cast<Word>(random() % static_cast<std::uint64_t>(end));
            };
            int walls = 0;
            for (int i = 0; i < 20'000; ++i) {
                const Word front = below(plan.input.highest + 1),
                           back = i % 16 == 0 ? front : below(plan.input.highest + 1);
                const Word full = Word{1} << plan.location.length_fraction;
                const Word length = i % 3 == 0 ? 1 + below(full) : full;
                const FadingLight<Word> light = light_of(plan, front, back, length);
                ASSERT_EQ(light.count, std::string(rule) == "linear" ? 2 : 4);
                walls += light.end < Word{1} << kWayBits;
            }
            EXPECT_EQ(walls > 0, has_wall);
        }
}
/// The sum of the parts of a channel, or of white, none of which is below zero.
Word sum_of_parts(const FadingLight<Word>& light, std::size_t channel) {
    Word sum = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(light.count); ++k) {
        EXPECT_GE(light.part[k][channel], 0);
        sum += light.part[k][channel];
    }
    return sum;
}

TEST(FadingLight, OfQuartersSumsToTheSlab) {
    expect_parts({"classification.method=pips", "classification.order=1"},
                 [](const Plan& plan, Word front, Word back, Word length) {
                     const auto& method = std::get<PowerSeriesOfOrder1>(plan.method);
                     const Slab<Word> slab = classify(method, front, back, length);
                     const FadingLight<Word> light = fades_of(plan, method, front, back, length, slab);
                     for (std::size_t c = 0; c < 4; ++c)
                         EXPECT_EQ(sum_of_parts(light, c), c < 3 ? slab.color[c] : method.one_ratio)
                             << front << ' ' << back << ' ' << length;
                     return light;
                 });
}

// A wall's place is that of its entry on the way.
TEST(FadingLight, EndsAtTheWall) {
    const Plan plan =
        plan_of("linear", 1, "default",
                {"transfer_function.points=[[0,1,1,1,0.1],[2015,1,1,1,0.1],[2080,1,1,1,1],[4095,1,1,1,1]]"});
    const auto& method = std::get<PreIntegrated2D>(plan.method);
    const Word full = Word{1} << plan.location.length_fraction;
    int walls = 0;
    for (Word back = 0; back <= plan.input.highest; back += 97) {
        const CutSlab<Word> cut = cut_at_wall(method.prefix, Word{0}, back);
        const Slab<Word> slab = classify(method, Word{0}, back, full);
        const FadingLight<Word> light = fading_light(method, Word{0}, back, full, slab);
        const double way = cut.wall ? static_cast<double>(cut.end_input) / static_cast<double>(back) : 1;
        EXPECT_NEAR(static_cast<double>(light.end), std::ldexp(way, kWayBits), 0.5) << back;
        walls += cut.wall && way < 0.9;
    }
    EXPECT_GT(walls, 20);
}

TEST(FadingLight, InWordsErrsByAFewLastBits) {
    for (const char* rule : {"linear", "nlpi"}) {
        const Plan words = plan_of(rule, 1, "default"), real = plan_of(rule, 1, "real");
        for (double degrees = 0; degrees <= 180; degrees += 8)  // not 90, where the quadratic ends
            // Half a last bit of each of four parts and coefficients, of the turn and the arc, and of the light.
            EXPECT_NEAR(lit<Word>(words, degrees), lit<Real<double>>(real, degrees), 6 * 0x1p-15)
                << rule << ' ' << degrees;
    }
}

// Parts are taken from the slab itself: whatever is rounded, and wherever a wall or a ray's end cuts it.
TEST(FadingLight, PartsSumToTheSlab) {
    expect_parts({}, [](const Plan& plan, Word front, Word back, Word length) {
        const auto& method = std::get<PreIntegrated2D>(plan.method);
        const Slab<Word> slab = classify(method, front, back, length);
        const FadingLight<Word> light = fading_light(method, front, back, length, slab);
        for (std::size_t c = 0; c < 4; ++c) {
            const Word sum = sum_of_parts(light, c),
                       all = c < 3 ? slab.color[c] : largest_color(method.premultiplied, slab.alpha);
            // A point is its own matter's; the cell's beside it may be brighter by roundings.
            EXPECT_TRUE(sum == all || (front == back && std::abs(sum - all) < 64))
                << front << ' ' << back << ' ' << length << ": " << sum << ", not " << all;
        }
        return light;
    });
}

TEST(FadingLight, AZeroNormalTakesTheOthers) {
    std::array<Word, 3> none{0, 0, 0}, other{3, -4, 12};
    share_normal(none, other);
    EXPECT_EQ(none, other);
    none = {0, 0, 0};
    share_normal(other, none);
    EXPECT_EQ(none, other);
    std::array<Word, 3> front{1, 0, 0}, back{0, 1, 0};
    share_normal(front, back);
    EXPECT_EQ(front, (std::array<Word, 3>{1, 0, 0}));
    EXPECT_EQ(back, (std::array<Word, 3>{0, 1, 0}));
}

TEST(FadingLight, IsRefusedWithoutTables) {
    for (const char* rule : {"linear", "nlpi"})
        for (const char* method : {"pi1d", "pi2d_no_attenuation"}) try {
                plan_of(rule, 1, "default", {std::string("classification.method=") + method});
                ADD_FAILURE() << rule << ' ' << method;
            } catch (const InputError& error) {
                const std::string text = error.what();
                for (const char* part : {"shading.inside", rule, method, "\"pi2d\"", "middle"})
                    EXPECT_NE(text.find(part), std::string::npos) << text;
                EXPECT_EQ(text.find("adaptive"), std::string::npos) << text;
            }
    try {
        plan_of("nlpi", 1, "default", {"classification.table_size=2048"});
        ADD_FAILURE();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("1024 at most"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace squint
