// Sweep files, their points, what a point is called and what its formats cost.
#include "core/error.h"
#include "studies/sweep/cost.h"
#include "studies/sweep/evaluate.h"
#include "studies/sweep/points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace squint::sweep {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kTiny =
    "[base]\nvolume.dims = 12\nimage.width = 8\nimage.height = 8\ncamera.height = 12\nlights = []\n"
    "classification.method = 'pc'\n";

SweepFile parsed(const std::string& text) {
    return parse_sweep(text, "s.toml", "");
}
std::vector<std::string> labels(const std::vector<Point>& points) {
    std::vector<std::string> out;
    for (const Point& point : points) {
        std::string line;
        for (const auto& [axis, label] : point.values) line += (line.empty() ? "" : " ") + label;
        out.push_back(line);
    }
    return out;
}
std::string refusal(const std::string& text) {
    try {
        parsed(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "nothing was refused";
}

TEST(SweepFile, MultipliesItsAxesWithTheLastChangingFastest) {
    const SweepFile sweep = parsed(
        "[[axis]]\nkey = 'sampling.step'\nvalues = [1, 0.5]\n[[axis]]\nkey = 'classification.method'\nvalues "
        "= "
        "['pc', 'pi2d']\n");
    EXPECT_THAT(labels(expand(sweep, {})),
                ElementsAre("1 \"pc\"", "1 \"pi2d\"", "0.5 \"pc\"", "0.5 \"pi2d\""));
    EXPECT_THAT(expand(sweep, {})[2].overrides,
                ElementsAre("sampling.step=0.5", "classification.method=\"pc\""));
}

TEST(SweepFile, RangesHoldBothEndsAndNoRoundingError) {
    const auto of = [](const std::string& range) {
        return labels(expand(parsed("[[axis]]\nkey = 'sampling.step'\nrange = " + range), {}));
    };
    EXPECT_THAT(of("{ from = 0.1, to = 0.5, step = 0.1 }").size(), 5u);
    EXPECT_THAT(of("{ from = 4, to = 8, step = 2 }"), ElementsAre("4", "6", "8"));
    EXPECT_THAT(of("{ from = 0.25, to = 4, factor = 2 }"), ElementsAre("0.25", "0.5", "1.0", "2.0", "4.0"));
    EXPECT_THAT(of("{ from = 3, to = 1, step = -1 }"), ElementsAre("3", "2", "1"));
}

TEST(SweepFile, WalksZippedListsSideBySide) {
    const SweepFile sweep = parsed(
        "[[axis]]\nzip = { \"sampling.step\" = [1, 0.5], \"classification.table_size\" = { from = 64, to = "
        "128, "
        "step = 64 } }\n");
    const auto points = expand(sweep, {});
    ASSERT_EQ(points.size(), 2u);
    EXPECT_THAT(points[1].overrides, ElementsAre("sampling.step=0.5", "classification.table_size=128"));
}

TEST(SweepFile, VariesOneWireAtATimeFirstFThenIThenAllTogether) {
    const SweepFile sweep =
        parsed("[wires]\nnames = ['color', 'transparency']\nfraction_bits = [8, 9]\ninteger_bits = [1]\n");
    std::vector<std::string> varied;
    for (const Point& point : expand(sweep, {})) varied.push_back(point.varied);
    EXPECT_THAT(varied,
                ElementsAre("", "color fraction_bits", "color fraction_bits", "transparency fraction_bits",
                            "transparency fraction_bits", "color integer_bits", "transparency integer_bits",
                            "all wires fraction_bits", "all wires fraction_bits", "all wires integer_bits"));
}

TEST(SweepFile, CombinesACrossedAxisWithEveryPointOfOneAtATime) {
    const SweepFile sweep = parsed(
        "[[axis]]\nkey = 'sampling.step'\nvalues = [1, 2]\ncross = true\n[wires]\nnames = ['color']\n"
        "fraction_bits = [8]\n");
    EXPECT_THAT(labels(expand(sweep, {})), ElementsAre("1", "1 8", "2", "2 8"));
}

TEST(SweepFile, DrawsDistinctPointsAndTheSameOnesForASeed) {
    const std::string axes =
        "mode = 'random'\nsamples = 40\nseed = 5\n[[axis]]\nkey = 'sampling.step'\nrange = { from = 1, to = "
        "10, "
        "step = 1 }\n[[axis]]\nkey = 'shading.exponent'\nrange = { from = 1, to = 10, step = 1 }\n";
    const auto once = labels(expand(parsed(axes), {})), again = labels(expand(parsed(axes), {}));
    EXPECT_EQ(once, again);
    EXPECT_EQ(std::set<std::string>(once.begin(), once.end()).size(), 40u);
    std::string other = axes;
    other.replace(other.find("seed = 5"), 8, "seed = 6");
    EXPECT_NE(labels(expand(parsed(other), {})), once);
}

TEST(SweepFile, SaysInOneLineWhatIsWrongAndWhere) {
    EXPECT_THAT(refusal("[[axis]]\nkey = 'sampling.stepp'\nvalues = [1]\n"),
                "s.toml:2:1: unknown setting \"sampling.stepp\"; did you mean \"sampling.step\"?");
    EXPECT_THAT(refusal("[base]\nsampling.stpe = 1\n"), HasSubstr("s.toml:2:"));
    EXPECT_THAT(refusal("[[axis]]\nwires = ['colour']\nfraction_bits = [8]\n"),
                HasSubstr("did you mean \"color\"?"));
    EXPECT_THAT(refusal("[[axis]]\nwires = ['color']\nfraction_bits = [30]\n"),
                HasSubstr("allowed: a whole number from 0 to 29"));
    EXPECT_THAT(refusal("[[axis]]\nkey = 'sampling.step'\nvalues = []\n"), HasSubstr("at least one value"));
    EXPECT_THAT(refusal("[[axis]]\nkey = 'sampling.step'\nrange = { from = 1, to = 2, step = -1 }\n"),
                HasSubstr("leads from"));
    EXPECT_THAT(refusal("[[axis]]\nzip = { \"sampling.step\" = [1], \"shading.exponent\" = [1, 2] }\n"),
                HasSubstr("lists of one length"));
    EXPECT_THAT(refusal("mode = 'grid'\n"), HasSubstr("product, one_at_a_time or random"));
    EXPECT_THAT(refusal("mode = 'random'\n[[axis]]\nkey = 'sampling.step'\nvalues = [1]\n"),
                HasSubstr("samples"));
    EXPECT_THAT(refusal("[measure]\nrael = true\n"), HasSubstr("did you mean \"real\"?"));
}

// ------------------------------------------------------------------------------------------ points

std::vector<Prepared> prepared(const SweepFile& sweep) {
    Evaluator evaluator(sweep, "");
    std::vector<Prepared> out;
    for (const Point& point : expand(sweep, evaluator.wires_in_use()))
        out.push_back(evaluator.prepare(point));
    return out;
}

TEST(SweepPoint, ChangesOnePartOfAWireAndKeepsTheRest) {
    const auto points =
        prepared(parsed(kTiny + "precision.color = 'u2.15 trn wrap'\n[[axis]]\nwires = ['color']\n"
                                "fraction_bits = [9]\n"));
    EXPECT_THAT(points[0].settings.back(), "precision.color=\"u2.9 trn wrap\"");
}

TEST(SweepPoint, IsCalledBySpecsAndNotByTheWayTheyAreWritten) {
    const auto points = prepared(parsed(
        kTiny + "[[axis]]\nkey = 'precision.color'\nvalues = ['u1.15', 'u1.15 rnd_conv sat', 'u1.14']\n"));
    EXPECT_EQ(points[0].hash, points[1].hash) << "the default preset's own Spec, in short and in full";
    EXPECT_NE(points[0].hash, points[2].hash);
}

TEST(SweepPoint, IsCalledByItsDataToo) {
    const auto points = prepared(
        parsed(kTiny + "[[axis]]\nkey = 'volume.procedural'\nvalues = ['phantom', 'shells']\n[[axis]]\n"
                       "key = 'volume.spacing'\nvalues = [[1, 1, 1], [1, 1, 2]]\n"));
    std::set<std::string> hashes;
    for (const Prepared& point : points) hashes.insert(point.hash);
    EXPECT_EQ(hashes.size(), 4u);
}

TEST(SweepPoint, KeepsWhyItCannotBeRendered) {
    const auto points = prepared(parsed(kTiny + "[[axis]]\nkey = 'sampling.step'\nvalues = [1, -1]\n"));
    EXPECT_EQ(points[0].failure, "");
    EXPECT_THAT(points[1].failure, HasSubstr("sampling.step"));
    EXPECT_NE(points[1].hash, "");
}

// Squeeze's V has one integer bit: at a step of 4 voxels the preset alone is refused.
TEST(SweepPoint, MendsAPresetThatDoesNotFit) {
    const SweepFile sweep = parsed(kTiny +
                                   "precision.preset = 'squeeze'\nsampling.step = 4\n[[axis]]\n"
                                   "key = 'precision.direction'\nvalues = ['s1.12', 's3.12']\n");
    Evaluator evaluator(sweep, "");
    const std::vector<Point> points = expand(sweep, {});
    EXPECT_THAT(evaluator.prepare(points[0]).failure, HasSubstr("precision.direction"));
    EXPECT_EQ(evaluator.prepare(points[1]).failure, "");
}

// The exact integral knows no slabs: rules of their light, methods and steps share one picture of it.
TEST(SweepPoint, SharesItsReferenceWithAllThatTheExactIntegralDoesNotKnow) {
    const SweepFile sweep = parsed(kTiny +
                                   "[[axis]]\nname = 'way'\nsettings = [\n"
                                   "{ label = 'a', lights = [{ headlight = true }], classification.method = "
                                   "'pips', shading.inside = 'mean' },\n"
                                   "{ label = 'b', lights = [{ headlight = true }], classification.method = "
                                   "'pi2d', shading.inside = 'nlpi' },\n"
                                   "{ label = 'c', lights = [{ headlight = true }], sampling.step = 0.5 },\n"
                                   "{ label = 'd', lights = [] },\n"
                                   "{ label = 'e', lights = [{ headlight = true }], shading.ks = 0 }]\n"
                                   "[measure]\nreal = false\nreference = true\n");
    Evaluator evaluator(sweep, "");
    std::vector<std::string> keys;
    for (const Point& point : expand(sweep, {})) {
        const Prepared p = evaluator.prepare(point);
        ASSERT_EQ(p.failure, "");
        keys.push_back(evaluator.baseline_keys(p).at(0));
    }
    EXPECT_EQ(keys[0], keys[1]);
    EXPECT_EQ(keys[0], keys[2]);
    EXPECT_NE(keys[0], keys[3]);
    EXPECT_NE(keys[0], keys[4]);
}

TEST(SweepPoint, MeasuresNoErrorWhereNothingIsRounded) {
    const SweepFile sweep = parsed(kTiny + "precision.preset = 'real'\n");
    Evaluator evaluator(sweep, "");
    const Json record = evaluator.measure(evaluator.prepare(expand(sweep, {})[0]), 1, false);
    EXPECT_EQ(record["error"]["real"]["color"]["identical"], true);
    EXPECT_EQ(record["error"]["real"]["alpha"]["max_error_lsb8"], 0.0);
}

// White fog: C + T is one at every step of the w form, and truncating equation 9 loses some (docs/math.md#c1).
TEST(SweepPoint, SeesThatTheWFormConservesAndEquation9DoesNot) {
    const SweepFile sweep = parsed(
        "[base]\nvolume.procedural = 'fog'\nvolume.dims = 64\nimage.width = 8\nimage.height = 8\n"
        "camera.height = 60\nlights = []\nclassification.method = 'pc'\ntransfer_function.unit_distance = 1\n"
        "transfer_function.points = [[0, 1, 1, 1, 0.004], [255, 1, 1, 1, 0.004]]\nsampling.termination = 0\n"
        "[[axis]]\nkey = 'compositing.form'\nvalues = ['w', 'equation_9']\n[measure]\nconservation = true\n");
    Evaluator evaluator(sweep, "");
    std::vector<double> lost;
    for (const Point& point : expand(sweep, {})) {
        Prepared p = evaluator.prepare(point);
        for (const Wire wire : {Wire::color, Wire::transparency, Wire::contribution})
            p.scene.precision.override_[static_cast<std::size_t>(wire)] = "u1.12 trn";
        const Json record = evaluator.measure(p, 1, false);
        lost.push_back(std::max(-record["conservation"]["least_lsb8"].get<double>(),
                                record["conservation"]["most_lsb8"].get<double>()));
    }
    EXPECT_EQ(lost[0], 0);
    // Some 64 samples lose up to a last bit each, of C and of T.
    EXPECT_GT(lost[1], 0);
    EXPECT_LE(lost[1], 2 * 110 * 255.0 / 4096);
}

TEST(SweepPoint, CountsSamplesAtWhichTransparencyStuck) {
    // alpha T below half a last bit of u1.8 rounds to nothing: w = q(0.001 T) is 0 for every T.
    const SweepFile sweep = parsed(
        kTiny +
        "volume.procedural = 'fog'\ntransfer_function.unit_distance = 1\ntransfer_function.points = [[0, 1, "
        "1, 1, "
        "0.001], [255, 1, 1, 1, 0.001]]\nprecision.contribution = 'u1.8'\nprecision.transparency = 'u1.8'\n"
        "[measure]\naudit = true\n");
    Evaluator evaluator(sweep, "");
    const Json record = evaluator.measure(evaluator.prepare(expand(sweep, {})[0]), 1, false);
    EXPECT_GT(record["stuck"]["visible_samples"], 0);
    // A ray's first sample has no T before it to compare with.
    EXPECT_EQ(record["stuck"]["stuck_samples"].get<int>(),
              record["stuck"]["visible_samples"].get<int>() - record["stuck"]["rays"].get<int>());
    EXPECT_EQ(record["audit"]["contribution"]["max_raw"], 0);
    // Every w was something and became nothing; no C was anything to begin with.
    EXPECT_EQ(record["audit"]["contribution"]["underflowed"], record["audit"]["contribution"]["count"]);
    EXPECT_EQ(record["audit"]["color"]["underflowed"], 0);
}

TEST(SweepPoint, MeasuresTheMeanCostUnlessItIsToldNotTo) {
    for (const bool wanted : {true, false}) {
        const SweepFile sweep = parsed(kTiny + (wanted ? "" : "[measure]\nmean_cost = false\n"));
        Evaluator evaluator(sweep, "");
        const Prepared p = evaluator.prepare(expand(sweep, {})[0]);
        EXPECT_EQ(p.failure, "");
        const Json cost = evaluator.measure(p, 1, false)["cost"];
        EXPECT_EQ(cost.contains("mean_bits"), wanted);
        const std::vector<std::string> names = evaluator.wanted();
        EXPECT_EQ(std::find(names.begin(), names.end(), "mean cost") != names.end(), wanted);
        if (!wanted) continue;
        EXPECT_GT(cost["mean_of"]["slabs"], 10);
        EXPECT_GT(cost["mean_bits"], cost["word_bits"]);
        EXPECT_LT(cost["mean_bits"], cost["bits"]);
        double bits = 0;  // of one stage, by its list
        for (const Json& m : cost["stages"]["interpolation"]["multipliers"])
            bits += m["mean"].get<double>() * m["widths"][0].get<double>() * m["widths"][1].get<double>();
        EXPECT_NEAR(bits, cost["stages"]["interpolation"]["mean_multiplier_bits"].get<double>(), 1e-9 * bits);
    }
}

// -------------------------------------------------------------------------------------------- cost

TEST(SweepCost, IsTheSumOfWidthsAndOfProductsOfOperandWidths) {
    const SweepFile sweep = parsed(kTiny + "precision.preset = 'squeeze'\nvolume.bits = 8\n");
    Evaluator evaluator(sweep, "");
    const Prepared p = evaluator.prepare(expand(sweep, {})[0]);
    const Cost cost = cost_of(make_plan(p.scene, p.volume));
    ASSERT_EQ(cost.stages.size(), 4u) << "unlit: no gradient, no shading";
    // Location u11.12, V s1.12, weight u1.12, length u1.15.
    EXPECT_EQ(cost.stages[0].word_bits, 23 + 14 + 13 + 16);
    // Three lerp levels of u12.12; voxels of 8 bits and a sign, then 24 bits and a sign, by a weight of 13.
    EXPECT_EQ(cost.stages[1].word_bits, 3 * 24);
    EXPECT_EQ(cost.stages[1].bill.multiplier_bits(), (4 * 9 + 2 * 25 + 25) * 13);
    EXPECT_EQ(operation_bits(cost.stages[1].bill), cost.stages[1].bill.multiplier_bits()) << "truncated";
    // Equation 9, C and T: alpha c, then T times that, then T (1 - alpha), in words of 16 bits.
    EXPECT_EQ(cost.stages[3].word_bits, 2 * 16);
    EXPECT_EQ(cost.stages[3].bill.multiplier_bits(), 7 * 16 * 16);
    EXPECT_EQ(cost.pixel_bits, 4 * 16);
    EXPECT_EQ(cost.voxel_bytes, 8);
    std::int64_t words = 0, operations = 0;
    for (const StageCost& stage : cost.stages)
        words += stage.word_bits, operations += operation_bits(stage.bill);
    EXPECT_EQ(cost.bits(), words + operations);
}

TEST(SweepCost, CountsEveryWireThatCarriesSomething) {
    for (const std::string settings :
         {"'lights' = []", "'lights' = 'headlight'", "'precision.preset' = 'squeeze'",
          "'precision.preset' = 'eight_bit'", "'classification.method' = 'pi2d'",
          "'classification.method' = 'pips'", "'classification.method' = 'pi1d'"}) {
        const SweepFile sweep = parsed(
            "[base]\nvolume.dims = 12\nimage.width = 8\nimage.height = 8\ncamera.height = 12\n"
            "[measure]\naudit = true\n[[axis]]\nsettings = [{ label = 'x', " +
            settings + " }]\n");
        Evaluator evaluator(sweep, "");
        const Prepared p = evaluator.prepare(expand(sweep, {})[0]);
        const auto used = make_plan(p.scene, p.volume).used_wires;
        const Json record = evaluator.measure(p, 1, false);
        for (const auto& [name, counts] : record["audit"].items()) {
            if (name == "voxels") continue;
            Wire wire{};
            ASSERT_TRUE(find_wire(name, wire));
            EXPECT_NE(std::find(used.begin(), used.end(), wire), used.end()) << name << ", " << settings;
        }
    }
}

// ---------------------------------------------------------------------------------------- pictures

TEST(SweepValues, KeepEveryNthPixelToSixteenBits) {
    Image image{7, 5, {}};
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    for (std::size_t i = 0; i < 35; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            image.channels[c].values[i] = static_cast<float>((i * 1777 + c * 31) % 4001) / 4000;
    const Image kept = read_values(values_file(image, 3));
    ASSERT_EQ(kept.width, 3);  // every third pixel of seven, of five
    ASSERT_EQ(kept.height, 2);
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t y = 0; y < 2; ++y)
            for (std::size_t x = 0; x < 3; ++x)
                EXPECT_NEAR(kept.channels[c].values[y * 3 + x], image.channels[c].values[y * 3 * 7 + x * 3],
                            0.5 / 65535 + 1e-7);  // half a word, and the float's own rounding
    EXPECT_THROW(read_values("squint.values/1 3 2 3\nrubbish"), InputError);
    EXPECT_THROW(read_values(""), InputError);
}

}  // namespace
}  // namespace squint::sweep
