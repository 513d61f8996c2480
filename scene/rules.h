// What each setting of a scene may be, in words and as a check: one table serves reading, messages and
// docs/scene.md.
#pragma once

#include "scene/scene.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <type_traits>

namespace squint {

/// A range of numbers.  An infinite end is not mentioned in messages.
struct Limits {
    std::string_view key;
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    bool low_open = false, high_open = false;
    double also = std::numeric_limits<double>::quiet_NaN();  // one more allowed value

    bool hold(double value) const {
        if (value == also) return true;
        return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
    }
    std::string text() const;  // " above 0", " from 1 to 16384", or nothing
};

/// The limits of a setting's number, or of each of its numbers.
const Limits& limits_of(std::string_view key);
/// The words that a text setting may hold; empty where any text is allowed.
std::vector<std::string_view> words_of(std::string_view key);
/// Whether "" means "not given" for a setting with a list of words.
bool may_be_empty(std::string_view key);
/// How many numbers a list setting holds: {1, 3} is one or three; empty where any number is allowed.
std::vector<std::size_t> counts_of(std::string_view key);

template <class T>
inline constexpr bool is_optional = false;
template <class T>
inline constexpr bool is_optional<std::optional<T>> = true;

template <class E>
std::vector<std::string_view> names_of() {
    return {std::begin(EnumNames<E>::names), std::end(EnumNames<E>::names)};
}

/// What a setting may be, in words: "a number above 0".
template <class T>
std::string allowed_text(std::string_view key) {
    const std::string limits = limits_of(key).text();
    if constexpr (is_optional<T>) {
        return allowed_text<typename T::value_type>(key);  // or "auto"
    } else if constexpr (std::is_enum_v<T>) {
        return listed(names_of<T>());
    } else if constexpr (std::is_same_v<T, std::string>) {
        if (const auto words = words_of(key); !words.empty())
            return listed(words) + (key == "precision.preset" ? ", or the path of a preset file" : "");
        if (key == "volume.file" || key == "transfer_function.file") return "a path in quotes";
        if (key.starts_with("precision."))
            return "a format (I of 0 to 24, F of 0 to 29, not both 0), a rounding (trn, trn_zero, rnd, "
                   "rnd_conv) and "
                   "an overflow rule (sat, wrap), as "
                   "in \"u1.15 trn sat\"; "
                   "parts may be left out";
        return "a name in quotes";
    } else if constexpr (std::is_same_v<T, bool>) {
        return "true or false";
    } else if constexpr (std::is_same_v<T, double>) {
        return "a number" + limits;
    } else if constexpr (std::is_integral_v<T>) {
        return "a whole number" + limits;
    } else if constexpr (std::is_same_v<T, Vec3>) {
        return (key.ends_with("color") || key.ends_with("background") || key.ends_with("cool") ||
                        key.ends_with("warm")
                    ? "three numbers [r, g, b]"
                    : "three numbers [x, y, z]") +
               limits;
    } else if constexpr (std::is_same_v<T, ValueRange>) {
        return "two numbers, the first below the second, \"data\", or [] for none";
    } else if constexpr (std::is_same_v<T, std::vector<std::vector<double>>>) {
        return key == "transfer_function.points"
                   ? "a list of [value, r, g, b, alpha], values ascending, the rest from 0 to 1"
               : key == "transfer_function.color"
                   ? "a list of [value, r, g, b], values ascending, the rest from 0 to 1"
                   : "a list of [value, alpha], values ascending, alpha from 0 to 1";
    } else {
        const std::string numbers =
            (std::is_same_v<T, std::vector<double>> ? " numbers" : " whole numbers") + limits;
        const auto counts = counts_of(key);
        return counts.size() == 2 ? "one or three" + numbers : "two" + numbers;
    }
}

}  // namespace squint
