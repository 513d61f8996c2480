// squint-read KIND PATH MAX_BYTES SECONDS SERIES COMPONENT: reads a file with another project's parser, under
// limits.  Returns a header on standard output and the voxels in the memory file, descriptor 3.
#include "core/error.h"
#include "core/import/read/readers.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace squint::read {
namespace {

/// Memory of the parser itself, for slices, tables and headers.  Voxels are not part of it.
constexpr rlim_t kParserBytes = rlim_t{2} << 30;
constexpr rlim_t kOpenFiles = 64;

// Sanitizers of addresses and threads take memory of their own, more than that.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitsMemory = false;
#elif defined(__has_feature)
constexpr bool kLimitsMemory = !__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer);
#else
constexpr bool kLimitsMemory = true;
#endif

void limit(__rlimit_resource what, rlim_t most) {
    const rlimit limits{most, most};
    setrlimit(what, &limits);
}

/// Limits memory, time and files to what a file of voxels needs: no core dump, no file but the memory file.
void limit_all(const LoadLimits& limits, rlim_t seconds) {
    const auto machine =
        static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
    const rlim_t voxels = std::min(machine, static_cast<rlim_t>(limits.max_bytes)) + kPaddingBytes;
    limit(RLIMIT_CPU, seconds);
    if (kLimitsMemory) limit(RLIMIT_DATA, kParserBytes);
    limit(RLIMIT_FSIZE, voxels);
    limit(RLIMIT_NOFILE, kOpenFiles);
    limit(RLIMIT_CORE, 0);
    signal(SIGXFSZ, SIG_IGN);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
}

Handover read(const std::string& kind, const Request& request) {
    if (kind == "dicom") return read_dicom(request);
    if (kind == "nifti") return read_nifti(request);
    if (kind == "vti") return read_vti(request);
    if (kind == "pictures") return read_pictures(request);
    throw InputError(fmt::format("{}: squint-read has no reader \"{}\"", request.path, kind));
}

int run(char** words) {
    const std::string kind = words[1];
    Request request;
    request.path = words[2];
    request.limits.max_bytes = std::atoll(words[3]);
    request.series = std::atoi(words[5]);
    request.component = std::atoi(words[6]);
    limit_all(request.limits, static_cast<rlim_t>(std::atoll(words[4])));
    std::string text;
    int code = 0;
    try {
        text = text_of(read(kind, request));
    } catch (const InputError& error) {
        text = fmt::format("error {}\n", error.what()), code = 2;
    } catch (const std::bad_alloc&) {
        text = fmt::format("error {}: needs more memory than is allowed or there is\n", request.path),
        code = 2;
    }
    const bool written =
        std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
    return written ? code : 3;
}

}  // namespace

unsigned char* room_for(const StoredVolume& stored, const LoadLimits& limits) {
    check_memory(stored.size(), stored, limits);
    const std::size_t bytes = stored.size() + kPaddingBytes;
    void* memory = MAP_FAILED;
    if (ftruncate(kVoxelsDescriptor, static_cast<off_t>(bytes)) == 0)
        memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, kVoxelsDescriptor, 0);
    if (memory == MAP_FAILED)
        throw InputError(fmt::format("{}: {}, but there is no such memory", stored.where, needs(stored)));
    return static_cast<unsigned char*>(memory);
}

}  // namespace squint::read

int main(int count, char** words) {
    if (count != 7) {
        std::fputs("squint-read is run by squint, not by hand\n", stderr);
        return 2;
    }
    return squint::read::run(words);
}
