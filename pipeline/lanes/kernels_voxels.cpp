// Between stages 1 and 2: where samples' voxels lie, and their way into registers.  And what of a ray need
// not be sampled at all.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_voxels.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/lane_tables.h"
#include "pipeline/lanes/kernels.h"

#include <algorithm>
#include <cstring>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::Samples;
using lanes::VoxelSource;
using lanes::Word;
constexpr int kLanes = static_cast<int>(HWY_LANES(Word));

// Offsets in voxels from a cell's lower corner to its four pairs along x.
struct PairOffsets {
    std::int64_t pair[4];
    explicit PairOffsets(const Volume& volume) {
        const std::int64_t y = volume.dims.y > 1 ? volume.dims.x : 0,
                           z = volume.dims.z > 1 ? volume.dims.x * volume.dims.y : 0;
        pair[0] = 0, pair[1] = y, pair[2] = z, pair[3] = y + z;
    }
};

// A pair of voxels as two 16-bit words.
HWY_INLINE Word pair_at(const std::uint16_t* voxels) {
    Word both;
    std::memcpy(&both, voxels, 4);
    return both;
}
HWY_INLINE Word pair_at(const std::uint8_t* voxels) {
    std::uint16_t both;
    std::memcpy(&both, voxels, 2);
    return (both & 0xff) | (both >> 8) << 16;
}

// ------------------------------------------------------------------------------------------------ the volume
// itself

template <class T>
HWY_INLINE const T* corner_of(const Volume& volume, const Samples& s, int i) {
    return static_cast<const T*>(volume.data.get()) + s.cell[0].v[i] +
           volume.dims.x * (s.cell[1].v[i] + volume.dims.y * s.cell[2].v[i]);
}
template <class T>
void prefetch_linear(const VoxelSource& source, int from, int to, Samples& s) {
    const PairOffsets offsets(*source.volume);
    // Every second step will do, for neighbours share cache lines.
    for (int row = from; row < to; row += 2)
        for (int i = row * kRays; i < (row + 1) * kRays; ++i)
            for (const std::int64_t offset : offsets.pair)
                __builtin_prefetch(corner_of<T>(*source.volume, s, i) + offset);
}
template <class T>
void fetch_linear(const VoxelSource& source, int from, int to, Samples& s) {
    const PairOffsets offsets(*source.volume);
    for (int i = from * kRays; i < to * kRays; ++i) {
        const T* corner = corner_of<T>(*source.volume, s, i);
        for (int p = 0; p < 4; ++p) s.pair[p].v[i] = pair_at(corner + offsets.pair[p]);
    }
}

// ------------------------------------------------------------------------------------------------ cells

template <class T>
void prefetch_cells(const VoxelSource& source, int from, int to, Samples& s) {
    const hn::ScalableTag<Word> d;
    constexpr int kBits = lanes::CellBlocks::kBits;
    const auto in_block = hn::Set(d, (1 << kBits) - 1), row = hn::Set(d, static_cast<Word>(source.blocks.x)),
               slice = hn::Set(d, static_cast<Word>(source.blocks.x * source.blocks.y));
    for (int at = from * kRays; at < to * kRays; at += kLanes) {
        const auto x = hn::Load(d, s.cell[0].v + at), y = hn::Load(d, s.cell[1].v + at),
                   z = hn::Load(d, s.cell[2].v + at);
        const auto block = hn::Add(
            hn::ShiftRight<kBits>(x),
            hn::Add(hn::Mul(row, hn::ShiftRight<kBits>(y)), hn::Mul(slice, hn::ShiftRight<kBits>(z))));
        const auto inside = [&](auto p) { return hn::And(p, in_block); };
        const auto offset =
            hn::Or(inside(x), hn::Or(hn::ShiftLeft<kBits>(inside(y)), hn::ShiftLeft<2 * kBits>(inside(z))));
        const auto slot = hn::GatherIndex(d, source.slots.data(), block);
        hn::Store(hn::Or(slot, offset), d, s.place.v + at);  // -1 stays -1
    }
    // A packet's outermost rays stand for those between them.
    constexpr int kOutermost[] = {0, 3, 12, 15};
    for (int i = from * kRays; i < to * kRays; i += kRays)
        for (const int ray : kOutermost)
            __builtin_prefetch(source.cells + std::int64_t{std::max(s.place.v[i + ray], 0)} *
                                                  static_cast<std::int64_t>(8 * sizeof(T)));
}
template <class T>
void fetch_cells(const VoxelSource& source, int from, int to, Samples& s) {
    const hn::ScalableTag<Word> d;
    const PairOffsets offsets(*source.volume);
    T spare[kLanes][8];
    const auto spared = [&](int lane, int at) {  // a cell that is not there is put together here
        const T* corner = corner_of<T>(*source.volume, s, at + lane);
        for (int p = 0; p < 4; ++p)
            spare[lane][2 * p] = corner[offsets.pair[p]],
                            spare[lane][2 * p + 1] = corner[offsets.pair[p] + 1];
        return reinterpret_cast<const std::uint8_t*>(spare[lane]);
    };
    const auto load = [](auto&& address) {
        if constexpr (sizeof(T) == 1)
            return load_widened_quads(address);
        else
            return load_quads(address);
    };
    for (int at = from * kRays; at < to * kRays; at += kLanes) {
        const Word* place = s.place.v + at;
        const auto there = [&](int lane) {
            return source.cells + std::int64_t{place[lane]} * static_cast<std::int64_t>(8 * sizeof(T));
        };
        const bool all_there = hn::AllFalse(d, hn::Lt(hn::Load(d, place), hn::Zero(d)));
        const auto pairs =
            all_there ? load(there)
                      : load([&](int lane) { return place[lane] < 0 ? spared(lane, at) : there(lane); });
        for (std::size_t p = 0; p < 4; ++p) store(Lanes<Word>{pairs[p]}, s.pair[p].v + at);
    }
}

// ------------------------------------------------------------------------------------------------ samples to
// be lit

int gather_lit_samples(const Plan& plan, const lanes::RayPacket& rays, const lanes::PixelPacket& pixels,
                       int steps, const Samples& s, lanes::LitSamples& lit) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d);
    const bool per_ray = plan.shading.half_per_ray || plan.shading.model == ShadingModel::phong;
    const bool from_samples = plan.gradient_from_samples();
    int count = 0;
    for (int at = 0; at < steps * kRays; at += kLanes) {
        const int r = at % kRays;
        const auto within = hn::Gt(hn::Load(d, rays.slabs.v + r), hn::Set(d, s.first + at / kRays));
        const auto wanted = hn::And(hn::And(hn::Gt(hn::Load(d, s.alpha.v + at), zero), within),
                                    hn::Gt(hn::Load(d, pixels.active.v + r), zero));
        const auto many = hn::CountTrue(d, wanted);
        if (many == 0) continue;
        // Whole vectors are stored; what lies behind the last sample is written over by the next.
        const auto pack = [&](const Word* from, lanes::Batch& to) {
            hn::StoreU(hn::Compress(hn::Load(d, from), wanted), d, to.v + count);
        };
        hn::StoreU(hn::Compress(hn::Iota(d, at), wanted), d, lit.from.v + count);
        for (int end = 0; end < (plan.needs_back ? 2 : 1); ++end)
            for (int a = 0; a < 3; ++a) {
                if (from_samples) {
                    pack(s.location[a].v + at + end * kRays, lit.location[end][a]);
                    continue;
                }
                pack(s.cell[a].v + at + end * kRays, lit.cell[end][a]);
                pack(s.weight[a].v + at + end * kRays, lit.weight[end][a]);
            }
        for (int c = 0; c < 3; ++c) pack(s.color[c].v + at, lit.color[c]);
        pack(s.alpha.v + at, lit.alpha);
        for (int a = 0; per_ray && a < 3; ++a) {
            pack(rays.view[a].v + r, lit.view[a]);
            for (int l = 0; l < plan.shading.lights; ++l) pack(rays.half[l][a].v + r, lit.half[l][a]);
        }
        count += static_cast<int>(many);
    }
    return count;
}

// Rows of four voxels a gradient wants, of the 4x4 about a cell: bit z * 4 + y.
constexpr unsigned rows_of(GradientRule rule) {
    return rule == GradientRule::analytic ? 0x0660U : rule == GradientRule::central ? 0x6ff6U : 0xffffU;
}

/// Four voxels along x at each lane's element of a row, as two words of pairs: one gather of four bytes or
/// two of eight.
#if HWY_TARGET != HWY_SCALAR
constexpr bool kGathersRows = true;
HWY_INLINE auto gathered_row(const std::uint8_t* row, hn::Vec<hn::ScalableTag<Word>> first) {
    const hn::ScalableTag<Word> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const auto four = hn::GatherOffset(d, reinterpret_cast<const Word*>(row), first);
    const auto upper = hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, four)));
    const auto spread = [&](auto two) HWY_ATTR {
        return hn::And(hn::Or(two, hn::ShiftLeft<8>(two)), hn::Set(d, 0x00ff00ff));
    };
    return std::array<hn::Vec<decltype(d)>, 2>{spread(hn::And(four, hn::Set(d, 0xffff))), spread(upper)};
}
HWY_INLINE auto gathered_row(const std::uint16_t* row, hn::Vec<hn::ScalableTag<Word>> first) {
    const hn::ScalableTag<Word> d;
    const hn::ScalableTag<std::int64_t> d64;
    const hn::Half<decltype(d)> half;
    const auto fours = [&](auto part) HWY_ATTR {
        const auto offset = hn::ShiftLeft<1>(hn::PromoteTo(d64, part));
        return hn::BitCast(d, hn::GatherOffset(d64, reinterpret_cast<const std::int64_t*>(row), offset));
    };
    const auto low = fours(hn::LowerHalf(half, first)), high = fours(hn::UpperHalf(half, first));
    return std::array<hn::Vec<decltype(d)>, 2>{hn::ConcatEven(d, high, low), hn::ConcatOdd(d, high, low)};
}
#else
constexpr bool kGathersRows = false;
template <class T>
std::array<hn::Vec<hn::ScalableTag<Word>>, 2> gathered_row(const T*, hn::Vec<hn::ScalableTag<Word>>) {
    return {};
}
#endif

template <class T>
void fetch_lit_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    const Volume& volume = *plan.volume;
    const hn::ScalableTag<Word> d;
    const Index3 n = volume.dims;
    const T* data = static_cast<const T*>(volume.data.get());
    const unsigned rows = rows_of(plan.gradient.rule);
    const bool offsets_fit = volume.voxels() < std::numeric_limits<Word>::max();
    const auto clamped = [](std::int64_t i, std::int64_t end) {
        return std::clamp<std::int64_t>(i, 0, end - 1);
    };
    for (int end = 0; end < (plan.needs_back ? 2 : 1); ++end)
        for (int at = 0; at < count; at += kLanes) {
            lanes::Batch* pair = lit.pair[end];
            const auto& cell = lit.cell[end];
            auto outside = hn::Lt(hn::Load(d, cell[0].v + at), hn::Set(d, 1));
            for (int a = 0; a < 3; ++a) {
                const auto p = hn::Load(d, cell[a].v + at);
                outside = hn::Or(outside, hn::Or(hn::Lt(p, hn::Set(d, 1)),
                                                 hn::Gt(p, hn::Set(d, static_cast<Word>(n[a] - 3)))));
            }
            const int here = std::min(kLanes, count - at);  // lanes behind the last sample repeat the first
            outside = hn::And(outside, hn::FirstN(d, static_cast<std::size_t>(here)));
            if (hn::AllFalse(d, outside)) {
                if (kGathersRows && offsets_fit) {
                    auto first = hn::Sub(hn::Load(d, cell[2].v + at), hn::Set(d, 1));
                    for (const int a : {1, 0})
                        first = hn::Add(hn::Mul(first, hn::Set(d, static_cast<Word>(n[a]))),
                                        hn::Sub(hn::Load(d, cell[a].v + at), hn::Set(d, 1)));
                    // Lanes behind the last sample look at the first voxel.
                    first = hn::IfThenElseZero(hn::FirstN(d, static_cast<std::size_t>(here)), first);
                    for (int row = 0; row < 16; ++row) {
                        if (!(rows >> row & 1)) continue;
                        const auto two = gathered_row(data + n.x * (row % 4 + n.y * (row / 4)), first);
                        hn::Store(two[0], d, pair[2 * row].v + at);
                        hn::Store(two[1], d, pair[2 * row + 1].v + at);
                    }
                    continue;
                }
                const T* low[kLanes];
                for (int lane = 0; lane < kLanes; ++lane) {
                    const int i = lane < here ? at + lane : at;
                    low[lane] = data + (cell[0].v[i] - 1) +
                                n.x * ((cell[1].v[i] - 1) + n.y * std::int64_t{cell[2].v[i] - 1});
                }
                for (int row = 0; row < 16; ++row) {
                    if (!(rows >> row & 1)) continue;
                    const std::int64_t offset = n.x * (row % 4 + n.y * (row / 4));
                    const auto address = [&](int lane) {
                        return reinterpret_cast<const std::uint8_t*>(low[lane] + offset);
                    };
                    const auto words = [&] {
                        if constexpr (sizeof(T) == 1)
                            return load_widened_quads(address);
                        else
                            return load_quads(address);
                    }();
                    hn::Store(words[0], d, pair[2 * row].v + at),
                        hn::Store(words[1], d, pair[2 * row + 1].v + at);
                }
                continue;
            }
            // Beside the volume's faces its outermost voxels go on.
            for (int i = at; i < at + here; ++i)
                for (int row = 0; row < 16; ++row) {
                    if (!(rows >> row & 1)) continue;
                    const T* line = data + n.x * (clamped(cell[1].v[i] + row % 4 - 1, n.y) +
                                                  n.y * clamped(cell[2].v[i] + row / 4 - 1, n.z));
                    const auto voxel = [&](int x) { return Word{line[clamped(cell[0].v[i] + x - 1, n.x)]}; };
                    pair[2 * row].v[i] = voxel(0) | voxel(1) << 16,
                             pair[2 * row + 1].v[i] = voxel(2) | voxel(3) << 16;
                }
        }
}

// ------------------------------------------------------------------------------------------------ empty
// space

/// How many samples from number `at` on, of each ray, lie in empty blocks: the one at `at` and those up to
/// the far side of the empty blocks around it.  0 or less where that one may not be left out.
auto empty_ahead(const lanes::EmptySpace& empty, const lanes::RayCourse& course, const Index3& dims, int r,
                 hn::Vec<hn::ScalableTag<Word>> at) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1);
    const auto margin = hn::Set(df, course.margin), side = hn::Set(df, float(lanes::kBlock)),
               inner_side = hn::Sub(side, margin);
    const Index3 &low_block = empty.box.low, &counts = empty.box.blocks;
    const Word strides[3] = {1, static_cast<Word>(counts.x), static_cast<Word>(counts.x * counts.y)};
    const auto number = hn::ConvertTo(df, at);
    hn::Vec<decltype(df)> p[3], low_side[3];  // where the ray is, and the lower face of its block there
    auto index = zero;
    auto beside = hn::Gt(zero, zero);  // a sample may lie in the next block
    for (int a = 0; a < 3; ++a) {
        p[a] = hn::MulAdd(number, hn::Load(df, course.step[a].v + r), hn::Load(df, course.first[a].v + r));
        // From here on, in voxels from the lowest block.
        const std::int64_t first = low_block[a] * lanes::kBlock;
        p[a] = hn::Sub(p[a], hn::Set(df, float(first)));
        p[a] = hn::Min(hn::Max(p[a], hn::Zero(df)), hn::Set(df, float(dims[a] - 1 - first)));
        const auto last = hn::Set(d, static_cast<Word>(counts[a] - 1));
        const auto block = hn::Min(hn::ShiftRight<lanes::kBlockBits>(hn::ConvertTo(d, p[a])), last);
        low_side[a] = hn::Mul(hn::ConvertTo(df, block), side);
        const auto inside = hn::Sub(p[a], low_side[a]);
        const auto near_low = hn::And(hn::RebindMask(d, hn::Lt(inside, margin)), hn::Gt(block, zero));
        const auto near_high = hn::And(hn::RebindMask(d, hn::Gt(inside, inner_side)), hn::Lt(block, last));
        beside = hn::Or(beside, hn::Or(near_low, near_high));
        index = hn::Add(index, hn::Mul(block, hn::Set(d, strides[a])));
    }
    auto distance = hn::And(hn::GatherOffset(d, reinterpret_cast<const Word*>(empty.distance.data()), index),
                            hn::Set(d, 0xff));
    distance = hn::Sub(distance, hn::IfThenElseZero(beside, one));
    // To the far side of the empty blocks ahead.
    const auto empty_side = hn::Mul(hn::ConvertTo(df, distance), side);
    auto steps = hn::Set(df, 1e6F);
    for (int a = 0; a < 3; ++a) {
        const auto up = hn::Sub(hn::Add(low_side[a], empty_side), p[a]);
        const auto down = hn::Sub(p[a], hn::Sub(hn::Add(low_side[a], side), empty_side));
        const auto backwards = hn::Lt(hn::Load(df, course.step[a].v + r), hn::Zero(df));
        const auto way = hn::Sub(hn::IfThenElse(backwards, down, up), margin);
        steps = hn::Min(steps, hn::Mul(way, hn::Load(df, course.pace[a].v + r)));
    }
    // The last sample inside is left out, too: the next one is looked at anew.
    const auto free = hn::Add(hn::ConvertTo(d, hn::Max(steps, hn::Zero(df))), one);
    return hn::IfThenElseZero(hn::Gt(distance, zero),
                              hn::Min(free, hn::Sub(hn::Load(d, course.skippable.v + r), at)));
}

int leave_out_empty(const lanes::EmptySpace& empty, const lanes::RayPacket& rays, const Index3& dims, int k,
                    int most, lanes::RayCourse& course, lanes::PixelPacket& pixels) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d), here = hn::Set(d, k);
    auto least = hn::Set(d, k + most);  // the first sample that stays, in every lane
    for (int r = 0; r < kRays; r += kLanes) {
        const auto goes_on = hn::And(hn::Gt(hn::Load(d, pixels.active.v + r), zero),
                                     hn::Gt(hn::Load(d, rays.slabs.v + r), here));
        // Each ray on its own, from where it was seen to be free to the first sample that is not.
        auto until = hn::Max(hn::Load(d, course.free_until.v + r), here);
        auto looks = hn::And(goes_on, hn::Lt(until, least));
        while (!hn::AllFalse(d, looks)) {
            const auto ahead = empty_ahead(empty, course, dims, r, until);
            const auto stops = hn::AndNot(hn::Gt(ahead, zero), looks);
            until = hn::Add(until, hn::IfThenElseZero(hn::AndNot(stops, looks), ahead));
            if (!hn::AllFalse(d, stops)) least = hn::MinOfLanes(d, hn::IfThenElse(stops, until, least));
            looks = hn::And(hn::AndNot(stops, looks), hn::Lt(until, least));
        }
        hn::Store(until, d, course.free_until.v + r);
    }
    const int left_out = hn::GetLane(least) - k;
    if (left_out == 0) return 0;
    for (int r = 0; r < kRays; r += kLanes) {
        const auto slabs =
            hn::Min(hn::Max(hn::Sub(hn::Load(d, rays.slabs.v + r), here), zero), hn::Set(d, left_out));
        const auto active = hn::Gt(hn::Load(d, pixels.active.v + r), zero);
        const auto samples = hn::Load(d, pixels.samples.v + r);
        hn::Store(hn::Add(samples, hn::IfThenElseZero(active, slabs)), d, pixels.samples.v + r);
    }
    return left_out;
}

template <class T>
void choose_voxel_kernels(bool cells, lanes::StageKernels& kernels) {
    kernels.prefetch = cells ? &prefetch_cells<T> : &prefetch_linear<T>;
    kernels.fetch = cells ? &fetch_cells<T> : &fetch_linear<T>;
    kernels.fetch_lit = &fetch_lit_samples<T>;
}

}  // namespace

void voxel_kernels_of(const VoxelSource& source, lanes::StageKernels& kernels) {
    kernels.leave_out = &leave_out_empty;
    kernels.gather_lit = &gather_lit_samples;
    if (source.volume->type == ScalarType::u8)
        choose_voxel_kernels<std::uint8_t>(source.cells != nullptr, kernels);
    else
        choose_voxel_kernels<std::uint16_t>(source.cells != nullptr, kernels);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void voxel_kernels(std::int64_t target, const VoxelSource& source, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, voxel_kernels_of, source, kernels)
}
}  // namespace squint::lanes
#endif
