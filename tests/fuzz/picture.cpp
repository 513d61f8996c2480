// Bytes as an EXR that `compare` is given: compared with itself, or refused in one line.
#include "core/compare.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    static const fuzz::File file(".exr");
    fuzz::read_or_refuse([&] {
        Attributes attributes;
        const Image image = read_image(file.write(data, size), &attributes);
        for (const Difference& d : compare(image, image).all)
            if (!d.identical) std::abort();
    });
    return 0;
}
