// squint doctor: what this installation is made of, and whether it renders the bits it should.
#include "cli/common.h"
#include "pipeline/record.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <hwy/highway.h>
#include <tbb/version.h>
#include <teem/air.h>
#include <nlohmann/json.hpp>

#include <string>
#include <thread>

namespace squint::cli {
namespace {

using Json = nlohmann::ordered_json;

// The hash of the picture below.  It changes only when a picture's meaning does (CONVENTIONS.md).
constexpr const char* kSelfTestHash = "c6e48ef6403a70f7aa9c11c15ceee9eb";

std::string self_test() {
    const Scene scene = scene_with(
        built_in_scene(), {"volume.dims=24", "image.width=32", "image.height=32", "output.fixed=true"});
    std::vector<std::string> notes;
    return picture_hash(render(make_plan(scene, load(scene, notes))).image);
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
    for (std::int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1)
        names += (names.empty() ? "" : " ") + std::string(hwy::TargetName(rest & -rest));
    return names;
}

}  // namespace

int run(const DoctorArguments& a) {
    const int oiio = OIIO::openimageio_version();
    const std::string hash = self_test();
    const bool well = hash == kSelfTestHash;
    Json json{{"schema", "squint.doctor/1"},
              {"squint", version()},
              {"compiler", compiler()},
              {"OpenImageIO", fmt::format("{}.{}.{}", oiio / 10000, oiio / 100 % 100, oiio % 100)},
              {"Highway", fmt::format("{}.{}.{}", HWY_MAJOR, HWY_MINOR, HWY_PATCH)},
              {"TBB", TBB_runtime_version()},
              {"teem", airTeemVersion},
              {"SIMD targets", targets()},
              {"processors", std::thread::hardware_concurrency()},
              {"self-test hash", hash},
              {"self-test", well ? "as expected" : fmt::format("FAILED, expected {}", kSelfTestHash)}};
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

}  // namespace squint::cli
