// The word that counts hardware: widths of operands, and what is counted apart.
#include "fixedpoint/words/tally.h"

#include <gtest/gtest.h>

namespace squint {
namespace {

class TallyTest : public testing::Test {
  protected:
    TallyTest() { Tally::bill = &bill; }
    ~TallyTest() override { Tally::bill = nullptr; }
    static Rescale to(int from, int integer, int fraction, Rounding rounding = Rounding::trn) {
        return Rescale(from, Spec{{integer, fraction, false}, rounding, Overflow::sat});
    }
    using Products = std::map<Bill::Widths, std::int64_t>;
    Bill bill;
    const Tally byte = tally_of({0, 255}, 8), wide_byte = tally_of({0, 255}, 12);
};

TEST_F(TallyTest, AProductOfTwoWiresIsCountedByTheirFormatsWidths) {
    (void)(byte * wide_byte);
    (void)(wide_byte * byte);
    EXPECT_EQ(bill.multipliers, (Products{{{12, 8}, 2}}));
    EXPECT_EQ(bill.multiplier_bits(), 2 * 12 * 8);
}

TEST_F(TallyTest, ADifferenceIsABitWiderThanItsEndsWhateverTheyHaveToSpare) {
    EXPECT_EQ((byte - byte).width(), 9);
    EXPECT_EQ((wide_byte - wide_byte).width(), 13);
    EXPECT_EQ((byte + byte).width(), 9);
    // A lerp multiplies one difference by the weight.
    (void)blend(wide_byte, wide_byte, byte, 8);
    EXPECT_EQ(bill.multipliers, (Products{{{13, 8}, 1}}));
}

TEST_F(TallyTest, ADifferenceThatCannotBeNegativeHasNoSign) {
    const Tally alpha = tally_of({0, 1 << 15}, 16);
    EXPECT_EQ((constant<Tally>(1 << 15) - alpha).width(), 16);
}

TEST_F(TallyTest, WhatALimitOrAMeaningNarrowsHasNothingToSpare) {
    EXPECT_EQ(min(wide_byte, constant<Tally>(15)).width(), 4);
    EXPECT_EQ(min(wide_byte, constant<Tally>(1 << 20)).width(), 12) << "no wider than the wire";
    EXPECT_EQ(within(wide_byte, 0, 100).width(), 7);
    EXPECT_EQ(max(wide_byte - wide_byte, constant<Tally>(0)).width(), 12);
}

TEST_F(TallyTest, AWireWidensWhatIsQuantisedToIt) {
    EXPECT_EQ(quantise(byte, to(4, 12, 2)).width(), 14);
    EXPECT_TRUE(bill.roundings.empty()) << "truncation is free";
    (void)quantise(byte, to(4, 12, 2, Rounding::rnd_conv));
    (void)quantise(byte, to(0, 8, 2, Rounding::rnd_conv));  // gains bits, and rounds nothing
    EXPECT_EQ(bill.roundings, (std::map<int, std::int64_t>{{14, 1}}));
    EXPECT_EQ(bill.rounding_bits(), 14);
}

TEST_F(TallyTest, ConstantsOfThePlanStandApartAndPowersOfTwoAreShifts) {
    (void)(byte * constant<Tally>(10));
    (void)(byte * constant<Tally>(-64));
    (void)(byte * constant<Tally>(0));
    (void)(constant<Tally>(10) * constant<Tally>(11));
    EXPECT_TRUE(bill.multipliers.empty());
    EXPECT_EQ(bill.constant_multipliers, (Products{{{8, 4}, 1}}));
}

TEST_F(TallyTest, ADividerIsCountedByQuotientAndDivisor) {
    const Tally divisor = max(wide_byte, constant<Tally>(1));
    (void)quotient(byte, divisor, to(0, 1, 15, Rounding::rnd));
    EXPECT_EQ(bill.dividers, (Products{{{16, 12}, 1}}));
    EXPECT_EQ(bill.rounding_bits(), 16);
    (void)quotient(byte, constant<Tally>(10), to(0, 1, 15));
    EXPECT_EQ(bill.constant_multipliers, (Products{{{16, 4}, 1}}));
    (void)quotient(byte, constant<Tally>(16), to(0, 1, 15));
    EXPECT_EQ(bill.divider_bits(), 16 * 12);
}

TEST_F(TallyTest, AVectorsLengthTakesThreeSquaresAndARoot) {
    (void)vector_length({byte, byte, byte}, 0);  // at most 255 root 3, of 9 bits
    EXPECT_EQ(bill.multipliers, (Products{{{8, 8}, 3}}));
    EXPECT_EQ(bill.dividers, (Products{{{9, 9}, 1}}));
}

TEST_F(TallyTest, ALookUpIsAsWideAsItsColumnsWire) {
    Table table(2, 2);
    table.wire = 3, table.last_wire = -1;
    table.set_raw(1, 0, 5), table.set_raw(1, 1, 3);
    Tally::wires[3] = 10;
    EXPECT_EQ(gather(table, byte, 0).width(), 10);
    EXPECT_EQ(gather(table, byte, 1).width(), 2) << "nobody's wire: what its words need";
    EXPECT_EQ(bill.lookups, 2);
    EXPECT_EQ(bill.lookup_bits, 12);
}

}  // namespace
}  // namespace squint
