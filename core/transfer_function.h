// The transfer function: control points in the file's units -> E entries over the scalar range, which *are*
// the function for all methods and the reference (docs/conventions.md#scalars-and-transfer-function).
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

/// Straight (not premultiplied) linear-light colour, and alpha; linear between points, constant outside.
struct TransferFunction {
    std::vector<ColorPoint> color;      // ascending; two points at one value make a step
    std::vector<OpacityPoint> opacity;  // ascending
    double unit_distance = 1;           // world units
    int entries = 0;                    // 0: one per level, at most 4096
    std::string name;                   // for messages

    Vec3 color_at(double value) const;
    double alpha_at(double value) const;
};

/// The number of entries where a scene does not say: one per level, and at most this many.
inline constexpr int kDefaultEntries = 4096;

/// Every alpha except exactly 1 is limited to this.
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

/// The sampled function.  Entry i stands at scalar i * scalars_per_entry; extinction and colour are linear
/// between entries.
struct Entries {
    std::vector<Entry> entry;
    double scalars_per_entry = 1;
    double unit_distance = 1;

    int size() const { return static_cast<int>(entry.size()); }
    double coordinate(double scalar) const { return scalar / scalars_per_entry; }
    bool any_opaque() const;
};

/// Throws InputError unless there is at least one point of each kind, points are finite and ascending,
/// colours and alphas are in [0,1] and unit_distance > 0.
void check(const TransferFunction& function);

/// Samples it over [0, volume.largest_representable()].  Uses the portable log: same bits everywhere.
Entries sample_entries(const TransferFunction& function, const Volume& volume);

}  // namespace squint
