// Between stages 1 and 2: finds samples' voxels and loads them into registers.  Also decides which parts of a
// ray need no samples.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_voxels.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/machines/lanes/fetch-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/stages/faces.h"

#include <algorithm>
#include <bit>
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

// ------------------------------------------------------------------------------- the volume itself

/// kNumbered: the index of any voxel fits a word, and `place` holds those of the cells' lowest corners.
template <class T, bool kNumbered>
void prefetch_linear(const VoxelSource& source, int from, int to, Samples& s) {
    const Volume& volume = *source.volume;
    const PairOffsets offsets(volume.dims);
    const hn::ScalableTag<Word> d;
    if constexpr (kNumbered) {
        const auto row = hn::Set(d, static_cast<Word>(volume.dims.x)),
                   slice = hn::Set(d, static_cast<Word>(volume.dims.x * volume.dims.y));
        for (int at = from * kRays; at < to * kRays; at += kLanes) {
            const auto y = hn::Mul(hn::Load(d, s.cell[1].v + at), row),
                       z = hn::Mul(hn::Load(d, s.cell[2].v + at), slice);
            hn::Store(hn::Add(hn::Load(d, s.cell[0].v + at), hn::Add(y, z)), d, s.place.v + at);
        }
    }
    // Every second step suffices, because neighbours share cache lines.
    for (int i = from * kRays; i < to * kRays; i += 2 * kRays)
        for (const int ray : kOutermost) {
            const T* corner = corner_of<T>(volume, s, i + ray);
            for (const std::int64_t offset : offsets.pair) __builtin_prefetch(corner + offset);
        }
}
template <class T, bool kNumbered>
void fetch_linear(const VoxelSource& source, int from, int to, Samples& s) {
    const Volume& volume = *source.volume;
    const PairOffsets offsets(volume.dims);
    const T* const voxels = static_cast<const T*>(volume.data.get());
    for (int i = from * kRays; i < to * kRays; ++i) {
        const T* corner = kNumbered ? voxels + s.place.v[i] : corner_of<T>(volume, s, i);
        for (int p = 0; p < 4; ++p) s.pair[p].v[i] = pair_at(corner + offsets.pair[p]);
    }
}

// ------------------------------------------------------------------------------------------- cells

template <class T>
void request_rows_of_cells(const VoxelSource& source, int from, int to, const Samples& s) {
    for (int row = from; row < to; ++row) request_cells<T>(source, s, row);
}
template <class T>
void prefetch_cells(const VoxelSource& source, int from, int to, Samples& s) {
    const hn::ScalableTag<Word> d;
    const CellPlaces places(source);
    for (int at = from * kRays; at < to * kRays; at += kLanes)
        hn::Store(places(hn::Load(d, s.cell[0].v + at), hn::Load(d, s.cell[1].v + at),
                         hn::Load(d, s.cell[2].v + at)),
                  d, s.place.v + at);
    // Not by a call of the above, which compilers drop: it does nothing else.
    for (int row = from; row < to; ++row) request_cells<T>(source, s, row);
}
template <class T>
void fetch_cells(const VoxelSource& source, int from, int to, Samples& s) {
    CellCorners<T> corners(source);
    for (int at = from * kRays; at < to * kRays; at += kLanes) {
        const auto pairs = corners.pairs(s, at);
        for (std::size_t p = 0; p < 4; ++p) store(Lanes<Word>{pairs[p]}, s.pair[p].v + at);
    }
}

// ------------------------------------------------------------------------------------- empty space

/// Bit i of the result: whether `seen_by(row, beam)`, a mask, holds of any beam at row `at[i]`, i < kWindow.
template <class At, class SeenBy>
HWY_INLINE std::uint32_t rows_seen(const lanes::RayCourse& course, const At& at, const SeenBy& seen_by) {
    const hn::ScalableTag<Word> d;
    std::uint32_t seen = 0;
    for (int lane = 0; lane < lanes::RayCourse::kWindow; lane += kLanes) {
        const auto row = at(lane);
        auto here = hn::Gt(hn::Zero(d), hn::Zero(d));
        for (int beam = 0; beam < course.beams; ++beam) here = hn::Or(here, seen_by(row, beam));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, here, bits);
        seen |= static_cast<std::uint32_t>(bits[0] | bits[1] << 8) << lane;
    }
    return seen;
}

/// Whether something may be visible around a beam at a row.
template <class At>
std::uint32_t seen_about(const lanes::EmptySpace& empty, const lanes::RayCourse& course, int enough,
                         const At& at) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const Index3& corners = empty.corners;
    return rows_seen(course, at, [&](auto row, int beam) HWY_ATTR {
        auto index = hn::Zero(d);
        for (int a = 2; a >= 0; --a) {
            const auto p =
                hn::MulAdd(row, hn::Set(df, course.step[beam][a]), hn::Set(df, course.first[beam][a]));
            const auto inside =
                hn::Min(hn::Max(p, hn::Zero(df)), hn::Set(df, static_cast<float>(corners[a] - 1)));
            index =
                hn::Add(hn::Mul(index, hn::Set(d, static_cast<Word>(corners[a]))), hn::NearestInt(inside));
        }
        const auto clear = hn::And(
            hn::GatherOffset(d, reinterpret_cast<const Word*>(empty.clear.data()), index), hn::Set(d, 0xff));
        return hn::Lt(clear, hn::Set(d, enough));
    });
}

/// The same of the blocks alone that a row's samples may lie in: at most two along each axis.
template <class At>
std::uint32_t seen_within(const lanes::EmptySpace& empty, const lanes::RayCourse& course, const At& at) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const Index3& blocks = empty.box.blocks;
    const auto apart = hn::Set(df, course.apart);
    return rows_seen(course, at, [&](auto row, int beam) HWY_ATTR {
        auto index = hn::Zero(d), span = hn::Set(d, 1);  // span: its bit of EmptySpace::spans
        const auto along = [&](int a, auto further) HWY_ATTR {
            const auto p =
                hn::MulAdd(row, hn::Set(df, course.step[beam][a]), hn::Set(df, course.first[beam][a]));
            const auto most = hn::Set(df, static_cast<float>(blocks[a] - 1));
            const auto block_at = [&](auto place) HWY_ATTR {  // floors, for no place is below zero
                return hn::ConvertTo(d, hn::Min(hn::Max(place, hn::Zero(df)), most));
            };
            const auto first = block_at(hn::Sub(p, apart)), last = block_at(hn::Add(p, apart));
            index = hn::Add(hn::Mul(index, hn::Set(d, static_cast<Word>(blocks[a]))), first);
            span = hn::IfThenElse(hn::Gt(last, first), further(span), span);
        };
        along(2, [](auto v) HWY_ATTR { return hn::ShiftLeft<4>(v); });
        along(1, [](auto v) HWY_ATTR { return hn::ShiftLeft<2>(v); });
        along(0, [](auto v) HWY_ATTR { return hn::ShiftLeft<1>(v); });
        const auto spans = hn::GatherOffset(d, reinterpret_cast<const Word*>(empty.spans.data()), index);
        return hn::TestBit(spans, span);
    });
}

/// The same of blocks of half a side, for rows whose samples lie in at most two of them along each axis.
template <class At>
std::uint32_t seen_in_fine(const lanes::EmptySpace& empty, const lanes::RayCourse& course, const At& at) {
    const hn::ScalableTag<float> df;
    const hn::ScalableTag<Word> d;
    const Index3& blocks = empty.box.blocks;
    const auto apart = hn::Set(df, 2 * course.apart);
    const auto one = hn::Set(d, 1);
    return rows_seen(course, at, [&](auto row, int beam) HWY_ATTR {
        auto index = hn::Zero(d);
        for (int a = 2; a >= 0; --a) {
            const auto p = hn::MulAdd(row, hn::Set(df, 2 * course.step[beam][a]),
                                      hn::Set(df, 2 * course.first[beam][a]));
            const auto inside = hn::Min(hn::Max(hn::Sub(p, apart), hn::Zero(df)),
                                        hn::Set(df, static_cast<float>(2 * blocks[a] - 1)));
            // Floors, for no place is below zero.
            index = hn::Add(hn::Mul(index, hn::Set(d, static_cast<Word>(2 * blocks[a]))),
                            hn::ConvertTo(d, inside));
        }
        const auto bits =
            hn::GatherIndex(d, reinterpret_cast<const Word*>(empty.fine.data()), hn::ShiftRight<5>(index));
        return hn::TestBit(bits, hn::Shl(one, hn::And(index, hn::Set(d, 31))));
    });
}

lanes::Rows visible_rows_of(const lanes::EmptySpace& empty, const lanes::RayPacket& rays, int k,
                            lanes::RayCourse& course) {
    constexpr int kWindow = lanes::RayCourse::kWindow;
    const hn::ScalableTag<float> df;
    const auto rows_from = [&](int first, float apart, float begin) {
        return [=](int lane) HWY_ATTR {
            return hn::MulAdd(hn::Iota(df, static_cast<float>(lane)), hn::Set(df, apart),
                              hn::Set(df, static_cast<float>(first) + begin));
        };
    };
    const bool fine = !empty.fine.empty() && course.apart >= 0 && course.apart <= 0.25F;
    while (k < rays.most_slabs) {
        if (k + lanes::kSteps > course.window + kWindow) {
            course.window = k;
            course.may_be_seen = fine ? seen_in_fine(empty, course, rows_from(k, 1, 0))
                                 : course.apart >= 0
                                     ? seen_within(empty, course, rows_from(k, 1, 0))
                                     : seen_about(empty, course, course.enough, rows_from(k, 1, 0));
        }
        const std::uint32_t ahead = course.may_be_seen >> (k - course.window);
        const int skipped = ahead ? std::countr_zero(ahead) : 0;
        if (ahead && k + skipped + lanes::kSteps <= course.window + kWindow) {
            const auto batch = (ahead >> skipped) & ((1U << lanes::kSteps) - 1);
            const int first = k + skipped;
            return {first, std::clamp(static_cast<int>(std::bit_width(batch)), 0, rays.most_slabs - first)};
        }
        if (ahead) {
            k += skipped;
            continue;
        }
        // Perhaps a wide gap.
        k = course.window + kWindow;
        const auto n = static_cast<float>(course.stride);
        for (std::uint32_t seen = 0; seen == 0 && k < rays.most_slabs;) {
            seen = seen_about(empty, course, course.enough_of_stride, rows_from(k, n, 0.5F * (n - 1)));
            k += (seen ? std::countr_zero(seen) : kWindow) * course.stride;
        }
    }
    return {rays.most_slabs, 0};
}

void pass_over_rows(const lanes::RayPacket& rays, int from, int to, lanes::PixelPacket& pixels) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d);
    for (int r = 0; r < kRays; r += kLanes) {
        const auto slabs = hn::Min(hn::Max(hn::Sub(hn::Load(d, rays.slabs.v + r), hn::Set(d, from)), zero),
                                   hn::Set(d, to - from));
        const auto active = hn::Gt(hn::Load(d, pixels.active.v + r), zero);
        hn::Store(hn::Add(hn::Load(d, pixels.samples.v + r), hn::IfThenElseZero(active, slabs)), d,
                  pixels.samples.v + r);
    }
}

template <class T>
void choose_voxel_kernels(const VoxelSource& source, lanes::StageKernels& kernels) {
    if (source.cells)
        kernels.prefetch = &prefetch_cells<T>, kernels.request = &request_rows_of_cells<T>,
        kernels.fetch = &fetch_cells<T>;
    else if (source.volume->voxels() <= std::numeric_limits<Word>::max())
        kernels.prefetch = &prefetch_linear<T, true>, kernels.fetch = &fetch_linear<T, true>;
    else
        kernels.prefetch = &prefetch_linear<T, false>, kernels.fetch = &fetch_linear<T, false>;
}

}  // namespace

void voxel_kernels_of(const VoxelSource& source, lanes::StageKernels& kernels) {
    kernels.visible_rows = &visible_rows_of;
    kernels.pass_over = &pass_over_rows;
    if (source.volume->type == ScalarType::u8)
        choose_voxel_kernels<std::uint8_t>(source, kernels);
    else
        choose_voxel_kernels<std::uint16_t>(source, kernels);
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
