// Rays in lanes: sets up sixteen, and computes about where they run.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_rays.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packet_rays-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::Word;

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
        const RaySetupOf<Reals> ray = set_up_packet_rays(plan, place, r);
        most = greater(most, ray.slabs);
        rays = rays + one_where_met(ray);

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
    packet.rays = static_cast<int>(sum_of(rays));
}

/// 2^bits; never a denormal.
constexpr float float_power(int bits) {
    return std::bit_cast<float>((bits + 127) << 23);
}

/// The group of 2x2 pixels to which ray r of a packet belongs.
constexpr int beam_of(int r) {
    return r % lanes::kSide / 2 + r / lanes::kSide / 2 * 2;
}

/// Along a course, the largest distance over the axes from it to any ray of a beam: it is at an end, because
/// both are straight.
float farthest_off(const lanes::RayPacket& rays, const float (*first)[kRays], const float (*step)[kRays],
                   const lanes::RayCourse& course) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const auto last = hn::Set(df, static_cast<float>(rays.most_slabs));
    auto off = hn::Zero(df);
    for (int a = 0; a < 3; ++a) {
        lanes::RealRow middle, middle_step;
        std::fill_n(middle.v, kRays, course.first[0][a]);
        std::fill_n(middle_step.v, kRays, course.step[0][a]);
        for (int r = 0; course.beams > 1 && r < kRays; ++r)
            middle.v[r] = course.first[beam_of(r)][a], middle_step.v[r] = course.step[beam_of(r)][a];
        for (int r = 0; r < kRays; r += static_cast<int>(hn::Lanes(d))) {
            const auto begin = hn::Sub(hn::Load(df, first[a] + r), hn::Load(df, middle.v + r)),
                       apart = hn::Sub(hn::Load(df, step[a] + r), hn::Load(df, middle_step.v + r));
            const auto here = hn::Max(hn::Abs(begin), hn::Abs(hn::MulAdd(apart, last, begin)));
            const auto there = hn::RebindMask(df, hn::Gt(hn::Load(d, rays.slabs.v + r), hn::Zero(d)));
            off = hn::Max(off, hn::IfThenElseZero(there, here));
        }
    }
    return hn::GetLane(hn::MaxOfLanes(df, off));
}

void set_course(const Plan& plan, const lanes::EmptySpace& empty, const lanes::RayPacket& rays,
                lanes::RayCourse& course) {
    using lanes::RayCourse;
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const LocationStage& stage = plan.location;
    const Index3 &n = plan.volume->dims, &low = empty.box.low;
    const auto cell_unit = hn::Set(df, float_power(-stage.location_fraction - lanes::kBlockBits)),
               step_unit = hn::Set(df, float_power(-stage.direction_fraction - lanes::kBlockBits));
    const auto value_at = [&](const Word* from) HWY_ATTR {  // in raw units
        const auto bits = hn::Load(d, from);
        return plan.float32 ? hn::BitCast(df, bits) : hn::ConvertTo(df, bits);
    };
    alignas(64) float first[3][kRays], step[3][kRays];  // blocks
    for (int a = 0; a < 3; ++a)
        for (int r = 0; r < kRays; r += static_cast<int>(hn::Lanes(d))) {
            const auto p = hn::Mul(value_at(rays.first[a].v + r), cell_unit);
            hn::Store(hn::Sub(p, hn::Set(df, static_cast<float>(low[a]))), df, first[a] + r);
            hn::Store(hn::Mul(value_at(rays.step[a].v + r), step_unit), df, step[a] + r);
        }
    // Midway between the first and the last ray of each beam.
    const auto set_beams = [&](int beams) {
        int one[RayCourse::kMostBeams], other[RayCourse::kMostBeams];
        std::fill_n(one, beams, -1);
        int any = 0;
        for (int r = 0; r < kRays; ++r) {
            if (rays.slabs.v[r] == 0) continue;
            const int beam = beams == 1 ? 0 : beam_of(r);
            if (one[beam] < 0) one[beam] = r;
            any = other[beam] = r;
        }
        course.beams = beams;
        for (int beam = 0; beam < beams; ++beam) {
            if (one[beam] < 0) one[beam] = other[beam] = any;
            for (int a = 0; a < 3; ++a) {
                course.first[beam][a] = 0.5F * (first[a][one[beam]] + first[a][other[beam]]);
                course.step[beam][a] = 0.5F * (step[a][one[beam]] + step[a][other[beam]]);
            }
        }
        return farthest_off(rays, first, step, course);
    };
    // A location is rounded once, by at most a last bit; the last one lies at its exit, off P0 + kV by the
    // sum of V's roundings; floats add errors of their own.
    const float margin = (float_power(-stage.location_fraction) + static_cast<float>(stage.drift()) +
                          static_cast<float>(std::max({n.x, n.y, n.z})) * 0x1p-20F + 0x1p-10F) /
                         lanes::kBlock;
    constexpr float kNearest = 0.5F;  // from a place to the nearest corner of blocks
    float reach = set_beams(1);
    if (reach + margin > kNearest) reach = set_beams(RayCourse::kMostBeams);
    const float off = reach + margin + kNearest;
    float fastest = 0x1p-10F;  // blocks a step
    for (int beam = 0; beam < course.beams; ++beam)
        for (const float v : course.step[beam]) fastest = std::max(fastest, std::abs(v));
    const float stride = std::max(std::floor(1 / fastest), 1.0F);
    const auto blocks_for = [](float distance) {
        return distance < 250 ? static_cast<int>(std::ceil(distance)) : 256;
    };
    constexpr float kWidest = 0.49F;
    course.apart = reach + margin <= kWidest ? reach + margin : -1;
    course.enough = blocks_for(off);
    course.stride = static_cast<int>(stride);
    course.enough_of_stride = blocks_for(off + 0.5F * (stride - 1) * fastest);
    course.window = -RayCourse::kWindow, course.may_be_seen = 0;
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
