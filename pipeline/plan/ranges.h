// How wide a word each stage of a plan needs: the stages themselves, run over intervals (words.h, Range).
#pragma once

#include "pipeline/plan/plan.h"

namespace squint {

/// Sets the needs of every stage, the golden model's word, the wires in use, and which of them need no limits
/// because no value of the scene can pass them.  Everything else of the plan must be there.  Throws InputError, naming the stage,
/// where no word holds its results.
void choose_words(Plan& plan);

/// Slabs of the longest ray there could be, through the box that is rendered; not rounded to whole ones.
double most_steps(const Plan& plan);

}  // namespace squint
