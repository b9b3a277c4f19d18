#include "sdnn/coding/symbol_patterns.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace sdnn::coding {
namespace {

PatternTable table_of(int n_symbols, int n_units, bool balanced, std::uint64_t seed = 1) {
  core::Random random(seed, core::Stream::code_books);
  return symbol_patterns(n_symbols, n_units, balanced, random);
}

TEST(SymbolPatterns, UnbalancedPatternsHaveIndependentUnits) {
  core::Random same_random(6, core::Stream::code_books);
  const PatternTable table = table_of(2, 70, false, 6);
  for (std::size_t symbol = 0; symbol < 2; ++symbol) {
    for (std::size_t k = 0; k < 70; ++k) EXPECT_EQ(table[symbol][k], same_random.below(2) == 1);
  }
}

// There must be a symbol, and two units in a pattern.
TEST(SymbolPatterns, RefuseBadSizes) {
  EXPECT_THROW(table_of(0, 40, true), std::invalid_argument);
  EXPECT_THROW(table_of(2, 1, true), std::invalid_argument);
}

}  // namespace
}  // namespace sdnn::coding
