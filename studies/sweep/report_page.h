// The page of a report, built into the program; empty where tools/report/report.html was
// missing.
#pragma once

#include <string_view>

namespace squint::sweep {

std::string_view report_page();

}  // namespace squint::sweep
