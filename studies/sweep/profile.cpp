#include "studies/sweep/profile.h"

#include "pipeline/audit_record.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/record.h"
#include "scene/scene.h"
#include "studies/search/by_shares.h"
#include "studies/sweep/evaluate.h"
#include "studies/sweep/report.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <map>

namespace squint::sweep {
namespace {

int integer_bits_for(const Range& values, const Format& format) {
    const Int128 magnitude = std::max(values.high, -values.low - 1);
    return std::max(0, static_cast<int>(bit_length(std::max<Int128>(magnitude, 0))) - format.fraction_bits);
}

search::Bits fraction_bits(const Plan& plan) {
    search::Bits bits;
    for (const Wire wire : plan.used_wires) bits[wire] = plan.specs[wire].format.fraction_bits;
    return bits;
}

/// The page's first line: what is proven, how many bits would keep the budget, which wires met their limits.
std::string answer_text(const Plan& plan, const Json& audit, const Proof& proof) {
    std::string overflow;
    int held = 0, enough = 0, wires = 0;
    for (const auto& [name, wire] : audit.items()) {
        if (wire["saturated"].get<std::int64_t>() + wire["wrapped"].get<std::int64_t>() > 0)
            overflow += (overflow.empty() ? "" : ", ") + name;
        if (!wire.contains("enough")) continue;
        const auto width = [&wire = wire](const char* key) {
            Spec spec;
            parse_spec(wire[key].get<std::string>(), spec);
            return spec.format.width();
        };
        ++wires, held += width("format"), enough += width("enough");
    }
    std::string text;
    if (const auto* c = std::get_if<Certificate>(&proof))
        text = fmt::format(
            "None of {} {}rays is more than {:.3g} LSB8 from what it is without rounding: proven. {} wires "
            "hold {} bits; about {} keep them within {:g} LSB8.",
            c->rays - c->undecided_rays, c->undecided_rays > 0 ? "decided " : "", c->most_decided, wires,
            held, enough, plan.scene.precision.budget);
    else
        text = "No bound is proven.";
    return text + (overflow.empty() ? " No value met a format's limits."
                                    : " Values met the limits of " + overflow + ".");
}

}  // namespace

Json profile_of(const Plan& plan, const RenderStatistics& statistics, const Proof& proof) {
    Json audit = json_of_audit(plan, statistics);
    const auto* certificate = std::get_if<Certificate>(&proof);
    if (!certificate) return audit;
    const std::map<int, Range> proven = proven_ranges(plan);
    const search::Bits bits = fraction_bits(plan);
    const search::Bits wanted = search::equal_shares(certificate->greatest_decided, bits,
                                                     search::least_bits(plan), plan.scene.precision.budget);
    for (const auto& [wire, fraction] : wanted) {
        const auto found = audit.find(std::string(info(wire).name));
        if (found == audit.end()) continue;
        const WireStatistics& s = statistics.wires[static_cast<std::size_t>(wire)];
        const Format& format = plan.specs[wire].format;
        const double share = certificate->greatest_decided[static_cast<int>(wire)];
        Format enough = format;
        enough.fraction_bits = share > 0 || s.inexact > 0
                                   ? fraction
                                   : std::max(format.fraction_bits - zero_low_bits(s, format), 0);
        if (const auto range = proven.find(static_cast<int>(wire)); range != proven.end()) {
            const int asked = integer_bits_for(range->second, format);
            enough.integer_bits = std::min(asked, format.integer_bits);
        }
        if (enough.integer_bits + enough.fraction_bits < 1) enough.fraction_bits = 1;
        (*found)["share_lsb8"] = share, (*found)["enough"] = to_string(enough);
    }
    return audit;
}

Json profile_data(const Plan& plan, const Rendering& rendering, const Proof& proof,
                  const std::string& command) {
    const RenderStatistics& s = rendering.statistics;
    const std::string hash = picture_hash(rendering.image);
    Json audit = profile_of(plan, s, proof), wires = Json::object();
    for (const Wire wire : plan.used_wires) wires[std::string(info(wire).name)] = to_string(plan.specs[wire]);
    const auto* c = std::get_if<Certificate>(&proof);
    Json not_measured = Json::array();
    if (!c)
        not_measured.push_back(
            "Shares of a bound, and formats that are enough: " + std::get<std::string>(proof) + ".");
    not_measured.push_back(
        "Other views: values are of this picture; intervals and integer bits hold for all.");
    Json run{{"started", now_text()}, {"machine", machine_record()}, {"shard", ""},       {"computed", 1},
             {"failed", 0},           {"seconds", s.seconds},        {"command", command}};
    run.update(program_record());
    return {{"schema", "squint.report/1"},
            {"mode", "profile"},
            {"title", "Profile of " + plan.scene.name},
            {"note", ""},
            {"file", plan.scene.name},
            {"text", to_toml(plan.scene)},
            {"facts", fmt::format("{}x{} pixels, {} rays, {} samples, picture {}; squint {}. Errors in LSB8, "
                                  "1/255 of full scale in linear light.",
                                  plan.camera.width, plan.camera.height, s.rays, s.samples,
                                  hash.substr(0, 12), version())},
            {"axes", Json::object()},
            {"stages", wires_by_stage()},
            {"measured", Json::array()},
            {"against", Json::array()},
            {"points", Json::array({Json{{"hash", hash},
                                         {"status", "done"},
                                         {"command", command},
                                         {"error", Json::object()},
                                         {"wires", wires},
                                         {"audit", audit}}})},
            {"entries", Json::array({Json{{"point", 0}, {"values", Json::object()}}})},
            {"not_measured", not_measured},
            {"answer",
             {{"text", answer_text(plan, audit, proof)},
              {"good", !c || c->most_decided <= plan.scene.precision.budget},
              {"bound", plan.scene.precision.budget},
              {"figure", "max"}}},
            {"programs", Json::array()},
            {"runs", Json::array({run})},
            {"version", version()}};
}

}  // namespace squint::sweep
