#include "pipeline/classification/entries.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "pipeline/stages/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>

namespace squint {
namespace {

// An alpha as the table's word gives it back.  sqrt(alpha) is stored in F bits and expanded, c + (c >> (F -
// 1)), so that 0 and 1 are exact; the square has 2 F fraction bits (Squeeze, section 4.4.2, as corrected).
double decoded_alpha(double alpha, const Spec& spec, AlphaEncoding encoding) {
    if (encoding == AlphaEncoding::alpha) return alpha;
    const int f = spec.format.fraction_bits;
    const std::int64_t code = std::min(quantise_real(std::sqrt(alpha), spec), (std::int64_t{1} << f) - 1);
    const double root =
        static_cast<double>(code + (code >> (f - 1))) / static_cast<double>(std::int64_t{1} << f);
    return root * root;
}

}  // namespace

InputStage build_input(const StageInputs& in) {
    require_integer_bits(
        in, Wire::classification_input, bits_for(in.entries.coordinate(in.volume.largest)),
        fmt::format("entry {} of the transfer function", in.entries.coordinate(in.volume.largest)));
    InputStage s;
    s.scaled = in.entries.scalars_per_entry != 1;
    s.scale_exact = 1 / in.entries.scalars_per_entry;
    // Entries per level with 20 significant bits.
    s.scale_fraction = s.scaled ? std::clamp(20 - bits_for(s.scale_exact) +
                                                 std::max(0, bits_for(in.entries.scalars_per_entry) - 1),
                                             0, 36)
                                : 0;
    s.scale =
        s.scaled
            ? static_cast<std::int64_t>(std::floor(s.scale_exact * std::ldexp(1.0, s.scale_fraction) + 0.5))
            : 1;
    s.to_input = rescale(in, fraction(in, Wire::sample) + s.scale_fraction, Wire::classification_input);
    s.highest = static_cast<std::int64_t>(in.entries.size() - 1) << fraction(in, Wire::classification_input);
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
    const int fraction = std::min(alpha.format.fraction_bits + 2, kMostFractionBits);
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

OpacityUnit build_opacity_unit(const WireSpecs& specs) {
    // It knows nothing of the transfer function, and copies share their rows: the last few formats are kept.
    struct Kept {
        Spec depth, alpha;
        OpacityUnit unit;
    };
    static thread_local std::vector<Kept> kept;
    const Spec depth = specs[Wire::slab_depth], alpha = specs[Wire::slab_alpha];
    for (const Kept& k : kept)
        if (k.depth == depth && k.alpha == alpha) return k.unit;
    if (kept.size() == 4) kept.erase(kept.begin());
    kept.push_back({depth, alpha, computed_opacity_unit(specs)});
    return kept.back().unit;
}

EntryLookup build_entry_lookup(const ClassificationInputs& in) {
    const WireSpecs& specs = in.specs;
    const Spec color = specs[Wire::table_color], alpha = specs[Wire::table_alpha],
               extinction = specs[Wire::table_extinction];
    const int n = in.entries.size();
    EntryLookup lookup;
    lookup.table = Table(n, 4, in.keeps_exact), lookup.matter = Table(n, 2, in.keeps_exact);
    lookup.table.wire = static_cast<int>(Wire::table_color);
    lookup.table.last_wire = static_cast<int>(Wire::table_alpha);
    lookup.matter.wire = static_cast<int>(Wire::table_extinction);
    lookup.matter.last_wire = -1;  // flags
    lookup.input_fraction = in.input_fraction;
    lookup.last_segment = n - 2;
    // The square of an F-bit root has 2 F bits; a plain alpha has its own F.
    const bool rooted = in.settings.encoding == AlphaEncoding::sqrt_alpha;
    Spec stored = alpha;
    if (rooted) stored.format = {1, std::min(2 * alpha.format.fraction_bits, kMostFractionBits), false};
    const auto size = static_cast<std::size_t>(n);
    const std::unique_ptr<double[]> numbers = std::make_unique_for_overwrite<double[]>(7 * size);
    const std::span<double> opacity(numbers.get(), size), seen(numbers.get() + size, 4 * size),
        matter(numbers.get() + 5 * size, 2 * size);
    bool opaque = false;  // the entry before
    for (std::size_t i = 0; i < size; ++i) {
        const Entry& entry = in.entries.entry[i];
        const double depth = entry.extinction * in.step_world;
        opacity[i] = -depth, matter[2 * i] = depth;
        matter[2 * i + 1] = entry.opaque ? static_cast<int>(EntryLookup::entry_is) : 0;
        if (entry.opaque && opaque) matter[2 * i - 1] += static_cast<int>(EntryLookup::segment_is);
        opaque = entry.opaque;
        lookup.has_opaque = lookup.has_opaque || opaque;
    }
    portable::expm1_each(opacity, opacity);
    for (double& alpha : opacity) alpha = -alpha;
    for (std::size_t i = 0; i < size; ++i) {
        const Vec3& c = in.entries.entry[i].color;
        double* const row = seen.data() + 4 * i;
        row[0] = c.x, row[1] = c.y, row[2] = c.z, row[EntryLookup::alpha] = opacity[i];
    }
    for (std::size_t i = 0; rooted && i < size; ++i)
        seen[4 * i + EntryLookup::alpha] = decoded_alpha(opacity[i], alpha, in.settings.encoding);
    lookup.table.fill(seen, std::array{color, color, color, stored});
    for (int i = 0; rooted && i < n; ++i)
        lookup.table.set_exact(i, EntryLookup::alpha, opacity[static_cast<std::size_t>(i)], stored.format);
    lookup.matter.fill(matter,
                       std::array{extinction, Spec{{2, 0, false}, Rounding::rnd_conv, Overflow::sat}});
    lookup.table.pair_rows();
    const Spec slab_alpha = specs[Wire::slab_alpha];
    // A straight colour leaves on the wire slab_ratio, an opacity on slab_alpha.
    lookup.to_color = Rescale(color.format.fraction_bits + in.input_fraction, specs[Wire::slab_ratio],
                              static_cast<int>(Wire::slab_ratio));
    lookup.to_alpha = Rescale(stored.format.fraction_bits + in.input_fraction, slab_alpha,
                              static_cast<int>(Wire::slab_alpha));
    lookup.least_opaque = lookup.to_alpha.wraps ? slab_alpha.format.smallest() : slab_alpha.format.largest();
    for (int i = 0; lookup.has_opaque && i < n; ++i)
        if (in.entries.entry[static_cast<std::size_t>(i)].opaque)
            lookup.least_opaque =
                std::min(lookup.least_opaque,
                         quantise(shift_left(lookup.table.word(i, EntryLookup::alpha), in.input_fraction),
                                  lookup.to_alpha) -
                             1);
    lookup.length_fraction = specs[Wire::length].format.fraction_bits;
    const Spec depth = specs[Wire::slab_depth];
    lookup.to_depth = Rescale(extinction.format.fraction_bits + in.input_fraction, depth,
                              static_cast<int>(Wire::slab_depth));
    lookup.to_shorter = Rescale(depth.format.fraction_bits + lookup.length_fraction, depth,
                                static_cast<int>(Wire::slab_depth));
    lookup.color_fraction = specs[Wire::slab_ratio].format.fraction_bits;
    lookup.alpha_fraction = slab_alpha.format.fraction_bits;
    lookup.one_alpha = std::min(slab_alpha.format.one(), slab_alpha.format.largest());
    lookup.opacity = build_opacity_unit(specs);
    return lookup;
}

}  // namespace squint
