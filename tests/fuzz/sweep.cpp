// Bytes as a sweep file.
#include "studies/sweep/sweep_file.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    fuzz::read_or_refuse([&] { (void)sweep::parse_sweep(fuzz::text_of(data, size), "sweep.toml", ""); });
    return 0;
}
