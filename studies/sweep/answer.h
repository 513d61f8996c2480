// The first line of a report: the cheapest point within the bound, what it saves, what was not measured.
#pragma once

#include <nlohmann/json.hpp>

namespace squint::sweep {

/// `data` comes from report_data(); `bound`, in LSB8, applies where no search asked for one.  Returns
///
///     text                      the line
///     good                      false where nothing keeps the bound, or unseen views exceed it
///     bound, figure, against    the question: error of at most `bound`, "rmse" or "max", against a baseline
///     point                     index in data["points"] of the cheapest that keeps it; null if none does
///     bits, error, than, than_bits, saving_percent    its own, and those of the point it is compared with
///     stage, stage_bits         the stage with most of the bits
///     wire, format, bits_a_bit  among wires that are varied alone: the one whose bits cost most, and what each costs
///     unseen_margin             of a search: the bound minus the error on views that it did not use
nlohmann::ordered_json answer_of(const nlohmann::ordered_json& data, double bound);

}  // namespace squint::sweep
