// Stage 6 of form w over words for numbers from 0 to 1, for slabs from anywhere; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_COMPOSITE_UNITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_COMPOSITE_UNITS_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_COMPOSITE_UNITS_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_COMPOSITE_UNITS_INL_H
#endif

#include "fixedpoint/words/unit_lanes-inl.h"
#include "fixedpoint/words/unit_reals-inl.h"
#include "pipeline/classification/entries.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/default_facts.h"

#include <hwy/highway.h>

#include <array>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Vectors of L that hold as many words as U.
template <class U, class L>
using PartsOf = std::array<L, U::count() / L::count()>;

/// Calls f(i) for each, written out: see unrolled-inl.h.
template <class U, class L, class F>
HWY_INLINE void for_parts_of(F&& f) {
    constexpr std::size_t kParts = U::count() / L::count();
    static_assert(kParts <= 2);
    f(std::size_t{0});
    if constexpr (kParts == 2) f(std::size_t{1});
}
/// Whether f(i) holds in a lane of some part.
template <class U, class L, class F>
HWY_INLINE bool any_part_of(F&& f) {
    auto mask = f(std::size_t{0});
    if constexpr (U::count() / L::count() == 2) mask = mask | f(std::size_t{1});
    return any(mask);
}
template <class U, class L>
HWY_INLINE PartsOf<U, L> load_parts(const lanes::Word* from) {
    PartsOf<U, L> parts;
    for_parts_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT { parts[i] = load<L>(from + i * L::count()); });
    return parts;
}
template <class U, class L>
HWY_INLINE void store_parts(const PartsOf<U, L>& parts, lanes::Word* to) {
    for_parts_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT { store(parts[i], to + i * L::count()); });
}
template <class U, class L>
HWY_INLINE U units_from(const PartsOf<U, L>& parts) {
    if constexpr (std::is_same_v<U, UnitReals>)
        return unit_reals(parts[0]);
    else
        return units_of<L>(parts);
}

/// Composites slabs [0, steps).  F: what is known of the stage.  source(at, slab): gives the slabs of places `at` and
/// on; false where nothing is to be seen in them.
template <class U, class L, class F, class Source>
HWY_INLINE void composite_units(const CompositingStage& of_plan, const lanes::RayPacket& packet, int steps,
                                int first, lanes::PixelPacket& pixels, const Source& source) {
    CompositingStage stage = of_plan;
    F::assume(stage);
    const U zero = constant<U>(0), one = constant<U>(1);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(U::count())) {
        const auto units = [&](const lanes::Row& row) {
            return units_from<U, L>(load_parts<U, L>(row.v + r));
        };
        Accumulated<U> pixel{{units(pixels.color[0]), units(pixels.color[1]), units(pixels.color[2])},
                             units(pixels.transparency)};
        PartsOf<U, L> left = load_parts<U, L>(packet.slabs.v + r);  // slabs of each ray, of this batch's
        for (L& slabs : left)
            slabs = clamp(slabs - constant<L>(first), constant<L>(0), constant<L>(lanes::kSteps));
        const U slabs = units_from<U, L>(left);
        U count = zero;
        auto active = zero < units(pixels.active);
        for (int step = 0; step < steps; ++step) {
            active = active & (constant<U>(step) < slabs);
            if (!any(active)) break;
            count = count + only(active, one);
            Slab<U> slab;
            if (!source(step * lanes::kRays + r, slab)) continue;
            // Transparent slabs change nothing: those of rays that have ended, too.
            const U alpha = only(active, slab.alpha);
            if (stage.premultiplied)
                for_three([&](std::size_t c)
                              SQUINT_WRITTEN_OUT { slab.color[c] = only(active, slab.color[c]); });
            take_contribution(stage, pixel, slab.color,
                              rounded_contribution(stage, alpha, pixel.transparency));
            active = active & goes_on(stage, pixel);
        }
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
            store_parts<U, L>(words_of<L>(pixel.color[c]), pixels.color[c].v + r);
        });
        store_parts<U, L>(words_of<L>(pixel.transparency), pixels.transparency.v + r);
        PartsOf<U, L> counted = words_of<L>(count);
        for (std::size_t i = 0; i < counted.size(); ++i)
            counted[i] = counted[i] + load<L>(pixels.samples.v + r + i * L::count());
        store_parts<U, L>(counted, pixels.samples.v + r);
        store_parts<U, L>(words_of<L>(only(active, one)), pixels.active.v + r);
    }
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
