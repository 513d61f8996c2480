// The squint program: parses the command line, runs one verb, and turns an exception into one line and an
// exit code.
//
//   0 done   1 a comparison failed, or nothing was found that keeps a bound   2 usage or input   70 internal error   130 interrupted
#include "cli/command_line.h"
#include "cli/common.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"
#include "pipeline/render.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <exception>
#include <new>

namespace squint::cli {

std::atomic<bool> interrupted{false};

namespace {

std::atomic<int> interruptible{0};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

// Another thread may be about to create its temporary: it has done so long before the second look.
void remove_temporaries_twice() noexcept {
    remove_temporaries();
    const timespec pause{0, 20'000'000};
    nanosleep(&pause, nullptr);
    remove_temporaries();
}

void leave_at_once() {
    remove_temporaries_twice();
    constexpr char message[] = "squint: interrupted\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, message, sizeof message - 1);
    _exit(kInterrupted);
}

void on_interrupt(int) {
    if (interruptible > 0 && !interrupted)
        interrupted = true;
    else
        leave_at_once();
}

// Ends as the signal demands, after removing temporaries.
void on_end(int signal) {
    remove_temporaries_twice();
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

// A signal that our parent ignores (nohup, a background job) stays ignored.
void handle(int signal, void (*handler)(int)) {
    if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

int report(int code, const char* kind, const char* what) {
    say(fmt::format("squint: {}{}\n", kind, message_text(what)));
    return code;
}

}  // namespace

Interruptible::Interruptible() {
    ++interruptible;
}
Interruptible::~Interruptible() {
    --interruptible;
}

}  // namespace squint::cli

int main(int argc, char** argv) {
    using namespace squint;
    using namespace squint::cli;
    handle(SIGINT, on_interrupt);
    handle(SIGTERM, on_interrupt);
    handle(SIGHUP, on_end);
    handle(SIGPIPE, on_end);
    try {
        return parse(argc, argv)();
    } catch (const InputError& error) {
        return report(kUsage, "", error.what());
    } catch (const Cancelled&) {
        return report(kInterrupted, "", "interrupted");
    } catch (const std::bad_alloc&) {
        return report(kUsage, "",
                      "out of memory: this machine has too little for this scene; see --max-memory");
    } catch (const std::exception& error) {
        return report(kInternal, "internal error: ", error.what());
    }
}
