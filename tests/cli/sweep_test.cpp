// squint sweep as a user runs it: resumed, in pieces, killed.
#include "program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <map>
#include <random>
#include <sstream>

namespace squint::test {
namespace {

const std::string kBase =
    "[base]\nvolume.dims = 12\nimage.width = 12\nimage.height = 8\ncamera.height = 12\n";

using Json = nlohmann::json;

class SweepProgram : public Program {
  protected:
    // Point files by name, and what each says of its picture.
    std::map<std::string, std::string> points(const std::string& run) const {
        std::map<std::string, std::string> found;
        for (const auto& entry : fs::directory_iterator(folder / run / "points")) {
            const std::string name = entry.path().filename();
            if (name.size() == 32 + 5 && name.ends_with(".json"))
                found[entry.path().stem()] =
                    Json::parse(contents(entry.path())).value("picture_hash", "failed");
        }
        return found;
    }
    Json record(const std::string& run, const std::string& hash) const {
        return Json::parse(contents(folder / run / "points" / (hash + ".json")));
    }
};

TEST_F(SweepProgram, WritesEveryPointOnceAndComputesNothingTwice) {
    write("s.toml", kBase + "[[axis]]\nwires = ['color', 'transparency']\nfraction_bits = [8, 10, 12, 15]\n");
    const Outcome first = squint("sweep s.toml -o run");
    ASSERT_EQ(first.code, 0) << first.err;
    EXPECT_NE(first.err.find("4 points, 4 of them different: 4 computed"), std::string::npos) << first.err;
    const auto before = points("run");
    EXPECT_EQ(before.size(), 4u);
    const Outcome second = squint("sweep s.toml -o run");
    EXPECT_NE(second.err.find("0 computed, 4 there already"), std::string::npos) << second.err;
    EXPECT_EQ(points("run"), before);
    for (const auto& [hash, picture] : before) {
        EXPECT_TRUE(has("run/pictures/" + hash + ".png"));
        EXPECT_TRUE(record("run", hash)["error"]["real"]["color"]["rmse_lsb8"].is_number());
    }
}

TEST_F(SweepProgram, PrintsARecordALineAndRendersAgainToTheSameHash) {
    write("s.toml", kBase +
                        "[[axis]]\nkey = 'sampling.step'\nvalues = [1, 0.5]\n[[axis]]\nwires = ['sample']\n"
                        "fraction_bits = [0, 6]\n");
    const Outcome outcome = squint("sweep s.toml -o run --json-lines -q");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::istringstream lines(outcome.out);
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) {
        const Json record = Json::parse(line);
        std::string command = "render --json - -q";
        for (const auto& [key, value] : record["settings"].items())
            command += " --set '" + key + "=" + value.dump() + "'";
        const Outcome again = squint(command);
        ASSERT_EQ(again.code, 0) << again.err;
        EXPECT_EQ(again.json()["pictures"][0]["hash"], record["picture_hash"]) << command;
    }
    EXPECT_EQ(count, 4);
}

TEST_F(SweepProgram, GoesOnPastAPointThatFailsAndSaysSo) {
    write("s.toml", kBase + "[[axis]]\nkey = 'precision.sample'\nvalues = ['u12.4', 'u1.4', 'u12.5']\n");
    const Outcome outcome = squint("sweep s.toml -o run");
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_EQ(points("run").size(), 3u);
    int failed = 0;
    for (const auto& [hash, picture] : points("run")) {
        const Json r = record("run", hash);
        if (r["status"] != "failed") continue;
        ++failed;
        EXPECT_NE(r["reason"].get<std::string>().find("precision.sample"), std::string::npos);
    }
    EXPECT_EQ(failed, 1);
    EXPECT_NE(squint("sweep s.toml -o run").err.find("1 computed, 2 there already, 1 failed"),
              std::string::npos)
        << "what failed is tried again";
}

TEST_F(SweepProgram, JoinsItsShardsToTheWhole) {
    write("s.toml", kBase + "[[axis]]\nwires = ['color']\nfraction_bits = { from = 6, to = 15 }\n");
    ASSERT_EQ(squint("sweep s.toml -o whole").code, 0);
    for (const char* shard : {"1/3", "2/3"})
        ASSERT_EQ(squint(std::string("sweep s.toml -o piece") + shard[0] + " --shard " + shard).code, 0);
    const Outcome partly = squint("sweep --collect piece1 piece2 -o joint");
    EXPECT_EQ(partly.code, 3) << "a third is missing";
    EXPECT_NE(partly.err.find("3 missing"), std::string::npos) << partly.err;
    ASSERT_EQ(squint("sweep s.toml -o piece3 --shard 3/3").code, 0);
    EXPECT_EQ(squint("sweep --collect piece1 piece2 piece3 -o joint").code, 0);
    EXPECT_EQ(points("joint"), points("whole"));
    write("other.toml", kBase + "[[axis]]\nwires = ['color']\nfraction_bits = [7]\n");
    ASSERT_EQ(squint("sweep other.toml -o other").code, 0);
    expect_refusal(squint("sweep --collect other -o joint"), "belongs to another sweep");
}

TEST_F(SweepProgram, SaysWhatItWouldDoAndWritesNothing) {
    write("s.toml", kBase + "[[axis]]\nkey = 'sampling.step'\nvalues = [1, 2, 1]\n");
    const Outcome outcome = squint("sweep s.toml -o run --dry-run");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(outcome.out.starts_with("3 points, 2 of them different, 2 to compute; about "))
        << outcome.out;
    EXPECT_NE(outcome.out.find("sampling.step = 2"), std::string::npos);
    EXPECT_FALSE(has("run"));
}

// The example of `sweep --help` is a sweep file.
TEST_F(SweepProgram, HelpHasASweepFileThatRuns) {
    const std::string help = squint("sweep --help").out, begin = "  scene = \"head.toml\"";
    const std::size_t from = help.find("  [base]"), end = help.find("\n\n", from);
    ASSERT_NE(help.find(begin), std::string::npos);
    ASSERT_NE(from, std::string::npos);
    write("s.toml", help.substr(from, end - from) + "\n");
    const Outcome outcome = squint("sweep s.toml --dry-run --set image.width=8 --set image.height=8");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(outcome.out.starts_with("16 points, ")) << outcome.out;
}

TEST_F(SweepProgram, ComputesAgainWhatLacksAMeasurement) {
    const std::string sweep = kBase + "[[axis]]\nwires = ['color']\nfraction_bits = [8, 9]\n";
    write("s.toml", sweep);
    ASSERT_EQ(squint("sweep s.toml -o run").code, 0);
    write("s.toml", sweep + "[measure]\nrepeats = 3\n");
    EXPECT_NE(squint("sweep s.toml -o run").err.find("2 computed"), std::string::npos);
    for (const auto& [hash, picture] : points("run")) {
        const Json time = record("run", hash)["time"];
        EXPECT_EQ(time["all_ms"].size(), 3u);
        EXPECT_GT(time["ms"], 0);
    }
    write("s.toml", sweep);
    EXPECT_NE(squint("sweep s.toml -o run").err.find("2 there already"), std::string::npos)
        << "a record with more is as good";
}

TEST_F(SweepProgram, RefusesWhatItCannotReadInOneLine) {
    expect_refusal(squint("sweep nothing.toml"), "nothing.toml");
    write("s.toml", "[[axis]]\nkey = 'sampling.stepp'\nvalues = [1]\n");
    expect_refusal(squint("sweep s.toml"), "s.toml:2:1: unknown setting");
    write("s.toml", kBase);
    expect_refusal(squint("sweep s.toml --shard 4/3"), "--shard");
}

TEST_F(SweepProgram, RunsAsShardsUnderGnuParallelAndAsSlurmTasksWould) {
    const std::string tools = std::string(SQUINT_SOURCE_DIR) + "/tools/sweeps/";
    write("s.toml", kBase + "[[axis]]\nwires = ['color']\nfraction_bits = { from = 6, to = 15 }\n");
    ASSERT_EQ(squint("sweep s.toml -o whole -q").code, 0);
    for (const char* task : {"1", "2", "3"}) {
        const Outcome outcome =
            shell(std::string("export SQUINT; SWEEP=s.toml RUN=slurm SHARDS=3 SLURM_ARRAY_TASK_ID=") + task +
                  " bash '" + tools + "slurm'");
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
    ASSERT_EQ(squint("sweep --collect slurm.1 slurm.2 slurm.3 -o slurm").code, 0);
    EXPECT_EQ(points("slurm"), points("whole"));
    if (shell("command -v parallel").code != 0) GTEST_SKIP() << "GNU parallel is not installed";
    const Outcome outcome = shell("export SQUINT; '" + tools + "gnu-parallel' s.toml run 3");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(points("run"), points("whole"));
}

// Those of real volumes only where the volumes are.
TEST_F(SweepProgram, ReadsEveryShippedSweepAndItsScenes) {
    const fs::path source = SQUINT_SOURCE_DIR;
    const char* given = std::getenv("SQUINT_DATA");
    const fs::path data = given ? fs::path(given) : source / "../shared/data";
    const bool has_data = fs::exists(data / "cthead_256x256x113_u16.nrrd");
    int read = 0;
    for (const auto& entry : fs::directory_iterator(source / "configs/sweeps")) {
        if (entry.path().extension() != ".toml") continue;
        ++read;
        const std::string text = contents(entry.path()), name = entry.path().filename();
        EXPECT_TRUE(text.starts_with("# ")) << name;
        EXPECT_NE(text.find("\n#   squint sweep configs/sweeps/" + name + " "), std::string::npos)
            << name << " does not say its command";
        EXPECT_NE(text.find("What to look for:"), std::string::npos) << name;
        if (text.find("../bench/") != std::string::npos && !has_data) continue;
        const Outcome outcome =
            shell("SQUINT_DATA='" + fs::absolute(data).string() + "' \"$SQUINT\" sweep '" +
                  entry.path().string() + "' --dry-run --set image.width=4 --set image.height=4");
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_NE(outcome.out.find(" points, "), std::string::npos) << name;
    }
    EXPECT_GE(read, 8);
}

// What a sweep of 24 points may leave behind after any accident: nothing torn, no temporary, and the rest to go on with.
const std::string kTwentyFour =
    kBase +
    "[[axis]]\nwires = ['color', 'transparency']\nfraction_bits = { from = 4, to = 15 }\n"
    "[[axis]]\nwires = ['sample']\nfraction_bits = [2, 9]\n";

TEST_F(SweepProgram, GoesOnAfterADiskThatWasFull) {
    write("s.toml", kTwentyFour);
    ASSERT_EQ(squint("sweep s.toml -o whole -q").code, 0);
    ASSERT_EQ(squint("sweep s.toml -o run -q --shard 1/2").code, 0);
    const auto half = points("run");
    ASSERT_EQ(half.size(), 12u);
    // Files of the program may not grow beyond 1 kB: its list of points cannot be written, and no record.
    const Outcome full = shell("(trap '' XFSZ; ulimit -f 2; exec \"$SQUINT\" sweep s.toml -o run -q)");
    EXPECT_EQ(full.code, 2);
    EXPECT_TRUE(full.err.starts_with("squint: ")) << full.err;
    EXPECT_NE(full.err.find("cannot write: File too large"), std::string::npos) << full.err;
    EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
    EXPECT_EQ(points("run"), half) << "what was there is there, whole";
    for (const auto& entry : fs::recursive_directory_iterator(folder / "run"))
        EXPECT_EQ(entry.path().filename().string().find(".squint-"), std::string::npos) << entry.path();
    EXPECT_EQ(squint("sweep s.toml -o run -q").code, 0);
    EXPECT_EQ(points("run"), points("whole"));
}

TEST_F(SweepProgram, SaysInOneLineThatItsFolderCannotBeWritten) {
    write("s.toml", kTwentyFour);
    expect_refusal(squint("sweep s.toml -o /proc/run -q"), "/proc/run");
    write("file", "no folder");
    expect_refusal(squint("sweep s.toml -o file/run -q"), "file/run");
    ASSERT_EQ(squint("sweep s.toml -o run -q --shard 1/2").code, 0);
    const auto half = points("run");
    // Root may write anywhere: there it is somebody else who may not.
    std::string as_somebody = "\"$SQUINT\"";
    if (geteuid() == 0) {
        as_somebody = "setpriv --reuid=65534 --regid=65534 --clear-groups \"$SQUINT\"";
        fs::permissions(folder, fs::perms::others_read | fs::perms::others_exec, fs::perm_options::add);
        if (shell(as_somebody + " --version").code != 0) GTEST_SKIP() << "nobody else may run this program";
    }
    fs::permissions(folder / "run" / "points", fs::perms::owner_read | fs::perms::owner_exec |
                                                   fs::perms::others_read | fs::perms::others_exec);
    const Outcome refused = shell(as_somebody + " sweep s.toml -o run -q");
    fs::permissions(folder / "run" / "points", fs::perms::owner_all);
    EXPECT_EQ(refused.code, 2) << refused.err;
    EXPECT_NE(refused.err.find("Permission denied"), std::string::npos) << refused.err;
    EXPECT_EQ(points("run"), half);
}

TEST_F(SweepProgram, TwoAtOnceInOneFolderEndWithEveryPoint) {
    write("s.toml", kTwentyFour);
    ASSERT_EQ(squint("sweep s.toml -o whole -q").code, 0);
    const Outcome both = shell(
        "\"$SQUINT\" sweep s.toml -o run -q & first=$!\n\"$SQUINT\" sweep s.toml -o run -q; second=$?\n"
        "wait $first && exit $second");
    EXPECT_EQ(both.code, 0) << both.err;
    EXPECT_EQ(points("run"), points("whole"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "run" / "runs"), {}), 2) << "each has a log";
}

TEST_F(SweepProgram, TakesRecordsFromBeforeAClockWasSetBack) {
    write("s.toml", kTwentyFour);
    ASSERT_EQ(squint("sweep s.toml -o run -q").code, 0);
    const auto tomorrow = fs::file_time_type::clock::now() + std::chrono::hours(24);
    for (const auto& entry : fs::recursive_directory_iterator(folder / "run"))
        fs::last_write_time(entry.path(), tomorrow);
    const Outcome again = squint("sweep s.toml -o run");
    EXPECT_NE(again.err.find("0 computed, 24 there already"), std::string::npos) << again.err;
}

/// The program with tests/cli/accidents/preload.cpp before its own calls.
std::string with_accidents(const std::string& setting) {
    return "LD_PRELOAD='" SQUINT_ACCIDENTS "' ASAN_OPTIONS=verify_asan_link_order=0 " + setting +
           " \"$SQUINT\" ";
}

// A loss of power after a rename finds the file's bytes on the disk: they were sent there before its name.
TEST_F(SweepProgram, EveryFileIsOnTheDiskBeforeItHasItsName) {
    write("s.toml", kTwentyFour);
    const std::string log = (folder / "log").string();
    ASSERT_EQ(shell(with_accidents("SQUINT_SYNC_LOG='" + log + "'") + "sweep s.toml -o run -q").code, 0);
    std::istringstream lines(contents(log));
    std::map<std::string, int> synced;
    int renamed = 0;
    for (std::string line; std::getline(lines, line);) {
        const std::string path = line.substr(line.find('\t') + 1);
        if (line.starts_with("fsync")) ++synced[path];
        if (!line.starts_with("rename")) continue;
        ++renamed;
        EXPECT_EQ(synced[path], 1) << path;
    }
    EXPECT_GE(renamed, 24) << "a rename a point, and those of the run";
}

TEST_F(SweepProgram, AClockThatGoesBackWhileItRunsLosesNothing) {
    write("s.toml", kTwentyFour);
    ASSERT_EQ(squint("sweep s.toml -o whole -q").code, 0);
    ASSERT_EQ(shell(with_accidents("SQUINT_CLOCK=back") + "sweep s.toml -o run -q --shard 1/2").code, 0);
    const Outcome rest = shell(with_accidents("SQUINT_CLOCK=back") + "sweep s.toml -o run");
    EXPECT_NE(rest.err.find("12 computed, 12 there already"), std::string::npos) << rest.err;
    EXPECT_EQ(points("run"), points("whole"));
    EXPECT_EQ(squint("report run").code, 0);
}

// Killed at 50 moments, gone on with each time: every point is there, once, whole, and what it should be.
TEST_F(SweepProgram, EndsWithEveryPointWhereverItWasKilled) {
    write("s.toml", kBase +
                        "[[axis]]\nwires = ['color', 'transparency']\nfraction_bits = { from = 4, to = 15 }\n"
                        "[[axis]]\nwires = ['sample']\nfraction_bits = { from = 0, to = 11 }\n");
    const auto begun = std::chrono::steady_clock::now();
    ASSERT_EQ(squint("sweep s.toml -o whole -q").code, 0);
    const double all = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    const auto whole = points("whole");
    ASSERT_EQ(whole.size(), 144u);

    std::mt19937 random(20240607);
    int killed = 0;
    for (int moment = 0; moment < 50; ++moment) {
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            const int nothing = open("/dev/null", O_WRONLY);
            dup2(nothing, 1), dup2(nothing, 2);
            if (chdir(folder.c_str()) == 0)
                execl(SQUINT_PROGRAM, "squint", "sweep", "s.toml", "-o", "run", static_cast<char*>(nullptr));
            _exit(127);
        }
        // From the loader's first steps to half of all the work: the rest goes on in the next process.
        const double pause = std::min(0.9, all * 0.5 * std::uniform_real_distribution<>(0, 1)(random));
        const timespec wait{0, static_cast<long>(pause * 1e9)};
        nanosleep(&wait, nullptr);
        kill(child, SIGKILL);
        int status = 0;
        waitpid(child, &status, 0);
        killed += WIFSIGNALED(status);
        if (!fs::exists(folder / "run" / "points")) continue;
        for (const auto& [hash, picture] : points("run")) {
            ASSERT_EQ(picture, whole.at(hash));
        }
    }
    EXPECT_GT(killed, 0) << "the program was faster than every pause: nothing was tested";
    const Outcome last = squint("sweep s.toml -o run");
    EXPECT_EQ(last.code, 0) << last.err;
    EXPECT_EQ(points("run"), whole);
}

}  // namespace
}  // namespace squint::test
