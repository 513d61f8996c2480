// Rays in lanes: sixteen of them set up, and about where they run.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_rays.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/lanes.h"
#include "pipeline/lanes/kernels.h"
#include "pipeline/ray_setup.h"

#include <bit>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::Word;

alignas(64) constexpr double kColumn[kRays] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) constexpr double kRow[kRays] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
static_assert(lanes::kSide == 4);

HWY_INLINE void store_words(Reals x, Word* to) {
    const hn::Rebind<Word, Reals::D> narrow;
    hn::StoreU(hn::DemoteTo(narrow, x.v), narrow, to);
}

HWY_INLINE void store_values(bool as_floats, Reals x, Word* to) {
    if (!as_floats) return store_words(x, to);
    const hn::Rebind<float, Reals::D> narrow;
    const hn::Rebind<Word, Reals::D> bits;
    hn::StoreU(hn::BitCast(bits, hn::DemoteTo(narrow, x.v)), bits, to);
}

void set_up_rays(const Plan& plan, const lanes::PacketPlace& place, lanes::RayPacket& packet) {
    Reals most(0.0), rays(0.0);
    for (int r = 0; r < kRays; r += Reals::count()) {
        const Reals column = Reals(place.left) + Reals(hn::LoadU(Reals::D(), kColumn + r)),
                    row = Reals(place.top) + Reals(hn::LoadU(Reals::D(), kRow + r));
        RaySetupOf<Reals> ray = set_up_ray(plan, column, row);
        const auto inside = (column < Reals(place.right)) & (row < Reals(place.bottom));
        ray.slabs = choose(inside, ray.slabs, Reals(0.0));
        most = greater(most, ray.slabs);
        rays = rays + choose(Reals(0.0) < ray.slabs, Reals(1.0), Reals(0.0));

        const RayWords<Reals> words = ray_words<Reals>(plan, ray);
        for (std::size_t a = 0; a < 3; ++a) {
            store_values(plan.float32, words.first[a], packet.first[a].v + r);
            store_values(plan.float32, words.last[a], packet.last[a].v + r);
            store_values(plan.float32, words.step[a], packet.step[a].v + r);
            if (!plan.lit) continue;
            store_values(plan.float32, words.view[a], packet.view[a].v + r);
            for (int l = 0; plan.shading.half_per_ray && l < plan.shading.lights; ++l)
                store_values(plan.float32, words.half[static_cast<std::size_t>(l)][a],
                             packet.half[l][a].v + r);
        }
        store_words(words.last_index, packet.last_index.v + r);
        store_values(plan.float32, words.last_length, packet.last_length.v + r);
        store_words(ray.slabs, packet.slabs.v + r);
        hn::StoreU(ray.entry_distance.v, Reals::D(), packet.entry_distance + r);
    }
    packet.most_slabs = static_cast<int>(hn::GetLane(hn::MaxOfLanes(Reals::D(), most.v)));
    packet.rays = static_cast<int>(hn::GetLane(hn::SumOfLanes(Reals::D(), rays.v)));
}

/// 2^bits; never a denormal.
constexpr float float_power(int bits) {
    return std::bit_cast<float>((bits + 127) << 23);
}

void set_course(const Plan& plan, const lanes::EmptySpace& empty, const lanes::RayPacket& rays,
                lanes::RayCourse& course) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const LocationStage& stage = plan.location;
    const auto cell_unit = hn::Set(df, float_power(-stage.location_fraction)),
               step_unit = hn::Set(df, float_power(-stage.direction_fraction));
    const Index3 &n = plan.volume->dims, &low = empty.box.low, &blocks = empty.box.blocks;
    // A location is rounded once, by a last bit at most; floats add their own error.
    course.margin = float_power(-stage.location_fraction) +
                    static_cast<float>(std::max({n.x, n.y, n.z})) * 0x1p-20F + 0x1p-10F;
    const int to_block = stage.location_fraction + lanes::kBlockBits;
    const auto value_at = [&](const Word* from) HWY_ATTR {  // in raw units
        const auto bits = hn::Load(d, from);
        return plan.float32 ? hn::BitCast(df, bits) : hn::ConvertTo(df, bits);
    };
    const auto block_at = [&](const Word* from) HWY_ATTR {
        if (plan.float32)
            return hn::ShiftRight<lanes::kBlockBits>(hn::ConvertTo(d, hn::Mul(value_at(from), cell_unit)));
        return shift_right_same(hn::Load(d, from), to_block);
    };
    for (int r = 0; r < kRays; r += static_cast<int>(hn::Lanes(d))) {
        auto block = hn::Zero(d);  // of the ray's last sample
        for (int a = 2; a >= 0; --a) {
            const auto step = hn::Mul(value_at(rays.step[a].v + r), step_unit);
            hn::Store(hn::Mul(value_at(rays.first[a].v + r), cell_unit), df, course.first[a].v + r);
            hn::Store(step, df, course.step[a].v + r);
            const auto still = hn::Eq(step, hn::Zero(df));
            const auto pace =
                hn::Div(hn::Set(df, 1.0F), hn::Abs(hn::IfThenElse(still, hn::Set(df, 1.0F), step)));
            hn::Store(hn::IfThenElse(still, hn::Set(df, 1e30F), pace), df, course.pace[a].v + r);
            const auto of_all = block_at(rays.last[a].v + r);
            const auto here =
                hn::Min(hn::Max(hn::Sub(of_all, hn::Set(d, static_cast<Word>(low[a]))), hn::Zero(d)),
                        hn::Set(d, static_cast<Word>(blocks[a] - 1)));
            block = hn::Add(hn::Mul(block, hn::Set(d, static_cast<Word>(blocks[a]))), here);
        }
        // The ray's last sample stands at its exit, off P0 + kV by what rounding V adds up to.
        const auto distance =
            hn::And(hn::GatherOffset(d, reinterpret_cast<const Word*>(empty.distance.data()), block),
                    hn::Set(d, 0xff));
        const auto last = hn::Sub(hn::Load(d, rays.last_index.v + r), hn::Set(d, plan.needs_back ? 1 : 0));
        hn::Store(
            hn::IfThenElse(hn::Gt(distance, hn::Zero(d)), hn::Set(d, std::numeric_limits<Word>::max()), last),
            d, course.skippable.v + r);
        hn::Store(hn::Zero(d), d, course.free_until.v + r);
    }
}

}  // namespace

void ray_kernels_of(lanes::StageKernels& kernels) {
    kernels.set_up = &set_up_rays;
    kernels.set_course = &set_course;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void ray_kernels(std::int64_t target, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, ray_kernels_of, kernels)
}
}  // namespace squint::lanes
#endif
