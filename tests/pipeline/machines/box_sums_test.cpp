// The fast path's sums over 5^3 voxels, by bricks: the model's, wherever they are asked for.
#include "pipeline/machines/lanes/exaggerated.h"
#include "pipeline/slab-inl.h"
#include "tests/truth/reference_cases.h"

#include <gtest/gtest.h>

#include <random>

namespace squint {
namespace {

using namespace cases;

TEST(BoxSums, AreTheModels) {
    std::mt19937 random(7);
    for (const int bits : {8, 16})
        // Smaller than a box, smaller than a brick, over bricks' ends, and more bricks than are kept along an axis.
        for (const Index3& dims : {Index3(2, 3, 1), Index3(7, 5, 6), Index3(19, 16, 9), Index3(80, 3, 40)}) {
            Volume volume = *volume_of(dims, bits, Vec3(1), [&](const Index3&) {
                return static_cast<int>(random() % (1U << bits));
            });
            if (bits == 8) {
                const auto* words = static_cast<const std::uint16_t*>(volume.data.get());
                const auto bytes = std::make_shared<std::vector<std::uint8_t>>();
                for (std::int64_t i = 0; i < dims.x * dims.y * dims.z; ++i)
                    bytes->push_back(static_cast<std::uint8_t>(words[i]));
                volume.data = std::shared_ptr<const void>(bytes, bytes->data());
                volume.type = ScalarType::u8;
            }
            const HWY_NAMESPACE::FromVolume model{volume};
            lanes::BoxSums sums(volume);
            for (int i = 0; i < 400; ++i) {
                std::array<std::int64_t, 3> cell;
                for (int a = 0; a < 3; ++a)
                    cell[static_cast<std::size_t>(a)] =
                        static_cast<std::int64_t>(random() % static_cast<unsigned>(dims[a]));
                ASSERT_EQ(sums.box_sums(cell).voxel, model.box_sums(cell).voxel) << bits << ' ' << dims.x;
            }
        }
}

}  // namespace
}  // namespace squint
