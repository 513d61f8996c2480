// Cells of differences: when they are built, what they take, and the same bits with them and without.
#include "pipeline/machines/lanes/lit_cells.h"

#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "pipeline/stages/faces.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/detect_targets.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace squint::lanes {
namespace {

using testing::HasSubstr;
using Settings = std::vector<std::string>;

Scene scene_of(const Settings& more) {
    Settings all{"volume.dims=[21, 18, 23]",
                 "classification.method=pc",
                 "shading.model=blinn_phong",
                 "image.width=96",
                 "image.height=80",
                 "camera.height=30",
                 "transfer_function.points=[[0, 1, 1, 1, 0], [1500, 1, 1, 1, 0], [4095, 1, 0.5, 0.2, 0.05]]"};
    all.insert(all.end(), more.begin(), more.end());
    return scene_with(built_in_scene(), all);
}
std::shared_ptr<const Volume> volume_of(const Scene& scene) {
    return test::volume_of(scene);
}
/// Whether this machine has vectors: plain C++ takes gradients from voxels.
bool has_vectors() {
    return find_target("") < HWY_EMU128;
}
const std::string kOtherFunction = "transfer_function.points=[[0, 1, 1, 1, 0.1], [4095, 0.2, 0.4, 1, 0.1]]";

TEST(LitCells, HoldTheDifferencesAtEachCorner) {
    for (const char* dims : {"[21, 18, 23]", "[1, 9, 12]", "[10, 1, 11]", "[9, 10, 1]"})
        for (const char* bits : {"8", "12"}) {
            const auto volume =
                volume_of(scene_of({std::string("volume.dims=") + dims, std::string("volume.bits=") + bits}));
            const Index3 n = volume->dims;
            CellBlocks blocks(*volume, CellBlocks::bytes_of_all(*volume, CellContent::differences),
                              CellContent::differences);
            blocks.build([](std::int64_t) { return true; });
            const auto voxel = [&](const Index3& p) {
                const std::int64_t at =
                    (voxel_at(p.z, n.z) * n.y + voxel_at(p.y, n.y)) * n.x + voxel_at(p.x, n.x);
                return volume->type == ScalarType::u8
                           ? int{static_cast<const std::uint8_t*>(volume->data.get())[at]}
                           : int{static_cast<const std::uint16_t*>(volume->data.get())[at]};
            };
            const std::vector<std::int32_t> slots = blocks.slots();
            int wrong = 0, nonzero = 0;
            for (std::int64_t z = 0; z < std::max<std::int64_t>(n.z - 1, 1); ++z)
                for (std::int64_t y = 0; y < std::max<std::int64_t>(n.y - 1, 1); ++y)
                    for (std::int64_t x = 0; x < std::max<std::int64_t>(n.x - 1, 1); ++x) {
                        const Index3 b = blocks.blocks();
                        const std::int64_t slot =
                            slots[static_cast<std::size_t>((z / 8 * b.y + y / 8) * b.x + x / 8)];
                        ASSERT_GE(slot, 0);
                        std::int16_t cell[3][8];
                        std::memcpy(cell,
                                    blocks.data() + (slot + (z % 8 * 8 + y % 8) * 8 + x % 8) *
                                                        CellBlocks::kDifferenceBytes,
                                    sizeof(cell));
                        for (int axis = 0; axis < 3; ++axis)
                            for (int i = 0; i < 8; ++i) {
                                Index3 ahead(x + i % 2, y + i / 2 % 2, z + i / 4), behind = ahead;
                                ++ahead[axis], --behind[axis];
                                wrong += cell[axis][i] != voxel(ahead) - voxel(behind);
                                nonzero += cell[axis][i] != 0;
                            }
                    }
            EXPECT_EQ(wrong, 0) << dims << ' ' << bits;
            EXPECT_GT(nonzero, 100);
        }
}

TEST(LitCells, AreBuiltInTheMidstOfAPictureOnceTheyHavePaidAndThenKept) {
    if (!has_vectors()) GTEST_SKIP();
    const Scene scene = scene_of({});
    const auto volume = volume_of(scene);
    RenderOptions model;
    model.path = Path::model;
    const std::string expected = picture_hash(render(make_plan(scene, volume), model).image);
    for (const int threads : {1, 7}) {
        const auto again = volume_of(scene);
        RenderOptions options;
        options.tile = 8, options.threads = threads;
        const auto picture = [&](const Settings& more) {
            return render(make_plan(scene_of(more), again), options);
        };
        // Few gradients; then enough of them; then a function that shows more.
        EXPECT_THAT(picture({"image.width=60", "image.height=56"}).statistics.why,
                    HasSubstr("; lit cells after "));
        bool built = false;
        for (int i = 0; i < 20 && !built; ++i) {
            const Rendering frame = picture({});
            EXPECT_EQ(picture_hash(frame.image), expected);
            built = frame.statistics.why.find("; lit cells of ") != std::string::npos;
        }
        EXPECT_TRUE(built);
        EXPECT_EQ(picture_hash(picture({}).image), expected);
        EXPECT_THAT(picture({"image.width=60", "image.height=56"}).statistics.why,
                    HasSubstr("; lit cells of "));
        const Settings other{kOtherFunction, "image.width=60", "image.height=56"};
        const Rendering changed = picture(other);
        EXPECT_THAT(changed.statistics.why, HasSubstr("; lit cells after "));
        EXPECT_EQ(picture_hash(changed.image),
                  picture_hash(render(make_plan(scene_of(other), volume), model).image));
    }
}

TEST(LitCells, TakeTheRoomThatCellsLeave) {
    if (!has_vectors()) GTEST_SKIP();
    RenderOptions options;
    options.layout = LayoutRule::linear;
    const Scene scene = scene_of({});
    const Rendering linear = render(make_plan(scene, volume_of(scene)), options);
    EXPECT_THAT(linear.statistics.why, HasSubstr("; no lit cells: the volume lies as it is"));
    options.layout = LayoutRule::cells;
    std::int64_t fitting = 0;
    // 27 blocks; cells alone take 27 * 8192 bytes of it.
    for (const std::int64_t room : {0, 100'000, 240'000, 260'000, 300'000, 600'000, 1'200'000}) {
        options.layout_bytes = room;
        const Rendering cells = render(make_plan(scene, volume_of(scene)), options);
        EXPECT_EQ(picture_hash(cells.image), picture_hash(linear.image)) << room;
        EXPECT_LE(cells.statistics.bytes, room);
        if (room <= 240'000) {
            const char* reason = room == 0 ? "the volume lies as it is" : "there is no room for them";
            EXPECT_THAT(cells.statistics.why, HasSubstr(std::string("; no lit cells: ") + reason)) << room;
        }
        fitting += cells.statistics.why.find("; lit cells of ") != std::string::npos;
    }
    EXPECT_GE(fitting, 3);
}

TEST(LitCells, HaveTheModelsBitsInThinVolumesAndByEveryMethod) {
    for (const char* dims : {"[21, 18, 23]", "[1, 20, 20]", "[20, 1, 20]", "[20, 20, 1]"})
        for (const char* method : {"pc", "pips", "pi2d", "pi1d", "leg"})
            for (const bool skip : {true, false}) {
                const Scene scene = scene_of(
                    {std::string("volume.dims=") + dims, std::string("classification.method=") + method,
                     "classification.table_size=64", "image.width=24", "image.height=20"});
                const Plan plan = make_plan(scene, volume_of(scene));
                RenderOptions options;
                options.path = Path::model;
                const std::string expected = picture_hash(render(plan, options).image);
                options = {}, options.layout = LayoutRule::cells, options.skip = skip;
                const Rendering found = render(plan, options);
                EXPECT_EQ(picture_hash(found.image), expected) << dims << ' ' << method << ' ' << skip;
                if (!has_vectors()) continue;
                EXPECT_THAT(found.statistics.why, HasSubstr("; lit cells of ")) << dims << ' ' << method;
            }
}

}  // namespace
}  // namespace squint::lanes
