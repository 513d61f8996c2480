// Light that fades from one end of a slab to the other, in lanes.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_fading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/inside-inl.h"

#include <array>
#include <variant>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::LitSamples;

/// Where light of packed slabs lies as it fades.
template <class L, class M>
void find_fades(const Plan& plan, int count, const LitSamples& lit, lanes::SlabLight& light) {
    const M& method = std::get<M>(plan.method);
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const L front = load<L>(lit.input[0].v + at), back = load<L>(lit.input[1].v + at),
                length = load<L>(lit.length.v + at);
        const Slab<L> slab{load_three<L>(lit.color, at), load<L>(lit.alpha.v + at)};
        FadingLight<L> fades;
        if constexpr (requires { method.fades; })
            fades = fading_light(method, front, back, length, slab);
        else
            fades = fading_light_of_quarters(plan.inside, method, front, back, length, slab);
        store(constant<L>(0), light.way[0].v + at), store(fades.end, light.way[1].v + at);
        for (std::size_t k = 0; k < static_cast<std::size_t>(fades.count); ++k)
            for (std::size_t c = 0; c < 4; ++c) store(fades.part[k][c], light.part[k][c].v + at);
    }
}

}  // namespace

void fading_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    if (!lights_fade(plan.inside.rule)) return;
    constexpr KnownRescales kNothing = KnownRescales::nothing;
    lanes::with_word<Lanes, kNothing>(ways.classification, [&]<class L>() {
        std::visit(
            [&]<class M>(const M& m) {
                constexpr bool kInFloats =
                    !std::is_same_v<M, MomentSeries>;  // else its floats are the model's
                if constexpr (requires { m.prefix; } && (kInFloats || !RealWord<L>))
                    if constexpr (requires { m.fades; } || !M::kPremultiplied)
                        kernels.find_light = &find_fades<L, M>;
            },
            plan.method);
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void fading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, fading_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
