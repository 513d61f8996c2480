#include "pipeline/audit_record.h"

#include "fixedpoint/words/range.h"
#include "pipeline/plan/ranges.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>

namespace squint {

using Json = nlohmann::ordered_json;

WireStatistics voxel_statistics(const Volume& volume) {
    WireStatistics s;
    const auto count_all = [&](const auto* voxels) {
        for (std::int64_t i = 0; i < volume.voxels(); ++i)
            s.ones |= voxels[i], ++s.magnitude[static_cast<std::size_t>(std::bit_width(voxels[i]))];
    };
    if (volume.type == ScalarType::u8)
        count_all(static_cast<const std::uint8_t*>(volume.data.get()));
    else
        count_all(static_cast<const std::uint16_t*>(volume.data.get()));
    s.count = volume.voxels(), s.smallest = volume.smallest, s.largest = volume.largest;
    return s;
}

Format voxel_format(const Volume& volume) {
    return {.integer_bits = volume.scalar_bits, .fraction_bits = 0, .is_signed = false};
}

int unused_high_bits(const WireStatistics& statistics, const Format& format) {
    int used = static_cast<int>(statistics.magnitude.size()) - 1;
    while (used > 0 && statistics.magnitude[static_cast<std::size_t>(used)] == 0) --used;
    return std::max(0, format.integer_bits + format.fraction_bits - used);
}

int zero_low_bits(const WireStatistics& statistics, const Format& format) {
    return std::min(format.integer_bits + format.fraction_bits, std::countr_zero(statistics.ones));
}

namespace {
Json json_of(const WireStatistics& s, const Format& format) {
    std::size_t bits = s.magnitude.size();
    while (bits > 1 && s.magnitude[bits - 1] == 0) --bits;
    Json magnitude = Json::array();
    for (std::size_t b = 0; b < bits; ++b) magnitude.push_back(s.magnitude[b]);
    return {{"format", to_string(format)},
            {"count", s.count},
            {"min_raw", s.smallest},
            {"max_raw", s.largest},
            {"min", to_real(s.smallest, format)},
            {"max", to_real(s.largest, format)},
            {"inexact", s.inexact},
            {"underflowed", s.underflowed},
            {"saturated", s.saturated},
            {"wrapped", s.wrapped},
            {"magnitude_bits", magnitude},
            {"unused_high_bits", unused_high_bits(s, format)},
            {"zero_low_bits", zero_low_bits(s, format)}};
}
}  // namespace

Json json_of_audit(const Plan& plan, const RenderStatistics& statistics) {
    Json json{{"voxels", json_of(voxel_statistics(*plan.volume), voxel_format(*plan.volume))}};
    const std::map<int, Range> proven = proven_ranges(plan);
    for (std::size_t w = 0; w < statistics.wires.size(); ++w) {
        const WireStatistics& s = statistics.wires[w];
        if (s.count == 0) continue;
        const Format& format = plan.specs.spec[w].format;
        Json& wire = json[std::string(kWireInfo[w].name)] = json_of(s, format);
        if (const auto found = proven.find(static_cast<int>(w)); found != proven.end()) {
            const auto real = [&](Int128 raw) {
                return std::ldexp(static_cast<double>(raw), -format.fraction_bits);
            };
            wire["proven_min"] = real(found->second.low), wire["proven_max"] = real(found->second.high);
        }
    }
    return json;
}

}  // namespace squint
