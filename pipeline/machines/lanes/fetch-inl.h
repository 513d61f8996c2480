// Where samples' cells lie in memory, and their way into registers; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_FETCH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_FETCH_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_FETCH_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_FETCH_INL_H
#endif

#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/stages/faces.h"

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A packet's outermost rays stand for those between them.
inline constexpr int kOutermost[] = {0, lanes::kSide - 1, lanes::kRays - lanes::kSide, lanes::kRays - 1};

/// The lowest voxel of sample i's cell.
template <class T>
HWY_INLINE const T* corner_of(const Volume& volume, const lanes::Samples& s, int i) {
    return static_cast<const T*>(volume.data.get()) + s.cell[0].v[i] +
           volume.dims.x * (s.cell[1].v[i] + volume.dims.y * s.cell[2].v[i]);
}

/// Places of cells in blocks of them (CellBlocks), a vector at a time.
class CellPlaces {
    static constexpr int kBits = lanes::CellBlocks::kBits;
    using Words = hn::Vec<hn::ScalableTag<lanes::Word>>;

  public:
    HWY_INLINE explicit CellPlaces(const lanes::VoxelSource& source)
        : CellPlaces(source.slots.data(), source.blocks) {}
    HWY_INLINE CellPlaces(const std::int32_t* slots, const Index3& blocks)
        : slots_(slots),
          row_(static_cast<lanes::Word>(blocks.x)),
          slice_(static_cast<lanes::Word>(blocks.x * blocks.y)) {}

    /// Of cells (x, y, z): among all cells, or -1 where there is none.
    HWY_INLINE Words operator()(Words x, Words y, Words z) const {
        const hn::ScalableTag<lanes::Word> d;
        const auto in_block = hn::Set(d, (1 << kBits) - 1);
        const auto block_row = hn::Mul(hn::Set(d, row_), hn::ShiftRight<kBits>(y)),
                   block_slice = hn::Mul(hn::Set(d, slice_), hn::ShiftRight<kBits>(z));
        const auto slot =
            hn::GatherIndex(d, slots_, hn::Add(hn::ShiftRight<kBits>(x), hn::Add(block_row, block_slice)));
        const auto offset =
            hn::Or(hn::And(x, in_block), hn::Or(hn::ShiftLeft<kBits>(hn::And(y, in_block)),
                                                hn::ShiftLeft<2 * kBits>(hn::And(z, in_block))));
        return hn::Or(slot, offset);  // -1 stays -1
    }

  private:
    const std::int32_t* slots_;
    lanes::Word row_, slice_;
};

/// Places of cells in at most two neighbouring blocks along each axis, whose slots fit a register: a gather costs
/// as much as all else that stage 1 does.
class NearPlaces {
    static constexpr int kBits = lanes::CellBlocks::kBits;
    using D = hn::ScalableTag<lanes::Word>;
    using Words = hn::Vec<D>;

  public:
    static constexpr bool kFits = HWY_LANES(lanes::Word) >= 8;

    HWY_INLINE explicit NearPlaces(const lanes::VoxelSource& source)
        : near_(source.near ? source.near->data() : nullptr),
          row_(source.blocks.x),
          slice_(source.blocks.x * source.blocks.y),
          starts_(hn::Zero(D())) {}

    /// Takes the slots of the blocks between cells `low` and `high`, each of some lane.  Returns false, and takes
    /// none, where they are more blocks.
    HWY_INLINE bool take(const std::array<Words, 3>& low, const std::array<Words, 3>& high) {
        if constexpr (kFits) {
            const D d;
            if (!near_) return false;
            std::int64_t first[3];
            auto beyond = hn::Zero(d);
            for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
                const auto least = hn::MinOfLanes(d, hn::ShiftRight<kBits>(low[a]));
                beyond = hn::Max(beyond, hn::Sub(hn::ShiftRight<kBits>(high[a]), least));
                first[a] = hn::GetLane(least);
            });
            if (!hn::AllFalse(d, hn::Gt(beyond, hn::Set(d, 1)))) return false;
            const lanes::Word* starts = near_[first[0] + row_ * first[1] + slice_ * first[2]].start;
            if constexpr (HWY_LANES(lanes::Word) == 8)
                starts_ = hn::Load(d, starts);
            else
                starts_ = hn::MaskedLoad(hn::FirstN(d, 8), d, starts);
            return true;
        }
        return false;
    }

    /// Of cells (x, y, z) among those: among all cells, or below zero where there is none.
    HWY_INLINE Words operator()(Words x, Words y, Words z) const {
        const D d;
        const auto odd = hn::Set(d, 1 << kBits);
        const auto block = hn::Or(
            hn::And(x, odd), hn::Or(hn::ShiftLeft<1>(hn::And(y, odd)), hn::ShiftLeft<2>(hn::And(z, odd))));
        const auto start = hn::TableLookupLanes(starts_, hn::IndicesFromVec(d, hn::ShiftRight<kBits>(block)));
        // What one more along an axis adds inside a block.
        return hn::Add(start, hn::Add(x, hn::Add(hn::ShiftLeft<kBits>(y), hn::ShiftLeft<2 * kBits>(z))));
    }

  private:
    const lanes::CellBlocks::Near* near_;
    std::int64_t row_, slice_;
    Words starts_;
};

/// Asks memory for the cells of a row of samples that have their places: the outermost rays', or every ray's
/// where those lie apart.
template <class T>
HWY_INLINE void request_cells(const lanes::VoxelSource& source, const lanes::Samples& s, int row) {
    // As numbers: a cell that is not there has an address before all others, which a request may name.
    const auto cells = reinterpret_cast<std::intptr_t>(source.cells);
    const lanes::Word* place = s.place.v + row * lanes::kRays;
    const auto request = [&](int ray) SQUINT_WRITTEN_OUT {  // compilers drop calls that do nothing but this
        __builtin_prefetch(reinterpret_cast<const void*>(
            cells + std::intptr_t{place[ray]} * static_cast<std::intptr_t>(8 * sizeof(T))));
    };
    if (source.requests_all)
        for (int ray = 0; ray < lanes::kRays; ++ray) request(ray);
    else
        for (const int ray : kOutermost) request(ray);
}

/// Cells out of blocks of them.
template <class T>
class CellCorners {
  public:
    HWY_INLINE explicit CellCorners(const lanes::VoxelSource& source)
        : volume_(*source.volume), cells_(source.cells), offsets_(source.volume->dims) {}

    /// A vector of them, samples that have their places, from `at` on: four words of pairs along x each, y
    /// fastest.
    HWY_INLINE auto pairs(const lanes::Samples& s, int at) {
        const hn::ScalableTag<lanes::Word> d;
        const lanes::Word* place = s.place.v + at;
        const auto there = [&](int lane) {
            return cells_ + std::int64_t{place[lane]} * static_cast<std::int64_t>(8 * sizeof(T));
        };
        if (hn::AllFalse(d, hn::Lt(hn::Load(d, place), hn::Zero(d)))) [[likely]]
            return load(there);
        return load(
            [&](int lane) { return place[lane] < 0 ? put_together(s, at + lane, lane) : there(lane); });
    }

  private:
    template <class Address>
    static HWY_INLINE auto load(Address&& address) {
        if constexpr (sizeof(T) == 1)
            return load_widened_quads(address);
        else
            return load_quads(address);
    }
    /// A cell that is in no block.
    HWY_INLINE const std::uint8_t* put_together(const lanes::Samples& s, int i, int lane) {
        const T* corner = corner_of<T>(volume_, s, i);
        for (int p = 0; p < 4; ++p)
            spare_[lane][2 * p] = corner[offsets_.pair[p]],
                             spare_[lane][2 * p + 1] = corner[offsets_.pair[p] + 1];
        return reinterpret_cast<const std::uint8_t*>(spare_[lane]);
    }

    const Volume& volume_;
    const std::uint8_t* cells_;
    PairOffsets offsets_;
    T spare_[HWY_LANES(lanes::Word)][8];
};

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
