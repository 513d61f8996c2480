// The one list of classification methods.  To add a method: its files beside this one, a line here and in
// methods-inl.h, its name and orders in scene.h (docs/architecture.md).
//
// A method is a type M with
//   static constexpr bool kPremultiplied     whether its slab colour already carries the opacity
//   static constexpr bool kNeedsBack         whether it takes the samples at both ends of the slab
//   serves(settings)                         whether it is the method that the settings name; one of the list is
//   build(inputs)                            builds it, with its tables
//   visit(v)                                 calls v(Rescale&), v(Table&) and v(CellTable&) for each it has
//   describe(ClassificationReport&)          names its tables and choices, for `squint plan`
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

/// How many entries beside a slab's own its colour may depend on: empty space keeps that margin.
template <class M>
int entry_reach(const M& method) {
    if constexpr (requires { method.entry_reach(); }) return method.entry_reach();
    return 0;
}

/// Builds the method that the settings name, with its tables.  Throws InputError for an order or a format
/// that it cannot have.
ClassificationMethod build_method(const ClassificationInputs& inputs);

/// Adds exact values to the tables of a method that was built from these inputs.  Other copies of the method
/// stay as they are.
void need_exact(ClassificationMethod& method, ClassificationInputs inputs);

/// Adds tables for lanes of floats, after need_exact().
void need_floats(ClassificationMethod& method);

}  // namespace squint
