// How many threads work.
#pragma once

#include <algorithm>
#include <thread>

namespace squint {

/// As many as are asked for; where that is 0, one a processor.
inline int threads_for(int asked) {
    return asked > 0 ? asked : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

}  // namespace squint
