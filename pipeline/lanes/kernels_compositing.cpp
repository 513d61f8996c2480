// Stage 6 in lanes: every form.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_compositing.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/lanes.h"
#include "pipeline/compositing.h"
#include "pipeline/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

template <class L>
void composite_rows(const Plan& plan, const lanes::RayPacket& packet, int steps,
                    const lanes::Samples& samples, lanes::PixelPacket& pixels) {
    const CompositingStage stage = plan.compositing;
    const bool backwards = stage.form == CompositingForm::back_to_front;
    const bool transparent_is_identity = plan.skips_empty_space && !stage.premultiplied;
    const L one = constant<L>(1), zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        Accumulated<L> pixel{
            {load<L>(pixels.color[0].v + r), load<L>(pixels.color[1].v + r), load<L>(pixels.color[2].v + r)},
            load<L>(pixels.transparency.v + r)};
        const L slabs = load<L>(packet.slabs.v + r);
        auto active = zero < load<L>(pixels.active.v + r);
        L count = load<L>(pixels.samples.v + r);
        for (int i = 0; i < steps; ++i) {
            const int step = backwards ? steps - 1 - i : i;
            const int at = step * lanes::kRays + r;
            const auto here = active & (constant<L>(samples.first + step) < slabs);
            const L alpha = load<L>(samples.alpha.v + at);
            count = count + select(here, one, zero);
            // A row in which nothing can be seen changes nothing, where a transparent slab is the identity.
            if (transparent_is_identity && !any(zero < alpha)) {
                if (!backwards) active = here;
                continue;
            }
            Accumulated<L> next = pixel;
            composite(stage, next,
                      {load<L>(samples.color[0].v + at), load<L>(samples.color[1].v + at),
                       load<L>(samples.color[2].v + at)},
                      alpha);
            for (std::size_t c = 0; c < 3; ++c) pixel.color[c] = select(here, next.color[c], pixel.color[c]);
            pixel.transparency = select(here, next.transparency, pixel.transparency);
            if (!backwards) active = here & goes_on(stage, pixel);
        }
        for (std::size_t c = 0; c < 3; ++c) store(pixel.color[c], pixels.color[c].v + r);
        store(pixel.transparency, pixels.transparency.v + r);
        store(count, pixels.samples.v + r);
        store(select(active, one, zero), pixels.active.v + r);
    }
}

}  // namespace

void compositing_kernel_of(const lanes::StageWay& way, lanes::StageKernels& kernels) {
    lanes::with_word<Lanes, KnownRescales::halves_to_even>(
        way, [&]<class L>() { kernels.composite = &composite_rows<L>; });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void compositing_kernel(std::int64_t target, const StageWay& way, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, compositing_kernel_of, way, kernels)
}
}  // namespace squint::lanes
#endif
