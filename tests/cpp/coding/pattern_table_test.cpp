#include "sdnn/coding/pattern_table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <stdexcept>

namespace {

using namespace sdnn;
using coding::PatternTable;

TEST(PatternTable, KeepsSignsBitByBit) {
  const std::array<std::int8_t, 6> signs{1, -1, 1, -1, -1, 1};
  const auto table = PatternTable::from_signs(signs, 2, 3);  // two patterns of three units
  EXPECT_EQ(table.n_bins(), 2U);
  EXPECT_EQ(table.n_units(), 3U);
  EXPECT_EQ(table[0].words()[0], 0b101U);
  EXPECT_EQ(table[1].words()[0], 0b100U);
  EXPECT_EQ(table.sign(0, 1), -1);
  EXPECT_EQ(table.sign(1, 2), 1);
}

// Patterns of 65 units take two words of 64; new patterns are -1 everywhere.
TEST(PatternTable, StartsEveryPatternAtAWord) {
  PatternTable table(3, 65);
  EXPECT_EQ(table.n_words(), 2U);
  table.flip(1, 64);
  EXPECT_EQ(table[1].words()[1], 1U);
  table.copy(1, 2);
  EXPECT_EQ(table.sign(2, 64), 1);
  EXPECT_EQ(table.sign(0, 64), -1);
}

TEST(PatternTable, BalancedPatternsHaveHalfOfTheUnitsOn) {
  core::Random random(1, core::Stream::code_books);
  for (const std::size_t n_units : {2U, 7U, 64U, 200U}) {
    PatternTable table(1, n_units);
    coding::fill_random(table, 0, true, random);
    EXPECT_EQ(table[0].count(), n_units / 2);
  }
}

TEST(PatternTable, BinsAreHalfOpenAndTheLastOneIsClosed) {
  EXPECT_EQ(coding::bin_of(0.0, 360), 0);
  EXPECT_EQ(coding::bin_of(1.0 / 360 * 0.999, 360), 0);
  EXPECT_EQ(coding::bin_of(0.5, 360), 180);
  EXPECT_EQ(coding::bin_of(0.9999999, 360), 359);
  EXPECT_EQ(coding::bin_of(1.0, 360), 359);
}

TEST(PatternTable, RefusesSignsOfWrongSizeOrValue) {
  const std::array<std::int8_t, 2> signs{1, 0};
  EXPECT_THROW(PatternTable::from_signs(signs, 1, 2), std::invalid_argument);  // 0 is no sign
  EXPECT_THROW(PatternTable::from_signs(signs, 1, 3), std::invalid_argument);  // needs 3 signs
  EXPECT_THROW(PatternTable(0, 2), std::invalid_argument);
  EXPECT_THROW(PatternTable(2, 0), std::invalid_argument);
}

}  // namespace
