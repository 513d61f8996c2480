// squint report as numbers, and what its page is made of.  (How the page works: tests/report, in a browser.)
#include "program.h"

#include <map>
#include <sstream>

namespace squint::test {
namespace {

using Json = nlohmann::json;

class ReportProgram : public Program {
  protected:
    // 3 points, one of which fails, and a title that asks for quotes.
    void SetUp() override {
        write(
            "s.toml",
            "title = 'Color, \"3\" ways | <b>'\n[base]\nvolume.dims = 12\nimage.width = 12\nimage.height = "
            "8\n"
            "camera.height = 12\n[[axis]]\nkey = 'precision.sample'\nvalues = ['u12.4', 'u1.4', 'u12.5']\n");
        ASSERT_EQ(squint("sweep s.toml -o run -q").code, 3);
    }
    std::vector<Json> records() const {
        std::vector<Json> all;
        const Json sweep = Json::parse(contents(folder / "run/sweep.json"));
        for (const auto& entry : sweep["points"])
            all.push_back(
                Json::parse(contents(folder / "run/points" / (entry["hash"].get<std::string>() + ".json"))));
        return all;
    }
};

TEST_F(ReportProgram, JsonAndTheRecordsOfPointsSayTheSame) {
    const Outcome outcome = squint("report run --format json");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json report = outcome.json();
    EXPECT_EQ(report["schema"], "squint.report/1");
    const std::vector<Json> all = records();
    ASSERT_EQ(report["points"].size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Json& point = report["points"][i];
        EXPECT_EQ(point["hash"], all[i]["hash"]);
        EXPECT_EQ(point["status"], all[i]["status"]);
        if (all[i]["status"] == "failed") {
            EXPECT_EQ(point["reason"], all[i]["reason"]);
            continue;
        }
        EXPECT_EQ(point["picture_hash"], all[i]["picture_hash"]);
        EXPECT_EQ(point["error"]["real"]["color"]["rmse"], all[i]["error"]["real"]["color"]["rmse_lsb8"]);
        EXPECT_EQ(point["cost"]["bits"], all[i]["cost"]["bits"]);
    }
}

// Runs of versions that kept settings as texts of TOML.
TEST_F(ReportProgram, ReadsPointsOfTheFirstSchema) {
    const auto commands = [&] {
        std::vector<std::string> all;
        const Json report = squint("report run --format json").json();
        for (const Json& point : report["points"]) all.push_back(point.value("command", ""));
        return all;
    };
    const std::vector<std::string> typed = commands();
    ASSERT_FALSE(typed.empty());
    for (const auto& entry : fs::directory_iterator(folder / "run/points")) {
        Json record = Json::parse(contents(entry.path()));
        ASSERT_EQ(record["schema"], "squint.point/2");
        Json settings = Json::array();
        for (const auto& [key, value] : record["settings"].items())
            settings.push_back(key + "=" + value.dump());
        record["schema"] = "squint.point/1", record["settings"] = settings;
        std::ofstream(entry.path()) << record.dump();
    }
    const std::vector<std::string> texts = commands();
    ASSERT_EQ(texts.size(), typed.size());
    for (std::size_t i = 0; i < texts.size(); ++i) {
        EXPECT_EQ(texts[i].size(), typed[i].size()) << "the same settings, in the order of the JSON";
        EXPECT_NE(texts[i].find("--set"), std::string::npos);
    }
}

// What the first line says is what the records hold.
TEST_F(ReportProgram, TheFirstLineIsTheCheapestPointUnderTheBound) {
    const std::vector<Json> all = records();
    const auto error = [](const Json& r) { return r["error"]["real"]["color"]["rmse_lsb8"].get<double>(); };
    const auto bits = [](const Json& r) { return r["cost"]["bits"].get<double>(); };
    double least_error = 1e9, most_error = 0, most_bits = 0;
    for (const Json& r : all)
        if (r["status"] == "done")
            least_error = std::min(least_error, error(r)), most_error = std::max(most_error, error(r)),
            most_bits = std::max(most_bits, bits(r));
    ASSERT_LT(least_error, most_error);
    for (const double bound : {most_error * 2, (least_error + most_error) / 2}) {
        const Json report = squint("report run --format json --max-error " + std::to_string(bound)).json();
        const Json& answer = report["answer"];
        const Json* cheapest = nullptr;
        for (const Json& r : all)
            if (r["status"] == "done" && error(r) <= bound && (!cheapest || bits(r) < bits(*cheapest)))
                cheapest = &r;
        ASSERT_NE(cheapest, nullptr);
        EXPECT_EQ(report["points"][answer["point"].get<std::size_t>()]["hash"], (*cheapest)["hash"]);
        EXPECT_EQ(answer["bits"], bits(*cheapest));
        EXPECT_EQ(answer["error"], error(*cheapest));
        EXPECT_EQ(answer["than_bits"], most_bits);
        EXPECT_DOUBLE_EQ(answer["saving_percent"].get<double>(), 100 * (1 - bits(*cheapest) / most_bits));
        EXPECT_EQ(answer["good"], true);
        const std::string text = answer["text"];
        EXPECT_NE(text.find(std::to_string((*cheapest)["cost"]["bits"].get<int>()) + " bits at "),
                  std::string::npos)
            << text;
        EXPECT_NE(text.find("Not measured: time"), std::string::npos) << text;
        const std::string page =
            squint("report run --format markdown --max-error " + std::to_string(bound)).out;
        EXPECT_NE(page.find("**" + text + "**"), std::string::npos);
    }
    const Json none =
        squint("report run --format json --max-error " + std::to_string(least_error / 2)).json()["answer"];
    EXPECT_EQ(none["good"], false);
    EXPECT_TRUE(none["point"].is_null());
    EXPECT_EQ(none["text"].get<std::string>().find("No point is within"), 0u) << none["text"];
}

// Wires one at a time: the base point is audited, what costs most is what the records say it costs, and one more point
// has all first formats at once.
TEST_F(ReportProgram, WiresOneAtATimeEndWithAllFirstFormatsAtOnce) {
    write("w.toml",
          "[base]\nvolume.dims = 16\nimage.width = 16\nimage.height = 16\nprecision.preset = 'squeeze'\n"
          "[wires]\nnames = ['color', 'weight', 'transparency']\nfraction_bits = [4, 8, 10, 13]\n");
    ASSERT_EQ(squint("sweep w.toml -o wires -q").code, 0);
    const Json report = squint("report wires --format json").json();
    std::map<std::string, Json> by_hash;
    for (const auto& entry : fs::directory_iterator(folder / "wires/points")) {
        const Json record = Json::parse(contents(entry.path()));
        by_hash[record["hash"]] = record;
    }
    const auto record_of = [&](const Json& entry) {
        return by_hash.at(report["points"][entry["point"].get<std::size_t>()]["hash"]);
    };
    const auto error = [](const Json& r) { return r["error"]["real"]["color"]["rmse_lsb8"].get<double>(); };
    const auto fraction_bits = [](const Json& r, const std::string& wire) {
        const std::string spec = r["wires"][wire];
        return std::stoi(spec.substr(spec.find('.') + 1));
    };
    const Json base = record_of(report["entries"][0]);
    Json together;
    std::map<std::string, std::map<int, Json>> series;  // wire -> fraction bits -> record
    for (const Json& entry : report["entries"]) {
        const Json record = record_of(entry);
        const std::string varied = entry.value("varied", "");
        EXPECT_EQ(record.contains("audit"), record["hash"] == base["hash"]) << varied;
        if (varied == "together") together = record;
        for (const char* wire : {"color", "weight", "transparency"})
            if (varied.empty() || varied == std::string(wire) + " fraction_bits")
                series[wire][fraction_bits(record, wire)] = record;
    }
    ASSERT_FALSE(together.is_null());
    std::string dearest;
    double most = 0, dearest_bit = 0;
    const Json& answer = report["answer"];
    const Json chosen = by_hash.at(report["points"][answer["point"].get<std::size_t>()]["hash"]);
    for (const auto& [wire, records] : series) {
        ASSERT_EQ(records.size(), 5u) << wire;
        int first = fraction_bits(base, wire);
        for (auto r = records.rbegin(); r != records.rend() && error(r->second) <= 0.5; ++r) first = r->first;
        EXPECT_EQ(fraction_bits(together, wire), first) << wire;
        const Json &least = records.begin()->second, &greatest = records.rbegin()->second;
        const double a_bit = (greatest["cost"]["bits"].get<double>() - least["cost"]["bits"].get<double>()) /
                             (records.rbegin()->first - records.begin()->first);
        // Each of these has one integer bit and no sign.
        const double all = a_bit * (1 + fraction_bits(chosen, wire));
        if (all > most) most = all, dearest = wire, dearest_bit = a_bit;
    }
    EXPECT_EQ(answer["wire"], dearest);
    EXPECT_DOUBLE_EQ(answer["bits_a_bit"].get<double>(), dearest_bit);
    EXPECT_EQ(answer["format"], chosen["wires"][dearest]);
    EXPECT_NE(answer["text"].get<std::string>().find("the wire that costs most is " + dearest + " ("),
              std::string::npos)
        << answer["text"];
    EXPECT_NE(answer["text"].get<std::string>().find("other views"), std::string::npos) << answer["text"];
    const Outcome again = squint("sweep w.toml -o wires");
    EXPECT_NE(again.err.find("0 computed"), std::string::npos) << again.err;
    EXPECT_EQ(squint("report wires --format json").json()["entries"], report["entries"]);
}

// Rounding alone says nothing of a method: where more than formats varies, the exact integral leads.
TEST_F(ReportProgram, MethodsAreJudgedByTheExactIntegral) {
    write("m.toml",
          "[base]\nvolume.dims = 12\nimage.width = 8\nimage.height = 8\nlights = []\n"
          "[measure]\nreference = true\n[[axis]]\nkey = 'classification.method'\nvalues = ['pc', 'pips']\n");
    ASSERT_EQ(squint("sweep m.toml -o methods -q").code, 0);
    const Json methods = squint("report methods --format json").json();
    EXPECT_EQ(methods["against"], Json({"reference", "real"}));
    EXPECT_EQ(methods["answer"]["against"], "reference");
    write("f.toml",
          "[base]\nvolume.dims = 12\nimage.width = 8\nimage.height = 8\nlights = []\n"
          "[measure]\nreference = true\n[[axis]]\nwires = ['color']\nfraction_bits = [8, 12]\n");
    ASSERT_EQ(squint("sweep f.toml -o formats -q").code, 0);
    EXPECT_EQ(squint("report formats --format json").json()["against"], Json({"real", "reference"}));
}

TEST_F(ReportProgram, CommandsOfPointsRenderTheirPicturesAgain) {
    const Json report = squint("report run --format json").json();
    for (const Json& point : report["points"]) {
        if (point["status"] != "done") continue;
        const std::string command = point["command"];
        ASSERT_TRUE(command.starts_with("squint render ")) << command;
        const Outcome again = shell("\"$SQUINT\"" + command.substr(6) + " --json - -q");
        ASSERT_EQ(again.code, 0) << again.err;
        EXPECT_EQ(again.json()["pictures"][0]["hash"], point["picture_hash"]) << command;
    }
}

TEST_F(ReportProgram, CsvHasALineAPointAndQuotesWhatHasCommas) {
    const Outcome outcome = squint("report run --format csv");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::istringstream lines(outcome.out);
    std::vector<std::string> all;
    for (std::string line; std::getline(lines, line);) all.push_back(line);
    ASSERT_EQ(all.size(), 4u);
    EXPECT_TRUE(all[0].starts_with("precision.sample,status,real color max,")) << all[0];
    EXPECT_TRUE(all[1].starts_with("u12.4,done,")) << all[1];
    EXPECT_TRUE(all[2].starts_with("u1.4,failed,")) << all[2];
    for (const std::string& line : all) {  // the same number of fields in each, commas in quotes aside
        bool quoted = false;
        std::ptrdiff_t fields = 1;
        for (const char c : line) quoted ^= c == '"', fields += c == ',' && !quoted;
        EXPECT_EQ(fields, std::count(all[0].begin(), all[0].end(), ',') + 1) << line;
    }
}

TEST_F(ReportProgram, MarkdownIsATableAndSaysWhatWasNotMeasured) {
    const Outcome outcome = squint("report run --format markdown");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const char* part :
         {"# Color, \"3\" ways | <b>\n", "| precision.sample | status |", "| u12.5 | done |",
          "- Time: this sweep is not timed", "- 1 points failed", "squint sweep s.toml"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << "\n" << outcome.out;
}

TEST_F(ReportProgram, ThePageIsOneFileThatAsksForNoOther) {
    const Outcome outcome = squint("report run -o page.html");
    if (outcome.code == 2 && outcome.err.find("no page") != std::string::npos) GTEST_SKIP() << outcome.err;
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::string page = contents(folder / "page.html");
    EXPECT_NE(page.find("<title>Color, &quot;3&quot; ways | &lt;b&gt;</title>"), std::string::npos);
    EXPECT_NE(page.find("content=\"default-src 'none'; script-src 'sha256-"), std::string::npos);
    for (const char* never :
         {"unsafe", "<link", "<iframe", "<img", " src=\"", "@DATA@", "@PICTURES@", "@TITLE@"}) {
        const std::size_t at = page.find(never);
        // The libraries' own code may speak of such things; what is ours lies before and after it.
        const std::size_t library = page.find("<script>"), ours = page.rfind("<script>");
        EXPECT_TRUE(at == std::string::npos || (at > library && at < ours)) << never << " at " << at;
    }
}

TEST_F(ReportProgram, RefusesAFolderThatIsNoRun) {
    fs::create_directory(folder / "empty");
    expect_refusal(squint("report empty --format csv"), "sweep.json");
    expect_refusal(squint("report nowhere"), "nowhere");
}

}  // namespace
}  // namespace squint::test
