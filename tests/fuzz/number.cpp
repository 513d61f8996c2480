// Bytes as a line of `number`: calculated, or answered by one line.
#include "fixedpoint/calculator.h"
#include "tests/fuzz/fuzz_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace squint;
    Calculation c;
    const std::string wrong = calculate({fuzz::text_of(data, size)}, c);
    if (wrong.empty()) {
        const Format& format = c.spec.format;
        if (c.raw < format.smallest() || c.raw > format.largest()) std::abort();
        if (decimal({c.raw, format.fraction_bits}).empty() || bits(c.raw, format).empty()) std::abort();
        (void)last_bits(c);
    }
    return 0;
}
