// precision.preset = "auto": formats under whose roundings no pixel of a command's own pictures errs by more than
// precision.budget, by certificates (docs/guarantees.md, "Formats that follow a budget").
#pragma once

#include "core/volume.h"
#include "scene/scene.h"

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squint::search {

struct AutoSettings {
    int threads = 0;  // 0: one a processor; the formats do not depend on them
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(const std::string&)> progress{};  // a line after every proof
};

struct AutoFormats {
    double bound = 0;                      // LSB8, over the rays that were certified
    std::int64_t undecided = 0;            // rays of which nothing is proven
    std::int64_t rays = 0;                 // so many
    int one_in = 1;                        // of the pictures' rows and columns
    bool within = false;                   // the budget
    double bits = 0, bits_of_default = 0;  // by the tally
    std::vector<std::string> notes, warnings;
};

/// Gives a scene with the preset `auto` the formats of all wires, as settings of its own, and
/// sampling.termination 2^-12 where it sets none; wires that it sets stay as they are.  The same formats for all
/// frames of its turntable.  Does nothing for another preset, or where all wires are set.  Throws InputError for what
/// has no certificate, and Cancelled.
AutoFormats choose_formats(Scene& scene, const std::shared_ptr<const Volume>& volume,
                           const AutoSettings& settings = {});

}  // namespace squint::search
