#include "sdnn/coding/random_inverse.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using namespace sdnn;
using coding::PatternTable;

int product(const PatternTable& table, std::size_t first, std::size_t second) {
  int sum = 0;
  for (std::size_t k = 0; k < table.n_units(); ++k) {
    sum += table.sign(first, k) * table.sign(second, k);
  }
  return sum;
}

TEST(RandomInverse, NeighboursDifferInNFlippedUnitsOfEachSign) {
  core::Random random(3, core::Stream::code_books);
  const auto table =
      coding::random_inverse_patterns({.n_units = 40, .n_bins = 60, .n_flipped = 3}, random);
  for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
    int n_on = 0;
    for (std::size_t k = 0; k < 40; ++k) n_on += table.sign(bin, k) > 0 ? 1 : 0;
    EXPECT_EQ(n_on, 20) << bin;  // stays balanced
    if (bin > 0) {
      EXPECT_EQ(product(table, bin - 1, bin), 40 - 2 * (3 + 3)) << bin;  // 6 of 40 signs differ
    }
  }
}

TEST(RandomInverse, FlipsEveryUnitWhenAllMayFlip) {
  core::Random random(7, core::Stream::code_books);
  const auto table =
      coding::random_inverse_patterns({.n_units = 10, .n_bins = 3, .n_flipped = 5}, random);
  EXPECT_EQ(product(table, 0, 1), -10);  // all 10 units are flipped
  EXPECT_EQ(product(table, 0, 2), 10);   // and flipped back
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
