// Stage 6 in lanes: every form.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_compositing.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/float_lanes.h"
#include "fixedpoint/lanes.h"
#include "pipeline/compositing.h"
#include "pipeline/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// The default's compositing: form w, straight colours, sums that no limit meets.  A transparent slab is the
/// identity.
bool is_plain(const CompositingStage& s) {
    const auto drops_bits = [](const Rescale& to) { return to.shift > 0 && !to.limits; };
    const auto does_nothing = [](const Rescale& to) { return to.shift == 0 && !to.limits; };
    return s.form == CompositingForm::w && !s.premultiplied &&
           s.contribution_fraction == s.transparency_fraction && drops_bits(s.to_contribution) &&
           drops_bits(s.to_color) && does_nothing(s.to_color_sum) && does_nothing(s.to_transparency);
}
/// Says so to the compiler.
HWY_INLINE void take_as_plain(CompositingStage& s) {
    s.form = CompositingForm::w, s.premultiplied = false;
    s.contribution_fraction = s.transparency_fraction;
    for (Rescale* to : {&s.to_contribution, &s.to_color, &s.to_color_sum, &s.to_transparency})
        to->limits = false;
    s.to_color_sum.shift = s.to_transparency.shift = 0;
    if (s.to_contribution.shift <= 0 || s.to_color.shift <= 0) __builtin_unreachable();
}

template <class L, bool kPlain, bool kKeepsT>
void composite_rows(const Plan& plan, const lanes::RayPacket& packet, int steps,
                    const lanes::Samples& samples, lanes::PixelPacket& pixels, lanes::Batch& between) {
    CompositingStage stage = plan.compositing;
    if constexpr (kPlain) take_as_plain(stage);
    const bool backwards = stage.form == CompositingForm::back_to_front;
    // A slab without opacity changes nothing: of rays that have ended, and of rows in which nothing is seen.
    const bool transparent_is_identity = kPlain || (plan.skips_empty_space && !stage.premultiplied);
    const L one = constant<L>(1), zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        Accumulated<L> pixel{
            {load<L>(pixels.color[0].v + r), load<L>(pixels.color[1].v + r), load<L>(pixels.color[2].v + r)},
            load<L>(pixels.transparency.v + r)};
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
            if (transparent_is_identity) {
                const L seen = select(here, alpha, zero);
                if (any(zero < seen)) composite(stage, pixel, color, seen);
            } else {
                Accumulated<L> next = pixel;
                composite(stage, next, color, alpha);
                for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
                    pixel.color[c] = select(here, next.color[c], pixel.color[c]);
                });
                pixel.transparency = select(here, next.transparency, pixel.transparency);
            }
            if (!backwards) active = here & goes_on(stage, pixel);
        }
        keep_transparency(backwards ? 0 : steps);
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { store(pixel.color[c], pixels.color[c].v + r); });
        store(pixel.transparency, pixels.transparency.v + r);
        store_whole(count, pixels.samples.v + r);
        store_whole(select(active, one, zero), pixels.active.v + r);
    }
}

}  // namespace

void compositing_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    lanes::with_word<Lanes, KnownRescales::halves_to_even>(way, [&]<class L>() {
        kernels.composite = plan.scene.output.depth      ? &composite_rows<L, false, true>
                            : is_plain(plan.compositing) ? &composite_rows<L, true, false>
                                                         : &composite_rows<L, false, false>;
    });
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
