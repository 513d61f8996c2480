// quantise() against the arithmetic it is defined by: SystemC's sc_fix and sc_ufix.  A program of its own,
// for SystemC brings a main() that wants an sc_main().
#define SC_INCLUDE_FX
#include <systemc>

#include "fixedpoint/quantise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

int sc_main(int, char**) {
    return 0;
}

namespace squint {
namespace {

sc_dt::sc_q_mode quantisation_of(Rounding rounding) {
    switch (rounding) {
        case Rounding::trn:
            return sc_dt::SC_TRN;
        case Rounding::trn_zero:
            return sc_dt::SC_TRN_ZERO;
        case Rounding::rnd:
            return sc_dt::SC_RND;
        case Rounding::rnd_conv:
            break;
    }
    return sc_dt::SC_RND_CONV;
}

/// x 2^-from, an exact double, assigned to SystemC's number of the same format; its raw bits as an integer.
template <class Number>
std::int64_t by_systemc(std::int64_t x, int from, const Spec& spec) {
    const Format& f = spec.format;
    Number number(f.width(), f.integer_bits + (f.is_signed ? 1 : 0), quantisation_of(spec.rounding),
                  spec.overflow == Overflow::sat ? sc_dt::SC_SAT : sc_dt::SC_WRAP);
    number = std::ldexp(static_cast<double>(x), -from);
    return static_cast<std::int64_t>(std::ldexp(number.to_double(), f.fraction_bits));
}

void expect_equal(std::int64_t x, int from, const Spec& spec) {
    const std::int64_t expected = spec.format.is_signed ? by_systemc<sc_dt::sc_fix>(x, from, spec)
                                                        : by_systemc<sc_dt::sc_ufix>(x, from, spec);
    ASSERT_EQ(quantise(x, Rescale(from, spec)), expected)
        << x << " with " << from << " fraction bits to " << to_string(spec);
    ASSERT_EQ(quantise_real(std::ldexp(static_cast<double>(x), -from), spec), expected)
        << x << " with " << from << " fraction bits to " << to_string(spec);
}

template <class F>
void for_each_mode(const Format& format, F&& f) {
    for (const Rounding rounding : {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv})
        for (const Overflow overflow : {Overflow::sat, Overflow::wrap}) f(Spec{format, rounding, overflow});
}

TEST(SystemC, EverySmallFormatModeAndValueAgrees) {
    for (int bits = 1; bits <= 3; ++bits)
        for (int fraction = 0; fraction <= bits; ++fraction)
            for (const bool is_signed : {false, true})
                for_each_mode({bits - fraction, fraction, is_signed}, [&](const Spec& spec) {
                    for (int from = fraction; from <= fraction + 3; ++from)
                        for (std::int64_t x = -128; x <= 128; ++x) expect_equal(x, from, spec);
                });
}

TEST(SystemC, RandomFormatsModesAndValuesAgree) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 40'000; ++i) {
        const Format format{static_cast<int>(random() % 25), static_cast<int>(random() % 25),
                            random() % 2 == 0};
        if (format.integer_bits + format.fraction_bits == 0) continue;
        const Spec spec{format, static_cast<Rounding>(random() % 4), static_cast<Overflow>(random() % 2)};
        const int from = static_cast<int>(random() % 49);
        const int gained = std::max(format.fraction_bits - from, 0);
        // 53 bits at most, for the doubles on the way, and 61 with what the format gains, for the words.
        const int dropped = std::max(11, 3 + gained);
        expect_equal(static_cast<std::int64_t>(random()) >> (dropped + random() % (64 - dropped)), from,
                     spec);
    }
}

}  // namespace
}  // namespace squint

int main(int count, char** arguments) {
    testing::InitGoogleTest(&count, arguments);
    return RUN_ALL_TESTS();
}
