// Formats as text: what is read, what is refused, and that refusing changes nothing.
#include "fixedpoint/format.h"

#include <gtest/gtest.h>

namespace squint {
namespace {

TEST(Format, EveryFormatReadsBackAsItself) {
    for (int i = 0; i <= kMostIntegerBits; ++i)
        for (int f = 0; f <= kMostFractionBits; ++f)
            for (const bool is_signed : {false, true}) {
                if (i + f == 0) continue;
                const Format format{i, f, is_signed};
                Format read{7, 7, true};
                EXPECT_EQ(parse_format(to_string(format), read), "");
                EXPECT_EQ(read, format);
            }
}

TEST(Format, EverySpecReadsBackAsItself) {
    for (const Rounding rounding : {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv})
        for (const Overflow overflow : {Overflow::sat, Overflow::wrap}) {
            const Spec spec{{1, 15, true}, rounding, overflow};
            Spec read;
            EXPECT_EQ(parse_spec(to_string(spec), read), "");
            EXPECT_EQ(read, spec);
        }
}

TEST(Format, TheSignBitIsExtra) {
    EXPECT_EQ((Format{1, 15, false}.width()), 16);
    EXPECT_EQ((Format{1, 12, true}.width()), 14);
    EXPECT_EQ((Format{1, 12, true}.smallest()), -8192);
    EXPECT_EQ((Format{1, 12, true}.largest()), 8191);
    EXPECT_EQ((Format{1, 15, false}.one()), 32768);
    EXPECT_EQ((Format{24, 24, false}.largest()), (std::int64_t{1} << 48) - 1);
}

TEST(Format, WhatIsNoFormatIsRefusedInOneLineAndChangesNothing) {
    const Format before{3, 4, true};
    for (const char* text : {"",      "u",      "u1",     "u1.",   "u.15",   "1.15",   "u1.15b",
                             "q1.15", "u25.0",  "u0.30",  "u0.0",  "s0.0",   "u1.150", "u-1.15",
                             "u1,15", " u1.15", "u1.15 ", "U1.15", "u1.1.5", "u100.1", "u1 .15"}) {
        Format format = before;
        const std::string wrong = parse_format(text, format);
        EXPECT_NE(wrong.find("is not a format"), std::string::npos) << text;
        EXPECT_EQ(wrong.find('\n'), std::string::npos);
        EXPECT_EQ(format, before) << text;
    }
}

TEST(Format, WhatASpecLeavesOutKeepsItsValue) {
    Spec spec{{1, 15, false}, Rounding::trn_zero, Overflow::wrap};
    EXPECT_EQ(parse_spec("s2.10", spec), "");
    EXPECT_EQ(spec, (Spec{{2, 10, true}, Rounding::trn_zero, Overflow::wrap}));
    EXPECT_EQ(parse_spec("rnd", spec), "");
    EXPECT_EQ(spec, (Spec{{2, 10, true}, Rounding::rnd, Overflow::wrap}));
    EXPECT_EQ(parse_spec("u1.8 sat", spec), "");
    EXPECT_EQ(spec, (Spec{{1, 8, false}, Rounding::rnd, Overflow::sat}));
}

TEST(Format, WhatIsNoSpecIsRefusedAndChangesNothing) {
    const Spec before{{3, 4, true}, Rounding::rnd, Overflow::wrap};
    for (const char* text : {"", "   ", "nearest", "u1.15 round", "u1.15 trn sat extra",
                             "u1.15 u1.15 u1.15 trn", "u1.15,trn", "u9.99"}) {
        Spec spec = before;
        EXPECT_NE(parse_spec(text, spec), "") << text;
        EXPECT_EQ(spec, before) << text;
    }
    Rounding rounding = Rounding::rnd;
    Overflow overflow = Overflow::wrap;
    EXPECT_NE(parse_rounding("half_up", rounding), "");
    EXPECT_NE(parse_overflow("saturate", overflow), "");
    EXPECT_EQ(rounding, Rounding::rnd);
    EXPECT_EQ(overflow, Overflow::wrap);
}

TEST(Format, NoPartOfASpecIsGivenTwice) {
    Spec spec;
    for (const char* text : {"u1.15 u1.8", "trn rnd", "sat wrap", "sat sat"})
        EXPECT_NE(parse_spec(text, spec), "") << text;
}

}  // namespace
}  // namespace squint
