// squint table: the tables of a scene's method as words, to look at and plot.  Two dimensions (pi2d) become
// EXR: channels R G B A, row = front, column = back; one dimension becomes CSV, a row an entry.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image.h"

#include <fmt/format.h>

#include <filesystem>

namespace squint::cli {
namespace {

struct TableArguments {
    SceneArguments scene;
    std::string output;
};

bool ends_in(const std::string& path, const char* extension) {
    return std::filesystem::path(path).extension() == extension;
}

Image image_of(const CellTable& cells, const WireSpecs& specs) {
    Image image;
    image.width = image.height = cells.size();
    const char* const names[] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4; ++c) {
        const Wire wire = c < 3 ? Wire::slab_color : Wire::slab_alpha;
        Channel& channel = image.add_float(names[c]);
        for (int f = 0; f < cells.size(); ++f)
            for (int b = 0; b < cells.size(); ++b)
                channel.values[static_cast<std::size_t>(f) * static_cast<std::size_t>(cells.size()) +
                               static_cast<std::size_t>(b)] =
                    static_cast<float>(to_real(cells.word(f, b, c), specs[wire].format));
    }
    return image;
}

/// The raw words of all tables with a row an entry, side by side.
struct CollectColumns {
    int entries;
    std::string& head;
    std::vector<std::string>& rows;
    int& count;
    void operator()(const Rescale&) const {}
    void operator()(const CellTable&) const {}
    void operator()(const Table& table) const {
        if (table.rows() != entries) return;
        const std::string_view wire =
            table.wire < 0 ? "table" : kWireInfo[static_cast<std::size_t>(table.wire)].name;
        ++count;
        for (int c = 0; c < table.columns(); ++c) {
            head += fmt::format(",{}.{}.{}", count, wire, c);
            for (int i = 0; i < entries; ++i)
                rows[static_cast<std::size_t>(i)] += fmt::format(",{}", table.word(i, c));
        }
    }
};

std::string csv_of(const Plan& plan) {
    const int entries = plan.entries.size();
    std::string head = "entry";
    std::vector<std::string> rows;
    for (int i = 0; i < entries; ++i) rows.push_back(std::to_string(i));
    int count = 0;
    Plan visited = plan;
    std::visit(
        [&](auto& method) {
            method.visit(CollectColumns{entries, head, rows, count});
        },
        visited.method);
    std::string text = head + "\n";
    for (const std::string& row : rows) text += row + "\n";
    return text;
}

int run(const TableArguments& a) {
    const Plan plan = plan_of(a.scene);
    if (const auto* method = std::get_if<PreIntegrated2D>(&plan.method)) {
        if (!ends_in(a.output, ".exr"))
            throw InputError(fmt::format(
                "-o {}: pi2d has a table of two dimensions: the name must end in .exr", a.output));
        write_exr(image_of(method->cells, plan.specs), a.output, {});
    } else {
        if (!ends_in(a.output, ".csv"))
            throw InputError(fmt::format("-o {}: {} has tables of one dimension: the name must end in .csv",
                                         a.output, name_of(plan.scene.classification.method)));
        write_text_whole(a.output, csv_of(plan));
    }
    return kDone;
}

void flags(Flags& f, TableArguments& a) {
    add_scene(f, a.scene);
    f.add("-o,--output", a.output,
          "pi2d: EXR, row = front, column = back; the others: CSV, a row an entry, raw words")
        .required()
        .value("OUT.exr|OUT.csv");
}

}  // namespace

namespace verbs {
extern const Verb table{
    .name = "table",
    .heading = "What happens inside",
    .help = "Write the tables of a scene's classification method",
    .footer = "Example:\n  squint table head.toml --set classification.method=pi2d -o table.exr",
    .describe = described<TableArguments, flags, run>,
};
}

}  // namespace squint::cli
