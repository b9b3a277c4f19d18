#include "sdnn/coding/selective_desensitization.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "errors.hpp"
#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace {

using namespace sdnn;
using coding::PatternTable;
using coding::SelectiveDesensitization;

PatternTable table(std::vector<std::int8_t> signs, std::size_t n_bins) {
  return PatternTable::from_signs(signs, n_bins, signs.size() / n_bins);
}

TEST(SelectiveDesensitization, KeepsThePatternWhereTheModifierIsOn) {
  // Pair (0, 1): pattern of input 0 where that of input 1 is +1; pair (1, 0) the other way round.
  const SelectiveDesensitization code(
      {table({1, -1, 1, -1}, 1), table({1, 1, -1, -1, -1, 1, 1, -1}, 2)},
      {table({1, 1, -1, -1, -1, 1, 1, -1}, 2), table({-1, -1, 1, 1}, 1)}, {{0, 1}, {1, 0}});
  EXPECT_EQ(code.n_inputs(), 2U);
  EXPECT_EQ(code.n_columns(), 8U);
  EXPECT_EQ(code.n_words(), 2U);
  EXPECT_EQ(code.max_active(), 2U + 2U);  // each modifier's patterns have two units on
  EXPECT_EQ(code.slot_of(5), 64U + 1U);   // unit 1 of the second pair, which begins on a word
  std::array<std::uint64_t, 2> active{}, positive{};
  const std::array<std::int32_t, 2> bins{0, 1};
  code.encode(bins, active.data(), positive.data());
  EXPECT_EQ(active[0], 0b0110U);    // modifier pattern -1 +1 +1 -1
  EXPECT_EQ(positive[0], 0b0100U);  // 0 -1 +1 0
  EXPECT_EQ(active[1], 0b1100U);    // modifier pattern -1 -1 +1 +1
  EXPECT_EQ(positive[1], 0b0100U);  // 0 0 +1 -1
}

// The input's pattern +1 -1, desensitized by another of its patterns, +1 +1: both are active.
TEST(SelectiveDesensitization, AcceptsASingleInput) {
  const SelectiveDesensitization code({table({1, -1}, 1)}, {table({1, 1}, 1)}, {{0, 0}});
  std::uint64_t active = 0, positive = 0;
  code.encode(std::array<std::int32_t, 1>{0}, &active, &positive);
  EXPECT_EQ(active, 0b11U);
  EXPECT_EQ(positive, 0b01U);
}

// Inner products from the tables equal those of the codes, with shared and with separate modifiers.
TEST(SelectiveDesensitization, InnerProductsOfBinsEqualThoseOfCodes) {
  core::Random random(4, core::Stream::code_books);
  for (const std::size_t n_units : {5U, 64U, 200U, 300U}) {
    const auto draw = [&] {
      PatternTable drawn(7, n_units);
      for (std::size_t bin = 0; bin < 7; ++bin) coding::fill_random(drawn, bin, false, random);
      return std::make_shared<const PatternTable>(std::move(drawn));
    };
    const auto shared = draw();
    const SelectiveDesensitization code({draw(), draw(), draw(), draw()},
                                        {shared, shared, draw(), shared},
                                        {{0, 1}, {2, 1}, {1, 0}, {0, 1}});
    for (int trial = 0; trial < 20; ++trial) {
      std::array<coding::Bin, 3> a{};
      std::array<coding::Bin, 3> b{};
      for (auto* const bins : {&a, &b}) {
        for (coding::Bin& bin : *bins) bin = static_cast<coding::Bin>(random.below(7));
      }
      std::vector<std::uint64_t> words(4 * code.n_words());
      const std::size_t n = code.n_words();
      code.encode(a, words.data(), words.data() + n);
      code.encode(b, words.data() + 2 * n, words.data() + 3 * n);
      const auto expected = coding::inner_product({words.data(), words.data() + n},
                                                  {words.data() + 2 * n, words.data() + 3 * n}, n);
      sdnn::testing::on_every_instruction_set(
          [&](auto level) { EXPECT_EQ(code.inner_product(a, b), expected) << level; });
    }
  }
}

// Input 0 has one bin, input 1 has two; bins of two samples are checked.
TEST(SelectiveDesensitization, RefusesBadBinsByIndex) {
  const SelectiveDesensitization code({table({1, -1}, 1)}, {table({1, 1, 1, 1}, 2)}, {{0, 1}});
  code.check_bins(std::array<std::int32_t, 4>{0, 1, 0, 0});
  const std::array<std::int32_t, 4> bad{0, 1, 0, 2};
  EXPECT_EQ(sdnn::testing::message_of([&] { code.check_bins(bad); }),
            "bins[1, 1] must be in [0, 2), got 2");
  EXPECT_THROW(code.check_bins(std::array<std::int32_t, 2>{-1, 0}), std::invalid_argument);
  EXPECT_THROW(code.check_bins(std::array<std::int32_t, 3>{0, 0, 0}), std::invalid_argument);
}

TEST(SelectiveDesensitization, RefusesTablesOfDifferentSizes) {
  const auto make = [](std::vector<PatternTable> modified, std::vector<PatternTable> modifiers,
                       std::vector<coding::InputPair> pairs) {
    return SelectiveDesensitization(std::move(modified), std::move(modifiers), std::move(pairs));
  };
  // No pairs, two modifiers for a pair, a table for two pairs, patterns of different lengths, and
  // an input of one bin by one table and of two bins by the other.
  const auto two = table({1, -1}, 1);
  const auto three = table({1, -1, 1}, 1);
  EXPECT_THROW(make({}, {}, {}), std::invalid_argument);
  EXPECT_THROW(make({two}, {two, two}, {{0, 1}}), std::invalid_argument);
  EXPECT_THROW(make({two}, {two}, {{0, 1}, {1, 0}}), std::invalid_argument);
  EXPECT_THROW(make({two}, {three}, {{0, 1}}), std::invalid_argument);
  EXPECT_THROW(make({two}, {table({1, 1, 1, 1}, 2)}, {{0, 0}}), std::invalid_argument);
}

}  // namespace
