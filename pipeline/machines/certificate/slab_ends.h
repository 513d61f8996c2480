// A slab between two inputs, and all that they and its length may be.
#pragma once

#include "pipeline/classification/entries.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/payers.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace squint {

/// Both ends, in entries, and the length, in steps; `off`: by how much each may be another.
struct SlabEnds {
    double from, to, from_off, to_off, low, high, l, l_off, last;
    SlabEnds(const EntryLookup& e, const Function& f, const Bounded& front, const Bounded& back,
             const Bounded& length)
        : last(f.last()) {
        const double unit = std::ldexp(1.0, -e.input_fraction), full = std::ldexp(1.0, e.length_fraction);
        from = std::min(in_double(front.v) * unit, last), to = std::min(in_double(back.v) * unit, last);
        from_off = front.most() * unit, to_off = back.most() * unit;
        low = std::max(std::min(from - from_off, to - to_off), 0.0);
        high = std::min(std::max(from + from_off, to + to_off), last);
        l = in_double(length.v) / full, l_off = length.most() / full;
    }
    /// The same, were nothing off.
    SlabEnds here() const {
        SlabEnds ends = *this;
        ends.from_off = ends.to_off = ends.l_off = 0;
        ends.low = std::min(from, to), ends.high = std::max(from, to);
        return ends;
    }
    Reach front() const { return around(from, from_off); }
    Reach back() const { return around(to, to_off); }
    Reach around(double at, double off) const { return {std::max(at - off, 0.0), std::min(at + off, last)}; }
    double shortest() const { return std::max(l - l_off, 0.0); }
    double longest() const { return std::min(l + l_off, 1.0); }

    /// The first opaque entry from front to back, both included.
    std::optional<double> first_wall(const Function& f) const {
        const double way = from < to ? 1 : -1;
        for (double entry = way > 0 ? std::ceil(from) : std::floor(from); (to - entry) * way >= 0;
             entry += way)
            if (f.opaque(entry, entry).any) return entry;
        return {};
    }
    /// Whether that entry ends the slab wherever its ends are.
    bool surely_meets(double wall) const {
        const double way = from < to ? 1 : -1;
        return (wall - from) * way > from_off && (to - wall) * way > to_off;
    }
    /// Whether an opaque entry in front of which nothing is opaque surely ends the slab.
    bool surely_cut(const Function& f) const {
        const Reach at_front = front();
        if (f.opaque(at_front.low, at_front.high).any) return false;
        const std::optional<double> wall = first_wall(f);
        const bool at_end = wall && to == *wall && to_off == 0 && from_off < std::abs(*wall - from);
        return at_end || (wall && surely_meets(*wall));
    }
    /// The part of the way up to a wall.
    Reach way_to(double wall) const {
        const double way = std::abs(wall - from), span = std::abs(to - from), off = from_off + to_off;
        return {span > 0 ? std::max(way - from_off, 0.0) / (span + off) : 0,
                span > off ? std::min((way + from_off) / (span - off), 1.0) : 1};
    }
};

/// The optical depth of a slab up to `end`, a place that does not move where it `stays`.
inline Reach own_depth(const Function& f, const SlabEnds& s, double end, bool stays) {
    const double a = std::max(std::min(s.from - s.from_off, stays ? end : end - s.to_off), 0.0),
                 b = std::min(std::max(s.from + s.from_off, stays ? end : end + s.to_off), s.last);
    const Reach depths = f.over(Function::depth, a, b);
    const double steep = f.slope(Function::depth, a, b), mean = f.mean(Function::depth, s.from, end);
    const double off = steep * (stays ? s.from_off : s.from_off + s.to_off) / 2;
    const Reach part = stays ? s.way_to(end) : Reach{1, 1};
    return {s.shortest() * part.low * std::max(mean - off, depths.low),
            s.longest() * part.high * std::min(mean + off, depths.high)};
}
/// The opacity of that depth.
inline Reach own_opacity(const Function& f, const SlabEnds& s, double end, bool stays) {
    const Reach depth = own_depth(f, s, end, stays);
    return {opacity_of(depth.low), opacity_of(depth.high)};
}

}  // namespace squint
