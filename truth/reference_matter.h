// The entries as the reference reads them: stretches of the scalar between knots, extinction and colour
// linear in each.
#pragma once

#include "core/transfer_function.h"

#include <cstdint>
#include <vector>

namespace squint::reference {

/// A coordinate this near an entry is on it: a thousand times the rounding of the field, and far below what
/// moves a picture.
inline constexpr double kTouch = 1e-10;

/// Entries first..last, between which everything is linear.
struct Stretch {
    int first = 0, last = 0;
    double extinction = 0, extinction_slope = 0;  // at `first`, and per entry
    Vec3 color{0, 0, 0}, color_slope{0, 0, 0};
    bool clear = false;      // nothing there
    bool one_color = false;  // colour does not change
};

class Matter {
  public:
    /// Leaves out knots where the function stays within the allowances of a straight line: 1 / world unit,
    /// and colour.  An opaque entry is always a knot.
    Matter(const Entries& entries, double allowed_extinction, double allowed_color);

    const Stretch& stretch(int index) const { return stretches_[static_cast<std::size_t>(index)]; }
    int stretches() const { return static_cast<int>(stretches_.size()); }
    /// The stretch that a coordinate is in, seen in the direction it goes (upwards or not).
    int stretch_at(double coordinate, bool upwards) const;

    bool opaque_entry(int entry) const { return entries_->entry[static_cast<std::size_t>(entry)].opaque; }
    /// On an opaque entry or between two (docs/conventions.md).
    bool opaque_at(double coordinate) const;
    double extinction_at(double coordinate) const;
    Vec3 color_at(double coordinate) const;
    /// Whether anything between two coordinates is not transparent.
    bool visible(double low, double high) const;

  private:
    int before(double coordinate) const;  // the entry at or below, at most the last but one

    const Entries* entries_;
    std::vector<Stretch> stretches_;
    std::vector<int> stretch_of_;    // by the entry before
    std::vector<int> visible_upto_;  // entries below this one that are not transparent
};

}  // namespace squint::reference
