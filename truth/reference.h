// The reference: the exact integral along a ray of the trilinear field through the transfer function of the
// entries (docs/conventions.md#compositing-and-output), in doubles.  It shares no arithmetic with the stages.
//
// Inside a cell the field is a cubic polynomial of the distance.  Each of its monotone parts is cut where it
// meets an entry.  Between cuts extinction and colour are linear in the field, the optical depth is a
// quartic, and quadrature is left with one smooth integral.  The nearest field is constant between jumps
// half-way from voxel to voxel, where passages are cut.  Of the scene it ignores step, method, formats and
// early termination (a ray ends where T < 1e-12).
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"

#include <array>
#include <atomic>
#include <functional>

namespace squint {

struct ReferenceOptions {
    int threads = 0;                         // 0: one a processor
    double tolerance = 1e-10;                // absolute, in each channel of a pixel
    std::function<void(double)> progress{};  // gets the part done, from any thread
    const std::atomic<bool>* cancelled = nullptr;
};

/// R G B A, premultiplied linear light, the same bits on any number of threads.  Of the plan it reads scene,
/// volume, camera, entries and whether it is lit.  Throws Cancelled (pipeline/render.h).
Image render_reference(const Plan& plan, const ReferenceOptions& options = {});

/// R G B A of one pixel, before rounding to float.
std::array<double, 4> reference_pixel(const Plan& plan, int column, int row, double tolerance = 1e-10);

}  // namespace squint
