// The page of a report, built into the program (tools/report).
#pragma once

#include <string_view>

namespace squint::sweep {

std::string_view report_page();

}  // namespace squint::sweep
