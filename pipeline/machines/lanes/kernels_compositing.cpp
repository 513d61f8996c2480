// Stage 6 in lanes, for every form.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_compositing.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/float_lanes-inl.h"
#include "fixedpoint/words/lane_quotients-inl.h"
#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/composite_units-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/default_facts.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// F: what is known of the stage.  kKeepsT: T at the slabs' ends is asked for.
template <class L, class F, bool kKeepsT>
void composite_rows(const Plan& plan, const lanes::RayPacket& packet, int steps,
                    const lanes::Samples& samples, lanes::PixelPacket& pixels, lanes::Batch& between) {
    CompositingStage stage = plan.compositing;
    F::assume(stage);
    const bool backwards = stage.form == CompositingForm::back_to_front;
    // A slab without opacity changes nothing: those of ended rays, and rows where nothing is visible.
    const bool transparent_is_identity = !F::kNone || (plan.skips_empty_space && !stage.premultiplied);
    const L one = constant<L>(1), zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        Accumulated<L> pixel{
            {load<L>(pixels.color[0].v + r), load<L>(pixels.color[1].v + r), load<L>(pixels.color[2].v + r)},
            load<L>(pixels.transparency.v + r),
            load<L>(pixels.remainder.v + r)};
        const L slabs = load_whole<L>(packet.slabs.v + r);
        auto active = zero < load_whole<L>(pixels.active.v + r);
        L count = load_whole<L>(pixels.samples.v + r);
        const auto keep_transparency = [&](int row) {
            if constexpr (kKeepsT) store(pixel.transparency, between.v + row * lanes::kRays + r);
        };
        for (int i = 0; i < steps; ++i) {
            const int step = backwards ? steps - 1 - i : i;
            const int at = step * lanes::kRays + r;
            keep_transparency(backwards ? step + 1 : step);
            const auto here = active & (constant<L>(samples.first + step) < slabs);
            const L alpha = load<L>(samples.alpha.v + at);
            const std::array<L, 3> color{load<L>(samples.color[0].v + at), load<L>(samples.color[1].v + at),
                                         load<L>(samples.color[2].v + at)};
            count = count + select(here, one, zero);
            if (transparent_is_identity && !any(zero < alpha)) {
                if (!backwards) active = here;
                continue;
            }
            Accumulated<L> next = pixel;
            composite(stage, next, color, alpha);
            for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
                pixel.color[c] = select(here, next.color[c], pixel.color[c]);
            });
            pixel.transparency = select(here, next.transparency, pixel.transparency);
            pixel.remainder = select(here, next.remainder, pixel.remainder);
            if (!backwards) active = here & goes_on(stage, pixel);
        }
        keep_transparency(backwards ? 0 : steps);
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { store(pixel.color[c], pixels.color[c].v + r); });
        store(pixel.transparency, pixels.transparency.v + r);
        store(pixel.remainder, pixels.remainder.v + r);
        store_whole(count, pixels.samples.v + r);
        store_whole(select(active, one, zero), pixels.active.v + r);
    }
}

/// Stage 6 of numbers from 0 to 1, in U.
template <class U, class F>
void composite_unit_rows(const Plan& plan, const lanes::RayPacket& packet, int steps,
                         const lanes::Samples& samples, lanes::PixelPacket& pixels, lanes::Batch&) {
    using L = Lanes<std::int32_t>;
    composite_units<U, L, F>(plan.compositing, packet, steps, samples.first, pixels,
                             [&](int at, Slab<U>& slab) SQUINT_WRITTEN_OUT {
                                 const PartsOf<U, L> alpha = load_parts<U, L>(samples.alpha.v + at);
                                 if (!any_part_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
                                         return constant<L>(0) < alpha[i];
                                     }))
                                     return false;
                                 slab.alpha = units_from<U, L>(alpha);
                                 for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
                                     slab.color[c] =
                                         units_from<U, L>(load_parts<U, L>(samples.color[c].v + at));
                                 });
                                 return true;
                             });
}

/// Computes only the transparency, front to back, without waiting for colours.
template <class L, class F>
void hide_rows(const Plan& plan, const lanes::RayPacket& packet, const lanes::PixelPacket& pixels, int steps,
               lanes::Samples& samples) {
    CompositingStage stage = plan.compositing;
    F::assume(stage);
    const L zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        L transparency = load<L>(pixels.transparency.v + r), remainder = load<L>(pixels.remainder.v + r);
        const L slabs = load_whole<L>(packet.slabs.v + r);
        auto active = zero < load_whole<L>(pixels.active.v + r);
        for (int step = 0; step < steps; ++step) {
            const int at = step * lanes::kRays + r;
            const auto here = active & (constant<L>(samples.first + step) < slabs);
            const L alpha = load<L>(samples.alpha.v + at);
            store(select(here, alpha, zero), samples.alpha.v + at);
            Accumulated<L> next{{zero, zero, zero}, transparency, remainder};
            composite(stage, next, {zero, zero, zero}, alpha);
            transparency = next.transparency = select(here, next.transparency, transparency);
            remainder = select(here, next.remainder, remainder);
            active = here & goes_on(stage, next);
        }
    }
}

/// One word a pixel from a packet, as to_double() of model.h has it.
HWY_INLINE Reals values_of(bool are_floats, const lanes::Word* words) {
    const hn::Rebind<lanes::Word, Reals::D> narrow;
    const auto bits = hn::LoadU(narrow, words);
    if (!are_floats) return Reals(hn::PromoteTo(Reals::D(), bits));
    return Reals(hn::PromoteTo(Reals::D(), hn::BitCast(hn::Rebind<float, Reals::D>(), bits)));
}

void store_colors(const Plan& plan, const lanes::PixelPacket& pixels, const lanes::PacketPlace& place,
                  Image& image) {
    const hn::Rebind<float, Reals::D> narrow;
    lanes::RealRow color[4];
    for (int r = 0; r < lanes::kRays; r += Reals::count()) {
        const auto value = [&](const lanes::Row& row) { return values_of(plan.float32, row.v + r); };
        const std::array<Reals, 4> values = color_of(
            plan.compositing,
            Accumulated<Reals>{{value(pixels.color[0]), value(pixels.color[1]), value(pixels.color[2])},
                               value(pixels.transparency),
                               Reals(0)});
        for (std::size_t c = 0; c < 4; ++c)
            hn::StoreU(hn::DemoteTo(narrow, values[c].v), narrow, color[c].v + r);
    }
    const int columns = std::min(lanes::kSide, place.right - place.left),
              rows = std::min(lanes::kSide, place.bottom - place.top);
    for (std::size_t c = 0; c < 4; ++c)  // R G B A come first
        for (int row = 0; row < rows; ++row) {
            const auto at =
                static_cast<std::size_t>(place.top + row) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(place.left);
            std::copy_n(color[c].v + row * lanes::kSide, columns, image.channels[c].values.data() + at);
        }
}

}  // namespace

void compositing_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    const CompositingStage& stage = plan.compositing;
    const bool keeps_t = plan.scene.output.depth;
    const auto choose = [&]<class L, class F>() {
        kernels.hide = &hide_rows<L, F>;
        if (!keeps_t) kernels.composite = &composite_rows<L, F, false>;
    };
    lanes::with_word<Lanes, KnownRescales::halves_to_even>(way, [&]<class L>() {
        if (keeps_t) kernels.composite = &composite_rows<L, NoFacts<CompositingStage>, true>;
        if (DefaultCompositing::hold(stage))
            choose.template operator()<L, DefaultCompositing>();
        else
            choose.template operator()<L, NoFacts<CompositingStage>>();
    });
    std::string missing = lanes::why_not_narrow(way, KnownRescales::nothing);
    if (missing.empty()) missing = UnitCompositing::missing(stage);
    if (missing.empty())
        choose.template operator()<Lanes<std::int32_t, KnownRescales::unit_products>, UnitCompositing>();
    // U has room for sums of slabs whose stage is known as Straight or Premultiplied.
    const auto in_units = [&]<class U, class Straight, class Premultiplied>() {
        if (keeps_t || !(Straight::hold(stage) || Premultiplied::hold(stage))) return false;
        kernels.composite =
            stage.premultiplied ? &composite_unit_rows<U, Premultiplied> : &composite_unit_rows<U, Straight>;
        return true;
    };
    bool units = missing.empty(), wide_units = false;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
    if (lanes::why_not_narrow(way, KnownRescales::nothing).empty())
        units |= in_units.template operator()<UnitLanes, UnitCompositing, PremultipliedUnitCompositing>();
#endif
    if constexpr (Lanes<std::int32_t>::count() > 1)
        if (!units && !way.is_float && way.bits == 64)
            wide_units =
                in_units
                    .template operator()<UnitReals, WideUnitCompositing, PremultipliedWideUnitCompositing>();
    if (units) missing.clear();  // nothing is faster
    const char* const name = keeps_t                           ? "composite.depth"
                             : units                           ? "composite.unit15"
                             : wide_units                      ? "composite.unit26"
                             : DefaultCompositing::hold(stage) ? "composite.default"
                                                               : "composite";
    kernels.chose(lanes::Segment::composite, name, missing);
    kernels.store_colors = &store_colors;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void compositing_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, compositing_kernel_of, plan, way, kernels)
}
}  // namespace squint::lanes
#endif
