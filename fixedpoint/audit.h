// Statistics of a wire: the Audited word counts them; `--audit` and `squint pixel` print them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace squint {

/// One value that arrived on a wire.
struct TraceEvent {
    int wire = -1;
    double exact = 0;      // before quantising, in units of the wire's last bit
    std::int64_t raw = 0;  // after quantising
};

struct WireStatistics {
    std::int64_t count = 0, inexact = 0, saturated = 0, wrapped = 0;
    std::int64_t underflowed = 0;  // values that were not zero and became zero
    std::int64_t smallest = std::numeric_limits<std::int64_t>::max();
    std::int64_t largest = std::numeric_limits<std::int64_t>::min();
    std::uint64_t ones = 0;                    // bit b: one of the absolute raw values has it
    std::array<std::int64_t, 64> magnitude{};  // [b]: values whose absolute raw value has b bits
    std::vector<TraceEvent>* trace = nullptr;  // where every event is recorded; null: nowhere

    void merge(const WireStatistics& other) {
        count += other.count, inexact += other.inexact, saturated += other.saturated,
            wrapped += other.wrapped, underflowed += other.underflowed, ones |= other.ones;
        if (other.smallest < smallest) smallest = other.smallest;
        if (other.largest > largest) largest = other.largest;
        for (std::size_t b = 0; b < magnitude.size(); ++b) magnitude[b] += other.magnitude[b];
    }
};

}  // namespace squint
