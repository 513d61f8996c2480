// What fuzz targets share: bytes become a file, and an InputError is the only answer beside a result.
#pragma once

#include "core/error.h"
#include "tests/own_folder.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace squint::fuzz {

/// A file of this process alone, written anew for each input.
class File {
  public:
    explicit File(const std::string& extension) : path_(folder_ / ("input" + extension)) {}

    const std::string& write(const std::uint8_t* data, std::size_t size) const {
        std::FILE* file = std::fopen(path_.c_str(), "wb");
        if (!file || std::fwrite(data, 1, size, file) != size || std::fclose(file) != 0) std::abort();
        return path_;
    }

  private:
    const test::OwnFolder folder_;
    const std::string path_;
};

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

/// Calls read(); a refusal must be one line.  Every other exception ends the program, and is what is looked for.
template <class Read>
void read_or_refuse(const Read& read) {
    try {
        read();
    } catch (const InputError& error) {
        const std::string line = error.what();
        if (line.empty() || line.find_first_of("\r\n") != std::string::npos) std::abort();
    }
}

}  // namespace squint::fuzz
