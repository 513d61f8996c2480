// Output files: a temporary beside the target, renamed into place when complete.
#include "core/atomic_file.h"

#include "core/error.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <semaphore>

namespace squint {
namespace {

// Temporaries that are being written.  A signal handler reads them: the storage is fixed, and a flag is set
// last and cleared first.
constexpr int kSlots = 64;
struct Slot {
    std::atomic<bool> taken{false}, live{false};
    char path[PATH_MAX];
};
Slot slots[kSlots];
static_assert(std::atomic<bool>::is_always_lock_free);
std::counting_semaphore<kSlots> free_slots{kSlots};

[[noreturn]] void refuse(const std::string& path, const std::string& reason) {
    throw InputError(fmt::format("{}: cannot write: {}", path, reason));
}
[[noreturn]] void refuse(const std::string& path, int error) {
    refuse(path, std::strerror(error));
}

/// Owns a temporary file beside `target`, registered for remove_temporaries.
class Temporary {
  public:
    Temporary(const std::string& named, const std::filesystem::path& target) {
        free_slots.acquire();
        slot_ = std::find_if(slots, slots + kSlots, [](Slot& slot) { return !slot.taken.exchange(true); });
        if (const int error = create(target)) {
            release();
            refuse(named, error);
        }
    }
    ~Temporary() {
        if (slot_->live) unlink(slot_->path);
        release();
    }
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    const char* path() const { return slot_->path; }
    /// Syncs the bytes before the name changes: a loss of power leaves the old file or the new one.
    int rename_to(const std::filesystem::path& target) {
        if (const int error = sync()) return error;
        if (std::rename(path(), target.c_str()) != 0) return errno;
        slot_->live = false;
        return 0;
    }

  private:
    /// The name takes only the target's extension, so that a long name stays within the limit.
    int create(const std::filesystem::path& target) {
        static std::atomic<unsigned> count{0};
        for (;;) {
            const std::string name =
                fmt::format(".squint-{}-{}{}", getpid(), count++, target.extension().string());
            const std::string full = (target.parent_path() / name).string();
            if (full.size() >= sizeof slot_->path) return ENAMETOOLONG;
            std::memcpy(slot_->path, full.c_str(), full.size() + 1);
            slot_->live = true;  // set before the file exists: a signal right after open() must find it
            const int file = open(slot_->path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
            if (file >= 0) return close(file), 0;
            slot_->live = false;
            if (errno != EEXIST) return errno;
        }
    }
    int sync() const {
        const int file = open(slot_->path, O_RDONLY | O_CLOEXEC);
        if (file < 0) return errno;
        const int error = fsync(file) == 0 || errno == EINVAL ? 0 : errno;  // EINVAL: this file system cannot
        close(file);
        return error;
    }
    void release() {
        slot_->live = false;
        slot_->taken = false;
        free_slots.release();
    }

    Slot* slot_;
};

/// Adds the target's name, and a full disk, to a writer's message: writers know only the temporary's name and
/// often not the reason.
std::string explained(std::string message, const std::string& temporary, const std::string& path) {
    for (std::size_t at; (at = message.find(temporary)) != std::string::npos;)
        message.replace(at, temporary.size(), path);
    if (message.find(path) == std::string::npos) message = fmt::format("{}: {}", path, message);
    struct statvfs disk {};
    const std::string full = std::strerror(ENOSPC);
    if (statvfs(temporary.c_str(), &disk) == 0 && disk.f_bavail == 0 &&
        message.find(full) == std::string::npos)
        message += fmt::format(" ({})", full);
    return message;
}

int write_bytes(int file, std::string_view bytes) {  // 0 or an error number
    while (!bytes.empty()) {
        const ssize_t written = ::write(file, bytes.data(), bytes.size());
        if (written < 0 && errno != EINTR) return errno;
        if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

}  // namespace

void write_whole(const std::string& path, const std::function<void(const std::string&)>& write) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (path.empty()) refuse("output", "the path is empty");
    const fs::file_status status = fs::status(path, ignored);
    if (fs::is_directory(status)) refuse(path, EISDIR);
    // A device or a pipe must not be replaced by a file.
    if (fs::exists(status) && !fs::is_regular_file(status)) return write(path);

    // Writes through a link to its file, so that the link stays; absolute, in case the working folder changes
    // meanwhile.
    const fs::path target = fs::exists(status) ? fs::canonical(path, ignored) : fs::absolute(path, ignored);
    if (target.empty()) refuse(path, ignored.message());
    if (!target.has_filename()) refuse(path, EISDIR);
    Temporary temporary(path, target);
    try {
        write(temporary.path());
    } catch (const InputError& error) {
        throw InputError(explained(error.what(), temporary.path(), path));
    }
    if (const int error = temporary.rename_to(target)) refuse(path, error);
}

void write_text_whole(const std::string& path, std::string_view text) {
    write_parts_whole(path, {text});
}

void write_parts_whole(const std::string& path, std::initializer_list<std::string_view> parts) {
    write_whole(path, [&](const std::string& temporary) {
        const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        if (file < 0) refuse(temporary, errno);
        int error = 0;
        for (auto part = parts.begin(); part != parts.end() && !error; ++part)
            error = write_bytes(file, *part);
        if (close(file) != 0 && !error) error = errno;
        if (error) refuse(temporary, error);
    });
}

void remove_temporaries() noexcept {
    for (Slot& slot : slots)
        if (slot.live) unlink(slot.path);
}

}  // namespace squint
