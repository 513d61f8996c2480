// Runs the squint program as a user would: through the shell, in an empty folder.
#pragma once

#include "tests/own_folder.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace squint::test {

namespace fs = std::filesystem;

inline std::string contents(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

struct Outcome {
    int code = -1;  // exit code; 128 + n after signal n
    std::string out, err;
    nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// A test whose program runs in a folder of its own.
class Program : public ::testing::Test {
  protected:
    /// `squint ARGUMENTS` as typed.
    Outcome squint(const std::string& arguments) const { return shell("\"$SQUINT\" " + arguments); }
    /// A line for sh, with $SQUINT for the program.
    Outcome shell(const std::string& line) const {
        const fs::path out = folder / ".stdout", err = folder / ".stderr";
        const std::string command = "cd '" + folder.string() + "' && SQUINT='" SQUINT_PROGRAM "' && { " +
                                    line + "\n} >'" + out.string() + "' 2>'" + err.string() + "'";
        const int status = std::system(command.c_str());
        const Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contents(out),
                              contents(err)};
        fs::remove(out), fs::remove(err);
        return outcome;
    }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder / name, std::ios::binary) << text;
    }
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
        std::sort(names.begin(), names.end());
        return names;
    }
    bool has(const std::string& name) const { return fs::exists(folder / name); }

    /// One line on standard error, beginning with `squint: ` and containing `part`; exit code 2; nothing
    /// written.
    void expect_refusal(const Outcome& outcome, const std::string& part) const {
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with("squint: ")) << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    }

    const OwnFolder folder;
};

/// A picture that takes milliseconds, full of the volume.
inline const std::string kSmall = " --size 24x16 --set volume.dims=16 --set camera.height=16 ";

}  // namespace squint::test
