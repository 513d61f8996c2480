#include "truth/reference_matter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace squint::reference {
namespace {

using Values = std::array<double, 4>;
Values values_of(const Entry& e) {
    return {e.extinction, e.color.x, e.color.y, e.color.z};
}

/// The last entry to which a straight line from `first` passes all entries between within `allowed`: the
/// range of such slopes narrows from entry to entry.
int straight_until(const std::vector<Entry>& entry, int first, const Values& allowed) {
    const Values from = values_of(entry[static_cast<std::size_t>(first)]);
    Values least, greatest;
    least.fill(-std::numeric_limits<double>::infinity());
    greatest.fill(std::numeric_limits<double>::infinity());
    const int size = static_cast<int>(entry.size());
    for (int i = first + 1; i < size; ++i) {
        const Entry& here = entry[static_cast<std::size_t>(i)];
        const Values value = values_of(here);
        const double run = i - first;
        for (std::size_t v = 0; v < 4; ++v) {
            const double slope = (value[v] - from[v]) / run;
            if (slope < least[v] || slope > greatest[v]) return i - 1;
            least[v] = std::max(least[v], slope - allowed[v] / run);
            greatest[v] = std::min(greatest[v], slope + allowed[v] / run);
        }
        if (here.opaque || entry[static_cast<std::size_t>(first)].opaque) return i;
    }
    return size - 1;
}

}  // namespace

Matter::Matter(const Entries& entries, double allowed_extinction, double allowed_color) : entries_(&entries) {
    const std::vector<Entry>& entry = entries.entry;
    const int size = entries.size();
    const Values allowed{allowed_extinction, allowed_color, allowed_color, allowed_color};
    for (int first = 0; first + 1 < size;) {
        Stretch s;
        s.first = first, s.last = straight_until(entry, first, allowed);
        const Entry &a = entry[static_cast<std::size_t>(s.first)],
                    &b = entry[static_cast<std::size_t>(s.last)];
        const double run = s.last - s.first;
        s.extinction = a.extinction, s.extinction_slope = (b.extinction - a.extinction) / run;
        s.color = a.color, s.color_slope = (b.color - a.color) / run;
        s.clear = a.extinction == 0 && b.extinction == 0;
        s.one_color = a.color == b.color;
        stretch_of_.insert(stretch_of_.end(), static_cast<std::size_t>(s.last - s.first), stretches());
        stretches_.push_back(s);
        first = s.last;
    }
    visible_upto_.assign(1, 0);
    for (const Entry& e : entry) visible_upto_.push_back(visible_upto_.back() + e.is_visible());
}

int Matter::before(double coordinate) const {
    return static_cast<int>(std::clamp(std::floor(coordinate), 0.0, entries_->size() - 2.0));
}

int Matter::stretch_at(double coordinate, bool upwards) const {
    const int found = stretch_of_[static_cast<std::size_t>(before(coordinate))];
    if (upwards && coordinate >= stretch(found).last - kTouch) return std::min(found + 1, stretches() - 1);
    if (!upwards && coordinate <= stretch(found).first + kTouch) return std::max(found - 1, 0);
    return found;
}

bool Matter::opaque_at(double coordinate) const {
    const double nearest = std::clamp(std::floor(coordinate + 0.5), 0.0, entries_->size() - 1.0);
    if (std::abs(coordinate - nearest) <= kTouch && opaque_entry(static_cast<int>(nearest))) return true;
    const int i = before(coordinate);
    return opaque_entry(i) && opaque_entry(i + 1);
}

double Matter::extinction_at(double coordinate) const {
    const auto i = static_cast<std::size_t>(before(coordinate));
    const double w = coordinate - static_cast<double>(i);
    return entries_->entry[i].extinction * (1 - w) + entries_->entry[i + 1].extinction * w;
}

Vec3 Matter::color_at(double coordinate) const {
    const auto i = static_cast<std::size_t>(before(coordinate));
    const double w = coordinate - static_cast<double>(i);
    return entries_->entry[i].color * (1 - w) + entries_->entry[i + 1].color * w;
}

bool Matter::visible(double low, double high) const {
    const auto first = static_cast<std::size_t>(std::clamp(std::floor(low), 0.0, entries_->size() - 1.0));
    const auto last = static_cast<std::size_t>(std::clamp(std::ceil(high), 0.0, entries_->size() - 1.0));
    return visible_upto_[last + 1] > visible_upto_[first];
}

}  // namespace squint::reference
