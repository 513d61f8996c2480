#include "pipeline/classification/prefix.h"

#include "pipeline/preintegration/opaque_prediction.h"

#include <algorithm>

namespace squint {

PrefixLookup build_prefix_lookup(const ClassificationInputs& in) {
    PrefixLookup p;
    p.entries = build_entry_lookup(in);
    const Spec extinction = in.specs[Wire::table_extinction], depth = in.specs[Wire::slab_depth];
    const int n = in.entries.size();
    p.depth = Table(n, 1);
    p.depth.wire = static_cast<int>(Wire::table_extinction);
    double sum = 0;  // trapezoids: exact for a linear extinction
    for (int i = 0; i + 1 < n; ++i)
        sum += 0.5 * (in.entries.entry[static_cast<std::size_t>(i)].extinction +
                      in.entries.entry[static_cast<std::size_t>(i) + 1].extinction);
    require_range(in.specs, Wire::table_extinction, sum * in.step_world,
                  "the prefix sums of the entries' optical depths");
    sum = 0;
    for (int i = 0; i < n; ++i) {
        p.depth.set(i, 0, sum * in.step_world, extinction);
        if (i + 1 < n)
            sum += 0.5 * (in.entries.entry[static_cast<std::size_t>(i)].extinction +
                          in.entries.entry[static_cast<std::size_t>(i) + 1].extinction);
    }
    const int wire = static_cast<int>(Wire::slab_depth);
    p.to_part = Rescale(extinction.format.fraction_bits + in.input_fraction, extinction,
                        static_cast<int>(Wire::table_extinction));
    p.to_depth = Rescale(extinction.format.fraction_bits - in.input_fraction, depth, wire);
    p.to_shorter = Rescale(depth.format.fraction_bits + p.entries.length_fraction, depth, wire);
    p.to_wall = Rescale(p.entries.color_fraction + p.entries.alpha_fraction, in.specs[Wire::slab_ratio],
                        static_cast<int>(Wire::slab_ratio));
    p.predicts = p.entries.has_opaque && in.settings.opaque_prediction;
    if (p.predicts) {
        const preintegration::OpaquePrediction prediction = preintegration::predict_opaque(in.entries);
        p.walls = Table(n, 2);
        for (int i = 0; i < n; ++i) {
            p.walls.set_raw(i, 0, prediction.up[static_cast<std::size_t>(i)]);
            p.walls.set_raw(i, 1, prediction.down[static_cast<std::size_t>(i)]);
        }
        p.walls.wire = static_cast<int>(Wire::table_extinction);
    }
    return p;
}

PremultipliedRules build_premultiplied_rules(const WireSpecs& specs) {
    const Spec color = specs[Wire::slab_color];
    const int alpha = specs[Wire::slab_alpha].format.fraction_bits, wire = static_cast<int>(Wire::slab_color);
    PremultipliedRules rules;
    rules.to_product = Rescale(specs[Wire::slab_ratio].format.fraction_bits + alpha, color, wire);
    rules.to_scaled = Rescale(color.format.fraction_bits, color, wire);
    rules.finer = color.format.fraction_bits - alpha;
    rules.one_color = std::min(color.format.one(), color.format.largest());
    return rules;
}

}  // namespace squint
