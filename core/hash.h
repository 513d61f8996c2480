// A hash of contents, to name data and pictures.  Not for security.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace squint {

/// A hash of 128 bits, the same on every machine.
class Hasher {
  public:
    void bytes(const void* data, std::size_t size);
    void text(const std::string& s) { number(s.size()), bytes(s.data(), s.size()); }
    void number(std::uint64_t value) { bytes(&value, sizeof value); }
    std::string hex() const;  // 32 digits

  private:
    std::uint64_t a_ = 0x9e3779b97f4a7c15u, b_ = 0xc2b2ae3d27d4eb4fu;
    std::uint64_t length_ = 0;
};

}  // namespace squint
