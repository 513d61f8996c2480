#include "cli/shelf.h"

#include "scene/shelf.h"

#include <filesystem>

namespace squint::cli {
namespace {

std::string folder() {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    return (program.parent_path().parent_path() / "share/squint/configs").string();
}

}  // namespace

std::vector<std::string> shelf() {
    return squint::shelf(folder());
}

std::vector<std::string> papers() {
    return squint::papers(folder());
}

std::string file_of(const std::string& name) {
    return shelf_file(name, folder());
}

}  // namespace squint::cli
