#include "scene/presets.h"

#include <algorithm>

namespace squint {

bool rounds_nothing(std::string_view preset) {
    return preset == "real" || preset == "float32";
}

bool has_all_formats(const PrecisionSettings& precision) {
    const auto& own = precision.override_;
    return std::all_of(own.begin(), own.end(), [](const auto& wire) { return wire.has_value(); });
}

CompositingForm preset_form(std::string_view name) {
    for (const std::string_view by_equation_9 : {"squeeze", "volumepro", "vizard2", "ultravis"})
        if (name == by_equation_9) return CompositingForm::equation_9;
    if (name == "eight_bit") return CompositingForm::unit255_shift;
    return CompositingForm::w;
}

}  // namespace squint
