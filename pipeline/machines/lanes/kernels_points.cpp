// Stage 4 of points between paired rows in lanes, and stage 6 with it where nothing stands between the two.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_points.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/composite_units-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/slabs-inl.h"
#include "pipeline/stages/default_facts.h"

#include <array>
#include <string>
#include <variant>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using L = Lanes<std::int32_t, KnownRescales::halves_up>;

void classify_paired_points(const Plan& plan, int steps, lanes::Samples& samples) {
    const PairedPoints<L> points(plan);
    const Unseen<L> unseen(plan);
    const L zero = constant<L>(0);
    for (int at = 0; at < steps * lanes::kRays; at += static_cast<int>(L::count())) {
        const L input = load<L>(samples.input.v + at), length = load<L>(samples.length.v + at);
        store_slab(
            unseen.holds(input, input) ? Slab<L>{{zero, zero, zero}, zero} : points.classify(input, length),
            at, samples);
    }
}

/// Points that are classified in 32 bits, narrowed or widened then.
template <class U, class Points>
class ConvertedPoints {
  public:
    HWY_INLINE ConvertedPoints(const Plan& plan, const std::int16_t*) : points_(plan) {}
    HWY_INLINE Slab<U> classify(const PartsOf<U, L>& input, const lanes::Samples& samples, int at) const {
        std::array<PartsOf<U, L>, 3> color;
        PartsOf<U, L> alpha;
        for_parts_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
            const Slab<L> slab = points_.classify(input[i], load<L>(samples.length.v + at + i * L::count()));
            for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { color[c][i] = slab.color[c]; });
            alpha[i] = slab.alpha;
        });
        return {{units_from<U, L>(color[0]), units_from<U, L>(color[1]), units_from<U, L>(color[2])},
                units_from<U, L>(alpha)};
    }

  private:
    Points points_;
};

/// Colours and opacities stay in registers, and are composited in U.
template <class U, class F, class Points>
void classify_and_composite_points(const Plan& plan, const std::int16_t* rows, const lanes::RayPacket& packet,
                                   int steps, const lanes::Samples& samples, lanes::PixelPacket& pixels) {
    const Points points(plan, rows);
    const Unseen<L> unseen(plan);
    composite_units<U, L, F>(
        plan.compositing, packet, steps, samples.first, pixels,
        [&](int at, Slab<U>& slab) SQUINT_WRITTEN_OUT {
            const PartsOf<U, L> input = load_parts<U, L>(samples.input.v + at);
            if (unseen.left_out && !any_part_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
                    return unseen.seen(input[i], input[i]);
                }))
                return false;
            slab = points.classify(input, samples, at);
            return true;
        });
}

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
using U = UnitLanes;
using Parts = UnitParts<L>;

/// Points between rows of 16 bits.
class UnitPoints {
  public:
    HWY_INLINE UnitPoints(const Plan& plan, const std::int16_t* rows)
        : entries_(std::get<PostClassification>(plan.method).entries),
          rows_(rows),
          weight_bits_(weight_bits_of(entries_)),
          full_(constant<L>(std::int64_t{1} << entries_.length_fraction)),
          below_opaque_(constant<U>(entries_.has_opaque ? entries_.least_opaque - 1 : 1 << 15)) {}

    /// See StageKernels::unit_rows.
    static std::vector<std::int16_t> rows_of(const EntryLookup& e) {
        const int bits = weight_bits_of(e);
        if (bits < 1 || bits > 15 || e.to_color.shift != bits || e.to_alpha.shift != bits) return {};
        constexpr std::int64_t kOne = 1 << 15;
        std::vector<std::int16_t> rows(static_cast<std::size_t>(4 * (e.table.rows() + 1)));
        for (int i = 0; i <= e.table.rows(); ++i)
            for (int c = 0; c < 4; ++c) {
                const std::int64_t word = e.table.word(std::min(i, e.table.rows() - 1), c);
                const std::int64_t before = i == 0 ? word : e.table.word(i - 1, c);
                if (word < 0 || word > kOne || word - before == kOne) return {};
                rows[static_cast<std::size_t>(4 * i + c)] = static_cast<std::int16_t>(-word);
            }
        return rows;
    }

    HWY_INLINE Slab<U> classify(const Parts& input, const lanes::Samples& samples, int at) const {
        // Inputs end at the last entry; its row stands twice, so that nothing is clamped.
        alignas(64) std::int32_t row[U::count()];
        Parts weight;
        for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
            store(floor_shift(input[i], weight_bits_), row + i * L::count());
            weight[i] = fraction_bits(input[i], weight_bits_);
        });
        const std::array<U, 4> between =
            lerp_unit_rows<L>(rows_, row, hn::ShiftLeftSame(narrow_words<L>(weight), 15 - weight_bits_));
        Slab<U> slab{{between[0], between[1], between[2]}, between[EntryLookup::alpha]};
        const bool some_short = !samples.all_full && any_part_of<U, L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
            return load<L>(samples.length.v + at + i * L::count()) < full_;
        });
        if (some_short || any(below_opaque_ < slab.alpha)) finish(input, samples, at, slab);
        return slab;
    }

  private:
    static int weight_bits_of(const EntryLookup& e) { return e.input_fraction - e.row_bits; }
    /// Few points need this.
    HWY_NOINLINE void finish(const Parts& input, const lanes::Samples& samples, int at, Slab<U>& slab) const {
        const Parts between[] = {words_of<L>(slab.color[0]), words_of<L>(slab.color[1]),
                                 words_of<L>(slab.color[2]), words_of<L>(slab.alpha)};
        Parts alpha;
        for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
            alpha[i] =
                finish_point(entries_, input[i], {between[0][i], between[1][i], between[2][i], between[3][i]},
                             load<L>(samples.length.v + at + i * L::count()))
                    .alpha;
        });
        slab.alpha = units_of<L>(alpha);
    }

    const EntryLookup& entries_;
    const std::int16_t* rows_;
    int weight_bits_;
    L full_;
    U below_opaque_;
};

void choose_fused(const EntryLookup& entries, lanes::StageKernels& kernels) {
    kernels.unit_rows = UnitPoints::rows_of(entries);
    const bool fit = !kernels.unit_rows.empty();
    kernels.classify_composite =
        fit ? &classify_and_composite_points<U, UnitCompositing, UnitPoints>
            : &classify_and_composite_points<U, UnitCompositing, ConvertedPoints<U, PairedPoints<L>>>;
    kernels.chose(lanes::Segment::classify_composite, "classify+composite.unit15",
                  fit ? "" : "rows do not fit 16 bits");
}
#else
void choose_fused(const EntryLookup&, lanes::StageKernels&) {}
#endif

}  // namespace

void point_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    if (!std::holds_alternative<PostClassification>(plan.method)) return;
    const std::string name = "classify." + std::string(name_of(plan.scene.classification.method));
    const std::string missing = PairedPoints<L>::missing(plan, ways.classification);
    kernels.chose(lanes::Segment::classify, missing.empty() ? name + ".paired" : name, missing);
    if (missing.empty()) kernels.classify = &classify_paired_points;
    const OutputSettings& output = plan.scene.output;
    if (plan.wants_depth || output.depth || output.normals) return;
    if (missing.empty() && UnitCompositing::hold(plan.compositing) &&
        lanes::why_not_narrow(ways.compositing, KnownRescales::nothing).empty())
        return choose_fused(std::get<PostClassification>(plan.method).entries, kernels);
    if constexpr (L::count() > 1)
        if (lanes::why_not_narrow(ways.classification, L::kKnown).empty() && ways.compositing.bits == 64 &&
            WideUnitCompositing::hold(plan.compositing)) {
            kernels.classify_composite =
                &classify_and_composite_points<UnitReals, WideUnitCompositing,
                                               ConvertedPoints<UnitReals, AnyPoints<L>>>;
            kernels.chose(lanes::Segment::classify_composite, "classify+composite.unit26",
                          missing.empty() ? UnitCompositing::missing(plan.compositing) : missing);
        }
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void point_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, point_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
