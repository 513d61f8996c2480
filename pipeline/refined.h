// How many slabs a picture refined.
#pragma once

#include <cstdint>

namespace squint {

/// Of the slabs that went through the stages: those looked at twice for walls, and of those that are lit as they
/// turn, how many in two pieces and in four.
struct RefinedSlabs {
    std::int64_t looked_twice = 0, in_two = 0, in_four = 0;

    void cut(int bits, std::int64_t slabs = 1) { (bits == 1 ? in_two : in_four) += slabs; }
    void add(const RefinedSlabs& other) {
        looked_twice += other.looked_twice, in_two += other.in_two, in_four += other.in_four;
    }
};

}  // namespace squint
