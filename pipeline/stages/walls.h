// Walls between samples: slabs that are looked at twice.  A wall is an opaque scalar.  The straight line between
// the scalars at a slab's ends misses one that the field comes to between them; then a corner of a cell on
// the way passes it.  Such a slab is cut into four at three samples inside, each piece a slab of the method's own
// tables, and joined again before compositing.  docs/conventions.md#scalars-and-transfer-function.
#pragma once

#include "core/transfer_function.h"
#include "scene/scene.h"

#include <cstdint>
#include <vector>

namespace squint {

/// A slab is cut into 2^kSecondLookBits.
inline constexpr int kSecondLookBits = 2;

struct WallStage {
    bool looks_twice = false;
    /// By level: the least level from it on that is opaque or behind an opaque place; levels.size() where there
    /// is none.
    std::vector<std::int32_t> next;

    /// Whether a cell whose corners' scalars reach from one level to another holds a wall.
    bool between(std::int64_t least, std::int64_t greatest) const {
        return next[static_cast<std::size_t>(least)] <= greatest;
    }
    bool operator==(const WallStage&) const = default;
};

/// `levels`: one more than the largest scalar of the volume.
WallStage build_walls(const Entries& entries, std::int64_t levels);

}  // namespace squint
