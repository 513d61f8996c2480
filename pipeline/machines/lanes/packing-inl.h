// How packed samples are made, the wanted lanes of several vectors side by side, and how they are read.
// Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_PACKING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_PACKING_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_PACKING_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_PACKING_INL_H
#endif

#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/packet.h"

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

#if HWY_TARGET <= HWY_AVX3
inline constexpr bool kCompresses = true;  // by an instruction
#else
inline constexpr bool kCompresses = HWY_LANES(lanes::Word) > 8;
#endif

/// The wanted lanes' numbers for every mask of eight, a byte each; zeros after them.
inline constexpr std::array<std::array<std::uint8_t, 8>, 256> kWantedLanes = [] {
    std::array<std::array<std::uint8_t, 8>, 256> lanes{};
    for (std::size_t mask = 0; mask < lanes.size(); ++mask) {
        std::size_t count = 0;
        for (std::size_t lane = 0; lane < 8; ++lane)
            if (mask >> lane & 1) lanes[mask][count++] = static_cast<std::uint8_t>(lane);
    }
    return lanes;
}();

/// The order of lanes, computed once: g++ 12 copies the table behind Highway's Compress at every use, all 2 KiB.
class Packing {
    using D = hwy::HWY_NAMESPACE::ScalableTag<lanes::Word>;

  public:
    template <class Mask>
    HWY_INLINE explicit Packing(Mask wanted)
        : count_(static_cast<int>(hwy::HWY_NAMESPACE::CountTrue(D(), wanted))),
          from_(order_of(wanted, count_)) {}
    int count() const { return count_; }
    /// Stores the wanted words, and after them other words up to a vector's end.
    template <class V>
    HWY_INLINE void operator()(V words, lanes::Word* to) const {
        hwy::HWY_NAMESPACE::StoreU(hwy::HWY_NAMESPACE::TableLookupLanes(words, from_), D(), to);
    }

  private:
    using Indices = decltype(hwy::HWY_NAMESPACE::IndicesFromVec(D(), hwy::HWY_NAMESPACE::Zero(D())));
    template <class Mask>
    static HWY_INLINE Indices order_of(Mask wanted, [[maybe_unused]] int count) {
        namespace hn = hwy::HWY_NAMESPACE;
        if constexpr (kCompresses) {
            const auto packed = hn::Compress(hn::Iota(D(), 0), wanted);
            return hn::IndicesFromVec(
                D(), hn::IfThenElseZero(hn::FirstN(D(), static_cast<std::size_t>(count)), packed));
        } else {
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(D(), wanted, bits);
            const hn::Rebind<std::uint8_t, D> bytes;
            return hn::IndicesFromVec(D(),
                                      hn::PromoteTo(D(), hn::LoadU(bytes, kWantedLanes[bits[0]].data())));
        }
    }
    int count_;
    Indices from_;
};

/// Three words each of the buffers.
template <class L>
HWY_INLINE std::array<L, 3> load_three(const lanes::Batch (&from)[3], int at) {
    return {load<L>(from[0].v + at), load<L>(from[1].v + at), load<L>(from[2].v + at)};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
