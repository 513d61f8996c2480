// The one list of classification methods.  Adding a method: a file beside this one, a line here, a name in
// scene.h.
//
// A method is a type M with
//   static constexpr bool kPremultiplied   whether its slab colour already carries the opacity
//   static constexpr bool kNeedsBack       whether it takes the samples at both ends of the slab
//   visit(v)                               v(Rescale&) for each rescale, v(Table&) or v(CellTable&) for each
//   table describe(ClassificationReport&)        tables and choices, for `squint plan`
//   build_...(ClassificationInputs) -> M   its table builder
// and, for every word, classify(const M&, front, back, length) -> Slab.
#pragma once

#include "pipeline/classification/moments.h"
#include "pipeline/classification/pc.h"
#include "pipeline/classification/pi1d.h"
#include "pipeline/classification/pi2d.h"
#include "pipeline/classification/pips.h"

#include <variant>

namespace squint {

using ClassificationMethod =
    std::variant<PostClassification, PreIntegrated1D, PreIntegrated2D, PowerSeriesOfOrder1, MomentSeries>;

/// Entries beside a slab's own that its colour may come from: what empty space must leave room for.
template <class M>
int entry_reach(const M& method) {
    if constexpr (requires { method.entry_reach(); }) return method.entry_reach();
    return 0;
}

/// The method that the settings name, with its tables built.  Throws InputError for orders and formats it
/// cannot have.
ClassificationMethod build_method(const ClassificationInputs& inputs);

/// Gives the tables of a method that was built from these inputs their unrounded values.  Other copies of the
/// method keep theirs.
void need_exact(ClassificationMethod& method, ClassificationInputs inputs);

/// Gives lanes of floats their tables, once there are unrounded values.
void need_floats(ClassificationMethod& method);

}  // namespace squint
