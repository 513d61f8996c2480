// Bytes as a NRRD: header and data.
#include "core/volume_source.h"
#include "tests/fuzz/fuzz_file.h"

/// teem keeps a few dozen bytes of some headers that it refuses.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libteem";
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    static const fuzz::File file(".nrrd");
    fuzz::read_or_refuse([&] {
        VolumeSource source;
        source.file = file.write(data, size);
        if (size % 2 == 1) source.window = {-1, 1}, source.bits = 9;  // floats need them
        std::vector<std::string> notes;
        const Volume volume = load_volume(source, {.max_bytes = 1 << 22}, &notes);
        if (volume.largest > volume.largest_representable()) std::abort();
    });
    return 0;
}
