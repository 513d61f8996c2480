// A word of the model with a bound on its distance from the same number without rounding, split by the
// causes: what a certificate runs (pipeline/machines/certificate.h).
//
// Errors are doubles.  They are only added and multiplied by factors that are not negative, so that their own
// roundings stay below 2^-20 of them; whoever reads a bound adds that.  An error that an operation cannot
// bound (in a table's rows, whose neighbours it does not know) is infinite, never too small.
#pragma once

#include "fixedpoint/words/word.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace squint {

/// Errors in one unit, by cause: a wire's index, or one of the causes behind the wires.
struct Shares {
    static constexpr int kMost = 40, kElsewhere = kMost - 1;
    std::array<double, kMost> of{};

    double sum() const {
        double all = 0;
        for (const double x : of) all += x;
        return all;
    }
    double& operator[](int i) { return of[static_cast<std::size_t>(i)]; }
    double operator[](int i) const { return of[static_cast<std::size_t>(i)]; }
    /// += x factor, factor >= 0.
    void add(const Shares& x, double factor) {
        for (std::size_t i = 0; i < of.size(); ++i) of[i] += x.of[i] * factor;
    }
    Shares scaled(double factor) const {
        Shares x;
        x.add(*this, factor);
        return x;
    }
    static Shares one(int who, double error) {
        Shares x;
        x[who < 0 ? kElsewhere : who] = error;
        return x;
    }
};
inline Shares operator+(Shares a, const Shares& b) {
    a.add(b, 1);
    return a;
}
/// At least the sum, for both signs.
inline Shares greatest(Shares a, const Shares& b) {
    for (std::size_t i = 0; i < a.of.size(); ++i) a.of[i] = std::max(a.of[i], b.of[i]);
    return a;
}

struct Bounded {
    Int128 v = 0;
    bool exact = true;  // has no error at all
    Shares error;       // in units of v's last bit

    double most() const { return exact ? 0 : error.sum(); }
    double low() const { return static_cast<double>(v) - most(); }
    double high() const { return static_cast<double>(v) + most(); }
};
inline Bounded with_error(Int128 v, const Shares& error) {
    Bounded x{v, true, error};
    x.exact = error.sum() == 0;
    return x;
}
inline Bounded unbounded(Int128 v) {
    return with_error(v, Shares::one(-1, std::numeric_limits<double>::infinity()));
}

/// The answer to a comparison, and whether it is the same without rounding.
struct Truth {
    bool is = false, sure = true;
    explicit operator bool() const { return is; }
    friend Truth operator!(Truth a) { return {!a.is, a.sure}; }
    friend Truth operator&(Truth a, Truth b) {
        return {a.is && b.is, (a.sure && b.sure) || (a.sure && !a.is) || (b.sure && !b.is)};
    }
    friend Truth operator|(Truth a, Truth b) { return !((!a) & (!b)); }
};
/// Whether the answer may be yes: what is skipped for all lanes must be false without rounding, too.
inline bool any(Truth t) {
    return t.is || !t.sure;
}

/// The error of one quantising, in units of the result: none where it is exact, else half a last bit, or a
/// whole one where bits are cut off, plus what a limit takes.
inline double rounding_of(double taken, Rounding rounding) {
    if (taken == 0) return 0;
    return std::max(taken, rounding == Rounding::rnd || rounding == Rounding::rnd_conv ? 0.5 : 1.0);
}

inline Bounded make_word(WordTag<Bounded>, std::int64_t value) {
    return {value, true, {}};
}
inline std::int64_t to_index(const Bounded& x) {
    return static_cast<std::int64_t>(x.v);
}
inline Bounded operator+(const Bounded& a, const Bounded& b) {
    if (a.exact && b.exact) return {a.v + b.v, true, {}};
    return {a.v + b.v, false, a.error + b.error};
}
inline Bounded operator-(const Bounded& a, const Bounded& b) {
    if (a.exact && b.exact) return {a.v - b.v, true, {}};
    return {a.v - b.v, false, a.error + b.error};
}
// a'b' - ab = a' db + b' da - da db.
inline Bounded operator*(const Bounded& a, const Bounded& b) {
    Bounded x{a.v * b.v, a.exact && b.exact, {}};
    if (!b.exact) x.error.add(b.error, static_cast<double>(absolute(a.v)));
    if (!a.exact) x.error.add(a.error, static_cast<double>(absolute(b.v)) + b.most());
    return x;
}
inline Truth operator==(const Bounded& a, const Bounded& b) {
    return {a.v == b.v,
            (a.exact && b.exact) || static_cast<double>(absolute(a.v - b.v)) > a.most() + b.most()};
}
inline Truth operator<(const Bounded& a, const Bounded& b) {
    return {a.v < b.v,
            (a.exact && b.exact) || static_cast<double>(absolute(a.v - b.v)) > a.most() + b.most()};
}
inline Bounded shift_left(const Bounded& x, int bits) {
    return {shift_left(x.v, bits), x.exact, x.exact ? Shares{} : x.error.scaled(std::ldexp(1.0, bits))};
}
/// The floors of two numbers that differ by e differ by at most e + 1.
inline Bounded floor_shift(const Bounded& x, int bits) {
    Bounded y{x.v >> bits, x.exact, {}};
    if (!x.exact) y.error = x.error.scaled(std::ldexp(1.0, -bits)) + Shares::one(-1, 1);
    return y;
}
inline Bounded shift_by(const Bounded& x, const Bounded& bits) {
    if (!bits.exact) return unbounded(shift_by(x.v, bits.v));
    const int by = static_cast<int>(bits.v);
    return by >= 0 ? shift_left(x, by) : floor_shift(x, -by);
}
inline Bounded lesser_or_greater(const Bounded& chosen, const Bounded& other, Truth which) {
    if (which.sure) return chosen;
    return {chosen.v, false, greatest(chosen.error, other.error)};
}
inline Bounded min(const Bounded& a, const Bounded& b) {
    const Truth less = b < a;
    return less ? lesser_or_greater(b, a, less) : lesser_or_greater(a, b, less);
}
inline Bounded max(const Bounded& a, const Bounded& b) {
    const Truth less = a < b;
    return less ? lesser_or_greater(b, a, less) : lesser_or_greater(a, b, less);
}
/// Between limits that have no error, with rounding and without: no further off than the limits are.
inline Bounded clamp(const Bounded& x, const Bounded& low, const Bounded& high) {
    Bounded y = min(max(x, low), high);
    if (y.exact || !low.exact || !high.exact) return y;
    const double most = static_cast<double>(std::max(y.v - low.v, high.v - y.v));
    if (const double off = y.most(); off > most)
        y.error = std::isfinite(off) ? y.error.scaled(most / off) : Shares::one(-1, most);
    return y;
}
inline Bounded absolute(const Bounded& x) {
    return {absolute(x.v), x.exact, x.error};
}
inline Bounded select(Truth c, const Bounded& yes, const Bounded& no) {
    const Bounded &chosen = c.is ? yes : no, &other = c.is ? no : yes;
    if (c.sure) return chosen;
    return with_error(
        chosen.v, greatest(chosen.error,
                           other.error + Shares::one(-1, static_cast<double>(absolute(chosen.v - other.v)))));
}
inline Bounded bit_length(const Bounded& x) {
    const Bounded bits{bit_length(x.v), true, {}};
    if (x.exact) return bits;
    const auto of = [](double value) { return bit_length(static_cast<Int128>(std::max(value, 0.0))); };
    return x.most() < 0x1p100 && of(x.low()) == of(x.high() + 1) ? bits : unbounded(bits.v);
}
/// Exact for a row that is the same without rounding; for others nothing is known here.
inline Bounded gather(const Table& table, const Bounded& row, int column) {
    const auto at = static_cast<std::int64_t>(row.v);
    const Int128 word = table.word(at, column);
    if (!row.exact || !table.has_exact()) return unbounded(word);
    return with_error(word, Shares::one(table.wire_of(column),
                                        std::abs(static_cast<double>(word) - table.exact(at, column))));
}
/// Between two values, each by its part.
inline Bounded blend(const Bounded& v0, const Bounded& v1, const Bounded& weight, int weight_bits) {
    Bounded x{blend(v0.v, v1.v, weight.v, weight_bits), v0.exact && v1.exact && weight.exact, {}};
    if (x.exact) return x;
    const double w = static_cast<double>(weight.v), one = std::ldexp(1.0, weight_bits);
    x.error.add(v0.error, std::abs(one - w)), x.error.add(v1.error, std::abs(w));
    x.error.add(weight.error, static_cast<double>(absolute(v1.v - v0.v)) + v0.most() + v1.most());
    return x;
}
inline Bounded affine(const Bounded& p, const Bounded& k, const Bounded& v, std::int64_t, std::int64_t) {
    return p + k * v;
}
inline Bounded within(const Bounded& x, std::int64_t, std::int64_t) {
    return x;
}
/// A length changes by no more than its vector does.
inline Bounded vector_length(const std::array<Bounded, 3>& v, int guard) {
    Bounded x{vector_length(std::array<Int128, 3>{v[0].v, v[1].v, v[2].v}, guard), false, {}};
    for (const Bounded& a : v) x.error.add(a.error, std::ldexp(1.0, guard));
    x.error[Shares::kElsewhere] += 1;
    return x;
}
inline Bounded quantise(const Bounded& x, const Rescale& to) {
    const Int128 raw = quantise(x.v, to);
    const double scale = std::ldexp(1.0, -to.shift);
    const Int128 taken = to.shift > 0 ? x.v - (raw << to.shift) : (x.v << -to.shift) - raw;
    const double rounded = static_cast<double>(absolute(taken)) * (to.shift > 0 ? scale : 1.0);
    Bounded y{raw, x.exact && taken == 0, {}};
    if (y.exact) return y;
    y.error = x.error.scaled(scale);
    y.error[to.wire < 0 ? Shares::kElsewhere : to.wire] += rounding_of(rounded, to.rounding);
    return y;
}
/// n'/d' - n/d = (dn - (n'/d') dd) / d, and d >= d' - |dd|.
inline Bounded quotient(const Bounded& numerator, const Bounded& denominator, const Rescale& to) {
    const Int128 raw = quotient(numerator.v, denominator.v, to);
    const double d = static_cast<double>(denominator.v), scale = std::ldexp(1.0, -to.shift);
    const double least = d - denominator.most();
    if (!(least > 0)) return unbounded(raw);
    const double q = static_cast<double>(numerator.v) / d * scale;
    Bounded y{raw, false, {}};
    y.error.add(numerator.error, scale / least);
    y.error.add(denominator.error, std::abs(q) / least);
    y.error[to.wire < 0 ? Shares::kElsewhere : to.wire] +=
        rounding_of(std::abs(static_cast<double>(raw) - q), to.rounding) + std::abs(q) * 0x1p-50;
    return y;
}

static_assert(Word<Bounded>);

}  // namespace squint
