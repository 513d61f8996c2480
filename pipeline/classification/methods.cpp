#include "pipeline/classification/methods.h"

#include "core/error.h"

#include <fmt/format.h>

namespace squint {

ClassificationMethod build_method(const ClassificationInputs& inputs) {
    switch (inputs.settings.method) {
        case Method::pc:
        case Method::pc_mid:
            return build_post_classification(inputs);
        case Method::pi1d:
        case Method::pi1d_engel:
            return build_pre_integrated_1d(inputs);
        case Method::pi2d:
        case Method::pi2d_no_attenuation:
            return build_pre_integrated_2d(inputs);
        case Method::pips:
            if (inputs.settings.order == 1) return build_power_series_of_order_1(inputs);
            return build_moment_series(inputs);
        case Method::leg:
            return build_moment_series(inputs);
    }
    throw InputError(fmt::format("classification.method: {} is not known", name_of(inputs.settings.method)));
}

}  // namespace squint
