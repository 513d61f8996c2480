// squint report: shows what a sweep found, as a page, or as numbers for programs and papers.
#include "studies/sweep/report.h"
#include "cli/common.h"
#include "cli/verb.h"
#include "core/atomic_file.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

namespace squint::cli {

namespace {

struct ReportArguments {
    std::string run, output, format = "html";
    double max_error = 0.5;  // LSB8
    std::int64_t most_picture_bytes = 24 << 20;
};

int run(const ReportArguments& a) {
    using namespace squint::sweep;
    const bool page = a.format == "html";
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

void flags(Flags& f, ReportArguments& a) {
    f.add("run", a.run, "The folder that squint sweep filled").required().value("RUN");
    f.add("-o,--output", a.output,
          "File to write; default: RUN/report.html for the page, standard output for numbers")
        .value("FILE");
    f.add("--format", a.format, "html, csv, json or markdown")
        .one_of({"html", "csv", "json", "markdown"})
        .value("NAME")
        .shows_default();
    f.add("--max-error", a.max_error,
          "The report's first line names the cheapest point within this RMSE, in 1/255 of full scale; a "
          "search has its own bound")
        .positive()
        .value("LSB8")
        .shows_default();
    f.read(
         "--pictures", [&](const std::string& text) { a.most_picture_bytes = size_of(text, "--pictures"); },
         "Room for pictures in the page; what does not fit is kept coarser; default: 24M")
        .value("SIZE");
}

}  // namespace

namespace verbs {
extern const Verb report{
    .name = "report",
    .heading = "Choosing formats",
    .help = "Write what a sweep found as one page, or as numbers",
    .footer =
        "The page needs no network and no server: open it from the disk, or send it.\n\n"
        "Example:\n  squint report run -o report.html; squint report run --format csv > run.csv",
    .describe = described<ReportArguments, flags, run>,
};
}

}  // namespace squint::cli
