#include "cli/shelf.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace squint::cli {
namespace {

namespace fs = std::filesystem;

fs::path configs() {
    std::error_code ignored;
    return fs::read_symlink("/proc/self/exe", ignored).parent_path().parent_path() / "share/squint/configs";
}

}  // namespace

std::vector<std::string> shelf() {
    std::vector<std::string> names;
    std::error_code ignored;
    const fs::path folder = configs();
    for (fs::recursive_directory_iterator at(folder, ignored), end; at != end; at.increment(ignored))
        if (at->path().extension() == ".toml")
            names.push_back("@" + at->path().lexically_relative(folder).replace_extension().string());
    std::sort(names.begin(), names.end());
    return names;
}

std::string file_of(const std::string& name) {
    if (!name.starts_with('@')) return name;
    const std::vector<std::string> names = shelf();
    if (names.empty())
        throw InputError(fmt::format("{}: this program has no scenes beside it: there is no folder {}", name,
                                     configs().string()));
    if (std::find(names.begin(), names.end(), name) == names.end()) {
        const std::string_view near = nearest_name(name, {names.begin(), names.end()});
        throw InputError(fmt::format(
            "{}: no such scene or sweep; {}", name,
            near.empty() ? "squint help --list lists them" : fmt::format("did you mean \"{}\"?", near)));
    }
    return (configs() / (name.substr(1) + ".toml")).string();
}

}  // namespace squint::cli
