// Bytes as a transfer function of another program; the first byte says of which.
#include "core/transfer_import.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    static const fuzz::File file("");
    if (size == 0) return 0;
    const std::string& path = file.write(data + 1, size - 1);
    fuzz::read_or_refuse([&] {
        switch (data[0] % 4) {
            case 0:
                return check(import_paraview_json(path, data[0] & 4 ? "b" : "", data[0] & 8, 1));
            case 1:
                return check(import_slicer_vp(path, false));
            case 2:
                return check(import_slicer_json(path, false));
            default:
                return check(import_imagevis3d(path, false, 1));
        }
    });
    return 0;
}
