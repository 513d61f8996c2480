// Walls between samples, in lanes: which slabs are looked at twice, and their samples inside.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_walls.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/float_lanes-inl.h"
#include "fixedpoint/words/lane_quotients-inl.h"
#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/location-inl.h"

#include <algorithm>
#include <array>
#include <bit>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::LitSamples;
using lanes::NearWalls;
using lanes::Samples;
using lanes::Word;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(hn::ScalableTag<Word>()));
using Words = hn::Vec<hn::ScalableTag<Word>>;

/// Bits of cells, a vector at a time.
class WallBits {
    static constexpr int kBits = lanes::kBlockBits;
    static constexpr hn::ScalableTag<Word> d{};

  public:
    HWY_INLINE explicit WallBits(const NearWalls& near)
        : bits_(reinterpret_cast<const Word*>(near.bits.data())),
          about_(reinterpret_cast<const Word*>(near.about.data())),
          row_(static_cast<Word>(near.box.blocks.x)),
          slice_(static_cast<Word>(near.box.blocks.x * near.box.blocks.y)),
          about_row_(static_cast<Word>(NearWalls::words_a_row(near.box))),
          about_slice_(static_cast<Word>(about_row_ * 2 * near.box.blocks.y)),
          low_{static_cast<Word>(near.box.low.x), static_cast<Word>(near.box.low.y),
               static_cast<Word>(near.box.low.z)} {}

    /// One where a cell is wanted and holds a wall, else zero.  Others may lie outside the box.
    template <class Mask>
    HWY_INLINE Words operator()(Mask wanted, const Words (&at)[3]) const {
        const auto block_along = [&](int a) SQUINT_WRITTEN_OUT {
            return hn::Sub(hn::ShiftRight<kBits>(at[a]), hn::Set(d, low_[a]));
        };
        const auto block = place(block_along(0), block_along(1), block_along(2), row_, slice_);
        const auto inside = hn::Set(d, lanes::kBlock - 1);
        const auto cell =
            hn::Or(hn::And(at[0], inside), hn::Or(hn::ShiftLeft<kBits>(hn::And(at[1], inside)),
                                                  hn::ShiftLeft<2 * kBits>(hn::And(at[2], inside))));
        return bit_of(wanted, bits_,
                      hn::Add(hn::ShiftLeft<std::countr_zero(unsigned{NearWalls::kWords})>(block),
                              hn::ShiftRight<5>(cell)),
                      cell);
    }
    /// The same, where it may be that a cell beside it does.
    template <class Mask>
    HWY_INLINE Words about(Mask wanted, const Words (&at)[3]) const {
        const auto two_along = [&](int a) SQUINT_WRITTEN_OUT {
            return hn::Sub(hn::ShiftRight<1>(at[a]), hn::Set(d, 2 * low_[a]));
        };
        const Words x = two_along(0);
        return bit_of(wanted, about_,
                      place(hn::ShiftRight<5>(x), two_along(1), two_along(2), about_row_, about_slice_), x);
    }

  private:
    static HWY_INLINE Words place(Words x, Words y, Words z, Word row, Word slice) {
        return hn::Add(x, hn::Add(hn::Mul(hn::Set(d, row), y), hn::Mul(hn::Set(d, slice), z)));
    }
    template <class Mask>
    static HWY_INLINE Words bit_of(Mask wanted, const Word* words, Words place, Words bit) {
        const auto word = hn::GatherIndex(d, words, hn::IfThenElseZero(wanted, place));
        const auto found = hn::And(hn::Shr(word, hn::And(bit, hn::Set(d, 31))), hn::Set(d, 1));
        return hn::IfThenElseZero(wanted, found);
    }
    const Word *bits_, *about_;
    Word row_, slice_, about_row_, about_slice_, low_[3];
};

/// Packs those of slabs [0, steps) of rays that go on which met no wall but have one in a cell on their way, and
/// repeats the last one up to a multiple of sixteen.  L: the lanes of locations.
template <class L>
int gather_second_looks(const Plan& plan, const NearWalls& near, const lanes::RayPacket& rays,
                        const lanes::PixelPacket& pixels, int steps, const Samples& s, LitSamples& slabs) {
    static_assert(L::count() <= kLanes);
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d);
    const Word one = plan.float32 ? std::bit_cast<Word>(static_cast<float>(plan.inside.one_alpha))
                                  : static_cast<Word>(plan.inside.one_alpha);
    const bool per_ray = plan.lit && plan.shading.needs_ray();
    const WallBits walls(near);
    // Places of the samples half-way along slabs.
    const auto find_half_way = [&](int at, Word(&cell)[3][kLanes]) {
        for (int i = 0; i < kLanes; i += static_cast<int>(L::count())) {
            const CellPosition<L> position = cell_position(
                plan.location, location_between(plan.inside, load_three<L>(s.location, at + i),
                                                load_three<L>(s.location, at + kRays + i), 1, 1));
            for (std::size_t a = 0; a < 3; ++a) store_whole(position.cell[a], cell[a] + i);
        }
    };
    int count = 0;
    for (int r = 0; r < kRays; r += kLanes) {
        const auto goes_on = hn::Gt(hn::Load(d, pixels.active.v + r), zero);
        if (hn::AllFalse(d, goes_on)) continue;
        const auto last = hn::Load(d, rays.slabs.v + r);
        auto wall_in_front = zero;  // that at the back of the slab before, where it was asked for
        bool knows_front = false;
        for (int row = 0; row < steps; ++row) {
            const int at = row * kRays + r;
            const bool knew_front = knows_front;
            knows_front = false;
            // Slabs behind a ray's last one have a location of their own, but are none.
            const auto there = hn::And(goes_on, hn::Gt(last, hn::Set(d, s.first + row)));
            const auto open = hn::And(there, hn::Lt(hn::Load(d, s.alpha.v + at), hn::Set(d, one)));
            if (hn::AllFalse(d, open)) continue;
            const Words front[3] = {hn::Load(d, s.cell[0].v + at), hn::Load(d, s.cell[1].v + at),
                                    hn::Load(d, s.cell[2].v + at)};
            const Words back[3] = {hn::Load(d, s.cell[0].v + at + kRays),
                                   hn::Load(d, s.cell[1].v + at + kRays),
                                   hn::Load(d, s.cell[2].v + at + kRays)};
            // Up to cells side by side, those on the way lie beside the front's.
            const auto apart = [&](int a) SQUINT_WRITTEN_OUT { return hn::Abs(hn::Sub(back[a], front[a])); };
            const auto far = hn::Gt(hn::Max(hn::Max(apart(0), apart(1)), apart(2)), hn::Set(d, 1));
            const auto near_one = hn::And(open, hn::Or(far, hn::Gt(walls.about(open, front), zero)));
            if (hn::AllFalse(d, near_one)) continue;
            if (!knew_front) wall_in_front = walls(there, front);
            const auto wall_behind = walls(there, back);
            auto wall = hn::Or(wall_in_front, wall_behind);
            wall_in_front = wall_behind, knows_front = true;
            const auto open_so_far = hn::And(near_one, hn::Eq(wall, zero));
            if (!hn::AllFalse(d, open_so_far)) {
                alignas(64) Word cell[3][kLanes];
                find_half_way(at, cell);
                const Words middle[3] = {hn::Load(d, cell[0]), hn::Load(d, cell[1]), hn::Load(d, cell[2])};
                wall = hn::Or(wall, walls(open_so_far, middle));
            }
            const auto wanted = hn::And(open, hn::Gt(wall, zero));
            if (hn::AllFalse(d, wanted)) continue;
            const Packing packing(wanted);
            const auto pack = [&](const Word* from, lanes::Batch& to) {
                packing(hn::Load(d, from), to.v + count);
            };
            packing(hn::Iota(d, at), slabs.from.v + count);
            for (int end = 0; end < 2; ++end) {
                for (int a = 0; a < 3; ++a) pack(s.location[a].v + at + end * kRays, slabs.location[end][a]);
                pack(s.input.v + at + end * kRays, slabs.input[end]);
            }
            pack(s.length.v + at, slabs.length);
            for (int a = 0; per_ray && a < 3; ++a) {
                pack(rays.view[a].v + r, slabs.view[a]);
                for (int l = 0; l < plan.shading.lights; ++l) pack(rays.half[l][a].v + r, slabs.half[l][a]);
            }
            count += packing.count();
        }
    }
    if (count == 0) return 0;
    const auto repeat = [&](lanes::Batch& b) {
        for (int i = count; i % kRays != 0; ++i) b.v[i] = b.v[count - 1];
    };
    repeat(slabs.from), repeat(slabs.length);
    for (int end = 0; end < 2; ++end) {
        repeat(slabs.input[end]);
        for (int a = 0; a < 3; ++a) repeat(slabs.location[end][a]);
    }
    for (int a = 0; per_ray && a < 3; ++a) {
        repeat(slabs.view[a]);
        for (int l = 0; l < plan.shading.lights; ++l) repeat(slabs.half[l][a]);
    }
    return count;
}

/// Cells and weights of the samples that cut sixteen slabs from `at` on into 2^bits: row i holds those between piece
/// i - 1 and piece i.
template <class L>
void place_samples_between(const Plan& plan, const LitSamples& slabs, int at, int bits, Samples& out) {
    for (int part = 1; part < 1 << bits; ++part)
        for (int r = 0; r < kRays; r += static_cast<int>(L::count())) {
            const CellPosition<L> position = cell_position(
                plan.location, location_between(plan.inside, load_three<L>(slabs.location[0], at + r),
                                                load_three<L>(slabs.location[1], at + r), part, bits));
            const int to = part * kRays + r;
            for (std::size_t a = 0; a < 3; ++a) {
                store_whole(position.cell[a], out.cell[a].v + to);
                store(position.weight[a], out.weight[a].v + to);
            }
        }
}

}  // namespace

void wall_kernels_of(const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    lanes::with_word<Lanes, KnownRescales::nothing>(ways.location, [&]<class L>() {
        kernels.gather_second_looks = &gather_second_looks<L>;
        kernels.place_samples_between = &place_samples_between<L>;
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void wall_kernels(std::int64_t target, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, wall_kernels_of, ways, kernels)
}
}  // namespace squint::lanes
#endif
