// A volume of more than 2^32 voxels in a sparse file: its far corner is rendered as a small volume with the
// same corner is, by every path and layout, and what was never written costs neither time nor memory.
#include "core/volume_data.h"
#include "core/volume_source.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/own_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace squint {
namespace {

constexpr std::int64_t kWidth = 2048, kDepth = 1040, kSide = 40;
static_assert(kWidth * kWidth * kDepth > std::int64_t{1} << 32);

/// The far corner: voxels of 40^3, zero in its first eight planes along each axis, noise behind them.
std::vector<std::uint8_t> corner_voxels() {
    std::mt19937 random(7);
    std::vector<std::uint8_t> voxels;
    for (std::int64_t z = 0; z < kSide; ++z)
        for (std::int64_t y = 0; y < kSide; ++y)
            for (std::int64_t x = 0; x < kSide; ++x) {
                const auto noise = static_cast<std::uint8_t>(random());
                voxels.push_back(std::min({x, y, z}) < 8 ? 0 : noise);
            }
    return voxels;
}

std::int64_t resident_bytes() {
    std::int64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return pages * sysconf(_SC_PAGESIZE);
}

class LargeVolume : public ::testing::Test {
  protected:
    void SetUp() override {
        const int file = open(path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
        ASSERT_GE(file, 0);
        const bool sparse = ftruncate(file, kWidth * kWidth * kDepth) == 0;
        bool written = true;
        const std::vector<std::uint8_t> voxels = corner_voxels();
        for (std::int64_t row = 0; sparse && row < kSide * kSide; ++row) {
            const std::int64_t y = kWidth - kSide + row % kSide, z = kDepth - kSide + row / kSide;
            written = written && pwrite(file, voxels.data() + row * kSide, kSide,
                                        (z * kWidth + y) * kWidth + kWidth - kSide) == kSide;
        }
        struct stat status {};
        ASSERT_EQ(fstat(file, &status), 0);
        close(file);
        if (!sparse || !written || status.st_blocks * 512 > 64 << 20)
            GTEST_SKIP() << "the file system of " << folder_ << " has no sparse files of 4 GiB";
    }

    std::string path() const { return (folder_ / "large.raw").string(); }

    std::shared_ptr<const Volume> large() const {
        const VolumeSource source{.file = path(), .dims = {kWidth, kWidth, kDepth}, .type = "u8"};
        return std::make_shared<const Volume>(load_volume(source, {.max_bytes = 1 << 20}));
    }
    /// The corner alone, where it stands in the world.
    static std::shared_ptr<const Volume> corner() {
        Volume volume;
        volume.dims = Index3(kSide);
        volume.origin = Vec3(kWidth - kSide, kWidth - kSide, kDepth - kSide);
        const auto voxels = std::make_shared<std::vector<std::uint8_t>>(corner_voxels());
        voxels->resize(voxels->size() + kPaddingBytes);
        volume.data = std::shared_ptr<const void>(voxels, voxels->data());
        measure(volume);
        return std::make_shared<const Volume>(volume);
    }

    const test::OwnFolder folder_;
};

/// A look at the corner's middle, through 100 voxels of nothing.
std::vector<std::string> view(bool lit, bool perspective, const std::string& method) {
    std::vector<std::string> overrides{
        "transfer_function.points=[[0, 1, 1, 1, 0], [60, 1, 0.5, 0.2, 0], [255, 0.1, 0.6, 1, 0.3]]",
        "transfer_function.unit_distance=1",
        "image.width=24",
        "image.height=24",
        "sampling.step=0.5",
        "output.fixed=true",
        "camera.center=[2031, 2031, 1023]",
        "camera.eye=[1971, 1951, 973]",
        "classification.method=" + method,
        std::string("shading.model=") + (lit ? "blinn_phong" : "none")};
    overrides.push_back(perspective ? "camera.projection=perspective" : "camera.height=30");
    return overrides;
}

TEST_F(LargeVolume, TheFarCornerIsRenderedAsAVolumeOfItsOwn) {
    [[maybe_unused]] const std::int64_t before = resident_bytes();
    const std::shared_ptr<const Volume> far = large(), near = corner();
    EXPECT_EQ(far->largest, near->largest);
    EXPECT_TRUE(far->mapped);
    for (const auto& [lit, perspective, method] :
         {std::tuple(false, false, "pc"), std::tuple(true, true, "pips")}) {
        std::vector<std::string> overrides = view(lit, perspective, method);
        overrides.push_back("clip.low=[2012, 2012, 1004]");
        Scene scene = scene_with(built_in_scene(), overrides);
        const Plan plan = make_plan(scene, far);
        // The same words, though a small volume's locations need fewer bits.
        for (std::size_t w = 0; w < kWires; ++w)
            scene.precision.override_[w] = to_string(plan.specs[static_cast<Wire>(w)]);
        RenderOptions model;
        model.path = Path::model;
        const Rendering expected = render(make_plan(scene, near), model);
        EXPECT_GT(expected.statistics.samples, 10000);
        const std::string hash = picture_hash(expected.image);
        EXPECT_EQ(picture_hash(render(plan, model).image), hash) << method;
        for (const LayoutRule layout : {LayoutRule::linear, LayoutRule::cells})
            for (const bool skip : {true, false}) {
                RenderOptions options;
                options.path = Path::lanes, options.layout = layout, options.skip = skip;
                const Rendering found = render(plan, options);
                EXPECT_EQ(picture_hash(found.image), hash)
                    << method << ' ' << found.statistics.layout << ' ' << skip;
            }
    }
    // Tables of where the whole volume's cells lie take 34 MB each; the voxels take 4 GiB.
#ifndef __SANITIZE_ADDRESS__  // whose own bytes about each of ours are resident, too
    EXPECT_LE(resident_bytes() - before, 256 << 20);
#endif
}

TEST_F(LargeVolume, WithoutAClipBoxItsEmptyPartIsSkippedUnread) {
    const std::int64_t before = resident_bytes();
    const std::shared_ptr<const Volume> far = large();
    const Scene scene = scene_with(built_in_scene(), view(false, true, "pc"));
    const Plan plan = make_plan(scene, far);
    std::string hash;
    for (const LayoutRule layout : {LayoutRule::linear, LayoutRule::cells}) {
        RenderOptions options;
        options.path = Path::lanes, options.layout = layout, options.layout_bytes = 340'000'000;
        const Rendering found = render(plan, options);
        EXPECT_LE(found.statistics.bytes, options.layout_bytes);
        EXPECT_LT(found.statistics.visited, found.statistics.samples / 2);
        if (hash.empty()) hash = picture_hash(found.image);
        EXPECT_EQ(picture_hash(found.image), hash);
    }
    EXPECT_LE(resident_bytes() - before,
              std::int64_t{1} << 30);  // 4 bytes for each of 68 million blocks, tables of cells and pages
    RenderOptions model;
    model.path = Path::model;
    EXPECT_EQ(picture_hash(render(plan, model).image), hash);
}

// Tables of 270 MB say which blocks are empty: a limit that has no room for them costs time, and no bit.
TEST_F(LargeVolume, WithoutRoomForTheTablesOfItsBlocksItIsRenderedWithoutThem) {
    const Scene scene = scene_with(built_in_scene(), view(false, true, "pc"));
    const Plan plan = make_plan(scene, large());
    RenderOptions options;
    const std::string hash = picture_hash(render(plan, options).image);
    options.layout_bytes = 1 << 20;
    for (const LayoutRule layout : {LayoutRule::linear, LayoutRule::cells}) {
        options.layout = layout;
        const Rendering found = render(plan, options);
        EXPECT_EQ(picture_hash(found.image), hash);
        EXPECT_LE(found.statistics.bytes, options.layout_bytes);
        EXPECT_GE(found.statistics.visited, found.statistics.samples) << found.statistics.why;
    }
}

// Two files of the same voxels have one name, whatever of them lies on the disk.
TEST_F(LargeVolume, AHoleIsMeasuredAsTheZerosItStandsFor) {
    const std::int64_t width = 1024, height = 1024, depth = 9;  // pieces of 4 MiB, the last one short
    const std::string sparse = (folder_ / "sparse.raw").string(), full = (folder_ / "full.raw").string();
    std::string bytes(static_cast<std::size_t>(width * height * depth), '\0');
    bytes[5000000] = 'a', bytes[5000001] = 'b';
    std::ofstream(full, std::ios::binary) << bytes;
    std::ofstream(sparse, std::ios::binary).seekp(5000000) << "ab";
    std::filesystem::resize_file(sparse, bytes.size());
    for (const char* type : {"u8", "u16"}) {
        VolumeSource source{.file = full, .dims = {width, height, depth}, .type = type};
        if (source.type == "u16") source.dims[0] /= 2;
        const Volume whole = load_volume(source);
        source.file = sparse;
        const Volume holed = load_volume(source);
        EXPECT_TRUE(whole.zeros.empty());
        EXPECT_FALSE(holed.zeros.empty());
        EXPECT_EQ(holed.content_hash, whole.content_hash);
        EXPECT_EQ(holed.largest, whole.largest);
        const std::int64_t voxel = 5000000 / static_cast<std::int64_t>(holed.scalar_bytes());
        EXPECT_FALSE(holed.known_zero(voxel, voxel + 1));
        EXPECT_FALSE(holed.known_zero(0, holed.voxels()));
        EXPECT_TRUE(holed.known_zero(0, 1000));
        EXPECT_TRUE(holed.known_zero(holed.voxels() - 1000, holed.voxels()));
    }
}

}  // namespace
}  // namespace squint
