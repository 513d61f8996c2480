// A square table whose nodes hold four raw numbers (red, green, blue, alpha), in 16 bits each where they fit:
// 4096 x 4096 nodes then take 128 MiB.  Every word reads all four at once (gather_cell).
#pragma once

#include "fixedpoint/words.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace squint {

/// size x size nodes; node (row, column), channel c, lies at (row * size + column) * 4 + c.  Copies share the
/// data.
class CellTable {
  public:
    int wire = -1;        // the wire of red, green and blue, to which audits attribute them
    int alpha_wire = -1;  // the wire of alpha
    bool active = true;   // whether Real reads the quantised words; false: the exact values

    CellTable() = default;
    /// Allocates words for values up to `largest`: 16 bits each where that fits, else 32.
    CellTable(int size, std::int64_t largest) : size_(size), data_(std::make_shared<Data>()) {
        data_->largest = largest;
        if (largest <= 0xffff)
            data_->narrow.resize(values() + kPadding);
        else
            data_->wide.resize(values() + kPadding);
    }
    int size() const { return size_; }
    int wire_of(int channel) const { return channel == 3 ? alpha_wire : wire; }
    int columns() const { return 4; }
    std::int64_t rows() const { return std::int64_t{size_} * size_; }
    std::size_t values() const { return static_cast<std::size_t>(rows()) * 4; }
    std::size_t bytes() const { return values() * (is_narrow() ? 2 : 4); }
    bool is_narrow() const { return data_ && !data_->narrow.empty(); }
    std::int64_t largest() const { return data_->largest; }

    std::span<std::uint16_t> narrow() { return {data_->narrow.data(), values()}; }
    std::span<std::uint32_t> wide() { return {data_->wide.data(), values()}; }
    const std::uint16_t* narrow_words() const { return data_->narrow.data(); }
    const std::uint32_t* wide_words() const { return data_->wide.data(); }

    std::int64_t word(std::int64_t row, std::int64_t column, int channel) const {
        const std::size_t at = index(row, column, channel);
        return is_narrow() ? data_->narrow[at] : data_->wide[at];
    }
    /// The value before rounding, in raw units.  Call need_exact() first.
    double exact(std::int64_t row, std::int64_t column, int channel) const {
        return data_->exact[index(row, column, channel)];
    }
    /// Sets the function that computes the exact values, in raw units.  It is called when they are first
    /// needed, because they take four times the room of the words.
    void exact_from(std::function<std::vector<double>()> build) { data_->build_exact = std::move(build); }
    void need_exact() const {
        if (!data_) return;
        const std::lock_guard lock(data_->mutex);
        if (data_->exact.empty()) data_->exact = data_->build_exact();
    }
    /// The exact values in float32, in half the room of doubles; null before need_floats().
    const float* floats() const { return data_->floats.empty() ? nullptr : data_->floats.data(); }
    void need_floats() const {
        if (!data_) return;
        const std::lock_guard lock(data_->mutex);
        if (!data_->floats.empty()) return;
        const std::vector<double> exact = data_->exact.empty() ? data_->build_exact() : data_->exact;
        data_->floats.reserve(exact.size() + kPadding);
        data_->floats.assign(exact.begin(), exact.end());
        data_->floats.resize(exact.size() + kPadding);
    }
    float float_at(std::int64_t row, std::int64_t column, int channel) const {
        return data_->floats[index(row, column, channel)];
    }

  private:
    static constexpr std::size_t kPadding = 8;  // a vector gather may read one node past the last
    struct Data {
        std::vector<std::uint16_t> narrow;
        std::vector<std::uint32_t> wide;
        std::vector<double> exact;
        std::vector<float> floats;
        std::function<std::vector<double>()> build_exact;
        std::mutex mutex;
        std::int64_t largest = 0;
    };
    std::size_t index(std::int64_t row, std::int64_t column, int channel) const {
        return static_cast<std::size_t>((row * size_ + column) * 4 + channel);
    }
    int size_ = 0;
    std::shared_ptr<Data> data_;
};

template <Integer W>
std::array<W, 4> gather_cell(const CellTable& t, W row, W column) {
    std::array<W, 4> cell;
    for (int c = 0; c < 4; ++c)
        cell[static_cast<std::size_t>(c)] =
            t.word(static_cast<std::int64_t>(row), static_cast<std::int64_t>(column), c);
    return cell;
}
inline std::array<Audited, 4> gather_cell(const CellTable& t, Audited row, Audited column) {
    const std::array<Int128, 4> cell = gather_cell(t, row.v, column.v);
    return {{{cell[0]}, {cell[1]}, {cell[2]}, {cell[3]}}};
}
template <class T>
std::array<Real<T>, 4> gather_cell(const CellTable& t, Real<T> row, Real<T> column) {
    std::array<Real<T>, 4> cell;
    const auto i = static_cast<std::int64_t>(row.v), j = static_cast<std::int64_t>(column.v);
    const bool floats = std::is_same_v<T, float> && t.floats();  // then doubles may be missing
    for (int c = 0; c < 4; ++c)
        cell[static_cast<std::size_t>(c)].v = t.active ? static_cast<T>(t.word(i, j, c))
                                              : floats ? static_cast<T>(t.float_at(i, j, c))
                                                       : static_cast<T>(t.exact(i, j, c));
    return cell;
}
/// Any word of the table's format; the index must fit the word as well.
inline std::array<Range, 4> gather_cell(const CellTable& t, Range, Range) {
    note_wire(WordTag<Range>{}, t.wire), note_wire(WordTag<Range>{}, t.alpha_wire);
    noted({0, t.rows() * 4});
    const Range any = noted({0, t.largest()});
    return {any, any, any, any};
}

/// Nodes (row, column) and (row, column + 1).
template <class W>
std::array<std::array<W, 4>, 2> gather_two_cells(const CellTable& t, W row, W column) {
    return {gather_cell(t, row, column), gather_cell(t, row, column + constant<W>(1))};
}

}  // namespace squint
