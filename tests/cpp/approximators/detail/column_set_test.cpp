#include "sdnn/approximators/detail/column_set.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

TEST(ColumnSet, HoldsEachAddedColumnOnce) {
  ColumnSet set(130);
  EXPECT_EQ(set.size(), 0U);
  for (const std::size_t column : {0U, 63U, 64U, 129U, 64U}) set.add(column);
  EXPECT_EQ(set.size(), 4U);
  EXPECT_TRUE(set.holds(64) && set.holds(129));
  EXPECT_FALSE(set.holds(1) || set.holds(128));
}

TEST(ColumnSet, RemovesColumns) {
  ColumnSet set(70);
  set.add(3);
  set.add(69);
  set.remove(3);
  set.remove(4);
  EXPECT_EQ(set.size(), 1U);
  EXPECT_EQ(set.words()[0].to_ullong(), 0U);
  EXPECT_EQ(set.words()[1].to_ullong(), std::uint64_t{1} << 5);
}

TEST(ListedColumns, FindsColumnsOfASetWithTheirRepetitions) {
  ColumnSet set(200);
  for (const std::size_t column : {7U, 70U, 130U, 199U}) set.add(column);
  const std::vector<std::uint32_t> columns = {1, 7, 7, 8, 70, 130, 131, 130, 2};
  std::array<std::uint32_t, 17> out{};
  const ListedColumns<16> listed(columns);
  sdnn::testing::on_every_instruction_set([&](auto level) {
    const auto n = static_cast<std::ptrdiff_t>(listed.in(set, out.data()));
    EXPECT_EQ(std::vector<std::uint32_t>(out.begin(), out.begin() + n),
              (std::vector<std::uint32_t>{7, 7, 70, 130, 130}))
        << level;
  });
  EXPECT_EQ(listed.in(ColumnSet(200), out.data()), 0U);
}

TEST(IntersectBits, FindsTheCommonColumnsForAnyNumberOfWords) {
  core::Random random(4, core::Stream::weights);
  for (std::size_t n_words = 1; n_words < 40; ++n_words) {
    ColumnSet set(64 * n_words);
    std::vector<std::uint64_t> bits(n_words);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t j = 0; j < 64 * n_words; ++j) {
      const bool is_listed = random.below(3) == 0;
      const bool is_set = random.below(10) == 0;
      if (is_listed) bits[j / 64] |= std::uint64_t{1} << j % 64;
      if (is_set) set.add(j);
      if (is_listed && is_set) expected.push_back(j);
    }
    sdnn::testing::on_every_instruction_set([&](auto level) {
      constexpr std::size_t kSpare = 2;  // items behind the results that may be overwritten
      std::vector<std::uint32_t> out(64 * n_words + kSpare);
      out.resize(static_cast<std::size_t>(
          intersect_bits(bits.data(), set.words(), n_words, out.data()) - out.data()));
      EXPECT_EQ(out, expected) << level;
    });
  }
}

}  // namespace
}  // namespace sdnn::approximators
