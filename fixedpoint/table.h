// Tables whose entries are raw numbers: built once from real values, read by every word.
#pragma once

#include "fixedpoint/quantise.h"

#include <cassert>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace squint {

/// Rows of `columns` raw numbers; row i, column c at i * columns + c.  Words are kept in 32 bits, or in 64
/// where one does not fit.  Copies share what was built.
class Table {
  public:
    int wire = -1;                 // whose it is, for attribution
    std::optional<int> last_wire;  // of the last column, where it differs; -1: nobody's
    bool active = true;            // Real reads the quantised words, or (false) the exact values

    Table() = default;
    /// Zeros.  The exact values take twice the words' room: without `keeps_exact` there are none.
    Table(int rows, int columns, bool keeps_exact = true);

    int wire_of(int column) const { return last_wire && column == columns_ - 1 ? *last_wire : wire; }
    int columns() const { return columns_; }
    int rows() const { return data_ ? static_cast<int>(data_->size) / columns_ : 0; }
    std::size_t index(std::int64_t row, int column) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }

    /// The word, rounded to its Spec.
    std::int64_t word(std::int64_t row, int column) const {
        const std::size_t at = index(row, column);
        return data_->narrow ? data_->narrow[at] : data_->wide[at];
    }
    /// Unrounded, in raw units: value * 2^F.  Only where has_exact().
    double exact(std::int64_t row, int column) const { return data_->exact[index(row, column)]; }
    bool has_exact() const { return !data_ || !data_->exact.empty(); }
    /// The words where all fit 32 bits: what lanes read; null otherwise.
    const std::int32_t* narrow() const { return data_ ? data_->narrow.get() : nullptr; }
    /// The words where narrow() is null.
    const std::int64_t* wide() const { return data_ ? data_->wide.get() : nullptr; }
    /// Of a table of four columns of unsigned 16-bit words: word c of row i in the low half, the same of row
    /// i + 1 in the high half, at i * 4 + c, each less 2^15 and signed.  One load for lanes that blend two
    /// rows.  Null where a word does not fit.  Made by pair_rows(), once the table is built.
    const std::int32_t* paired() const { return data_ ? data_->paired.get() : nullptr; }
    void pair_rows();
    /// The exact values in float32, for lanes of floats; null before need_floats().
    const float* floats() const { return data_ && !data_->floats.empty() ? data_->floats.data() : nullptr; }
    void need_floats() const {
        if (data_ && data_->floats.empty()) data_->floats.assign(data_->exact.begin(), data_->exact.end());
    }
    std::size_t bytes() const { return !data_ ? 0 : data_->size * (narrow() ? 4 : 8); }

    void set(int row, int column, double value, const Spec& spec) {
        put(index(row, column), value * static_cast<double>(spec.format.one()), quantise_real(value, spec));
    }
    void set_raw(int row, int column, std::int64_t raw) {
        put(index(row, column), static_cast<double>(raw), raw);
    }
    /// All rows at once, many words at a time: real values in the table's order, each column to its Spec.
    void fill(std::span<const double> values, std::span<const Spec> columns);
    /// All words at once, made elsewhere, without exact values.
    void take(std::unique_ptr<std::int32_t[]> words) { data_->narrow = std::move(words); }
    /// Where a word is not the rounding of its exact value: an encoding's.
    void set_exact(int row, int column, double value, const Format& format) {
        if (has_exact()) data_->exact[index(row, column)] = value * static_cast<double>(format.one());
    }
    /// The rows of a table built alike, with its exact values.
    void share(const Table& other) { data_ = other.data_; }

  private:
    struct Data {
        std::size_t size = 0;
        std::unique_ptr<std::int32_t[]> narrow;
        std::unique_ptr<std::int64_t[]> wide;
        std::unique_ptr<std::int32_t[]> paired;
        std::vector<double> exact;
        std::vector<float> floats;
    };
    void put(std::size_t at, double exact_raw, std::int64_t raw);
    void widen();
    int columns_ = 1;
    std::shared_ptr<Data> data_;
};

/// Rows of `scale.size()` columns: the nearest whole number, halves to even, of value * scale within [low,
/// high], column by column; |low|, |high| <= 2^51, and NaN gives 0.  False, and the words are nobody's, where
/// one needs more than 32 bits.
bool quantise_rows(std::span<const double> values, std::span<const double> scale, std::span<const double> low,
                   std::span<const double> high, std::int32_t* words);

}  // namespace squint
