// squint info: says what a volume is.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "core/volume_source.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace squint::cli {
namespace {

struct InfoArguments {
    std::string volume;  // the name of a procedural volume, or a file
    std::vector<std::string> overrides;
    bool json = false;
};

/// A histogram: at most `most` equal ranges of scalars, from the least to the greatest.
struct Histogram {
    std::uint32_t first = 0, width = 1;  // width of a range, in scalars
    std::vector<std::int64_t> count;
};

Histogram histogram_of(const Volume& v, std::uint32_t most) {
    Histogram h;
    const std::uint32_t levels = v.largest - v.smallest + 1;
    h.first = v.smallest, h.width = (levels + most - 1) / most;
    std::vector<std::int64_t> level(v.largest + 1);
    for (std::int64_t z = 0; z < v.dims.z; ++z)
        for (std::int64_t y = 0; y < v.dims.y; ++y)
            for (std::int64_t x = 0; x < v.dims.x; ++x) ++level[v.at(x, y, z)];
    h.count.resize((levels + h.width - 1) / h.width);
    for (std::uint32_t s = v.smallest; s <= v.largest; ++s) h.count[(s - h.first) / h.width] += level[s];
    return h;
}

std::string histogram_text(const Volume& v) {
    const Histogram h = histogram_of(v, 24);
    const double most = std::log1p(static_cast<double>(*std::max_element(h.count.begin(), h.count.end())));
    std::vector<std::vector<std::string>> rows{{"from value", "voxels", "share", "(bars are logarithmic)"}};
    for (std::size_t i = 0; i < h.count.size(); ++i) {
        const double value = v.value_scale * (h.first + static_cast<double>(i) * h.width) + v.value_offset;
        const auto count = static_cast<double>(h.count[i]);
        rows.push_back(
            {fmt::format("{:g}", value), std::to_string(h.count[i]),
             fmt::format("{:.2f} %", 100 * count / static_cast<double>(v.voxels())),
             std::string(static_cast<std::size_t>(std::lround(40 * std::log1p(count) / most)), '#')});
    }
    return table_text(rows, "  ");
}

std::string info_text(const Volume& v) {
    std::string text = v.name + "\n";
    const auto line = [&](const char* what, const std::string& value) {
        text += fmt::format("  {:<9} {}\n", what, value);
    };
    line("dims",
         fmt::format("{} x {} x {} = {} voxels, {} in memory", v.dims.x, v.dims.y, v.dims.z, v.voxels(),
                     text_of_bytes(v.voxels() * static_cast<std::int64_t>(v.scalar_bytes()))));
    line("type",
         fmt::format("{}, levels of {} bits", v.type == ScalarType::u8 ? "u8" : "u16", v.scalar_bits));
    line("spacing", fmt::format("{:g} {:g} {:g}", v.spacing.x, v.spacing.y, v.spacing.z));
    const Vec3 origin = v.world_from_voxel(Vec3(0));
    line("origin", fmt::format("{:g} {:g} {:g}", origin.x, origin.y, origin.z));
    for (std::size_t a = 0; v.turned() && a < 3; ++a)
        line(fmt::format("along {}", "xyz"[a]).c_str(),
             fmt::format("{:.6f} {:.6f} {:.6f}", v.turn[a].x, v.turn[a].y, v.turn[a].z));
    if (!v.space.empty()) line("axes", v.space + (v.modality.empty() ? "" : ", " + v.modality));
    line("scalars", fmt::format("{} to {}", v.smallest, v.largest));
    line("values", fmt::format("{:g} to {:g} (value = {:g} * scalar + {:g})",
                               v.value_scale * v.smallest + v.value_offset,
                               v.value_scale * v.largest + v.value_offset, v.value_scale, v.value_offset));
    line("hash", v.content_hash);
    return text;
}

int run(const InfoArguments& a) {
    std::vector<std::string> notes;
    const auto volume = load(scene_of_volume(a.volume, a.overrides), notes);
    if (!a.json) {
        std::string text = info_text(*volume);
        for (const std::string& note : notes) text += "  note: " + note + "\n";
        print(text + "\nhistogram\n" + histogram_text(*volume));
        return kDone;
    }
    nlohmann::ordered_json json = json_of(*volume);
    const Histogram h = histogram_of(*volume, 256);
    json["histogram"] = {{"first_scalar", h.first}, {"scalars_per_bin", h.width}, {"counts", h.count}};
    if (!volume->space.empty()) json["space"] = volume->space;
    if (!volume->modality.empty()) json["modality"] = volume->modality;
    json["notes"] = notes;
    print_json(json);
    return kDone;
}

void flags(Flags& f, InfoArguments& a) {
    f.add("volume", a.volume, "Volume file, folder of slices, or a procedural volume by name")
        .value("VOLUME");
    add_series(f, a.overrides);
    add_set(f, a.overrides, "Set a volume.* key: what a raw file does not say");
    add_json_flag(f, a.json);
}

}  // namespace

namespace verbs {
extern const Verb info{
    .name = "info",
    .heading = "Volumes",
    .help = "Describe a volume: size, type, spacing, range, histogram",
    .footer =
        "Examples:\n"
        "  squint info head.nrrd\n"
        "  squint info head.raw --set volume.dims=[256,256,113] --set volume.type=u16\n"
        "  squint info phantom",
    .describe = described<InfoArguments, flags, run>,
};
}

}  // namespace squint::cli
