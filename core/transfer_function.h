// The transfer function: control points in the file's units -> E entries over the scalar range, which *are*
// the function for every method and for the reference (docs/conventions.md#scalars-and-transfer-function).
#pragma once

#include "core/vector.h"
#include "core/volume.h"

#include <span>
#include <string>
#include <vector>

namespace squint {

struct ColorPoint {
    double value = 0;  // file's units
    Vec3 color{0, 0, 0};
    bool operator==(const ColorPoint&) const = default;
};
struct OpacityPoint {
    double value = 0;
    double alpha = 0;  // opacity of `unit_distance` of this matter, in [0, 1]
    bool operator==(const OpacityPoint&) const = default;
};

/// Straight linear-light colour and alpha, linear between points, constant outside.
struct TransferFunction {
    std::vector<ColorPoint> color;      // ascending; two points at one value make a step
    std::vector<OpacityPoint> opacity;  // ascending
    double unit_distance = 1;           // world units
    int entries = 0;                    // 0: one per level, at most 4096
    std::string name;                   // for messages

    Vec3 color_at(double value) const;
    double alpha_at(double value) const;
};

/// Entries where a scene does not say: one per level, at most so many.
inline constexpr int kDefaultEntries = 4096;

/// Every alpha but exactly 1 is capped here.
inline constexpr double kLargestTranslucentAlpha = 1 - 1.0 / 4096;

/// One entry of the sampled function.
struct Entry {
    Vec3 color{0, 0, 0};
    double alpha = 0;  // per unit_distance, as sampled; exactly 1 when opaque
    /// tau = -ln(1 - min(alpha, kLargestTranslucentAlpha)) / unit_distance, per world unit.
    double extinction = 0;
    bool opaque = false;  // alpha was exactly 1
    bool is_visible() const { return extinction > 0 || opaque; }
};

/// The sampled function.  Entry i stands at scalar i * scalars_per_entry; between entries extinction and
/// colour are linear.
struct Entries {
    std::vector<Entry> entry;
    double scalars_per_entry = 1;
    double unit_distance = 1;

    int size() const { return static_cast<int>(entry.size()); }
    double coordinate(double scalar) const { return scalar / scalars_per_entry; }
    bool any_opaque() const;
};

/// Checks points (at least one each, finite, ascending, colours and alphas in [0,1], unit_distance > 0) and
/// throws InputError.
void check(const TransferFunction& function);

/// Samples the function over [0, volume.largest_representable()].  Uses portable log: same bits everywhere.
Entries sample_entries(const TransferFunction& function, const Volume& volume);

}  // namespace squint
