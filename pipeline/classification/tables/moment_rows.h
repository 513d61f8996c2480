// Rows of the moments' level tables, a block at a time, in vectors: the words of MomentSeries::moments.
#pragma once

#include <cstddef>

#include <cstdint>
#include <vector>

namespace squint {

/// The entries as the tables take them, one behind the other: depth, then each channel's light, then the
/// light again for every further moment; `padded` numbers an entry.
struct MomentSteps {
    static constexpr int kPadded = 16;  // 1 + 3 * 5, the most orders
    int order = 2;
    int padded = kPadded;
    std::vector<double> number;

    const double* of(int entry) const {
        return number.data() + static_cast<std::size_t>(entry) * static_cast<std::size_t>(padded);
    }
};

/// Writes the words of a block's rows, entries first <= i < end, from its start on: `end - first` + 1 rows of
/// 1 + 3 order words of `word_fraction` bits, rounded to nearest, halves to even.  `unit` turns depths into
/// the block's.  Up to kPadded words behind the last are written, too.
void write_moment_rows(const MomentSteps& steps, int first, int end, double unit, int word_fraction,
                       std::int32_t* words);

}  // namespace squint
