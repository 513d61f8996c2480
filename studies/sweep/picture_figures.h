// What is measured of a picture for the record of a point (docs/sweeps.md, "The record of a point").
#pragma once

#include "pipeline/render.h"
#include "studies/sweep/evaluate.h"

#include <memory>

namespace squint::sweep {

/// Its R, G, B and A alone.
Image colors_of(const Image& image);

/// How it differs from another: colour, opacity, and what else `measure` asks for.
Json errors_of(const Image& picture, const Image& other, const Measure& measure);

/// Colour exceeding opacity, in LSB8: a premultiplied colour never does, but rounding may let it.
double color_above_alpha(const Image& image);

/// What rounding leaves of C + T = 1, which holds at every sample with white colours and no light.
Json conservation(const Scene& scene, const std::shared_ptr<const Volume>& volume,
                  const RenderOptions& options);

/// Samples with opacity above zero that left T unchanged, on a grid of at most 32 x 32 rays.
Json stuck_transparency(const Plan& plan);

}  // namespace squint::sweep
