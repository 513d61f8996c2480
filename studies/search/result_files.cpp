#include "studies/search/result_files.h"

#include "core/atomic_file.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>

#include <filesystem>

namespace squint::search {
namespace {

std::string record_file(const std::string& folder) {
    return folder + "/search.json";
}

}  // namespace

std::string formats_file(const std::string& folder) {
    return folder + "/formats.toml";
}

void remove_result_files(const std::string& folder) {
    for (const std::string& old : {formats_file(folder), record_file(folder)}) std::filesystem::remove(old);
}

void write_formats(const std::string& folder, const std::string& about, const std::string& preset,
                   const std::vector<Wire>& wires, const std::vector<Spec>& specs) {
    std::string text = about + fmt::format("[precision]\npreset = \"{}\"\n", preset);
    for (std::size_t w = 0; w < wires.size(); ++w)
        text += fmt::format("{} = \"{}\"\n", info(wires[w]).name, to_string(specs[w]));
    write_text_whole(formats_file(folder), text);
}

void write_search_record(const std::string& folder, const sweep::Json& record) {
    write_text_whole(record_file(folder), sweep::dump(record));
}

sweep::Json begin_record(const Settings& settings) {
    sweep::Json record{{"schema", "squint.search/1"}};
    record.update(sweep::program_record());
    record.update({{"command", settings.command},
                   {"scenes", settings.scenes},
                   {"max_error_lsb8", settings.most_error}});
    return record;
}

sweep::Json formats_record(const std::vector<Wire>& wires, const std::vector<Spec>& specs) {
    sweep::Json record = sweep::Json::object();
    for (std::size_t w = 0; w < wires.size(); ++w)
        record[std::string(info(wires[w]).name)] = to_string(specs[w]);
    return record;
}

}  // namespace squint::search
