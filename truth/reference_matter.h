// The entries for the reference: stretches of the scalar between knots, with extinction and colour linear in
// each.
#pragma once

#include "core/transfer_function.h"

#include <cstdint>
#include <vector>

namespace squint::reference {

/// A coordinate this near to an entry counts as on it: a thousand times the field's rounding, and far below
/// what a picture shows.
inline constexpr double kTouch = 1e-10;

/// Entries first..last, between which all is linear.
struct Stretch {
    int first = 0, last = 0;
    double extinction = 0, extinction_slope = 0;  // at `first`, and per entry
    Vec3 color{0, 0, 0}, color_slope{0, 0, 0};
    bool clear = false;      // transparent
    bool one_color = false;  // of one colour
};

class Matter {
  public:
    /// Leaves out knots where the function stays within the allowances of a straight line, which are 1 /
    /// world unit and a colour.  An opaque entry is always a knot.
    Matter(const Entries& entries, double allowed_extinction, double allowed_color);

    const Stretch& stretch(int index) const { return stretches_[static_cast<std::size_t>(index)]; }
    int stretches() const { return static_cast<int>(stretches_.size()); }
    /// The stretch of a coordinate, for a coordinate that rises (`upwards`) or falls.
    int stretch_at(double coordinate, bool upwards) const;

    bool opaque_entry(int entry) const { return entries_->entry[static_cast<std::size_t>(entry)].opaque; }
    /// Whether it lies on an opaque entry or between two (docs/conventions.md).
    bool opaque_at(double coordinate) const;
    double extinction_at(double coordinate) const;
    Vec3 color_at(double coordinate) const;
    /// Whether anything between two coordinates can be seen.
    bool visible(double low, double high) const;

  private:
    int before(double coordinate) const;  // the entry at or below, the last but one at most

    const Entries* entries_;
    std::vector<Stretch> stretches_;
    std::vector<int> stretch_of_;    // by the entry at or below
    std::vector<int> visible_upto_;  // number of visible entries below each
};

}  // namespace squint::reference
