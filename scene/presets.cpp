#include "scene/presets.h"

namespace squint {

bool rounds_nothing(std::string_view preset) {
    return preset == "real" || preset == "float32";
}

CompositingForm preset_form(std::string_view name) {
    for (const std::string_view by_equation_9 : {"squeeze", "volumepro", "vizard2", "ultravis"})
        if (name == by_equation_9) return CompositingForm::equation_9;
    if (name == "eight_bit") return CompositingForm::unit255_shift;
    return CompositingForm::w;
}

}  // namespace squint
