// squint search against exhaustive search, in the abstract and on a small scene.
#include "studies/search/search.h"
#include "core/error.h"
#include "studies/sweep/run.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

namespace squint::search {
namespace {

namespace fs = std::filesystem;
using sweep::Json;
using ::testing::HasSubstr;

// ----------------------------------------------------------------------------------------- lengths

/// Wires whose roundings add up as independent noise does: a share of 4^-F each, a price a bit each.
struct Model {
    std::vector<double> share, price;
    Trial trial(const Lengths& lengths) const {
        Trial t{0, 0, 0, 0};
        for (std::size_t v = 0; v < lengths.size(); ++v)
            t.penalty += share[v] * std::ldexp(1.0, -2 * lengths[v]), t.cost += price[v] * lengths[v];
        t.error = std::sqrt(t.penalty), t.bits = t.cost;
        return t;
    }
    Problem problem(double most_error, int most) const {
        Problem p;
        p.most.assign(share.size(), most), p.shaken = share.size(), p.most_error = most_error;
        p.evaluate = [this](std::span<const Lengths> vectors, std::span<const Step>) {
            std::vector<Trial> out;
            for (const Lengths& lengths : vectors) out.push_back(trial(lengths));
            return out;
        };
        return p;
    }
};

Model model_of(std::uint64_t seed, int variables) {
    Random random{seed};
    Model model;
    for (int v = 0; v < variables; ++v)
        model.share.push_back(0.1 + 100 * random.unit()), model.price.push_back(1 + random.below(20));
    return model;
}

double cheapest_of_all(const Model& model, double most_error, int most) {
    Lengths lengths(model.share.size(), 0);
    double best = INFINITY;
    for (;;) {
        const Trial t = model.trial(lengths);
        if (t.error <= most_error) best = std::min(best, t.cost);
        std::size_t v = 0;
        while (v < lengths.size() && ++lengths[v] > most) lengths[v++] = 0;
        if (v == lengths.size()) return best;
    }
}

TEST(WordLengths, KeepTheBoundAndCannotLoseABit) {
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        const Model model = model_of(seed, 12);
        const Found found = find_lengths(model.problem(0.01, 20), {.restarts = 2, .seed = seed});
        ASSERT_TRUE(found.feasible);
        EXPECT_LE(model.trial(found.lengths).error, 0.01);
        for (std::size_t v = 0; v < found.lengths.size(); ++v) {
            Lengths less = found.lengths;
            if (less[v] == 0) continue;
            --less[v];
            EXPECT_GT(model.trial(less).error, 0.01) << "seed " << seed << ", variable " << v;
        }
    }
}

// Four variables of 0 to 12 bits: 28,561 vectors.
TEST(WordLengths, EqualExhaustiveSearchOnMostModelsAndAreNeverAFiftiethAbove) {
    int equal = 0;
    constexpr int kModels = 20;
    for (std::uint64_t seed = 1; seed <= kModels; ++seed) {
        const Model model = model_of(seed, 4);
        const double best = cheapest_of_all(model, 0.1, 12);
        const Found found = find_lengths(model.problem(0.1, 12), {.restarts = 16, .seed = seed});
        ASSERT_GE(found.trial.cost, best) << "exhaustive search missed one";
        equal += found.trial.cost == best;
        // Greedy search may end a bit or so beside the best of some 28 bits; what is claimed is measured
        // here.
        EXPECT_LE(found.trial.cost, best * 1.02) << "seed " << seed;
    }
    EXPECT_GE(equal, kModels * 3 / 4);
}

TEST(WordLengths, RestartsNeverMakeItDearer) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const Model model = model_of(seed, 8);
        const double once = find_lengths(model.problem(0.05, 16), {}).trial.cost;
        EXPECT_LE(find_lengths(model.problem(0.05, 16), {.restarts = 8, .seed = seed}).trial.cost, once);
    }
}

TEST(WordLengths, AreRaisedNoFurtherThanABitOfEachBeyondNeed) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const Model model = model_of(seed, 6);
        const Found loose = find_lengths(model.problem(0.1, 20), {});
        const Found tight = raise_lengths(model.problem(0.01, 20), loose.lengths);
        ASSERT_TRUE(tight.feasible);
        EXPECT_LE(model.trial(tight.lengths).error, 0.01);
        for (std::size_t v = 0; v < tight.lengths.size(); ++v)
            EXPECT_GE(tight.lengths[v], loose.lengths[v]) << "nothing is taken";
        // Seven bits of sixty or so make ten times less; what is greedy ends near what searching anew finds.
        EXPECT_LE(tight.trial.cost, 1.1 * find_lengths(model.problem(0.01, 20), {}).trial.cost)
            << "seed " << seed;
    }
    EXPECT_FALSE(raise_lengths(model_of(1, 3).problem(1e-9, 4), {1, 1, 1}).feasible);
}

TEST(WordLengths, SayWhenNotEvenTheMostAreEnough) {
    const Model model = model_of(1, 3);
    EXPECT_FALSE(find_lengths(model.problem(1e-9, 4), {}).feasible);
}

// ------------------------------------------------------------------------------------------ scenes

class Search : public ::testing::Test {
  protected:
    Settings small(const std::string& run) const {
        Settings s;
        s.overrides = {"volume.dims=12",   "image.width=10", "image.height=8",
                       "camera.height=12", "lights=[]",      "classification.method=pc"};
        s.most_error = 1, s.views = 1, s.integer_bits = false, s.descent.restarts = 8;
        s.wires = {Wire::contribution, Wire::color, Wire::transparency};
        s.folder = (folder / run).string();
        return s;
    }
    Json points(const std::string& run) const {
        return sweep::read_json((folder / run / "sweep.json").string())["points"];
    }
    const test::OwnFolder folder;
};

TEST_F(Search, EqualsExhaustiveSearchOverThreeWires) {
    const Settings s = small("run");
    const Result result = run_search(s);
    EXPECT_LE(result.found.error, 1);

    // Every vector of 4 to 13 bits: at 3 bits a wire's own half bit is 16 LSB8, and all at 13 pass.
    sweep::SweepFile all;
    all.overrides = s.overrides;
    all.measure.ssim = false, all.measure.picture_size = 0;
    sweep::Evaluator evaluator(all, "");
    double best = INFINITY;
    for (int a = 4; a <= 13; ++a)
        for (int b = 4; b <= 13; ++b)
            for (int c = 4; c <= 13; ++c) {
                sweep::Point point;
                const int bits[] = {a, b, c};
                for (std::size_t w = 0; w < 3; ++w)
                    point.edits.push_back({s.wires[w], sweep::WireEdit::Part::fraction_bits, bits[w], {}});
                const Json record = evaluator.measure(evaluator.prepare(point), 1, false);
                const Json& error = record["error"]["real"];
                const double color = error["color"]["max_error_lsb8"],
                             alpha = error["alpha"]["max_error_lsb8"];
                if (std::max(color, alpha) <= 1) best = std::min(best, record["cost"]["bits"].get<double>());
            }
    EXPECT_EQ(result.found.bits, best);
}

TEST_F(Search, LeavesTheSameTrailWhateverTheThreads) {
    Settings s = small("one");
    s.integer_bits = true, s.descent.restarts = 2, s.threads = 1;
    const Result one = run_search(s);
    s.folder = (folder / "three").string(), s.threads = 3;
    const Result three = run_search(s);
    EXPECT_EQ(one.found.specs, three.found.specs);
    EXPECT_EQ(points("one"), points("three"));
}

TEST_F(Search, GoesOnWithThePicturesThatAreThere) {
    const Settings s = small("run");
    const Result first = run_search(s), again = run_search(s);
    EXPECT_GT(first.computed, 20u);
    EXPECT_EQ(again.computed, 0u);
    EXPECT_EQ(first.found.specs, again.found.specs);
}

TEST_F(Search, HoldsOutSixteenViewsAtLeast) {
    Settings s = small("run");
    s.views = 2, s.descent.restarts = 0, s.most_error = 40;
    const Result result = run_search(s);
    EXPECT_EQ(result.sets, 1) << "coarse enough to hold everywhere";
    EXPECT_THAT(result.degrees, ::testing::ElementsAre(0, 180));
    EXPECT_EQ(result.other_degrees.size(), 16u);
    EXPECT_NEAR(result.may_break_percent(), 17.1, 0.05) << "(1 - 0.171)^16 = 0.05";
    std::set<std::string> tuned, held;
    for (const Json& point : points("run")) {
        const std::string phase = point["values"]["phase"];
        (phase.ends_with("other views") ? held : tuned).insert(point["values"]["degrees"].dump());
    }
    EXPECT_EQ(held.size(), 16u);
    s.views = 20, s.folder += "-20";
    EXPECT_EQ(run_search(s).other_degrees.size(), 20u);
}

// What a single view of 10 x 8 pixels asks for is not what all around asks for.
TEST_F(Search, WritesNoFormatsThatAHeldOutViewBreaks) {
    int backed_off = 0;
    for (const double most : {1.0, 4.0}) {
        Settings s = small(std::to_string(most));
        s.most_error = most, s.descent.restarts = 0;
        const Result result = run_search(s);
        ASSERT_EQ(result.failure, "");
        backed_off += result.sets > 1;
        EXPECT_LE(result.found.error, most);
        EXPECT_LE(result.found.other_error, most);
        EXPECT_EQ(result.degrees.size(), 1 + 16 * static_cast<std::size_t>(result.sets - 1));
        // The last set took no part in any decision: it is met once the formats stand.
        std::set<double> decided(result.degrees.begin(), result.degrees.end());
        for (const double degrees : result.other_degrees) EXPECT_FALSE(decided.contains(degrees)) << degrees;
        double worst = 0;
        for (const Json& point : points(std::to_string(most)))
            if (std::string(point["values"]["phase"]).starts_with("found")) {
                const Json record = sweep::read_json(
                    (folder / std::to_string(most) / "points" / (std::string(point["hash"]) + ".json"))
                        .string());
                for (const char* channel : {"color", "alpha"})
                    worst = std::max(worst, record["error"]["real"][channel]["max_error_lsb8"].get<double>());
            }
        EXPECT_LE(worst, most) << "the record of every view";
    }
    EXPECT_GT(backed_off, 0) << "or the test says nothing";
}

TEST_F(Search, RefusesInOneLineWhatCannotBe) {
    const auto refusal = [](const Settings& s) -> std::string {
        try {
            run_search(s);
        } catch (const InputError& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    Settings s = small("run");
    s.most_error = 1e-12;
    const Result none = run_search(s);
    EXPECT_THAT(none.failure, HasSubstr("--max-error: found 1e-12, but with every wire at its widest"));
    EXPECT_EQ(none.formats_file, "");
    EXPECT_FALSE(fs::exists(folder / "run" / "formats.toml"));
    s = small("run");
    s.wires = {Wire::dot};
    EXPECT_THAT(refusal(s), HasSubstr("--wires: dot carries nothing in this scene"));
    s = small("run");
    s.overrides.push_back("precision.preset=real");
    EXPECT_THAT(refusal(s), HasSubstr("real has no formats"));
    s = small("run");
    s.overrides.push_back("sampling.stepp=1");
    EXPECT_THAT(refusal(s), HasSubstr("did you mean"));
    s = small("run");
    s.scenes = {"nothing.toml"};
    EXPECT_THAT(refusal(s), HasSubstr("nothing.toml"));
}

}  // namespace
}  // namespace squint::search
