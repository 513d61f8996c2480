// Bytes as a scene file: read, or refused in one line; what is read is written and read back the same.
#include "scene/scene.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    fuzz::read_or_refuse([&] {
        const Scene scene = parse_scene(fuzz::text_of(data, size), "s.toml", "");
        if (!(parse_scene(to_toml(scene), "again.toml", "") == scene)) std::abort();
    });
    return 0;
}
