#include "core/image.h"

#include "core/error.h"
#include "core/exr_header.h"
#include "core/srgb.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

namespace {

using namespace squint;
using testing::HasSubstr;

std::size_t files_in(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// R G B A of floats, with values that no 8-bit file holds, and two channels of words.
Image picture(int width = 37, int height = 23) {
    Image image{width, height, {}};
    std::mt19937 random(5);
    for (const char* name : {"R", "G", "B", "A", "Z", "N.x"})
        for (float& value : image.add_float(name).values)
            value = static_cast<float>(random()) * 0x1p-31f - 0.5f;
    for (const char* name : {"fixed.R", "fixed.T"})
        for (std::uint32_t& word : image.add_words(name).words) word = static_cast<std::uint32_t>(random());
    image.find("fixed.R")->words[0] = 0xffffffffu;  // -1: read as a float it would lose bits
    image.find("Z")->values[1] = std::numeric_limits<float>::infinity();
    return image;
}

template <class Call>
std::string message(const Call& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Exr, EveryFloatAndEveryWordComesBackBitForBit) {
    const test::OwnFolder folder;
    const Image image = picture();
    write_exr(image, folder / "a.exr", {{"squint:scene", "line one\nline two"}, {"squint:version", "0.1"}});
    Attributes attributes;
    const Image back = read_image(folder / "a.exr", &attributes);
    EXPECT_EQ(back.width, image.width);
    EXPECT_EQ(back.height, image.height);
    ASSERT_EQ(back.channels.size(), image.channels.size());
    for (const Channel& channel : image.channels) {
        const Channel* found = back.find(channel.name);
        ASSERT_TRUE(found) << channel.name;
        EXPECT_EQ(found->is_words(), channel.is_words()) << channel.name;
        EXPECT_EQ(found->words, channel.words) << channel.name;
        EXPECT_EQ(found->values, channel.values) << channel.name;
    }
    EXPECT_EQ(attributes["squint:scene"], "line one\nline two");
    EXPECT_EQ(attributes["squint:version"], "0.1");
}

TEST(Exr, TwoRunsAtDifferentTimesAndPlacesWriteTheSameBytes) {
    const test::OwnFolder folder;
    write_exr(picture(), folder / "a.exr", {{"squint:scene", "x"}});
    std::filesystem::create_directory(folder / "deeper");
    const std::time_t started = std::time(nullptr);
    while (std::time(nullptr) == started) {
    }  // a stamp of the time has seconds
    write_exr(picture(), folder / "deeper/other.exr", {{"squint:scene", "x"}});
    EXPECT_EQ(bytes_of(folder / "a.exr"), bytes_of(folder / "deeper/other.exr"));
    EXPECT_THAT(bytes_of(folder / "a.exr"), Not(HasSubstr("squint_image_")));
}

TEST(Exr, AFolderThatCannotBeWrittenIsNamedAndNothingRemains) {
    const test::OwnFolder folder;
    EXPECT_THAT(message([&] { write_exr(picture(), folder / "absent/a.exr", {}); }),
                HasSubstr("absent/a.exr"));
    EXPECT_THAT(message([&] {
                    write_exr(Image{3, 3, {}}, folder / "a.exr", {});
                }),
                HasSubstr("3 x 3 pixels of 0 channels"));
    Image torn = picture();
    torn.channels[2].values.pop_back();
    EXPECT_THAT(message([&] { write_exr(torn, folder / "a.exr", {}); }),
                HasSubstr("channel B has not 37 x 23 values"));
    EXPECT_EQ(files_in(folder), 0u);
}

TEST(Exr, AFullDiskIsReportedAndNothingRemainsForPicturesAndPreviews) {
    const test::OwnFolder folder;
    const double black[3] = {0, 0, 0};
    // Files of this process may not grow beyond 4 kB for a moment: less than either picture needs.
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{4096, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const std::string exr = message([&] { write_exr(picture(200, 200), folder / "a.exr", {}); });
    const std::string png = message([&] { write_preview_png(picture(200, 200), folder / "a.png", black); });
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_THAT(exr, HasSubstr("a.exr: cannot write"));
    EXPECT_THAT(png, HasSubstr("a.png: cannot write"));
    EXPECT_EQ(files_in(folder), 0u);
}

TEST(Srgb, TheCurveAndItsInverseMeet) {
    for (int i = 0; i <= 4096; ++i) {
        const double x = i / 4096.0;
        // The slope of decoding is at most 2.3 and pow is good to 2^-50; the standard's two pieces miss each
        // other by 3e-8.
        EXPECT_NEAR(linear_from_srgb(srgb_from_linear(x)), x, x > 0.00313 && x < 0.00314 ? 1e-7 : 1e-14);
    }
    EXPECT_EQ(srgb_from_linear(0), 0);
    EXPECT_NEAR(srgb_from_linear(1), 1, 4e-16);
    EXPECT_EQ(srgb_from_linear(-3), 0);
}

TEST(Preview, CodesAreTheNearestToTheSrgbCurveAndHalvesRoundUp) {
    const test::OwnFolder folder;
    Image image{4096, 1, {}};
    for (const char* name : {"R", "G", "B"}) {
        float next = 0;
        for (float& value : image.add_float(name).values) value = next++ / 4095;
    }
    const double black[3] = {0, 0, 0};
    write_preview_png(image, folder / "a.png", black);
    const Image back = read_image(folder / "a.png");
    ASSERT_TRUE(back.find("R"));
    for (int x = 0; x < image.width; ++x) {
        const auto i = static_cast<std::size_t>(x);
        const double expected = std::floor(srgb_from_linear(image.find("R")->values[i]) * 255 + 0.5);
        EXPECT_EQ(std::lround(back.find("R")->values[i] * 255), expected) << x;
    }
}

TEST(Preview, PutsTheBackgroundUnderPremultipliedColour) {
    const test::OwnFolder folder;
    Image image{4, 1, {}};
    image.add_float("A").values = {0, 0.5f, 1, 0.25f};
    image.add_float("B").values = {0, 0, 0, 9};
    image.add_float("G").values = {0, 0.25f, 0.5f, -9};
    image.add_float("R").values = {0, 0.5f, 1, std::nanf("")};
    const double background[3] = {1, 0.5, 0};
    write_preview_png(image, folder / "a.png", background);
    const Image back = read_image(folder / "a.png");
    // 188 is the code of half the light: 255 * srgb(0.5) = 187.5...
    const std::vector<int> red{255, 255, 255, 0}, green{188, 188, 188, 0}, blue{0, 0, 0, 255};
    for (std::size_t x = 0; x < 4; ++x) {
        EXPECT_EQ(std::lround(back.find("R")->values[x] * 255), red[x]) << x;
        EXPECT_EQ(std::lround(back.find("G")->values[x] * 255), green[x]) << x;
        EXPECT_EQ(std::lround(back.find("B")->values[x] * 255), blue[x]) << x;
    }
    EXPECT_THAT(message([&] {
                    write_preview_png(Image{picture().width, 23, {picture().channels[3]}}, folder / "b.png",
                                      background);
                }),
                HasSubstr("no channel R"));
    EXPECT_EQ(files_in(folder), 1u);
}

TEST(ReadImage, WhatCannotBeReadIsOneLineThatNamesTheFile) {
    const test::OwnFolder folder;
    const auto refused = [&](const std::string& name) {
        return message([&] { (void)read_image(folder / name); });
    };
    EXPECT_THAT(refused("absent.exr"),
                AllOf(HasSubstr("absent.exr"), HasSubstr("cannot read: No such file")));
    std::ofstream(folder / "a.unknown") << "text";
    EXPECT_THAT(refused("a.unknown"), HasSubstr("extension \".unknown\" names no image format"));
    std::ofstream(folder / "plain") << "text";
    EXPECT_THAT(refused("plain"), HasSubstr("names no image format"));
    std::filesystem::create_directory(folder / "folder.exr");
    EXPECT_THAT(refused("folder.exr"), HasSubstr("cannot read: Is a directory"));
    std::ofstream(folder / "empty.exr").close();
    EXPECT_THAT(refused("empty.exr"), HasSubstr("cannot read"));
    std::ofstream(folder / "text.png") << "text";
    EXPECT_THAT(refused("text.png"), AllOf(HasSubstr("text.png: cannot read"), Not(HasSubstr("\n"))));
}

long most_resident_kilobytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

void put(std::string& bytes, std::size_t at, std::uint32_t number) {
    std::memcpy(bytes.data() + at, &number, sizeof number);
}

TEST(ReadImage, AnExrThatClaimsMoreThanItHoldsIsRefusedBeforeMemoryIsTaken) {
    const test::OwnFolder folder;
    write_exr(picture(), folder / "whole.exr", {{"squint.scene", "x"}});
    const std::string whole = bytes_of(folder / "whole.exr");
    const long before = most_resident_kilobytes();
    const auto refused = [&](const std::string& bytes) {
        std::ofstream(folder / "damaged.exr", std::ios::binary) << bytes;
        return message([&] { (void)read_image(folder / "damaged.exr"); });
    };
    int attributes = 0;
    for (std::size_t at = 8; whole[at] != 0; ++attributes) {
        at += std::strlen(&whole[at]) + 1;
        at += std::strlen(&whole[at]) + 1;  // name, type, length
        std::uint32_t length = 0;
        std::memcpy(&length, &whole[at], sizeof length);
        for (const std::uint32_t claim :
             {0x69000000u, 0xffffffffu, static_cast<std::uint32_t>(whole.size())}) {
            std::string damaged = whole;
            put(damaged, at, claim);
            EXPECT_THAT(refused(damaged), HasSubstr("the EXR header is damaged: attribute \"")) << at;
        }
        at += 4 + length;
    }
    EXPECT_GT(attributes, 8);
    const std::size_t window = whole.find("dataWindow") + std::strlen("dataWindow") + 1 + 6 + 4;
    for (const std::size_t high : {window + 8, window + 12}) {
        std::string damaged = whole;
        put(damaged, high, 0x7ffffff0);
        EXPECT_THAT(refused(damaged), HasSubstr("pixels in")) << high;
    }
    std::string wide = whole;
    put(wide, window, 0x80000000), put(wide, window + 8, 0x7fffffff);
    put(wide, window + 4, 0x80000000), put(wide, window + 12, 0x7fffffff);
    EXPECT_THAT(refused(wide), HasSubstr("4294967296 x 4294967296 pixels"));
    EXPECT_LT(most_resident_kilobytes() - before, 64 << 10);
}

std::string word(std::uint32_t number) {
    std::string bytes(4, 0);
    put(bytes, 0, number);
    return bytes;
}

// OpenEXR reads an attribute by its type, whatever length the file gives, and takes what follows for the next one: so
// a list of channels that is longer than said made it ask for 1.8 GB, for a file of 400 bytes.
TEST(ReadImage, AnExrAttributeThatDoesNotEndWhereItSaysIsRefused) {
    using namespace std::string_literals;
    const test::OwnFolder folder;
    write_exr(picture(), folder / "whole.exr", {});
    const std::string whole = bytes_of(folder / "whole.exr");
    const auto refusal = [&](const std::string& type, const std::string& value) {
        const std::string bytes = whole.substr(0, 8) + "more\0"s + type + '\0' +
                                  word(static_cast<std::uint32_t>(value.size())) + value + whole.substr(8);
        return message([&] {
            check_exr_header(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), "a.exr");
        });
    };
    const std::string zeros(200, '\0');
    for (const auto& [type, bytes] : {std::pair{"box2i", 16},
                                      {"box2f", 16},
                                      {"chromaticities", 32},
                                      {"compression", 1},
                                      {"double", 8},
                                      {"envmap", 1},
                                      {"float", 4},
                                      {"int", 4},
                                      {"keycode", 28},
                                      {"lineOrder", 1},
                                      {"m33f", 36},
                                      {"m44f", 64},
                                      {"rational", 8},
                                      {"tiledesc", 9},
                                      {"timecode", 8},
                                      {"v2f", 8},
                                      {"v2i", 8},
                                      {"v3f", 12},
                                      {"v3i", 12}}) {
        const auto size = static_cast<std::size_t>(bytes);
        EXPECT_EQ(refusal(type, zeros.substr(0, size)), "") << type;
        for (const std::size_t wrong : {size - 1, size + 1})
            EXPECT_THAT(refusal(type, zeros.substr(0, wrong)), HasSubstr("but its type, "s + type)) << wrong;
    }
    const std::string channel = "R\0"s + zeros.substr(0, 16);
    const std::string pixels = word(2) + word(3) + zeros.substr(0, 24);
    for (const auto& [type, value] : {std::pair{"chlist", channel + '\0'},
                                      {"stringvector", word(2) + "ab" + word(0)},
                                      {"stringvector", ""s},
                                      {"floatvector", zeros.substr(0, 8)},
                                      {"preview", pixels},
                                      {"preview", word(0) + word(7)},
                                      {"string", "any"s},
                                      {"of somebody", "any"s}})
        EXPECT_EQ(refusal(type, value), "") << type;
    for (const auto& [type, value] : {std::pair{"chlist", channel},
                                      {"chlist", channel + channel.substr(0, 9)},
                                      {"chlist", ""s},
                                      {"chlist", channel + '\0' + channel},
                                      {"chlist", "R"s},
                                      {"stringvector", word(3) + "ab"},
                                      {"stringvector", word(1) + "abc"},
                                      {"floatvector", zeros.substr(0, 7)},
                                      {"preview", pixels + 'x'},
                                      {"preview", pixels.substr(0, 28)},
                                      {"preview", word(2)},
                                      {"preview", word(0x80000000) + word(2)}})
        EXPECT_THAT(refusal(type, value), HasSubstr("does not end after its")) << type;
}

TEST(ReadImage, APictureKnowsItsPlaceAndSeveralInAFileAreRefused) {
    const test::OwnFolder folder;
    write_exr(picture(), folder / "a.exr", {});
    EXPECT_EQ(read_image(folder / "a.exr").left, 0);
    const std::string whole = bytes_of(folder / "a.exr");
    std::string moved = whole;
    const std::size_t window = whole.find("dataWindow") + std::strlen("dataWindow") + 1 + 6 + 4;
    put(moved, window, 7), put(moved, window + 8, 7 + 36);
    std::ofstream(folder / "moved.exr", std::ios::binary) << moved;
    EXPECT_EQ(read_image(folder / "moved.exr").left, 7);
    EXPECT_EQ(read_image(folder / "moved.exr").find("R")->values, picture().find("R")->values);

    std::size_t end = 8;  // of the header
    while (whole[end] != 0) {
        for (int text = 0; text < 2; ++text) end += std::strlen(&whole[end]) + 1;
        std::uint32_t length = 0;
        std::memcpy(&length, &whole[end], sizeof length);
        end += 4 + length;
    }
    const std::string header = whole.substr(8, end + 1 - 8);
    std::string parts = whole.substr(0, 8) + header + header + whole.substr(end);
    parts[5] |= 0x10;
    std::ofstream(folder / "parts.exr", std::ios::binary) << parts;
    EXPECT_THAT(message([&] { (void)read_image(folder / "parts.exr"); }),
                HasSubstr("parts.exr: holds several pictures"));
}

TEST(Preview, IsTheOneThatItsPictureShows) {
    const test::OwnFolder folder;
    const double background[3] = {0.25, 0.5, 1};
    Image image = picture();
    write_preview_png(image, folder / "a.png", background);
    const Image back = read_image(folder / "a.png"), shown = preview_of(image, background);
    EXPECT_TRUE(back.is_display);
    for (const char* name : {"R", "G", "B"})
        EXPECT_EQ(back.find(name)->values, shown.find(name)->values) << name;
    EXPECT_FALSE(read_image(folder / "a.png").find("A"));
}

TEST(ReadImage, ATornOrFlippedExrIsRefusedOrReadButNeverWorse) {
    const test::OwnFolder folder;
    write_exr(picture(), folder / "whole.exr", {{"squint:scene", "x"}});
    const std::string whole = bytes_of(folder / "whole.exr");
    std::mt19937 random(3);
    int refused = 0;
    for (int i = 0; i < 120; ++i) {
        std::string torn = whole;
        if (i % 2) torn.resize(random() % whole.size());
        for (int flip = 0; i % 2 == 0 && flip < 4; ++flip)
            torn[random() % 600] ^= static_cast<char>(1u << random() % 8);
        std::ofstream(folder / "torn.exr", std::ios::binary) << torn;
        const std::string said = message([&] { (void)read_image(folder / "torn.exr"); });
        refused += !said.empty();
        EXPECT_THAT(said, Not(HasSubstr("\n"))) << "case " << i << " of seed 3";
    }
    EXPECT_GE(refused, 60) << "at least every cut file";
}

}  // namespace
