#include "sdnn/coding/detail/ternary_code.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"

namespace sdnn {
namespace {

/// A code whose entries are all +1, or all -1.
testing::Code full_code(std::size_t n_words, int entry) {
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  return {std::vector(n_words, kOnes), std::vector(n_words, entry > 0 ? kOnes : 0)};
}

TEST(TernaryCode, InnerProductsAreExactForAnyNumberOfWords) {
  core::Random random(3, core::Stream::weights);
  for (std::size_t n_words = 0; n_words < 270; n_words += n_words < 70 ? 1 : 13) {
    const auto code = testing::random_code(n_words, random);
    const auto other = testing::random_code(n_words, random);
    std::int32_t expected = 0;
    for (std::size_t slot = 0; slot < 64 * n_words; ++slot)
      expected += code.at(slot) * other.at(slot);
    testing::on_every_instruction_set([&](auto level) {
      EXPECT_EQ(coding::inner_product(code.words(), other.words(), n_words), expected) << level;
    });
  }
}

// Kernels count matches in bytes, which reach 8 * 31 of 255 at 124 words.
TEST(TernaryCode, InnerProductsOfFullCodesDoNotOverflow) {
  for (const std::size_t n_words : {124U, 128U, 400U}) {
    const testing::Code on = full_code(n_words, 1), off = full_code(n_words, -1);
    const auto all = static_cast<std::int32_t>(64 * n_words);
    testing::on_every_instruction_set([&](auto level) {
      EXPECT_EQ(coding::inner_product(on.words(), on.words(), n_words), all) << level;
      EXPECT_EQ(coding::inner_product(on.words(), off.words(), n_words), -all) << level;
    });
  }
}

/// The entries of a code: how often each column is listed as plus, minus how often as minus.
std::vector<int> entries_of(const coding::ColumnLists& slots, std::size_t n_words) {
  std::vector<int> entries(64 * n_words);
  for (const std::uint32_t slot : slots.columns().plus) ++entries[slot];
  for (const std::uint32_t slot : slots.columns().minus) --entries[slot];
  return entries;
}

// A column whose entry changes by 2, from -1 to +1 or back, is listed twice.
TEST(ColumnLists, ListTheChangesFromOneCodeToAnother) {
  core::Random random(5, core::Stream::weights);
  for (std::size_t n_words = 0; n_words < 9; ++n_words) {
    for (const std::size_t n_changes : {0U, 1U, 5U, 1000U}) {
      const auto from = testing::random_code(n_words, random);
      const auto to = n_words == 0 ? from : testing::neighbour_of(from, n_changes, random);
      std::vector<int> differences;
      std::size_t distance = 0;
      for (std::size_t slot = 0; slot < 64 * n_words; ++slot) {
        differences.push_back(to.at(slot) - from.at(slot));
        distance += static_cast<std::size_t>(std::abs(differences.back()));
      }
      testing::on_every_instruction_set([&](auto level) {
        coding::ColumnLists slots(n_words);
        slots.read_changes(from.words(), to.words());
        EXPECT_EQ(entries_of(slots, n_words), differences) << level;
        EXPECT_EQ(slots.columns().size(), distance);
        slots.read(to.words());
        for (std::size_t slot = 0; slot < 64 * n_words; ++slot) {
          ASSERT_EQ(entries_of(slots, n_words)[slot], to.at(slot)) << level;
        }
      });
    }
  }
}

// From -1 to +1 each column rises by 2, and is listed twice.
TEST(ColumnLists, HaveRoomForChangesOfEveryColumn) {
  const std::size_t n_words = 3;
  const testing::Code up = full_code(n_words, 1), down = full_code(n_words, -1);
  testing::on_every_instruction_set([&](auto level) {
    coding::ColumnLists slots(n_words);
    slots.read_changes(down.words(), up.words());
    EXPECT_EQ(slots.columns().plus.size(), 128 * n_words) << level;
    slots.read(down.words());
    EXPECT_EQ(slots.columns().minus.size(), 64 * n_words) << level;
    EXPECT_TRUE(slots.columns().plus.empty());
  });
}

// A group of 200 columns has four words, of which the last is filled to its bit 8.
TEST(ColumnLists, NumberColumnsOfGroupsConsecutively) {
  core::Random random(6, core::Stream::weights);
  const std::size_t n_words = 12;
  auto code = testing::random_code(n_words, random);
  std::vector<std::uint32_t> plus, minus;
  for (std::uint32_t w = 0; w < n_words; ++w) {
    if (w % 4 == 3) {  // 3 * 64 + 8 = 200
      code.active[w] &= 0xFF;
      code.positive[w] &= 0xFF;
    }
    for (std::uint32_t bit = 0; bit < 64; ++bit) {
      if ((code.active[w] >> bit & 1) == 0) continue;
      (code.positive[w] >> bit & 1 ? plus : minus).push_back(w / 4 * 200 + w % 4 * 64 + bit);
    }
  }
  coding::ColumnLists lists(n_words, 4, 200);
  lists.read(code.words());
  EXPECT_GT(plus.size(), 50U);
  EXPECT_TRUE(std::ranges::equal(lists.columns().plus, plus));
  EXPECT_TRUE(std::ranges::equal(lists.columns().minus, minus));
}

}  // namespace
}  // namespace sdnn
