// squint render, as a new user runs it.
#include "core/image.h"
#include "tests/cli/program.h"

#include <gmock/gmock.h>
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <sstream>
#include <thread>

namespace squint {
namespace {

using namespace test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Render : public Program {};

TEST_F(Render, WithoutASceneWritesTheBuiltInOne) {
    const Outcome r = squint("render" + kSmall);
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_EQ(r.out, "");
    EXPECT_THAT(r.err, HasSubstr("squint.exr: 24x16 pixels"));
    EXPECT_THAT(files(), ElementsAre("squint.exr"));
}

TEST_F(Render, WritesExrPreviewAndRecord) {
    const Outcome r = squint("render" + kSmall + "-o a.exr --preview a.png --json a.json --quiet");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_EQ(r.out + r.err, "");
    EXPECT_THAT(files(), ElementsAre("a.exr", "a.json", "a.png"));
    const Image exr = read_image((folder / "a.exr").string()), png = read_image((folder / "a.png").string());
    EXPECT_EQ(exr.width, 24);
    EXPECT_EQ(exr.height, 16);
    EXPECT_EQ(png.width, 24);
    EXPECT_NE(exr.find("A"), nullptr);
    const auto record = nlohmann::json::parse(contents(folder / "a.json"));
    EXPECT_EQ(record["schema"], "squint.render/2");
    EXPECT_EQ(record["scene"]["image.width"], 24);
    EXPECT_EQ(record["scene"]["camera.eye"], nullptr);
    EXPECT_EQ(record["scene"]["sampling.step"], 1.0);
    EXPECT_EQ(record["scene"]["classification.method"], "pips");
    EXPECT_TRUE(record["scene"]["lights"][0]["direction"].is_array());
    EXPECT_EQ(record["pictures"][0]["hash"].get<std::string>().size(), 32u);
}

TEST_F(Render, JsonToStandardOutputIsJsonAlone) {
    const Outcome r = squint("render" + kSmall + "--json - --audit");
    EXPECT_EQ(r.code, 0) << r.err;
    const auto picture = r.json()["pictures"][0];
    for (const char* key : {"hash", "seconds", "samples", "rays", "path", "target", "threads", "memory"})
        EXPECT_TRUE(picture.contains(key)) << key;
    EXPECT_GT(picture["audit"]["sample"]["count"], 0);
    EXPECT_THAT(r.err, HasSubstr("24x16 pixels"));
    EXPECT_THAT(files(), ElementsAre());
}

TEST_F(Render, TwoRunsWriteTheSameBytesWhateverTheThreadsTilesAndPath) {
    EXPECT_EQ(squint("render" + kSmall + "-o a.exr --preview a.png --set output.fixed=true --threads 1").code,
              0);
    fs::create_directory(folder / "other");
    EXPECT_EQ(
        shell("cd other && sleep 1.1 && \"$SQUINT\" render" + kSmall +
              "-o b.exr --preview b.png --set output.fixed=true --threads 7 --tile 5 --path model --no-skip")
            .code,
        0);
    EXPECT_EQ(contents(folder / "a.exr"), contents(folder / "other/b.exr"));
    EXPECT_EQ(contents(folder / "a.png"), contents(folder / "other/b.png"));
}

TEST_F(Render, TheExrHoldsTheResolvedSceneTheFormatsAndTheVersionAndNoFolder) {
    ASSERT_EQ(squint("volume sphere --dims 16 -o ball.nrrd").code, 0);
    const Outcome r = squint(
        "render --size 8x8 --set volume.file=\"$PWD/ball.nrrd\" --set 'precision.sample=u12.3 trn' "
        "--threads 1 -o a.exr -q");
    ASSERT_EQ(r.code, 0) << r.err;
    Attributes attributes;
    read_image((folder / "a.exr").string(), &attributes);
    EXPECT_EQ(attributes["squint.image.width"], "8");
    EXPECT_EQ(attributes["squint.volume.file"], "\"ball.nrrd\"");
    EXPECT_EQ(attributes["squint.wire.sample"], "u12.3 trn sat");
    EXPECT_THAT(attributes["squint.version"], HasSubstr("."));
    EXPECT_EQ(attributes["squint.volume.hash"].size(), 32u);
    for (const auto& [name, value] : attributes) {
        EXPECT_EQ(value.find(folder.string()), std::string::npos) << name;
        EXPECT_EQ(name.find("thread"), std::string::npos) << name;
    }
}

TEST_F(Render, TheValueGivenLastWins) {
    write("s.toml", "[image]\nwidth = 10\n");
    const auto width = [&](const std::string& flags) {
        const Outcome r = squint(
            "render s.toml --set volume.dims=8 --set volume.procedural=phantom "
            "--set transfer_function.preset=phantom --json - -q " +
            flags);
        EXPECT_EQ(r.code, 0) << r.err;
        return r.json()["scene"]["image.width"].get<int>();
    };
    EXPECT_EQ(width("--set image.height=4"), 10);
    EXPECT_EQ(width("--set image.width=11 --size 12x4"), 12);
    EXPECT_EQ(width("--size 12x4 --set image.width=11"), 11);
}

TEST_F(Render, ATurntableNumbersItsPictures) {
    const Outcome r =
        squint("render" + kSmall + "--set camera.turntable=3 -o t.exr --preview p.png --json -");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_THAT(files(), ElementsAre("p.0000.png", "p.0001.png", "p.0002.png", "t.0000.exr", "t.0001.exr",
                                     "t.0002.exr"));
    const auto pictures = r.json()["pictures"];
    ASSERT_EQ(pictures.size(), 3u);
    EXPECT_NE(pictures[0]["hash"], pictures[1]["hash"]);
}

TEST_F(Render, ProvesABoundAndKeepsItBesideThePicture) {
    const std::string unlit = kSmall + "--set lights=[] --set precision.preset=eight_bit ";
    const Outcome r = squint("render" + unlit + "--error --bound -o b.exr --json -");
    ASSERT_EQ(r.code, 0) << r.err;
    const auto picture = r.json()["pictures"][0];
    const double most = picture["bound"]["most_lsb8"];
    EXPECT_GE(most, picture["error"]["against_real"]["all"]["RGB"]["max_error_lsb8"]);
    EXPECT_LT(most, 255);
    double by_stage = 0;
    for (const auto& stage : picture["bound"]["stages_lsb8"]) by_stage += stage.get<double>();
    EXPECT_NEAR(by_stage, most, 1e-9 * most);
    const Image exr = read_image((folder / "b.exr").string());
    double greatest = 0;
    for (const char* name : {"bound.R", "bound.G", "bound.B", "bound.A"}) {
        ASSERT_NE(exr.find(name), nullptr) << name;
        for (const float x : exr.find(name)->values)
            greatest = std::max(greatest, 255 * static_cast<double>(x));
    }
    EXPECT_NEAR(greatest, most, 1e-5 * most);
    const Outcome same = squint("render" + unlit + "-q --json -");
    EXPECT_EQ(same.json()["pictures"][0]["hash"], picture["hash"]) << "bounds are no part of the picture";
    const Outcome text = squint("render" + unlit + "--bound -o b.exr");
    EXPECT_NE(text.err.find("bound, proven: no pixel is more than"), std::string::npos) << text.err;
    expect_refusal(squint("render" + kSmall + "--set classification.as_printed=true --bound -o b.exr"),
                   "--bound");
}

TEST_F(Render, ErrorIsReportedAndAttributedToStages) {
    const Outcome r = squint("render" + kSmall + "--set precision.preset=eight_bit --error --json -");
    ASSERT_EQ(r.code, 0) << r.err;
    const auto error = r.json()["pictures"][0]["error"];
    EXPECT_GT(error["against_real"]["foreground"]["RGB"]["psnr"], 10);
    EXPECT_EQ(error["stages"].size(), 6u);
    // Rounding one stage alone is not the whole: each differs from it, and none is free at eight bits.
    for (const auto& stage : error["stages"])
        EXPECT_NE(stage["against_real"]["all"]["RGB"], error["against_real"]["all"]["RGB"]) << stage["stage"];
    EXPECT_THAT(r.err, HasSubstr("compositing"));
}

TEST_F(Render, RealHasNoRoundingError) {
    const Outcome r = squint("render" + kSmall + "--set precision.preset=real --error --json -");
    ASSERT_EQ(r.code, 0) << r.err;
    const auto rgb = r.json()["pictures"][0]["error"]["against_real"]["foreground"]["RGB"];
    EXPECT_TRUE(rgb["identical"]);
    EXPECT_TRUE(rgb["psnr"].is_null());
}

TEST_F(Render, ReferenceIsMeasuredToo) {
    const Outcome r = squint("render" + kSmall + "--set sampling.step=0.25 --reference --json -");
    ASSERT_EQ(r.code, 0) << r.err;
    const auto error = r.json()["pictures"][0]["error"];
    EXPECT_FALSE(error.contains("against_real"));
    EXPECT_FALSE(error["against_reference"]["all"]["RGB"]["identical"]);
}

TEST_F(Render, AuditPrintsATableOfWires) {
    const Outcome r = squint("render" + kSmall + "--audit -q");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_THAT(r.out, HasSubstr("to zero"));
    EXPECT_THAT(r.out, HasSubstr("saturated"));
    EXPECT_THAT(r.out, HasSubstr("transparency"));
    EXPECT_EQ(r.err, "");
}

TEST_F(Render, TheAuditsTableSaysWhatItsRecordSays) {
    const std::string scene = kSmall + "--set precision.color='u1.8 wrap' --audit -q ";
    std::istringstream table(squint("render" + scene).out);
    const auto record = squint("render" + scene + "--json -").json()["pictures"][0]["audit"];
    std::string line;
    std::getline(table, line);
    std::size_t wires = 0;
    while (std::getline(table, line) && !line.starts_with("idle:")) {
        std::istringstream cells(line);
        std::string wire, format, idle, bits;
        std::int64_t count = 0;
        double least = 0, greatest = 0;
        cells >> wire >> format >> count >> least >> greatest;
        for (std::string word; cells >> word;) idle = std::exchange(bits, word);
        ASSERT_TRUE(record.contains(wire)) << wire;
        const auto& of = record[wire];
        EXPECT_EQ(of["format"], format);
        EXPECT_EQ(of["count"], count) << wire;
        EXPECT_NEAR(of["min"].get<double>(), least, 1e-5 * std::abs(least)) << wire;
        EXPECT_NEAR(of["max"].get<double>(), greatest, 1e-5 * std::abs(greatest)) << wire;
        EXPECT_EQ(idle, std::to_string(of["unused_high_bits"].get<int>()) + "+" +
                            std::to_string(of["zero_low_bits"].get<int>()))
            << wire;
        // A digit for each number of bits that some value needs: the power of ten of how many do.
        const std::vector<std::int64_t> magnitude = of["magnitude_bits"];
        ASSERT_GE(bits.size(), magnitude.size()) << wire;
        for (std::size_t b = 0; b < bits.size(); ++b) {
            const std::int64_t values = b < magnitude.size() ? magnitude[b] : 0;
            EXPECT_EQ(bits[b], values == 0 ? '.' : std::to_string(std::to_string(values).size() - 1)[0])
                << wire << ' ' << b;
        }
        ++wires;
    }
    EXPECT_EQ(wires, record.size());
    EXPECT_GT(wires, 20u);
}

// Along an axis every step is one voxel: along it weights have one value, and the step one bit.
TEST_F(Render, TheAuditCountsBitsThatNoValueNeedsOrSets) {
    const auto audit =
        squint("render" + kSmall +
               "--set camera.azimuth=0 --set camera.elevation=0 --set lights=[] --audit -q --json -")
            .json()["pictures"][0]["audit"];
    EXPECT_EQ(audit["direction"]["zero_low_bits"], 24) << "one voxel a step";
    EXPECT_EQ(audit["direction"]["unused_high_bits"], 0);
    EXPECT_EQ(audit["voxels"]["count"], 16 * 16 * 16);
    EXPECT_EQ(audit["voxels"]["format"], "u12.0");
    EXPECT_EQ(audit["sample"]["inexact"], 0);
}

// Intervals hold for every ray: no value that an audit met lies outside them.
TEST_F(Render, NoWireCarriesWhatIntervalsRuleOut) {
    int proven = 0;
    for (const char* method : {"pc", "pips", "leg", "pi1d", "pi2d"})
        for (const char* rest :
             {"", "--set lights=[]", "--set camera.projection=perspective --set compositing.form=alpha",
              "--set precision.preset=squeeze --set sampling.step=0.6"}) {
            const auto audit = squint("render" + kSmall + "--audit -q --json - " + rest +
                                      " --set classification.method=" + method)
                                   .json()["pictures"][0]["audit"];
            for (const auto& [name, wire] : audit.items()) {
                if (!wire.contains("proven_max")) continue;
                ++proven;
                EXPECT_LE(wire["proven_min"], wire["min"]) << method << ' ' << rest << ' ' << name;
                EXPECT_GE(wire["proven_max"], wire["max"]) << method << ' ' << rest << ' ' << name;
            }
        }
    EXPECT_GT(proven, 250);
}

TEST_F(Render, AProfileIsAPageAndRefusesWhatRoundsNothing) {
    const Outcome r = squint("render" + kSmall + "--set lights=[] --profile wires.html");
    EXPECT_EQ(r.code, 0) << r.err;
    EXPECT_EQ(r.out, "");
    EXPECT_THAT(files(), ElementsAre("wires.html"));
    EXPECT_THAT(contents(folder / "wires.html"), HasSubstr("Profile of built-in scene"));
    expect_refusal(squint("render" + kSmall + "--profile wires.txt"), "the name must end in .html");
    expect_refusal(squint("render" + kSmall + "--set precision.preset=real --profile wires.html"),
                   "which rounds no wire");
}

TEST_F(Render, WhatIsAskedForDecidesWhatIsWritten) {
    const auto written = [&](const std::string& flags) {
        for (const std::string& name : files()) fs::remove(folder / name);
        const Outcome r = squint("render" + kSmall + "-q " + flags);
        EXPECT_EQ(r.code, 0) << flags << r.err;
        return files();
    };
    EXPECT_THAT(written(""), ElementsAre("squint.exr"));
    EXPECT_THAT(written("--preview p.jpg"), ElementsAre("p.jpg"));
    EXPECT_THAT(written("-o p.png"), ElementsAre("p.png"));
    EXPECT_THAT(written("--json r.json"), ElementsAre("r.json"));
    EXPECT_THAT(written("--audit"), ElementsAre());
    EXPECT_THAT(written("--reference-output x.exr"), ElementsAre("squint.exr", "x.exr"));
    expect_refusal(squint("render -o a.png --preview b.png"), "a second preview beside --preview b.png");
}

TEST_F(Render, SaysThePriceOfErrorsAndHowToMakeAFilm) {
    const Outcome lit = squint("render" + kSmall + "--error -o a.exr");
    EXPECT_THAT(lit.err, HasSubstr("measuring the error: 7 more pictures")) << "in double, and six stages";
    const Outcome real = squint("render" + kSmall + "--set precision.preset=real --error -o a.exr");
    EXPECT_THAT(real.err, HasSubstr("measuring the error: 1 more pictures"));
    const Outcome turn = squint("render" + kSmall + "--set camera.turntable=2 -o t.exr");
    EXPECT_THAT(turn.err, HasSubstr("film: ffmpeg -framerate 25 -apply_trc iec61966_2_1 -i 't.%04d.exr'"));
    const Outcome shown = squint("render" + kSmall + "--set camera.turntable=2 --preview t.png");
    EXPECT_THAT(shown.err, HasSubstr("film: ffmpeg -framerate 25 -i 't.%04d.png'"));
}

TEST_F(Render, AuditDoesNotChangeThePicture) {
    const auto hash = [&](const char* flags) {
        return squint("render" + kSmall + "--json - -q " + flags).json()["pictures"][0]["hash"];
    };
    EXPECT_EQ(hash(""), hash("--audit"));
}

TEST_F(Render, ScenesThatHaveLittleToShowWork) {
    for (const char* flags :
         {"--set 'lights=[]'", "--set volume.dims=[16,16,1]", "--set clip.high=[-5,-5,-5]",
          "--set 'transfer_function.points=[[0, 1, 1, 1, 0]]' --set transfer_function.unit_distance=1",
          "--set 'camera.eye=[5, 5, 5]' --set camera.projection=perspective"}) {
        const Outcome r = squint("render" + kSmall + flags + " -o a.exr");
        EXPECT_EQ(r.code, 0) << flags << ": " << r.err;
    }
}

// --------------------------------------------------------------------------------------- bad input

TEST_F(Render, MistakesInAFileAreNamedWithTheirPlace) {
    write("s.toml", "[volume]\nprocedural = \"phantom\"\n[samplig]\nstep = 1\n");
    expect_refusal(squint("render s.toml"),
                   "s.toml:3:2: unknown setting \"samplig\"; did you mean \"sampling\"?");
    EXPECT_THAT(files(), ElementsAre("s.toml"));
}

TEST_F(Render, MistakesOnTheCommandLineAreOneLine) {
    expect_refusal(squint("render --set sampling.stepp=1"), "did you mean \"step\"?");
    expect_refusal(squint("render --set sampling.step"), "sampling.step");
    expect_refusal(squint("render --set sampling.step=-1"), "sampling.step");
    expect_refusal(squint("render --size 12"), "WIDTHxHEIGHT");
    expect_refusal(squint("render --size 0x5"), "image.width");
    expect_refusal(squint("render --frobnicate"), "see squint render --help");
    expect_refusal(squint("render --threads 0"), "--threads");
    expect_refusal(squint("render --path fastest"), "--path");
    expect_refusal(squint("render --max-memory lots"), "500M");
    expect_refusal(squint("render --target SSE9000" + kSmall), "SSE9000");
    expect_refusal(squint("render --audit --set precision.preset=real" + kSmall), "--audit");
    expect_refusal(squint("render nothing.toml"), "nothing.toml");
    expect_refusal(squint("render --set volume.file=nothing.nrrd"), "nothing.nrrd");
    expect_refusal(squint("render --set 'volume.file=${SQUINT_UNSET_VARIABLE}/a.nrrd'"),
                   "SQUINT_UNSET_VARIABLE");
    expect_refusal(squint("render --set precision.sample=u3.8" + kSmall), "sample");
    EXPECT_THAT(files(), ElementsAre());
}

TEST_F(Render, WhatOnlySeveralSettingsShowIsRefusedWhereOneOfThemStands) {
    const std::string volume = "[volume]\nprocedural = 'sphere'\ndims = 16\n",
                      function = "[transfer_function]\nunit_distance = 1\npoints = [[0, 1, 1, 1, 0.5]]\n";
    const auto refusal = [&](const std::string& rest, const std::string& part) {
        write("s.toml", rest);
        expect_refusal(squint("render s.toml --size 8x8"), "squint: s.toml:" + part);
    };
    refusal(volume + function + "[camera]\neye = [1, 2, 3]\ncenter = [1, 2, 3]\n",
            "8:7: camera.eye: eye and center are both");
    refusal(volume + function + "[camera]\neye = [8, 8, -9]\ncenter = [8, 8, 8]\nup = [0, 0, 1]\n",
            "10:6: camera.up: up [0, 0, 1] is parallel");
    refusal(volume + function + "[precision]\nsample = 'u3.8'\n", "8:10: precision.sample: u3.8");
    refusal(volume + function + "[[lights]]\nheadlight = true\n[shading]\nexponent = 3\n",
            "10:12: shading.exponent: 3");
    refusal(volume + "[transfer_function]\nunit_distance = 1\npoints = []\n",
            "6:10: transfer_function.points: found an empty list");
    expect_refusal(squint("render --size 8x8 --set precision.sample=u3.8"), "--set precision.sample: u3.8");
    EXPECT_THAT(files(), ElementsAre("s.toml"));
}

TEST_F(Render, OutputsThatCannotBeAreRefusedBeforeTheWork) {
    const std::string slow = "render --size 4000x4000 --set sampling.step=0.01 ";
    expect_refusal(squint(slow + "-o no/such/a.exr"), "no folder no/such");
    expect_refusal(squint(slow + "-o a.gif"), ".exr");
    expect_refusal(squint(slow + "--preview a.exr"), ".png");
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    if (geteuid() != 0) expect_refusal(squint(slow + "-o locked/a.exr"), "Permission denied");
    fs::permissions(folder / "locked", fs::perms::owner_all);
}

TEST_F(Render, RefusesMoreMemoryThanAllowed) {
    expect_refusal(squint("render --size 8000x8000 --max-memory 100M"),
                   "--max-memory: a picture of 8000x8000 pixels");
    expect_refusal(squint("render --size 8x8 --max-memory 1M"), "phantom");
    EXPECT_EQ(squint("render" + kSmall + "--max-memory 10M").code, 0);
}

TEST_F(Render, AMappedVolumeLargerThanTheMemoryAllowedIsRendered) {
    ASSERT_EQ(shell("yes squint | head -c 16777216 > v.raw").code, 0);  // 256^3
    const std::string render =
        "render --size 24x16 --json - -q --set volume.file=v.raw --set volume.dims=[256,256,256] --set "
        "volume.type=u8 "
        "--set transfer_function.unit_distance=50 --set "
        "'transfer_function.points=[[99, 1, 1, 1, 0], [120, 1, 0.5, 1, 0.9]]' ";
    const auto whole = squint(render).json()["pictures"][0];
    for (const std::string layout : {"linear", "cells"}) {
        const Outcome outcome = squint((render + "--max-memory 8M --layout ").append(layout));
        ASSERT_EQ(outcome.code, 0) << outcome.err;
        const auto picture = outcome.json()["pictures"][0];
        EXPECT_EQ(picture["hash"], whole["hash"]);
        EXPECT_EQ(picture["memory"]["mapped_bytes"], 1 << 24);
        EXPECT_EQ(picture["memory"]["volume_bytes"], 0);
        EXPECT_LE(picture["memory"]["total_bytes"], 8 << 20);
        EXPECT_GT(picture["memory"]["total_bytes"], layout == "cells" ? 4 << 20 : 0)
            << "cells take what there is";
    }
    // Big-endian voxels must be put in order, in memory.
    const std::string swapped =
        " --set volume.dims=[128,256,256] --set volume.type=u16 --set volume.endian=big ";
    expect_refusal(squint(render + swapped + "--max-memory 8M"), "needs 16777216 bytes of memory");
}

TEST_F(Render, AFullDiskLeavesNothing) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root, to mount a small disk";
    const fs::path disk = folder / "disk";
    fs::create_directory(disk);
    if (mount("none", disk.c_str(), "tmpfs", 0, "size=4k") != 0)
        GTEST_SKIP() << "cannot mount a small disk here";
    const std::string large = "render --size 128x128 --set volume.dims=16 --set camera.height=16 ";
    expect_refusal(squint(large + "-o disk/a.exr -q"), "disk/a.exr");
    expect_refusal(squint("volume sphere --dims 32 -o disk/a.nrrd"), "disk/a.nrrd");
    EXPECT_TRUE(fs::is_empty(disk));
    umount(disk.c_str());
}

TEST_F(Render, StandardOutputThatCannotBeWrittenIsAnError) {
    if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    const Outcome r = shell("\"$SQUINT\" plan" + kSmall + ">/dev/full");
    EXPECT_EQ(r.code, 2);
    EXPECT_THAT(r.err, HasSubstr("squint: standard output"));
}

// ------------------------------------------------------------------------------------ interruption

/// Starts `squint ARGUMENTS` in `folder`, waits until it has begun to listen for `signal` (Linux tells), then
/// `delay`, and sends it.  (sh would start a job in the background with SIGINT ignored.)
Outcome interrupt(const fs::path& folder, const std::string& arguments, int signal,
                  std::chrono::milliseconds delay) {
    const std::string line =
        "cd '" + folder.string() + "' && exec '" SQUINT_PROGRAM "' " + arguments + " >.stdout 2>.stderr";
    const pid_t child = fork();
    if (child == 0) {
        std::signal(signal, SIG_DFL);  // a shell's background work ignores SIGINT, and so would this
        execl("/bin/sh", "sh", "-c", line.c_str(), nullptr), _exit(127);
    }
    const auto listens = [&] {
        std::ifstream status("/proc/" + std::to_string(child) + "/status");
        for (std::string word; status >> word;) {
            if (word == "Name:" && status >> word && word != "squint") return false;  // sh listens, too
            if (word == "State:" && status >> word && word == "Z") return true;
            if (word == "SigCgt:" && status >> word)
                return (std::stoull(word, nullptr, 16) >> (signal - 1) & 1) != 0;
        }
        return true;  // it has ended
    };
    while (!listens()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::this_thread::sleep_for(delay);
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
                    contents(folder / ".stdout"), contents(folder / ".stderr")};
    fs::remove(folder / ".stdout"), fs::remove(folder / ".stderr");
    return outcome;
}

TEST_F(Render, CtrlCEndsWith130AndLeavesNothing) {
    for (const int signal : {SIGINT, SIGTERM}) {
        const Outcome r = interrupt(folder,
                                    "render --size 4000x4000 --set sampling.step=0.01 --path model -o a.exr "
                                    "--preview a.png --json a.json",
                                    signal, std::chrono::milliseconds(300));
        EXPECT_EQ(r.code, 130) << r.err;
        EXPECT_EQ(r.err, "squint: interrupted\n");
        EXPECT_THAT(files(), ElementsAre());
    }
}

TEST_F(Render, CtrlCAtAnyMomentLeavesNothingHalfWritten) {
    // From set-up to the last file: what is there is whole.
    for (const int delay : {0, 3, 10, 20, 40, 80, 150, 300}) {
        const Outcome r =
            interrupt(folder, "render --size 300x300 --set volume.dims=16 -q -o a.exr --preview a.png",
                      SIGINT, std::chrono::milliseconds(delay));
        EXPECT_TRUE(r.code == 130 || r.code == 0) << r.code << r.err;
        for (const std::string& name : files()) {
            EXPECT_TRUE(name == "a.exr" || name == "a.png") << name;
            EXPECT_EQ(read_image((folder / name).string()).width, 300);
            fs::remove(folder / name);
        }
    }
}

}  // namespace
}  // namespace squint
