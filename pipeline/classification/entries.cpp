#include "pipeline/classification/entries.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>

namespace squint {
namespace {

// An alpha as it comes back from the table's word.  sqrt(alpha) is stored in F bits and expanded to c + (c >>
// (F - 1)), so that 0 and 1 are exact; the square has 2 F fraction bits (Squeeze 4.4.2, as corrected).  Its
// R G B T of 8, 8, 8 and 15 bits stores 1 - alpha.
double decoded_alpha(double alpha, const Spec& spec, AlphaEncoding encoding) {
    if (encoding == AlphaEncoding::alpha) return alpha;
    const int f = spec.format.fraction_bits;
    if (encoding == AlphaEncoding::transparency)
        return 1 - std::ldexp(static_cast<double>(quantise_real(1 - alpha, spec)), -f);
    const std::int64_t code = std::min(quantise_real(std::sqrt(alpha), spec), (std::int64_t{1} << f) - 1);
    const double root =
        static_cast<double>(code + (code >> (f - 1))) / static_cast<double>(std::int64_t{1} << f);
    return root * root;
}

}  // namespace

std::vector<WireFormats> classification_wires(const PresetInputs& in) {
    constexpr Rounding trn = Rounding::trn;
    const int sum = accumulating_bits(in), wide_sum = wide_accumulating_bits(in), total = in.total_depth_bits;
    // Where the sums have 15 bits, an entry's depth times an input's 8 fraction bits must fit 32, too.
    const int depth = sum > 15 ? sum + 1 : std::min(20, 23 - in.depth_bits);
    // Before a short slab takes its part, the full step's depth must fit.  Deep steps take their integer bits
    // from two spare fraction bits first; 32-bit lanes then multiply as before.
    const int deep = std::max(4, in.depth_bits);
    const auto sums = [&](Wire wire) -> WireFormats {
        return {wire, unsigned_spec(total, std::min(depth, held(31 - total)), kToEven),
                unsigned_spec(std::max(9, total), 15, trn), unsigned_spec(std::max(9, total), 15, trn),
                unsigned_spec(total, 24, kToEven)};
    };
    const Spec squeeze = unsigned_spec(1, 15, trn), byte = unsigned_spec(0, 8, trn),
               eight_bit = unsigned_spec(1, 8, trn), wide = unsigned_spec(1, wide_sum, kToEven);
    return {
        {Wire::classification_input, unsigned_spec(in.entry_bits, held(8 + in.entry_levels_bits), kHalvesUp),
         unsigned_spec(12, 0, trn), unsigned_spec(in.entry_bits, 0, trn),
         unsigned_spec(in.entry_bits, held(std::min(18 + in.entry_levels_bits, 31 - in.entry_bits)),
                       kToEven)},
        {Wire::table_color, unsigned_spec(1, 15, kToEven), squeeze, byte, wide},
        {Wire::table_alpha, unsigned_spec(1, sum, kToEven), squeeze, byte, wide},
        sums(Wire::table_extinction),
        sums(Wire::table_moment),
        {Wire::slab_depth, unsigned_spec(deep, held(std::max(sum + 7 - deep, sum + 1)), kHalvesUp),
         unsigned_spec(4, 15, trn), unsigned_spec(4, 8, trn),
         unsigned_spec(std::max(5, in.depth_bits), 24, kToEven)},
        {Wire::slab_ratio, unsigned_spec(1, 15, kHalvesUp), squeeze, eight_bit, wide},
        {Wire::slab_alpha, unsigned_spec(1, sum, kHalvesUp), squeeze, eight_bit, wide},
        {Wire::slab_color, unsigned_spec(1, sum, kHalvesUp), squeeze, eight_bit, wide}};
}

InputStage build_input(const StageInputs& in) {
    require_integer_bits(
        in, Wire::classification_input, bits_for(in.entries.coordinate(in.volume.largest)),
        fmt::format("entry {} of the transfer function", in.entries.coordinate(in.volume.largest)));
    InputStage s;
    s.scaled = in.entries.scalars_per_entry != 1;
    s.scale_exact = 1 / in.entries.scalars_per_entry;
    // Entries per level, with 20 significant bits.
    s.scale_fraction = s.scaled ? std::clamp(20 - bits_for(s.scale_exact) +
                                                 std::max(0, bits_for(in.entries.scalars_per_entry) - 1),
                                             0, 36)
                                : 0;
    s.scale =
        s.scaled
            ? static_cast<std::int64_t>(std::floor(s.scale_exact * std::ldexp(1.0, s.scale_fraction) + 0.5))
            : 1;
    s.to_input = rescale(in, fraction(in, Wire::sample) + s.scale_fraction, Wire::classification_input);
    // The last entry, or where no voxel comes near it and the format ends before, its end: lanes as narrow as the
    // format hold the limit, too.
    const Format input = in.specs[Wire::classification_input].format;
    s.highest =
        std::min(static_cast<std::int64_t>(in.entries.size() - 1) << input.fraction_bits, input.largest());
    return s;
}

void require_range(const WireSpecs& specs, Wire wire, double largest, const char* what) {
    const Format& f = specs[wire].format;
    int bits = 0;
    while (std::ldexp(1.0, bits) <= largest) ++bits;
    if (bits > f.integer_bits)
        throw InputError(
            fmt::format("precision.{}: {} has {} integer bits, but {} reach {:.6g}, which needs {}",
                        info(wire).name, to_string(f), f.integer_bits, what, largest, bits));
}

namespace {

OpacityUnit computed_opacity_unit(const WireSpecs& specs) {
    const Spec depth = specs[Wire::slab_depth], alpha = specs[Wire::slab_alpha];
    OpacityUnit unit;
    unit.depth_fraction = depth.format.fraction_bits;
    unit.alpha_fraction = alpha.format.fraction_bits;
    // Lines between rows err by h^2 / 8: h = 2^-b with 2 b + 3 >= F + 1 stays below half a last bit.
    unit.row_bits = std::min({(alpha.format.fraction_bits - 1) / 2 + 1, 12, depth.format.fraction_bits});
    // Rows up to the depth that is opaque to the last bit, or the largest depth the wire holds.
    const double deepest =
        std::min(std::ldexp(1.0, depth.format.integer_bits), 0.6932 * (alpha.format.fraction_bits + 2));
    const int rows = static_cast<int>(std::ceil(std::ldexp(deepest, unit.row_bits))) + 2;
    const int fraction = std::min(alpha.format.fraction_bits + 2, kMostChosenFractionBits);
    const Spec row_spec{{1, fraction, false}, Rounding::rnd_conv, Overflow::sat};
    unit.rows = Table(rows, 1);
    unit.rows.wire = static_cast<int>(Wire::slab_alpha);
    std::vector<double> opacity(static_cast<std::size_t>(rows));
    for (int i = 0; i < rows; ++i) opacity[static_cast<std::size_t>(i)] = -std::ldexp(i, -unit.row_bits);
    portable::expm1_each(opacity, opacity);
    for (double& value : opacity) value = -value;
    unit.rows.fill(opacity, std::array{row_spec});
    unit.rows.set_raw(rows - 1, 0, row_spec.format.one());
    unit.to_alpha =
        Rescale(fraction + unit.depth_fraction - unit.row_bits, alpha, static_cast<int>(Wire::slab_alpha));
    return unit;
}

}  // namespace

OpacityUnit build_opacity_unit(const WireSpecs& specs, double longest_ray) {
    // The rows do not depend on the transfer function: those of the last few formats are kept and shared.
    struct Kept {
        Spec depth, alpha;
        OpacityUnit unit;
    };
    static thread_local std::vector<Kept> kept;
    const Spec depth = specs[Wire::slab_depth], alpha = specs[Wire::slab_alpha];
    for (const Kept& k : kept)
        if (k.depth == depth && k.alpha == alpha) {
            OpacityUnit unit = k.unit;
            unit.longest_ray = longest_ray;
            return unit;
        }
    if (kept.size() == 4) kept.erase(kept.begin());
    kept.push_back({depth, alpha, computed_opacity_unit(specs)});
    OpacityUnit unit = kept.back().unit;
    unit.longest_ray = longest_ray;
    return unit;
}

double lost_along_ray(double error, double least, double longest) {
    const double slabs = least * longest > 1 ? 1 / least : longest;
    return 255 * error * slabs * portable::exp(-slabs * least);
}

Approximation OpacityUnit::error() const {
    // At a depth x below a row h the line loses at most x h / 2, never more than h^2 / 8; x e^-x <= 1 / e.
    const double h = std::ldexp(1.0, -row_bits);
    return {"1 - exp(-x) between its rows", 255 * std::min(longest_ray * h * h / 8, h / 2 * 0.36788)};
}

EntryRows rows_for_opacity(const ClassificationInputs& in) {
    // Between rows d apart in depth, at a depth x or more, an opacity is at most d^2 / 8 above its chord;
    // where rows begin at zero, at most d / 2 of its depth.
    const auto lost = [&](int bits) {
        double worst = 0;
        for (int i = 0; i + 1 < in.entries.size(); ++i) {
            const Entry &a = in.entries.entry[static_cast<std::size_t>(i)],
                        &b = in.entries.entry[static_cast<std::size_t>(i) + 1];
            if (a.opaque && b.opaque) continue;
            const double d = std::ldexp(std::abs(b.extinction - a.extinction) * in.step_world, -bits);
            const double least = std::min(a.extinction, b.extinction) * in.step_world;
            if (d * d / 8 * std::min(in.longest_ray, 1 / (least + d / 4)) * 255 <= worst) continue;
            worst = std::max(worst, std::min(lost_along_ray(std::min(d * d / 8, 1.0), least, in.longest_ray),
                                             255 * std::min(d / 2 * 0.36788, 1.0)));
        }
        return worst;
    };
    EntryRows rows{0, lost(0)};
    while (rows.lsb8 > kMayBeLeftOut && rows.bits < in.input_fraction &&
           (in.entries.size() - 1) << (rows.bits + 1) <= kMostEntryRows)
        ++rows.bits, rows.lsb8 = lost(rows.bits);
    return rows;
}

namespace {

/// Straight colours and opacities of a full step, 2^bits rows an entry.
void write_rows(const ClassificationInputs& in, int bits, std::span<double> opacity, std::span<double> seen) {
    const int per_entry = 1 << bits, last = in.entries.size() - 1;
    for (int i = 0, row = 0; i <= last; ++i)
        for (int k = 0; k < per_entry && row < static_cast<int>(opacity.size()); ++k, ++row) {
            const Entry &a = in.entries.entry[static_cast<std::size_t>(i)],
                        &b = in.entries.entry[static_cast<std::size_t>(std::min(i + 1, last))];
            const double way = std::ldexp(k, -bits);
            const Vec3 color = k == 0 ? a.color : a.color + (b.color - a.color) * way;
            const double extinction =
                k == 0 ? a.extinction : a.extinction + (b.extinction - a.extinction) * way;
            opacity[static_cast<std::size_t>(row)] = -(extinction * in.step_world);
            double* const to = seen.data() + 4 * row;
            to[0] = color.x, to[1] = color.y, to[2] = color.z;
        }
    portable::expm1_each(opacity, opacity);
    for (std::size_t i = 0; i < opacity.size(); ++i)
        seen[4 * i + EntryLookup::alpha] = opacity[i] = -opacity[i];
}

}  // namespace

EntryLookup build_entry_lookup(const ClassificationInputs& in) {
    const WireSpecs& specs = in.specs;
    const Spec color = specs[Wire::table_color], alpha = specs[Wire::table_alpha],
               extinction = specs[Wire::table_extinction];
    const int n = in.entries.size();
    EntryLookup lookup;
    const EntryRows needed = rows_for_opacity(in);
    const int bits = lookup.row_bits = needed.bits, rows = ((n - 1) << bits) + 1;
    lookup.bend = {"the opacity of a step between rows", needed.lsb8};
    lookup.table = Table(rows, 4, in.keeps_exact), lookup.matter = Table(n, 2, in.keeps_exact);
    lookup.table.wire = static_cast<int>(Wire::table_color);
    lookup.table.last_wire = static_cast<int>(Wire::table_alpha);
    lookup.matter.wire = static_cast<int>(Wire::table_extinction);
    lookup.matter.last_wire = -1;  // flags
    lookup.input_fraction = in.input_fraction;
    lookup.last_segment = n - 2;
    // The square of a root of F bits has 2 F bits; a plain alpha has its own F.
    const bool rooted = in.settings.encoding == AlphaEncoding::sqrt_alpha;
    if (rooted && alpha.format.fraction_bits == 0)
        throw InputError(
            fmt::format("precision.table_alpha: {} has no fraction bits, but the root of an "
                        "opacity needs 1 or more",
                        to_string(alpha.format)));
    const bool encoded = in.settings.encoding != AlphaEncoding::alpha;
    if (encoded && !rooted && alpha.format.integer_bits == 0)
        throw InputError(
            fmt::format("precision.table_alpha: {} has no integer bits, but a transparency of 1.0 needs 1",
                        to_string(alpha.format)));
    Spec stored = alpha;
    if (rooted) stored.format = {1, std::min(2 * alpha.format.fraction_bits, kMostChosenFractionBits), false};
    const auto size = static_cast<std::size_t>(n), row_count = static_cast<std::size_t>(rows);
    const std::unique_ptr<double[]> numbers =
        std::make_unique_for_overwrite<double[]>(5 * row_count + 2 * size);
    const std::span<double> opacity(numbers.get(), row_count), seen(numbers.get() + row_count, 4 * row_count),
        matter(numbers.get() + 5 * row_count, 2 * size);
    bool opaque = false;  // the entry before
    for (std::size_t i = 0; i < size; ++i) {
        const Entry& entry = in.entries.entry[i];
        matter[2 * i] = entry.extinction * in.step_world;
        matter[2 * i + 1] = entry.opaque ? static_cast<int>(EntryLookup::entry_is) : 0;
        if (entry.opaque && opaque) matter[2 * i - 1] += static_cast<int>(EntryLookup::segment_is);
        opaque = entry.opaque;
        lookup.has_opaque = lookup.has_opaque || opaque;
    }
    write_rows(in, bits, opacity, seen);
    for (std::size_t i = 0; encoded && i < row_count; ++i)
        seen[4 * i + EntryLookup::alpha] = decoded_alpha(opacity[i], alpha, in.settings.encoding);
    lookup.table.fill(seen, std::array{color, color, color, stored});
    for (int i = 0; encoded && i < rows; ++i)
        lookup.table.set_exact(i, EntryLookup::alpha, opacity[static_cast<std::size_t>(i)], stored.format);
    lookup.matter.fill(matter,
                       std::array{extinction, Spec{{2, 0, false}, Rounding::rnd_conv, Overflow::sat}});
    lookup.table.pair_rows();
    const Spec slab_alpha = specs[Wire::slab_alpha];
    // A straight colour leaves on the wire slab_ratio, an opacity on slab_alpha.
    lookup.to_color = Rescale(color.format.fraction_bits + in.input_fraction - bits, specs[Wire::slab_ratio],
                              static_cast<int>(Wire::slab_ratio));
    lookup.to_alpha = Rescale(stored.format.fraction_bits + in.input_fraction - bits, slab_alpha,
                              static_cast<int>(Wire::slab_alpha));
    lookup.least_opaque = lookup.to_alpha.wraps ? slab_alpha.format.smallest() : slab_alpha.format.largest();
    for (int i = 0; lookup.has_opaque && i < n; ++i)
        if (in.entries.entry[static_cast<std::size_t>(i)].opaque)
            lookup.least_opaque = std::min(
                lookup.least_opaque, quantise(shift_left(lookup.table.word(i << bits, EntryLookup::alpha),
                                                         in.input_fraction - bits),
                                              lookup.to_alpha) -
                                         1);
    lookup.length_fraction = specs[Wire::length].format.fraction_bits;
    const Spec depth = specs[Wire::slab_depth];
    lookup.to_depth = Rescale(extinction.format.fraction_bits + in.input_fraction, depth,
                              static_cast<int>(Wire::slab_depth));
    lookup.to_shorter = Rescale(depth.format.fraction_bits, depth, static_cast<int>(Wire::slab_depth));
    lookup.to_shorter.divides = true;
    lookup.table_color_fraction = color.format.fraction_bits;
    lookup.extinction_fraction = extinction.format.fraction_bits;
    lookup.color_fraction = specs[Wire::slab_ratio].format.fraction_bits;
    lookup.alpha_fraction = slab_alpha.format.fraction_bits;
    lookup.one_alpha = std::min(slab_alpha.format.one(), slab_alpha.format.largest());
    lookup.opacity = build_opacity_unit(specs, in.longest_ray);
    return lookup;
}

}  // namespace squint
