// Tables of raw numbers, built once from real values and read by every word.
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

/// Rows of `columns` raw numbers; row i, column c lies at i * columns + c.  Words take 32 bits, or 64 where
/// one does not fit 32.  Copies share the data.
class Table {
  public:
    int wire = -1;                 // the wire of its columns, to which audits attribute them
    std::optional<int> last_wire;  // the wire of the last column, where it differs; -1: none
    bool active = true;            // whether Real reads the quantised words; false: the exact values

    Table() = default;
    /// A table of zeros.  `keeps_exact` keeps the exact values beside the words, which take twice their room.
    Table(int rows, int columns, bool keeps_exact = true);

    int wire_of(int column) const { return last_wire && column == columns_ - 1 ? *last_wire : wire; }
    int columns() const { return columns_; }
    int rows() const { return rows_; }
    std::size_t index(std::int64_t row, int column) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }

    /// The raw word, rounded to its Spec.
    std::int64_t word(std::int64_t row, int column) const {
        const std::size_t at = index(row, column);
        return data_->narrow ? data_->narrow[at] : data_->wide[at];
    }
    /// The value before rounding, in raw units: value * 2^F.  Only where has_exact().
    double exact(std::int64_t row, int column) const { return data_->exact[index(row, column)]; }
    bool has_exact() const { return !data_ || !data_->exact.empty(); }
    /// The words, where all fit 32 bits, for lanes; else null.
    const std::int32_t* narrow() const { return data_ ? data_->narrow.get() : nullptr; }
    /// The words, where narrow() is null.
    const std::int64_t* wide() const { return data_ ? data_->wide.get() : nullptr; }
    /// For tables of four columns of unsigned 16-bit words: at i * 4 + c word c of row i in the low half and
    /// that of row i + 1 in the high half, each minus 2^15 and signed.  Lanes that blend two rows load both
    /// at once.  Null where a word does not fit.  pair_rows() makes them, once the table is built.
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
    /// Sets all rows at once, with SIMD: real values in the table's order, a Spec for each column.
    void fill(std::span<const double> values, std::span<const Spec> columns);
    /// Takes all words at once, without exact values.
    void take(std::unique_ptr<std::int32_t[]> words) { data_->narrow = std::move(words); }
    /// Sets the exact value of a word that is not its rounding: of an encoded value.
    void set_exact(int row, int column, double value, const Format& format) {
        if (has_exact()) data_->exact[index(row, column)] = value * static_cast<double>(format.one());
    }
    /// Shares the rows and exact values of a table that was built in the same way.
    void share(const Table& other) { rows_ = other.rows_, data_ = other.data_; }

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
    int rows_ = 0, columns_ = 1;
    std::shared_ptr<Data> data_;
};

/// Rounds value * scale to the nearest integer, halves to even, within [low, high], in rows of scale.size()
/// columns; |low|, |high| <= 2^51, and NaN gives 0.  Returns false, with undefined `words`, where one needs
/// more than 32 bits.
bool quantise_rows(std::span<const double> values, std::span<const double> scale, std::span<const double> low,
                   std::span<const double> high, std::int32_t* words);

}  // namespace squint
