// Writes rows of the moments' level tables, a block at a time, with SIMD: the words of MomentSeries::moments.
#pragma once

#include <cstddef>

#include <cstdint>
#include <vector>

namespace squint {

/// The entries as the tables take them, one after the other: depth, then the light of each channel, then that
/// light again for each further moment; an entry is `padded` numbers.
struct MomentSteps {
    static constexpr int kPadded = 16;  // 1 + 3 * 5, the most orders
    int order = 2;
    int padded = kPadded;
    std::vector<double> number;

    const double* of(int entry) const {
        return number.data() + static_cast<std::size_t>(entry) * static_cast<std::size_t>(padded);
    }
};

/// Writes the words of a block's rows from its start on, for entries first <= i < end: `end - first` + 1 rows
/// of 1 + 3 order words with `word_fraction` bits, rounded to nearest, halves to even.  `unit` turns depths
/// into the block's units.  Writes up to kPadded words after the last.
void write_moment_rows(const MomentSteps& steps, int first, int end, double unit, int word_fraction,
                       std::int32_t* words);

}  // namespace squint
