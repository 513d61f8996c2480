// How wide a word each stage of a plan needs: runs the stages over intervals (words.h, Range).
#pragma once

#include "pipeline/plan/plan.h"

namespace squint {

/// Sets the needs of every stage, the golden model's word, the wires in use, and which of them need no limits
/// because no value of the scene passes them.  All else in the plan must be set before.  Throws InputError
/// naming the stage, where no word holds its results.
void choose_words(Plan& plan);

/// The number of slabs of the longest ray through the rendered box, not rounded to an integer.
double most_steps(const Plan& plan);

}  // namespace squint
