#include "sdnn/coding/permutation.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>

namespace sdnn::coding {
namespace {

PatternTable table(std::initializer_list<std::int8_t> signs) {
  return PatternTable::from_signs({signs.begin(), signs.size()}, 1, signs.size());
}

TEST(Permutation, UnitKOfAPermutedPatternIsUnitSigmaOfK) {  // sigma is (2, 0, 1)
  EXPECT_EQ(permuted(table({1, -1, -1}), {2, 0, 1}), table({-1, 1, -1}));
}

TEST(Permutation, IsUndoneByItsInverse) {
  core::Random random(1, core::Stream::permutations);
  const Permutation sigma = random_permutation(130, random);
  const Permutation back = inverse(sigma);
  for (std::uint32_t k = 0; k < 130; ++k) EXPECT_EQ(sigma[back[k]], k);
  PatternTable pattern(1, 130);
  fill_random(pattern, 0, true, random);
  EXPECT_NE(permuted(pattern, sigma), pattern);
  EXPECT_EQ(permuted(permuted(pattern, sigma), back), pattern);
}

TEST(Permutation, RefusesIndicesThatAreNoPermutation) {
  EXPECT_THROW(static_cast<void>(permuted(table({1, -1, -1}), {0, 1})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(permuted(table({1, -1, -1}), {0, 1, 1})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(permuted(table({1, -1, -1}), {0, 1, 3})), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::coding
