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

template <class L>
HWY_INLINE std::array<L, 3> load_three(const lanes::Batch (&from)[3], int at) {
    return {load<L>(from[0].v + at), load<L>(from[1].v + at), load<L>(from[2].v + at)};
}

/// The bits of cells, a vector at a time.
class WallBits {
    static constexpr int kBits = lanes::kBlockBits;

  public:
    HWY_INLINE explicit WallBits(const NearWalls& near)
        : bits_(reinterpret_cast<const Word*>(near.bits.data())),
          row_(static_cast<Word>(near.box.blocks.x)),
          slice_(static_cast<Word>(near.box.blocks.x * near.box.blocks.y)),
          low_{static_cast<Word>(near.box.low.x), static_cast<Word>(near.box.low.y),
               static_cast<Word>(near.box.low.z)} {}

    /// One where cell (x, y, z) is wanted and holds a wall, else zero.  Others may lie outside the box.
    template <class Mask>
    HWY_INLINE Words operator()(Mask wanted, Words x, Words y, Words z) const {
        const hn::ScalableTag<Word> d;
        const auto block_along = [&](Words cell, int axis) SQUINT_WRITTEN_OUT {
            return hn::Sub(hn::ShiftRight<kBits>(cell), hn::Set(d, low_[axis]));
        };
        const auto block =
            hn::Add(block_along(x, 0), hn::Add(hn::Mul(hn::Set(d, row_), block_along(y, 1)),
                                               hn::Mul(hn::Set(d, slice_), block_along(z, 2))));
        const auto inside = hn::Set(d, lanes::kBlock - 1);
        const auto cell = hn::Or(hn::And(x, inside), hn::Or(hn::ShiftLeft<kBits>(hn::And(y, inside)),
                                                            hn::ShiftLeft<2 * kBits>(hn::And(z, inside))));
        const auto place = hn::Add(hn::ShiftLeft<std::countr_zero(unsigned{NearWalls::kWords})>(block),
                                   hn::ShiftRight<5>(cell));
        const auto word = hn::GatherIndex(d, bits_, hn::IfThenElseZero(wanted, place));
        const auto bit = hn::And(hn::Shr(word, hn::And(cell, hn::Set(d, 31))), hn::Set(d, 1));
        return hn::IfThenElseZero(wanted, bit);
    }

  private:
    const Word* bits_;
    Word row_, slice_, low_[3];
};

/// Packs those of slabs [0, steps) of rays that go on which met no wall but have one in a cell on their way, and
/// repeats the last one up to a multiple of sixteen.  L: the lanes of locations.
template <class L>
int gather_second_looks(const Plan& plan, const NearWalls& near, const lanes::RayPacket& rays,
                        const lanes::PixelPacket& pixels, int steps, const Samples& s, LitSamples& slabs) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d);
    const Word one = plan.float32 ? std::bit_cast<Word>(static_cast<float>(plan.inside.one_alpha))
                                  : static_cast<Word>(plan.inside.one_alpha);
    const bool per_ray = plan.lit && plan.shading.needs_ray();
    const WallBits walls(near);
    const auto at_sample = [&](auto wanted, int at) SQUINT_WRITTEN_OUT {
        return walls(wanted, hn::Load(d, s.cell[0].v + at), hn::Load(d, s.cell[1].v + at),
                     hn::Load(d, s.cell[2].v + at));
    };
    constexpr int kStep = std::max(kLanes, static_cast<int>(L::count()));
    alignas(64) Word middle[3][kStep];
    int count = 0;
    for (int r = 0; r < kRays; r += kStep) {
        for (int row = 0; row < steps; ++row) {
            const int first = row * kRays + r;
            // Slabs behind a ray's last one have a location of their own, but are none.
            const auto open = [&](int at) SQUINT_WRITTEN_OUT {
                const int ray = at % kRays;
                const auto there = hn::And(hn::Gt(hn::Load(d, rays.slabs.v + ray), hn::Set(d, s.first + row)),
                                           hn::Gt(hn::Load(d, pixels.active.v + ray), zero));
                return hn::And(there, hn::Lt(hn::Load(d, s.alpha.v + at), hn::Set(d, one)));
            };
            bool any_open = false;
            for (int i = 0; i < kStep; i += kLanes) any_open = any_open || !hn::AllFalse(d, open(first + i));
            if (!any_open) continue;
            for (int i = 0; i < kStep; i += static_cast<int>(L::count())) {
                const CellPosition<L> position = cell_position(
                    plan.location, location_between(plan.inside, load_three<L>(s.location, first + i),
                                                    load_three<L>(s.location, first + kRays + i), 1, 1));
                for (std::size_t a = 0; a < 3; ++a) store_whole(position.cell[a], middle[a] + i);
            }
            for (int i = 0; i < kStep; i += kLanes) {
                const int at = first + i, ray = at % kRays;
                auto wanted = open(at);
                if (hn::AllFalse(d, wanted)) continue;
                const auto half_way = walls(wanted, hn::Load(d, middle[0] + i), hn::Load(d, middle[1] + i),
                                            hn::Load(d, middle[2] + i));
                const auto there =
                    hn::Or(half_way, hn::Or(at_sample(wanted, at), at_sample(wanted, at + kRays)));
                wanted = hn::And(wanted, hn::Gt(there, zero));
                if (hn::AllFalse(d, wanted)) continue;
                const Packing packing(wanted);
                const auto pack = [&](const Word* from, lanes::Batch& to) {
                    packing(hn::Load(d, from), to.v + count);
                };
                packing(hn::Iota(d, at), slabs.from.v + count);
                for (int end = 0; end < 2; ++end) {
                    for (int a = 0; a < 3; ++a)
                        pack(s.location[a].v + at + end * kRays, slabs.location[end][a]);
                    pack(s.input.v + at + end * kRays, slabs.input[end]);
                }
                pack(s.length.v + at, slabs.length);
                for (int a = 0; per_ray && a < 3; ++a) {
                    pack(rays.view[a].v + ray, slabs.view[a]);
                    for (int l = 0; l < plan.shading.lights; ++l)
                        pack(rays.half[l][a].v + ray, slabs.half[l][a]);
                }
                count += packing.count();
            }
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
