// squint volume: writes a volume of any kind for other programs.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "core/volume_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace squint::cli {
namespace {

struct VolumeArguments {
    std::string volume, output;
    std::vector<std::string> overrides;
};

void flags(Flags& f, VolumeArguments& a) {
    f.add("volume", a.volume, "A procedural volume by name, a volume file or a folder of slices")
        .required()
        .value("NAME|FILE");
    add_series(f, a.overrides);
    f.add("-o,--output", a.output, "NRRD to write").required().value("OUT.nrrd");
    add_set(f, a.overrides, "Set a volume.* key");
    f.read(
         "--dims",
         [&](const std::string& text) {
             std::string list = text;
             std::replace(list.begin(), list.end(), 'x', ',');
             a.overrides.push_back("volume.dims=[" + list + "]");
         },
         "Voxels, as in 64 or 64x64x32")
        .in_order()
        .value("N|XxYxZ");
    f.read(
         "--bits", [&](const std::string& text) { a.overrides.push_back("volume.bits=" + text); },
         "Bits of a procedural or float volume")
        .in_order()
        .value("N");
}

int run(const VolumeArguments& a) {
    if (std::filesystem::path(a.output).extension() != ".nrrd")
        throw InputError(fmt::format("-o {}: the name must end in .nrrd", a.output));
    std::vector<std::string> notes;
    const auto volume = load(scene_of_volume(a.volume, a.overrides), notes);
    save_nrrd(*volume, a.output);
    say(fmt::format("{}: {}x{}x{} voxels of {} bits from {}\n", a.output, volume->dims.x, volume->dims.y,
                    volume->dims.z, 8 * volume->scalar_bytes(), volume->name));
    return kDone;
}

}  // namespace

namespace verbs {
extern const Verb volume{
    .name = "volume",
    .heading = "Volumes",
    .help = "Write a volume of any kind as NRRD",
    .footer = "Example:\n  squint volume marschner_lobb --dims 64 --bits 8 -o ml.nrrd",
    .describe = described<VolumeArguments, flags, run>,
};
}

}  // namespace squint::cli
