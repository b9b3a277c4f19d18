#include "sdnn/estimators/detail/signed_sums.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "estimators/codes.hpp"
#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn {
namespace {

/// Expects exact sums where two thirds of 21 rows are added and the others subtracted. Entries are
/// up to `largest` in size; `n_per_sum` of them are summed before the sum is widened.
template <class To, class Entry>
void expect_exact_sums(std::int32_t largest, std::size_t n_per_sum) {
  core::Random random(4, core::Stream::weights);
  const auto span = static_cast<std::uint64_t>(2 * std::int64_t{largest} + 1);
  constexpr std::size_t kOffset = 5;
  for (const std::size_t size : {1U, 16U, 64U, 100U, 128U, 200U}) {
    std::vector<std::vector<Entry>> rows(21, std::vector<Entry>(kOffset + size));
    estimators::SignedRows<Entry> signed_rows;
    std::vector<To> expected(size, 3);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      for (auto& entry : rows[k]) {
        entry = static_cast<Entry>(static_cast<std::int64_t>(random.below(span)) - largest);
      }
      const int direction = k % 3 == 0 ? -1 : 1;
      signed_rows.add(rows[k].data(), direction);
      for (std::size_t i = 0; i < size; ++i) {
        expected[i] = static_cast<To>(expected[i] + direction * rows[k][kOffset + i]);
      }
    }
    EXPECT_EQ(signed_rows.size(), 21U);
    testing::on_every_instruction_set([&](auto level) {
      std::vector<To> to(size, 3);
      estimators::add_signed(to.data(), size, signed_rows, kOffset, n_per_sum);
      EXPECT_EQ(to, expected) << level << ' ' << size;
    });
  }
}

TEST(SignedSums, AreExactForAllTypes) {
  // Arguments are the largest entry, and how many such entries their type still sums: 127 * 1,
  // 8 * 4000 < 2^15.
  expect_exact_sums<std::int16_t, std::int8_t>(1, 127);
  expect_exact_sums<std::int32_t, std::int8_t>(127, 1);
  expect_exact_sums<std::int32_t, std::int16_t>(4000, 8);
  expect_exact_sums<std::int32_t, std::int16_t>(32767, 1);
  expect_exact_sums<std::int32_t, std::int32_t>(1000000, std::numeric_limits<std::int32_t>::max());
}

TEST(SignedSums, OfNoColumnsDoNotChangeSums) {
  std::vector<std::int32_t> to(40, 9);
  const estimators::SignedRows<std::int16_t> no_rows;
  estimators::add_signed(to.data(), to.size(), no_rows, /*offset=*/0, /*n_per_sum=*/8);
  EXPECT_EQ(to, std::vector<std::int32_t>(40, 9));
}

// The words of a code are expanded to bytes in the order `words`, in chunks of two words; chunk c
// begins at c * stride.
TEST(SignedSums, ExpandedCodesHaveTheEntriesOfTheirWords) {
  core::Random random(10, core::Stream::weights);
  constexpr std::size_t kChunkWords = 2;
  constexpr std::size_t kColumns = 64 * kChunkWords;
  const auto code = testing::random_code(2 * kChunkWords, random);
  const std::vector<std::size_t> words{2, 0, 1, 3};
  testing::on_every_instruction_set([&](auto level) {
    const std::size_t stride = 3 * kColumns;
    constexpr std::int8_t kUntouched = 7;
    std::vector<std::int8_t> entries(2 * stride, kUntouched);
    estimators::expand_code(code.words(), words, kChunkWords, entries.data(), stride);
    for (std::size_t slot = 0; slot < 2 * kColumns; ++slot) {
      ASSERT_EQ(entries[slot / kColumns * stride + slot % kColumns],
                code.at(64 * words[slot / 64] + slot % 64))
          << level;
    }
    EXPECT_EQ(entries[kColumns], kUntouched);  // in the gap between two chunks
  });
}

template <class Product>
void expect_exact_row() {
  const std::vector<Product> row{3, -4, 5};
  testing::on_every_instruction_set([&](auto level) {
    std::vector<std::int32_t> to{1000000, 2, 3, 4};
    estimators::add_row(to.data(), row.data(), 1, row.size());
    EXPECT_EQ(to, (std::vector<std::int32_t>{1000003, -2, 8, 4})) << level;
    // Subtracted from the second entry on: -2 - 3, 8 + 4, 4 - 5.
    estimators::add_row(to.data() + 1, row.data(), -1, row.size());
    EXPECT_EQ(to, (std::vector<std::int32_t>{1000003, -5, 12, -1})) << level;
  });
}

TEST(SignedSums, EqualPlainSumsOfASingleRow) {
  expect_exact_row<std::int16_t>();
  expect_exact_row<std::int32_t>();
}

}  // namespace
}  // namespace sdnn
