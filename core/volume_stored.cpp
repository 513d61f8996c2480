// Voxels as a file stores them -> a volume of levels (docs/conventions.md#scalars-and-transfer-function).
#include "core/volume_stored.h"

#include "core/error.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace squint {
namespace {

static_assert(std::endian::native == std::endian::little, "levels lie in memory as little-endian words");

// --- Reading stored voxels
// -----------------------------------------------------------------------------------------------

template <class T>
struct Reader {
    const unsigned char* bytes;
    bool swapped;

    T operator()(std::int64_t index) const {
        if constexpr (sizeof(T) == 1) {
            return bytes[index];
        } else {
            using Word = std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint32_t>;
            Word word;
            std::memcpy(&word, bytes + index * static_cast<std::int64_t>(sizeof(T)), sizeof(T));
            if (swapped)
                word = sizeof(T) == 2 ? static_cast<Word>(__builtin_bswap16(static_cast<std::uint16_t>(word)))
                                      : static_cast<Word>(__builtin_bswap32(word));
            return std::bit_cast<T>(word);
        }
    }
};

template <class T>
Reader<T> reader(const StoredVolume& stored) {
    return {stored.inflated ? stored.inflated.get() : stored.bytes.get(), stored.big_endian};
}

/// Where the voxel (x, y, z) of world order lies in the file: first + x * step.x + y * step.y + z * step.z.
struct FileOrder {
    Index3 dims, step;
    std::int64_t first = 0;

    explicit FileOrder(const StoredVolume& stored) {
        const Index3 stride{1, stored.dims.x, stored.dims.x * stored.dims.y};
        for (int world = 0; world < 3; ++world) {
            const int axis = stored.axis[world];
            dims[world] = stored.dims[axis];
            step[world] = stored.flipped[world] ? -stride[axis] : stride[axis];
            if (stored.flipped[world]) first += stride[axis] * (dims[world] - 1);
        }
    }
};

/// levels[world order] = convert(voxel, its index in the file), rows side by side.
template <class T, class Scalar, class Convert>
void convert_voxels(const StoredVolume& stored, void* levels, const Convert& convert) {
    const Reader<T> read = reader<T>(stored);
    const FileOrder file(stored);
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, file.dims.y * file.dims.z), [&](const auto& rows) {
        for (std::int64_t row = rows.begin(); row < rows.end(); ++row) {
            const std::int64_t y = row % file.dims.y, z = row / file.dims.y;
            const std::int64_t start = file.first + y * file.step.y + z * file.step.z;
            Scalar* out = static_cast<Scalar*>(levels) + row * file.dims.x;
            std::int64_t clamped = 0;
            for (std::int64_t x = 0; x < file.dims.x; ++x) {
                const std::int64_t index = start + x * file.step.x;
                out[x] = static_cast<Scalar>(convert(read(index), index, clamped));
            }
            convert.count(clamped);
        }
    });
}

// --- Integers: subtract the least
// ------------------------------------------------------------------------------------------

struct Shift {
    std::int64_t least, greatest;
    std::atomic<std::int64_t>& outside;

    template <class T>
    std::int64_t operator()(T voxel, std::int64_t, std::int64_t& clamped) const {
        clamped += voxel < least || voxel > greatest;
        return std::clamp<std::int64_t>(voxel, least, greatest) - least;
    }
    void count(std::int64_t clamped) const { outside.fetch_add(clamped, std::memory_order_relaxed); }
};

std::int16_t least_of(const StoredVolume& stored) {
    const Reader<std::int16_t> read = reader<std::int16_t>(stored);
    constexpr std::int16_t kGreatest = std::numeric_limits<std::int16_t>::max();
    return tbb::parallel_reduce(
        tbb::blocked_range<std::int64_t>(0, static_cast<std::int64_t>(stored.voxels()), 1 << 16), kGreatest,
        [&](const auto& range, std::int16_t least) {
            for (std::int64_t i = range.begin(); i < range.end(); ++i) least = std::min(least, read(i));
            return least;
        },
        [](std::int16_t a, std::int16_t b) { return std::min(a, b); });
}

// --- Floats: round to the levels of a window
// ---------------------------------------------------------------------------------

struct Quantise {
    double scale, offset;           // file's units from stored
    double least, levels_per_unit;  // of the window, in the file's units
    double last_level;
    std::atomic<std::int64_t>& outside;
    std::atomic<std::int64_t>& not_finite;  // least index in the file

    std::int64_t operator()(float voxel, std::int64_t index, std::int64_t& clamped) const {
        if (!std::isfinite(voxel)) {
            for (std::int64_t seen = not_finite;
                 index < seen && !not_finite.compare_exchange_weak(seen, index);) {
            }
            return 0;
        }
        const double level = (scale * static_cast<double>(voxel) + offset - least) * levels_per_unit;
        clamped += level < 0 || level > last_level;
        const double inside = std::clamp(level, 0.0, last_level), whole = std::floor(inside);
        return static_cast<std::int64_t>(whole) + (inside - whole >= 0.5);
    }
    void count(std::int64_t clamped) const { outside.fetch_add(clamped, std::memory_order_relaxed); }
};

// --- Settings
// --------------------------------------------------------------------------------------------------------------

/// Everything a scene and a file say about values, settled.
struct Values {
    double scale = 1, offset = 0;  // value = scale * stored + offset
    bool windowed = false;
    double least = 0, greatest = 0;  // of the window, in the file's units
    int bits = 0;                    // declared, or 0
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
    return values;
}

void note_clamped(const StoredVolume& stored, const Values& values, std::int64_t clamped,
                  std::vector<std::string>& notes) {
    if (clamped > 0)
        notes.push_back(
            fmt::format("{}: {} of {} voxels lie outside the window [{}, {}] and were clamped to it",
                        stored.where, clamped, stored.voxels(), values.least, values.greatest));
}

/// Memory for the levels: the file's own where each level takes the place of its voxel, otherwise new.
std::shared_ptr<void> room_for_levels(const StoredVolume& stored, const Volume& volume,
                                      const LoadLimits& limits) {
    const std::size_t bytes = stored.voxels() * volume.scalar_bytes();
    if (stored.inflated && !stored.reordered() && bytes_of(stored.type) == volume.scalar_bytes())
        return stored.inflated;
    check_memory(bytes + (stored.inflated ? stored.size() : 0), stored, limits);
    return allocate_voxels(bytes, stored.where);
}

void quantise_floats(Volume& volume, const StoredVolume& stored, const Values& values,
                     const LoadLimits& limits, std::vector<std::string>& notes) {
    if (!values.windowed || values.bits == 0)
        throw InputError(fmt::format(
            "{}: float voxels, but {} missing: float data need window = [least, greatest] and bits = 1 to 16",
            stored.where,
            values.windowed ? "bits is"
            : values.bits   ? "window is"
                            : "window and bits are"));
    const double last_level = (1 << values.bits) - 1;
    std::atomic<std::int64_t> outside{0}, not_finite{std::numeric_limits<std::int64_t>::max()};
    const Quantise quantise{
        values.scale, values.offset, values.least, last_level / (values.greatest - values.least),
        last_level,   outside,       not_finite};
    volume.type = values.bits <= 8 ? ScalarType::u8 : ScalarType::u16;
    volume.scalar_bits = values.bits;
    volume.value_scale = (values.greatest - values.least) / last_level;
    volume.value_offset = values.least;
    const std::shared_ptr<void> levels = room_for_levels(stored, volume, limits);
    if (volume.type == ScalarType::u8) convert_voxels<float, std::uint8_t>(stored, levels.get(), quantise);
    if (volume.type == ScalarType::u16) convert_voxels<float, std::uint16_t>(stored, levels.get(), quantise);
    volume.data = levels;

    if (const std::int64_t at = not_finite; at < static_cast<std::int64_t>(stored.voxels()))
        throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}, but every voxel must be finite",
                                     stored.where, at % stored.dims.x, at / stored.dims.x % stored.dims.y,
                                     at / stored.dims.x / stored.dims.y, reader<float>(stored)(at)));
    notes.push_back(
        fmt::format("{}: float voxels were quantised to {} bits over [{}, {}]: one level is {:.6g}",
                    stored.where, values.bits, values.least, values.greatest, volume.value_scale));
    note_clamped(stored, values, outside, notes);
}

/// The stored values that levels begin and end at.
std::pair<std::int64_t, std::int64_t> stored_range(const StoredVolume& stored, const Values& values) {
    if (values.windowed) {
        // One level is one stored value: the window snaps to the nearest ones, within what 18 bits hold.
        const auto nearest = [&](double value) {
            return static_cast<std::int64_t>(
                std::floor(std::clamp((value - values.offset) / values.scale, -131072.0, 131072.0) + 0.5));
        };
        const auto [least, greatest] = std::minmax({nearest(values.least), nearest(values.greatest)});
        return {least, greatest};
    }
    if (stored.type == StoredType::i16) return {least_of(stored), std::numeric_limits<std::int16_t>::max()};
    return {0, stored.type == StoredType::u8 ? 255 : 65535};
}

void shift_integers(Volume& volume, const StoredVolume& stored, const Values& values,
                    const LoadLimits& limits, std::vector<std::string>& notes) {
    const auto [least, greatest] = stored_range(stored, values);
    const std::int64_t most = stored.type == StoredType::u8 ? 255 : 65535;
    if (greatest <= least || greatest - least > most)
        throw InputError(fmt::format("{}: window [{}, {}] spans {} stored values, but 2 to {} are allowed",
                                     stored.where, values.least, values.greatest, greatest - least + 1,
                                     most + 1));
    volume.type = stored.type == StoredType::u8 ? ScalarType::u8 : ScalarType::u16;
    volume.value_scale = values.scale;
    volume.value_offset = values.offset + values.scale * static_cast<double>(least);

    // Levels already: taken as they are, without a copy.
    const unsigned char* bytes = stored.inflated ? stored.inflated.get() : stored.bytes.get();
    const bool aligned = reinterpret_cast<std::uintptr_t>(bytes) % bytes_of(stored.type) == 0;
    const bool swapped = stored.big_endian && stored.type != StoredType::u8;
    if (stored.type != StoredType::i16 && !values.windowed && !stored.reordered() && !swapped && aligned) {
        volume.data = stored.inflated ? std::shared_ptr<const void>(stored.inflated)
                                      : std::shared_ptr<const void>(stored.bytes);
        volume.mapped = !stored.inflated;
        if (volume.mapped) volume.zeros = stored.zeros;
        return;
    }
    std::atomic<std::int64_t> outside{0};
    const Shift shift{least, greatest, outside};
    const std::shared_ptr<void> levels = room_for_levels(stored, volume, limits);
    if (stored.type == StoredType::u8)
        convert_voxels<std::uint8_t, std::uint8_t>(stored, levels.get(), shift);
    if (stored.type == StoredType::i16)
        convert_voxels<std::int16_t, std::uint16_t>(stored, levels.get(), shift);
    if (stored.type == StoredType::u16)
        convert_voxels<std::uint16_t, std::uint16_t>(stored, levels.get(), shift);
    volume.data = levels;
    note_clamped(stored, values, outside, notes);
}

/// Integer bits that hold the window where one is declared, otherwise the data; 8 at least.
void choose_bits(Volume& volume, const StoredVolume& stored, const Values& values) {
    std::uint64_t largest = volume.largest;
    if (values.windowed) {
        const auto [least, greatest] = stored_range(stored, values);
        largest = static_cast<std::uint64_t>(greatest - least);
    }
    if (values.bits != 0 && values.bits < bits_for(largest))
        throw InputError(fmt::format("{}: bits is {}, but scalars to {} need {}", stored.where, values.bits,
                                     largest, bits_for(largest)));
    const int at_least = values.bits != 0 ? values.bits : 8;
    volume.scalar_bits =
        volume.type == ScalarType::u8 && values.bits == 0 ? 8 : std::max(at_least, bits_for(largest));
}

/// Of the scalars but the least or the greatest: where they end, and how many voxels are left out.
struct Rest {
    std::uint32_t smallest = std::numeric_limits<std::uint32_t>::max(), largest = 0;
    std::int64_t at_smallest = 0, at_largest = 0;  // voxels of the volume's least and greatest scalar
};

Rest rest_of(const Volume& volume) {
    const auto* scalars = static_cast<const std::uint16_t*>(volume.data.get());
    return tbb::parallel_reduce(
        tbb::blocked_range<std::int64_t>(0, volume.voxels(), 1 << 18), Rest{},
        [&](const auto& range, Rest rest) {
            for (std::int64_t i = range.begin(); i < range.end(); ++i) {
                const std::uint32_t s = scalars[i];
                rest.at_smallest += s == volume.smallest, rest.at_largest += s == volume.largest;
                if (s != volume.smallest) rest.smallest = std::min(rest.smallest, s);
                if (s != volume.largest) rest.largest = std::max(rest.largest, s);
            }
            return rest;
        },
        [](const Rest& a, const Rest& b) {
            return Rest{std::min(a.smallest, b.smallest), std::max(a.largest, b.largest),
                        a.at_smallest + b.at_smallest, a.at_largest + b.at_largest};
        });
}

/// A value that stands apart from all others (what scanners fill up with) makes entries of several levels.
void note_padding(const Volume& volume, const Values& values, std::vector<std::string>& notes) {
    constexpr std::uint32_t kEntries = 4096;
    constexpr std::uint32_t kApart = 4;  // a part of the range as large as this is no chance
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
    return type == StoredType::u8 ? 1 : type == StoredType::f32 ? 4 : 2;
}

std::string needs(const StoredVolume& stored) {
    return fmt::format("{} of {} bits needs {}", text_of(stored.dims), bytes_of(stored.type) * 8,
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
    if (stored.reordered())
        notes.push_back(
            fmt::format("{}: axes are permuted or flipped; voxels were put in x, y, z order", stored.where));

    if (stored.type == StoredType::f32) {
        quantise_floats(volume, stored, values, limits, notes);
        measure(volume);
    } else {
        shift_integers(volume, stored, values, limits, notes);
        measure(volume);
        choose_bits(volume, stored, values);
        note_padding(volume, values, notes);
    }
    return volume;
}

}  // namespace squint
