#include "studies/reproduce/slab_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace squint::reproduce {
namespace {

constexpr double kDegree = 0.017453292519943295;
constexpr int kSamples = 201;
constexpr double kOffMiddle = 15;                  // degrees
constexpr double kDiffuse = 0.6, kSpecular = 0.4;  // of both together

}  // namespace

SlabLight slab_light(double angle, double exponent) {
    const double half = angle / 2 * kDegree, cosine = std::cos(half), light = kOffMiddle * kDegree;
    SlabLight result{angle, exponent, {}};
    for (int i = 0; i < kSamples; ++i) {
        const double s = static_cast<double>(i) / (kSamples - 1), x = 2 * s - 1;
        // In the plane of the normals, the middle between them along y.
        const double along = x * std::sin(half), up = cosine;
        const double length = std::sqrt(along * along + up * up);
        const double quadratic = cosine / (x * x * (cosine - 1) + 1);  // equation 5
        SlabLightSample sample{s, {1, length, length / quadratic}, {}, {}};
        const double facing = along / length * std::sin(light) + up / length * std::cos(light);
        for (std::size_t turn = 0; turn < kTurns.size(); ++turn) {
            const double value = std::max(0.0, facing * sample.length[turn]);
            sample.diffuse[turn] = value, sample.specular[turn] = std::pow(value, exponent);
        }
        result.samples.push_back(sample);
    }
    return result;
}

std::array<double, 2> SlabLight::length_errors() const {
    std::array<double, 2> errors{};
    for (const SlabLightSample& sample : samples)
        for (std::size_t i = 0; i < errors.size(); ++i)
            errors[i] = std::max(errors[i], 100 * std::abs(sample.length[i + 1] - 1));
    return errors;
}

std::string csv_of(const SlabLight& light) {
    std::string text = "place";
    for (const char* what : {"length", "diffuse", "specular"})
        for (const char* turn : kTurns) text += fmt::format(",{}.{}", what, turn);
    for (const SlabLightSample& s : light.samples) {
        text += fmt::format("\n{:.4f}", s.place);
        for (const auto& columns : {s.length, s.diffuse, s.specular})
            for (const double value : columns) text += fmt::format(",{:.6f}", value);
    }
    return text + "\n";
}

std::string svg_of(const SlabLight& light) {
    constexpr int kWidth = 260, kHeight = 200, kLeft = 40, kTop = 40, kApart = 300;
    constexpr const char* kColors[] = {"#000000", "#d0542a", "#2a6fd0"};
    constexpr const char* kDashes[] = {"none", "6 4", "2 3"};
    struct Panel {
        const char* title;
        std::function<double(const SlabLightSample&, std::size_t)> value;
    };
    const Panel panels[] = {
        {"diffuse", [](const SlabLightSample& s, std::size_t t) { return s.diffuse[t]; }},
        {"specular", [](const SlabLightSample& s, std::size_t t) { return s.specular[t]; }},
        {"both", [](const SlabLightSample& s, std::size_t t) {
             return kDiffuse * s.diffuse[t] + kSpecular * s.specular[t];
         }}};
    std::string svg = fmt::format(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{}' height='{}' font-family='sans-serif' "
        "font-size='12'>\n"
        "<rect width='100%' height='100%' fill='white'/>\n"
        "<text x='{}' y='18'>Light along a slab whose ends' normals stand {:g} degrees apart, exponent "
        "{:g}</text>\n",
        kLeft + 3 * kApart, kHeight + 90, kLeft, light.angle, light.exponent);
    int left = kLeft;
    for (const Panel& panel : panels) {
        svg += fmt::format(
            "<text x='{}' y='{}'>{}</text>\n<rect x='{}' y='{}' width='{}' height='{}' fill='none' "
            "stroke='#888'/>\n",
            left, kTop - 5, panel.title, left, kTop, kWidth, kHeight);
        for (const auto& [value, text] : {std::pair{1.0, "1"}, {0.5, "0.5"}, {0.0, "0"}})
            svg += fmt::format("<text x='{}' y='{:.1f}' text-anchor='end'>{}</text>\n", left - 4,
                               kTop + kHeight * (1 - value) + 4, text);
        svg +=
            fmt::format("<text x='{}' y='{}'>front</text><text x='{}' y='{}' text-anchor='end'>back</text>\n",
                        left, kTop + kHeight + 16, left + kWidth, kTop + kHeight + 16);
        for (std::size_t t = 0; t < kTurns.size(); ++t) {
            svg += fmt::format(
                "<polyline fill='none' stroke='{}' stroke-width='1.6' stroke-dasharray='{}' points='",
                kColors[t], kDashes[t]);
            for (const SlabLightSample& s : light.samples)
                svg += fmt::format("{:.1f},{:.1f} ", left + kWidth * s.place,
                                   kTop + kHeight * (1 - std::min(panel.value(s, t), 1.0)));
            svg += "'/>\n";
        }
        left += kApart;
    }
    for (std::size_t t = 0; t < kTurns.size(); ++t)
        svg += fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", kLeft + 120 * static_cast<int>(t),
                           kTop + kHeight + 40, kColors[t], kTurns[t]);
    return svg + "</svg>\n";
}

}  // namespace squint::reproduce
