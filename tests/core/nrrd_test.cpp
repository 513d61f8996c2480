// What is read of a NRRD file, and that a saved volume comes back.
#include "core/procedural.h"
#include "tests/core/nrrd_files.h"

#include <teem/nrrd.h>

#include <limits>

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

// --- What is read ---------------------------------------------------------------------------------

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

// --- Geometry -------------------------------------------------------------------------------------

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

// --- Round trips ----------------------------------------------------------------------------------

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

}  // namespace
}  // namespace squint
