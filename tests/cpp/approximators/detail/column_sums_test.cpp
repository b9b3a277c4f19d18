#include "sdnn/approximators/detail/column_sums.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "instruction_sets.hpp"
#include "sdnn/core/detail/aligned_buffer.hpp"
#include "sdnn/core/random.hpp"

namespace sdnn::approximators {
namespace {

using Sums = std::array<std::int32_t, kBlockUnits>;

struct Problem {
  core::AlignedBuffer<std::int8_t> block;
  std::vector<std::uint32_t> columns;
  int group;   // the number of weights whose sum fits into a byte
  int factor;  // of the sum of all columns, which is added to `start`
  Sums start;
};

// Weights are up to 127 / group in size; in a quarter of the problems all have that size. Columns
// repeat, and there are many in one of twenty problems. The last column is 0 in all units.
Problem random_problem(core::Random& random) {
  static constexpr int kGroups[] = {1, 2, 4};
  const std::size_t n_columns = 1 + random.below(40);
  static constexpr int kFactors[] = {1, -1, 128, -128};
  Problem p{core::AlignedBuffer<std::int8_t>((n_columns + 1) * kBlockUnits),
            {},
            kGroups[random.below(3)],
            kFactors[random.below(4)],
            {}};
  const int largest = 127 / p.group;
  const bool extreme = random.below(4) == 0;
  for (std::int8_t& w : p.block.span().first(n_columns * kBlockUnits)) {
    const int drawn = static_cast<int>(random.below(static_cast<std::uint64_t>(2 * largest + 1)));
    w = static_cast<std::int8_t>(extreme ? largest : drawn - largest);
  }
  const std::size_t n = random.below(random.below(20) == 0 ? 1500 : 24);
  for (std::size_t c = 0; c < n; ++c) {
    p.columns.push_back(static_cast<std::uint32_t>(random.below(n_columns)));
  }
  for (auto& sum : p.start) sum = static_cast<std::int32_t>(random.below(2001)) - 1000;
  return p;
}

Sums plain_sums(const Problem& p) {
  Sums sums = p.start;
  for (const std::uint32_t column : p.columns) {
    for (std::size_t i = 0; i < kBlockUnits; ++i) {
      sums[i] += p.factor * p.block[column * kBlockUnits + i];
    }
  }
  return sums;
}

// Sums of listed columns, times a factor, are added in calls of at most kMost columns.
TEST(ColumnSums, EqualPlainSumsOn100000RandomProblemsOnEveryInstructionSet) {
  testing::on_every_instruction_set([](auto level) {
    core::Random random(1, core::Stream::weights);
    for (int problem = 0; problem < 100000; ++problem) {
      const Problem p = random_problem(random);
      Sums sums = p.start;
      const std::size_t zeros = p.block.size() / kBlockUnits - 1;  // the last column is 0
      std::span<const std::uint32_t> left = p.columns;
      do {
        const auto columns = left.first(std::min(ColumnPlaces::kMost, left.size()));
        left = left.subspan(columns.size());
        add_columns(p.block.data(), ColumnPlaces(columns, zeros), p.group, p.factor, sums.data());
      } while (!left.empty());
      ASSERT_EQ(sums, plain_sums(p)) << level << ", problem " << problem;
    }
  });
}

}  // namespace
}  // namespace sdnn::approximators
