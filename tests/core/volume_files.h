// Small volume files in a folder of their own, for the tests of the loaders.
#pragma once

#include "core/error.h"
#include "core/volume_source.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

namespace squint {

class VolumeFiles : public testing::Test {
  protected:
    /// Writes a file and gives its path.
    std::string file(const std::string& name, const std::string& bytes) const {
        std::filesystem::remove(folder / name);  // a new file: truncating an old one waits for the disk
        std::ofstream(folder / name, std::ios::binary) << bytes;
        return (folder / name).string();
    }
    static Volume load(const VolumeSource& source, const LoadLimits& limits = {}) {
        return load_volume(source, limits);
    }
    static Volume load_path(const std::string& path) { return load_volume({.file = path}); }
    static std::vector<std::string> notes_of(const VolumeSource& source) {
        std::vector<std::string> notes;
        load_volume(source, {}, &notes);
        return notes;
    }
    /// What a load is refused with, without the folder; always one line.
    std::string refusal(const VolumeSource& source, const LoadLimits& limits = {}) const {
        try {
            load_volume(source, limits);
        } catch (const InputError& error) {
            std::string message = error.what();
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            const std::string prefix = folder.string() + "/";
            for (std::size_t at; (at = message.find(prefix)) != std::string::npos;)
                message.erase(at, prefix.size());
            return message;
        }
        return "no refusal";
    }
    std::string refusal_of(const std::string& path) const { return refusal(VolumeSource{.file = path}); }

    static std::vector<std::uint32_t> scalars_of(const Volume& volume) {
        std::vector<std::uint32_t> scalars;
        for (std::int64_t z = 0; z < volume.dims.z; ++z)
            for (std::int64_t y = 0; y < volume.dims.y; ++y)
                for (std::int64_t x = 0; x < volume.dims.x; ++x) scalars.push_back(volume.at(x, y, z));
        return scalars;
    }

    const test::OwnFolder folder;
};

template <class T>
std::string bytes_of_values(const std::vector<T>& values, bool big_endian = false) {
    std::string bytes(values.size() * sizeof(T), 0);
    std::memcpy(bytes.data(), values.data(), bytes.size());
    for (std::size_t i = 0; big_endian && i < bytes.size(); i += sizeof(T))
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                     bytes.begin() + static_cast<std::ptrdiff_t>(i + sizeof(T)));
    return bytes;
}

inline std::string gzip(const std::string& bytes) {
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
    std::string packed(deflateBound(&stream, bytes.size()), 0);
    stream.next_in = reinterpret_cast<unsigned char*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<unsigned>(bytes.size());
    stream.next_out = reinterpret_cast<unsigned char*>(packed.data());
    stream.avail_out = static_cast<unsigned>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

/// 0, 1, 2, ...
template <class T>
std::vector<T> counting(std::size_t count) {
    std::vector<T> values(count);
    std::iota(values.begin(), values.end(), T{0});
    return values;
}

}  // namespace squint
