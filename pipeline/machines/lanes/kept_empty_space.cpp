#include "pipeline/machines/lanes/kept_empty_space.h"

#include "pipeline/kept.h"

namespace squint::lanes {
namespace {

// What empty space depends on, beside the voxels.
struct Key {
    std::vector<bool> visible;  // entries
    double scalars_per_entry;
    int reach, entry_reach;
    bool from_zero;
    bool operator==(const Key&) const = default;
};
struct Keyed {
    Key key;
    EmptySpace space;
};

}  // namespace

std::shared_ptr<const EmptySpace> kept_empty_space(const Volume& volume, const BlockBox& box,
                                                   const Entries& entries, int reach, int entry_reach,
                                                   bool from_zero) {
    static KeptPerVolume<Keyed> kept;
    Key key{{}, entries.scalars_per_entry, reach, entry_reach, from_zero};
    for (const Entry& entry : entries.entry) key.visible.push_back(entry.is_visible());
    const auto make = [&] {
        const std::shared_ptr<const BlockRanges> ranges = block_ranges(volume, box);
        auto keyed = std::make_shared<Keyed>(
            Keyed{key, find_empty_space(*ranges, entries, reach, entry_reach, from_zero)});
        if (reach == 0 && entry_reach == 0 && !from_zero) look_again(volume, entries, keyed->space);
        return keyed;
    };
    const std::shared_ptr<Keyed> found = kept.find_or_make(
        volume, make, [&](const Keyed& k) { return k.key == key && k.space.box.holds(box); });
    return {found, &found->space};
}

}  // namespace squint::lanes
