// A method's tables, for the pictures of a volume that follow one another: a camera, a light or a size changes none.
#pragma once

#include "core/volume.h"
#include "pipeline/classification/methods.h"

namespace squint {

/// build_method(inputs).  The last one of each volume is kept while its voxels live: equal inputs take over its
/// tables, which copies share.  Many threads may call it at once.
ClassificationMethod kept_method(const Volume& volume, const ClassificationInputs& inputs);

}  // namespace squint
