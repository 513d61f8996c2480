// Packets that look at nothing are filled, not cast: the same picture, the same counts, and most of an empty
// picture left out.  Pictures of R G B A alone, for all other channels are cast.
#include "pipeline/machines/lanes/screen_mask.h"

#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/render.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

// Something small, somewhere in the volume: most packets see nothing.
const std::vector<std::string> kSmall{
    "volume.dims=[61, 47, 53]", "volume.procedural=sphere", "image.width=150", "image.height=130",
    "transfer_function.points=[[0, 1, 1, 1, 0], [3300, 1, 0.5, 0.2, 0], [3400, 1, 0.5, 0.2, 0.3], "
    "[4095, 0.2, 0.4, 1, 0.2]]"};

Plan plan_of(std::vector<std::string> settings, const std::vector<std::string>& more) {
    settings.insert(settings.begin(), "classification.method=pc");
    settings.insert(settings.end(), more.begin(), more.end());
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}

const std::vector<std::vector<std::string>>& views() {
    static const std::vector<std::vector<std::string>> all{
        {},
        {"camera.azimuth=0", "camera.elevation=0"},
        {"camera.azimuth=90", "camera.elevation=90"},
        {"camera.azimuth=217", "camera.elevation=-41", "camera.height=21"},
        {"camera.projection=perspective"},
        {"camera.projection=perspective", "camera.fov_y=100", "camera.azimuth=211"},
        {"camera.projection=perspective", "camera.eye=[30, 23, 26]", "camera.center=[31, 40, 22]"},
        {"camera.projection=perspective", "camera.eye=[-7, 3, 5]", "camera.center=[30, 23, 26]"},
        {"clip.low=[5, 20, 3]", "clip.high=[21, 40, 50]"},
        {"volume.dims=[61, 1, 53]", "camera.azimuth=3", "camera.elevation=2"},
        {"classification.method=pips", "sampling.step=1.7"},
        {"classification.method=pi1d", "compositing.form=back_to_front"},
        {"compositing.form=alpha", "precision.preset=wide"},
        {"precision.preset=float32"},
        {"shading.model=blinn_phong", "volume.spacing=[1, 0.6, 1.9]"},
    };
    return all;
}

TEST(ScreenMask, PicturesAndCountsAreTheModels) {
    for (const std::vector<std::string>& view : views()) {
        const Plan plan = plan_of(kSmall, view);
        RenderOptions golden;
        golden.path = Path::model;
        const Rendering model = render(plan, golden);
        for (const std::string& target : lanes::target_names())
            for (const int tile : {32, 13}) {  // packets that start anywhere
                RenderOptions options;
                options.target = target, options.tile = tile;
                const Rendering found = render(plan, options);
                const std::string where = (view.empty() ? "" : view.front()) + ", " + target;
                ASSERT_EQ(found.statistics.path, "lanes") << where;
                EXPECT_EQ(found.statistics.samples, model.statistics.samples) << where;
                EXPECT_EQ(found.statistics.rays, model.statistics.rays) << where;
                for (std::size_t c = 0; c < 4; ++c)
                    EXPECT_EQ(std::memcmp(found.image.channels[c].values.data(),
                                          model.image.channels[c].values.data(),
                                          sizeof(float) * model.image.channels[c].values.size()),
                              0)
                        << where << ", channel " << c;
            }
    }
}

TEST(ScreenMask, HoldsWhatIsSeenAndLittleElse) {
    int seen_in_all = 0;
    for (const std::vector<std::string>& view : views()) {
        const Plan plan = plan_of(kSmall, view);
        if (plan.needs_back) continue;  // their visible blocks reach farther
        const auto space = lanes::find_empty_space(
            *lanes::block_ranges(*plan.volume, lanes::all_blocks_of(*plan.volume)), plan.entries, 0);
        const lanes::ScreenMask mask = lanes::visible_packets(plan, lanes::VisibleSurface(space));
        RenderOptions options;
        options.path = Path::model;
        const Image image = render(plan, options).image;
        int seen = 0, held = 0, packets = 0;
        for (int y = 0; y < image.height; y += lanes::kSide)
            for (int x = 0; x < image.width; x += lanes::kSide) {
                bool sees = false;
                for (int j = y; j < std::min(y + lanes::kSide, image.height); ++j)
                    for (int i = x; i < std::min(x + lanes::kSide, image.width); ++i)
                        sees = sees ||
                               image.channels[3].values[static_cast<std::size_t>(j * image.width + i)] > 0;
                const bool holds = mask.holds(x, y);
                EXPECT_TRUE(holds || !sees) << x << ' ' << y;
                ++packets, seen += sees, held += holds;
            }
        const bool is_inside = plan.camera.projection == Projection::perspective && plan.scene.camera.eye;
        seen_in_all += seen;
        if (!is_inside) {
            EXPECT_LT(held, 2 * seen + 100) << (view.empty() ? "" : view.front());
            EXPECT_LT(held, packets);
        }
    }
    EXPECT_GT(seen_in_all, 300);
}

TEST(ScreenMask, AnEmptyPictureIsFilledAndCounted) {
    const Plan plan = plan_of(kSmall, {"transfer_function.points=[[0, 1, 1, 1, 0], [4095, 1, 1, 1, 0]]"});
    RenderOptions golden;
    golden.path = Path::model;
    const Rendering model = render(plan, golden), found = render(plan, RenderOptions{});
    EXPECT_EQ(found.statistics.samples, model.statistics.samples);
    EXPECT_EQ(found.statistics.visited, 0);
    for (const Channel& channel : found.image.channels)
        for (const float value : channel.values) ASSERT_EQ(value, 0);
}

}  // namespace
}  // namespace squint
