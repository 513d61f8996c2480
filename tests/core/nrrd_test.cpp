#include "core/procedural.h"
#include "tests/core/volume_files.h"

#include <teem/nrrd.h>

#include <cmath>
#include <limits>
#include <random>

/// teem keeps a few dozen bytes of some headers that it refuses; what it does with ours is measured here, not
/// its memory.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libteem";
}

namespace squint {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// A header of 4x3x2 voxels, to be changed line by line.
struct Header {
    std::string type = "uchar", sizes = "4 3 2", encoding = "raw", more = "";
    std::string text() const {
        return "NRRD0004\n# a comment\ntype: " + type + "\ndimension: 3\nsizes: " + sizes +
               "\nencoding: " + encoding + "\nendian: little\n" + more + "\n";
    }
};
const std::string k24Bytes = bytes_of_values(counting<std::uint8_t>(24));

class Nrrd : public VolumeFiles {};

// --- What is read
// ----------------------------------------------------------------------------------------------------------

template <class T>
class NrrdOfType : public VolumeFiles {};
using AllTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t,
                                std::int32_t, std::uint64_t, std::int64_t, float, double>;
TYPED_TEST_SUITE(NrrdOfType, AllTypes);

/// Of 24 voxels -3, -2, ... or 0, 1, ... the values come back, from raw bytes of either order and from text.
TYPED_TEST(NrrdOfType, ValuesComeBackRawBigEndianAndAsText) {
    constexpr const char* names[] = {"uint8",  "int8",  "uint16", "int16",
                                     "uint32", "int32", "uint64", "int64"};
    const bool is_signed = std::is_signed_v<TypeParam>;
    const std::string type = std::is_same_v<TypeParam, float> ? "float"
                             : std::is_same_v<TypeParam, double>
                                 ? "double"
                                 : names[2 * std::countr_zero(sizeof(TypeParam)) + is_signed];
    std::vector<TypeParam> values(24);
    std::string text;
    for (std::size_t i = 0; i < 24; ++i) {
        values[i] = static_cast<TypeParam>(static_cast<int>(i) - (is_signed ? 3 : 0));
        text += std::to_string(static_cast<int>(values[i])) + (i % 5 == 4 ? "\n" : ", ");
    }
    const auto header = [&](const char* encoding, const char* endian) {
        return "NRRD0004\ntype: " + type + "\ndimension: 3\nsizes: 4 3 2\nencoding: " + encoding +
               "\nendian: " + endian + "\n\n";
    };
    for (const std::string& path :
         {this->file("l.nrrd", header("raw", "little") + bytes_of_values(values)),
          this->file("b.nrrd", header("raw", "big") + bytes_of_values(values, true)),
          this->file("t.nrrd", header("ascii", "little") + text)}) {
        const Volume volume = this->load_path(path);
        const std::vector<std::uint32_t> scalars = this->scalars_of(volume);
        for (std::size_t i = 0; i < 24; ++i)
            EXPECT_NEAR(volume.value_scale * scalars[i] + volume.value_offset, static_cast<double>(values[i]),
                        volume.value_scale < 1 ? volume.value_scale / 2 : 0)
                << path << " " << i;
    }
}

TEST_F(Nrrd, TextOfTheWrongNumberOfNumbersOrBeyondItsTypeIsRefused) {
    const auto with = [&](const std::string& text) {
        return refusal_of(file("a.nrrd", Header{.sizes = "2 2 1", .encoding = "ascii"}.text() + text));
    };
    EXPECT_EQ(with("1 2 3 4\n"), "no refusal");
    EXPECT_EQ(with("1 2 3         "), "a.nrrd: text of voxels: 3 numbers; 4 numbers are needed");
    EXPECT_EQ(with("1 2 3 4 5"), "a.nrrd: text of voxels: more than 4 numbers; 4 numbers are needed");
    EXPECT_EQ(
        with("1 2 256 4"),
        "a.nrrd: text of voxels: number 2 is \"256\", which its type does not hold; 4 numbers are needed");
    EXPECT_EQ(with("1 2"), "a.nrrd: 3 bytes of text hold at most 2 numbers, but 2x2x1 of 8 bits needs 4");
}

TEST_F(Nrrd, WideIntegersBeyondSixteenBitsNeedAWindowOrAreRounded) {
    std::vector<std::int32_t> values(24, 1000);
    values[5] = -70000;
    const std::string path = file("a.nrrd", Header{.type = "int"}.text() + bytes_of_values(values));
    EXPECT_EQ(refusal_of(path),
              "a.nrrd: stored values from -70000 to 1000 need 17 bits, but 16 are allowed: window = [least, "
              "greatest] "
              "keeps some, and with bits = 16 rounds more");
    EXPECT_EQ(load({.file = path, .window = {0, 4095}}).at(0, 0, 0), 1000u);
    const Volume rounded = load({.file = path, .bits = 8});
    EXPECT_EQ(rounded.at(1, 1, 0), 0u);
    EXPECT_EQ(rounded.at(0, 0, 0), 255u);
    EXPECT_EQ(rounded.value_offset, -70000);
}

TEST_F(Nrrd, FloatsWithoutAWindowTakeTheirFiniteRangeAtSixteenBits) {
    std::vector<float> values(24, 0.5f);
    values[2] = -1, values[3] = 3;
    values[4] = std::numeric_limits<float>::infinity();
    const VolumeSource source{.file =
                                  file("a.nrrd", Header{.type = "float"}.text() + bytes_of_values(values))};
    EXPECT_THAT(
        notes_of(source),
        ElementsAre(HasSubstr("float voxels were quantised to 16 bits over [-1, 3], their finite range"),
                    HasSubstr("1 of 24 voxels lie outside")));
    const Volume volume = load(source);
    EXPECT_EQ(volume.scalar_bits, 16);
    EXPECT_EQ(volume.at(2, 0, 0), 0u);
    EXPECT_EQ(volume.at(3, 0, 0), 65535u);
    EXPECT_EQ(volume.at(0, 1, 0), 65535u);

    values[7] = std::numeric_limits<float>::quiet_NaN();
    const std::string path = file("n.nrrd", Header{.type = "float"}.text() + bytes_of_values(values));
    EXPECT_EQ(load({.file = path, .nan = -5}).at(3, 1, 0), 0u);
    EXPECT_EQ(load({.file = path, .nan = -5}).value_offset, -5);
    EXPECT_THAT(refusal_of(path), HasSubstr("volume.nan = VALUE"));
    const std::vector<float> none(24, std::numeric_limits<float>::quiet_NaN());
    EXPECT_THAT(refusal_of(file("o.nrrd", Header{.type = "float"}.text() + bytes_of_values(none))),
                HasSubstr("voxel (0, 0, 0) is nan"));
}

TEST_F(Nrrd, AComponentIsChosenByAKeyWhereverItsAxisLies) {
    const std::string head = "NRRD0004\ntype: uchar\ndimension: 4\nencoding: raw\n";
    const std::string first =
                          file("a.nrrd",
                               head + "sizes: 3 2 2 2\nkinds: 3-color domain domain domain\n\n" + k24Bytes),
                      last = file("b.nrrd",
                                  head + "sizes: 2 2 2 3\nkinds: domain domain domain list\n\n" + k24Bytes),
                      inner = file("c.nrrd",
                                   head +
                                       "sizes: 2 3 2 2\nspace dimension: 3\nspace directions: (1,0,0) none "
                                       "(0,1,0) (0,0,1)\n\n" +
                                       k24Bytes);
    EXPECT_EQ(refusal_of(first),
              "a.nrrd: 3 numbers a voxel (colours, a vector or times), but one is allowed: "
              "volume.component = 0 to 2 chooses it");
    EXPECT_EQ(refusal({.file = first, .component = 3}),
              "a.nrrd: volume.component is 3, but 0 to 2 are allowed");
    EXPECT_THAT(scalars_of(load({.file = first, .component = 1})), ElementsAre(1, 4, 7, 10, 13, 16, 19, 22));
    EXPECT_THAT(scalars_of(load({.file = last, .component = 1})), ElementsAre(8, 9, 10, 11, 12, 13, 14, 15));
    EXPECT_THAT(scalars_of(load({.file = inner, .component = 1})), ElementsAre(2, 3, 8, 9, 14, 15, 20, 21));
}

TEST_F(Nrrd, ItsSpaceIsTurnedToLpsWhereAskedFor) {
    const std::string path =
        file("a.nrrd",
             "NRRD0004\ntype: uchar\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 3 2\n"
             "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (10,20,30)\nencoding: raw\n\n" +
                 k24Bytes);
    EXPECT_EQ(load_path(path).space, "right-anterior-superior");
    EXPECT_EQ(load_path(path).origin, Vec3(10, 20, 30));
    const Volume lps = load({.file = path, .space = "lps"});
    EXPECT_EQ(lps.space, "left-posterior-superior");
    EXPECT_EQ(lps.origin, Vec3(-13, -24, 30));
    EXPECT_EQ(lps.at(0, 0, 0), 11u);  // the last along x and y
    EXPECT_EQ(
        refusal({.file = file("b.nrrd", Header{}.text() + k24Bytes), .space = "lps"}),
        "b.nrrd: volume.space is lps, but the file's axes are not named; allowed: right-anterior-superior, "
        "left-anterior-superior and left-posterior-superior");
}

TEST_F(Nrrd, RawBytesAreTheScalars) {
    const Volume volume = load_path(file("a.nrrd", Header{.more = "spacings: 1 0.5 2\n"}.text() + k24Bytes));
    EXPECT_EQ(volume.dims, Index3(4, 3, 2));
    EXPECT_EQ(volume.spacing, Vec3(1, 0.5, 2));
    EXPECT_EQ(volume.type, ScalarType::u8);
    EXPECT_EQ(volume.scalar_bits, 8);
    EXPECT_EQ(volume.smallest, 0u);
    EXPECT_EQ(volume.largest, 23u);
    EXPECT_EQ(scalars_of(volume), counting<std::uint32_t>(24));
}

TEST_F(Nrrd, GzipDetachedAndLineEndsOfDosGiveTheSameVolume) {
    const std::string hash = load_path(file("a.nrrd", Header{}.text() + k24Bytes)).content_hash;
    EXPECT_EQ(load_path(file("b.nrrd", Header{.encoding = "gzip"}.text() + gzip(k24Bytes))).content_hash,
              hash);
    EXPECT_EQ(load_path(file("c.nrrd", Header{.encoding = "gzip"}.text() + gzip(k24Bytes.substr(0, 7)) +
                                           gzip(k24Bytes.substr(7))))
                  .content_hash,
              hash);

    std::filesystem::create_directory(folder / "data");
    file("data/voxels.raw", k24Bytes);
    file("voxels.raw.gz", gzip(k24Bytes));
    EXPECT_EQ(load_path(file("d.nhdr", Header{.more = "data file: data/voxels.raw\n"}.text())).content_hash,
              hash);
    EXPECT_EQ(
        load_path(file("e.nhdr", Header{.encoding = "gzip", .more = "datafile: ./voxels.raw.gz\n"}.text()))
            .content_hash,
        hash);

    std::string dos;
    for (const char c : Header{}.text()) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
    EXPECT_EQ(load_path(file("f.nrrd", dos + k24Bytes)).content_hash, hash);
}

TEST_F(Nrrd, SkipsLinesAndBytes) {
    const auto with = [&](const std::string& more, const std::string& data, const char* encoding = "raw") {
        return scalars_of(
            load_path(file("a.nrrd", Header{.encoding = encoding, .more = more}.text() + data)));
    };
    const std::vector<std::uint32_t> expected = counting<std::uint32_t>(24);
    EXPECT_EQ(with("line skip: 2\n", "one\ntwo\n" + k24Bytes), expected);
    EXPECT_EQ(with("byte skip: 5\n", "12345" + k24Bytes), expected);
    EXPECT_EQ(with("byte skip: -1\n", "anything" + k24Bytes), expected);
    EXPECT_EQ(with("byte skip: 5\n", gzip("12345" + k24Bytes), "gzip"), expected);
    // The last bytes, after a header of another format (.nii.gz).
    for (const std::size_t before : {0, 352, 100000})
        EXPECT_EQ(with("byte skip: -1\n", gzip(std::string(before, 'x') + k24Bytes), "gzip"), expected);
}

TEST_F(Nrrd, BothByteOrdersGiveTheSameVolume) {
    const auto values = counting<std::uint16_t>(24);
    std::string big = Header{.type = "ushort"}.text();
    big.replace(big.find("little"), 6, "big");
    const Volume a = load_path(file("a.nrrd", Header{.type = "ushort"}.text() + bytes_of_values(values)));
    const Volume b = load_path(file("b.nrrd", big + bytes_of_values(values, true)));
    EXPECT_EQ(a.content_hash, b.content_hash);
    EXPECT_EQ(a.type, ScalarType::u16);
}

TEST_F(Nrrd, SignedDataStartAtTheirMeasuredLeast) {
    std::vector<std::int16_t> values(24, -1000);
    values[5] = -1024, values[6] = 2000;
    const std::string path = file("a.nrrd", Header{.type = "short"}.text() + bytes_of_values(values));
    const Volume volume = load_path(path);
    EXPECT_EQ(volume.smallest, 0u);
    EXPECT_EQ(volume.largest, 3024u);
    EXPECT_EQ(volume.scalar_bits, 12);
    EXPECT_EQ(volume.value_scale * volume.at(2, 1, 0) + volume.value_offset, 2000);
    EXPECT_EQ(load_path(file("b.nrrd", Header{.type = "short", .encoding = "gzip"}.text() +
                                           gzip(bytes_of_values(values))))
                  .content_hash,
              volume.content_hash);
}

TEST_F(Nrrd, TheFullSignedRangeFits) {
    std::vector<std::int16_t> values(24, 0);
    values[0] = -32768, values[23] = 32767;
    const Volume volume = load_path(file("a.nrrd", Header{.type = "short"}.text() + bytes_of_values(values)));
    EXPECT_EQ(volume.largest, 65535u);
    EXPECT_EQ(volume.scalar_bits, 16);
    EXPECT_EQ(volume.value_offset, -32768);
}

TEST_F(Nrrd, AWindowClampsAndSaysSo) {
    std::vector<std::int16_t> values(24, 0);
    values[0] = -3000, values[1] = -1000, values[2] = 1000, values[3] = 5000;
    VolumeSource source{.file = file("a.nrrd", Header{.type = "short"}.text() + bytes_of_values(values)),
                        .window = {-1000, 3000}};
    const Volume volume = load(source);
    EXPECT_THAT((std::vector{volume.at(0, 0, 0), volume.at(1, 0, 0), volume.at(2, 0, 0), volume.at(3, 0, 0)}),
                ElementsAre(0u, 0u, 2000u, 4000u));
    EXPECT_EQ(volume.scalar_bits, 12);
    EXPECT_EQ(volume.value_offset, -1000);
    EXPECT_THAT(notes_of(source),
                ElementsAre(HasSubstr("2 of 24 voxels lie outside the window [-1000, 3000]")));

    source.value_scale = 0.5,
    source.value_offset = -500;  // the window is in these units: stored values -1000 to 7000
    EXPECT_EQ(load(source).value_offset, -1000);
    EXPECT_EQ(load(source).scalar_bits, 13);
    EXPECT_EQ(load(source).at(3, 0, 0), 6000u);
}

TEST_F(Nrrd, BitsFollowTheDataAndStartAtEight) {
    const auto bits_with = [&](std::uint16_t largest) {
        std::vector<std::uint16_t> values(24, 0);
        values[7] = largest;
        return load_path(file("a.nrrd", Header{.type = "ushort"}.text() + bytes_of_values(values)))
            .scalar_bits;
    };
    EXPECT_EQ(bits_with(3), 8);
    EXPECT_EQ(bits_with(255), 8);
    EXPECT_EQ(bits_with(256), 9);
    EXPECT_EQ(bits_with(3272), 12);
    EXPECT_EQ(bits_with(4096), 13);
    EXPECT_EQ(bits_with(65535), 16);
}

TEST_F(Nrrd, FloatsAreRoundedToTheLevelsOfTheirWindow) {
    std::vector<float> values(24, 0.0f);
    values[0] = -1, values[1] = 1, values[2] = 0.5f, values[3] = 0.499f, values[4] = 2, values[5] = -7;
    const VolumeSource source{
        .file = file("a.nrrd", Header{.type = "float"}.text() + bytes_of_values(values)),
        .window = {-1, 1},
        .bits = 2};
    const Volume volume =
        load(source);  // levels at -1, -1/3, 1/3, 1: 0.5 lies nearest to 1/3; 0 half-way goes up
    EXPECT_EQ(volume.scalar_bits, 2);
    EXPECT_EQ(volume.value_offset, -1);
    EXPECT_EQ(volume.value_scale, 2.0 / 3);
    const std::vector<std::uint32_t> scalars = scalars_of(volume);
    EXPECT_THAT((std::vector(scalars.begin(), scalars.begin() + 7)), ElementsAre(0u, 3u, 2u, 2u, 3u, 0u, 2u));
    EXPECT_THAT(notes_of(source), ElementsAre(HasSubstr("float voxels were quantised to 2 bits over [-1, 1]"),
                                              HasSubstr("2 of 24 voxels lie outside the window")));
}

// --- Geometry
// --------------------------------------------------------------------------------------------------------------

TEST_F(Nrrd, DirectionsGiveSpacingAndOrigin) {
    const Volume volume = load_path(file(
        "a.nrrd", Header{.more = "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.75,0) "
                                 "(0,0,2)\nspace origin: (-10,20,3.5)\n"}
                          .text() +
                      k24Bytes));
    EXPECT_EQ(volume.spacing, Vec3(0.5, 0.75, 2));
    EXPECT_EQ(volume.origin, Vec3(-10, 20, 3.5));
}

// Every permutation and flip of the axes: the voxel that the file puts at a world position is found at that
// position.
TEST_F(Nrrd, PermutedAndFlippedAxesLandWhereTheHeaderSays) {
    std::array<int, 3> order{0, 1, 2};
    do {
        for (int flips = 0; flips < 8; ++flips) {
            std::string directions = "space dimension: 3\nspace directions:";
            Vec3 direction[3];
            for (int axis = 0; axis < 3; ++axis) {
                direction[axis] = Vec3(0);
                direction[axis][order[axis]] = (flips >> axis & 1 ? -1 : 1) * (axis + 1.0);
                directions += " (" + std::to_string(direction[axis].x) + "," +
                              std::to_string(direction[axis].y) + "," + std::to_string(direction[axis].z) +
                              ")";
            }
            const VolumeSource source{
                .file = file("a.nrrd",
                             Header{.more = directions + "\nspace origin: (10,20,30)\n"}.text() + k24Bytes)};
            const Volume volume = load(source);
            for (int i = 0; i < 24; ++i) {
                const Vec3 world = Vec3(10, 20, 30) + direction[0] * (i % 4) + direction[1] * (i / 4 % 3) +
                                   direction[2] * (i / 12);
                const Vec3 voxel = volume.voxel_from_world(world);  // exact: small integers
                EXPECT_EQ(volume.at(std::int64_t(voxel.x), std::int64_t(voxel.y), std::int64_t(voxel.z)),
                          unsigned(i))
                    << directions;
            }
            const bool plain = flips == 0 && order == std::array{0, 1, 2};
            EXPECT_EQ(notes_of(source).size(), plain ? 0u : 1u) << directions;
        }
    } while (std::next_permutation(order.begin(), order.end()));
}

TEST_F(Nrrd, AxisMinsAreTheOrigin) {
    const Volume nodes =
        load_path(file("a.nrrd", Header{.more = "spacings: 2 2 2\naxis mins: 1 2 3\n"}.text() + k24Bytes));
    EXPECT_EQ(nodes.origin, Vec3(1, 2, 3));
    const Volume cells = load_path(file(
        "b.nrrd",
        Header{.more = "spacings: 2 2 2\naxis mins: 1 2 3\ncenters: cell cell cell\n"}.text() + k24Bytes));
    EXPECT_EQ(cells.origin, Vec3(2, 3, 4));
}

TEST_F(Nrrd, MinsAndMaxsAreSpacingsBetweenCellFacesOrNodes) {
    const auto with = [&](const std::string& more) {
        return load_path(file("a.nrrd", Header{.more = more}.text() + k24Bytes));
    };
    const std::string ends = "axis mins: 1 2 3\naxis maxs: 13 8 7\n";
    const Volume cells = with(ends);
    EXPECT_EQ(cells.spacing, Vec3(3, 2, 2)) << "as teem has it where the file does not say";
    EXPECT_EQ(cells.origin, Vec3(2.5, 3, 4));
    EXPECT_EQ(with(ends + "centers: cell cell cell\n").origin, cells.origin);
    const Volume nodes = with(ends + "centers: node node node\n");
    EXPECT_EQ(nodes.spacing, Vec3(4, 3, 4));
    EXPECT_EQ(nodes.origin, Vec3(1, 2, 3));
    EXPECT_EQ(with(ends + "spacings: 3 2 2\n").spacing, Vec3(3, 2, 2));

    const auto refused = [&](const std::string& more) {
        return refusal_of(file("a.nrrd", Header{.more = more}.text() + k24Bytes));
    };
    EXPECT_EQ(refused(ends + "spacings: 3 2 1\n"),
              "a.nrrd: axis 2 has spacing 1, but its min and max make it 2");
    EXPECT_THAT(refused("axis maxs: 13 8 7\n"), HasSubstr("axis 0 runs from nan to 13"));
    EXPECT_THAT(refused("axis mins: 1 2 3\naxis maxs: 13 2 7\n"), HasSubstr("axis 1 runs from 2 to 2"));
    EXPECT_EQ(refusal_of(file("b.nrrd",
                              Header{.sizes = "24 1 1",
                                     .more = "axis mins: 0 0 0\naxis maxs: 1 1 1\ncenters: node node node\n"}
                                      .text() +
                                  k24Bytes)),
              "b.nrrd: axis 1 has one node, but axis mins and axis maxs need two");
}

TEST_F(Nrrd, ASpaceThatIsNotDicomsIsNoted) {
    const std::string directions = "space directions: (1,0,0) (0,1,0) (0,0,1)\n";
    const auto notes = [&](const std::string& space) {
        return notes_of({.file = file("a.nrrd", Header{.more = "space: " + space + "\n" + directions}.text() +
                                                    k24Bytes)});
    };
    EXPECT_THAT(notes("right-anterior-superior"), ElementsAre(HasSubstr("turned by half a turn about z")));
    EXPECT_THAT(notes("left-posterior-superior"), IsEmpty());
}

TEST_F(Nrrd, GzipDataCutBeforeTheirChecksumAreRefused) {
    const std::string packed = gzip(k24Bytes);
    for (std::size_t cut = 1; cut <= 8; ++cut)
        EXPECT_EQ(refusal_of(file("a.nrrd",
                                  Header{.encoding = "gzip"}.text() + packed.substr(0, packed.size() - cut))),
                  "a.nrrd: compressed data end before their checksum: the file is cut short, compress or "
                  "copy it anew")
            << cut;
    std::string wrong = packed;
    wrong[wrong.size() - 5] ^= 1;
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + wrong)), HasSubstr("damaged"));
    const std::string two = gzip(k24Bytes.substr(0, 7)) + gzip(k24Bytes.substr(7));
    EXPECT_THAT(refusal_of(file("a.nrrd", Header{.encoding = "gzip"}.text() + two.substr(0, two.size() - 3))),
                HasSubstr("before their checksum"));
}

TEST_F(Nrrd, APaddingValueIsNotedWithTheWindowThatLeavesItOut) {
    std::vector<std::int16_t> values(24, 0);
    for (std::size_t i = 0; i < 24; ++i) values[i] = static_cast<std::int16_t>(i * 100 - 1000);
    const auto notes = [&](const VolumeSource& how = {}) {
        VolumeSource source = how;
        source.file = file("a.nrrd", Header{.type = "short"}.text() + bytes_of_values(values));
        return notes_of(source);
    };
    EXPECT_THAT(notes(), IsEmpty());
    values[3] = values[4] = -32768;
    EXPECT_THAT(notes(),
                ElementsAre(AllOf(HasSubstr("2 voxels are -32768, apart from all others (-1000 to 1300)"),
                                  HasSubstr("volume.window = [-1000, 1300] leaves it out"))));
    EXPECT_THAT(notes({.window = {-1000, 1300}}), ElementsAre(HasSubstr("were clamped")));
    values[3] = values[4] = 32767;
    EXPECT_THAT(notes(), ElementsAre(HasSubstr("2 voxels are 32767")));
    values[3] = -2000, values[4] = -2000;
    EXPECT_THAT(notes(), IsEmpty()) << "entries of one level";
}

TEST_F(Nrrd, UnitsOfTheSceneWinOverTheFilesEachForItself) {
    const std::string path = file(
        "a.nrrd", Header{.more = "squint value scale:=2\nsquint value offset:=-100\n"}.text() + k24Bytes);
    const auto units = [&](const VolumeSource& source) {
        const Volume volume = load(source);
        return std::pair(volume.value_scale, volume.value_offset);
    };
    EXPECT_EQ(units({.file = path}), std::pair(2.0, -100.0));
    EXPECT_EQ(units({.file = path, .value_scale = 1, .value_offset = 0}), std::pair(1.0, 0.0));
    EXPECT_EQ(units({.file = path, .value_scale = 1}), std::pair(1.0, -100.0));
    EXPECT_EQ(units({.file = path, .value_offset = 0}), std::pair(2.0, 0.0));
}

TEST_F(Nrrd, BytesOfAFileNeverReachAMessage) {
    const std::string message = refusal_of(file("a.nrrd",
                                                "NRRD\x9b"
                                                "31mX\n\n"));
    EXPECT_EQ(message, "a.nrrd: NRRD header: version is \"NRRD?31mX\", but NRRD0001 to NRRD0005 are allowed");
    EXPECT_THAT(refusal_of(file("a.nhdr", Header{.more = "data file: \xc3\xbc/../\x1b\n"}.text())),
                HasSubstr("data file is \"\\u00FC/../?\""));
}

TEST_F(Nrrd, ALeftHandedSpaceIsNoted) {
    const std::string more = "space: left-anterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n";
    EXPECT_THAT(notes_of({.file = file("a.nrrd", Header{.more = more}.text() + k24Bytes)}),
                ElementsAre(HasSubstr("left-handed")));
}

// --- What is refused
// -------------------------------------------------------------------------------------------------------

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

// --- Round trips
// -------------------------------------------------------------------------------------------------------------

TEST_F(Nrrd, ASavedVolumeComesBackWhole) {
    Volume volume = make_procedural(*find_procedural("sphere"), {9, 7, 5}, 12, {0.1, 1.0 / 3, 2});
    volume.origin = {-1.25, 1e-7, 1e6};
    volume.value_scale = 0.1, volume.value_offset = -1024;
    const std::string path = (folder / "a.nrrd").string();
    save_nrrd(volume, path);
    const Volume back = load_path(path);
    EXPECT_EQ(back.dims, volume.dims);
    EXPECT_EQ(back.spacing, volume.spacing);
    EXPECT_EQ(back.origin, volume.origin);
    EXPECT_EQ(back.type, volume.type);
    EXPECT_EQ(back.scalar_bits, volume.scalar_bits);
    EXPECT_EQ(back.value_scale, volume.value_scale);
    EXPECT_EQ(back.value_offset, volume.value_offset);
    EXPECT_EQ(back.smallest, volume.smallest);
    EXPECT_EQ(back.largest, volume.largest);
    EXPECT_EQ(back.content_hash, volume.content_hash);
    EXPECT_THAT(notes_of({.file = path}), IsEmpty());
    EXPECT_EQ(refusal({.file = path}, {.max_bytes = 0}), "no refusal");  // mapped: saved voxels are aligned
    EXPECT_EQ(load({.file = path, .value_scale = 2}).value_scale,
              2);  // a scene's own units go before the file's
}

TEST_F(Nrrd, OthersReadWhatWeSave) {
    Volume volume = make_procedural(*find_procedural("marschner_lobb"), {6, 5, 4}, 16, {0.5, 0.75, 2});
    volume.origin = {1, 2, 3};
    const std::string path = (folder / "a.nrrd").string();
    save_nrrd(volume, path);
    ::Nrrd* theirs = nrrdNew();
    ASSERT_EQ(nrrdLoad(theirs, path.c_str(), nullptr), 0);
    EXPECT_EQ(theirs->type, nrrdTypeUShort);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(theirs->axis[axis].size, static_cast<std::size_t>(volume.dims[axis]));
        EXPECT_EQ(theirs->axis[axis].spaceDirection[axis], volume.spacing[axis]);
        EXPECT_EQ(theirs->spaceOrigin[axis], volume.origin[axis]);
    }
    EXPECT_EQ(std::memcmp(theirs->data, volume.data.get(), 6 * 5 * 4 * 2), 0);
    nrrdNuke(theirs);
}

TEST_F(Nrrd, RefusesASavedScaleThatIsNoNumber) {
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint value scale:=much\n"}.text() + k24Bytes)),
              "a.nrrd: \"squint value scale\" must be a finite number");
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint scalar bits:=99\n"}.text() + k24Bytes)),
              "a.nrrd: \"squint scalar bits\" is 99, but 1 to 16 are allowed");
    EXPECT_EQ(refusal_of(file("a.nrrd", Header{.more = "squint scalar bits:=4\n"}.text() + k24Bytes)),
              "a.nrrd: bits is 4, but scalars to 23 need 5");
}

// --- Hostile headers
// -----------------------------------------------------------------------------------------------------------

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
