#include "core/import/child.h"

#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/handover.h"
#include "core/import/stored_bytes.h"
#include "core/module_file.h"
#include "core/text.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>

extern char** environ;

namespace squint {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostHeader = std::size_t{1} << 20;
/// Processor seconds of a reader: 4, and one for every 16 MiB of its files (gzip of that size makes some 100
/// MiB of voxels a second).
constexpr std::int64_t kLeastSeconds = 4, kBytesPerSecond = std::int64_t{16} << 20;
/// How much longer than its processor time a reader may take on a busy machine.
constexpr std::int64_t kWaits = 15;

/// Owns a descriptor, moved above those that a child uses itself.
class Descriptor {
  public:
    explicit Descriptor(int number) : number_(number < 0 ? -1 : fcntl(number, F_DUPFD_CLOEXEC, 16)) {
        if (number >= 0) ::close(number);
    }
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return number_; }
    void close() {
        if (number_ >= 0) ::close(number_);
        number_ = -1;
    }

  private:
    int number_;
};

/// The bytes of a file, or of all files in a folder.
std::int64_t bytes_under(const std::string& path) {
    std::error_code error;
    if (!fs::is_directory(path, error)) return static_cast<std::int64_t>(fs::file_size(path, error));
    std::int64_t bytes = 0;
    for (auto at = fs::recursive_directory_iterator(path, error);
         !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
        std::error_code ignored;
        if (at->is_regular_file(ignored)) bytes += static_cast<std::int64_t>(at->file_size(ignored));
    }
    return bytes;
}

/// A child that is waited for, and killed first if it still runs.
class Child {
  public:
    Child(const std::vector<std::string>& words, int in, int out, int voxels) {
        std::vector<char*> arguments;
        for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, in, 0);
        posix_spawn_file_actions_adddup2(&actions, out, 1);
        posix_spawn_file_actions_adddup2(&actions, in, 2);
        posix_spawn_file_actions_adddup2(&actions, voxels, kVoxelsDescriptor);
        const int error = posix_spawn(&id_, arguments[0], &actions, nullptr, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        if (error != 0)
            throw InputError(fmt::format("{}: cannot be run: {}", words[0], std::strerror(error)));
    }
    ~Child() {
        if (id_ > 0) end();
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    int wait() {
        int status = 0;
        while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
        }
        id_ = 0;
        return status;
    }
    int end() {
        kill(id_, SIGKILL);
        return wait();
    }

  private:
    pid_t id_ = 0;
};

/// Reads all that the child writes until it ends; false when time is up or it writes too much.
bool receive(int pipe, std::int64_t seconds, std::string& text) {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + std::chrono::seconds(seconds);
    for (char part[4096];;) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
        pollfd waiting{pipe, POLLIN, 0};
        const int ready =
            left > 0 ? poll(&waiting, 1, static_cast<int>(std::min<std::int64_t>(left, 1 << 30))) : 0;
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) return false;
        const ssize_t got = read(pipe, part, sizeof part);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return true;
        text.append(part, static_cast<std::size_t>(got));
        if (text.size() > kMostHeader) return false;
    }
}

std::string death_of(int status, std::int64_t seconds) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (signal == SIGXCPU || signal == SIGKILL)
        return fmt::format("took more than the {} s of processor time or the memory that it is allowed",
                           seconds);
    if (signal != 0) return fmt::format("died ({})", strsignal(signal));
    return fmt::format("ended with code {}", WEXITSTATUS(status));
}

/// Takes the bytes of the memory file as memory of our own.
std::shared_ptr<unsigned char> take_voxels(int voxels, std::size_t size, const std::string& where) {
    struct stat status {};
    // From here on no process can shrink the file under us.
    if (fcntl(voxels, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0 ||
        fstat(voxels, &status) != 0 || static_cast<std::size_t>(status.st_size) != size + kPaddingBytes)
        throw InputError(fmt::format("{}: its reader handed back {} bytes of voxels, but {} are needed",
                                     where, status.st_size, size + kPaddingBytes));
    const std::size_t mapped = size + kPaddingBytes;
    void* memory = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_SHARED, voxels, 0);
    if (memory == MAP_FAILED)
        throw InputError(fmt::format("{}: no memory for {} bytes of voxels", where, mapped));
    return {static_cast<unsigned char*>(memory), [mapped](unsigned char* p) { munmap(p, mapped); }};
}

}  // namespace

std::string reader_program() {
    constexpr const char* kName = "squint-read";
    if (const char* named = std::getenv("SQUINT_READ"); named != nullptr && *named != '\0') return named;
    // Beside the program, or beside the module that another's program (Python) has loaded.
    const fs::path beside = fs::path(module_file()).parent_path();
    for (const fs::path& folder : {beside, beside / "../libexec/squint", fs::path(SQUINT_LIBEXEC)})
        if (access((folder / kName).c_str(), X_OK) == 0) return (folder / kName).string();
    return {};
}

StoredVolume read_in_child(std::string_view kind, const VolumeSource& source, const LoadLimits& limits,
                           std::vector<std::string>& notes) {
    const std::string& where = source.file;
    const std::string program = reader_program();
    if (program.empty())
        throw InputError(fmt::format(
            "{}: reading it needs the program squint-read, which lies neither beside this one nor in "
            "../libexec/squint; SQUINT_READ names another place",
            where));
    const std::int64_t seconds = kLeastSeconds + bytes_under(where) / kBytesPerSecond;

    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw InputError(fmt::format("{}: {}", where, std::strerror(errno)));
    const Descriptor from(ends[0]);
    Descriptor to(ends[1]);
    const Descriptor nothing(open("/dev/null", O_RDWR | O_CLOEXEC));
    const Descriptor voxels(memfd_create("squint-voxels", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (to.get() < 0 || nothing.get() < 0 || voxels.get() < 0)
        throw InputError(fmt::format("{}: {}", where, std::strerror(errno)));
    Child child({program, std::string(kind), where, std::to_string(limits.max_bytes), std::to_string(seconds),
                 std::to_string(source.series), std::to_string(source.component.value_or(-1))},
                nothing.get(), to.get(), voxels.get());
    to.close();
    std::string text;
    const bool ended = receive(from.get(), seconds * kWaits, text);
    const int status = ended ? child.wait() : child.end();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        if (constexpr std::string_view kError = "error "; WIFEXITED(status) && text.starts_with(kError))
            throw InputError(printable(text.substr(kError.size(), text.find('\n') - kError.size())));
        throw InputError(fmt::format(
            "{}: its reader {}: the file is damaged or hostile", where,
            ended ? death_of(status, seconds) : fmt::format("was stopped after {} s", seconds * kWaits)));
    }
    Handover handover = handover_from(text, where);
    StoredVolume& stored = handover.stored;
    check_memory(stored.size(), stored, limits);
    take_axes(stored);
    stored.inflated = take_voxels(voxels.get(), stored.size(), where);
    notes.insert(notes.end(), handover.notes.begin(), handover.notes.end());
    return std::move(stored);
}

}  // namespace squint
