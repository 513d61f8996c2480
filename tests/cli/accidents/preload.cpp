// Accidents for a program under test, by LD_PRELOAD.  SQUINT_SYNC_LOG=FILE: a line for every fsync and rename, with their
// files.  SQUINT_CLOCK=back: the time of day is an hour less at every look.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace {

template <class F>
F next(const char* name) {
    return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

void note(const std::string& line) {
    const char* const path = std::getenv("SQUINT_SYNC_LOG");
    if (!path) return;
    const int log = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    [[maybe_unused]] const auto written = write(log, line.data(), line.size());
    close(log);
}

}  // namespace

extern "C" int fsync(int file) {
    static const auto real = next<int (*)(int)>("fsync");
    const int done = real(file);
    char path[PATH_MAX] = "";
    const std::string link = "/proc/self/fd/" + std::to_string(file);
    if (done == 0 && readlink(link.c_str(), path, sizeof path - 1) > 0)
        note("fsync\t" + std::string(path) + "\n");
    return done;
}

extern "C" int rename(const char* from, const char* to) noexcept {
    static const auto real = next<int (*)(const char*, const char*)>("rename");
    note("rename\t" + std::string(from) + "\n");
    return real(from, to);
}

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
    static const auto real = next<int (*)(clockid_t, timespec*)>("clock_gettime");
    static std::atomic<long> looks{0};
    const int done = real(clock, time);
    if (done == 0 && clock == CLOCK_REALTIME && std::getenv("SQUINT_CLOCK")) time->tv_sec -= 3600 * ++looks;
    return done;
}
