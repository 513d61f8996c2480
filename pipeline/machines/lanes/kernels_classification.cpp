// Stage 4 in lanes: every method.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_classification.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

static_assert(BlendsPairs<Lanes<std::int32_t>> && LoadsRows<Lanes<float>>,
              "lerp_rows has lost its fast ways");

/// pips.h's rows by loads of whole ones.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> prefix_rows(const PowerSeriesOfOrder1& m,
                                                                            Lanes<std::int32_t, K> row) {
    return load_two_rows(m.rows->data(), row);
}
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> prefix_rows(const PowerSeriesOfOrder1& m,
                                                                     Lanes<float, K> row) {
    return load_two_rows(m.float_rows->data(), row);
}

namespace {

/// What a method knows of a sample: its input, for most.
template <class M, class L>
HWY_INLINE L sample_of(const M&, L input) {
    return input;
}

/// Slabs in which nothing is to be seen need no table.
template <class L>
struct Unseen {
    bool left_out;  // where a transparent slab changes no pixel
    L to, from;
    explicit Unseen(const Plan& plan)
        : left_out(plan.skips_empty_space),
          to(constant<L>(plan.unseen_to)),
          from(constant<L>(plan.unseen_from)) {}
    bool holds(L front, L back) const {
        return left_out && !any((to < max(front, back)) & (min(front, back) < from));
    }
};

template <class L>
HWY_INLINE void store_slab(const Slab<L>& slab, int at, lanes::Samples& samples) {
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { store(slab.color[c], samples.color[c].v + at); });
    store(slab.alpha, samples.alpha.v + at);
}

template <class L, class M>
void classify_rows(const Plan& plan, int steps, lanes::Samples& samples) {
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

/// Post-classification of rows that are paired.  Nearly all samples want two entries and nothing else.
template <class L>
void classify_paired_entries(const Plan& plan, int steps, lanes::Samples& samples) {
    const EntryLookup& entries = std::get<PostClassification>(plan.method).entries;
    const std::int32_t* const rows = entries.table.paired();
    const EntrySpacing spacing = entries;  // copies: nothing stored can change them
    const Rescale to_color = entries.to_color, to_alpha = entries.to_alpha;
    const Unseen<L> unseen(plan);
    const L zero = constant<L>(0), full = constant<L>(std::int64_t{1} << entries.length_fraction),
            least_opaque = constant<L>(entries.has_opaque ? entries.least_opaque
                                                          : std::numeric_limits<std::int32_t>::max());
    for (int at = 0; at < steps * lanes::kRays; at += static_cast<int>(L::count())) {
        const L input = load<L>(samples.input.v + at), length = load<L>(samples.length.v + at);
        if (unseen.holds(input, input)) {
            store_slab<L>({{zero, zero, zero}, zero}, at, samples);
            continue;
        }
        const EntryPosition<L> place = sub_entry_position(spacing, spacing.row_bits, input);
        const std::array<L, 4> between = lerp_paired_rows(
            rows, place.entry, place.fraction, spacing.input_fraction - spacing.row_bits, to_color, to_alpha);
        Slab<L> slab{{between[0], between[1], between[2]}, between[EntryLookup::alpha]};
        if (any((length < full) | !(slab.alpha < least_opaque)))
            slab = finish_point(entries, input, between, length);
        store_slab(slab, at, samples);
    }
}

}  // namespace

void classification_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    std::visit(
        [&]<class M>([[maybe_unused]] const M& m) {
            // Entries alone meet no limit; prefix sums' depths may.
            constexpr KnownRescales kKnown = std::is_same_v<M, PostClassification>
                                                 ? KnownRescales::halves_up
                                                 : KnownRescales::halves_to_even;
            if constexpr (!std::is_same_v<M, MomentSeries>)  // its float words run in the model
                if (way.is_float) {
                    kernels.classify = &classify_rows<Lanes<float>, M>;
                    return;
                }
            lanes::with_integer_word<Lanes, kKnown>(
                way, [&]<class L>() { kernels.classify = &classify_rows<L, M>; });
            if constexpr (std::is_same_v<M, PostClassification>)
                if (way.bits == 32 && way.known >= kKnown && m.entries.table.paired() &&
                    m.entries.input_fraction <= 14)
                    kernels.classify = &classify_paired_entries<Lanes<std::int32_t, kKnown>>;
        },
        plan.method);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void classification_kernel(std::int64_t target, const Plan& plan, const StageWay& way,
                           StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, classification_kernel_of, plan, way, kernels)
}
}  // namespace squint::lanes
#endif
