// ImageVis3D's one-dimensional functions.
#include "core/transfer_import.h"
#include "core/transfer_text.h"

#include <algorithm>
#include <string_view>

namespace squint {
namespace {

using namespace transfer_text;

TransferFunction imagevis3d_function(const std::string& text, bool srgb, const std::string& path) {
    std::vector<double> numbers;
    const std::string_view space = " \t\r\n";
    for (std::size_t at = text.find_first_not_of(space); at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(space, at), text.size());
        std::size_t from = 0;
        const std::optional<double> number = number_at(text.substr(at, end - at), from);
        if (!number)
            refuse(path, fmt::format("\"{}\" is not a number", excerpt(text.substr(at, end - at), 20)));
        numbers.push_back(*number);
        at = std::min(text.find_first_not_of(space, end), text.size());
    }
    const std::size_t count = numbers.empty() ? 0 : (numbers.size() - 1) / 4;
    if (count < 2 || count > kMostPoints || numbers.size() != 4 * count + 1 ||
        numbers[0] != static_cast<double>(count))
        refuse(path, fmt::format("{} numbers, allowed are a count of 2 to {} and as many colours r g b a",
                                 numbers.size(), kMostPoints));
    TransferFunction function;
    std::vector<double> colors;
    for (std::size_t i = 0; i < count; ++i) {
        const double* rgba = &numbers[4 * i + 1];
        colors.insert(colors.end(), {static_cast<double>(i), rgba[0], rgba[1], rgba[2]});
        function.opacity.push_back({static_cast<double>(i), rgba[3]});
    }
    function.color = color_points(colors, srgb, path, "colours");
    return function;
}

}  // namespace

TransferFunction import_imagevis3d(const std::string& path, bool srgb, double unit_distance) {
    TransferFunction function = imagevis3d_function(read_text(path), srgb, path);
    function.unit_distance = unit_distance;
    return checked(std::move(function), path);
}

}  // namespace squint
