#include "pipeline/classification/pc.h"

namespace squint {

PostClassification PostClassification::build(const ClassificationInputs& inputs) {
    return {build_entry_lookup(inputs)};
}

}  // namespace squint
