// The reference: the exact integral along a ray of the trilinear field through the entries' transfer function
// (docs/conventions.md#compositing-and-output), in doubles, sharing no arithmetic with the stages.
//
// Inside a cell the field is a cubic polynomial of the distance.  Each of its monotone parts is cut where it
// meets an entry; between cuts extinction and colour are linear in the field, the optical depth is a quartic,
// and what is left to quadrature is one smooth integral.  The nearest field is constant between jumps half-way
// from voxel to voxel, where passages are cut.  What of a scene it does not know: step, methods, formats and
// the scene's early termination (a ray ends where T < 1e-12).
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"

#include <array>
#include <atomic>
#include <functional>

namespace squint {

struct ReferenceOptions {
    int threads = 0;                         // 0: one a processor
    double tolerance = 1e-10;                // of each channel of a pixel, absolute
    std::function<void(double)> progress{};  // called with the part done, from any thread
    const std::atomic<bool>* cancelled = nullptr;
};

/// Channels R G B A, premultiplied linear light.  Of the plan it reads scene, volume, camera, entries and
/// whether it is lit.  Throws Cancelled (pipeline/render.h).  The same bits for every number of threads.
Image render_reference(const Plan& plan, const ReferenceOptions& options = {});

/// R G B A of one pixel, before they are rounded to float.
std::array<double, 4> reference_pixel(const Plan& plan, int column, int row, double tolerance = 1e-10);

}  // namespace squint
