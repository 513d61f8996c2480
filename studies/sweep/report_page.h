// The page of a report, taken into the program when it was built; empty where tools/report/report.html was
// not there.
#pragma once

#include <string_view>

namespace squint::sweep {

std::string_view report_page();

}  // namespace squint::sweep
