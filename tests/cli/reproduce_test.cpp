// squint reproduce: what is listed, what is written, what is kept, what is missing; and at a small size every number.
#include "program.h"

#include <gmock/gmock.h>

#include <cmath>

namespace squint::test {
namespace {

using testing::HasSubstr;

const fs::path kSource = SQUINT_SOURCE_DIR;

class Reproduce : public Program {
  protected:
    /// Without data, whatever the environment says.
    Outcome without_data(const std::string& arguments) const {
        return shell("unset SQUINT_DATA; \"$SQUINT\" reproduce " + arguments);
    }
};

TEST_F(Reproduce, ListsEveryPaperWithItsFiguresAndTimes) {
    const Outcome r = squint("reproduce");
    EXPECT_EQ(r.code, 0) << r.err;
    for (const char* part : {"squeeze:", "lee_shin:", "guetat:", "figure_5", "teaser", "timed, "})
        EXPECT_THAT(r.out, HasSubstr(part));
    EXPECT_TRUE(files().empty());
}

TEST_F(Reproduce, AFigureBecomesPicturesAndATableAndIsKept) {
    const Outcome first = without_data("lee_shin figure_5 --size 16x16 -o out");
    EXPECT_EQ(first.code, 0) << first.err;
    EXPECT_THAT(first.out, HasSubstr("PIPS(1) against PI2D"));
    EXPECT_THAT(first.out, HasSubstr("41.90 44.53 45.42"));
    const fs::path made = folder / "out/lee_shin/figure_5";
    for (const char* file :
         {"a_pc.exr", "a_pc.png", "e_pips3.png", "results.json", "results.md", "results.csv"})
        EXPECT_TRUE(fs::exists(made / file)) << file;
    const auto record = nlohmann::json::parse(contents(made / "results.json"));
    EXPECT_EQ(record["schema"], "squint.reproduce/1");
    EXPECT_EQ(record["rows"][0]["ours"].size(), 3u);
    EXPECT_THAT(first.err, HasSubstr("6 made, 0 there already"));

    const auto time = fs::last_write_time(made / "a_pc.exr");
    const Outcome again = without_data("lee_shin figure_5 --size 16x16 -o out");
    EXPECT_THAT(again.err, HasSubstr("0 made, 6 there already"));
    EXPECT_EQ(again.out, first.out);
    EXPECT_EQ(fs::last_write_time(made / "a_pc.exr"), time);
    fs::remove(made / "b_pi1d.exr");
    EXPECT_THAT(without_data("lee_shin figure_5 --size 16x16 -o out").err,
                HasSubstr("1 made, 5 there already"));
    EXPECT_THAT(without_data("lee_shin figure_5 --size 17x16 -o out").err, HasSubstr("6 made"));
}

TEST_F(Reproduce, SaysWhatDataIsMissingAndWhatStandsIn) {
    const Outcome r = without_data("guetat figure_5 --size 8x8 -o out");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_THAT(r.out,
                HasSubstr("cthead_256x256x113_u16.nrrd is missing: neither --data nor SQUINT_DATA names its "
                          "folder; the built-in head stands in for it"));
    const Outcome empty = without_data("guetat figure_5 --size 8x8 -o out --data .");
    EXPECT_THAT(empty.out, HasSubstr("cthead_256x256x113_u16.nrrd is missing in .; the built-in head"));
}

TEST_F(Reproduce, ARuleThatThisProgramLacksIsSaidAndNotFaked) {
    const Outcome r =
        without_data("lee_shin figure_5 --size 8x8 -o out --set shading.inside=nothing_of_the_kind");
    EXPECT_EQ(r.code, 3);
    EXPECT_THAT(r.out, HasSubstr("not measured: "));
    EXPECT_THAT(r.out, HasSubstr("nothing_of_the_kind"));
}

TEST_F(Reproduce, RefusesWhatThereIsNot) {
    expect_refusal(squint("reproduce nobody"), "allowed: all, guetat, lee_shin or squeeze");
    expect_refusal(squint("reproduce squeeze figure_99"), "squeeze has no \"figure_99\"");
    expect_refusal(squint("reproduce all figure_1"), "allowed: PAPER FIGURE, or all");
}

TEST_F(Reproduce, TimedTablesAreLeftOutUntilAskedFor) {
    const Outcome r = without_data("lee_shin table_1 -o out");
    EXPECT_EQ(r.code, 0) << r.err;
    const Outcome timed = without_data(
        "lee_shin table_4 -o out --size 8x8 --set camera.turntable=1 --set classification.table_size=64");
    EXPECT_EQ(timed.code, 0) << timed.err;
    EXPECT_THAT(timed.err, HasSubstr("lee_shin table_4: about 25 min 0 s on two cores"));
    EXPECT_THAT(timed.err, HasSubstr("20 made"));
}

// tests/cli/reproduced.json: paper -> figure -> row -> numbers at 24x24.  `squint reproduce PAPER --size 24x24 --json`
// makes it anew.
TEST_F(Reproduce, NumbersAtASmallSizeAreTheseToTheDigit) {
    const char* given = std::getenv("SQUINT_DATA");
    const fs::path data = given ? fs::path(given) : kSource / "../shared/data";
    if (!fs::exists(data / "cthead_256x256x113_u16.nrrd")) GTEST_SKIP() << data << " has no volumes";
    const auto expected = nlohmann::json::parse(contents(kSource / "tests/cli/reproduced.json"));
    for (const auto& [paper, figures] : expected.items())
        for (const auto& [figure, rows] : figures.items()) {
            const Outcome r =
                squint("reproduce " + paper + " " + figure + " --size 24x24 --json -q -o out --data '" +
                       fs::absolute(data).string() + "'");
            ASSERT_TRUE(r.code == 0 || r.code == 3) << r.err;
            std::map<std::string, nlohmann::json> ours;
            const nlohmann::json record = r.json();
            for (const auto& row : record[0]["rows"]) ours[row["what"]] = row["ours"];
            for (const auto& [what, numbers] : rows.items()) {
                ASSERT_EQ(ours[what].size(), numbers.size()) << figure << ' ' << what;
                for (std::size_t i = 0; i < numbers.size(); ++i)
                    if (numbers[i].is_null())
                        EXPECT_TRUE(ours[what][i].is_null()) << figure << ' ' << what;
                    else
                        EXPECT_NEAR(ours[what][i].get<double>(), numbers[i].get<double>(),
                                    1e-3 * std::abs(numbers[i].get<double>()) + 1e-3)
                            << paper << ' ' << figure << ' ' << what;
            }
        }
}

// A page a paper names every figure that is made, as `figure_5`.
TEST_F(Reproduce, PagesNameEveryFigure) {
    const std::map<std::string, std::string> pages{
        {"squeeze", "squeeze.md"}, {"lee_shin", "lee-shin.md"}, {"guetat", "guetat.md"}};
    const nlohmann::json list = squint("reproduce --json").json();
    for (const auto& paper : list["papers"]) {
        const std::string page = contents(kSource / "docs/papers" / pages.at(paper["paper"]));
        for (const auto& figure : paper["figures"])
            EXPECT_THAT(page, HasSubstr("`" + figure["figure"].get<std::string>() + "`"));
    }
}

}  // namespace
}  // namespace squint::test
