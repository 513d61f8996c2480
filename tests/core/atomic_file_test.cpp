#include "core/atomic_file.h"

#include "core/error.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

namespace squint {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class AtomicFile : public testing::Test {
  protected:
    std::size_t files() const {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    static std::string text_of(const fs::path& path) {
        std::ostringstream text;
        text << std::ifstream(path).rdbuf();
        return text.str();
    }
    static std::string message_of(const std::function<void()>& write) {
        try {
            write();
        } catch (const InputError& error) {
            return error.what();
        }
        return "no error";
    }

    const test::OwnFolder folder;
};

TEST_F(AtomicFile, AppearsWholeAndLeavesNothingElse) {
    write_text_whole((folder / "a.json").string(), "first");
    write_text_whole((folder / "a.json").string(), "second");
    EXPECT_EQ(text_of(folder / "a.json"), "second");
    EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFile, TheTemporaryLiesBesideTheTargetAndKeepsItsExtension) {
    write_whole((folder / "picture.exr").string(), [&](const std::string& temporary) {
        EXPECT_EQ(fs::path(temporary).extension(), ".exr");
        EXPECT_EQ(fs::path(temporary).parent_path(), fs::canonical(folder));
        EXPECT_FALSE(fs::exists(folder / "picture.exr"));
    });
    EXPECT_TRUE(fs::exists(folder / "picture.exr"));
}

TEST_F(AtomicFile, AFailedWriteLeavesTheOldFileAndNoTemporary) {
    const std::string path = (folder / "a.txt").string();
    write_text_whole(path, "old");
    const std::string message = message_of([&] {
        write_whole(path, [](const std::string& temporary) {
            std::ofstream(temporary) << "half";
            throw InputError(temporary + ": the encoder gave up");
        });
    });
    EXPECT_EQ(message, path + ": the encoder gave up");
    EXPECT_EQ(text_of(path), "old");
    EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFile, OtherExceptionsPassAndLeaveNoTemporary) {
    EXPECT_THROW(write_whole((folder / "a").string(), [](const std::string&) { throw std::bad_alloc(); }),
                 std::bad_alloc);
    EXPECT_EQ(files(), 0u);
}

TEST_F(AtomicFile, AFolderThatIsNotThereIsNamed) {
    const std::string path = (folder / "none" / "a.txt").string();
    EXPECT_THAT(message_of([&] { write_text_whole(path, "x"); }),
                AllOf(HasSubstr(path), HasSubstr("No such file or directory"), Not(HasSubstr("\n"))));
}

TEST_F(AtomicFile, AFileInPlaceOfAFolderIsNamed) {
    std::ofstream(folder / "file") << "x";
    const std::string path = (folder / "file" / "a.txt").string();
    EXPECT_THAT(message_of([&] { write_text_whole(path, "x"); }), HasSubstr(path + ": cannot write: "));
}

TEST_F(AtomicFile, AFolderIsNoTarget) {
    EXPECT_EQ(message_of([&] { write_text_whole(folder.string(), "x"); }),
              folder.string() + ": cannot write: Is a directory");
    EXPECT_THAT(message_of([&] { write_text_whole("", "x"); }), HasSubstr("the path is empty"));
}

TEST_F(AtomicFile, AnUnwritableFolderIsNamed) {
    if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
    fs::permissions(folder, fs::perms::owner_read | fs::perms::owner_exec);
    const std::string path = (folder / "a.txt").string();
    EXPECT_EQ(message_of([&] { write_text_whole(path, "x"); }), path + ": cannot write: Permission denied");
    fs::permissions(folder, fs::perms::owner_all);
}

TEST_F(AtomicFile, AFullDeviceIsNamedAndStaysADevice) {
    if (!fs::is_character_file("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    EXPECT_EQ(message_of([&] { write_text_whole("/dev/full", "x"); }),
              "/dev/full: cannot write: No space left on device");
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

// The limit on a file's size stands for a disk that fills up half-way.
TEST_F(AtomicFile, AFileCutShortByTheSystemIsRemoved) {
    const std::string path = (folder / "a.txt").string();
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{4096, 4096};
        setrlimit(RLIMIT_FSIZE, &limit);
        const std::string message = message_of([&] { write_text_whole(path, std::string(100000, 'x')); });
        _exit(message == path + ": cannot write: File too large" ? 0 : 1);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    EXPECT_EQ(files(), 0u);
}

TEST_F(AtomicFile, ALinkStaysAndItsFileIsReplaced) {
    std::ofstream(folder / "file") << "old";
    fs::create_symlink("file", folder / "link");
    write_text_whole((folder / "link").string(), "new");
    EXPECT_TRUE(fs::is_symlink(folder / "link"));
    EXPECT_EQ(text_of(folder / "file"), "new");
}

TEST_F(AtomicFile, AnInterruptedProcessLeavesNothing) {
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGINT, [](int) {
            remove_temporaries();
            _exit(130);
        });
        write_whole((folder / "a").string(), [&](const std::string&) {
            write_whole((folder / "b").string(), [](const std::string& temporary) {
                std::ofstream(temporary) << "half";
                raise(SIGINT);
            });
        });
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_EQ(files(), 0u);
}

TEST_F(AtomicFile, ManyWritersAtOnceDoNotMeet) {
    std::vector<std::thread> writers;
    for (int i = 0; i < 100; ++i)
        writers.emplace_back(
            [&, i] { write_text_whole((folder / std::to_string(i)).string(), std::to_string(i)); });
    for (std::thread& writer : writers) writer.join();
    EXPECT_EQ(files(), 100u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(text_of(folder / std::to_string(i)), std::to_string(i));
}

}  // namespace
}  // namespace squint
