#include "core/module_file.h"

#include <dlfcn.h>

#include <filesystem>

namespace squint {

std::string module_file() {
    namespace fs = std::filesystem;
    std::error_code error;
    Dl_info module{};
    // Of a program the loader keeps what it was called by, which may be a name without a folder.
    if (dladdr(reinterpret_cast<const void*>(&module_file), &module) != 0 && module.dli_fname != nullptr)
        if (const fs::path path(module.dli_fname); path.is_absolute()) {
            const fs::path real = fs::canonical(path, error);
            if (!error) return real.string();
        }
    return fs::read_symlink("/proc/self/exe", error).string();
}

}  // namespace squint
