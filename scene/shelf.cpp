#include "scene/shelf.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace squint {

namespace fs = std::filesystem;

namespace {
constexpr const char* kPapers = "reproduce";  // neither scenes nor sweeps
}

std::vector<std::string> shelf(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code ignored;
    for (fs::recursive_directory_iterator at(folder, ignored), end; at != end; at.increment(ignored))
        if (at->path().extension() == ".toml" && at->path().parent_path().filename() != kPapers)
            names.push_back("@" + at->path().lexically_relative(folder).replace_extension().string());
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> papers(const std::string& folder) {
    std::vector<std::string> files;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(fs::path(folder) / kPapers, ignored))
        if (entry.path().extension() == ".toml") files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    return files;
}

std::string shelf_file(const std::string& name, const std::string& folder) {
    if (!name.starts_with('@')) return name;
    const std::vector<std::string> names = shelf(folder);
    if (names.empty())
        throw InputError(
            fmt::format("{}: there are no scenes to choose from: there is no folder {}", name, folder));
    if (std::find(names.begin(), names.end(), name) == names.end()) {
        const std::string_view near = nearest_name(name, {names.begin(), names.end()});
        throw InputError(fmt::format(
            "{}: no such scene or sweep; {}", name,
            near.empty() ? "squint help --list lists them" : fmt::format("did you mean \"{}\"?", near)));
    }
    return (fs::path(folder) / (name.substr(1) + ".toml")).string();
}

}  // namespace squint
