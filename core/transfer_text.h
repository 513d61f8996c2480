// What readers of other programs' transfer functions share.  Messages begin with the file's name.
#pragma once

#include "core/text.h"
#include "core/transfer_function.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace squint::transfer_text {

using Json = nlohmann::json;

constexpr std::size_t kMostPoints = 65536;

[[noreturn]] void refuse(const std::string& path, const std::string& what);

std::string read_text(const std::string& path);

/// Parses a number of a line as the "C" locale does, whatever the program's locale.
std::optional<double> number_at(const std::string& line, std::size_t& at);

/// Groups of `stride` numbers; each group begins with its value.
void check_groups(std::span<const double> numbers, std::size_t stride, const std::string& path,
                  const std::string& name);
std::vector<ColorPoint> color_points(std::span<const double> numbers, bool srgb, const std::string& path,
                                     const std::string& name);

/// Refuses a curve with a midpoint or a sharpness of its own: it is not piecewise linear.
void check_straight(double midpoint, double sharpness, const std::string& path, const std::string& name,
                    std::size_t point);

/// Checks the order and the ranges of an imported function.
TransferFunction checked(TransferFunction function, const std::string& path);

/// Parses JSON, and accepts comments and trailing commas.
Json read_json(const std::string& path);
std::vector<double> json_numbers(const Json& map, const char* key, const std::string& path);

/// Runs a reader of JSON and turns its errors into one line.
template <class Read>
TransferFunction from_json(const std::string& path, const Read& read) {
    try {
        return checked(read(read_json(path)), path);
    } catch (const Json::exception& error) {
        const std::string what = error.what();  // "[json.exception.parse_error.101] parse error at ..."
        const std::size_t begin = what.find("] ");
        refuse(path, fmt::format("not the JSON it should be: {}",
                                 excerpt(what.substr(begin == std::string::npos ? 0 : begin + 2), 120)));
    }
}

}  // namespace squint::transfer_text
