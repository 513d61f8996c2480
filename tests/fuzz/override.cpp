// Bytes as the value of --set: taken, or refused in one line.
#include "scene/scene.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    fuzz::read_or_refuse([&] { (void)scene_with(built_in_scene(), {fuzz::text_of(data, size)}); });
    return 0;
}
