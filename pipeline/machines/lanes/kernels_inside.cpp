// Light inside slabs, in lanes: its places, gradients between a slab's ends, and slabs in pieces.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_inside.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/location-inl.h"

#include <algorithm>
#include <array>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::LitSamples;
using lanes::Samples;
using lanes::Word;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(hn::ScalableTag<Word>()));

/// Packs the samples at the ends of visible slabs, each once.
int gather_slab_ends(const Plan& plan, const lanes::RayPacket& rays, int steps, const Samples& s,
                     lanes::Row& known, LitSamples& ends) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1);
    const bool from_samples = plan.gradient_from_samples();
    int count = 0;
    for (int at = 0; at < (steps + 1) * kRays; at += kLanes) {
        const auto slabs = hn::Load(d, rays.slabs.v + at % kRays);
        // One of the slab in this row, or of the slab in front of it.
        const auto seen = [&](int place) {
            const auto within = hn::Gt(slabs, hn::Set(d, s.first + place / kRays));
            return hn::And(hn::Gt(hn::Load(d, s.alpha.v + place), zero), within);
        };
        auto wanted = hn::Gt(zero, zero);
        if (at < steps * kRays) wanted = seen(at);
        if (at >= kRays)
            wanted = hn::Or(wanted, seen(at - kRays));
        else
            wanted = hn::And(wanted, hn::Eq(hn::Load(d, known.v + at), zero));
        if (at >= steps * kRays) hn::Store(hn::IfThenElseZero(wanted, one), d, known.v + at % kRays);
        if (hn::AllFalse(d, wanted)) continue;
        const Packing packing(wanted);
        const auto pack = [&](const Word* from, lanes::Batch& to) {
            packing(hn::Load(d, from), to.v + count);
        };
        packing(hn::Iota(d, at), ends.from.v + count);
        for (int a = 0; a < 3; ++a) {
            if (from_samples) {
                pack(s.location[a].v + at, ends.location[0][a]);
                continue;
            }
            pack(s.cell[a].v + at, ends.cell[a]);
            pack(s.weight[a].v + at, ends.weight[a]);
        }
        count += packing.count();
    }
    return count;
}

/// Packs those of `count` slabs with so many cuts, and repeats the last one up to a multiple of sixteen.
int pick_by_cuts(const Plan& plan, int count, int cuts, const LitSamples& lit, LitSamples& picked) {
    const hn::ScalableTag<Word> d;
    const ShadingStage& shading = plan.shading;
    int many = 0;
    const auto copy_all = [&](auto&& copy) {
        copy(lit.from, picked.from), copy(lit.length, picked.length);
        for (int end = 0; end < 2; ++end) {
            copy(lit.input[end], picked.input[end]);
            for (int a = 0; a < 3; ++a) copy(lit.location[end][a], picked.location[end][a]);
        }
        for (int a = 0; shading.needs_ray() && a < 3; ++a) {
            copy(lit.view[a], picked.view[a]);
            for (int l = 0; l < shading.lights; ++l) copy(lit.half[l][a], picked.half[l][a]);
        }
    };
    for (int at = 0; at < count; at += kLanes) {
        auto wanted = hn::Eq(hn::Load(d, lit.cuts.v + at), hn::Set(d, cuts));
        wanted = hn::And(wanted, hn::FirstN(d, static_cast<std::size_t>(count - at)));
        if (hn::AllFalse(d, wanted)) continue;
        const Packing packing(wanted);
        copy_all([&](const lanes::Batch& from, lanes::Batch& to) {
            packing(hn::Load(d, from.v + at), to.v + many);
        });
        many += packing.count();
    }
    if (many == 0) return 0;
    copy_all([&](const lanes::Batch&, lanes::Batch& to) {
        for (int i = many; i % kRays != 0; ++i) to.v[i] = to.v[many - 1];
    });
    return many;
}

/// Stores places `part` 2^-bits of the way along slabs [at, at + count) as places [to, to + count).
template <class L>
void place_between(const Plan& plan, const LitSamples& ends, int at, int count, int part, int bits,
                   LitSamples& places, int to) {
    const bool from_samples = plan.gradient_from_samples();
    for (int i = 0; i < count; i += static_cast<int>(L::count())) {
        const std::array<L, 3> location =
            location_between(plan.inside, load_three<L>(ends.location[0], at + i),
                             load_three<L>(ends.location[1], at + i), part, bits);
        if (from_samples) {
            for (std::size_t a = 0; a < 3; ++a) store(location[a], places.location[0][a].v + to + i);
            continue;
        }
        const CellPosition<L> position = cell_position(plan.location, location);
        for (std::size_t a = 0; a < 3; ++a) {
            store_whole(position.cell[a], places.cell[a].v + to + i);
            store(position.weight[a], places.weight[a].v + to + i);
        }
    }
}

/// Cuts sixteen slabs from `at` on into 2^bits: row i holds part i, between its inputs and the next row's.
template <class L>
void cut_sixteen(const Plan& plan, const LitSamples& slabs, int at, int bits, Samples& out) {
    const InsideStage& s = plan.inside;
    const int last = 1 << bits;
    for (int r = 0; r < kRays; r += static_cast<int>(L::count())) {
        const L front = load<L>(slabs.input[0].v + at + r), back = load<L>(slabs.input[1].v + at + r),
                length = load<L>(slabs.length.v + at + r);
        L near_length = constant<L>(0);
        store(front, out.input.v + r);
        for (int i = 1; i <= last; ++i) {
            const L far_length = i == last ? length : length_up_to(s, length, i, bits);
            store(i == last ? back : input_between(s, front, back, i, bits), out.input.v + i * kRays + r);
            store(far_length - near_length, out.length.v + (i - 1) * kRays + r);
            near_length = far_length;
        }
    }
}

/// A component of the gradients at the fronts of packed slabs, or at their backs.
HWY_INLINE auto end_words(const lanes::EndGradients& ends, int component, const Word* from, bool back) {
    const hn::ScalableTag<Word> d;
    return hn::GatherIndex(d, ends.component[component].v + (back ? kRays : 0), hn::Load(d, from));
}
/// Those of kStep packed slabs, side by side.
template <int kStep>
HWY_INLINE void load_ends(const lanes::EndGradients& ends, const Word* from, Word (&end)[2][3][kStep]) {
    const hn::ScalableTag<Word> d;
    for (int e = 0; e < 2; ++e)
        for (int a = 0; a < 3; ++a)
            for (int i = 0; i < kStep; i += kLanes)
                hn::Store(end_words(ends, a, from + i, e == 1), d, end[e][a] + i);
}
template <class L, int kStep>
HWY_INLINE std::array<L, 3> end_at(const Word (&end)[3][kStep], int i) {
    return {load<L>(end[0] + i), load<L>(end[1] + i), load<L>(end[2] + i)};
}
/// The raw gradients of packed slabs: sum_of_ends() over the words of the buffers.
void add_slab_ends(const Plan& plan, int count, const lanes::EndGradients& ends, LitSamples& lit) {
    const hn::ScalableTag<Word> d;
    const hn::ScalableTag<float> df;
    for (int at = 0; at < count; at += kLanes)
        for (int a = 0; a < 3; ++a) {
            const auto front = end_words(ends, a, lit.from.v + at, false),
                       back = end_words(ends, a, lit.from.v + at, true);
            const auto sum = plan.float32
                                 ? hn::BitCast(d, hn::Add(hn::BitCast(df, front), hn::BitCast(df, back)))
                                 : hn::Add(front, back);
            hn::Store(sum, d, lit.gradient[a].v + at);
        }
}

/// Raw gradients on the way from front to back: gradient_up_to() of the words of the buffers.
template <class L>
void lerp_slab_ends(const Plan& plan, int count, const lanes::EndGradients& ends, const lanes::Batch& from,
                    const lanes::SlabLight& light, LitSamples& near, LitSamples* far) {
    constexpr int kStep = std::max(kLanes, static_cast<int>(L::count()));
    alignas(64) Word end[2][3][kStep];
    for (int first = 0; first < count; first += kStep) {
        load_ends<kStep>(ends, from.v + first, end);
        const auto lerp_to = [&](const lanes::Batch& way, LitSamples& to) {
            for (int i = 0; i < kStep; i += static_cast<int>(L::count())) {
                const std::array<L, 3> gradient = gradient_up_to(
                    plan.inside, end_at<L>(end[0], i), end_at<L>(end[1], i), load<L>(way.v + first + i));
                for (std::size_t a = 0; a < 3; ++a) store(gradient[a], to.gradient[a].v + first + i);
            }
        };
        lerp_to(light.way[0], near);
        if (far) lerp_to(light.way[1], *far);
    }
}

const PrefixLookup* prefix_of(const Plan& plan) {
    return std::visit(
        [](const auto& m) -> const PrefixLookup* {
            if constexpr (requires { m.prefix; }) return &m.prefix;
            return nullptr;
        },
        plan.method);
}
/// Where packed slabs' light comes from.
template <class L>
void find_places(const Plan& plan, int count, const LitSamples& lit, lanes::SlabLight& light) {
    const PrefixLookup& prefix = *prefix_of(plan);
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const LightPlaces<L> places =
            places_of_light(plan.inside, prefix, load<L>(lit.input[0].v + at), load<L>(lit.input[1].v + at),
                            load<L>(lit.length.v + at));
        store(places.near, light.way[0].v + at), store(places.far, light.way[1].v + at);
        store(places.share, light.share.v + at);
    }
}
template <class L>
void join_slab_places(const Plan& plan, int count, const lanes::SlabLight& light, const LitSamples& far,
                      LitSamples& lit) {
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const std::array<L, 3> color =
            light_of_places(plan.inside, load_three<L>(lit.color, at), load_three<L>(far.color, at),
                            load<L>(light.share.v + at));
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
    }
}

/// log2 of the number of pieces of packed slabs.
template <class L>
void find_cuts(const Plan& plan, int count, const lanes::EndGradients& ends, LitSamples& lit) {
    const L zero = constant<L>(0), least = constant<L>(plan.inside.least_cut);
    constexpr int kStep = std::max(kLanes, static_cast<int>(L::count()));
    alignas(64) Word end[2][3][kStep];
    for (int first = 0; first < count; first += kStep) {
        load_ends<kStep>(ends, lit.from.v + first, end);
        for (int i = 0; i < kStep; i += static_cast<int>(L::count())) {
            const L cuts = cuts_between(end_at<L>(end[0], i), end_at<L>(end[1], i));
            store_whole(select(load<L>(lit.alpha.v + first + i) < least, zero, cuts), lit.cuts.v + first + i);
        }
    }
}

/// Joins the pieces of sixteen slabs, piece i in row i, to colours and opacities in `slabs` from `at` on.
template <class L>
void join_sixteen(const Plan& plan, const lanes::Batch (&color)[3], const lanes::Batch& alpha, int bits,
                  LitSamples& slabs, int at) {
    for (int r = 0; r < kRays; r += static_cast<int>(L::count())) {
        PieceLight<L> sum = no_piece<L>(plan.inside);
        for (int i = 0; i < 1 << bits; ++i) {
            const int place = i * kRays + r;
            add_piece(plan.inside, sum, load_three<L>(color, place), load<L>(alpha.v + place));
        }
        const std::array<L, 3> joined = color_of_pieces(plan.inside, sum);
        for (std::size_t c = 0; c < 3; ++c) store(joined[c], slabs.color[c].v + at + r);
        store(opacity_of_pieces(plan.inside, sum), slabs.alpha.v + at + r);
    }
}

}  // namespace

void inside_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    constexpr KnownRescales kNothing = KnownRescales::nothing;
    kernels.gather_ends = &gather_slab_ends;
    kernels.add_ends = &add_slab_ends;
    kernels.pick_by_cuts = &pick_by_cuts;
    lanes::with_word<Lanes, kNothing>(ways.location,
                                      [&]<class L>() { kernels.place_between = &place_between<L>; });
    lanes::with_word<Lanes, kNothing>(ways.classification, [&]<class L>() { kernels.cut = &cut_sixteen<L>; });
    if (lights_at_places(plan.inside.rule))
        lanes::with_word<Lanes, KnownRescales::halves_to_even>(
            ways.places, [&]<class L>() { kernels.find_light = &find_places<L>; });
    lanes::with_word<Lanes, KnownRescales::halves_to_even>(
        ways.between, [&]<class L>() { kernels.lerp_ends = &lerp_slab_ends<L>; });
    lanes::with_word<Lanes, kNothing>(ways.shading, [&]<class L>() {
        kernels.join_places = &join_slab_places<L>;
        kernels.find_cuts = &find_cuts<L>;
    });
    lanes::with_word<Lanes, kNothing>(plan.lit ? ways.shading : ways.classification,
                                      [&]<class L>() { kernels.join = &join_sixteen<L>; });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void inside_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, inside_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
