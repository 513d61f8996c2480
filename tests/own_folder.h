// A folder that no other test and no other program writes in: tests run at once, and each in a process of its own.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace squint::test {

/// The path of a new, empty folder.  It goes away, with what was written in it, when this does.
class OwnFolder : public std::filesystem::path {
  public:
    OwnFolder() : path(created()) {}
    ~OwnFolder() {
        std::error_code gone_already;
        std::filesystem::remove_all(*this, gone_already);
    }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;

  private:
    static path created() {
        std::string name = (std::filesystem::temp_directory_path() / "squint-test-XXXXXX").string();
        if (!mkdtemp(name.data())) throw std::system_error(errno, std::generic_category(), name);
        return name;
    }
};

}  // namespace squint::test
