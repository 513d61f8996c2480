#include "core/hash.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace squint {
namespace {

std::string hash_of(const std::vector<unsigned char>& bytes) {
    Hasher hasher;
    hasher.bytes(bytes.data(), bytes.size());
    return hasher.hex();
}

TEST(Hash, EveryOneBitChangeOfAKilobyteGivesAnotherHash) {
    std::vector<unsigned char> bytes(1024);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(i * 37);
    std::set<std::string> seen{hash_of(bytes)};
    for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
        bytes[bit / 8] ^= 1u << (bit % 8);
        EXPECT_TRUE(seen.insert(hash_of(bytes)).second) << "bit " << bit;
        bytes[bit / 8] ^= 1u << (bit % 8);
    }
}

TEST(Hash, ZerosOfEveryLengthDiffer) {
    std::set<std::string> seen;
    for (std::size_t length = 0; length < 300; ++length)
        EXPECT_TRUE(seen.insert(hash_of(std::vector<unsigned char>(length))).second) << length;
}

TEST(Hash, CallsOnBlockBoundariesEqualOneCall) {
    std::vector<unsigned char> bytes(160, 7);
    Hasher parts;
    parts.bytes(bytes.data(), 32);
    parts.bytes(bytes.data() + 32, 128);
    EXPECT_EQ(parts.hex(), hash_of(bytes));
}

TEST(Hash, TextKeepsItsBoundaries) {
    Hasher one, other;
    one.text("ab"), one.text("c");
    other.text("a"), other.text("bc");
    EXPECT_NE(one.hex(), other.hex());
}

// The hash names pictures in golden files: it must never change unnoticed.
TEST(Hash, StaysWhatItWas) {
    Hasher hasher;
    hasher.text("squint");
    hasher.number(2004);
    EXPECT_EQ(hasher.hex(), "bf6fa8a4c62a446d0efec4f2b7384528");
}

}  // namespace
}  // namespace squint
