// All scalar words in which a stage's arithmetic can run.  words/word.h says what a stage may use of them.
//
// Integer<W>   the model: 64 bits, or 128 where a product needs them
// Audited      the model, counting what every wire carried
// Real<T>      no rounding: raw units in floating point
// Range        intervals: what a stage's exact results can reach
// Lanes        many samples side by side: words/lanes-inl.h and its neighbours
//
// Wide<W>      beside W, for the few numbers that need more bits than the others: words/word.h
#pragma once

#include "fixedpoint/words/audited.h"
#include "fixedpoint/words/integer.h"
#include "fixedpoint/words/range.h"
#include "fixedpoint/words/real.h"
#include "fixedpoint/words/word.h"
