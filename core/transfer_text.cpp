#include "core/transfer_text.h"

#include "core/error.h"
#include "core/read_whole.h"
#include "core/srgb.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace squint::transfer_text {
namespace {

constexpr std::size_t kMostBytes = std::size_t{16} << 20;  // colour maps are a few kilobytes

Vec3 decoded(const Vec3& color, bool srgb) {
    return srgb ? Vec3(linear_from_srgb(color.x), linear_from_srgb(color.y), linear_from_srgb(color.z))
                : color;
}

/// Removes a comma with only space and comments before a closing bracket: editors of text leave them.
std::string without_trailing_commas(std::string text) {
    std::size_t comma = std::string::npos;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"') {
            for (++i; i < text.size() && text[i] != '"'; ++i) i += text[i] == '\\';
        } else if (c == '/' && i + 1 < text.size() && (text[i + 1] == '/' || text[i + 1] == '*')) {
            const std::size_t end = text.find(text[i + 1] == '/' ? "\n" : "*/", i + 2);
            i = end == std::string::npos ? text.size() : end + (text[i + 1] == '*');
            continue;
        } else if (c == ',') {
            comma = i;
            continue;
        } else if (std::isspace(static_cast<unsigned char>(c))) {
            continue;
        } else if ((c == ']' || c == '}') && comma != std::string::npos) {
            text[comma] = ' ';
        }
        comma = std::string::npos;
    }
    return text;
}

}  // namespace

void refuse(const std::string& path, const std::string& what) {
    throw InputError(fmt::format("{}: {}", path, what));
}

std::string read_text(const std::string& path) {
    return read_whole(path, "a transfer function of ParaView, 3D Slicer or ImageVis3D", kMostBytes);
}

void check_groups(std::span<const double> numbers, std::size_t stride, const std::string& path,
                  const std::string& name) {
    if (numbers.empty() || numbers.size() % stride != 0)
        refuse(path,
               fmt::format("{} has {} numbers, allowed is {} for every point", name, numbers.size(), stride));
    if (numbers.size() / stride > kMostPoints)
        refuse(path,
               fmt::format("{} has {} points, allowed is {}", name, numbers.size() / stride, kMostPoints));
}

std::vector<ColorPoint> color_points(std::span<const double> numbers, bool srgb, const std::string& path,
                                     const std::string& name) {
    check_groups(numbers, 4, path, name);
    for (std::size_t i = 0; i < numbers.size(); ++i)  // before decoding, which would hide a colour below 0
        if (i % 4 != 0 && !(numbers[i] >= 0 && numbers[i] <= 1))
            refuse(path, fmt::format("{}, point {}: {}, allowed is 0 to 1", name, i / 4 + 1, numbers[i]));
    std::vector<ColorPoint> points;
    for (std::size_t i = 0; i < numbers.size(); i += 4)
        points.push_back({numbers[i], decoded({numbers[i + 1], numbers[i + 2], numbers[i + 3]}, srgb)});
    return points;
}

TransferFunction checked(TransferFunction function, const std::string& path) {
    function.name = path;
    check(function);
    return function;
}

std::optional<double> number_at(const std::string& line, std::size_t& at) {
    at = std::min(line.find_first_not_of(" \t", at), line.size());
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    double number = 0;
    const auto [stopped, error] = std::from_chars(line.data() + at, line.data() + end, number);
    if (error != std::errc{} || stopped != line.data() + end || at == end) return std::nullopt;
    at = end;
    return number;
}

void check_straight(double midpoint, double sharpness, const std::string& path, const std::string& name,
                    std::size_t point) {
    if (midpoint != 0.5 || sharpness != 0)
        refuse(path, fmt::format("{}, point {}: midpoint {} and sharpness {}, allowed are 0.5 and 0 (linear)",
                                 name, point + 1, midpoint, sharpness));
}

Json read_json(const std::string& path) {
    return Json::parse(without_trailing_commas(read_text(path)), nullptr, true, true);
}

std::vector<double> json_numbers(const Json& map, const char* key, const std::string& path) {
    const auto& list = map.at(key);
    if (!list.is_array()) refuse(path, fmt::format("{} is not a list of numbers", key));
    std::vector<double> numbers;
    for (const auto& item : list) {
        if (!item.is_number())
            refuse(path, fmt::format("{} holds {}, allowed are numbers", key, excerpt(item.dump())));
        numbers.push_back(item.get<double>());
    }
    return numbers;
}

}  // namespace squint::transfer_text
