// Lanes equal the model word for word: every operation of fixedpoint/words/lanes-inl.h, lane_tables-inl.h and
// lane_quotients-inl.h on every SIMD target, 32 and 64 bits, against the integer words of fixedpoint/words.h.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/fixedpoint/lane_words_test.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words.h"
#include "fixedpoint/words/all_lanes-inl.h"
#include "fixedpoint/words/unit_lanes-inl.h"
#include "fixedpoint/words/unit_reals-inl.h"
#include "pipeline/classification/entries-inl.h"

#include <bit>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

// The integers' overloads; those of lanes are found by their arguments.
using squint::absolute, squint::affine, squint::bit_length, squint::blend, squint::clamp, squint::floor_shift,
    squint::gather, squint::max, squint::min, squint::quantise, squint::quantised_product, squint::quotient,
    squint::quotients, squint::select, squint::shift_by, squint::shift_left, squint::vector_length,
    squint::wide_product, squint::wide_sum, squint::widen;

/// Draws operands, runs one operation on lanes and on integers, and keeps the first difference of each.
template <class T, KnownRescales K = KnownRescales::nothing>
class Comparison {
  public:
    using L = Lanes<T, K>;
    static constexpr int kMost = 16;  // lanes of the widest target

    explicit Comparison(std::vector<std::string>& wrong) : wrong_(wrong) {}

    std::int64_t between(std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
    }
    /// Any magnitude below 2^bits.
    std::int64_t any(int bits, bool negative = true) {
        const std::int64_t size = std::int64_t{1} << between(0, bits);
        return between(negative ? -size : 0, size - 1);
    }

    /// f(x, y, z) on both words, with operands from draw(i) for operand i.
    template <class Draw, class F>
    void operator()(const std::string& name, Draw&& draw, F&& f) {
        std::int32_t in[3][kMost], out[kMost];
        for (int operand = 0; operand < 3; ++operand)
            for (std::int32_t& x : in[operand]) x = static_cast<std::int32_t>(draw(operand));
        store(f(load<L>(in[0]), load<L>(in[1]), load<L>(in[2])), out);
        for (std::size_t i = 0; i < L::count(); ++i) {
            const auto expected = static_cast<std::int32_t>(
                f(std::int64_t{in[0][i]}, std::int64_t{in[1][i]}, std::int64_t{in[2][i]}));
            if (out[i] == expected) continue;
            wrong_.push_back(name + '(' + std::to_string(in[0][i]) + ", " + std::to_string(in[1][i]) + ", " +
                             std::to_string(in[2][i]) + ") of " + std::to_string(8 * sizeof(T)) +
                             " bits: " + std::to_string(out[i]) + ", not " + std::to_string(expected));
            return;
        }
    }

  private:
    std::vector<std::string>& wrong_;
    std::mt19937_64 random_{7};
};

template <class T, KnownRescales K>
Spec any_spec(Comparison<T, K>& compare) {
    Spec spec{{static_cast<int>(compare.between(0, 24)), static_cast<int>(compare.between(0, 24)),
               compare.between(0, 1) == 1},
              static_cast<Rounding>(compare.between(0, 3)),
              static_cast<Overflow>(compare.between(0, 1))};
    if (spec.format.integer_bits + spec.format.fraction_bits == 0) spec.format.integer_bits = 1;
    return spec;
}

template <class T, KnownRescales K>
void compare_quantise(Comparison<T, K>& compare) {
    const Spec spec = any_spec(compare);
    Rescale to(static_cast<int>(compare.between(0, 48)), spec);
    // The plan gives a stage lanes that hold x, x + bias and the result.
    const int shift = to.shift, operand = 31 - std::max(-shift, 0);
    if (operand < 1 || (shift > 30 && sizeof(T) == 4 && (to.bias || to.to_zero))) return;
    const std::int64_t room = sizeof(T) == 4 ? 0x7fffffff - to.bias - to.to_even - to.to_zero : 0x7fffffff;
    const std::int64_t most = std::min(room, (std::int64_t{1} << operand) - 1);
    // An unsigned format that wraps negative numbers to more than 31 bits is refused by the lanes.
    const bool negative = to.lowest < 0 || !to.wraps || to.width <= 31;
    if (most < 1) return;
    // What a kernel takes for granted must be so: where it leaves out the limits, no operand meets them.
    const bool meets_limits =
        round_off(negative ? -most : 0, to) < to.lowest || round_off(most, to) > to.highest;
    to.limits = K != KnownRescales::halves_up || meets_limits;
    if (!holds(K, to, 8 * sizeof(T))) return;
    compare(
        "quantise to " + to_string(spec) + " by " + std::to_string(shift),
        [&](int) { return std::min(std::max(compare.any(31, negative), negative ? -most : 0), most); },
        [&](auto x, auto, auto) { return quantise(x, to); });
}

template <class T>
void compare_arithmetic(Comparison<T>& compare) {
    const auto word = [&](int) { return compare.any(29); };
    compare("+", word, [](auto x, auto y, auto) { return x + y; });
    compare("-", word, [](auto x, auto y, auto) { return x - y; });
    compare("min", word, [](auto x, auto y, auto) { return min(x, y); });
    compare("max", word, [](auto x, auto y, auto) { return max(x, y); });
    compare("clamp", word, [](auto x, auto y, auto z) { return clamp(x, min(y, z), max(y, z)); });
    compare("absolute", word, [](auto x, auto, auto) { return absolute(x); });
    compare("<", word, [](auto x, auto y, auto z) { return select(x < y, y, z); });
    compare(
        "==", [&](int) { return compare.between(-2, 2); },
        [](auto x, auto y, auto z) { return select(x == y, x + y, z); });
    compare(
        "& | !", [&](int) { return compare.between(-2, 2); },
        [](auto x, auto y, auto z) { return select(((x < y) & (y < z)) | !(x == z), x, z - y); });
    compare(
        "*", [&](int) { return compare.any(15); }, [](auto x, auto y, auto) { return x * y; });
    const int bits = static_cast<int>(compare.between(0, 15));
    compare("floor_shift", word, [&](auto x, auto, auto) { return floor_shift(x, bits); });
    compare(
        "shift_left", [&](int) { return compare.any(15); },
        [&](auto x, auto, auto) { return shift_left(x, bits); });
    const auto within_weight = [&](int i) {
        return i == 2 ? compare.between(0, std::int64_t{1} << bits) : compare.any(14);
    };
    compare("blend", within_weight, [&](auto x, auto y, auto w) { return blend(x, y, w, bits); });
    compare(
        "affine", [&](int) { return compare.any(14); },
        [](auto x, auto y, auto z) { return affine(x, y, z, 0, 0); });
    compare(
        "bit_length", [&](int) { return compare.any(31, false); },
        [](auto x, auto, auto) { return bit_length(x); });
    compare(
        "shift_by", [&](int i) { return i == 1 ? compare.between(-15, 15) : compare.any(15, false); },
        [](auto x, auto by, auto) { return shift_by(x, by); });
}

template <class T>
void compare_tables(Comparison<T>& compare, const Table& table) {
    const auto row = [&](int) { return compare.between(0, table.rows() - 1); };
    for (int column = 0; column < table.columns(); ++column)
        compare("gather", row, [&](auto x, auto, auto) { return gather(table, x, column); });
}

template <class T>
void compare_quotients(Comparison<T>& compare) {
    Spec spec = any_spec(compare);
    spec.overflow = Overflow::sat;
    const int gained = static_cast<int>(compare.between(0, 12));
    // 32-bit lanes: results of at most 22 bits, scaled numerators and denominators below 2^29.
    spec.format = {static_cast<int>(compare.between(1, 8)), static_cast<int>(compare.between(0, 14)), false};
    const Rescale to(spec.format.fraction_bits - gained, spec);
    const int wide = sizeof(T) == 4 ? 28 - gained : 30;
    compare(
        "quotient to " + to_string(spec),
        [&](int i) { return i == 1 ? 1 + compare.any(28, false) : compare.any(wide, false); },
        [&](auto x, auto y, auto) { return quotient(x, y, to); });
    compare(
        "quotients by one denominator to " + to_string(spec),
        [&](int i) { return i == 1 ? 1 + compare.any(28, false) : compare.any(wide, false); },
        [&](auto x, auto y, auto z) {
            const auto three = quotients(std::array{x, z, min(x, z)}, y, to);  // 22 bits each
            return three[0] + shift_left(three[1], 2) + shift_left(three[2], 5);
        });
    // Ties, and quotients a hair's breadth off one.
    compare(
        "quotients near ties to " + to_string(spec),
        [&](int i) { return i == 1 ? 1 + compare.between(0, 6) : compare.any(12, false); },
        [&](auto x, auto y, auto) { return quotient(x, y, to); });
}

/// Quotients of numbers wider than 32 bits.
template <class T>
void compare_wide(Comparison<T>& compare) {
    Spec spec = any_spec(compare);
    spec.overflow = Overflow::sat;
    spec.format = {static_cast<int>(compare.between(1, 6)), static_cast<int>(compare.between(0, 16)), false};
    const int gained = static_cast<int>(compare.between(0, 10)),
              bits = static_cast<int>(compare.between(0, 16));
    const Rescale to(spec.format.fraction_bits - gained, spec);
    // Small denominators are met by many ties.
    const int most = compare.between(0, 1) ? 30 : 4;
    const auto draw = [&](int i) { return i == 2 ? 1 + compare.any(most - 1, false) : compare.any(30); };
    compare("wide over wide to " + to_string(spec), draw, [&](auto x, auto y, auto z) {
        return quotient(absolute(wide_sum(x, bits, y)), absolute(wide_sum(z, bits, z)), to);
    });
    compare("wide over narrow to " + to_string(spec), draw,
            [&](auto x, auto y, auto z) { return quotient(absolute(wide_sum(x, bits, y)), widen(z), to); });
    compare(
        "product over wide to " + to_string(spec),
        [&](int i) { return i == 2 ? 1 + compare.any(most - 1, false) : compare.any(20); },
        [&](auto x, auto y, auto z) { return quotient(absolute(wide_product(x, y)), widen(z), to); });
}

/// Wide quotients at a tie, or off it by less than 2^-45: a remainder that is not exact falls on the wrong side.
template <class T>
void compare_wide_ties(Comparison<T>& compare) {
    constexpr int kBits = 16;
    const int gained = static_cast<int>(compare.between(1, 15));
    const Rescale to(
        0, {{1, gained, false}, compare.between(0, 1) ? Rounding::rnd : Rounding::rnd_conv, Overflow::sat});
    const std::int64_t parts = std::int64_t{2} << gained;
    std::vector<std::array<std::int64_t, 3>> drawn;
    std::size_t next[3] = {0, 0, 0};
    compare(
        "wide ties to " + to_string(Format{1, gained, false}),
        [&](int operand) {
            if (operand == 0) {
                // `parts` N = odd D + off, D = z (2^16 + 1): z is the class of numbers for which N is whole.
                const std::int64_t odd = 2 * compare.between(0, parts / 2 - 1) + 1,
                                   off = compare.between(-3, 3);
                std::int64_t inverse = odd;
                for (int i = 0; i < 4; ++i) inverse = inverse * (2 - odd * inverse) & (parts - 1);
                const std::int64_t z = (compare.between(1 << 29, (1 << 30) - 1) & -parts) |
                                       (-off * inverse & (parts - 1)),
                                   n = (odd * (z * ((1 << kBits) + 1)) + off) / parts;
                drawn.push_back({n >> kBits, n & ((1 << kBits) - 1), z});
            }
            const auto at = static_cast<std::size_t>(operand);
            return drawn[next[at]++][at];
        },
        [&](auto x, auto y, auto z) { return quotient(wide_sum(x, kBits, y), wide_sum(z, kBits, z), to); });
}

/// Numbers from 0 to 1 of 15 fraction bits, both ends included; half of them of few significant bits, whose
/// products are often halves.
template <class Comparison>
std::int64_t any_unit(Comparison& compare) {
    constexpr std::int64_t kOne = 1 << 15;
    if (compare.between(0, 1)) return compare.between(0, kOne);
    const std::int64_t bits = compare.between(0, 15);
    return compare.between(0, kOne >> bits) << bits;
}
Rescale to_unit() {
    Rescale to(30, Spec{{1, 15, false}, Rounding::rnd_conv, Overflow::sat});
    to.limits = false;
    return to;
}
void compare_unit_products(std::vector<std::string>& wrong) {
    Comparison<std::int32_t, KnownRescales::unit_products> compare(wrong);
    const Rescale to = to_unit();
    for (int round = 0; round < 100'000 && wrong.empty(); ++round)
        compare(
            "unit product", [&](int) { return any_unit(compare); },
            [&](auto x, auto y, auto) { return quantised_product(x, y, to); });
}

/// Numbers from 0 to 1 of more bits, as doubles: the same.
void compare_unit_reals(std::vector<std::string>& wrong) {
    using L = Lanes<std::int32_t>;
    Comparison<std::int32_t> draw(wrong);
    for (int round = 0; round < 100'000 && wrong.empty(); ++round) {
        const int more = static_cast<int>(draw.between(0, UnitReals::kMostBits - 15));
        const std::int64_t one = std::int64_t{1} << (15 + more);
        Rescale to(2 * (15 + more), Spec{{1, 15 + more, false}, Rounding::rnd_conv, Overflow::sat});
        to.limits = false;
        std::int32_t a[16], b[16], product[16], clear[16];
        for (std::int32_t* x : {a, b})
            for (int i = 0; i < 16; ++i)
                x[i] = static_cast<std::int32_t>(draw.between(0, 1) ? any_unit(draw) << more
                                                                    : draw.between(0, one));
        const UnitReals p = unit_reals(load<L>(a)), q = unit_reals(load<L>(b));
        store(words_of<L>(quantised_product(p, q, to))[0], product);
        store(words_of<L>(only(p < q, constant<UnitReals>(one) - p))[0], clear);
        for (std::size_t i = 0; i < UnitReals::count(); ++i)
            if (product[i] != quantised_product(std::int64_t{a[i]}, std::int64_t{b[i]}, to) ||
                clear[i] != (a[i] < b[i] ? one - a[i] : 0))
                wrong.push_back("unit reals of " + std::to_string(a[i]) + " and " + std::to_string(b[i]));
    }
}

/// Lerps whose blend is wider than a lane, and products that are.
void compare_wide_steps(std::vector<std::string>& wrong) {
    Comparison<std::int32_t, KnownRescales::halves_up> compare(wrong);
    Comparison<std::int32_t> any_rounding(wrong);
    constexpr int kRows = 200;
    for (int round = 0; round < 4000 && wrong.empty(); ++round) {
        const int fraction = static_cast<int>(compare.between(15, 22)),
                  bits = static_cast<int>(compare.between(8, 14)),
                  coarser = static_cast<int>(compare.between(0, 2));
        const std::int64_t one = std::int64_t{1} << (fraction + coarser), whole = std::int64_t{1} << bits;
        const Spec spec{{1, fraction, false}, Rounding::rnd, Overflow::sat};
        Rescale to(fraction + coarser + bits, spec);
        const auto draw_lerp = [&](int i) { return compare.between(0, i == 2 ? whole : one); };
        const auto lerp = [&](auto x, auto y, auto w) {
            if constexpr (std::is_same_v<decltype(x), std::int64_t>)
                return quantise(blend(x, y, w, bits), to);
            else
                return lerp_nodes(x, y, w, bits, to);
        };
        any_rounding("split lerp", draw_lerp, lerp);
        Table table(kRows, 1);
        for (int i = 0; i < kRows; ++i) table.set_raw(i, 0, i == 0 ? 0 : one * i / (kRows - 1));
        const auto between_rows = [&](auto row, auto, auto w) {
            if constexpr (std::is_same_v<decltype(row), std::int64_t>)
                return quantise(blend(gather(table, row, 0), gather(table, row + 1, 0), w, bits), to);
            else
                return lerp_row(table, row, w, bits, to);
        };
        const auto draw_row = [&](int i) { return compare.between(0, i == 2 ? whole : kRows - 2); };
        any_rounding("lerp of rows", draw_row, between_rows);
        to.limits = false;
        compare("split lerp without limits", draw_lerp, lerp);
        compare("lerp of rows without limits", draw_row, between_rows);
        for (const Rounding rounding :
             {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv}) {
            const Rescale rounded(fraction + static_cast<int>(compare.between(-4, fraction)),
                                  Spec{{1, fraction, false}, rounding, Overflow::sat});
            any_rounding(
                "wide product", [&](int) { return compare.between(0, 3) ? compare.any(fraction) : 1 << 10; },
                [&](auto x, auto y, auto) {
                    if constexpr (std::is_same_v<decltype(x), std::int64_t>)
                        return quantise(x * y, rounded);
                    else
                        return quantised_wide_product(x, y, rounded);
                });
        }
    }
}

/// Products, sums, order and masks in 16 bits, on their way from words of 32 bits and back.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
void compare_unit_lanes(std::vector<std::string>& wrong) {
    using L = Lanes<std::int32_t>;
    using Parts = UnitParts<L>;
    Comparison<std::int32_t> draw(wrong);
    const Rescale to = to_unit();
    for (int round = 0; round < 100'000 && wrong.empty(); ++round) {
        std::int32_t a[16], b[16], product[16], clear[16];
        for (std::int32_t* x : {a, b})
            for (int i = 0; i < 16; ++i) x[i] = static_cast<std::int32_t>(any_unit(draw));
        Parts x, y;
        for (std::size_t i = 0; i < x.size(); ++i)
            x[i] = load<L>(a + i * L::count()), y[i] = load<L>(b + i * L::count());
        const UnitLanes p = units_of<L>(x), q = units_of<L>(y);
        const Parts pq = words_of<L>(quantised_product(p, q, to)),
                    rest = words_of<L>(only(p < q, constant<UnitLanes>(1 << 15) - p));
        for (std::size_t i = 0; i < x.size(); ++i)
            store(pq[i], product + i * L::count()), store(rest[i], clear + i * L::count());
        for (std::size_t i = 0; i < UnitLanes::count(); ++i)
            if (product[i] != quantised_product(std::int64_t{a[i]}, std::int64_t{b[i]}, to) ||
                clear[i] != (a[i] < b[i] ? (1 << 15) - a[i] : 0))
                wrong.push_back("unit lanes of " + std::to_string(a[i]) + " and " + std::to_string(b[i]));
    }
}
#else
void compare_unit_lanes(std::vector<std::string>&) {}
#endif

template <class T>
void compare_words(std::vector<std::string>& wrong) {
    Comparison<T> compare(wrong);
    Comparison<T, KnownRescales::halves_to_even> known_even(wrong);
    Comparison<T, KnownRescales::halves_up> known_up(wrong);
    Table table(200, 3);
    for (int i = 0; i < 200; ++i)
        for (int c = 0; c < 3; ++c) table.set_raw(i, c, compare.any(31));
    for (int round = 0; round < 4000 && wrong.size() < 4; ++round) {
        compare_arithmetic(compare), compare_quantise(compare), compare_quotients(compare);
        compare_tables(compare, table), compare_wide(compare), compare_wide_ties(compare);
        compare_quantise(known_even), compare_quantise(known_up);
    }
    for (int round = 0; round < 4000 && wrong.size() < 4; ++round) {
        const int guard = static_cast<int>(compare.between(0, sizeof(T) == 4 ? 8 : 9));
        compare(
            "vector_length", [&](int) { return compare.between(0, 3) ? compare.any(15, false) : 0x7fff; },
            [guard](auto x, auto y, auto z) {
                return vector_length(std::array{x, y, z}, guard);
            });
    }
}

/// The same of floats, bit for bit: zeros of either sign, and numbers of any magnitude a stage meets.
class FloatComparison {
  public:
    using L = Lanes<float>;
    static constexpr int kMost = 16;

    explicit FloatComparison(std::vector<std::string>& wrong) : wrong_(wrong) {}

    float any() {
        const float sizes[] = {0, -0.0F, 1, -1, 0.5F};
        const auto i = random_() % 24;
        if (i < 5) return sizes[i];
        const auto mantissa =
            static_cast<float>(static_cast<std::int64_t>(random_() % (1U << 25)) - (1 << 24));
        return std::ldexp(mantissa, static_cast<int>(random_() % 60) - 50);
    }
    int between(int low, int high) {
        return static_cast<int>(
            low +
            static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(std::int64_t{high} - low + 1)));
    }

    template <class Draw, class F>
    void operator()(const std::string& name, Draw&& draw, F&& f) {
        std::int32_t in[3][kMost], out[kMost];
        for (int operand = 0; operand < 3; ++operand)
            for (std::int32_t& x : in[operand])
                x = std::bit_cast<std::int32_t>(static_cast<float>(draw(operand)));
        store(f(load<L>(in[0]), load<L>(in[1]), load<L>(in[2])), out);
        for (std::size_t i = 0; i < L::count(); ++i) {
            const auto word = [&](int operand) { return Real<float>{std::bit_cast<float>(in[operand][i])}; };
            const float expected = f(word(0), word(1), word(2)).v, found = std::bit_cast<float>(out[i]);
            if (std::bit_cast<std::int32_t>(expected) == out[i] || (expected != expected && found != found))
                continue;
            char text[200];
            std::snprintf(text, sizeof text, "%s(%a, %a, %a): %a, not %a", name.c_str(), double{word(0).v},
                          double{word(1).v}, double{word(2).v}, double{found}, double{expected});
            wrong_.push_back(text);
            return;
        }
    }

  private:
    std::vector<std::string>& wrong_;
    std::mt19937_64 random_{11};
};

void compare_float_words(std::vector<std::string>& wrong) {
    FloatComparison compare(wrong);
    Table table(200, 4);
    for (int i = 0; i < 200; ++i)
        for (int c = 0; c < 4; ++c) table.set_raw(i, c, compare.between(-1 << 30, 1 << 30));
    table.active = false;
    table.need_floats();
    const auto any = [&](int) { return compare.any(); };
    const auto row = [&](int i) {
        return static_cast<float>(i == 0 ? compare.between(0, 198) : compare.between(0, 4096));
    };
    for (int round = 0; round < 3000 && wrong.size() < 4; ++round) {
        const int bits = compare.between(-20, 30);
        Rescale to;
        to.shift = bits, to.active = false;
        compare("+ float", any, [](auto x, auto y, auto) { return x + y; });
        compare("- float", any, [](auto x, auto y, auto) { return x - y; });
        compare("* float", any, [](auto x, auto y, auto) { return x * y; });
        compare("/ float", any, [](auto x, auto y, auto) { return x / y; });
        compare("min float", any, [](auto x, auto y, auto) { return min(x, y); });
        compare("max float", any, [](auto x, auto y, auto) { return max(x, y); });
        compare("clamp float", any, [](auto x, auto y, auto z) { return clamp(x, y, z); });
        compare("absolute float", any, [](auto x, auto, auto) { return absolute(x); });
        compare("select float", any,
                [](auto x, auto y, auto z) { return select(((x < y) & !(y == z)) | (z < x), y, z); });
        compare("square_root", any, [](auto x, auto, auto) { return square_root(absolute(x)); });
        compare("shift_left float", any, [=](auto x, auto, auto) { return shift_left(x, bits); });
        compare("floor_shift float", any, [=](auto x, auto, auto) { return floor_shift(x, bits); });
        compare("blend float", any, [=](auto x, auto y, auto z) { return blend(x, y, z, bits); });
        compare("affine float", any, [](auto x, auto y, auto z) { return affine(x, y, z, 0, 0); });
        compare("quantise float", any, [&](auto x, auto, auto) { return quantise(x, to); });
        compare("quotient float", any, [&](auto x, auto y, auto) { return quotient(x, y, to); });
        compare("wide float", any,
                [=](auto x, auto y, auto z) { return wide_sum(x, bits, y) - wide_product(widen(y), z); });
        compare(
            "whole_power_of_two", [&](int) { return compare.between(-126, 127); },
            [](auto x, auto, auto) { return whole_power_of_two(x); });
        compare("one_minus_exp", any, [](auto x, auto, auto) { return one_minus_exp(absolute(x)); });
        compare("gather float", row, [&](auto x, auto, auto) { return gather(table, x, 3); });
        compare("lerp_rows float", row, [&](auto x, auto w, auto) {
            const auto rows = lerp_rows(table, x, w, 12, to, to);
            return rows[0] + rows[1] - rows[2] * rows[3];
        });
    }
}

}  // namespace

void compare_all_words(std::vector<std::string>& wrong) {
    compare_words<std::int32_t>(wrong);
    compare_words<std::int64_t>(wrong);
    compare_unit_products(wrong), compare_unit_reals(wrong), compare_wide_steps(wrong);
    compare_unit_lanes(wrong);
    compare_float_words(wrong);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "pipeline/machines/lanes/kernels.h"

#include <gtest/gtest.h>

namespace squint {
namespace {

void on_target(std::int64_t target,
               std::vector<std::string>& wrong){SQUINT_CALL_TARGET(target, compare_all_words, wrong)}

TEST(LaneWords, EqualTheModelsOnEveryTarget) {
    for (const std::string& name : lanes::target_names()) {
        std::vector<std::string> wrong;
        on_target(lanes::find_target(name), wrong);
        for (const std::string& line : wrong) ADD_FAILURE() << name << ": " << line;
    }
}

}  // namespace
}  // namespace squint
#endif
