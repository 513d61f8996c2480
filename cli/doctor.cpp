// squint doctor: what this installation consists of, and whether it renders the right bits.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/pictures/pictures.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <hwy/highway.h>
#include <tbb/version.h>
#include <teem/air.h>
#include <nlohmann/json.hpp>

#include <string>
#include <thread>

namespace squint::cli {
namespace {

struct DoctorArguments {
    bool json = false;
};

using Json = nlohmann::ordered_json;

// The hash of the picture below.  It changes only when the meaning of a picture does (docs/conventions.md).
constexpr const char* kSelfTestHash = "d5d997b12f72b1bf6e9e15d03f5390a2";

/// A lit ball in a shell, 32x32 pixels of words, drawn by one path.
std::string self_test(Path path) {
    const Scene scene =
        scene_with(built_in_scene(), {"volume.procedural=sphere", "volume.dims=24", "image.width=32",
                                      "image.height=32", "output.fixed=true", "classification.method=pc",
                                      "transfer_function.points=[[0, 0.2, 0.4, 0.9, 0.0], [2000, 0.9, 0.5, "
                                      "0.1, 0.6], [4095, 1.0, 1.0, 0.8, 0.9]]",
                                      "transfer_function.unit_distance=1"});
    std::vector<std::string> notes;
    RenderOptions options;
    options.path = path;
    return picture_hash(render(make_plan(scene, load(scene, notes)), options).image);
}

std::string compiler() {
#if defined(__clang__)
    return fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#else
    return fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
}

std::string targets() {
    std::string names;
    for (const std::string& name : lanes::target_names()) names += (names.empty() ? "" : " ") + name;
    return names;
}

int run(const DoctorArguments& a) {
    const int oiio = pictures::codec().version;
    const std::string model = self_test(Path::model), fast = self_test(Path::automatic);
    const bool well = model == kSelfTestHash && fast == model;
    Json json{{"schema", "squint.doctor/1"},
              {"squint", version()},
              {"compiler", compiler()},
              {"OpenImageIO", fmt::format("{}.{}.{}", oiio / 10000, oiio / 100 % 100, oiio % 100)},
              {"Highway", fmt::format("{}.{}.{}", HWY_MAJOR, HWY_MINOR, HWY_PATCH)},
              {"TBB", TBB_runtime_version()},
              {"teem", airTeemVersion},
              {"SIMD targets", targets()},
              {"processors", std::thread::hardware_concurrency()},
              {"self-test hash", model},
              {"self-test", well            ? "as expected"
                            : fast != model ? "FAILED, the fast path gives " + fast
                                            : fmt::format("FAILED, expected {}", kSelfTestHash)}};
    if (a.json) {
        print_json(json);
    } else {
        std::vector<std::vector<std::string>> rows;
        for (const auto& [key, value] : json.items())
            if (key != "schema")
                rows.push_back({key, value.is_string() ? value.get<std::string>() : value.dump()});
        print(table_text(rows));
    }
    return well ? kDone : kComparisonFailed;
}

void flags(Flags& f, DoctorArguments& a) {
    add_json_flag(f, a.json);
}

}  // namespace

namespace verbs {
extern const Verb doctor{
    .name = "doctor",
    .heading = "This program",
    .help = "Check this installation: libraries, SIMD targets, threads, a test picture",
    .footer = "Example:\n  squint doctor",
    .describe = described<DoctorArguments, flags, run>,
};
}

}  // namespace squint::cli
