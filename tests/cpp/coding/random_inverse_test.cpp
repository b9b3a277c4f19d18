#include "sdnn/coding/random_inverse.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using namespace sdnn;
TEST(RandomInverse, NeighboursDifferInNFlippedUnitsOfEachSign) {
  core::Random random(3, core::Stream::code_books);
  const auto table =
      coding::random_inverse_patterns({.n_units = 40, .n_bins = 60, .n_flipped = 3}, random);
  for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
    EXPECT_EQ(table[bin].count(), 40U / 2) << bin;  // balanced
    if (bin > 0) {
      EXPECT_EQ(table[bin - 1].distance(table[bin]), 3U + 3) << bin;
    }
  }
}

TEST(RandomInverse, FlipsEveryUnitWhenAllMayFlip) {
  core::Random random(7, core::Stream::code_books);
  const auto table =
      coding::random_inverse_patterns({.n_units = 10, .n_bins = 3, .n_flipped = 5}, random);
  EXPECT_EQ(table[0].distance(table[1]), 10U);  // all 10 units are flipped,
  EXPECT_EQ(table[0].distance(table[2]), 0U);   // then all are flipped back
}

TEST(RandomInverse, RefusesImpossibleSettings) {
  core::Random random(1, core::Stream::code_books);
  for (const coding::RandomInverseConfig& bad :
       {coding::RandomInverseConfig{.n_units = 41, .n_bins = 5, .n_flipped = 1},  // odd
        {.n_units = 40, .n_bins = 0, .n_flipped = 1},
        {.n_units = 40, .n_bins = 5, .n_flipped = 21},  // more than 20 of a sign
        {.n_units = 40, .n_bins = 5, .n_flipped = -1}}) {
    EXPECT_THROW(coding::random_inverse_patterns(bad, random), std::invalid_argument);
  }
}

}  // namespace
