#include "pipeline/classification/pc.h"

namespace squint {

PostClassification build_post_classification(const ClassificationInputs& inputs) {
    return {build_entry_lookup(inputs)};
}

}  // namespace squint
