// The golden model's rays, each of its words compiled in a file of its own (int64.cpp, ...): every method, and
// so all of the composition, is an instance of it.
#pragma once

#include "core/image.h"
#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/model.h"
#include "pipeline/plan/plan.h"

#include <vector>

namespace squint::model {

/// ModelRenderer::render_tile in words W: std::int64_t, Int128, Audited, Real<float> or Real<double>.  `empty`, for
/// doubles alone: what may be left out; none where it is null.
template <class W>
void cast_tile(const Plan& plan, const lanes::EmptySpace* empty, int left, int top, int right, int bottom,
               Image& image, TileStatistics& statistics);

/// The ray of trace.setup in words W: Audited, Real<float> or Real<double>.  `fresh`: where the plan's wires
/// put what they see; its events go to `trace` slab by slab.
template <class W>
void cast_traced(const Plan& plan, std::vector<TraceEvent>& fresh, RayTrace& trace);

}  // namespace squint::model
