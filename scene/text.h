// Settings as TOML values: "auto" where a setting is absent.
#pragma once

#include "scene/scene.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <cstdint>
#include <type_traits>

namespace squint {

template <class E>
requires std::is_enum_v<E> std::string text_of(E value) {
    return toml_text(name_of(value));
}
template <class I>
requires(std::is_integral_v<I>) std::string text_of(I value) {
    if constexpr (std::is_same_v<I, bool>)
        return toml_text(value);
    else
        return toml_text(static_cast<std::int64_t>(value));
}
inline std::string text_of(double value) {
    return toml_text(value);
}
inline std::string text_of(const std::string& value) {
    return toml_text(std::string_view(value));
}
inline std::string text_of(const Vec3& v) {
    return fmt::format("[{}, {}, {}]", toml_text(v.x), toml_text(v.y), toml_text(v.z));
}
inline std::string text_of(const Light& light);
template <class T>
std::string text_of(const std::vector<T>& list) {
    std::string text = "[";
    for (const T& item : list) text += (text.size() > 1 ? ", " : "") + text_of(item);
    return text + "]";
}
template <class T>
std::string text_of(const std::optional<T>& value) {
    return value ? text_of(*value) : "\"auto\"";
}

inline std::string text_of(const ValueRange& range) {
    return range.of_data ? toml_text(std::string_view("data")) : text_of(range.ends);
}

inline std::string text_of(const Light& light) {
    std::string text;
    visit_light(light, [&](std::string_view name, const auto& setting, std::string_view) {
        text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", name, text_of(setting));
    });
    return "{ " + text + " }";
}

/// The parts of "section.name".
inline std::string_view section_of(std::string_view key) {
    return key.substr(0, key.find('.'));
}
inline std::string_view name_in_section(std::string_view key) {
    return key.substr(key.find('.') + 1);
}

template <class T>
bool is_absent(const T&) {
    return false;
}
template <class T>
bool is_absent(const std::optional<T>& value) {
    return !value;
}

}  // namespace squint
