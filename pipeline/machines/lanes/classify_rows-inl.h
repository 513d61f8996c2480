// Stage 4 in lanes, over the rows of a packet; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_CLASSIFY_ROWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_CLASSIFY_ROWS_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_CLASSIFY_ROWS_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_CLASSIFY_ROWS_INL_H
#endif

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/slabs-inl.h"

#include <string>
#include <utility>
#include <variant>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// What a method computes of a sample: its input, for most.
template <class M, class L>
HWY_INLINE L sample_of(const M&, L input) {
    return input;
}

/// `samples` is nothing of the plan: what is stored there changes no constant of the method.
template <class L, class M>
void classify_rows(const Plan& plan, int steps, lanes::Samples& __restrict samples) {
    const M& method = std::get<M>(plan.method);
    const Unseen<L> unseen(plan);
    const L zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        L front_input = load<L>(samples.input.v + r);
        auto front = sample_of(method, front_input);
        bool has_front = true;
        for (int row = 0; row < steps; ++row) {
            const int at = row * lanes::kRays + r;
            const L back_input =
                load<L>(samples.input.v + at + (M::kNeedsBack || row + 1 < steps ? lanes::kRays : 0));
            if (unseen.holds(front_input, M::kNeedsBack ? back_input : front_input)) {
                store_slab<L>({{zero, zero, zero}, zero}, at, samples);
                has_front = false;
            } else {
                if (!has_front) front = sample_of(method, front_input);
                const auto back = sample_of(method, back_input);
                store_slab<L>(classify(method, front, back, load<L>(samples.length.v + at)), at, samples);
                front = back, has_front = true;
            }
            front_input = back_input;
        }
    }
}

/// The kernel of the plan's method M, whose fixed-point words know K of their rescales. In floats only where asked.
template <class M, KnownRescales K, bool kInFloats>
void choose_classification(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    const std::string name = "classify." + std::string(name_of(plan.scene.classification.method));
    const auto chose = [&](std::string why_not_faster) {
        kernels.chose(lanes::Segment::classify, name, std::move(why_not_faster));
    };
    if constexpr (kInFloats)
        if (way.is_float) {
            kernels.classify = &classify_rows<Lanes<float>, M>;
            return chose({});
        }
    lanes::with_integer_word<Lanes, K>(way, [&]<class L>() { kernels.classify = &classify_rows<L, M>; });
    chose(lanes::why_not_narrow(way, K));
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
