// Stages 1 and 2 in lanes.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_sampling.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/float_lanes-inl.h"
#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/classification/entries-inl.h"
#include "pipeline/machines/lanes/fetch-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"

#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;

/// What becomes of samples' cells: they are stored.
class KeepsCells {
  public:
    HWY_INLINE explicit KeepsCells(lanes::Samples& out) : out_(out) {}
    /// Cells to come lie between these, lane by lane; or anywhere.
    template <class L>
    HWY_INLINE void between(const std::array<L, 3>&, const std::array<L, 3>&) const {}
    HWY_INLINE void anywhere() const {}
    /// Samples `at` and on have these cells.
    template <class L>
    HWY_INLINE void operator()(int at, const std::array<L, 3>& cell) const {
        for_three([&](std::size_t a) SQUINT_WRITTEN_OUT { store_whole(cell[a], out_.cell[a].v + at); });
    }

  private:
    lanes::Samples& out_;
};
/// ... or their places are, and the cells too where one has no place, or where kKeepsCells.
template <bool kKeepsCells>
class KeepsPlaces {
  public:
    HWY_INLINE KeepsPlaces(const lanes::VoxelSource& source, lanes::Samples& out)
        : places_(source), near_(source), cells_(out), out_(out) {}

    template <class L>
    HWY_INLINE void between(const std::array<L, 3>& low, const std::array<L, 3>& high) {
        are_near_ = near_.take({low[0].v, low[1].v, low[2].v}, {high[0].v, high[1].v, high[2].v});
    }
    HWY_INLINE void anywhere() { are_near_ = false; }
    template <class L>
    HWY_INLINE void operator()(int at, const std::array<L, 3>& cell) const {
        const L place{are_near_ ? near_(cell[0].v, cell[1].v, cell[2].v)
                                : places_(cell[0].v, cell[1].v, cell[2].v)};
        store_whole(place, out_.place.v + at);
        if (kKeepsCells || any(place < constant<L>(0))) cells_(at, cell);
    }

  private:
    CellPlaces places_;
    NearPlaces near_;
    KeepsCells cells_;
    bool are_near_ = false;
    lanes::Samples& out_;
};

/// Stage 1.  `keep_cell`: what becomes of cells.
template <class L, bool kKeepsLocation, class KeepCell>
HWY_INLINE void locate_into(const Plan& plan, const lanes::RayPacket& packet, int from, int to,
                            lanes::Samples& out, KeepCell keep_cell) {
    const LocationStage stage = plan.location;  // a copy: no store can change it
    const L full = constant<L>(std::int64_t{1} << stage.length_fraction);
    const auto keep = [&](int at, const std::array<L, 3>& location, const CellPosition<L>& position)
                          SQUINT_WRITTEN_OUT {
                              for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
                                  store(position.weight[a], out.weight[a].v + at);
                                  if constexpr (kKeepsLocation) store(location[a], out.location[a].v + at);
                              });
                              keep_cell(at, position.cell);
                          };
    // P0 + kV by adding V: exact, hence the same, except in floats.
    struct Part {
        int at;  // its first ray
        RayWords<L> ray;
        std::array<L, 3> exact, strides;
    };
    Part parts[kRays / L::count()];
    const L start = constant<L>(out.first + from);
    int r = 0;
    for (Part& part : parts) {
        part.at = r;
        for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
            part.ray.first[a] = load<L>(packet.first[a].v + r);
            part.ray.step[a] = load<L>(packet.step[a].v + r);
            part.exact[a] = exact_location(stage, part.ray, start, static_cast<int>(a));
            part.strides[a] = stride(stage, part.ray, static_cast<int>(a));
        });
        r += static_cast<int>(L::count());
    }
    if constexpr (!RealWord<L>) {
        // A batch that ends before any ray's last slab, both ends inside the box: nothing is clamped.
        const L rows = constant<L>(to - from - 1), end_of_batch = constant<L>(out.first + to - 1);
        auto leaves = constant<L>(0) < constant<L>(0);
        const L lowest = constant<L>(std::numeric_limits<std::int32_t>::min()),
                highest = constant<L>(std::numeric_limits<std::int32_t>::max());
        std::array<L, 3> low{highest, highest, highest}, high{lowest, lowest, lowest};
        for (const Part& part : parts) {
            const L slabs = load_whole<L>(packet.slabs.v + part.at);
            leaves = leaves | ((constant<L>(0) < slabs) & !(end_of_batch < slabs - constant<L>(1)));
            for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
                const L begin = rounded_inside(stage, part.exact[a]),
                        end = rounded_inside(stage, part.exact[a] + rows * part.strides[a]);
                const L least = min(begin, end), most = max(begin, end);
                leaves = leaves | (least < constant<L>(0)) | !(most < constant<L>(stage.limit[a]));
                low[a] = min(low[a], least), high[a] = max(high[a], most);
            });
        }
        if (!any(leaves)) {
            const auto cells_of = [&](const std::array<L, 3>& at) {
                return cell_position_inside(stage, at).cell;
            };
            keep_cell.between(cells_of(low), cells_of(high));
            if (!out.all_full) {
                const int whole = from == 0 ? lanes::kRows : to;
                for (int at = from * kRays; at < whole * kRays; at += static_cast<int>(L::count()))
                    store(full, out.length.v + at);
                out.all_full = from == 0;
            }
            LocationStage inside = stage;
            L bias = constant<L>(0);
            if constexpr (L::kKnown == KnownRescales::halves_up) {  // added once, before the first row
                bias = constant<L>(inside.to_location.bias);
                inside.to_location.bias = 0;
            }
            for (const Part& part : parts) {
                std::array<L, 3> exact = part.exact, location;
                for_three([&](std::size_t a) SQUINT_WRITTEN_OUT { exact[a] = exact[a] + bias; });
                for (int at = from * kRays + part.at; at < to * kRays; at += kRays) {
                    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
                        location[a] = rounded_inside(inside, exact[a]);
                        exact[a] = exact[a] + part.strides[a];
                    });
                    keep(at, location, cell_position_inside(stage, location));
                }
            }
            return;
        }
    }
    keep_cell.anywhere();
    out.all_full = false;
    for (Part& part : parts) {
        r = part.at;
        part.ray.last_index = load_whole<L>(packet.last_index.v + r);
        for_three([&](std::size_t a)
                      SQUINT_WRITTEN_OUT { part.ray.last[a] = load<L>(packet.last[a].v + r); });
        const L last_length = load<L>(packet.last_length.v + r),
                last_slab = load_whole<L>(packet.slabs.v + r) - constant<L>(1);
        for (int row = from; row < to; ++row) {
            const int at = row * kRays + r;
            const L k = constant<L>(out.first + row);
            std::array<L, 3> location;
            for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
                if constexpr (RealWord<L>)
                    part.exact[a] = exact_location(stage, part.ray, k, static_cast<int>(a));
                location[a] = rounded_location(stage, part.ray, part.exact[a], k, static_cast<int>(a));
                if constexpr (!RealWord<L>) part.exact[a] = part.exact[a] + part.strides[a];
            });
            keep(at, location, cell_position(stage, location));
            store(select(k == last_slab, last_length, full), out.length.v + at);
        }
    }
}

template <class L, bool kKeepsLocation>
void locate_rows(const Plan& plan, const lanes::RayPacket& packet, int from, int to, lanes::Samples& out) {
    locate_into<L, kKeepsLocation>(plan, packet, from, to, out, KeepsCells(out));
}
template <class L, bool kKeepsCells, bool kKeepsLocation>
void locate_and_address_rows(const Plan& plan, const lanes::VoxelSource& source,
                             const lanes::RayPacket& packet, int from, int to, lanes::Samples& out) {
    locate_into<L, kKeepsLocation>(plan, packet, from, to, out, KeepsPlaces<kKeepsCells>(source, out));
}

template <class L>
void step_rows_aside(const Plan& plan, const lanes::LitSamples& lit, int axis, bool ahead, int rows,
                     lanes::Samples& out) {
    const LocationStage stage = plan.location;
    for (int at = 0; at < rows * kRays; at += static_cast<int>(L::count())) {
        std::array<L, 3> location;
        for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
            // Lanes past the last sample hold garbage: clamp them, so that the fetch stays in bounds.
            location[a] =
                clamp(load<L>(lit.location[0][a].v + at), constant<L>(0), constant<L>(stage.limit[a]));
        });
        L& moved = location[static_cast<std::size_t>(axis)];
        moved = beside(stage, moved, axis, ahead);
        const CellPosition<L> position = cell_position(stage, location);
        for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
            store_whole(position.cell[a], out.cell[a].v + at);
            store(position.weight[a], out.weight[a].v + at);
        });
    }
}

/// A cell as fetched: two corners a word.
template <class L, bool kBelow15Bits>
struct PackedCell {
    std::array<L, 4> pair;
    L at(int i) const { return half_of(pair[static_cast<std::size_t>(i / 2)], i % 2 != 0); }
    L along_x(int i, L weight, int weight_bits, const Rescale& to) const {
        if constexpr (std::is_same_v<typename L::Element, std::int32_t>)
            if (weight_bits <= 14)
                return blend_pairs<L::kKnown>(signed_pairs<kBelow15Bits>(pair[static_cast<std::size_t>(i)].v),
                                              pair_weights(weight.v, weight_bits),
                                              kBelow15Bits ? 0 : 1 << (weight_bits + 15), to);
        return quantise(blend(at(2 * i), at(2 * i + 1), weight, weight_bits), to);
    }
};

template <class L>
HWY_INLINE std::array<L, 3> weights_at(const lanes::Samples& samples, int at) {
    return {load<L>(samples.weight[0].v + at), load<L>(samples.weight[1].v + at),
            load<L>(samples.weight[2].v + at)};
}
/// Stage 2 of fetched corners.
template <class L, bool kBelow15Bits>
HWY_INLINE L stored_sample(const InterpolationStage& stage, const lanes::Samples& samples, int at) {
    PackedCell<L, kBelow15Bits> cell;
    cell.pair = {load<L>(samples.pair[0].v + at), load<L>(samples.pair[1].v + at),
                 load<L>(samples.pair[2].v + at), load<L>(samples.pair[3].v + at)};
    return interpolate(stage, cell, weights_at<L>(samples, at));
}

template <class L, bool kBelow15Bits>
void interpolate_scalar_rows(const Plan& plan, int from, int to, lanes::Samples& samples) {
    const InterpolationStage stage = plan.interpolation;
    for (int at = from * kRays; at < to * kRays; at += static_cast<int>(L::count()))
        store(stored_sample<L, kBelow15Bits>(stage, samples, at), samples.input.v + at);
}

/// I: the lanes from a sample to table entries, no narrower than L.
template <class L, class I, bool kBelow15Bits>
void interpolate_rows(const Plan& plan, int from, int to, lanes::Samples& samples) {
    const InterpolationStage stage = plan.interpolation;
    const InputStage input = plan.input;
    for (int at = from * kRays; at < to * kRays; at += static_cast<int>(L::count())) {
        const L sample = stored_sample<L, kBelow15Bits>(stage, samples, at);
        if constexpr (std::is_same_v<typename L::Element, typename I::Element>)
            store(classification_input(input, I{sample.v}), samples.input.v + at);
        else
            store(sample, samples.input.v + at);
    }
    if constexpr (!std::is_same_v<typename L::Element, typename I::Element>)
        for (int at = from * kRays; at < to * kRays; at += static_cast<int>(I::count()))
            store(classification_input(input, load<I>(samples.input.v + at)), samples.input.v + at);
}

/// Stage 2 of cells in blocks, whose corners stay in registers.
template <class L, class T, bool kBelow15Bits>
void fetch_and_interpolate_rows(const Plan& plan, const lanes::VoxelSource& source, int from, int to,
                                lanes::Samples& samples, int next_from, int next_to,
                                const lanes::Samples& next) {
    const InterpolationStage stage = plan.interpolation;
    const InputStage input = plan.input;
    CellCorners<T> corners(source);
    int asked = next_from;
    for (int row = from; row < to; ++row) {
        if (asked < next_to) request_cells<T>(source, next, asked++);
        for (int at = row * kRays; at < (row + 1) * kRays; at += static_cast<int>(L::count())) {
            const auto pairs = corners.pairs(samples, at);
            const PackedCell<L, kBelow15Bits> cell{{L{pairs[0]}, L{pairs[1]}, L{pairs[2]}, L{pairs[3]}}};
            const L sample = interpolate(stage, cell, weights_at<L>(samples, at));
            store(classification_input(input, sample), samples.input.v + at);
        }
    }
    for (; asked < next_to; ++asked) request_cells<T>(source, next, asked);
}

/// The segments of two stages each: cells in blocks, in narrow lanes that round halves up.
void fused_kernels_of(const Plan& plan, const lanes::StageWays& ways, const lanes::VoxelSource& source,
                      lanes::StageKernels& kernels) {
    using lanes::Segment;
    constexpr KnownRescales kKnown = KnownRescales::halves_up;
    using L = Lanes<std::int32_t, kKnown>;
    if constexpr (L::count() > 1) {
        std::string missing = !source.cells ? "the volume lies as it is" : "";
        for (const lanes::StageWay& way : {ways.location, ways.interpolation, ways.input})
            if (missing.empty()) missing = lanes::why_not_narrow(way, kKnown);
        if (!missing.empty()) return kernels.chose(Segment::fetch, "fetch", missing);
        kernels.locate_address = !lanes::keeps_cells(plan) ? &locate_and_address_rows<L, false, false>
                                 : plan.keeps_locations()  ? &locate_and_address_rows<L, true, true>
                                                           : &locate_and_address_rows<L, true, false>;
        kernels.chose(Segment::locate_address, "locate+address");
        const bool bytes = source.volume->type == ScalarType::u8;
        kernels.fetch_interpolate = bytes ? &fetch_and_interpolate_rows<L, std::uint8_t, true>
                                    : source.volume->largest < 1 << 15
                                        ? &fetch_and_interpolate_rows<L, std::uint16_t, true>
                                        : &fetch_and_interpolate_rows<L, std::uint16_t, false>;
        kernels.chose(Segment::fetch_interpolate, bytes ? "fetch+interpolate.u8" : "fetch+interpolate.u16");
    }
}

}  // namespace

void sampling_kernels_of(const Plan& plan, const lanes::StageWays& ways, const lanes::VoxelSource& source,
                         lanes::StageKernels& kernels) {
    lanes::with_word<Lanes, KnownRescales::halves_up>(ways.location, [&]<class L>() {
        kernels.locate = plan.keeps_locations() ? &locate_rows<L, true> : &locate_rows<L, false>;
        kernels.step_aside = &step_rows_aside<L>;
    });
    lanes::with_word<Lanes, KnownRescales::halves_up>(ways.interpolation, [&]<class L>() {
        constexpr bool kNarrow = std::is_same_v<typename L::Element, std::int32_t>;
        const bool below_15_bits = plan.volume->largest < 1 << 15;
        kernels.interpolate_scalars = kNarrow && below_15_bits ? &interpolate_scalar_rows<L, kNarrow>
                                                               : &interpolate_scalar_rows<L, false>;
        if constexpr (!kNarrow)
            kernels.interpolate = &interpolate_rows<L, L, false>;
        else
            lanes::with_integer_word<Lanes, KnownRescales::halves_up>(ways.input, [&]<class I>() {
                kernels.interpolate =
                    below_15_bits ? &interpolate_rows<L, I, true> : &interpolate_rows<L, I, false>;
            });
    });
    fused_kernels_of(plan, ways, source, kernels);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void sampling_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, const VoxelSource& source,
                      StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, sampling_kernels_of, plan, ways, source, kernels)
}
}  // namespace squint::lanes
#endif
