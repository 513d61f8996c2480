// Tables whose entries are raw numbers: built once from real values, read by every word.
#pragma once

#include "fixedpoint/quantise.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

namespace squint {

/// Rows of `columns` raw numbers; row i, column c at i * columns + c.  Copies share what was built.
class Table {
  public:
    int wire = -1;       // whose it is, for attribution
    bool active = true;  // Real reads the quantised words, or (false) the exact values

    Table() = default;
    Table(int rows, int columns) : columns_(columns), data_(std::make_shared<Data>()) {
        const auto size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
        data_->exact.assign(size, 0), data_->words.assign(size, 0), data_->narrow.assign(size, 0);
    }
    int columns() const { return columns_; }
    int rows() const { return data_ ? static_cast<int>(data_->words.size()) / columns_ : 0; }
    std::size_t index(std::int64_t row, int column) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }

    /// The word, rounded to its Spec.
    std::int64_t word(std::int64_t row, int column) const { return data_->words[index(row, column)]; }
    /// Unrounded, in raw units: value * 2^F.
    double exact(std::int64_t row, int column) const { return data_->exact[index(row, column)]; }
    /// The same words where all fit 32 bits: what lanes read; null otherwise.
    const std::int32_t* narrow() const {
        return data_ && !data_->narrow.empty() ? data_->narrow.data() : nullptr;
    }
    /// Of a table of four columns of unsigned 16-bit words: word c of row i in the low half, the same of row
    /// i + 1 in the high half, at i * 4 + c, each less 2^15 and signed.  One load for lanes that blend two
    /// rows.  Null where a word does not fit.  Made by pair_rows(), once the table is built.
    const std::int32_t* paired() const {
        return data_ && !data_->paired.empty() ? data_->paired.data() : nullptr;
    }
    void pair_rows() {
        data_->paired.clear();
        if (columns_ != 4) return;
        for (std::size_t i = 0; i < data_->words.size(); ++i) {
            const std::int64_t here = data_->words[i],
                               next = i + 4 < data_->words.size() ? data_->words[i + 4] : here;
            if ((here | next) >> 16) return data_->paired.clear();
            data_->paired.push_back(
                static_cast<std::int32_t>(static_cast<std::uint32_t>(here | next << 16) ^ 0x80008000U));
        }
    }
    const std::vector<std::int64_t>& words() const { return data_->words; }
    std::size_t bytes() const {
        return !data_ ? 0 : narrow() ? data_->words.size() * 4 : data_->words.size() * 8;
    }

    void set(int row, int column, double value, const Spec& spec) {
        put(index(row, column), value * static_cast<double>(spec.format.one()), quantise_real(value, spec));
    }
    void set_raw(int row, int column, std::int64_t raw) {
        put(index(row, column), static_cast<double>(raw), raw);
    }
    /// A word that is not the rounding of its exact value: an encoding's.
    void set_encoded(int row, int column, double value, std::int64_t raw, const Format& format) {
        put(index(row, column), value * static_cast<double>(format.one()), raw);
    }

  private:
    struct Data {
        std::vector<double> exact;
        std::vector<std::int64_t> words;
        std::vector<std::int32_t> narrow;
        std::vector<std::int32_t> paired;
    };
    void put(std::size_t at, double exact_raw, std::int64_t raw) {
        data_->exact[at] = exact_raw, data_->words[at] = raw;
        if (raw < std::numeric_limits<std::int32_t>::min() || raw > std::numeric_limits<std::int32_t>::max())
            data_->narrow.clear();
        if (!data_->narrow.empty()) data_->narrow[at] = static_cast<std::int32_t>(raw);
    }
    int columns_ = 1;
    std::shared_ptr<Data> data_;
};

}  // namespace squint
