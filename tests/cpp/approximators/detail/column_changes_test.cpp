#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/approximators/detail/column_sums.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

core::AlignedBuffer<std::int8_t> random_block(core::Random& random, std::size_t n_columns) {
  core::AlignedBuffer<std::int8_t> block(n_columns * kBlockUnits);
  const std::uint64_t largest = random.below(128);
  for (std::int8_t& byte : block.span()) {
    byte = static_cast<std::int8_t>(static_cast<int>(random.below(2 * largest + 1)) -
                                    static_cast<int>(largest));
  }
  return block;
}

TEST(ColumnChanges, AreAddedToTheColumnsListed) {
  testing::on_every_instruction_set([](std::string_view level) {
    core::Random random(1, core::Stream::weights);
    for (int problem = 0; problem < 200; ++problem) {
      const std::size_t n_columns = 1 + random.below(30);
      auto block = random_block(random, n_columns);
      auto expected = block;
      detail::Bytes change;
      for (auto& byte : change) byte = static_cast<std::int8_t>(random.below(256));
      std::vector<std::uint32_t> columns;
      for (std::uint32_t j = 0; j < n_columns; ++j) {
        if (random.below(2) == 0) columns.push_back(j);
      }
      for (const std::uint32_t j : columns) {
        for (std::size_t i = 0; i < kBlockUnits; ++i) {
          auto& byte = expected[j * kBlockUnits + i];
          byte = static_cast<std::int8_t>(byte + change[i]);
        }
      }
      add_to_columns(block.data(), columns.data(), columns.size(), change);
      ASSERT_TRUE(std::ranges::equal(block.span(), expected.span())) << level;
    }
  });
}

TEST(ColumnChanges, FindTheLargestMagnitudeOfEachUnitsBytes) {
  testing::on_every_instruction_set([](std::string_view level) {
    core::Random random(2, core::Stream::weights);
    for (int problem = 0; problem < 200; ++problem) {
      const std::size_t n_columns = 1 + random.below(30);
      const auto block = random_block(random, n_columns);
      detail::Bytes expected{};
      for (std::size_t at = 0; at < block.size(); ++at) {  // column by column
        auto& largest = expected[at % kBlockUnits];
        largest = static_cast<std::int8_t>(std::max<int>(largest, std::abs(block[at])));
      }
      detail::Bytes largest;
      find_largest_bytes(block.data(), n_columns, largest);
      ASSERT_EQ(largest, expected) << level;
    }
  });
}

}  // namespace
}  // namespace sdnn::approximators
