// X1, the prefix sums of colour over depth, and their rise from row to row, in vectors.
#pragma once

#include "core/transfer_function.h"

#include <cstdint>
#include <span>

namespace squint {

/// sums[3 i + c]: what channel c's light of all entries before entry i amounts to for a step of one entry,
/// `step` long; every sum in order, an entry at a time.  One number behind the last is written, too.
void write_light_sums(std::span<const Entry> entries, double step, double* sums);

/// The largest change of a colour's channel from an entry to the next.
double largest_swing(std::span<const Entry> entries);

/// Rows of T and X1 side by side from their own tables' rows of `stride` and three words.  The largest rise
/// of any from a row to the next.
std::int32_t join_rows(const std::int32_t* depth, int stride, const std::int32_t* light, int rows,
                       std::int32_t* joined);

}  // namespace squint
