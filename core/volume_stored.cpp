// Turns voxels as a file stores them into levels (docs/conventions.md#scalars-and-transfer-function).
#include "core/volume_stored.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/stored_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

namespace squint {
namespace {

static_assert(std::endian::native == std::endian::little, "levels lie in memory as little-endian words");

constexpr std::int64_t kMostLevels = 65536;  // of 16 bits

// --- Integers: subtract the least --------------------------------------------------------------------------

struct Shift {
    std::int64_t least, greatest;
    std::atomic<std::int64_t>& outside;

    template <class T>
    std::int64_t operator()(T voxel, std::int64_t, std::int64_t& clamped) const {
        if constexpr (std::is_same_v<T, std::uint64_t>)
            voxel = std::min<T>(voxel, std::numeric_limits<std::int64_t>::max());
        const auto value = static_cast<std::int64_t>(voxel);  // NOLINT: voxels are numbers
        clamped += value < least || value > greatest;
        return std::clamp(value, least, greatest) - least;
    }
    void count(std::int64_t clamped) const { outside.fetch_add(clamped, std::memory_order_relaxed); }
};

// --- Floats: round to the levels of a window ---------------------------------------------------------------

struct Quantise {
    double scale, offset;                     // file's units from stored
    double least, greatest, levels_per_unit;  // of the window, in the file's units
    double last_level;
    double nan;  // in the file's units: the value for voxels that are NaN, if any
    std::atomic<std::int64_t>& outside;
    std::atomic<std::int64_t>& not_a_number;  // least index in the file of a NaN voxel

    template <class T>
    std::int64_t operator()(T voxel, std::int64_t index, std::int64_t& clamped) const {
        double value = scale * static_cast<double>(voxel) + offset;
        if (std::isnan(value)) {
            if (std::isnan(nan)) {
                for (std::int64_t seen = not_a_number;
                     index < seen && !not_a_number.compare_exchange_weak(seen, index);) {
                }
                return 0;
            }
            value = nan;
        }
        const double level = (value - least) * levels_per_unit;
        clamped += value < least || value > greatest;
        const double inside = std::clamp(level, 0.0, last_level), whole = std::floor(inside);
        return static_cast<std::int64_t>(whole) + (inside - whole >= 0.5);
    }
    void count(std::int64_t clamped) const { outside.fetch_add(clamped, std::memory_order_relaxed); }
};

// --- Settings ----------------------------------------------------------------------------------------------

/// How values map to levels: from the scene's settings and the file's.
struct Values {
    double scale = 1, offset = 0;  // value = scale * stored + offset
    bool windowed = false;
    double least = 0, greatest = 0;  // of the window, in the file's units
    int bits = 0;                    // declared, or 0
    double nan = std::numeric_limits<double>::quiet_NaN();
};

Values settle(const StoredVolume& stored, const VolumeSource& source) {
    Values values{source.value_scale.value_or(stored.value_scale.value_or(1)),
                  source.value_offset.value_or(stored.value_offset.value_or(0))};
    if (!std::isfinite(values.scale) || values.scale == 0 || !std::isfinite(values.offset))
        throw InputError(
            fmt::format("{}: value scale is {} and offset {}, but both must be finite and the scale not 0",
                        stored.where, values.scale, values.offset));
    values.windowed = !source.window.empty();
    if (values.windowed) {
        if (source.window.size() != 2)
            throw InputError(fmt::format("{}: window has {} numbers, but needs two: [least, greatest]",
                                         stored.where, source.window.size()));
        values.least = source.window[0], values.greatest = source.window[1];
        if (!std::isfinite(values.greatest - values.least) || !(values.least < values.greatest))
            throw InputError(
                fmt::format("{}: window is [{}, {}], but needs two finite numbers, the least first",
                            stored.where, values.least, values.greatest));
    }
    values.bits = source.bits != 0 ? source.bits : values.windowed ? 0 : stored.scalar_bits;
    if (values.bits < 0 || values.bits > 16)
        throw InputError(fmt::format("{}: bits is {}, but 1 to 16 are allowed", stored.where, values.bits));
    if (source.nan) values.nan = *source.nan;
    return values;
}

void note_clamped(const StoredVolume& stored, const Values& values, std::int64_t clamped,
                  std::vector<std::string>& notes) {
    if (clamped > 0)
        notes.push_back(
            fmt::format("{}: {} of {} voxels lie outside the window [{}, {}] and were clamped to it",
                        stored.where, clamped, stored.voxels(), values.least, values.greatest));
}

/// The window of floats where none is given: from the least to the greatest finite value.
void window_from_data(Values& values, const StoredVolume& stored) {
    struct Range {
        double least = std::numeric_limits<double>::infinity(),
               greatest = -std::numeric_limits<double>::infinity();
        bool nan = false;
    };
    const Range range = with_type(stored.type, [&](auto voxel) {
        return reduce_voxels<decltype(voxel)>(
            stored, Range{},
            [](Range& r, auto v) {
                const auto number = static_cast<double>(v);
                if (std::isfinite(number))
                    r.least = std::min(r.least, number), r.greatest = std::max(r.greatest, number);
                r.nan = r.nan || std::isnan(number);
            },
            [](const Range& a, const Range& b) {
                return Range{std::min(a.least, b.least), std::max(a.greatest, b.greatest), a.nan || b.nan};
            });
    });
    double ends[2] = {values.scale * range.least + values.offset,
                      values.scale * range.greatest + values.offset};
    if (range.nan && !std::isnan(values.nan)) {
        if (!(range.least <= range.greatest)) ends[0] = ends[1] = values.nan;
        ends[0] = std::min(ends[0], values.nan), ends[1] = std::max(ends[1], values.nan);
    } else if (!(range.least <= range.greatest)) {
        if (range.nan) ends[0] = 0, ends[1] = 1;  // refused at the first such voxel, which the message names
    }
    values.least = std::min(ends[0], ends[1]), values.greatest = std::max(ends[0], ends[1]);
    if (values.least == values.greatest) values.greatest += std::max(1.0, std::abs(values.least));
    if (!std::isfinite(values.greatest - values.least))
        throw InputError(
            fmt::format("{}: no finite range of values; window = [least, greatest] gives one", stored.where));
}

/// Floats, and integers with a range wider than the levels.
void quantise(Volume& volume, const StoredVolume& stored, Values values, const LoadLimits& limits,
              std::vector<std::string>& notes) {
    const bool from_data = !values.windowed;
    if (from_data) window_from_data(values, stored);
    if (values.bits == 0) values.bits = 16;
    const double last_level = (1 << values.bits) - 1;
    constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::max();
    std::atomic<std::int64_t> outside{0}, not_a_number{kNowhere};
    const Quantise convert{values.scale,
                           values.offset,
                           values.least,
                           values.greatest,
                           last_level / (values.greatest - values.least),
                           last_level,
                           values.nan,
                           outside,
                           not_a_number};
    volume.type = values.bits <= 8 ? ScalarType::u8 : ScalarType::u16;
    volume.scalar_bits = values.bits;
    volume.value_scale = (values.greatest - values.least) / last_level;
    volume.value_offset = values.least;
    convert_all(volume, stored, limits, convert);

    if (std::int64_t at = not_a_number; at != kNowhere) {
        const std::int64_t run = stored.component_run;
        if (stored.components > 1) at = at / (run * stored.components) * run + at % run;
        throw InputError(fmt::format(
            "{}: voxel ({}, {}, {}) is nan, but every voxel needs a value: volume.nan = VALUE gives it one",
            stored.where, at % stored.dims.x, at / stored.dims.x % stored.dims.y,
            at / stored.dims.x / stored.dims.y));
    }
    notes.push_back(fmt::format(
        "{}: {} voxels were quantised to {} bits over [{}, {}]{}: one level is {:.6g}", stored.where,
        stored.type == StoredType::f32   ? "float"
        : stored.type == StoredType::f64 ? "double"
                                         : "integer",
        values.bits, values.least, values.greatest, from_data ? ", their finite range" : "",
        volume.value_scale));
    note_clamped(stored, values, outside, notes);
}

/// Least and greatest number; u64 beyond i64 counts as its largest.
std::pair<std::int64_t, std::int64_t> measured_range(const StoredVolume& stored) {
    using Range = std::pair<std::int64_t, std::int64_t>;
    static constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    return with_type(stored.type, [&](auto voxel) {
        using T = decltype(voxel);
        return reduce_voxels<T>(
            stored, Range{kMost, std::numeric_limits<std::int64_t>::min()},
            [](Range& r, T v) {
                if constexpr (std::is_same_v<T, std::uint64_t>) v = std::min<T>(v, kMost);
                const auto number = static_cast<std::int64_t>(v);  // NOLINT: voxels are numbers
                r.first = std::min(r.first, number), r.second = std::max(r.second, number);
            },
            [](const Range& a, const Range& b) {
                return Range{std::min(a.first, b.first), std::max(a.second, b.second)};
            });
    });
}

/// The stored values of the lowest and the highest level.
std::pair<std::int64_t, std::int64_t> stored_range(const StoredVolume& stored, const Values& values) {
    if (values.windowed) {
        // One level is one stored value: the window snaps to the nearest stored values within 18 bits (62
        // bits for wide integers).
        const double most = bytes_of(stored.type) <= 2 ? 131072.0 : 0x1p62;
        const auto nearest = [&](double value) {
            return static_cast<std::int64_t>(
                std::floor(std::clamp((value - values.offset) / values.scale, -most, most) + 0.5));
        };
        const auto [least, greatest] = std::minmax({nearest(values.least), nearest(values.greatest)});
        return {least, greatest};
    }
    switch (stored.type) {
        case StoredType::u8:
            return {0, 255};
        case StoredType::u16:
            return {0, 65535};
        case StoredType::i8:
            return {measured_range(stored).first, 127};
        case StoredType::i16:
            return {measured_range(stored).first, 32767};
        default:
            break;
    }
    const auto [least, greatest] = measured_range(stored);
    return {is_signed(stored.type) ? least : 0, greatest};
}

void shift_integers(Volume& volume, const StoredVolume& stored, const Values& values,
                    std::pair<std::int64_t, std::int64_t> range, const LoadLimits& limits,
                    std::vector<std::string>& notes) {
    const auto [least, greatest] = range;
    const bool narrow = bytes_of(stored.type) == 1;
    const std::uint64_t most = narrow ? 255 : kMostLevels - 1,
                        spans = static_cast<std::uint64_t>(greatest) - static_cast<std::uint64_t>(least);
    if (values.windowed && (greatest <= least || spans > most))
        throw InputError(fmt::format("{}: window [{}, {}] spans {} stored values, but 2 to {} are allowed",
                                     stored.where, values.least, values.greatest, spans + 1, most + 1));
    if (spans > most)
        throw InputError(
            fmt::format("{}: stored values from {} to {} need {} bits, but 16 are allowed: "
                        "window = [least, greatest] keeps some, and with bits = 16 rounds more",
                        stored.where, least, greatest, bits_for(spans)));
    volume.type = narrow ? ScalarType::u8 : ScalarType::u16;
    volume.value_scale = values.scale;
    volume.value_offset = values.offset + values.scale * static_cast<double>(least);

    // Already levels: taken without a copy.
    const unsigned char* bytes = stored.inflated ? stored.inflated.get() : stored.bytes.get();
    const bool aligned = reinterpret_cast<std::uintptr_t>(bytes) % bytes_of(stored.type) == 0;
    const bool levels =
        stored.type == StoredType::u8 || (stored.type == StoredType::u16 && !stored.big_endian);
    if (levels && !values.windowed && !stored.reordered() && stored.components == 1 && aligned) {
        volume.data = stored.inflated ? std::shared_ptr<const void>(stored.inflated)
                                      : std::shared_ptr<const void>(stored.bytes);
        volume.mapped = !stored.inflated;
        if (volume.mapped) volume.zeros = stored.zeros;
        return;
    }
    std::atomic<std::int64_t> outside{0};
    convert_all(volume, stored, limits, Shift{least, greatest, outside});
    note_clamped(stored, values, outside, notes);
}

/// Integer bits that hold the declared window, or else the data; at least 8.
void choose_bits(Volume& volume, const StoredVolume& stored, const Values& values,
                 std::pair<std::int64_t, std::int64_t> range) {
    std::uint64_t largest = volume.largest;
    if (values.windowed) largest = static_cast<std::uint64_t>(range.second - range.first);
    if (values.bits != 0 && values.bits < bits_for(largest))
        throw InputError(fmt::format("{}: bits is {}, but scalars to {} need {}", stored.where, values.bits,
                                     largest, bits_for(largest)));
    const int at_least = values.bits != 0 ? values.bits : 8;
    volume.scalar_bits =
        volume.type == ScalarType::u8 && values.bits == 0 ? 8 : std::max(at_least, bits_for(largest));
}

/// The range of the scalars without the least or the greatest, and how many voxels that leaves out.
struct Rest {
    std::uint32_t smallest = std::numeric_limits<std::uint32_t>::max(), largest = 0;
    std::int64_t at_smallest = 0, at_largest = 0;  // voxels of the volume's least and greatest scalar
};

Rest rest_of(const Volume& volume) {
    const auto* scalars = static_cast<const std::uint16_t*>(volume.data.get());
    return reduce_in_parallel(
        volume.voxels(), std::int64_t{1} << 18, Rest{},
        [&](Rest& rest, std::int64_t i) {
            const std::uint32_t s = scalars[i];
            rest.at_smallest += s == volume.smallest, rest.at_largest += s == volume.largest;
            if (s != volume.smallest) rest.smallest = std::min(rest.smallest, s);
            if (s != volume.largest) rest.largest = std::max(rest.largest, s);
        },
        [](const Rest& a, const Rest& b) {
            return Rest{std::min(a.smallest, b.smallest), std::max(a.largest, b.largest),
                        a.at_smallest + b.at_smallest, a.at_largest + b.at_largest};
        });
}

/// Notes a value far from all others, as scanners pad with: it makes an entry span several levels.
void note_padding(const Volume& volume, const Values& values, std::vector<std::string>& notes) {
    constexpr std::uint32_t kEntries = 4096;
    constexpr std::uint32_t kApart = 4;  // a gap of a quarter of the range is no chance
    const std::uint32_t range = volume.largest - volume.smallest;
    if (values.windowed || volume.type != ScalarType::u16 || range < kEntries) return;
    const Rest rest = rest_of(volume);
    if (rest.smallest > rest.largest) return;
    const std::uint32_t below = rest.smallest - volume.smallest, above = volume.largest - rest.largest;
    const bool low = below >= above;
    if (std::max(below, above) < range / kApart) return;
    const std::uint32_t padding = low ? volume.smallest : volume.largest,
                        first = low ? rest.smallest : volume.smallest,
                        last = low ? volume.largest : rest.largest;
    if (first >= last) return;
    const auto [least, greatest] = std::minmax({volume.value_at(first), volume.value_at(last)});
    notes.push_back(
        fmt::format("{}: {} voxels are {}, apart from all others ({} to {}): a padding value makes the "
                    "transfer function's "
                    "entries coarser; volume.window = [{}, {}] leaves it out",
                    volume.name, low ? rest.at_smallest : rest.at_largest, volume.value_at(padding), least,
                    greatest, least, greatest));
}

}  // namespace

std::size_t bytes_of(StoredType type) {
    return with_type(type, [](auto voxel) { return sizeof voxel; });
}

std::string needs(const StoredVolume& stored) {
    const std::string times =
        stored.components > 1 ? fmt::format(" and {} components", stored.components) : "";
    return fmt::format("{} of {} bits{} needs {}", text_of(stored.dims), bytes_of(stored.type) * 8, times,
                       stored.size());
}

void check_memory(std::size_t bytes, const StoredVolume& stored, const LoadLimits& limits) {
    if (limits.max_bytes < 0 || bytes > static_cast<std::size_t>(limits.max_bytes))
        throw InputError(fmt::format("{}: {} needs {} bytes of memory, but {} are allowed", stored.where,
                                     text_of(stored.dims), bytes, limits.max_bytes));
}

Volume levels_from_stored(const StoredVolume& stored, const VolumeSource& source, const LoadLimits& limits,
                          std::vector<std::string>& notes) {
    const Values values = settle(stored, source);
    Volume volume;
    volume.name = stored.where;
    volume.dims = FileOrder(stored).dims;
    volume.spacing = stored.spacing;
    volume.origin = stored.origin;
    volume.turn = stored.turn;
    volume.space = stored.space;
    volume.modality = stored.modality;
    if (stored.reordered())
        notes.push_back(
            fmt::format("{}: axes are permuted or flipped; voxels were put in x, y, z order", stored.where));
    if (volume.turned()) {
        const double cosine = (volume.turn[0].x + volume.turn[1].y + volume.turn[2].z - 1) / 2;
        notes.push_back(fmt::format(
            "{}: axes are turned by {:.3g} degrees against x, y, z; voxels are rendered where they lie",
            stored.where, std::acos(std::clamp(cosine, -1.0, 1.0)) * 57.29577951308232));
    }

    const bool floats = is_float(stored.type);
    const auto range = floats ? std::pair<std::int64_t, std::int64_t>{} : stored_range(stored, values);
    const bool rounded =
        !floats && bytes_of(stored.type) > 2 && values.bits != 0 && range.second - range.first >= kMostLevels;
    if (floats || rounded) {
        quantise(volume, stored, values, limits, notes);
        measure(volume);
    } else {
        shift_integers(volume, stored, values, range, limits, notes);
        measure(volume);
        choose_bits(volume, stored, values, range);
        note_padding(volume, values, notes);
    }
    return volume;
}

}  // namespace squint
