#include "core/read_whole.h"

#include "core/error.h"
#include "tests/own_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace squint {
namespace {

TEST(ReadWhole, GivesEveryByteOfAFile) {
    const test::OwnFolder folder;
    std::string bytes;
    for (int i = 0; i < 200000; ++i) bytes += static_cast<char>(i * 7 % 251);
    std::ofstream(folder / "file", std::ios::binary) << bytes;
    EXPECT_EQ(read_whole(folder / "file", "bytes"), bytes);
    EXPECT_EQ(read_whole(folder / "file", "bytes", bytes.size()), bytes);
    std::ofstream(folder / "empty").close();
    EXPECT_EQ(read_whole(folder / "empty", "bytes", 0), "");
}

TEST(ReadWhole, SaysWhatCannotBeReadAndWhatMayStandThere) {
    const test::OwnFolder folder;
    std::ofstream(folder / "six") << "123456";
    const auto refusal = [&](const std::string& name, std::size_t most) {
        try {
            read_whole(folder / name, "a scene", most);
        } catch (const InputError& error) {
            return std::string(error.what()).substr(folder.string().size());
        }
        return std::string("none");
    };
    EXPECT_EQ(refusal("six", 6), "none");
    EXPECT_EQ(refusal("six", 5), "/six: found more than 5 bytes; allowed: a scene of at most so many");
    EXPECT_EQ(refusal("none", 5), "/none: cannot read: No such file or directory; allowed: a scene");
    EXPECT_EQ(refusal("", 5), "/: cannot read: Is a directory; allowed: a scene");
}

}  // namespace
}  // namespace squint
