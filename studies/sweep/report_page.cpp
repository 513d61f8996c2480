#include "studies/sweep/report_page.h"

#include <cstddef>

// The assembler copies the file: as an array, a megabyte would take the compiler a minute.
asm(".section .rodata\n"
    ".balign 16\n"
    "squint_report_page_begin:\n"
    ".incbin \"" SQUINT_REPORT_PAGE
    "\"\n"
    "squint_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const char squint_report_page_begin[], squint_report_page_end[];

namespace squint::sweep {

std::string_view report_page() {
    return {squint_report_page_begin,
            static_cast<std::size_t>(squint_report_page_end - squint_report_page_begin)};
}

}  // namespace squint::sweep
