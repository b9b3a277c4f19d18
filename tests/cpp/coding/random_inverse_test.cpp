#include "sdnn/coding/random_inverse.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace {

using namespace sdnn;
using coding::PatternTable;

int product(const PatternTable& table, std::size_t one, std::size_t other) {
  int sum = 0;
  for (std::size_t k = 0; k < table.n_units(); ++k)
    sum += table.sign(one, k) * table.sign(other, k);
  return sum;
}

TEST(RandomInverse, NeighboursDifferInNFlippedUnitsOfEachSign) {
  core::Random random(3, core::Stream::code_books);
  const auto table = coding::random_inverse_patterns({40, 60, 3}, random);
  for (std::size_t bin = 0; bin < table.n_bins(); ++bin) {
    int n_on = 0;
    for (std::size_t k = 0; k < 40; ++k) n_on += table.sign(bin, k) > 0 ? 1 : 0;
    EXPECT_EQ(n_on, 20) << bin;  // stays balanced
    if (bin > 0) {
      EXPECT_EQ(product(table, bin - 1, bin), 40 - 2 * 6) << bin;
    }
  }
}

TEST(RandomInverse, FlipsEveryUnitWhenAllMayFlip) {
  core::Random random(7, core::Stream::code_books);
  const auto table = coding::random_inverse_patterns({10, 3, 5}, random);
  EXPECT_EQ(product(table, 0, 1), -10);
  EXPECT_EQ(product(table, 0, 2), 10);
}

TEST(RandomInverse, RefusesImpossibleSettings) {
  core::Random random(1, core::Stream::code_books);
  EXPECT_THROW(coding::random_inverse_patterns({41, 5, 1}, random),
               std::invalid_argument);  // odd units
  EXPECT_THROW(coding::random_inverse_patterns({40, 0, 1}, random),
               std::invalid_argument);  // no bins
  EXPECT_THROW(coding::random_inverse_patterns({40, 5, 21}, random),
               std::invalid_argument);  // too many
  EXPECT_THROW(coding::random_inverse_patterns({40, 5, -1}, random),
               std::invalid_argument);  // too few
}

}  // namespace
