// Prefix sums X1 of colour over depth, and how much they rise from row to row, with SIMD.
#pragma once

#include "core/transfer_function.h"

#include <cstdint>
#include <span>

namespace squint {

/// sums[3 i + c]: the light in channel c of all entries before entry i, for a step of one entry that is
/// `step` long.  Sums run in order, an entry at a time.  One number after the last is written, too.
void write_light_sums(std::span<const Entry> entries, double step, double* sums);

/// The largest change of a colour channel between neighbouring entries.
double largest_swing(std::span<const Entry> entries);

/// Writes rows of T and X1 side by side, from rows of `stride` words and of three words.  Returns the largest
/// rise of any of them between rows.
std::int32_t join_rows(const std::int32_t* depth, int stride, const std::int32_t* light, int rows,
                       std::int32_t* joined);

}  // namespace squint
