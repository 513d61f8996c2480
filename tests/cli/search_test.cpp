// squint search as a user runs it.
#include "program.h"

namespace squint::test {
namespace {

using Json = nlohmann::json;

const std::string kScene =
    "lights = []\n[volume]\ndims = 12\n[camera]\nheight = 12\n[image]\nwidth = 12\nheight = 8\n"
    "[transfer_function]\npreset = 'phantom'\n";
const std::string kQuick = " --views 1 --restarts 1 --wires color,transparency,contribution,sample ";

class SearchProgram : public Program {
  protected:
    void SetUp() override { write("s.toml", kScene); }
};

TEST_F(SearchProgram, WritesFormatsThatRenderToThePictureItJudged) {
    const Outcome found = squint("search s.toml --max-error 1 -o run --json" + kQuick);
    ASSERT_EQ(found.code, 0) << found.err;
    EXPECT_EQ(found.err, "") << "progress is for a terminal";
    const Json json = found.json();
    EXPECT_EQ(json["schema"], "squint.search/1");
    EXPECT_LE(json["found"]["error_lsb8"], 1.0);
    EXPECT_LT(json["found"]["bits"], json["squeeze"]["bits"]);

    std::string hash;
    const Json sweep = Json::parse(contents(folder / "run/sweep.json"));
    for (const auto& point : sweep["points"])
        if (point["values"]["phase"] == "found") hash = point["hash"];
    const Json record = Json::parse(contents(folder / "run/points" / (hash + ".json")));
    const Outcome again = squint("render s.toml --set precision.preset=run/formats.toml -q --json -");
    ASSERT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(again.json()["pictures"][0]["hash"], record["picture_hash"]);
    EXPECT_LE(record["error"]["real"]["color"]["max_error_lsb8"], 1.0);
}

TEST_F(SearchProgram, SaysWhatItFoundAndIsAReport) {
    const Outcome found = squint("search s.toml --max-error 2 -o run" + kQuick);
    ASSERT_EQ(found.code, 0) << found.err;
    for (const char* part : {"found", "as the scene says", "Squeeze's table", "held out: 16 more",
                             "guarantee: views; none of 16", "Squeeze's table in bits",
                             "run/formats.toml: squint render s.toml"})
        EXPECT_NE(found.out.find(part), std::string::npos) << part << " in\n" << found.out;
    const Outcome report = squint("report run --format csv");
    EXPECT_EQ(report.code, 0) << report.err;
    EXPECT_NE(report.out.find("max-1"), std::string::npos);
}

TEST_F(SearchProgram, SearchesSeveralScenesAtOnce) {
    write("t.toml", kScene + "[sampling]\nstep = 0.5\n");
    const Outcome found = squint("search s.toml t.toml --max-error 1 -o run --json" + kQuick);
    ASSERT_EQ(found.code, 0) << found.err;
    for (const char* scene : {"s.toml", "t.toml"}) {
        const Outcome picture = squint(std::string("render ") + scene +
                                       " --set precision.preset=run/formats.toml --error -q --json -");
        ASSERT_EQ(picture.code, 0) << picture.err;
        for (const char* channel : {"R", "G", "B", "A"})
            EXPECT_LE(
                picture.json()["pictures"][0]["error"]["against_real"]["all"][channel]["max_error_lsb8"], 1.0)
                << scene;
    }
}

TEST_F(SearchProgram, CountsBytesOfTablesAndTime) {
    for (const std::string cost : {"table-bytes", "time"}) {
        const Outcome found =
            squint("search s.toml --max-error 4 --cost " + cost + " -o " + cost + " --json" + kQuick);
        ASSERT_EQ(found.code, 0) << found.err;
        EXPECT_EQ(found.json()["cost"], cost);
        EXPECT_LE(found.json()["found"]["error_lsb8"], 4.0);
        EXPECT_LE(found.json()["found"]["table_bytes"], found.json()["scene"]["table_bytes"]);
        EXPECT_EQ(found.json()["found"].contains("ms"), cost == "time");
    }
}

TEST_F(SearchProgram, SaysThatASceneSetsAWireItself) {
    write("own.toml", kScene + "[precision]\ncolor = 'u1.15'\n");
    const Outcome found = squint("search own.toml --max-error 4 -o run" + kQuick);
    ASSERT_EQ(found.code, 0) << found.err;
    EXPECT_NE(found.err.find("own.toml sets precision.color itself"), std::string::npos) << found.err;
}

TEST_F(SearchProgram, EndsWithOneAndNoFileWhereNoFormatsKeepTheBound) {
    ASSERT_EQ(squint("search s.toml --max-error 4 -q -o run" + kQuick).code, 0);
    ASSERT_TRUE(std::filesystem::exists(folder / "run/formats.toml"));
    const Outcome found = squint("search s.toml --max-error 1e-9 -o run" + kQuick);
    EXPECT_EQ(found.code, 1);
    EXPECT_NE(found.err.find("--max-error: found 1e-09, but with every wire at its widest"),
              std::string::npos)
        << found.err;
    EXPECT_EQ(found.out, "");
    for (const char* file : {"run/formats.toml", "run/search.json"})
        EXPECT_FALSE(std::filesystem::exists(folder / file)) << file << " of the search before";
    EXPECT_TRUE(std::filesystem::exists(folder / "run/sweep.json")) << "the trail stays";
}

TEST_F(SearchProgram, RefusesWhatItCannotReadInOneLine) {
    expect_refusal(squint("search s.toml"), "--max-error");
    expect_refusal(squint("search s.toml --max-error 0"), "--max-error");
    expect_refusal(squint("search s.toml --max-error one"), "--max-error");
    expect_refusal(squint("search s.toml --max-error 1 --cost area"), "--cost");
    expect_refusal(squint("search s.toml --max-error 1 --wires colour"), "--wires: found \"colour\"");
    expect_refusal(squint("search s.toml --max-error 1 --views 0"), "--views");
    expect_refusal(squint("search s.toml --max-error 1 --guarantee hope"), "--guarantee");
    expect_refusal(squint("search nothing.toml --max-error 1"), "nothing.toml");
    expect_refusal(squint("search s.toml --max-error 1 --set sampling.stepp=1"), "did you mean");
    write("r.toml", kScene + "[precision]\npreset = 'real'\n");
    expect_refusal(squint("search r.toml --max-error 1"), "real has no formats");
    expect_refusal(squint("search s.toml r.toml --max-error 1"), "r.toml");
}

TEST_F(SearchProgram, ShowsAnExampleInItsHelp) {
    const Outcome help = squint("search --help");
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find("squint search head.toml --size 128x128 --max-error 1"), std::string::npos);
}

}  // namespace
}  // namespace squint::test
