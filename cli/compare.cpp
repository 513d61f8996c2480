// squint compare: differences between two pictures, and bounds they must keep.
#include "core/compare.h"

#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "core/text.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

namespace squint::cli {
namespace {

struct CompareArguments {
    std::string a, b, diff, json;  // json: a file, or - for standard output
    double gain = 1;
    bool srgb = false;
    std::optional<double> fail_above;  // LSB8
    std::optional<double> min_psnr;    // dB
};

using Json = nlohmann::ordered_json;

std::string psnr_text(const Difference& d, bool words) {
    return d.identical ? "identical" : words ? "-" : fmt::format("{:.2f}", d.psnr.value_or(0));
}

std::string figures_text(const Comparison& comparison, const Image& image) {
    std::vector<std::vector<std::string>> rows{{"channel", "PSNR all", "PSNR foreground", "RMSE", "bias",
                                                "max error", "at x", "y", "SSIM", "foreground pixels"}};
    for (std::size_t i = 0; i < comparison.all.size(); ++i) {
        const Difference &all = comparison.all[i], &foreground = comparison.foreground[i];
        const Channel* channel = image.find(all.channel);
        const bool words = channel && channel->is_words();
        const double unit = words ? 1 : 255;
        rows.push_back({all.channel, psnr_text(all, words), psnr_text(foreground, words),
                        fmt::format("{:.4g}", unit * all.rmse), fmt::format("{:+.4g}", unit * all.bias),
                        fmt::format("{:.4g}", unit * all.largest), std::to_string(all.largest_x),
                        std::to_string(all.largest_y), all.ssim ? fmt::format("{:.6f}", *all.ssim) : "-",
                        std::to_string(foreground.pixels)});
    }
    return table_text(rows) +
           "PSNR in dB, peak 1.  RMSE, bias (A - B) and max error over all pixels in 1/255 of full scale; of "
           "fixed.* in "
           "raw units.\n";
}

/// The bounds that fail, a line each.
std::vector<std::string> failures(const CompareArguments& a, const Comparison& comparison) {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < comparison.all.size(); ++i) {
        const Difference &all = comparison.all[i], &foreground = comparison.foreground[i];
        const bool color =
            all.channel.size() == 1 && std::string_view("RGBA").find(all.channel) != std::string::npos;
        if (a.fail_above && color && all.largest * 255 > *a.fail_above)
            lines.push_back(fmt::format("compare: {}: error of {:.4g} LSB8 at {} {}, allowed: {:g}",
                                        all.channel, all.largest * 255, all.largest_x, all.largest_y,
                                        *a.fail_above));
        if (a.min_psnr && (color || all.channel == "RGB") && !foreground.identical &&
            foreground.psnr.value_or(0) < *a.min_psnr)
            lines.push_back(
                fmt::format("compare: {}: PSNR of {:.2f} dB over the foreground, allowed: {:g} or more",
                            all.channel, foreground.psnr.value_or(0), *a.min_psnr));
    }
    return lines;
}

/// |A - B| as colours over black.
Image sizes_of(Image image) {
    Image sizes{image.width, image.height, {}};
    for (Channel& channel : image.channels)
        if (channel.name == "R" || channel.name == "G" || channel.name == "B") {
            for (float& value : channel.values) value = std::fabs(value);
            sizes.channels.push_back(std::move(channel));
        }
    return sizes;
}

void write_difference(const CompareArguments& a, const Image& x, const Image& y) {
    const Image signed_difference = difference(x, y, a.gain);
    const std::string extension = std::filesystem::path(a.diff).extension().string();
    const double black[3] = {0, 0, 0};
    if (extension == ".exr")
        write_exr(signed_difference, a.diff, {{"squint.version", version()}});
    else if (extension == ".png")
        write_preview_png(sizes_of(signed_difference), a.diff, black);
    else
        throw InputError(fmt::format("--diff {}: the name must end in .exr or .png", a.diff));
}

/// `image` as its preview shows it, over the background that the file states.
Image as_preview(const Image& image, const Attributes& attributes) {
    double background[3] = {0, 0, 0};
    if (const auto given = attributes.find("squint.image.background"); given != attributes.end())
        if (std::sscanf(given->second.c_str(), "[%lf, %lf, %lf]", background, background + 1,
                        background + 2) != 3)
            background[0] = background[1] = background[2] = 0;
    return preview_of(image, background);
}

/// Linear light is compared with display codes as those: as a display shows it.
void show_alike(const CompareArguments& a, Image& x, const Attributes& of_x, Image& y,
                const Attributes& of_y) {
    const auto is_light = [](const Image& image) {
        return !image.is_display && image.find("A") && image.find("R");
    };
    const auto is_shown = [](const Image& image) { return image.is_display && !image.find("A"); };
    const bool first = is_light(x) && is_shown(y);
    if (!first && !(is_light(y) && is_shown(x))) return;
    if (a.srgb)
        throw InputError("--transfer srgb: one picture is encoded already; allowed beside a preview: linear");
    (first ? x : y) = first ? as_preview(x, of_x) : as_preview(y, of_y);
    say(fmt::format("note: {} is compared as its preview: over its background, 8-bit sRGB\n",
                    first ? a.a : a.b));
}

int run(const CompareArguments& a) {
    Attributes of_x, of_y;
    Image x = read_image(a.a, &of_x), y = read_image(a.b, &of_y);
    show_alike(a, x, of_x, y, of_y);
    Comparison comparison;
    std::vector<std::string> failed;
    try {
        comparison = compare(x, y, a.srgb);
        failed = failures(a, comparison);
        if (!a.diff.empty()) write_difference(a, x, y);
    } catch (const InputError& error) {
        if (!comparison.all.empty()) throw;  // the pictures are fine: only the difference cannot be written
        failed = {error.what()};
    }
    if (!a.json.empty())
        write_json(a.json, Json{{"schema", "squint.compare/1"},
                                {"version", version()},
                                {"a", a.a},
                                {"b", a.b},
                                {"transfer", a.srgb ? "srgb" : "linear"},
                                {"channels", json_of(comparison)},
                                {"failed", failed}});
    if (a.json != "-" && !comparison.all.empty()) print(figures_text(comparison, x));
    for (const std::string& line : failed) say(fmt::format("squint: {}\n", line));
    return failed.empty() ? kDone : kComparisonFailed;
}

void flags(Flags& f, CompareArguments& a) {
    const Flag first = f.add("a", a.a, "Picture").required().value("A");
    const Flag second = f.add("b", a.b, "Picture to compare with").value("B");
    f.add("--diff", a.diff, "Write A - B: an EXR with its signs, or a PNG of its size").value("OUT");
    f.add("--gain", a.gain, "Multiply the difference in --diff").value("NUMBER");
    f.choose("--transfer", {"linear", "srgb"}, a.srgb, "linear, or srgb: encode R, G and B first");
    f.add("--max-error,--fail-above", a.fail_above, "Fail when any error is larger, in 1/255 of full scale")
        .not_negative()
        .value("LSB8");
    f.add("--min-psnr", a.min_psnr, "Fail when the PSNR over the foreground is lower").value("DB");
    const Flag json = f.add("--json", a.json,
                            "Write the figures as JSON; without a file to standard output, in place of "
                            "the table")
                          .value_may_be_left_out()
                          .value("FILE|-");
    f.then([&a, first, second, json] {
        if (json.given() && !second.given() && !a.json.empty()) {
            // A word after a bare --json is a picture.
            a.b = json.before(first) ? std::exchange(a.a, a.json) : a.json;
            a.json = "-";
        }
        if (a.b.empty())
            throw InputError("compare: one picture given; allowed: two; see squint compare --help");
        if (json.given() && a.json.empty()) a.json = "-";
    });
}

}  // namespace

namespace verbs {
extern const Verb compare{
    .name = "compare",
    .heading = "Pictures",
    .help = "Compare two pictures; exit code 1 when a bound fails",
    .footer =
        "Different sizes or channels and values that are not finite fail, always.\n\n"
        "Example:\n  squint compare fixed.exr real.exr --min-psnr 60 --diff diff.exr",
    .describe = described<CompareArguments, flags, run>,
};
}

}  // namespace squint::cli
