// squint report: shows what a sweep found, as a page, or as numbers for programs and papers.
#include "studies/sweep/report.h"
#include "cli/common.h"
#include "core/atomic_file.h"
#include "core/error.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

namespace squint::cli {

int run(const ReportArguments& a) {
    using namespace squint::sweep;
    const bool page = a.format == "html";
    if (page)
        if (const std::string why = why_no_page(); !why.empty()) throw InputError("report: " + why);
    const Json data = report_data(a.run, a.max_error);
    if (page) {
        const std::string path =
            a.output.empty() ? (std::filesystem::path(a.run) / "report.html").string() : a.output;
        write_text_whole(path, report_html(data, a.run, a.most_picture_bytes));
        say(fmt::format("{}: {} points\n", path, data["entries"].size()));
        return kDone;
    }
    const std::string text = a.format == "csv" ? report_csv(data)
                             : a.format == "markdown"
                                 ? report_markdown(data)
                                 : data.dump(1, ' ', true, Json::error_handler_t::replace) + "\n";
    if (a.output.empty() || a.output == "-")
        print(text);
    else
        write_text_whole(a.output, text);
    return kDone;
}

}  // namespace squint::cli
