// Stage 4 in lanes: slabs in which nothing is to be seen, and points between paired rows; compiled once per SIMD
// target.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_SLABS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_SLABS_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_SLABS_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_SLABS_INL_H
#endif

#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/classification/entries-inl.h"
#include "pipeline/machines/lanes/kernels.h"

#include <hwy/highway.h>

#include <limits>
#include <string>
#include <variant>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Slabs in which nothing is to be seen need no table.
template <class L>
struct Unseen {
    bool left_out;  // where a transparent slab changes no pixel
    L to, from;
    explicit Unseen(const Plan& plan)
        : left_out(plan.skips_empty_space),
          to(constant<L>(plan.unseen_to)),
          from(constant<L>(plan.unseen_from)) {}
    /// Where something may be seen, of slabs that may be left out.
    auto seen(L front, L back) const { return (to < max(front, back)) & (min(front, back) < from); }
    bool holds(L front, L back) const { return left_out && !any(seen(front, back)); }
};

template <class L>
HWY_INLINE void store_slab(const Slab<L>& slab, int at, lanes::Samples& samples) {
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { store(slab.color[c], samples.color[c].v + at); });
    store(slab.alpha, samples.alpha.v + at);
}

/// Post-classification of rows that are paired.  Nearly all samples want two rows and nothing else.
template <class L>
class PairedPoints {
  public:
    HWY_INLINE explicit PairedPoints(const Plan& plan)
        : entries_(std::get<PostClassification>(plan.method).entries),
          rows_(entries_.table.paired()),
          spacing_(entries_),
          to_color_(entries_.to_color),
          to_alpha_(entries_.to_alpha),
          full_(constant<L>(std::int64_t{1} << entries_.length_fraction)),
          least_opaque_(constant<L>(entries_.has_opaque ? entries_.least_opaque
                                                        : std::numeric_limits<std::int32_t>::max())) {}

    /// Why a plan's points are not between paired rows of words that are `known`; empty where they are.
    static std::string missing(const Plan& plan, const lanes::StageWay& way) {
        const auto* points = std::get_if<PostClassification>(&plan.method);
        if (!points) return "slabs are no points";
        if (std::string narrow = lanes::why_not_narrow(way, L::kKnown); !narrow.empty()) return narrow;
        if (!points->entries.table.paired() || points->entries.input_fraction > 14)
            return "entries have over 16 bits, or places between them over 14";
        return {};
    }

    HWY_INLINE Slab<L> classify(L input, L length) const {
        const EntryPosition<L> place = sub_entry_position(spacing_, spacing_.row_bits, input);
        const std::array<L, 4> between =
            lerp_paired_rows(rows_, place.entry, place.fraction, spacing_.input_fraction - spacing_.row_bits,
                             to_color_, to_alpha_);
        Slab<L> slab{{between[0], between[1], between[2]}, between[EntryLookup::alpha]};
        if (any((length < full_) | !(slab.alpha < least_opaque_)))
            slab = finish_point(entries_, input, between, length);
        return slab;
    }

  private:
    const EntryLookup& entries_;
    const std::int32_t* rows_;
    // Copies: nothing stored can change them.
    EntrySpacing spacing_;
    Rescale to_color_, to_alpha_;
    L full_, least_opaque_;
};

/// Post-classification of any rows.
template <class L>
class AnyPoints {
  public:
    HWY_INLINE explicit AnyPoints(const Plan& plan)
        : entries_(std::get<PostClassification>(plan.method).entries) {}
    HWY_INLINE Slab<L> classify(L input, L length) const { return classify_point(entries_, input, length); }

  private:
    const EntryLookup& entries_;
};

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
