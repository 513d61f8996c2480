#include "pipeline/machines/scene_bound/sample_errors.h"

#include "pipeline/machines/certificate.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/plan/ranges.h"

#include <cmath>

namespace squint {

SampleErrors sample_errors(const Plan& plan) {
    SampleErrors e;
    const LocationStage& at = plan.location;
    const double place = std::ldexp(1.0, -at.location_fraction),
                 first = rounding_of(1e-300, at.location.rounding) * place,
                 last_sample = std::floor(most_steps(plan)) + 2;
    Shares& point = e.of_displacement;
    point[index_of(Wire::location)] = first + unit_of(at.to_location) * place;
    point[index_of(Wire::direction)] =
        last_sample * rounding_of(1e-300, at.direction.rounding) * std::ldexp(1.0, -at.direction_fraction);
    point[index_of(Wire::weight)] = unit_of(at.to_weight) * std::ldexp(1.0, -plan.interpolation.weight_bits);
    point[kDoublesPay] = 0x1p-36;
    e.displacement = point.sum();

    const InterpolationStage& s = plan.interpolation;
    e.two_products = s.two_products;
    const int bits = s.weight_bits, x_bits = bits - s.to_x.shift, y_bits = x_bits + bits - s.to_y.shift;
    const double each = s.two_products ? 2 : 1;
    e.of_lerps[index_of(Wire::lerp_x)] = each * unit_of(s.to_x) * std::ldexp(1.0, -x_bits);
    e.of_lerps[index_of(Wire::lerp_y)] = each * unit_of(s.to_y) * std::ldexp(1.0, -y_bits);
    e.of_lerps[index_of(Wire::sample)] = each * unit_of(s.to_sample) * std::ldexp(1.0, -s.sample_fraction);
    e.lerps = e.of_lerps.sum();

    const InputStage& input = plan.input;
    e.scaled = input.scaled, e.scale = input.scale_exact;
    e.of_rounding[index_of(Wire::classification_input)] =
        unit_of(input.to_input) *
        std::ldexp(1.0, -plan.specs[Wire::classification_input].format.fraction_bits);
    if (input.scaled) {
        const double off =
            std::abs(std::ldexp(static_cast<double>(input.scale), -input.scale_fraction) - input.scale_exact);
        e.of_rounding[Shares::kElsewhere] = off * (plan.volume->largest + 1.0);
        e.of_rounding[kDoublesPay] = static_cast<double>(plan.entries.size()) * 0x1p-50;
    }
    if (plan.scene.compositing.mode == CompositingMode::average) {
        // Its quotient is rounded, and its last slab counts by a rounded length, of two slabs at least.
        e.of_rounding[index_of(Wire::classification_input)] +=
            rounding_of(1e-300, plan.to_average.rounding) *
            std::ldexp(1.0, -plan.specs[Wire::classification_input].format.fraction_bits);
        e.of_rounding[index_of(Wire::length)] +=
            (plan.volume->largest - plan.volume->smallest + 1) * std::abs(e.scale) *
            std::ldexp(1.0, -plan.specs[Wire::length].format.fraction_bits);
    }
    e.rounding = e.of_rounding.sum();
    return e;
}

}  // namespace squint
