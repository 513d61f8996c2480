#include "tests/core/volume_files.h"

#include <fcntl.h>
#include <unistd.h>

namespace squint {
namespace {

using testing::HasSubstr;

class Raw : public VolumeFiles {
  protected:
    VolumeSource source(const std::string& bytes, const std::string& type = "u8") const {
        return {.file = file("a.raw", bytes), .dims = {4, 3, 2}, .type = type};
    }
};
const std::string k24Bytes = bytes_of_values(counting<std::uint8_t>(24));

TEST_F(Raw, AllTypesAndByteOrdersGiveTheirScalars) {
    const std::vector<std::uint32_t> expected = counting<std::uint32_t>(24);
    EXPECT_EQ(scalars_of(load(source(k24Bytes))), expected);
    for (const bool big : {false, true}) {
        VolumeSource s = source(bytes_of_values(counting<std::uint16_t>(24), big), "u16");
        s.endian = big ? "big" : "little";
        EXPECT_EQ(scalars_of(load(s)), expected);

        std::vector<std::int16_t> signed_values = counting<std::int16_t>(24);
        for (std::int16_t& value : signed_values) value = static_cast<std::int16_t>(value - 1000);
        s = source(bytes_of_values(signed_values, big), "i16");
        s.endian = big ? "big" : "little";
        EXPECT_EQ(scalars_of(load(s)), expected);
        EXPECT_EQ(load(s).value_offset, -1000);

        s = source(bytes_of_values(counting<float>(24), big), "f32");
        s.endian = big ? "big" : "little";
        s.window = {0, 255}, s.bits = 8;
        EXPECT_EQ(scalars_of(load(s)), expected);
    }
}

TEST_F(Raw, AnOffsetAndASpacingAreHonoured) {
    VolumeSource s = source("header!" + bytes_of_values(counting<std::uint16_t>(24)),
                            "u16");  // at an odd place in the file
    s.offset = 7;
    s.spacing = {1, 2, 3};
    EXPECT_EQ(scalars_of(load(s)), counting<std::uint32_t>(24));
    EXPECT_EQ(load(s).spacing, Vec3(1, 2, 3));
}

TEST_F(Raw, RefusesAFileOfAnotherSize) {
    EXPECT_EQ(refusal(source(k24Bytes.substr(1))), "a.raw: 23 bytes of voxels, but 4x3x2 of 8 bits needs 24");
    EXPECT_EQ(refusal(source(k24Bytes, "u16")), "a.raw: 24 bytes of voxels, but 4x3x2 of 16 bits needs 48");
    EXPECT_EQ(refusal(source(k24Bytes + "xxx")),
              "a.raw: 27 bytes of voxels, but 4x3x2 of 8 bits needs 24: oversized");
    VolumeSource s = source(k24Bytes + "xxx");
    s.offset = 2;
    EXPECT_EQ(refusal(s),
              "a.raw: 25 bytes of voxels after the first 2, but 4x3x2 of 8 bits needs 24: oversized");
    s.offset = 3;
    EXPECT_EQ(refusal(s), "no refusal");
    EXPECT_EQ(refusal(source("")), "a.raw: 0 bytes of voxels, but 4x3x2 of 8 bits needs 24");
}

TEST_F(Raw, RefusesSettingsThatCannotBe) {
    VolumeSource s = source(k24Bytes);
    s.dims = {};
    EXPECT_EQ(refusal(s), "a.raw: dims has 0 numbers, but a raw file needs three");
    s.dims = {4, 0, 2};
    EXPECT_EQ(refusal(s), "a.raw: dimensions are 4x0x2, but each must be at least 1");
    s.dims = {4, -3, -2};
    EXPECT_EQ(refusal(s), "a.raw: dimensions are 4x-3x-2, but each must be at least 1");
    s.dims = {std::int64_t{1} << 62, std::int64_t{1} << 62, std::int64_t{1} << 62};
    EXPECT_THAT(refusal(s), HasSubstr("but less than 2^62 bytes of voxels are allowed"));
    s = source(k24Bytes, "u12");
    EXPECT_EQ(
        refusal(s),
        "a.raw: type is \"u12\", but a raw file needs one of u8, i8, u16, i16, u32, i32, u64, i64, f32, f64");
    s = source(k24Bytes);
    s.endian = "middle";
    EXPECT_EQ(refusal(s), "a.raw: endian is \"middle\", but little and big are allowed");
    s = source(k24Bytes);
    s.offset = -1;
    EXPECT_EQ(refusal(s), "a.raw: offset is -1, but 0 to the file's size of 24 is allowed");
    s.offset = 25;
    EXPECT_EQ(refusal(s), "a.raw: offset is 25, but 0 to the file's size of 24 is allowed");
    s = source(k24Bytes);
    s.spacing = {1, -1, 1};
    EXPECT_EQ(refusal(s), "a.raw: spacing is 1 -1 1, but each must be finite and greater than 0");
    s.file = (folder / "none.raw").string();
    EXPECT_EQ(refusal(s), "none.raw: cannot read: No such file or directory");
}

TEST_F(Raw, APipeIsNoFile) {
    ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
    EXPECT_EQ(refusal({.file = (folder / "pipe").string(), .dims = {1, 1, 1}, .type = "u8"}),
              "pipe: cannot read: not a regular file");
}

// 2^32 + 2^16 voxels in a sparse file: takes no disk, and the last voxel's index needs 33 bits.
TEST_F(Raw, MoreThanFourBillionVoxelsAreMapped) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "takes a minute under the address sanitizer";
#endif
    const std::string path = file("big.raw", "");
    const Index3 dims(65536, 65537, 1);
    const int descriptor = open(path.c_str(), O_WRONLY);
    const std::int64_t size = dims.x * dims.y;
    const unsigned char last = 200, above = 100;
    ASSERT_EQ(ftruncate(descriptor, size), 0);
    ASSERT_EQ(pwrite(descriptor, &last, 1, size - 1), 1);
    ASSERT_EQ(pwrite(descriptor, &above, 1, std::int64_t{1} << 32), 1);
    close(descriptor);
    const Volume volume =
        load({.file = path, .dims = {dims.x, dims.y, dims.z}, .type = "u8"}, {.max_bytes = 1 << 20});
    EXPECT_EQ(volume.at(dims.x - 1, dims.y - 1, 0), 200u);
    EXPECT_EQ(volume.at(0, 65536, 0), 100u);
    EXPECT_EQ(volume.at(0, 0, 0), 0u);
    EXPECT_EQ(volume.largest, 200u);
}

}  // namespace
}  // namespace squint
