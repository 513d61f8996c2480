// What is refused of a NRRD file, in one line each.
#include "tests/core/nrrd_files.h"

#include <cstdlib>
#include <limits>
#include <random>

namespace squint {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST_F(Nrrd, RefusesWhatIsNoNrrd) {
    EXPECT_THAT(refusal_of((folder / "none.nrrd").string()),
                HasSubstr("none.nrrd: cannot read: No such file or directory"));
    setenv("SQUINT_READ", (std::filesystem::path(SQUINT_PROGRAM).parent_path() / "squint-read").c_str(), 1);
    EXPECT_EQ(refusal_of(folder.string()),
              folder.string() + ": a folder without DICOM, TIFF or PNG slices; allowed: one of their series");
    EXPECT_EQ(refusal_of(file("a.nrrd", "P5 2 2")), "a.nrrd: no NRRD: the file does not begin with \"NRRD\"");
    EXPECT_EQ(refusal_of(file("a.nrrd", "")), "a.nrrd: no NRRD: the file does not begin with \"NRRD\"");
    EXPECT_THAT(refusal_of(file("a.nrrd", "NRRD0009\ntype: uchar\n\n")),
                HasSubstr("version is \"NRRD0009\", but NRRD0001 to NRRD0005 are allowed"));
    EXPECT_THAT(refusal_of(file("a.nrrd", "NRRD0004\ntype: uchar\n")),
                HasSubstr("without the blank line that ends it"));
    EXPECT_EQ(refusal_of(file("a.nrrd", "NRRD0004\n# " + std::string(1, '\0') + "\n\n")),
              "a.nrrd: NRRD header holds a byte of zero, but must be text");
    EXPECT_THAT(refusal_of(file("a.nrrd", "NRRD0004\n" + std::string(3 << 20, 'x'))),
                HasSubstr("without the blank line"));
}

TEST_F(Nrrd, RefusesTypesOutsideTheList) {
    EXPECT_THAT(
        refusal_of(file("a.nrrd", Header{.type = "block", .more = "block size: 1\n"}.text() + k24Bytes)),
        HasSubstr("but integers and floats are allowed"));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.type = "u12"}.text() + k24Bytes)),
                StartsWith("a.nrrd: NRRD header: "));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.encoding = "hex"}.text() + k24Bytes)),
                HasSubstr("encoding is hex, but raw, gzip and ascii are allowed"));
}

TEST_F(Nrrd, RefusesDimensionsThatCannotBe) {
    EXPECT_EQ(refusal_of(file(
                  "a.nrrd", "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 4 6\nencoding: raw\n\n" + k24Bytes)),
              "a.nrrd: dimension is 2, but 3 is allowed, and 4 with an axis of components");
    EXPECT_EQ(
        refusal_of(file(
            "a.nrrd", "NRRD0004\ntype: uchar\ndimension: 5\nsizes: 1 1 4 3 2\nencoding: raw\n\n" + k24Bytes)),
        "a.nrrd: dimension is 5, but 3 is allowed, and 4 with an axis of components");
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.sizes = "4 0 2"}.text() + k24Bytes)),
                StartsWith("a.nrrd: NRRD header: parsing sizes"));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.sizes = "4 -3 2"}.text() + k24Bytes)),
                StartsWith("a.nrrd: "));
    EXPECT_THAT(
        refusal_of(file("a.nrrd", Header{.sizes = "4294967296 4294967296 4294967296"}.text() + k24Bytes)),
        HasSubstr("too large"));
    EXPECT_THAT(
        refusal_of(
            file("a.nrrd", Header{.type = "ushort", .sizes = "2147483648 2147483648 1"}.text() + k24Bytes)),
        HasSubstr("less than 2^62 bytes of voxels are allowed"));
}

TEST_F(Nrrd, RefusesDataOfAnotherSize) {
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{}.text() + k24Bytes.substr(1))),
              "a.nrrd: 23 bytes of voxels after the first 89, but 4x3x2 of 8 bits needs 24");
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{}.text() + k24Bytes + "xx")),
                HasSubstr("26 bytes of voxels after the first 89, but 4x3x2 of 8 bits needs 24: oversized"));
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + gzip(k24Bytes.substr(4)))),
              "a.nrrd: 20 bytes of voxels, but 4x3x2 of 8 bits needs 24");
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + gzip(k24Bytes + "x"))),
              "a.nrrd: more than 24 bytes of voxels, but 4x3x2 of 8 bits needs 24");
    const std::string packed = gzip(k24Bytes);
    EXPECT_THAT(
        refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + packed.substr(0, packed.size() / 2))),
        HasSubstr("bytes of voxels, but 4x3x2 of 8 bits needs 24"));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.more = "byte skip: 1000\n"}.text() + k24Bytes)),
                HasSubstr(": 0 bytes of voxels"));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.more = "line skip: 9\n"}.text() + k24Bytes)),
                HasSubstr("line skip reaches past the end"));
    EXPECT_THAT(
        refusal_of(file("a.nrrd", Header{.encoding = "gzip", .more = "byte skip: 30\n"}.text() + packed)),
        HasSubstr("byte skip is 30, but the data end before"));
    EXPECT_THAT(
        refusal_of(file("a.nrrd", Header{.encoding = "gzip", .more = "byte skip: -2\n"}.text() + packed)),
        HasSubstr("-1 or more"));
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.encoding = "gzip", .more = "byte skip: -1\n"}.text() +
                                            gzip(k24Bytes.substr(4)))),
              "a.nrrd: 20 bytes of voxels, but 4x3x2 of 8 bits needs 24");
}

TEST_F(Nrrd, RefusesDamagedGzip) {
    std::string packed = gzip(std::string(1000, 'a') + k24Bytes);
    packed[12] = static_cast<char>(packed[12] ^ 0xff);
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.sizes = "32 32 1", .encoding = "gzip"}.text() + packed)),
                HasSubstr("compressed data are damaged"));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + k24Bytes)),
                HasSubstr("compressed data are damaged"));
}

TEST_F(Nrrd, RefusesAGzipBombBeforeItTakesMemory) {
    const std::string bomb = gzip(std::string(50 << 20, 0));  // 50 MiB in about 50 kB
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + bomb)),
              "a.nrrd: more than 24 bytes of voxels, but 4x3x2 of 8 bits needs 24");
    EXPECT_THAT(refusal_of(file("b.nrrd", Header{.sizes = "100000 100000 100", .encoding = "gzip"}.text() +
                                              gzip(k24Bytes))),
                HasSubstr("bytes of compressed data hold at most"));
    const VolumeSource source{
        .file = file("c.nrrd", Header{.sizes = "1024 1024 50", .encoding = "gzip"}.text() + bomb)};
    EXPECT_EQ(refusal(source, {.max_bytes = 50 << 10}),
              "c.nrrd: 1024x1024x50 needs 52428800 bytes of memory, but 51200 are allowed");
    EXPECT_EQ(refusal(source), "no refusal");
}

TEST_F(Nrrd, CopiesCountAgainstTheMemoryLimitAndMappedVoxelsDoNot) {
    const std::string values = bytes_of_values(counting<std::uint16_t>(24));
    EXPECT_EQ(refusal({.file = file("a.nrrd", Header{.type = "short"}.text() + values)}, {.max_bytes = 40}),
              "a.nrrd: 4x3x2 needs 48 bytes of memory, but 40 are allowed");
    EXPECT_EQ(
        refusal({.file = file("b.nrrd", Header{.more = "# pad\n"}.text() + k24Bytes)}, {.max_bytes = 0}),
        "no refusal");
}

TEST_F(Nrrd, RefusesHeadersThatPointElsewhere) {
    file("voxels.raw", k24Bytes);
    std::filesystem::create_directory(folder / "sub");
    const auto with = [&](const std::string& name) {
        return refusal_of(file("sub/a.nhdr", Header{.more = "data file: " + name + "\n"}.text()));
    };
    for (const std::string name : {"../voxels.raw", "x/../../voxels.raw", "..", "/etc/passwd"})
        EXPECT_EQ(with(name), "sub/a.nhdr: data file is \"" + name +
                                  "\", but only files in the header's own folder or below are allowed");
    EXPECT_THAT(with("LIST"), HasSubstr("data in several files are not supported"));
    EXPECT_THAT(with("slice%03d.raw 1 2 1"), HasSubstr("data in several files are not supported"));
    EXPECT_THAT(with("x.raw\ndata file: y.raw"), HasSubstr("data file is named twice"));
    EXPECT_THAT(with(" "), HasSubstr("data file is named by nothing"));
    EXPECT_THAT(with("none.raw"), HasSubstr("sub/none.raw: cannot read: No such file or directory"));
    EXPECT_THAT(with("."), HasSubstr("not a regular file"));
}

TEST_F(Nrrd, RefusesLinksThatLeadOutOfTheHeadersFolder) {
    namespace fs = std::filesystem;
    file("voxels.raw", k24Bytes);
    fs::create_directories(folder / "sub/deeper");
    file("sub/deeper/own.raw", k24Bytes);
    fs::create_symlink("../voxels.raw", folder / "sub/out.raw");
    fs::create_directory_symlink("..", folder / "sub/up");
    fs::create_symlink("deeper/own.raw", folder / "sub/in.raw");
    fs::create_symlink("nowhere.raw", folder / "sub/broken.raw");
    const auto with = [&](const std::string& name) {
        return refusal_of(file("sub/a.nhdr", Header{.more = "data file: " + name + "\n"}.text()));
    };
    for (const std::string name : {"out.raw", "up/voxels.raw", "./deeper/.././up/voxels.raw"})
        EXPECT_THAT(with(name), HasSubstr("only files in the header's own folder or below are allowed"));
    EXPECT_EQ(with("out.raw"),
              "sub/a.nhdr: data file is \"out.raw\", a link to elsewhere, but only files in the header's own "
              "folder or below are allowed: put the header beside the file that the link leads to");
    EXPECT_EQ(with("in.raw"), "no refusal");
    EXPECT_EQ(with("up/sub/in.raw"), "no refusal");  // and back again
    EXPECT_THAT(with("broken.raw"), HasSubstr("sub/broken.raw: cannot read: No such file or directory"));
    // A folder that is itself reached through a link is the header's own.
    fs::create_directory_symlink("sub", folder / "link");
    EXPECT_EQ(refusal_of((folder / "link/a.nhdr").string()),
              "link/broken.raw: cannot read: No such file or directory");
    file("sub/a.nhdr", Header{.more = "data file: in.raw\n"}.text());
    EXPECT_EQ(refusal_of((folder / "link/a.nhdr").string()), "no refusal");
}

TEST_F(Nrrd, RefusesSpacingsThatCannotBe) {
    const auto with = [&](const std::string& more) {
        return refusal_of(file("a.nrrd", Header{.more = more + "\n"}.text() + k24Bytes));
    };
    EXPECT_EQ(with("spacings: 1 nan 1"),
              "a.nrrd: spacing is 1 nan 1, but each must be finite and greater than 0");
    EXPECT_EQ(with("spacings: 1 1 -2"),
              "a.nrrd: spacing is 1 1 -2, but each must be finite and greater than 0");
    EXPECT_THAT(with("spacings: 0 1 1"), StartsWith("a.nrrd: NRRD header: parsing spacings"));
    EXPECT_THAT(with("spacings: inf 1 1"), StartsWith("a.nrrd: "));
    EXPECT_THAT(with("space dimension: 3\nspace directions: (1,0,0) (0,nan,0) (0,0,1)"),
                StartsWith("a.nrrd: "));
    EXPECT_THAT(with("space dimension: 3\nspace directions: (1,0,0) (0,0,0) (0,0,1)"),
                HasSubstr("space direction of axis 1 is (0,0,0), but must be finite and not zero"));
    EXPECT_THAT(with("space dimension: 3\nspace directions: none (0,1,0) (0,0,1)"), StartsWith("a.nrrd: "));
    EXPECT_THAT(
        with("space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (nan,0,0)"),
        StartsWith("a.nrrd: "));
    EXPECT_EQ(refusal({.file = file("a.nrrd", Header{}.text() + k24Bytes), .spacing = {1, 0, 1}}),
              "a.nrrd: spacing is 1 0 1, but each must be finite and greater than 0");
    EXPECT_EQ(refusal({.file = file("a.nrrd", Header{}.text() + k24Bytes), .spacing = {1}}),
              "a.nrrd: spacing has 1 numbers, but needs three");
}

TEST_F(Nrrd, RefusesShearedAxesByTheirAngle) {
    const auto with = [&](const std::string& directions) {
        return refusal_of(file(
            "a.nrrd",
            Header{.more = "space dimension: 3\nspace directions: " + directions + "\n"}.text() + k24Bytes));
    };
    EXPECT_EQ(
        with("(1,0,0) (0,0.8,0.6) (0,0,1)"),
        "a.nrrd: axes 1 and 2 meet at 53.13 degrees, their space directions are (0,0.8,0.6) and (0,0,1), "
        "but only right angles are allowed");
    EXPECT_THAT(with("(1,0,0) (1,0,0) (0,0,1)"), StartsWith("a.nrrd: "));
    EXPECT_EQ(with("(1,0,1e-6) (0,1,0) (0,0,1)"), "no refusal");  // rounding of a writer
    EXPECT_EQ(
        refusal_of(file(
            "a.nrrd",
            Header{.more = "space dimension: 2\nspace directions: (1,0) (0,1) none\n"}.text() + k24Bytes)),
        "a.nrrd: space dimension is 2, but 3 is allowed");
}

TEST_F(Nrrd, RefusesDirectionsBeforeTheirSpace) {
    const std::string message = refusal_of(file(
        "a.nrrd",
        Header{.more = "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace dimension: 3\n"}.text() + k24Bytes));
    EXPECT_THAT(message, HasSubstr("space directions"));
    EXPECT_THAT(message, HasSubstr("don't yet have a valid space dimension"));
}

TEST_F(Nrrd, RefusesFloatsThatAreNotANumberAndWindowsThatCannotBe) {
    std::vector<float> values(24, 0.0f);
    const std::string path = file("a.nrrd", Header{.type = "float"}.text() + bytes_of_values(values));
    EXPECT_EQ(refusal({.file = path, .window = {0, 1}, .bits = 17}),
              "a.nrrd: bits is 17, but 1 to 16 are allowed");
    EXPECT_EQ(refusal({.file = path, .window = {1, 1}, .bits = 8}),
              "a.nrrd: window is [1, 1], but needs two finite numbers, the least first");
    EXPECT_EQ(refusal({.file = path, .window = {1}, .bits = 8}),
              "a.nrrd: window has 1 numbers, but needs two: [least, greatest]");

    values[17] = std::numeric_limits<float>::infinity();
    values[13] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(
        refusal({.file = file("b.nrrd", Header{.type = "float"}.text() + bytes_of_values(values)),
                 .window = {0, 1},
                 .bits = 8}),
        "b.nrrd: voxel (1, 0, 1) is nan, but every voxel needs a value: volume.nan = VALUE gives it one");
}

TEST_F(Nrrd, RefusesWindowsScalesAndBitsThatCannotBe) {
    const std::string path =
        file("a.nrrd", Header{.type = "short"}.text() + bytes_of_values(std::vector<std::int16_t>(24, 300)));
    EXPECT_EQ(refusal({.file = path, .window = {-50000, 50000}}),
              "a.nrrd: window [-50000, 50000] spans 100001 stored values, but 2 to 65536 are allowed");
    EXPECT_THAT(refusal({.file = path, .window = {0.1, 0.2}}), HasSubstr("spans 1 stored values"));
    EXPECT_THAT(refusal({.file = path, .window = {0, std::numeric_limits<double>::quiet_NaN()}}),
                HasSubstr("needs two finite numbers"));
    EXPECT_EQ(refusal({.file = path, .value_scale = 0}),
              "a.nrrd: value scale is 0 and offset 0, but both must be finite and the scale not 0");
    EXPECT_EQ(refusal({.file = path, .window = {0, 4095}, .bits = 10}),
              "a.nrrd: bits is 10, but scalars to 4095 need 12");
    EXPECT_EQ(refusal({.file = path, .dims = {4, 3, 2}, .type = "i16"}),
              "a.nrrd: dims and type are for raw files, but this is a NRRD and says its own");
}

TEST_F(Nrrd, RefusesASavedScaleThatIsNoNumber) {
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint value scale:=much\n"}.text() + k24Bytes)),
              "a.nrrd: \"squint value scale\" must be a finite number");
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint scalar bits:=99\n"}.text() + k24Bytes)),
              "a.nrrd: \"squint scalar bits\" is 99, but 1 to 16 are allowed");
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint scalar bits:=4\n"}.text() + k24Bytes)),
              "a.nrrd: bits is 4, but scalars to 23 need 5");
}

// --- Hostile headers ------------------------------------------------------------------------------

/// One change to a header: a byte, a number, a line taken out, doubled or moved, or the end cut off.
std::string mutated(std::string text, std::mt19937& random) {
    const auto below = [&](std::size_t n) {
        return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
    };
    static const char* const kNumbers[] = {
        "-1",   "0", "1e308", "nan", "-inf", "99999999999999999999", "2147483648", "65536",
        "none", "(", ",",     "%d",  ""};
    for (std::size_t changes = 1 + below(4); changes > 0 && !text.empty(); --changes) {
        const std::size_t at = below(text.size());
        const std::size_t line = text.rfind('\n', at) + 1,
                          next = std::min(text.find('\n', at), text.size() - 1) + 1;
        switch (below(7)) {
            case 0:
                text[at] = static_cast<char>(below(256));
                break;
            case 1:
                text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
                break;
            case 2:
                text.insert(at, kNumbers[below(std::size(kNumbers))]);
                break;
            case 3:
                text.erase(line, next - line);
                break;
            case 4:
                text.insert(line, text.substr(line, next - line));
                break;
            case 5:
                text.erase(at, 1 + below(8));
                break;
            case 6: {
                const std::string moved = text.substr(line, next - line);
                text.erase(line, next - line);
                text.insert(text.rfind('\n', below(text.size() + 1)) + 1, moved);
            }
        }
    }
    return text;
}

TEST_F(Nrrd, AHostileHeaderGivesAVolumeOrOneLine) {
    const std::string more =
        "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,-0.75,0) (0,0,2)\nspace origin: "
        "(1,2,3)\n"
        "kinds: domain domain domain\nbyte skip: 0\nline skip: 0\nspace units: \"mm\" \"mm\" "
        "\"mm\"\nkey:=value\n";
    const std::string raw = Header{.type = "short", .more = more}.text() + k24Bytes + k24Bytes;
    const std::string packed =
        Header{.encoding = "gzip", .more = "spacings: 1 2 3\naxis mins: 0 0 0\nlabels: \"x\" \"y\" \"z\"\n"}
            .text() +
        gzip(k24Bytes);
    int volumes = 0, refusals = 0;
    for (unsigned seed = 0; seed < 6000; ++seed) {
        std::mt19937 random(seed);
        const std::string bytes = mutated(seed % 2 ? raw : packed, random);
        try {
            load_volume({.file = file("a.nrrd", bytes)}, {.max_bytes = 1 << 20});
            ++volumes;
        } catch (const InputError& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.find('\n'), std::string::npos) << "seed " << seed << ": " << message;
            EXPECT_THAT(message, StartsWith(folder.string())) << "seed " << seed;
            ++refusals;
        }
    }
    EXPECT_GT(volumes, 500);
    EXPECT_GT(refusals, 500);
}

}  // namespace
}  // namespace squint
