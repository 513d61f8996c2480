#include "tests/core/volume_files.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>

namespace squint {
namespace {

using testing::HasSubstr;

std::string data_file(const std::string& name) {
    const char* folder = std::getenv("SQUINT_DATA");
    return (folder ? std::string(folder) : SQUINT_SOURCE_DIR "/../shared/data") + "/" + name;
}
#define SKIP_WITHOUT(path) \
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there; set SQUINT_DATA"

class LoadVolume : public VolumeFiles {};

TEST_F(LoadVolume, ReadsTheCtHead) {
    const std::string path = data_file("cthead_256x256x113_u16.nrrd");
    SKIP_WITHOUT(path);
    const Volume volume = load_path(path);
    EXPECT_EQ(volume.dims, Index3(256, 256, 113));
    EXPECT_EQ(volume.spacing, Vec3(1, 1, 2));
    EXPECT_EQ(volume.smallest, 0u);
    EXPECT_EQ(volume.largest, 3272u);
    EXPECT_EQ(volume.scalar_bits, 12);
}

TEST_F(LoadVolume, ReadsEveryPublicDataSet) {
    struct Known {
        const char* name;
        Index3 dims;
        std::uint32_t largest;
    };
    for (const Known& known :
         {Known{"aneurism_256x256x256_u8", {256, 256, 256}, 255},
          Known{"bonsai_256x256x256_u8", {256, 256, 256}, 255},
          Known{"engine_256x256x128_u8", {256, 256, 128}, 255},
          Known{"heptane_302x302x302_u8", {302, 302, 302}, 255},
          Known{"lobster_301x324x56_u8", {301, 324, 56}, 255},
          Known{"tooth_103x94x161_u16", {103, 94, 161}, 1300}, Known{"fuel_64x33x32_u8", {64, 33, 32}, 255},
          Known{"neghip_64x64x64_u8", {64, 64, 64}, 255}, Known{"nucleon_41x41x41_u8", {41, 41, 41}, 249}}) {
        const std::string path = data_file(std::string(known.name) + ".nrrd");
        SKIP_WITHOUT(path);
        const Volume volume = load_path(path);
        EXPECT_EQ(volume.dims, known.dims) << known.name;
        EXPECT_EQ(volume.largest, known.largest) << known.name;
    }
}

TEST_F(LoadVolume, AProceduralVolumeTakesOneSizeOrThree) {
    EXPECT_EQ(load({.procedural = "ramp"}).dims, Index3(128, 128, 128));
    EXPECT_EQ(load({.procedural = "ramp", .dims = {8}}).dims, Index3(8, 8, 8));
    const Volume volume = load({.procedural = "ramp",
                                .dims = {8, 4, 2},
                                .spacing = {1, 2, 4},
                                .bits = 12,
                                .value_scale = 2,
                                .value_offset = -7});
    EXPECT_EQ(volume.dims, Index3(8, 4, 2));
    EXPECT_EQ(volume.spacing, Vec3(1, 2, 4));
    EXPECT_EQ(volume.scalar_bits, 12);
    EXPECT_EQ(volume.largest, 4095u);
    EXPECT_EQ(volume.value_scale, 2);
    EXPECT_EQ(volume.value_offset, -7);
}

TEST_F(LoadVolume, RefusesProceduralVolumesThatCannotBe) {
    EXPECT_THAT(refusal({.procedural = "sphare"}),
                HasSubstr("procedural: no field \"sphare\", but phantom, sphere, marschner_lobb, "));
    EXPECT_EQ(refusal({.procedural = "ramp", .dims = {8, 8}}),
              "ramp: dims has 2 numbers, but one or three are allowed");
    EXPECT_EQ(refusal({.procedural = "ramp", .dims = {0}}),
              "ramp: dimensions are 0x0x0, but each must be at least 1");
    EXPECT_EQ(refusal({.procedural = "ramp", .dims = {8}, .bits = 20}),
              "ramp: bits is 20, but 1 to 16 are allowed");
    EXPECT_EQ(refusal({.procedural = "ramp", .dims = {8}}, {.max_bytes = 500}),
              "ramp: 8x8x8 needs 512 bytes of memory, but 500 are allowed");
    EXPECT_THAT(refusal({.procedural = "ramp", .dims = {8}, .spacing = {1, 1}}),
                HasSubstr("spacing has 2 numbers, but needs three"));
    EXPECT_THAT(refusal({.procedural = "ramp", .dims = {8}, .value_scale = 0}),
                HasSubstr("value scale is 0"));
}

TEST_F(LoadVolume, TheContentsAreNamedWhereverTheyLie) {
    const std::string bytes = bytes_of_values(counting<std::uint8_t>(24));
    const VolumeSource one{.file = file("a.raw", bytes), .dims = {4, 3, 2}, .type = "u8"};
    const VolumeSource moved{.file = file("b.raw", "x" + bytes),
                             .dims = {4, 3, 2},
                             .type = "u8",
                             .offset = 1,
                             .spacing = {2, 2, 2}};
    const VolumeSource turned{.file = one.file, .dims = {2, 3, 4}, .type = "u8"};
    EXPECT_EQ(load(one).content_hash, load(moved).content_hash);
    EXPECT_NE(load(one).content_hash, load(turned).content_hash);
}

// Wide loads of the last voxel reach past the end: there must be something to read, also where the file ends
// with its page.
TEST_F(LoadVolume, BytesAfterTheLastVoxelCanBeRead) {
    const std::int64_t page = sysconf(_SC_PAGESIZE);
    const Volume mapped = load({.file = file("a.raw", std::string(static_cast<std::size_t>(page), 'x')),
                                .dims = {page, 1, 1},
                                .type = "u8"});
    const Volume made = load({.procedural = "constant", .dims = {page, 1, 1}});
    for (const Volume* volume : {&mapped, &made}) {
        const volatile unsigned char* after = static_cast<const unsigned char*>(volume->data.get()) + page;
        unsigned sum = 0;
        for (int i = 0; i < 64; ++i) sum += after[i];
        EXPECT_EQ(sum, 0u);
    }
}

}  // namespace
}  // namespace squint
