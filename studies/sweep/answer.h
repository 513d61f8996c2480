// A report's first line: the cheapest point under the bound, what it saves, and what nobody has measured.
#pragma once

#include <nlohmann/json.hpp>

namespace squint::sweep {

/// `data` as report_data() has it; `bound` in LSB8 holds where no search asked for one of its own.  Returns
///
///     text                      the line
///     good                      false where nothing keeps the bound, or unseen views are beyond it
///     bound, figure, against    what was asked: an error of at most `bound`, as "rmse" or "max", against a baseline
///     point                     index in data["points"] of the cheapest that keeps it; null where none does
///     bits, error, than, than_bits, saving_percent    its own, and those of what it is compared with
///     stage, stage_bits, wire, format                 the stage with most of the bits, the widest wire
///     unseen_margin             of a search: the bound less the error on views that took no part
nlohmann::ordered_json answer_of(const nlohmann::ordered_json& data, double bound);

}  // namespace squint::sweep
