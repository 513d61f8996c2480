// What a stage may do with a number.  A stage is written once, over a Word, and runs in any of them.  The
// file of each word ends with the assertion that it is one.
#pragma once

#include "fixedpoint/words/integer.h"

#include <concepts>

namespace squint {

/// Real<T> and lanes of floats: they round only where a wire's Rescale is active.
template <class W>
concept RealWord = requires {
    typename W::IsReal;
};

/// One number, or as many side by side as a vector holds.
template <class W>
concept Word = requires(W x, int bits, std::int64_t raw, const Table& table, const Rescale& to) {
    { constant<W>(raw) } -> std::same_as<W>;
    { x + x } -> std::same_as<W>;
    { x - x } -> std::same_as<W>;
    requires std::same_as<decltype(x * x), W>;
    x == x;
    x < x;
    any(x < x);                                   // whether it holds in any lane
    { select(x < x, x, x) } -> std::same_as<W>;   // lane by lane
    { shift_left(x, bits) } -> std::same_as<W>;   // x 2^bits
    { floor_shift(x, bits) } -> std::same_as<W>;  // floor(x 2^-bits)
    { shift_by(x, x) } -> std::same_as<W>;        // x 2^y for y of either sign
    { min(x, x) } -> std::same_as<W>;
    { max(x, x) } -> std::same_as<W>;
    { absolute(x) } -> std::same_as<W>;
    { bit_length(x) } -> std::same_as<W>;              // of |x|: 0 for 0
    { gather(table, x, bits) } -> std::same_as<W>;     // one column of a row of a table
    { blend(x, x, x, bits) } -> std::same_as<W>;       // v0 + w (v1 - v0), exact
    { affine(x, x, x, raw, raw) } -> std::same_as<W>;  // p + k v, promised to lie in [raw, raw]
    { within(x, raw, raw) } -> std::same_as<W>;        // x, promised to lie in [raw, raw]
    { quantise(x, to) } -> std::same_as<W>;            // the one place where bits are lost
    { quotient(x, x, to) } -> std::same_as<W>;         // exact, then quantised once
    requires RealWord<W> || requires(const std::array<W, 3>& v) {
        { vector_length(v, bits) } -> std::same_as<W>;  // floor(|v| 2^bits), for normals
    };
};

// ------------------------------------------------------------------------------------ wide numbers

/// A few numbers of a stage need more bits than all others: differences of sums, which a quotient makes small
/// again.  A Wide<W> holds them.  It is W itself where W is wide enough; for lanes of 32 bits it is two
/// doubles, exact to 53 bits.
///
///   widen  wide_sum  wide_product  -  shift_left  absolute  max  quotient
template <class W>
struct WideOf {
    using Type = W;
};
template <class W>
using Wide = typename WideOf<W>::Type;
template <class W>
constexpr W widen(W x) {
    return x;
}
/// high 2^bits + low.
template <class W>
constexpr W wide_sum(W high, int bits, W low) {
    return shift_left(high, bits) + low;
}
template <class W>
constexpr W wide_product(W a, W b) {
    return a * b;
}
/// Whether any lane is above zero.
template <class N>
constexpr bool any_positive(const N& x) {
    return any(constant<N>(0) < x);
}

// ---------------------------------------------------------------------------------- for every word

/// Three quotients with one denominator.
template <class W>
constexpr std::array<W, 3> quotients(const std::array<W, 3>& numerators, W denominator, const Rescale& to) {
    return {quotient(numerators[0], denominator, to), quotient(numerators[1], denominator, to),
            quotient(numerators[2], denominator, to)};
}

/// a b, computed exactly and quantised once.
template <class W>
constexpr W quantised_product(W a, W b, const Rescale& to) {
    return quantise(a * b, to);
}

template <class W>
constexpr W clamp(W x, W low, W high) {
    return min(max(x, low), high);
}

static_assert(Word<std::int64_t> && Word<Int128>);

}  // namespace squint
