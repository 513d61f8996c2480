// Bytes as a preset file of formats.
#include "scene/scene.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    static const fuzz::File file(".toml");
    Scene scene = built_in_scene();
    scene.precision.preset = file.write(data, size);
    fuzz::read_or_refuse([&] { (void)resolved_precision(scene); });
    return 0;
}
