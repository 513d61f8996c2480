// How wide a word each stage of a plan needs: runs the stages over intervals (words.h, Range).
#pragma once

#include "pipeline/plan/plan.h"

#include "fixedpoint/words/range.h"

#include <map>

namespace squint {

/// Sets the needs of every stage, the golden model's word, the wires in use, and which of them need no limits
/// because no value of the scene passes them.  All else in the plan must be set before.  Throws InputError
/// naming the stage, where no word holds its results.
void choose_words(Plan& plan);

/// The number of slabs of the longest ray through the rendered box, not rounded to an integer.
double most_steps(const Plan& plan);

/// The values that can reach each wire, rounded, in raw units, before its format limits them: proven by
/// intervals over any slab of any ray, so often wider than what rays meet.  Locations, which are clamped to the box,
/// and wires of tables are left out.
std::map<int, Range> proven_ranges(const Plan& plan);

}  // namespace squint
